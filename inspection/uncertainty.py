"""Uncertainty of each deviation after a fit, from a budget by the GUM: u^2(e) is the diagonal of (I - H) V (I - H)'.

V holds what every measured point is uncertain by and how that goes together between points; H = J Z (Z'J'WJZ)^-1 Z'J'W is what the
fit takes away. An error that all points share in the way of a free motion is fitted away; one that they do not share leaves the pose
uncertain by its mean. See Forbes, Appl. Sci. 2022, 12(6), 2808. The propagation is linear, and that of least squares; a minimum zone
hangs on few points, so that its pose is less certain than this.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from inspection.freedoms import Freedoms, gradients
from inspection.gaps import weigh_by_station
from inspection.methods import WeightName
from inspection.nominal import NominalProfile
from inspection.signed_deviations import check_points, deviations

Array = NDArray[np.float64]
PartName = Literal["repeatability", "device", "tip radius", "temperature", "expansion"]

_FREE = 1e-6  # a motion by a mm that changes deviations by less than a thousandth of it is not fitted: a circle turns in itself
_MOST_GROUPS = 512  # of neighbouring points that stand together where the device's error is summed up: it changes slowly
_AT_ONCE = 512  # places whose errors are compared with those of all points together
_FAR = 8.0  # standard deviations: farther below the largest, a point has no share in what noise adds to it
_NODES = 2001


@dataclass(frozen=True, slots=True)
class UncertaintyBudget:
    """What a measured point is uncertain by. All are standard uncertainties but the device's, which is its maximum permissible error.

    repeatability_mm  : of one point along the normal, independent from point to point; scanning noise belongs here
    mpe_mm, mpe_share : the device measures a length L to within mpe_mm + mpe_share * L (A + L/K of ISO 10360-2, mpe_share = 1/K in mm a
                        mm), taken as rectangular: the errors of two places differ by (A + L/K) / sqrt(3), along any direction
    tip_radius_mm     : of the calibrated tip: the same for every point, so that it does not average
    temperature_k     : of the part's temperature
    expansion_per_k   : the part's coefficient of thermal expansion
    off_reference_k   : how far above the reference temperature the part was measured
    u_expansion_per_k : of the coefficient, which counts by that distance
    compensated       : the part's growth by that distance was taken out of the points; False where it stands in every deviation
    """

    repeatability_mm: float = 0.0
    mpe_mm: float = 0.0
    mpe_share: float = 0.0
    tip_radius_mm: float = 0.0
    temperature_k: float = 0.0
    expansion_per_k: float = 0.0
    off_reference_k: float = 0.0
    u_expansion_per_k: float = 0.0
    compensated: bool = True

    def __post_init__(self) -> None:
        for name in self.__slots__:
            value = getattr(self, name)
            if not np.isfinite(value) or (value < 0 and name != "off_reference_k"):
                raise ValueError(f"{name} of an uncertainty budget must be a finite number, zero or more; got {value:g}")

    @property
    def growth(self) -> float:
        """Standard uncertainty of the part's size by temperature, mm a mm."""
        return float(np.hypot(self.expansion_per_k * self.temperature_k, self.u_expansion_per_k * self.off_reference_k))

    @property
    def growth_left(self) -> float:
        """How much larger than at the reference temperature the part is known to be in the points, mm a mm."""
        return 0.0 if self.compensated else self.expansion_per_k * self.off_reference_k


@dataclass(frozen=True, slots=True, eq=False)
class DeviationUncertainty:
    """Standard uncertainties of n deviations.

    station_mm  : (n,) where they are; NaN, as the others, beyond open ends
    standard_mm : (n,) all parts together
    pose_mm     : (n,) what of it the pose brings in, sqrt(j P j'); not a part beside the others, which hold it already
    parts_mm    : (n,) each, by name; their squares add up to that of `standard_mm`
    lever_mm    : (n,) how much a deviation changes where the part grows by its own size, after the fit
    left_mm     : (n,) known growth that was not taken out of the points, as it stands in the deviations
    grown       : (3,) motion of the fit, likewise, where the part grows by its own size
    covariance  : (3, 3) P of the pose: shift in mm and rotation in rad about `pivot_mm`; zero in motions that are locked
    pivot_mm    : (2,)
    """

    station_mm: Array
    standard_mm: Array
    pose_mm: Array
    parts_mm: dict[PartName, Array]
    lever_mm: Array
    left_mm: Array
    grown: Array
    covariance: Array
    pivot_mm: Array

    def expanded_mm(self, coverage_factor: float = 2.0) -> Array:
        """Expanded uncertainty U (n,); a factor of 2 covers about 95 %. What is known and not corrected is added to it (GUM F.2.4.5)."""
        return coverage_factor * self.standard_mm + np.abs(self.left_mm)


