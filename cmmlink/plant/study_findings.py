"""What a study says: the spread of the gauge by characteristic and along the profile, and from it U with its budget.

The budget follows the GUM (JCGM 100:2008): standard uncertainties add up by their squares, those by repeating (type A) have degrees of
freedom, and k comes from the effective ones by the formula of Welch and Satterthwaite (G.4). Which sources a capable measuring process
has, and that a bias which is not corrected counts as a rectangular distribution, is as in VDA volume 5.
"""

import math
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import norm
from scipy.stats import t as t_distribution

from cmmlink.plant.gauge_studies import CrossedStudy, StationStudy, TypeOneStudy, crossed_study, station_study, type_one_study
from cmmlink.plant.study_file import StudiedCharacteristic, Study, StudyRun

Stated = tuple[str, str, float, int | None]  # a source, its type, its standard uncertainty and its degrees of freedom

_COVERED = float(norm.cdf(2) - norm.cdf(-2))  # 95.45 %: what k = 2 covers where the degrees of freedom are many
_FEWEST_REPEATS = 5  # of one part; fewer tell nothing of a spread


@dataclass(frozen=True, slots=True)
class SourceOfU:
    """A line of the budget.

    evaluated : "A" by repeating, "B" by other knowledge
    standard  : its standard uncertainty in the unit of the characteristic
    freedom   : degrees of freedom, None where they are infinite
    share     : of the square of the combined standard uncertainty
    """

    source: str
    evaluated: str
    standard: float
    freedom: int | None
    share: float


@dataclass(frozen=True, slots=True)
class BudgetOfU:
    """The uncertainty of a value: its sources, u, the effective degrees of freedom (None: infinite), k, and U = k u."""

    sources: tuple[SourceOfU, ...]
    standard: float
    freedom: float | None
    factor: float
    expanded: float


@dataclass(frozen=True, slots=True)
class StudyFinding:
    """What was found of one characteristic; `type_one` or `crossed` is None, by the kind of the study."""

    characteristic: StudiedCharacteristic
    type_one: TypeOneStudy | None
    crossed: CrossedStudy | None
    budget: BudgetOfU
    notes: tuple[str, ...]


@dataclass(frozen=True, slots=True, eq=False)
class StudyFindings:
    """What was found by a study.

    parts, operators : names, in the order in which they came
    repeats : measurements of each part by each operator
    along   : spread of the mean deviation in even parts of the profile; of a type-1 study reproducibility and part are zero there
    notes   : what stands beside all of it
    """

    findings: tuple[StudyFinding, ...]
    parts: tuple[str, ...]
    operators: tuple[str, ...]
    repeats: int
    along: StationStudy
    notes: tuple[str, ...]


def findings_of(study: Study) -> StudyFindings:
    """Evaluate a study. Raises ValueError with what it lacks."""
    if not study.runs:
        raise ValueError("the study has no runs yet: `cmmlink study add` adds them")
    if study.kind == "type-1":
        return _type_one(study)
    return _crossed(study)


# --- one part of known value ------------------------------------------------------------------------------------------


def _type_one(study: Study) -> StudyFindings:
    if len(study.runs) < _FEWEST_REPEATS:
        raise ValueError(f"the study has {len(study.runs)} runs; a type-1 study needs at least {_FEWEST_REPEATS}, and 25 are usual")
    parts = _names(study.runs, "part")
    if len(parts) > 1:
        raise ValueError(f"a type-1 study is of one part, and the runs are of {len(parts)}: {', '.join(parts)}")
    findings, notes = [], []
    for one in study.characteristics:
        reference, tolerance = study.references.get(one.name), one.tolerance
        if reference is None or tolerance is None:
            lacks = "no reference value was stated" if reference is None else "it has no upper limit"
            notes.append(f"{one.name} is left out: {lacks}.")
            continue
        found = type_one_study([run.values[one.name] for run in study.runs], reference.value, tolerance)
        sources: list[Stated] = [
            ("repeatability, each time with a registration of its own", "A", found.sigma, found.values - 1),
            ("bias, not corrected", "B", abs(found.bias) / math.sqrt(3), None),
            ("reference value", "B", reference.expanded / 2, None),
        ]
        findings.append(StudyFinding(one, found, None, budget_of([*sources, *_stated(one)]), (*found.notes, *_notes(one))))
    if not findings:
        raise ValueError(f"no characteristic can be studied: {' '.join(notes)} `cmmlink study new --reference NAME=VALUE` states one")
    strips = _strips(study.runs)
    spread = strips.std(axis=0, ddof=1)
    nothing = np.where(np.isfinite(spread), 0.0, np.nan)
    along = StationStudy(spread, nothing, spread, nothing, np.zeros(len(spread), dtype=bool))
    return StudyFindings(tuple(findings), parts, _names(study.runs, "operator"), len(study.runs), along, tuple(notes))


