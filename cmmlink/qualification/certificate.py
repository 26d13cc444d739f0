"""The certificate of a qualification: what was found on which installation, when, and whether it is inside every limit."""

import hashlib
import json
import os
import platform
import tempfile
import time
from collections.abc import Callable, Iterable
from datetime import datetime
from pathlib import Path
from typing import Any

from cmmlink.installation import Installation, versions_installed
from cmmlink.last_qualification import LastQualification
from cmmlink.qualification.budget import FoundError, budget_of, kinds_outside
from cmmlink.qualification.cases import errors_of_case
from cmmlink.qualification.wire import scan_on_the_wire
from cmmlink.reference import ReferenceCase, write_reference
from cmmlink.words import utc_words

WIRE_POINTS = 15_000
_SCHEMA = "urn:cmmlink:qualification:1"


def qualify(
    cases: Iterable[ReferenceCase],
    now: Callable[[], datetime],
    read: Callable[[], Installation],
    *,
    wire_points: int = WIRE_POINTS,
    on_case: Callable[[str], None] = lambda name: None,
) -> tuple[dict[str, Any], Installation]:
    """Run a reference set on this installation. Returns the certificate as JSON holds it, and the installation that it was made on.

    now         : date and time of day
    read        : reads the installation, once all has been judged: what had to be compiled for that is part of it
    wire_points : of the scan from the wire to the verdict
    on_case     : called with the name of each case before it is judged
    """
    began, start_s = now(), time.monotonic()
    found: list[FoundError] = []
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        on_case("the reference set")
        judged = list(cases)
        sums = write_reference(folder / "set", judged)
        for case in judged:
            on_case(case.name)
            found += errors_of_case(case, folder / "set")
        on_case("wire to verdict")
        wire = scan_on_the_wire(folder, wire_points)
    found += wire.errors
    installation = read()
    budget = budget_of(found)
    outside = kinds_outside(budget)
    certificate = {
        "schema": _SCHEMA,
        "date": utc_words(began),
        "result": "failed" if outside else "passed",
        "outside": outside,
        "duration_s": round(time.monotonic() - start_s, 3),
        "set": {"cases": len(judged), "files": len(sums), "sha256": _hash_of(sums)},
        "budget": [line.document() for line in budget],
        "wire": wire.document(),
        "problems": list(dict.fromkeys(one.problem for one in found if one.problem)),
        "software": versions_installed(),
        "machine": {"name": platform.node(), "system": platform.platform(), "processors": os.cpu_count()},
        "installation": {"sha256": installation.sha256, "parts": dict(installation.parts)},
    }
    return {**certificate, "certificate_sha256": _hash_of(certificate)}, installation


def is_unaltered(certificate: dict[str, Any]) -> bool:
    """Whether a certificate says what it said when it was made, by the hash that it holds of all else in it."""
    said = {key: value for key, value in certificate.items() if key != "certificate_sha256"}
    return certificate.get("certificate_sha256") == _hash_of(said)


def last_from(certificate: dict[str, Any], installation: Installation, file: Path) -> LastQualification:
    """What is kept of a certificate, so that results can name it."""
    told = {key: certificate[key] for key in ("date", "result", "outside", "certificate_sha256")}
    return LastQualification(**told, certificate=str(file), installation=installation)


def _hash_of(document: Any) -> str:
    """The SHA-256 of a document of JSON, spelled in the one way: keys sorted, no blanks."""
    return hashlib.sha256(json.dumps(document, sort_keys=True, separators=(",", ":")).encode()).hexdigest()
