"""The provisional pose of a scan that still runs: sought on the points so far, then refined with every further block."""

import math

import numpy as np
from numpy.typing import NDArray

from inspection.cloud import Cloud
from inspection.errors import RegistrationError
from inspection.fine import MISFIT, ranked_poses, register_fine
from inspection.kernels import GrowingSums
from inspection.nominal import NominalProfile
from inspection.registration import Registration
from inspection.rigid import RigidTransform, turned_about
from inspection.scan_rows import ScanRows
from inspection.signed_deviations import deviations
from inspection.terms import Terms
from inspection.verdict import NOT_JUDGED

Array = NDArray[np.float64]

_CLEARLY_BETTER = 0.5  # of the next best pose's rms
_PRIOR_SHARE = 1 / 6  # of the zone's width: standard deviation of the form error expected where nothing is measured yet
_PLACES = 16  # every so many samples of the nominal are asked how far a deviation there may still move


class PoseTrack:
    """Normal equations that grow about a pose fitted before, so that every block refines the pose at constant cost."""

    def __init__(self, registration: Registration, points: Cloud, terms: Terms) -> None:
        nominal = terms.nominal
        self.registration = registration
        self._terms, self._start, self._centre = terms, self.pose, registration.centre_mm
        self._places, self._normals = nominal.points_mm[::_PLACES].copy(), nominal.outward * nominal.normal[::_PLACES]
        self._stations = nominal.station_mm[::_PLACES].copy()
        reach = float(np.hypot(*(self._places - self._centre).T).max())
        expected_form_mm = _PRIOR_SHARE * (terms.zone.upper_mm - terms.zone.lower_mm)
        self._sums = GrowingSums(self._centre, reach, nominal.length_mm, expected_form_mm, terms.target_mm)
        for block in points.blocks():  # copied, because arrays that cannot be written to are another type to the compiler
            d = deviations(self.pose.apply(block), nominal, tip_radius_mm=terms.tip_radius_mm)
            part = np.where(d.beyond_end, np.int8(NOT_JUDGED), np.int8(0))
            self._sums.add(d.foot_mm.copy(), d.normal.copy(), d.deviation_mm.copy(), d.station_mm.copy(), part, follows=True)
        self._ends, self._tangents = _open_ends(nominal)
        self._reserve_mm: float | None = None  # asked for more often than it changes, which is once a block

    @property
    def pose(self) -> RigidTransform:
        """Where the points lie at this moment."""
        return self.registration.nominal_from_section

    def refine(self, rows: ScanRows, first: int, stop: int) -> None:
        """Take in a block of rows judged at this track's pose."""
        block, places = slice(first, stop), slice(first - rows.base, stop - rows.base)
        self._sums.add(rows.foot[places], rows.normal[places], rows.deviation[block], rows.station[block], rows.verdicts[block])
        x, y, angle = self._sums.move()
        self.registration = self.registration.at(turned_about(self._start, self._centre, angle, x, y))
        self._reserve_mm = None

    def refit(self, points: Cloud) -> "PoseTrack":
        """A track about the pose that fits all points so far, started at this one's."""
        return _fit_track(points, self.pose, self._terms)

    def count_as(self, points: int) -> None:
        """Let the points that this track was fitted to stand for so many."""
        self._sums.count_as(points)

    def reserve_mm(self) -> float:
        """How far the last pose is expected to move a deviation that was measured: what provisional verdicts leave room for.

        One standard deviation by the model of `GrowingSums`, the largest over what was measured so far. This is an expectation, no
        bound: form that is still to come can move the pose farther than all form so far. For a minimum zone it is infinite, since
        one point still to come moves that as far as the point stands out.
        """
        if self._terms.fit == "minimum-zone":
            return math.inf
        if self._reserve_mm is None:
            self._reserve_mm = self._sums.spread_mm(self._places, self._normals, self._stations)
        return self._reserve_mm

    def is_clear(self, largest_mm: float) -> bool:
        """Whether the pose is expected to move no deviation anywhere on the profile by more than that (95 %)."""
        return 2.0 * self._sums.spread_mm(self._places, self._normals) < largest_mm

    def slide_mm(self) -> float:
        """How far the pose is expected to slide along an open profile at its ends (95 %), 0 for a closed one; no bound either."""
        return 2.0 * self._sums.spread_mm(self._ends, self._tangents) if len(self._ends) else 0.0


def seek_pose(points: Cloud, terms: Terms) -> PoseTrack | None:
    """A track from the one pose that fits the points clearly better than any other, None where there is no such pose."""
    try:
        poses = ranked_poses(points, terms.nominal, terms.tip_radius_mm + terms.target_mm)
    except RegistrationError:
        return None
    largest_rms = MISFIT * terms.nominal.size_mm
    scores = [score for score, _ in poses]
    clear = len(poses) == 1 or scores[0] < _CLEARLY_BETTER * scores[1]
    if not clear or scores[0] > largest_rms:
        return None
    track = _fit_track(points, poses[0][1], terms)
    return track if track.is_clear(largest_rms) else None


def _fit_track(points: Cloud, start: RigidTransform, terms: Terms) -> PoseTrack:
    registration = register_fine(points, terms.nominal, start, tip_radius_mm=terms.tip_radius_mm, target_mm=terms.target_mm)
    return PoseTrack(registration, points, terms)


def _open_ends(nominal: NominalProfile) -> tuple[Array, Array]:
    """The ends of an open profile and the directions along it there, both (2, 2); (0, 2) for a closed one."""
    ends = np.empty((0, 2)) if nominal.curve.closed else nominal.points_mm[[0, -1]]
    return ends, nominal.normal[[0, -1]][: len(ends), ::-1] * np.array([1.0, -1.0])
