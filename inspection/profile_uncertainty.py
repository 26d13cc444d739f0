"""The uncertainty U of the deviations along a profile, and the one U by which the points are judged while they arrive.

Known before the first point. Where the pose is known, a deviation is uncertain by what is stated of device, tip, temperature and noise
at its place, so that U follows from the nominal alone. Where the pose is free and a part conforms when any placement passes, a
deviation may be freed of any motion that all errors together look like: the claim is about every placement. U is then taken as what a
fit of the whole profile leaves of the errors that points share, and all of the noise, which no motion can be relied on to follow. It
holds however little was measured, since the motion need not be the one that the measured points would have had.

Only where the best fit alone decides does U depend on which points came, and how dense: it is worked out anew at the end
(`uncertainty_at_fit`), and where it came out larger than was known before, everything is judged again by the larger one.

The U that judges is the largest along the profile. So it is nowhere smaller than the U of a station, and no point is said to be
in or out that the U of its own station would leave open.
"""

import math
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from inspection.datum import FoundDatum
from inspection.freedoms import Freedoms
from inspection.gaps import weigh_by_station
from inspection.methods import WeightName
from inspection.nominal import NominalProfile
from inspection.rigid import RigidTransform
from inspection.uncertainty import (
    DeviationUncertainty,
    PartName,
    UncertaintyBudget,
    deviation_uncertainty,
    places_on,
    propagate,
    propagate_by,
)

Array = NDArray[np.float64]
Rows = NDArray[np.int64]
Basis = Literal["the known pose", "any placement of the part", "the best fit of the points", "the measured datum"]

_ALONG, _AROUND = 512, 256  # places that stand for the profile, all along it and, where it bends, to a full turn
_MOST_STATIONS = 200  # of a table for people


@dataclass(frozen=True, slots=True)
class StatedUncertainty:
    """What is stated about the uncertainty of a deviation before anything is measured.

    coverage_factor : k of the expanded uncertainty U = k u; 2 covers about 95 %
    fixed_mm        : (x, y) the place that stays where it is as the part grows, in section coordinates. After a free fit it does not matter
    """

    budget: UncertaintyBudget
    coverage_factor: float = 2.0
    fixed_mm: tuple[float, float] = (0.0, 0.0)

    def __post_init__(self) -> None:
        if not (np.isfinite(self.coverage_factor) and self.coverage_factor > 0):
            raise ValueError(f"the coverage factor must be a number above zero, got {self.coverage_factor:g}")
        if not np.isfinite(self.fixed_mm).all():
            raise ValueError(f"the fixed place must be two finite numbers, got {self.fixed_mm}")


class Contribution(NamedTuple):
    """One line of a GUM budget, at the station where U is largest.

    value, unit, distribution, evaluated : what was stated, and by which type of evaluation, A or B
    standard       : its standard uncertainty, in the same unit
    sensitivity    : mm of the deviation for a unit of it
    contributed_mm : the product of both
    share          : of u^2
    """

    name: PartName
    value: float
    unit: str
    distribution: Literal["normal", "rectangular"]
    evaluated: Literal["A", "B"]
    standard: float
    sensitivity: float
    contributed_mm: float
    share: float