class Places(NamedTuple):
    """Places where deviations are uncertain: stations (n,), where (n, 2), outward normals (n, 2), rates by the free motions (n, k)."""

    station: Array
    at: Array
    normal: Array
    rates: Array


def places_on(station_mm: Array, at_mm: Array, normal: Array, free: Freedoms) -> Places:
    """Places (n, 2) with their stations (n,) and outward normals (n, 2), and how the free motions change the deviations there."""
    return Places(station_mm, at_mm, normal, gradients(normal, at_mm - free.pivot_mm) @ free.directions.T)


def deviation_uncertainty(
    points_mm: ArrayLike,
    nominal: NominalProfile,
    budget: UncertaintyBudget,
    freedoms: Freedoms | None = None,
    elsewhere_mm: ArrayLike | None = None,
    fixed_mm: ArrayLike | None = None,
    tip_radius_mm: float = 0.0,
    weights: WeightName = "points",
) -> DeviationUncertainty:
    """Uncertainty of the deviation of fitted points (m, 2), which are given at their pose, in nominal coordinates.

    freedoms     : the motions that were fitted; None for all, none of them for a datum
    elsewhere_mm : (n, 2) places that took no part in the fit; the uncertainties are then theirs
    fixed_mm     : (2,) the point that stays where it is when the part grows with temperature; None takes the middle of the points. After
                   a free fit it does not matter
    weights      : of the fit

    NaN for points beyond open ends.
    """
    points = check_points(points_mm)
    d = deviations(points, nominal, tip_radius_mm=tip_radius_mm)
    used = np.flatnonzero(~d.beyond_end)
    free = Freedoms.about(points[used].mean(axis=0)) if freedoms is None else freedoms
    shares = np.ones(len(points))
    if weights == "arc-length":
        weigh_by_station(np.where(d.beyond_end, np.nan, d.station_mm), shares, nominal)
    fit = places_on(d.station_mm[used], points[used], d.normal[used], free)
    there, known, count = fit, used, len(points)
    if elsewhere_mm is not None:
        others = check_points(elsewhere_mm)
        beyond = deviations(others, nominal, tip_radius_mm=tip_radius_mm)
        known, count = np.flatnonzero(~beyond.beyond_end), len(others)
        there = places_on(beyond.station_mm[known], others[known], beyond.normal[known], free)
    fixed = points[used].mean(axis=0) if fixed_mm is None else np.asarray(fixed_mm, dtype=np.float64)
    found = propagate(fit, there, shares[used], free, budget, fixed)
    return DeviationUncertainty(
        _spread(found.station_mm, known, count),
        _spread(found.standard_mm, known, count),
        _spread(found.pose_mm, known, count),
        {name: _spread(part, known, count) for name, part in found.parts_mm.items()},
        _spread(found.lever_mm, known, count),
        _spread(found.left_mm, known, count),
        found.grown,
        found.covariance,
        found.pivot_mm,
    )


def propagate(
    fit: Places, there: Places, shares: Array, free: Freedoms, budget: UncertaintyBudget, fixed_mm: Array
) -> DeviationUncertainty:
    """Uncertainty at the n places `there` after a fit to m places with shares (m,), the motions of `free` being fitted.

    there : `fit` itself for the fitted points; the pose has followed the errors of these
    """
    reach = float(np.hypot(*(fit.at - free.pivot_mm).T).max(initial=0.0))
    gain = _gain(fit.rates, shares, 1.0 / np.maximum(free.units_mm(reach), 1e-300))
    return propagate_by(gain, fit, there, free, budget, fixed_mm)


