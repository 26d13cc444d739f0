"""Points in, registration state and verdicts out, while the scan runs: the one stateful part of the inspection.

Without a datum the pose is sought on the growing prefix of the scan. Once one pose fits the prefix clearly better than any
other, verdicts are given provisionally; every further point refines the pose at constant cost (accumulated normal
equations), and the whole is fitted anew when the number of points has doubled. `finish` registers all points together and
judges every one at that settled pose.

State moves only at fixed point numbers, never at the edges of batches: the same points in any batches give the same result.
"""

import math
from dataclasses import dataclass, replace
from typing import Literal, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from inspection.coarse import FEWEST_POINTS
from inspection.deviations import Method
from inspection.errors import RegistrationError
from inspection.fine import ranked_poses, register, register_fine
from inspection.kernels import GrowingSums, judge, placed, take_in
from inspection.minimum_zone import fit_minimum_zone
from inspection.nominal import NominalProfile
from inspection.profile_error import check_tip_radius, deviations, feet_on
from inspection.registration import Registration, given_pose
from inspection.result import NOT_JUDGED, InspectionResult, Rejection, coverage, rejections_by_reason, stretches
from inspection.rigid import RigidTransform, about
from inspection.section import SectionPlane
from inspection.tolerance import ToleranceZone, Verdict

Array = NDArray[np.float64]
FitName = Literal["best-fit", "minimum-zone", "none"]
State = Literal["seeking", "provisional", "settled"]

_USABLE = (Rejection.NONE, Rejection.BEYOND_END)  # what a registration may use; beyond which end depends on the pose
_BLOCK = 64  # points between two moves of the state
_SEEK_GROWTH = 1.3  # a further search once the prefix has grown by this factor
_REFIT_GROWTH = 2.0
_CLEARLY_BETTER = 0.5  # of the next best pose's rms
_CORRELATION = 0.125  # share of the length over which form error is taken as one independent value: two to four waves around
_PRIOR_SHARE = 1 / 6  # of the zone's width: standard deviation of the form error expected where nothing is measured yet
_MISFIT = 0.02  # rms above this share of the nominal's size is no registration of the same part
_PLACES = 16  # every so many samples of the nominal are asked how far a deviation there may still move
_MIRROR_HINT = 0.2  # a mirrored fit must be better by this factor to be named as the cause


