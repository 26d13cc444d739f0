"""Points in, registration state and verdicts out, while the scan runs: the one stateful part of the inspection.

Without a datum the pose is sought on the growing prefix of the scan. Once one pose fits the prefix clearly better than any
other, verdicts are given provisionally; every further point refines the pose at constant cost (accumulated normal
equations), and the whole is fitted anew when the number of points has doubled. `finish` registers all points together and
judges every one at that settled pose.

A long scan takes constant memory for this: from a number of points on the whole is fitted by a choice of them, and points that were
judged are not judged again before the end.

State moves only at fixed point numbers, never at the edges of batches: the same points in any batches give the same result.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from inspection.characteristics.characteristic import Characteristic, SectionCharacteristic
from inspection.cloud import MANY, Cloud
from inspection.compensation import Compensation
from inspection.conclusion import Missing
from inspection.evaluation.evaluate import Evaluation, evaluate
from inspection.evaluation.so_far import EvaluationSoFar, ScanSoFar, ScanWatch
from inspection.kernels import Room, compile_projection, fit_compiled_beside, is_fit_compiled
from inspection.methods import FitName, Method, RuleName, WeightName
from inspection.nominal import NominalProfile
from inspection.pose_track import PoseTrack, seek_pose
from inspection.prefix import Prefix, PrefixSearch, PrefixWatch
from inspection.profile_uncertainty import ProfileUncertainty, StatedUncertainty, uncertainty_along
from inspection.registration import Registration
from inspection.result import InspectionResult
from inspection.rigid import RigidTransform
from inspection.scan_rows import BLOCK, ScanRows
from inspection.section import SectionPlane
from inspection.settled import settle
from inspection.terms import Terms
from inspection.tolerance import ToleranceZone

Array = NDArray[np.float64]
State = Literal["seeking", "provisional", "settled"]

_SEEK_GROWTH = 1.3  # the pose is sought again once the prefix has grown by this factor
_REFIT_GROWTH = 2.0  # and fitted anew once it has grown by this one


@dataclass(frozen=True, slots=True, eq=False)
class LiveUpdate:
    """What one batch changed. Arrays cover the received points first .. stop - 1; rejected points carry NaN and NOT_JUDGED.

    state       : seeking (no verdicts yet), provisional (the pose still moves), settled (a datum: final at once)
    verdicts    : provisional ones are UNCERTAIN where the pose, as far as it is expected to move yet, could change them, and always
                  for a minimum zone. They are no proof: form that is still to come may move the pose farther
    can_move_mm : a bound on how far a deviation can still move: 0 when settled, else NaN, since none is known
    """

    state: State
    first: int
    stop: int
    actual_mm: Array
    foot_mm: Array
    station_mm: Array
    deviation_mm: Array
    verdicts: NDArray[np.int8]
    can_move_mm: float
    registration: Registration | None


class LiveInspection:
    """Inspection of one scan of one section.

    nominal, zone   : what the points are held against
    datum           : pose known beforehand; verdicts are then final at once. Without it `fit` finds the pose.
    fit             : "best-fit" (least squares), "minimum-zone" (Chebyshev), or "none" (points are in nominal coordinates)
    method          : projection that gives the deviations
    tip_radius_mm   : points are centres of a ball of this radius
    section         : plane for points in space (m, 3); off_section_max_mm rejects points farther from it
    coverage_min    : share of the nominal's length below which conformity is not proven
    reject_outliers : find gross outliers in the final registration, farther off than six median deviations and half the zone, and
                      reject them. What was rejected was not judged, and from far off a defect looks like dust: conformity is
                      then not proven
    rule, weights   : what decides where there is no datum, and how points count in the best fit (see `Terms`)
    gap_max_mm, end_allowance_mm, allow_unseen_mm : what may be unmeasured, lie beyond an open end, or be missing before conformity is
                      not proven any more (see `Terms`)
    uncertainty     : a budget of the uncertainty; the U of the zone is then its largest along the profile, and the zone comes without one
    compensation    : takes the growth of a warm part out of every point before anything else is done with it
    characteristics : what is evaluated at the end, each with a verdict of its own; none stands for the profile alone
    numbers         : what is found at the end as well, without a part in the verdict, for what stands on several inspections
    evaluation      : how the characteristics are found at the end, where they may be known already
    provisional     : False seeks no pose before `finish`, for points that are all there from the start; the result is the same
    room            : gives the arrays that grow with the scan, like numpy.empty: about 60 bytes a point until `finish` returns
    """

    def __init__(
        self,
        nominal: NominalProfile,
        zone: ToleranceZone,
        *,
        datum: RigidTransform | None = None,
        fit: FitName = "best-fit",
        method: Method = "exact",
        tip_radius_mm: float = 0.0,
        section: SectionPlane | None = None,
        off_section_max_mm: float | None = None,
        coverage_min: float = 0.0,
        reject_outliers: bool = False,
        rule: RuleName = "minimum-zone",
        weights: WeightName = "arc-length",
        gap_max_mm: float | None = None,
        end_allowance_mm: float | None = None,
        allow_unseen_mm: float | None = None,
        uncertainty: StatedUncertainty | None = None,
        compensation: Compensation | None = None,
        characteristics: Sequence[Characteristic] = (),
        numbers: Sequence[SectionCharacteristic] = (),
        evaluation: Evaluation = evaluate,
        provisional: bool = True,
        room: Room = np.empty,
    ) -> None:
        along = None
        if uncertainty is not None:
            if zone.uncertainty_mm:
                raise ValueError(f"either a zone with an uncertainty ({zone.uncertainty_mm:g} mm) or a budget of it, not both")
            along = uncertainty_along(nominal, uncertainty, RigidTransform.identity() if datum is None and fit == "none" else datum)
            zone = replace(zone, uncertainty_mm=along.largest_mm)
        self._compensation = compensation
        self._terms = Terms(
            nominal=nominal,
            zone=zone,
            datum=datum,
            fit=fit,
            method=method,
            tip_radius_mm=tip_radius_mm * (compensation.factor if compensation is not None else 1.0),  # the ball shrinks with its centre
            off_section_max_mm=float("inf") if off_section_max_mm is None else off_section_max_mm,
            coverage_min=coverage_min,
            reject_outliers=reject_outliers,
            rule=rule,
            weights=weights,
            gap_max_mm=gap_max_mm,
            end_allowance_mm=end_allowance_mm,
            allow_unseen_mm=allow_unseen_mm,
            uncertainty=along,
        )
        self._characteristics, self._numbers = tuple(characteristics), tuple(numbers)
        self._known_pose = self._terms.known_pose
        self._plane = section or SectionPlane(np.zeros(3), np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0]))
        self._provisional, self._evaluation = provisional, evaluation
        self._kept = ScanRows(room=room)
        self._handed_over = False  # the rows belong to a result by now
        self._next_fit = BLOCK  # received points at which the pose is sought, or fitted anew
        self._track: PoseTrack | None = None
        self._watch, self._scan_watch = PrefixWatch(self._terms), ScanWatch(self._terms)

    @property
    def state(self) -> State:
        """Where the registration stands."""
        if self._known_pose is not None:
            return "settled"
        return "seeking" if self._track is None else "provisional"

    @property
    def received(self) -> int:
        """Points taken in so far."""
        return self._kept.count

    @property
    def judged(self) -> int:
        """Points that have a verdict at this moment."""
        return self._kept.judged

    @property
    def rejected_by_reason(self) -> dict[str, int]:
        """Points rejected so far, by reason."""
        return self._kept.rejected_by_reason

    def add(self, points_mm: ArrayLike) -> LiveUpdate:
        """Take in section points (m, 2) or machine points (m, 3), in scan order."""
        points = np.asarray(points_mm, dtype=np.float64)
        if points.ndim != 2 or points.shape[1] not in (2, 3):
            raise ValueError(f"points must have shape (m, 2) or (m, 3), got {points.shape}")
        if self._compensation is not None:
            points = self._compensation.apply(points, self._plane)
        rows, pose, first = self._rows, self._pose, self._rows.count
        taken = (_of_one_type(points), self._plane, self._terms.off_section_max_mm)
        if pose is not None and len(points) <= BLOCK - (first % BLOCK if self._known_pose is None else 0):
            rows.take_in_judged(*taken, pose, self._terms, self._reserve_mm)
        else:
            rows.take_in(*taken)
        if self._known_pose is not None or not self._provisional:
            self._judge_to(first + len(points))
            return self._update(first)
        changed_from = first
        for stop in range(first - first % BLOCK + BLOCK, first + len(points) + BLOCK, BLOCK):
            self._judge_to(min(stop, first + len(points)))
            if rows.count == stop and self._advance():
                changed_from = 0
        return self._update(changed_from)

    def snapshot(self) -> LiveUpdate:
        """Every point received so far, judged at the pose of this moment."""
        self._judge(0, self._rows.count)
        return self._update(0)

    def prefix(self) -> Prefix | None:
        """A copy of the points so far for a `prefix_search`, None where no point looks out of tolerance and without a provisional pose.

        None as well where outliers are rejected, for what looks out may be rejected in the end, and where the U that judges in the end
        is not known yet.
        """
        not_final = self._terms.at_best_fit and self._terms.uncertainty is not None
        if self._track is None or self._terms.reject_outliers or not_final:
            return None
        return self._watch.prefix(self._rows, self._track.pose, self._track.slide_mm())

    def prefix_search(self) -> PrefixSearch:
        """A search for the proof that the part will fail, on the terms of this inspection. It may run in another thread."""
        return PrefixSearch(self._terms)

    def so_far(self) -> ScanSoFar | None:
        """A copy of few points that tell of all so far, for an `evaluation_so_far`; None without a pose."""
        pose = self._track.pose if self._track is not None else self._known_pose
        return None if pose is None else self._scan_watch.so_far(self._rows, pose)

    def evaluation_so_far(self) -> EvaluationSoFar:
        """What evaluates the characteristics while the scan still runs, on the terms of this inspection. It may run in another thread."""
        return EvaluationSoFar(self._characteristics, self._terms)

    @property
    def uncertainty(self) -> ProfileUncertainty | None:
        """Of the deviations along the profile, as far as it is known before the end; None where no budget was stated."""
        return self._terms.uncertainty

    def finish(self, complete: bool = True, missing: Missing | None = None) -> InspectionResult:
        """Register all points together, judge every one at that pose, evaluate what was asked for, and say the verdict on the part.

        complete : False when the scan was cut short
        missing  : points that are known to be missing before they came here; None for none

        Raises RegistrationError when the points cannot be brought onto the nominal.
        """
        rows, self._handed_over = self._rows, True
        missing = missing or Missing()
        result = settle(rows, self._terms, complete, missing)
        return self._evaluation(self._characteristics, result, self._terms, missing, complete, self._numbers)

    @property
    def _rows(self) -> ScanRows:
        """The rows to work on: those that a result holds stay as they are, and a scan that goes on after it does so with a copy."""
        if self._handed_over:
            self._kept, self._handed_over = self._kept.copy(), False
            self._judge_anew()
        return self._kept

    def _judge(self, first: int, stop: int) -> None:
        """Deviations and verdicts of rows first .. stop - 1 at the pose of this moment, if there is one."""
        pose = self._pose
        if pose is not None:
            self._rows.judge(first, stop, pose, self._terms, self._reserve_mm)

    def _judge_to(self, stop: int) -> None:
        """Let the rows before `stop` count, and judge those of them that do not count yet."""
        first = self._rows.count
        if first < stop:
            self._rows.count = stop
            self._judge(first, stop)

    def _judge_anew(self) -> None:
        """The same of all rows so far; places are kept of the newest alone, so that no memory is taken."""
        rows, pose = self._rows, self._pose
        if pose is not None:
            rows.settle(pose, self._terms, self._reserve_mm, rows.base)
            rows.judge(rows.base, rows.count, pose, self._terms, self._reserve_mm)

    @property
    def _pose(self) -> RigidTransform | None:
        """Where the points lie at this moment, if that is known."""
        return self._track.pose if self._track is not None else self._known_pose

    @property
    def _reserve_mm(self) -> float:
        return self._track.reserve_mm() if self._track is not None else 0.0

    def _advance(self) -> bool:
        """Move the state at a block's end; True when every verdict given so far is replaced."""
        rows, count = self._rows, self._rows.count
        if count < self._next_fit:
            if self._track is not None:
                self._track.refine(rows, count - BLOCK, count)
            return False
        points, sought = rows.usable(), self._track is None
        few = Cloud(points.few(), room=rows.room) if len(points) > MANY else points
        self._track = seek_pose(few, self._terms) if self._track is None else self._track.refit(few)
        self._next_fit = int(count * (_SEEK_GROWTH if self._track is None else _REFIT_GROWTH))
        if self._track is None:
            return False
        if count <= MANY:
            self._judge(0, count)
            return True
        self._track.count_as(len(points))
        if sought:
            self._judge_anew()
        return False

    def _update(self, first: int) -> LiveUpdate:
        rows, stop = self._rows, self._rows.count
        places = slice(first - rows.base, stop - rows.base)
        return LiveUpdate(
            self.state,
            first,
            stop,
            rows.actual[places].copy(),
            rows.foot[places].copy(),
            rows.station[first:stop].copy(),
            rows.deviation[first:stop].copy(),
            rows.verdicts[first:stop].copy(),
            0.0 if self._known_pose is not None else float("nan"),
            self._track.registration if self._track is not None else None,
        )