@dataclass(frozen=True, slots=True, eq=False)
class ProfileUncertainty:
    """Uncertainty of the deviations at n places along a profile, in the order of their stations.

    station_mm  : (n,) rising
    standard_mm : (n,) u; parts_mm : (n,) its parts by name, whose squares add up to its own
    lever_mm    : (n,) what a deviation changes by where the part grows by its own size
    left_mm     : (n,) known growth that was not taken out of the points: it is added to U
    expanded_mm : (n,) U = k u, and that growth
    size_mm     : of the part: the longest distance over which the device's error counts
    basis       : what the deviations are counted from, which decides what of the errors they hold
    """

    stated: StatedUncertainty
    basis: Basis
    station_mm: Array
    standard_mm: Array
    parts_mm: dict[PartName, Array]
    lever_mm: Array
    left_mm: Array
    expanded_mm: Array
    size_mm: float

    def __post_init__(self) -> None:
        for array in (self.station_mm, self.standard_mm, self.lever_mm, self.left_mm, self.expanded_mm, *self.parts_mm.values()):
            array.setflags(write=False)

    @property
    def worst(self) -> int:
        """The place where U is largest."""
        return int(self.expanded_mm.argmax())

    @property
    def largest_mm(self) -> float:
        """The largest U along the profile: what judges the points."""
        return float(self.expanded_mm[self.worst])

    def at(self, station_mm: ArrayLike) -> Array:
        """U (m,) at stations (m,), between two places the straight line from one to the other."""
        return np.interp(np.asarray(station_mm, dtype=np.float64), self.station_mm, self.expanded_mm)

    def telling_places(self, most: int = _MOST_STATIONS) -> Rows:
        """At most so many places (k,) that tell U all along: of every stretch of the profile the one where U is largest."""
        if len(self.station_mm) <= most:
            return np.arange(len(self.station_mm))
        span = self.station_mm[-1] - self.station_mm[0]
        stretch = np.minimum(((self.station_mm - self.station_mm[0]) * (most / span)).astype(np.int64), most - 1)
        order = np.lexsort((-self.expanded_mm, stretch))
        return np.sort(order[np.unique(stretch[order], return_index=True)[1]])

    def contributions(self) -> tuple[Contribution, ...]:
        """The budget at the place where U is largest, a line for everything that was stated."""
        at, budget = self.worst, self.stated.budget
        square, lever = float(self.standard_mm[at]) ** 2, float(abs(self.lever_mm[at]))
        mpe = budget.mpe_mm + budget.mpe_share * self.size_mm
        stated: tuple[tuple[PartName, float, str, Literal["normal", "rectangular"], Literal["A", "B"], float | None], ...] = (
            ("repeatability", budget.repeatability_mm, "mm", "normal", "A", None),
            ("device", mpe, "mm", "rectangular", "B", None),
            ("tip radius", budget.tip_radius_mm, "mm", "normal", "B", None),
            ("temperature", budget.temperature_k, "K", "normal", "B", budget.expansion_per_k * lever),
            ("expansion", budget.u_expansion_per_k, "1/K", "normal", "B", abs(budget.off_reference_k) * lever),
        )
        lines = []
        for name, value, unit, distribution, evaluated, sensitivity in stated:
            if value > 0:
                standard, part = value / (math.sqrt(3.0) if distribution == "rectangular" else 1.0), float(self.parts_mm[name][at])
                by_unit = part / standard if sensitivity is None else sensitivity
                share = part**2 / square if square > 0 else 0.0
                lines.append(Contribution(name, value, unit, distribution, evaluated, standard, by_unit, part, share))
        return tuple(lines)


def uncertainty_along(nominal: NominalProfile, stated: StatedUncertainty, pose: RigidTransform | None) -> ProfileUncertainty:
    """Uncertainty of deviations all along a profile, known before anything is measured: see the head of this file.

    pose : nominal from section where it is known beforehand, None where it is free
    """
    rows = _samples_that_tell(nominal)
    station, at, shares = nominal.station_mm[rows], nominal.points_mm[rows], np.ones(len(rows))
    weigh_by_station(station, shares, nominal)
    free = Freedoms.about(at.mean(axis=0), ("x", "y", "rotation") if pose is None else ())
    fixed = (pose or RigidTransform.identity()).apply(np.array([stated.fixed_mm]))[0]
    fit = places_on(station, at, nominal.outward * nominal.normal[rows], free)
    found = propagate(fit, fit, shares, free, stated.budget, fixed)
    found.parts_mm["repeatability"][:] = stated.budget.repeatability_mm
    return _along(found, stated, "any placement of the part" if pose is None else "the known pose", nominal.size_mm)


