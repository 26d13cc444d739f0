"""The last qualification that was made here, and whether the installation is still the one that it was made on.

Whatever came of it is kept, a failed one like one that passed: it takes the place of the one before. One that was broken off is
none, and leaves the one before in its place. Results and reports name it; where none was made they name none, and nothing is looked for.
"""

import json
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Literal

from cmmlink.installation import Installation, installation_here, station_folder

QualificationResult = Literal["passed", "failed"]
_LAST = "last.json"


@dataclass(frozen=True, slots=True)
class LastQualification:
    """What is known of a qualification that was made.

    date   : when it began, in UTC, like 2026-03-14T15:09:26.000Z
    outside: the kinds of numbers that lay outside their limits; none where it passed
    certificate_sha256 : the hash of the contents of its certificate
    certificate : the file that it was written to
    """

    date: str
    result: QualificationResult
    outside: Sequence[str]
    certificate_sha256: str
    certificate: str
    installation: Installation

    def changes(self, now: Installation) -> list[str]:
        """The names of what is not as it was when it was made."""
        return now.changes_since(self.installation)

    def words(self, changes: Sequence[str]) -> str:
        """What came of it, and whether it still holds."""
        came = "passed" if self.result == "passed" else f"failed ({', '.join(self.outside)})"
        if changes:
            return f"{came} on {self.date[:10]}; the installation changed since ({_some(changes)})"
        return f"{came} on {self.date[:10]}; the installation is the same"

    def warning(self, changes: Sequence[str]) -> str:
        """What has to stand beside a verdict; nothing where it passed and still holds."""
        anew = "`cmmlink qualify` makes a new one"
        if changes:
            return f"the installation changed since its qualification of {self.date[:10]} ({_some(changes)}); {anew}"
        if self.result == "failed":
            return f"the qualification of this installation failed on {self.date[:10]} ({', '.join(self.outside)}); {anew}"
        return ""


def keep_as_last(made: LastQualification, folder: Path) -> None:
    """Let a qualification be the last one. Raises OSError where that cannot be written."""
    folder.mkdir(parents=True, exist_ok=True)
    new = folder / f"{_LAST}.new"
    new.write_text(json.dumps(asdict(made), indent=1), encoding="utf-8")
    new.replace(folder / _LAST)


def last_qualification(folder: Path) -> LastQualification | None:
    """The last qualification that is kept in a folder; None where there is none that can be read."""
    with suppress(OSError, ValueError, TypeError, KeyError):
        told = json.loads((folder / _LAST).read_bytes())
        return LastQualification(**{**told, "installation": Installation(**told["installation"])})
    return None


def qualification_here() -> tuple[dict[str, Any] | None, str]:
    """What results say of the last qualification, and what is to be warned of: nothing where none was made, or where it still holds."""
    last = last_qualification(station_folder())
    if last is None:
        return None, ""
    changes = last.changes(installation_here())
    told: Mapping[str, Any] = {
        "date": last.date,
        "result": last.result,
        "certificate_sha256": last.certificate_sha256,
        "same_installation": not changes,
        "words": last.words(changes),
    }
    return dict(told), last.warning(changes)


def _some(names: Sequence[str], most: int = 3) -> str:
    """The first few of some names, and how many more there are."""
    return ", ".join(names[:most]) + (f" and {len(names) - most} more" if len(names) > most else "")