def _of_one_type(points: Array) -> Array:
    """The points as they are, or a copy where the compiler would take them for another type and compile all anew in mid-scan."""
    flags = points.flags
    return points if flags.c_contiguous and flags.writeable else np.array(points, order="C")


def rehearse(nominal: NominalProfile, method: Method = "exact", reject_outliers: bool = False, unless_compiled: bool = False) -> None:
    """Inspect a made-up scan of the nominal itself, so that every loop it needs is compiled before a real scan begins.

    unless_compiled : leave it where compiled code is on disk, for points that do not come by themselves: they can wait while it is loaded

    Takes seconds on the first use after an installation, milliseconds from the cache afterwards.
    """
    if unless_compiled and is_fit_compiled():
        return
    with fit_compiled_beside(reject_outliers) as fit_comes:
        compile_projection()
        if fit_comes:  # meanwhile all that needs no fit
            _rehearse(nominal, LiveInspection(nominal, ToleranceZone(-1.0, 1.0), datum=RigidTransform.identity(), method=method))
    _rehearse(nominal, LiveInspection(nominal, ToleranceZone(-1.0, 1.0), method=method, reject_outliers=reject_outliers))


def _rehearse(nominal: NominalProfile, live: LiveInspection) -> None:
    """Inspect points of the nominal itself."""
    # No place twice, none at the origin, no steps that are exactly alike: such points would have to be looked into, which loads scipy.
    points = nominal.points_mm[nominal.twin < 0][:: max(1, len(nominal) // (8 * BLOCK))]
    points = points + 1e-3 * (1.5 + np.cos(np.square(np.arange(len(points)))))[:, None]
    first, second = points[:-1:2].copy(), points[1:-1:2].copy()  # as a device gives them: of one type to the compiler
    live.add(np.column_stack([first, np.zeros(len(first))]))
    live.add(second)
    live.add(points[-1:])  # few points are judged by a loop of their own
    live.snapshot()
    live.finish()