def _samples_that_tell(nominal: NominalProfile) -> Rows:
    """Samples (k,) of a profile, near enough to one another that neither their places nor their normals change much between two."""
    turned = np.abs(np.diff(np.unwrap(np.arctan2(nominal.normal[:, 1], nominal.normal[:, 0])), prepend=0.0))
    turned[0] = 0.0
    place = np.floor(_ALONG * nominal.station_mm / nominal.length_mm + _AROUND * np.cumsum(turned) / (2 * np.pi))
    return np.union1d(np.flatnonzero(np.diff(place, prepend=-1.0)), [len(nominal) - 1])


def uncertainty_at_fit(
    points_mm: Array,
    nominal: NominalProfile,
    stated: StatedUncertainty,
    tip_radius_mm: float,
    weights: WeightName,
    freedoms: Freedoms | None = None,
    fixed_mm: ArrayLike | None = None,
) -> ProfileUncertainty:
    """Uncertainty of the deviations of points (m, 2), given at their best fit, after which it depends on where and how dense they lie.

    freedoms, fixed_mm : the motions that were fitted, and what stays where it is as the part grows: see `deviation_uncertainty`
    """
    in_any_order = points_mm[np.lexsort(points_mm.T)]  # so that sums over them come out the same to the last bit
    found = deviation_uncertainty(
        in_any_order, nominal, stated.budget, freedoms, fixed_mm=fixed_mm, tip_radius_mm=tip_radius_mm, weights=weights
    )
    return _along(found, stated, "the best fit of the points", float(np.hypot(*np.ptp(points_mm, axis=0))))


def uncertainty_at_datum(nominal: NominalProfile, stated: StatedUncertainty, datum: FoundDatum, fixed_mm: ArrayLike) -> ProfileUncertainty:
    """Uncertainty of deviations all along a profile that is placed by features that were measured: that of the datum's pose is in it.

    fixed_mm : (2,) what stays where it is as the part grows, in nominal coordinates
    """
    rows = _samples_that_tell(nominal)
    free = Freedoms.about(datum.pivot_mm)
    there = places_on(nominal.station_mm[rows], nominal.points_mm[rows], nominal.outward * nominal.normal[rows], free)
    fit = places_on(datum.station_mm, datum.at_mm, datum.normal, free)
    found = propagate_by(datum.gain, fit, there, free, stated.budget, np.asarray(fixed_mm, dtype=np.float64))
    return _along(found, stated, "the measured datum", nominal.size_mm)


def pose_uncertainty(datum: FoundDatum, stated: StatedUncertainty, place_mm: ArrayLike, fixed_mm: ArrayLike) -> tuple[Array, Array]:
    """Covariance (3, 3) of a measured datum's pose about a place (2,), mm and rad, and what known growth moves it by (3,)."""
    about = Freedoms.about(place_mm)
    lever = np.asarray(place_mm, dtype=np.float64) - datum.pivot_mm
    carried = np.array([[1.0, 0.0, -lever[1]], [0.0, 1.0, lever[0]], [0.0, 0.0, 1.0]])  # motions about the pivot as motions about the place
    fit = places_on(datum.station_mm, datum.at_mm, datum.normal, about)
    found = propagate_by(carried @ datum.gain, fit, fit, about, stated.budget, np.asarray(fixed_mm, dtype=np.float64))
    return found.covariance, found.grown * stated.budget.growth_left


def _along(found: DeviationUncertainty, stated: StatedUncertainty, basis: Basis, size_mm: float) -> ProfileUncertainty:
    """The same in the order of the stations, without places that have no deviation."""
    order = np.argsort(found.station_mm, kind="stable")
    order = order[np.isfinite(found.standard_mm[order])]
    parts = {name: part[order] for name, part in found.parts_mm.items()}
    standard = np.sqrt(sum((np.square(part) for part in parts.values()), np.zeros(len(order))))
    left = found.left_mm[order]
    expanded = stated.coverage_factor * standard + np.abs(left)
    return ProfileUncertainty(stated, basis, found.station_mm[order], standard, parts, found.lever_mm[order], left, expanded, size_mm)
