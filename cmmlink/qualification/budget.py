"""The error budget of a qualification: every number that was found against its truth, by kind, each kind with a limit and its reason."""

import math
import statistics
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

from cmmlink.qualification_keys import QualifiedKind
from cmmlink.result_json import number

_PICOMETRE = "a picometre: no machine resolves it, and it is ten thousand times the round-off of coordinates of a metre"
_FIT = "ten picometres: a fit ends when no point moves by more than one"
_RIGHT = "a verdict is right or wrong"


@dataclass(frozen=True, slots=True)
class Quantity:
    """Numbers of one kind that are held against one limit.

    limit  : how far the largest error may go
    reason : why that limit
    """

    kind: QualifiedKind
    name: str
    unit: str
    limit: float
    reason: str

    @property
    def limit_words(self) -> str:
        """The limit with its unit."""
        return f"{self.limit:g}" if self.unit == "count" else f"{self.limit:g} {self.unit}"


DEVIATION = Quantity("deviation", "deviation of a point at a known pose", "mm", 1e-9, _PICOMETRE)
RMS = Quantity("deviation", "root mean square of the deviations", "mm", 1e-9, "that of each deviation")
POSE = Quantity("pose", "a point from where the best fit brings it", "mm", 1e-8, _FIT)
MINIMUM_ZONE = Quantity("zone", "width of the minimum zone", "mm", 1e-8, _FIT)
CONSUMPTION = Quantity(
    "zone", "least consumption of the tolerance", "share", 2.5e-7, "ten picometres in a zone of 0.04 mm, the narrowest of the set"
)
PART_VERDICTS = Quantity("zone", "wrong verdicts of parts", "count", 0, _RIGHT)
POINT_VERDICTS = Quantity("zone", "wrong verdicts of points at a known pose", "count", 0, _RIGHT)
EDGE_VERDICTS = Quantity("zone", "wrong verdicts 10 pm inside or outside of a limit", "count", 0, "a zone is as wide as it is stated")
FILTERED = Quantity("filter", "deviation behind a filter", "mm", 1e-6, "a nanometre: a filter ends where its weights fall below 2e-6")
LENGTHS = Quantity(
    "characteristics", "chords, radii, thicknesses and displacements", "mm", 1e-5, "ten nanometres: a section is drawn through its points"
)
BENDS = Quantity(
    "characteristics", "radii by curvature, largest thicknesses", "mm", 1e-4, "0.1 um: they hang on how the drawn section bends"
)
ANGLES = Quantity("characteristics", "angles of the section", "deg", 1e-8, "ten picometres at the end of a chord of 60 mm")
LOST = Quantity("wire to verdict", "points lost, damaged or rejected", "count", 0, "what a device sends is judged")
ARRIVED = Quantity("wire to verdict", "a point from where it was sent", "mm", 1e-6, "the last digit that the line carries")
WIRE_DEVIATION = Quantity("wire to verdict", "deviation of a point that arrived", "mm", 1e-9, _PICOMETRE)
WIRE_VERDICTS = Quantity("wire to verdict", "wrong verdicts of points", "count", 0, _RIGHT)
QUANTITIES = (
    DEVIATION, RMS, POSE, MINIMUM_ZONE, CONSUMPTION, PART_VERDICTS, POINT_VERDICTS, EDGE_VERDICTS, FILTERED, LENGTHS, BENDS, ANGLES,
    LOST, ARRIVED, WIRE_DEVIATION, WIRE_VERDICTS,
)  # fmt: skip


@dataclass(frozen=True, slots=True)
class FoundError:
    """By how much something that was found is not what is true, at a case of the set. Infinite where nothing was found.

    values : how many numbers it is the largest of; problem : why nothing was found
    """

    quantity: Quantity
    error: float
    case: str
    values: int = 1
    problem: str = ""


@dataclass(frozen=True, slots=True)
class BudgetLine:
    """One quantity over all cases. The median is that of the largest errors of the cases."""

    quantity: Quantity
    values: int
    cases: int
    largest: float
    median: float
    worst_case: str

    @property
    def inside(self) -> bool:
        """Whether the largest error is inside the limit; never of what was not looked at."""
        return self.values > 0 and self.largest <= self.quantity.limit

    def document(self) -> dict[str, Any]:
        """The line as the certificate holds it."""
        of = self.quantity
        return {
            "kind": of.kind,
            "quantity": of.name,
            "unit": of.unit,
            "values": self.values,
            "cases": self.cases,
            "largest": number(self.largest),
            "median": number(self.median),
            "worst_case": self.worst_case,
            "limit": float(of.limit),
            "inside": self.inside,
            "reason": of.reason,
        }


def budget_of(found: Iterable[FoundError]) -> list[BudgetLine]:
    """Every quantity, in the order of the kinds; one of which nothing was looked at is outside, since nothing shows that it is inside."""
    by_quantity: dict[Quantity, list[FoundError]] = {quantity: [] for quantity in QUANTITIES}
    for one in found:
        by_quantity[one.quantity].append(one)
    return [_line(quantity, errors) for quantity, errors in by_quantity.items()]


def kinds_outside(budget: Sequence[BudgetLine]) -> list[QualifiedKind]:
    """The kinds with a line outside its limit, each once."""
    return list(dict.fromkeys(line.quantity.kind for line in budget if not line.inside))


def _line(quantity: Quantity, errors: Sequence[FoundError]) -> BudgetLine:
    if not errors:
        return BudgetLine(quantity, 0, 0, math.nan, math.nan, "")
    told = [math.inf if math.isnan(one.error) else one.error for one in errors]
    worst = max(range(len(told)), key=told.__getitem__)
    cases = len({one.case for one in errors})
    return BudgetLine(quantity, sum(one.values for one in errors), cases, told[worst], statistics.median(told), errors[worst].case)
