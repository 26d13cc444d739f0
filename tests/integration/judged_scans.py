"""Parts to be scanned by any source, and what a run says of them."""

import itertools
import threading
from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

from cmmlink.events import Counts, Event, Judged, RunFinished, RunStarted
from cmmlink.pipeline import RunOutcome, run_inspection
from inspection import LiveInspection, NominalProfile, NurbsCurve, SectionPlane, ToleranceZone, Verdict, discretize
from inspection.methods import FitName
from tests.cmmlink.oval_part import oval_profile
from tests.inspection import profiles
from tests.integration.encoded_scans import Source, Transcript, decode, placed
from tests.integration.listed import Listed
from tests.integration.machine_scans import EVERY_SOURCE

Array = NDArray[np.float64]

COUNT = 180
ZONE = ToleranceZone(-0.05, 0.05)
DEFECT_MM = 0.4
BED_MM = 60.0  # length of the part that is fed under a distance sensor
STEP_MM = BED_MM / (COUNT - 1)
XY = SectionPlane(np.zeros(3), np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0]))
XZ = SectionPlane(np.zeros(3), np.array([1.0, 0.0, 0.0]), np.array([0.0, -1.0, 0.0]))


@cache
def profile_of(flat: bool) -> NominalProfile:
    return discretize(_bed(), samples=600, material="right") if flat else oval_profile()


def _bed() -> NurbsCurve:
    """A wavy surface as the graph of a spline: its parameter is x, as the control points stand at the Greville abscissae."""
    knots = np.concatenate([[0.0] * 3, np.linspace(0.0, BED_MM, 13), [BED_MM] * 3])
    greville = np.array([knots[i + 1 : i + 4].mean() for i in range(len(knots) - 4)])
    return NurbsCurve(3, np.column_stack([greville, 25.0 + 3.0 * np.sin(greville / 8.0)]), knots)


@cache
def _feet(flat: bool) -> tuple[Array, Array]:
    """Where the points are taken (n, 2), and the direction in which a deviation moves them (n, 2): that of the beam, or outward."""
    curve = profile_of(flat).curve
    if flat:
        return curve.point(np.linspace(0.0, BED_MM, COUNT)), np.tile([0.0, 1.0], (COUNT, 1))
    u = profiles.even_in_arc_length(curve, COUNT)
    return curve.point(u), -profiles.left_normal(curve, u)


def scan_of(source: Source, first: int = 0, stop: int = 0) -> Array:
    """Points (n, 3) of a good part; rows first .. stop - 1 lie on a step that no zone holds."""
    feet, out = _feet(source.flat)
    rows = np.arange(COUNT)
    form = 0.01 * np.sin(6 * np.pi * rows / COUNT) + DEFECT_MM * ((rows >= first) & (rows < stop))
    return np.column_stack([feet + form[:, None] * out, np.zeros(COUNT)])


@dataclass(frozen=True, slots=True)
class Said:
    """What a run said. `conforms` is exit status 0; `counts_ok` that every count of it added up and none was negative."""

    outcome: RunOutcome
    counts_ok: bool

    @property
    def verdict(self) -> Verdict:
        return self.outcome.result.verdict if self.outcome.result else Verdict.UNCERTAIN

    @property
    def conforms(self) -> bool:
        return self.verdict == Verdict.CONFORM and self.outcome.failure is None

    @property
    def missing(self) -> bool:
        """Whether anything is known to be missing, but for what came twice."""
        counts = self.outcome.counts
        twice = sum(number for reason, number in counts.rejected_by_reason.items() if "repeated" in reason or "older than" in reason)
        return bool(counts.lost or counts.damaged_bytes or counts.rejected > twice)


def judged(source: Listed, flat: bool = False, upright: bool = False, fit: FitName = "none", coverage_min: float = 0.95) -> Said:
    """Carry out a run."""
    events: list[Event] = []
    live = LiveInspection(
        profile_of(flat), ZONE, fit=fit, section=XZ if upright else XY, coverage_min=coverage_min, provisional=fit != "none"
    )
    ticks = itertools.count()
    outcome = run_inspection(
        source,
        live,
        [events.append],
        RunStarted("part", "", "", "list", simulated=True),
        buffer_points=1000,
        clock=lambda: float(next(ticks)),
        stop=threading.Event(),
    )
    told = [event.counts for event in events if isinstance(event, Judged | RunFinished)]
    return Said(outcome, all(map(_adds_up, told)))


def _adds_up(counts: Counts) -> bool:
    whole = counts.received == counts.judged + counts.rejected + counts.pending
    return whole and min(counts.received, counts.judged, counts.rejected, counts.pending, counts.lost, counts.damaged_bytes) >= 0


def judge(name: str, transcript: Transcript, fit: FitName = "none", cuts: np.random.Generator | None = None, count: int = COUNT) -> Said:
    """What a run says of what passed over the wire of a source."""
    source = EVERY_SOURCE[name]
    return judged(placed(source, decode(source, transcript, count, cuts), STEP_MM), source.flat, source.upright, fit)