@dataclass(frozen=True, slots=True, eq=False)
class LiveUpdate:
    """What one batch changed. Arrays cover the received points first .. stop - 1; rejected points carry NaN and NOT_JUDGED.

    state       : seeking (no verdicts yet), provisional (the pose still moves), settled (a datum: final at once)
    can_move_mm : by how much a provisional deviation can still move (95 %); NaN while seeking, 0 when settled
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
    provisional     : False seeks no pose before `finish`, for points that are all there from the start; the result is the same
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
        provisional: bool = True,
    ) -> None:
        check_tip_radius(tip_radius_mm, nominal)
        if fit not in get_args(FitName):
            raise ValueError(f"fit must be one of {', '.join(get_args(FitName))}, not {fit!r}")
        if method not in get_args(Method):
            raise ValueError(f"method must be one of {', '.join(get_args(Method))}, not {method!r}")
        self._nominal, self._zone, self._fit, self._method, self._tip = nominal, zone, fit, method, tip_radius_mm
        self._coverage_min = coverage_min
        self._plane = (section or SectionPlane(np.zeros(3), np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0]))).packed
        self._off_section_max = float("inf") if off_section_max_mm is None else off_section_max_mm
        self._judgement = (nominal.outward, tip_radius_mm, zone.lower_mm, zone.upper_mm, zone.uncertainty_mm)
        self._reject_outliers, self._provisional = reject_outliers, provisional
        self._datum = RigidTransform.identity() if datum is None and fit == "none" else datum
        self._rows = _Rows()
        self._next_fit = _BLOCK  # received points at which the pose is sought, or fitted anew
        self._track: _PoseTrack | None = None

    @property
    def state(self) -> State:
        """Where the registration stands."""
        if self._datum is not None:
            return "settled"
        return "seeking" if self._track is None else "provisional"

    @property
    def received(self) -> int:
        """Points taken in so far."""
        return self._rows.count

    @property
    def judged(self) -> int:
        """Points that have a verdict at this moment."""
        return int(np.count_nonzero(self._rows.verdicts[: self._rows.count] != NOT_JUDGED))

    @property
    def rejected_by_reason(self) -> dict[str, int]:
        """Points rejected so far, by reason."""
        return rejections_by_reason(self._rows.rejection[: self._rows.count])

    def add(self, points_mm: ArrayLike) -> LiveUpdate:
        """Take in section points (m, 2) or machine points (m, 3), in scan order."""
        points = np.asarray(points_mm, dtype=np.float64)
        if points.ndim != 2 or points.shape[1] not in (2, 3):
            raise ValueError(f"points must have shape (m, 2) or (m, 3), got {points.shape}")
        rows, first = self._rows, self._rows.count
        rows.reserve(first + len(points))
        take_in(points, self._plane, self._off_section_max, rows.points, rows.rejection, first)
        if self._datum is not None or not self._provisional:
            rows.count = first + len(points)
            self._judge(first, rows.count)
            return self._update(first)
        changed_from = first
        for stop in range(first - first % _BLOCK + _BLOCK, first + len(points) + _BLOCK, _BLOCK):
            begin, rows.count = rows.count, min(stop, first + len(points))
            self._judge(begin, rows.count)
            if rows.count == stop and self._advance():
                changed_from = 0
        return self._update(changed_from)

    def snapshot(self) -> LiveUpdate:
        """Every point received so far, judged at the pose of this moment."""
        self._judge(0, self._rows.count)
        return self._update(0)

    def finish(self, complete: bool = True) -> InspectionResult:
        """Register all points together and judge every one at that pose; `complete` is False when the scan was cut short.

        Raises RegistrationError when the points cannot be brought onto the nominal.
        """
        rows, count = self._rows, self._rows.count
        usable = np.flatnonzero(np.isin(rows.rejection[:count], _USABLE))
        off = int(np.count_nonzero(rows.rejection[:count] == Rejection.OFF_SECTION))
        if self._datum is None and len(usable) < FEWEST_POINTS <= off:
            raise RegistrationError(
                f"{off} of {count} points lie farther than {self._off_section_max:g} mm from the plane of the section: "
                "are its origin and its normal right?"
            )
        registration = given_pose(self._datum, len(usable)) if self._datum is not None else self._registered(rows.points[usable])
        if self._datum is None:  # so that a replay on another processor judges at the very same pose
            registration = replace(registration, nominal_from_section=registration.nominal_from_section.rounded())
        settled = rows.copy()
        settled.rejection[usable[registration.outliers]] = Rejection.OUTLIER
        self._judge_rows(settled, registration.nominal_from_section, 0, count)
        return self._result(settled, registration, complete)

    def _judge(self, first: int, stop: int) -> None:
        """Deviations and verdicts of rows first .. stop - 1 at the pose of this moment."""
        if self._datum is not None:
            self._judge_rows(self._rows, self._datum, first, stop)
        elif self._track is not None:
            self._judge_rows(self._rows, self._track.pose, first, stop)

    def _judge_rows(self, rows: "_Rows", pose: RigidTransform, first: int, stop: int) -> None:
        x, y = pose.translation_mm
        moved = placed(rows.points, rows.rejection, first, stop, (math.cos(pose.rotation_rad), math.sin(pose.rotation_rad), x, y))
        judge(feet_on(moved, self._nominal, self._method), self._judgement, first, rows.judged_arrays)

    def _advance(self) -> bool:
        """Move the state at a block's end; True when every verdict given so far is replaced."""
        rows, count = self._rows, self._rows.count
        if count < self._next_fit:
            if self._track is not None:
                self._track.refine(rows, count - _BLOCK, count)
            return False
        points = rows.points[:count][np.isin(rows.rejection[:count], _USABLE)]
        if self._track is None:
            self._track = self._sought(points)
        else:
            self._track = self._fresh_track(register_fine(points, self._nominal, self._track.pose, tip_radius_mm=self._tip), points)
        self._next_fit = int(count * (_SEEK_GROWTH if self._track is None else _REFIT_GROWTH))
        if self._track is not None:
            self._judge(0, count)
        return self._track is not None

    def _sought(self, points: Array) -> "_PoseTrack | None":
        """A track from the one pose that fits clearly better than any other, if there is one."""
        try:
            poses = ranked_poses(points, self._nominal, self._tip)
        except RegistrationError:
            return None
        size = _size(self._nominal)
        scores = [score for score, _ in poses]
        clear = len(poses) == 1 or scores[0] < _CLEARLY_BETTER * scores[1]
        if not clear or scores[0] > _MISFIT * size:
            return None
        track = self._fresh_track(register_fine(points, self._nominal, poses[0][1], tip_radius_mm=self._tip), points)
        return track if track.can_move_mm() < _MISFIT * size else None

    def _fresh_track(self, registration: Registration, points: Array) -> "_PoseTrack":
        return _PoseTrack(registration, points, self._nominal, self._tip, _PRIOR_SHARE * (self._zone.upper_mm - self._zone.lower_mm))

    def _update(self, first: int) -> LiveUpdate:
        rows, stop = self._rows, self._rows.count
        return LiveUpdate(
            self.state,
            first,
            stop,
            rows.actual[first:stop].copy(),
            rows.foot[first:stop].copy(),
            rows.station[first:stop].copy(),
            rows.deviation[first:stop].copy(),
            rows.verdicts[first:stop].copy(),
            0.0 if self._datum is not None else float("nan") if self._track is None else self._track.can_move_mm(),
            self._track.registration if self._track is not None else None,
        )

    def _registered(self, points: Array) -> Registration:
        gross_mm = (self._zone.upper_mm - self._zone.lower_mm) / 2  # nearer points are form, however exact the others are
        registration = register(points, self._nominal, tip_radius_mm=self._tip, robust=self._reject_outliers, gross_mm=gross_mm)
        self._check_fit(points, registration)
        if self._fit == "minimum-zone":
            kept = points[~registration.outliers]
            zone = fit_minimum_zone(kept, self._nominal, registration, self._method, self._tip, self._zone.middle_mm)
            return replace(registration, nominal_from_section=zone.nominal_from_section, iterations=zone.programs, converged=zone.converged)
        return registration

    def _check_fit(self, points: Array, registration: Registration) -> None:
        """Refuse points that are not of this part, naming the likely cause."""
        size = _size(self._nominal)
        spread = float(np.abs(self._zone.upper_mm) + np.abs(self._zone.lower_mm))
        if registration.rms_mm <= min(_MISFIT * size, 3 * spread):
            return
        mirrored = register(points[:, ::-1], self._nominal, tip_radius_mm=self._tip)
        if mirrored.rms_mm < _MIRROR_HINT * registration.rms_mm:
            raise RegistrationError(
                f"the points fit the nominal only mirrored (rms {mirrored.rms_mm:.4g} mm instead of {registration.rms_mm:.4g} mm): "
                "are the x and y columns swapped, or does the section's normal point the other way?"
            )
        if registration.rms_mm > _MISFIT * size:
            raise RegistrationError(
                f"the points do not fit the nominal: rms {registration.rms_mm:.4g} mm after the best registration; they span "
                f"{np.hypot(*np.ptp(points, axis=0)):.4g} mm, the nominal {size:.4g} mm. Check the unit, the scale and the nominal"
            )

    def _result(self, settled: "_Rows", registration: Registration, complete: bool) -> InspectionResult:
        judged = settled.verdicts != NOT_JUDGED
        station, deviation, verdicts = settled.station[judged], settled.deviation[judged], settled.verdicts[judged]
        covered = coverage(station, self._nominal)
        verdict = self._zone.verdict(deviation)
        proven = complete and covered >= self._coverage_min and not registration.outliers.any()
        return InspectionResult(
            settled.actual,
            settled.foot,
            settled.station,
            settled.deviation,
            settled.verdicts,
            settled.rejection,
            verdict if proven else max(verdict, Verdict.UNCERTAIN),
            covered,
            complete,
            self._zone,
            registration,
            "none" if self._datum is not None else self._fit,
            self._method,
            stretches(station, deviation, verdicts, self._zone, self._nominal),
        )