# --- parts crossed with operators ------------------------------------------------------------------------------------


def _crossed(study: Study) -> StudyFindings:
    parts, operators, cells = _cells(study.runs)
    findings = []
    for one in study.characteristics:
        values = [[[run.values[one.name] for run in cells[part, operator]] for operator in operators] for part in parts]
        found = crossed_study(values, one.tolerance)
        reproducibility = found.line("reproducibility")
        sources: list[Stated] = [
            ("repeatability, each time with a registration of its own", "A", found.line("repeatability").sigma, found.freedom),
            ("reproducibility, of operators", "A", reproducibility.sigma, len(operators) - 1),
        ]
        findings.append(StudyFinding(one, None, found, budget_of([*sources, *_stated(one)]), (*found.notes, *_notes(one))))
    runs = [run for part in parts for operator in operators for run in cells[part, operator]]
    repeats = len(runs) // (len(parts) * len(operators))
    strips = _strips(runs)
    along = station_study(strips.reshape(len(parts), len(operators), repeats, strips.shape[1]))
    return StudyFindings(tuple(findings), parts, operators, repeats, along, ())


def _cells(runs: Sequence[StudyRun]) -> tuple[tuple[str, ...], tuple[str, ...], Mapping[tuple[str, str], list[StudyRun]]]:
    """Parts, operators, and the runs of each pair of them. Raises ValueError where the study is not whole yet."""
    cells: defaultdict[tuple[str, str], list[StudyRun]] = defaultdict(list)
    for run in runs:
        cells[run.part, run.operator].append(run)
    parts, operators = _names(runs, "part"), _names(runs, "operator")
    if min(len(parts), len(operators)) < 2:
        few = f"{len(parts)} part{'s' * (len(parts) != 1)} and {len(operators)} operator{'s' * (len(operators) != 1)}"
        raise ValueError(f"a crossed study needs at least 2 parts and 2 operators, and has {few}; 10, 3 and 3 repeats are usual")
    most = max(map(len, cells.values()))
    lacking = [(part, operator, len(cells[part, operator])) for part in parts for operator in operators]
    lacking = [one for one in lacking if one[2] < max(most, 2)]
    if lacking:
        part, operator, count = lacking[0]
        others = f", and so do {len(lacking) - 1} more pairs" if len(lacking) > 1 else ""
        raise ValueError(f"part {part} by operator {operator} has {count} of {max(most, 2)} repeats{others}: every pair needs as many")
    return parts, operators, cells


def _names(runs: Sequence[StudyRun], kind: str) -> tuple[str, ...]:
    """Names of parts or operators in the order in which they came."""
    return tuple(dict.fromkeys(getattr(run, kind) for run in runs))


def _strips(runs: Sequence[StudyRun]) -> NDArray[np.float64]:
    """Mean deviations (runs, parts of the profile), NaN where a run saw nothing."""
    return np.array([[math.nan if value is None else value for value in run.strip_mm] for run in runs], dtype=np.float64)


# --- the budget ------------------------------------------------------------------------------------------------------


def budget_of(sources: Sequence[Stated]) -> BudgetOfU:
    """The budget of sources, each with its name, type, standard uncertainty and degrees of freedom (None: infinite)."""
    total = math.hypot(*(standard for _, _, standard, _ in sources))
    lines = tuple(SourceOfU(*one, (one[2] / total) ** 2 if total else 0.0) for one in sources)
    weight = sum(line.standard**4 / line.freedom for line in lines if line.freedom)
    freedom = total**4 / weight if weight else None
    factor = 2.0 if freedom is None else float(t_distribution.ppf((1 + _COVERED) / 2, freedom))
    return BudgetOfU(lines, total, freedom, factor, factor * total)


def _stated(one: StudiedCharacteristic) -> Iterator[Stated]:
    """What the plan states of sources that repeating does not show."""
    for source, standard in one.stated.items():
        yield source, "B", standard, None


def _notes(one: StudiedCharacteristic) -> tuple[str, ...]:
    if one.stated:
        return ()
    told = "The plan states no budget of the uncertainty: device, probe and temperature count for nothing here, and U is too small by them."
    return (told,)
