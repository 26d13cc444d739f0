"""One best fit of several sections together: the one motion that brings all of them onto their nominals.

The sum of squares runs over the points of all sections. By arc length every millimetre of profile counts alike, whichever section it is
of and however densely that was measured; by points every point does. Gauss-Newton steps with halving, begun at the best of the poses
that the sections have on their own.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from inspection.errors import RegistrationError
from inspection.freedoms import gradients
from inspection.gaps import default_gap_max_mm, weigh_by_station
from inspection.methods import Method, WeightName
from inspection.nominal import NominalProfile
from inspection.rigid import RigidTransform, rotation_about
from inspection.signed_deviations import deviations

Array = NDArray[np.float64]

_MOST_STEPS, _HALVINGS = 60, 12
_WEIGHINGS = 3  # the weights follow from the pose, and the pose from them
_STANDSTILL_MM = 1e-9
_LEAST_SHARE = 1e-9  # of the largest eigenvalue: a motion with less changes no deviation


class SectionToFit(NamedTuple):
    """A section: its points (m, 2) in section coordinates, its nominal, and where it lies by its own fit."""

    points_mm: Array
    nominal: NominalProfile
    own_pose: RigidTransform


class CommonFit(NamedTuple):
    """Where all sections lie together: nominal from section, root mean square of the weighted deviations, and whether the fit settled."""

    nominal_from_section: RigidTransform
    rms_mm: float
    converged: bool


def fit_together(
    sections: Sequence[SectionToFit], target_mm: float = 0.0, weights: WeightName = "arc-length", method: Method = "exact"
) -> CommonFit:
    """The motion of least squares over all sections. Raises RegistrationError where there is none."""
    if not sections:
        raise RegistrationError("no section has points for a common fit")
    looks = [_Look(one, target_mm, weights, method) for one in sections]
    pose = min((one.own_pose for one in sections), key=lambda pose: _sum(looks, pose).mean)
    for _ in range(_WEIGHINGS):
        for look in looks:
            look.weigh(pose)
        pose, settled = _settle(looks, pose)
    here = _sum(looks, pose)
    return CommonFit(pose.snap_to_grid(), float(np.sqrt(here.mean)), settled)


def _settle(looks: Sequence["_Look"], pose: RigidTransform) -> tuple[RigidTransform, bool]:
    """Go to the least mean square. Gives the pose, and whether the last step moved nothing by more than 1e-9 mm."""
    here = _sum(looks, pose)
    for _ in range(_MOST_STEPS):
        values, vectors = np.linalg.eigh(here.curvature)
        kept = values > _LEAST_SHARE * values.max()
        step = -(vectors[:, kept] / values[kept]) @ (vectors[:, kept].T @ here.slope) * here.units
        if float(np.abs(step / here.units).sum()) <= _STANDSTILL_MM:
            return pose, True
        share = 1.0
        for _ in range(_HALVINGS):
            onward = rotation_about(here.middle, share * float(step[2]), share * step[:2]).after(pose)
            trial = _sum(looks, onward)
            if trial.mean <= here.mean * (1 + 1e-12):
                break
            share /= 2
        else:
            return pose, False
        pose, here = onward, trial
    return pose, False


class _Sum(NamedTuple):
    """The sum of squares and what a step follows from; motions count by how far they move a point that is far from the middle."""

    square: float
    weight: float
    slope: Array
    curvature: Array
    middle: Array
    units: Array

    @property
    def mean(self) -> float:
        """The mean square."""
        return self.square / max(self.weight, 1e-300)


class _Part(NamedTuple):
    """The same of one section, with motions about the origin."""

    square: float
    weight: float
    slope: Array
    curvature: Array
    moved: Array


class _Look:
    """The squares of one section at any pose."""

    def __init__(self, section: SectionToFit, target_mm: float, weights: WeightName, method: Method) -> None:
        self._section, self._target_mm, self._weights, self._method = section, target_mm, weights, method
        at_own = deviations(section.own_pose.apply(section.points_mm), section.nominal, method)
        self._measured_mm = _measured_mm(at_own.station_mm[~at_own.beyond_end], section.nominal)
        self._shares = np.empty(0)
        self.weigh(section.own_pose)

    def weigh(self, pose: RigidTransform) -> None:
        """Set how much each point counts by where it lies at a pose."""
        points, nominal, _ = self._section
        d = deviations(pose.apply(points), nominal, self._method)
        self._shares = np.where(d.beyond_end, 0.0, 1.0)
        if self._weights == "arc-length":
            weigh_by_station(np.where(d.beyond_end, np.nan, d.station_mm), self._shares, nominal)
            self._shares *= self._measured_mm / max(float(self._shares.sum()), 1e-300)

    def __call__(self, pose: RigidTransform) -> _Part:
        points, nominal, _ = self._section
        moved = pose.apply(points)
        d = deviations(moved, nominal, self._method)
        shares = np.where(d.beyond_end, 0.0, self._shares)
        e = np.where(d.beyond_end, 0.0, d.deviation_mm - self._target_mm)
        J = gradients(d.normal, moved)
        weighted = J.T * shares
        return _Part(float((shares * e * e).sum()), float(shares.sum()), weighted @ e, weighted @ J, moved)


def _measured_mm(station_mm: Array, nominal: NominalProfile) -> float:
    """How much of a profile points at stations (m,) stand for; a gap counts up to the longest that counts as measured."""
    stations = np.sort(station_mm)
    over_the_seam = stations[:1] + nominal.length_mm if nominal.curve.closed else np.empty(0)
    gaps = np.diff(np.concatenate([stations, over_the_seam]))
    return float(np.minimum(gaps, default_gap_max_mm(nominal)).sum())


def _sum(looks: Sequence[_Look], pose: RigidTransform) -> _Sum:
    """The sum over all sections, with motions about the middle of their points."""
    parts = [look(pose) for look in looks]
    low = np.min([part.moved.min(axis=0) for part in parts], axis=0)
    high = np.max([part.moved.max(axis=0) for part in parts], axis=0)
    middle = (low + high) / 2
    units = np.array([1.0, 1.0, 2.0 / max(float(np.hypot(*(high - low))), 1e-9)])
    about = np.array(
        [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [middle[1], -middle[0], 1.0]]
    )  # rates about the middle, from those about the origin
    about = about * units[:, None]
    slope = about @ sum((part.slope for part in parts), np.zeros(3))
    curvature = about @ sum((part.curvature for part in parts), np.zeros((3, 3))) @ about.T
    return _Sum(sum(part.square for part in parts), sum(part.weight for part in parts), slope, curvature, middle, units)
