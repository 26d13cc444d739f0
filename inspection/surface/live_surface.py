"""Points of a surface in, state and verdicts out, while the scan runs: the 3D twin of `LiveInspection`.

Without a datum the pose is sought on the growing prefix of the scan, and fitted anew when that has grown by half; in between every block
of points is judged at the pose of that moment. `finish` registers all points together and judges every one at that pose.

State moves only at fixed point numbers, never at the edges of batches: the same points in any batches give the same result.
"""

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from inspection.conclusion import Missing
from inspection.errors import RegistrationError
from inspection.surface.feet import NominalSurface, points_in_space
from inspection.surface.judged_surface import JudgedPoints, directions_of, judge_points, judge_surface
from inspection.surface.rigid_motion import RigidMotion
from inspection.surface.surface_fit import SurfaceRegistration, register_surface
from inspection.surface.surface_result import SurfaceResult
from inspection.surface.surface_terms import SurfaceTerms
from inspection.verdict import NOT_JUDGED, Rejection

Array = NDArray[np.float64]
State = Literal["seeking", "provisional", "settled"]

BLOCK = 256  # points between two moves of the state
_SEEK_GROWTH = 1.3  # the pose is sought again once the prefix has grown by this factor
_REFIT_GROWTH = 1.5  # and fitted anew once it has grown by this one
_MANY = 20_000  # points by which a pose is fitted before the end
_COLUMNS: dict[str, tuple[tuple[int, ...], type]] = {
    "points": ((3,), np.float64),
    "normals": ((3,), np.float64),
    "deviation": ((), np.float64),
    "verdicts": ((), np.int8),
    "rejection": ((), np.int8),
}


@dataclass(frozen=True, slots=True, eq=False)
class SurfaceUpdate:
    """What one batch changed. Arrays cover the received points first .. stop - 1; rejected points carry NaN and NOT_JUDGED.

    state        : seeking (no verdicts yet), provisional (the pose still moves), settled (a datum: final at once)
    whole        : every point so far is judged anew, so that `first` is 0
    points_mm    : (k, 3) in the coordinates of the nominal at the pose of this moment; as scanned while it is sought
    deviation_mm : (k,) positive out of material
    verdicts     : (k,) codes of `Verdict`; provisional ones are UNCERTAIN where the pose, as far as it moved a deviation last, could change
                   them. They are no proof: form that is still to come may move the pose farther
    rejection    : (k,) codes of `Rejection`
    registration : how the pose of this moment was fitted; None while it is sought, and where it is known
    """

    state: State
    first: int
    stop: int
    whole: bool
    points_mm: Array
    deviation_mm: Array
    verdicts: NDArray[np.int8]
    rejection: NDArray[np.int8]
    registration: SurfaceRegistration | None


