"""A study of the measuring system as a file: which runs belong to it, and what each of them found.

The file holds the values themselves, beside the hash that ends the record of each run: it can be read, sent on and evaluated without the
records, and `cmmlink verify` proves the runs that it names.
"""

import json
import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, Literal, get_args

StudyKind = Literal["type-1", "crossed"]
STUDY_SCHEMA = 1


@dataclass(frozen=True, slots=True)
class StudiedCharacteristic:
    """What is studied, and what it is uncertain by for reasons that repeating does not show.

    lower, upper : limits in its unit, None where there is none
    stated       : standard uncertainties by their source, from the budget of the plan; empty where it states none
    """

    name: str
    type: str
    unit: str
    lower: float | None
    upper: float | None
    stated: Mapping[str, float] = field(default_factory=dict)

    @property
    def tolerance(self) -> float | None:
        """Width of its zone; of a one-sided form deviation, which begins at zero, its limit."""
        if self.upper is None:
            return None
        return self.upper - (self.lower if self.lower is not None else 0.0)

    @property
    def judged_by(self) -> tuple[str, str, str, float | None, float | None]:
        """What has to be the same in all runs of a study."""
        return self.name, self.type, self.unit, self.lower, self.upper


@dataclass(frozen=True, slots=True)
class Reference:
    """The value of the one part of a type-1 study, from a better measurement, and its expanded uncertainty (k = 2)."""

    value: float
    expanded: float = 0.0


@dataclass(frozen=True, slots=True)
class StudyRun:
    """One measurement: `part` and `operator` are the names it counts under, `strip_mm` the mean deviations along the profile."""

    run: str
    chain_sha256: str
    measured_at: str
    part: str
    operator: str
    values: Mapping[str, float]
    strip_mm: tuple[float | None, ...]


@dataclass(frozen=True, slots=True)
class Study:
    """A study as far as it has come. `length_mm` is that of the nominal, 0 as long as no run was added."""

    kind: StudyKind
    name: str
    references: Mapping[str, Reference] = field(default_factory=dict)
    length_mm: float = 0.0
    characteristics: tuple[StudiedCharacteristic, ...] = ()
    runs: tuple[StudyRun, ...] = ()

    def document(self) -> dict[str, Any]:
        """The study as its file holds it."""
        return {"schema": STUDY_SCHEMA, **asdict(self)}


def read_study(path: Path) -> Study:
    """The study of a file. Raises ValueError with what is wrong, OSError where the file cannot be read."""
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
    except ValueError as error:
        raise ValueError(f"{path}: no study: {error}; `cmmlink study new {path}` makes one") from None
    try:
        return _study_in(found)
    except (KeyError, TypeError, AttributeError, ValueError) as error:
        told = f"{error} is missing" if isinstance(error, KeyError) else str(error)
        raise ValueError(f"{path}: no study of this version of cmmlink: {told}; `cmmlink study new` makes one") from None


def _study_in(found: Any) -> Study:
    if found["schema"] != STUDY_SCHEMA:
        raise ValueError(f"schema {found['schema']}, and this version reads {STUDY_SCHEMA}")
    if found["kind"] not in get_args(StudyKind):
        raise ValueError(f"kind {found['kind']!r}; expected {' or '.join(get_args(StudyKind))}")
    runs = [StudyRun(**one | {"values": _numbers(one["values"]), "strip_mm": tuple(one["strip_mm"])}) for one in found["runs"]]
    return Study(
        kind=found["kind"],
        name=str(found["name"]),
        references={name: Reference(**_numbers(one)) for name, one in found["references"].items()},
        length_mm=float(found["length_mm"]),
        characteristics=tuple(StudiedCharacteristic(**one) for one in found["characteristics"]),
        runs=tuple(runs),
    )


def _numbers(given: Mapping[str, Any]) -> dict[str, float]:
    """Numbers by their names, all finite."""
    numbers = {str(name): float(value) for name, value in given.items()}
    if wrong := [name for name, value in numbers.items() if not math.isfinite(value)]:
        raise ValueError(f"{wrong[0]} is no finite number")
    return numbers


def study_text(study: Study) -> str:
    """The text of its file."""
    return json.dumps(study.document(), indent=1, allow_nan=False) + "\n"