def propagate_by(
    gain: Array, fit: Places, there: Places, free: Freedoms, budget: UncertaintyBudget, fixed_mm: Array
) -> DeviationUncertainty:
    """The same where a unit of each of the m deviations moves the motions by amounts `gain` (k, m), however these are found."""
    parts, poses = {}, np.zeros((len(free), len(free)))
    for name, variance, pose in _parts(fit, there, gain, budget, fixed_mm):
        parts[name], poses = np.sqrt(np.maximum(variance, 0.0)), poses + pose
    pose_mm = np.sqrt(np.maximum(((there.rates @ poses) * there.rates).sum(axis=1), 0.0))
    standard = np.sqrt(sum((np.square(part) for part in parts.values()), np.zeros(len(there.at))))
    lever, amounts = _carried(there, gain, _growth_of(there, fixed_mm), _growth_of(fit, fixed_mm))
    covariance = free.directions.T @ poses @ free.directions
    left, grown = budget.growth_left * lever, amounts @ free.directions
    return DeviationUncertainty(there.station, standard, pose_mm, parts, lever, left, grown, covariance, free.pivot_mm)


def _spread(values: Array, rows: NDArray[np.int64], count: int) -> Array:
    """Values (k,) at their rows among so many, NaN at the others."""
    every = np.full(count, np.nan)
    every[rows] = values
    return every


def _gain(rates: Array, weights: Array, units: Array) -> Array:
    """Amounts (k, m) by which a unit of each deviation moves the free motions; `units` (k,) of these move points by a mm at most."""
    scaled = rates * units
    values, vectors = np.linalg.eigh((scaled.T * weights) @ scaled) if len(units) else (np.empty(0), np.empty((0, 0)))
    kept = values > _FREE * weights.sum()
    inverse = (vectors[:, kept] / values[kept]) @ vectors[:, kept].T
    return np.asarray(-(inverse @ (scaled.T * weights)) * units[:, None])


def _parts(fit: Places, there: Places, gain: Array, budget: UncertaintyBudget, fixed_mm: Array) -> Iterator[tuple[PartName, Array, Array]]:
    """Variance (n,) of the deviations and of the amounts (k, k) by each part of the budget.

    A deviation after the fit is e = z + j gain z: what is added to the others by the motion that the fit makes of them.
    """
    yield "repeatability", *_independent(there, gain, budget.repeatability_mm**2, there is fit)
    yield "device", *_of_device(fit, there, gain, budget)
    ones = (np.ones(len(there.at)), np.ones(len(fit.at)))
    yield "tip radius", *_common(there, gain, ones, budget.tip_radius_mm)
    grown = (_growth_of(there, fixed_mm), _growth_of(fit, fixed_mm))
    yield "temperature", *_common(there, gain, grown, budget.expansion_per_k * budget.temperature_k)
    yield "expansion", *_common(there, gain, grown, budget.u_expansion_per_k * budget.off_reference_k)


def _growth_of(places: Places, fixed_mm: Array) -> Array:
    """Deviations (n,) of a part that grows by its own size about a fixed place (2,), before any fit."""
    return np.asarray((places.normal * (places.at - fixed_mm)).sum(axis=1))


def _carried(there: Places, gain: Array, shape: Array, at_fit: Array) -> tuple[Array, Array]:
    """Deviations (n,) after the fit of an error of shapes (n,) at the places and (m,) at the fitted points; amounts (k,) of the motions."""
    amounts = gain @ at_fit
    return shape + there.rates @ amounts, amounts


def _common(there: Places, gain: Array, shapes: tuple[Array, Array], standard: float) -> tuple[Array, Array]:
    """An error that all points share, of shapes (n,) at the places and (m,) at the fitted points."""
    carried, amounts = _carried(there, gain, *shapes)
    return standard**2 * np.square(carried), standard**2 * np.outer(amounts, amounts)


def _independent(there: Places, gain: Array, variance: float, same: bool) -> tuple[Array, Array]:
    """An error that no two points share. At a fitted point the pose has followed it a little."""
    pose = variance * gain @ gain.T
    own = 2 * variance * (there.rates * gain.T).sum(axis=1) if same else 0.0
    return variance + own + ((there.rates @ pose) * there.rates).sum(axis=1), pose