class LiveSurface:
    """Inspection of one scan of one surface.

    nominal : what the points are held against
    terms   : and how
    provisional : False seeks no pose before `finish`, for points that are all there from the start; the result is the same

    Raises InspectionError for terms on which this surface cannot be judged.
    """

    def __init__(self, nominal: NominalSurface, terms: SurfaceTerms, provisional: bool = True) -> None:
        self._nominal, self._terms, self._provisional = nominal, terms, provisional
        terms.limits_on(nominal)  # refused now, not when the scan is over
        self._farthest_mm = terms.farthest_on(nominal)
        self._rows: dict[str, NDArray[Any]] = {name: np.empty((0, *shape), dtype) for name, (shape, dtype) in _COLUMNS.items()}
        self._has_normals = False
        self._received = 0
        self._known_pose = terms.known_pose
        self._registration: SurfaceRegistration | None = None
        self._reserve_mm = 0.0  # how far the pose is expected to move a deviation yet
        self._next_fit = BLOCK  # received points at which the pose is sought, or fitted anew

    @property
    def state(self) -> State:
        """Where the registration stands."""
        if self._known_pose is not None:
            return "settled"
        return "seeking" if self._registration is None else "provisional"

    @property
    def received(self) -> int:
        """Points taken in so far."""
        return self._received

    @property
    def judged(self) -> int:
        """Points that have a verdict at this moment."""
        return int(np.count_nonzero(self._column("verdicts") != NOT_JUDGED))

    @property
    def rejected_by_reason(self) -> dict[str, int]:
        """Points rejected so far, by reason."""
        counts = np.bincount(self._column("rejection"), minlength=max(Rejection) + 1)
        return {each.words: int(counts[each]) for each in Rejection if each != Rejection.NONE and counts[each]}

    def add(self, points_mm: ArrayLike, normals: ArrayLike | None = None) -> SurfaceUpdate:
        """Take in points (k, 3) in scan order, with the outward directions (k, 3) of the measured surface where the scanner gives them."""
        points, directions = points_in_space(points_mm), directions_of(normals, points_mm)
        first, stop = self._received, self._received + len(points)
        self._take_in(points, directions, stop)
        changed_from = first
        while self._received < stop:
            begin = self._received
            self._received = min(begin - begin % BLOCK + BLOCK, stop) if self._moves else stop
            self._judge(begin, self._received)
            if self._received % BLOCK == 0 and self._moves and self._advance():
                changed_from = 0
        return self._update(changed_from)

    def snapshot(self) -> SurfaceUpdate:
        """Every point received so far, judged at the pose of this moment."""
        self._judge(0, self._received)
        return self._update(0)

    def finish(self, complete: bool = True, missing: Missing | None = None) -> SurfaceResult:
        """Register all points together, judge every one at that pose, and say the verdict on the part.

        complete : False when the scan was cut short
        missing  : points that are known to be missing before they came here; None for none

        Raises RegistrationError when the points cannot be brought onto the nominal, NotMeasured when the set-up contradicts them.
        """
        normals = self._column("normals") if self._has_normals else None
        return judge_surface(self._column("points"), self._nominal, self._terms, normals, complete, missing)

    @property
    def _moves(self) -> bool:
        """Whether the pose is sought and refined while points come in."""
        return self._provisional and self._known_pose is None

    @property
    def _pose(self) -> RigidMotion | None:
        """Where the points lie at this moment, if that is known."""
        return self._known_pose if self._registration is None else self._registration.nominal_from_scan

    def _column(self, name: str) -> NDArray[Any]:
        return self._rows[name][: self._received]

    def _take_in(self, points: Array, directions: Array | None, stop: int) -> None:
        """Write points behind the rows so far. They count once `_received` is raised."""
        first = self._received
        if stop > len(self._rows["points"]):
            for name, (shape, dtype) in _COLUMNS.items():
                grown: NDArray[Any] = np.empty((max(stop, 2 * first, 4096), *shape), dtype)
                grown[:first] = self._rows[name][:first]
                self._rows[name] = grown
        self._has_normals |= directions is not None
        fresh: dict[str, Any] = {"points": points, "normals": np.nan if directions is None else directions}
        fresh |= {"deviation": np.nan, "verdicts": np.int8(NOT_JUDGED), "rejection": np.int8(Rejection.NONE)}
        for name, values in fresh.items():
            self._rows[name][first:stop] = values

    def _judge(self, first: int, stop: int) -> None:
        """Fill in rows first .. stop - 1 at the pose of this moment, if there is one."""
        if self._pose is not None:
            found = self._judged_at(self._pose, slice(first, stop))
            no_verdict = found.verdicts == NOT_JUDGED
            self._rows["deviation"][first:stop] = np.where(no_verdict, np.nan, found.feet.distance_mm)
            self._rows["verdicts"][first:stop], self._rows["rejection"][first:stop] = found.verdicts, found.rejection

    def _judged_at(self, pose: RigidMotion, rows: slice) -> JudgedPoints:
        normals = self._rows["normals"][rows] if self._has_normals else None
        held = normals, self._nominal, pose, self._terms.zone, self._farthest_mm
        return judge_points(self._rows["points"][rows], *held, self._reserve_mm)

    def _advance(self) -> bool:
        """Seek the pose, or fit it anew, at a block's end; True when every verdict given so far is replaced."""
        if self._received < self._next_fit:
            return False
        points, terms = self._column("points"), self._terms
        few = points[np.unique(np.linspace(0, len(points) - 1, _MANY).astype(np.int64))]
        start = terms.start if self._registration is None else self._registration.nominal_from_scan
        gross = terms.width_mm / 2 if terms.reject_outliers else None
        try:
            aim = terms.zone.middle_mm, gross, self._farthest_mm, terms.circle_mm
            found = register_surface(few, self._nominal, start, terms.locked, *aim)
        except RegistrationError:
            found = None
        if found is not None and (self._registration is not None or start is not None or self._is_clear(found)):
            self._reserve_mm = self._moved_by(found, few)
            self._registration = found
        self._next_fit = int(self._received * (_SEEK_GROWTH if self._registration is None else _REFIT_GROWTH))
        if self._registration is None:
            return False
        self._judge(0, self._received)
        return True

    def _moved_by(self, found: SurfaceRegistration, points: Array) -> float:
        """How far a new pose moves the deviations of points (k, 3) at most: the next ones are expected to move them less, as scans grow.

        Infinite for the first pose, of which nothing is known.
        """
        if self._registration is None:
            return np.inf
        poses = self._registration.nominal_from_scan, found.nominal_from_scan
        before, after = (self._nominal.project(pose.apply(points)).distance_mm for pose in poses)
        return float(np.abs(after - before)[found.used].max(initial=0.0)) + found.settles_within_mm

    def _is_clear(self, found: SurfaceRegistration) -> bool:
        """Whether one pose fits the points so far clearly better than any other, and they fix it."""
        return not found.rivals and not found.weakest.slides and found.weakest.shift_95_mm <= self._terms.width_mm / 2

    def _update(self, first: int) -> SurfaceUpdate:
        rows, stop, pose = self._rows, self._received, self._pose
        part = slice(first, stop)
        return SurfaceUpdate(
            state=self.state,
            first=first,
            stop=stop,
            whole=first == 0,
            points_mm=rows["points"][part].copy() if pose is None else pose.apply(rows["points"][part]),
            deviation_mm=rows["deviation"][part].copy(),
            verdicts=rows["verdicts"][part].copy(),
            rejection=rows["rejection"][part].copy(),
            registration=self._registration,
        )