def rehearse(nominal: NominalProfile, method: Method = "exact", reject_outliers: bool = False) -> None:
    """Inspect a made-up scan of the nominal itself, so that every loop it needs is compiled before a real scan begins.

    Takes seconds on the first use after an installation, milliseconds from the cache afterwards.
    """
    live = LiveInspection(nominal, ToleranceZone(-1.0, 1.0), method=method, reject_outliers=reject_outliers)
    points = nominal.points_mm[:: max(1, len(nominal) // (4 * _BLOCK))]
    live.add(np.column_stack([points, np.zeros(len(points))]))
    live.add(points)
    live.snapshot()
    live.finish()


class _Rows:
    """Growing arrays, a row for every received point."""

    def __init__(self, capacity: int = 4096) -> None:
        self.count = 0
        self.points, self.actual, self.foot, self.normal = (np.full((capacity, 2), np.nan) for _ in range(4))
        self.station, self.deviation = np.full(capacity, np.nan), np.full(capacity, np.nan)
        self.verdicts = np.full(capacity, NOT_JUDGED, dtype=np.int8)
        self.rejection = np.zeros(capacity, dtype=np.int8)

    @property
    def judged_arrays(self) -> tuple[NDArray[np.generic], ...]:
        """What `judge` fills, in its order."""
        return (self.actual, self.foot, self.normal, self.station, self.deviation, self.verdicts, self.rejection)

    def reserve(self, capacity: int) -> None:
        """Make room for so many rows, at least doubling it."""
        if capacity > len(self.verdicts):
            self._take_over(self, _Rows(max(capacity, 2 * len(self.verdicts))))

    def copy(self) -> "_Rows":
        """The rows so far, in arrays of just their number."""
        same = _Rows(self.count)
        same._take_over(self, same)
        return same

    def _take_over(self, old: "_Rows", larger: "_Rows") -> None:
        """Hold the arrays of `larger`, with the rows of `old` in them."""
        count = old.count
        for name, array in vars(larger).items():
            if isinstance(array, np.ndarray):
                array[:count] = getattr(old, name)[:count]
                setattr(self, name, array)
        self.count = count


class _PoseTrack:
    """The provisional pose: normal equations that grow about a fitted pose, one constant-cost update a block."""

    def __init__(
        self, registration: Registration, points: Array, nominal: NominalProfile, tip_radius_mm: float, expected_form_mm: float
    ) -> None:
        self.registration = registration
        self._start, self._centre, self._expected_form_mm = self.pose, registration.centre_mm, expected_form_mm
        self._places, self._normals = nominal.points_mm[::_PLACES], nominal.outward * nominal.normal[::_PLACES]
        reach = float(np.hypot(*(self._places - self._centre).T).max())
        self._sums = GrowingSums(self._centre, reach, nominal.length_mm)
        d = deviations(self.pose.apply(points), nominal, tip_radius_mm=tip_radius_mm)
        part = np.where(d.beyond_end, np.int8(NOT_JUDGED), np.int8(0))
        self._sums.add(d.foot_mm, d.normal, d.deviation_mm, d.station_mm, part)
        self._can_move_mm: float | None = None  # asked for at most once a batch, and only batches that end a block change it

    @property
    def pose(self) -> RigidTransform:
        """Where the points lie at this moment."""
        return self.registration.nominal_from_section

    def refine(self, rows: _Rows, first: int, stop: int) -> None:
        """Take in a block of rows judged at this track's pose."""
        block = slice(first, stop)
        self._sums.add(rows.foot[block], rows.normal[block], rows.deviation[block], rows.station[block], rows.verdicts[block])
        self._sums.move()
        x, y, angle = self._sums.motion.tolist()
        pose = about(self._centre, angle, np.array([x, y])).after(self._start)
        self.registration = replace(self.registration, nominal_from_section=pose)
        self._can_move_mm = None

    def can_move_mm(self) -> float:
        """Largest 95 % shift of a deviation anywhere on the profile by what the pose is still uncertain.

        What changes from point to point is noise, independent at every point. The rest is form error, one value for every
        eighth of the length: a scan of a few such patches is trusted no more than its patches, less those that the pose
        itself used up. Where nothing is measured yet, form error of a sixth of the zone's width is expected.
        """
        if self._can_move_mm is not None:
            return self._can_move_mm
        sums = self._sums
        patches = max(sums.covered / _CORRELATION, 1.0)
        form = max(sums.mean_square - sums.noise, 0.0) * patches / max(patches - 3.0, 0.5)
        form = max(form, self._expected_form_mm**2 * (1 - sums.covered))
        self._can_move_mm = 2.0 * sums.spread_mm(self._places, self._normals, sums.noise + form * sums.count / patches)
        return self._can_move_mm


def _size(nominal: NominalProfile) -> float:
    return float(np.hypot(*np.ptp(nominal.points_mm, axis=0)))