def _of_device(fit: Places, there: Places, gain: Array, budget: UncertaintyBudget) -> tuple[Array, Array]:
    """The device's error, a field over the plane of which only differences over a length are known: u^2 = (A + L/K)^2 / 3.

    With C0 = (A + D/K)^2 / 3 for the part's size D its covariance over a length L is C0 - (A + L/K)^2 / 6: of this A^2 / 6 is
    independent from place to place, and the rest changes slowly. A free fit takes C0 away, so that its choice matters to datums only.
    """
    A, share = budget.mpe_mm, budget.mpe_share
    size = float(np.hypot(*np.ptp(fit.at, axis=0)))
    near = (A + share * size) ** 2 / 3 - A * A / 6
    if not len(gain):
        return np.full(len(there.at), near + A * A / 6), np.zeros((0, 0))
    order = np.argsort(fit.station, kind="stable")
    starts = np.unique(np.linspace(0, len(order), min(len(order), _MOST_GROUPS), endpoint=False).astype(np.int64))
    middles = order[(starts + np.append(starts[1:], len(order)) - 1) // 2]
    at = fit.at[middles]
    pulls = [np.add.reduceat((gain * fit.normal[:, axis])[:, order], starts, axis=1) for axis in (0, 1)]  # (k, groups) by x and by y

    def moved(places: Array) -> tuple[Array, Array]:
        """Covariance (n, k) of the errors in x, and in y, at places (n, 2) with the amounts of the motions."""
        both = np.concatenate(pulls).T  # (groups, 2 k)
        blocks = [_covariance(places[i : i + _AT_ONCE], at, near, A, share) @ both for i in range(0, len(places), _AT_ONCE)]
        found = np.concatenate(blocks)
        return found[:, : len(gain)], found[:, len(gain) :]

    x, y = moved(at)
    pose = pulls[0] @ x + pulls[1] @ y
    x, y = moved(there.at)
    with_pose = there.normal[:, :1] * x + there.normal[:, 1:] * y
    smooth = near + 2 * (there.rates * with_pose).sum(axis=1) + ((there.rates @ pose) * there.rates).sum(axis=1)
    apart, of_apart = _independent(there, gain, A * A / 6, there is fit)
    return smooth + apart, pose + of_apart


def _covariance(places: Array, others: Array, near: float, A: float, share: float) -> Array:
    """Covariance (n, g) of the part of the device's error that changes slowly."""
    square = np.square(places[:, None, 0] - others[:, 0]) + np.square(places[:, None, 1] - others[:, 1])
    return np.asarray(near - share / 6 * (2 * A * np.sqrt(square) + share * square))


def largest_by_noise_mm(deviation_mm: ArrayLike, standard_mm: ArrayLike, counts: ArrayLike = 1) -> float:
    """How much independent noise raises the largest |deviation| on average: the largest of many values is biased upward.

    deviation_mm : (m,) as measured or true; NaN counts for nothing
    standard_mm  : (m,) or one number: standard deviation of the noise of each
    counts       : (m,) or one number: how many points have that deviation
    """
    e = np.abs(np.asarray(deviation_mm, dtype=np.float64))
    u = np.broadcast_to(np.asarray(standard_mm, dtype=np.float64), e.shape)
    times = np.broadcast_to(np.asarray(counts, dtype=np.float64), e.shape)
    counted = np.isfinite(e) & np.isfinite(u) & (times > 0)
    e, u, times = e[counted], u[counted], times[counted]
    if not len(e) or not u.max() > 0:
        return 0.0
    from scipy.special import ndtr  # noqa: PLC0415 - it takes a quarter of a second, and nothing else here needs it

    largest, widest = float(e.max()), float(u.max())
    near = (e > largest - _FAR * widest) & (u > 0)
    low, high = float(max(e[u <= 0].max(initial=0.0), largest - _FAR * widest, 0.0)), largest + _FAR * widest
    t = np.linspace(low, high, _NODES)
    below = np.ones(_NODES)
    for value, spread, count in zip(e[near].tolist(), u[near].tolist(), times[near].tolist(), strict=True):
        below *= (ndtr((t - value) / spread) - ndtr((-t - value) / spread)) ** count
    return float(high - np.trapezoid(below, t) - largest)
