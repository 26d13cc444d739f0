"""Profile filters along the arc length: Gaussian regression of order 0 or 2, and its robust form (ISO 16610-21, -28 and -31).

At every station a polynomial is fitted to the deviations near it, weighted by a Gaussian of the distance and by how much of the
profile each point stands for; its value there is the waviness. Weights by arc length keep a dense stretch from drawing the curve
to itself. The kernel's width follows from the order, so that a wave as long as the cutoff is halved by either order.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]
Rows = NDArray[np.int64]
FilterOrder = Literal[0, 2]

# Transmission of a sine: exp(-z) by order 0, (1 + z) exp(-z) by order 2, z = pi (gamma cutoff / wavelength)^2. One half at the cutoff:
_GAMMA = {0: math.sqrt(math.log(2) / math.pi), 2: 0.7309134280564225}  # the second solves (1 + z) exp(-z) = 1/2
_WINDOW = {0: 1.0, 2: 1.5}  # of the cutoff, to either side: beyond it the kernel is below 2e-6
_GAP = 0.5  # of the cutoff: farther from every point there is no value
_TUKEY = 4.4478  # times the median of |residual|: beyond it a point counts for nothing (ISO 16610-31)
_MOST_ROUNDS = 50
_NO_SPIKE_MM = 1e-6  # a residual below a nanometre is none, however smooth the profile is
_SETTLED = 1e-6  # relative change of Tukey's limit
_DETERMINED = 1e-10  # determinant of the moments, in units of the cutoff, below which the points determine no parabola
_BLOCK = 128  # places whose sums are one product of matrices, where they lie within
_BLOCK_REACH = 0.7  # of the cutoff: powers of greater distances lose digits
_MOST_PAIRS = 1 << 22  # kernel values that are kept from round to round
_NODES = 128  # a cutoff: where points are denser, those between two nodes are put together


@dataclass(frozen=True, slots=True)
class ProfileFilter:
    """What is filtered out: waves much shorter than the cutoff.

    cutoff_mm : the wavelength of which half the amplitude passes
    order     : of the polynomial; 2 follows curvature, and stays right up to the ends of an open profile
    robust    : weight spikes down, so that they do not draw the waviness to themselves (ISO 16610-31)
    """

    cutoff_mm: float
    order: FilterOrder = 2
    robust: bool = False

    def __post_init__(self) -> None:
        if not 0 < self.cutoff_mm < math.inf:
            raise ValueError(f"the cutoff must be a positive length, not {self.cutoff_mm:g} mm")
        if self.order not in _GAMMA:
            raise ValueError(f"the order of a filter is 0 or 2, not {self.order}")

    def transmission(self, wavelength_mm: float) -> float:
        """Share of a sine's amplitude that passes, where the points are dense and far from ends."""
        z = math.pi * (_GAMMA[self.order] * self.cutoff_mm / wavelength_mm) ** 2
        return math.exp(-z) * (1.0 if self.order == 0 else 1.0 + z)

    @property
    def words(self) -> str:
        """The filter as a verdict names it."""
        kind = "robust Gaussian regression" if self.robust else "Gaussian regression"
        return f"{kind} of order {self.order}, cutoff {self.cutoff_mm:g} mm"


@dataclass(frozen=True, slots=True, eq=False)
class FilteredProfile:
    """The waviness of m points, and how it was reached.

    waviness_mm : (m,) or at the stations asked for; NaN where no point lies within half a cutoff, or where the points near by do
                  not determine the polynomial
    weight      : (m,) of each point by the robust filter, 0 for a spike; 1 without it, 0 for points that took no part
    rounds      : of the robust filter; 1 without it
    settled     : the robust filter's limit changed by less than a millionth in its last round; True without it. Where it did not, the
                  limit goes to and fro between residuals of neighbouring size
    pairs       : kernel values that were worked out
    """

    waviness_mm: Array
    weight: Array
    rounds: int
    settled: bool
    pairs: int

    def __post_init__(self) -> None:
        self.waviness_mm.setflags(write=False)
        self.weight.setflags(write=False)


class _Stretch(NamedTuple):
    """A smooth stretch of the profile: where it begins, how long it is, whether it runs into itself, and the whole profile around it."""

    start_mm: float
    length_mm: float
    circular: bool
    profile_mm: float
    wraps: bool
    last: bool

    def along(self, station_mm: Array) -> Array:
        """How far stations (n,) lie from its start, NaN for those outside it."""
        along = station_mm - self.start_mm
        if self.wraps:
            along = np.mod(along, self.profile_mm)
        inside = (along >= 0) & ((along <= self.length_mm) if self.last else (along < self.length_mm))
        return np.where(inside, along, np.nan)


def filter_profile(
    station_mm: ArrayLike,
    deviation_mm: ArrayLike,
    length_mm: float,
    closed: bool,
    wanted: ProfileFilter,
    corners_mm: ArrayLike = (),
    at_mm: ArrayLike | None = None,
) -> FilteredProfile:
    """Filter deviations (m,) at stations (m,), in any order, along a profile. Fit first: filtered points have another pose.

    station_mm : arc length of the feet, 0 to length_mm; points whose station or deviation is NaN take no part
    closed     : the profile runs into itself, so that its seam is no end
    corners_mm : (c,) stations at which the profile is cut: no value depends on points beyond a corner. A point on a corner belongs
                 to the stretch that begins there
    at_mm      : (n,) stations at which the waviness is asked for; None asks at the points

    Raises ValueError for a cutoff longer than the profile.
    """
    station, deviation = np.asarray(station_mm, dtype=np.float64), np.asarray(deviation_mm, dtype=np.float64)
    if station.shape != deviation.shape or station.ndim != 1:
        raise ValueError(f"stations and deviations must have one shape (m,), got {station.shape} and {deviation.shape}")
    if not wanted.cutoff_mm <= length_mm:
        raise ValueError(f"a cutoff of {wanted.cutoff_mm:g} mm is longer than the profile ({length_mm:g} mm)")
    asked = station if at_mm is None else np.asarray(at_mm, dtype=np.float64)
    waviness, weight, rounds, settled, pairs = np.full(len(asked), np.nan), np.zeros(len(station)), 1, True, 0
    for stretch in _stretches(length_mm, closed, np.unique(np.asarray(corners_mm, dtype=np.float64))):
        along = stretch.along(station)
        rows = np.flatnonzero(np.isfinite(along) & np.isfinite(deviation))
        if not len(rows):
            continue
        rows = rows[np.argsort(along[rows], kind="stable")]
        smoother = _Smoother(stretch, along[rows], deviation[rows], wanted)
        weight[rows], taken, stands = smoother.weigh()
        where = stretch.along(asked)
        here = np.flatnonzero(np.isfinite(where))
        here = here[np.argsort(where[here], kind="stable")]
        waviness[here] = smoother.values(weight[rows], where[here])
        rounds, settled, pairs = max(rounds, taken), settled and stands, pairs + smoother.pairs
    return FilteredProfile(waviness, weight, rounds, settled, pairs)


def _stretches(length_mm: float, closed: bool, corners_mm: Array) -> list[_Stretch]:
    """The profile cut at its corners (c,), which rise."""
    if closed and not len(corners_mm):
        return [_Stretch(0.0, length_mm, True, length_mm, True, False)]
    if closed:
        corners = np.unique(np.mod(corners_mm, length_mm))
        lengths = np.diff(np.append(corners, corners[0] + length_mm))
        return [_Stretch(float(s), float(n), False, length_mm, True, False) for s, n in zip(corners, lengths, strict=True)]
    inner = corners_mm[(corners_mm > 0) & (corners_mm < length_mm)]
    starts, lengths = np.append(0.0, inner), np.diff(np.concatenate([[0.0], inner, [length_mm]]))
    return [_Stretch(float(s), float(n), False, length_mm, False, s == starts[-1]) for s, n in zip(starts, lengths, strict=True)]


class _Smoother:
    """The regression over the points of one stretch, in the order of their stations (k,)."""

    def __init__(self, stretch: _Stretch, station: Array, deviation: Array, wanted: ProfileFilter) -> None:
        self._stretch, self._station, self._deviation, self._filter = stretch, station, deviation, wanted
        self._share = _shares(station, stretch, wanted.cutoff_mm)
        self._known: _Known | None = None
        self.pairs = 0  # kernel values that were worked out

    def weigh(self) -> tuple[Array, int, bool]:
        """Weight (k,) of each point by the robust filter, 1 without it; the rounds, and whether the weights stand."""
        weight = np.ones(len(self._station))
        if not self._filter.robust:
            return weight, 1, True
        limit = np.inf
        for taken in range(1, _MOST_ROUNDS + 1):
            residual = np.abs(self._deviation - self._smooth(weight, self._station))
            residual = np.where(np.isnan(residual), 0.0, residual)
            before, limit = limit, max(_TUKEY * _weighted_median(residual, self._share), _NO_SPIKE_MM)
            if abs(limit - before) <= _SETTLED * limit:
                return weight, taken, True
            weight = np.where(residual < limit, np.square(1.0 - np.square(residual / limit)), 0.0)
        return weight, _MOST_ROUNDS, False

    def values(self, weight: Array, at: Array) -> Array:
        """The waviness at places (n,) of the stretch, with weights (k,) beside the shares; NaN far from every point."""
        far = self._distance_to_nearest(at) > _GAP * self._filter.cutoff_mm
        return np.where(far, np.nan, self._smooth(weight, at))

    def _smooth(self, weight: Array, at: Array) -> Array:
        """The waviness at places (n,) of the stretch, near to points or not."""
        station, heavy, deviation = self._station, weight * self._share, self._deviation
        step = self._filter.cutoff_mm / _NODES
        if len(station) * step <= self._stretch.length_mm:
            return self._regress(station, heavy, deviation, at)
        count = math.ceil(self._stretch.length_mm / step)
        step = self._stretch.length_mm / count
        return self._by_nodes(*_put_together(station, self._share, heavy, deviation, (step, count)), at, step, count)

    def _by_nodes(self, station: Array, heavy: Array, deviation: Array, at: Array, step: float, count: int) -> Array:
        """The waviness at places (n,), through four values of an even grid each."""
        first = np.floor(at / step).astype(np.int64) - 1
        if not self._stretch.circular:
            first = np.clip(first, 0, count - 3)  # no value is worked out beyond an end
        grid = self._regress(station, heavy, deviation, np.arange(-1, count + 3, dtype=np.float64) * step)
        t = at / step - first
        four = [grid[first + 1 + i] for i in range(4)]
        parts = (-(t - 1) * (t - 2) * (t - 3) / 6, t * (t - 2) * (t - 3) / 2, -t * (t - 1) * (t - 3) / 2, t * (t - 1) * (t - 2) / 6)
        return np.asarray(sum(part * value for part, value in zip(parts, four, strict=True)))

    def _regress(self, station: Array, heavy: Array, deviation: Array, at: Array) -> Array:
        """The local polynomial's value at places (n,), from points (k,) that weigh `heavy`."""
        known = self._known
        if known is None or not (np.array_equal(station, known.station) and np.array_equal(at, known.at)):
            row, along = self._with_images(station)
            known = self._known = _Known(station, at, row, _Kernel(along, at, self._filter))
            self.pairs += known.kernel.pairs_kept
        self.pairs += known.kernel.pairs_anew
        return known.kernel.values(heavy[known.row], deviation[known.row])

    def _with_images(self, station: Array) -> tuple[Rows, Array]:
        """Rows and stations of the points, and on a closed stretch of their images before and behind it, as far as a window reaches."""
        if not self._stretch.circular:
            return np.arange(len(station)), station
        length, reach = self._stretch.length_mm, (_WINDOW[self._filter.order] + 4 / _NODES) * self._filter.cutoff_mm
        around = range(-math.ceil(reach / length), math.ceil(reach / length) + 1)
        every = np.concatenate([station + k * length for k in around])
        near = np.flatnonzero((every >= -reach) & (every <= length + reach))
        return near % len(station), every[near]

    def _distance_to_nearest(self, at: Array) -> Array:
        """How far places (n,) are from the nearest point."""
        station = self._station
        if self._stretch.circular:
            station = np.concatenate([station[-1:] - self._stretch.length_mm, station, station[:1] + self._stretch.length_mm])
        after = np.searchsorted(station, at)
        behind, ahead = station[np.maximum(after - 1, 0)], station[np.minimum(after, len(station) - 1)]
        return np.asarray(np.minimum(np.abs(at - behind), np.abs(ahead - at)))


def _shares(station: Array, stretch: _Stretch, cutoff_mm: float) -> Array:
    """Half the distances to both neighbours (k,), a side half a cutoff at most. Points at one station share what it stands for."""
    places, which, points = np.unique(station, return_inverse=True, return_counts=True)
    gaps = np.minimum(np.diff(places) / 2, _GAP * cutoff_mm)
    seam = min((stretch.length_mm - (places[-1] - places[0])) / 2, _GAP * cutoff_mm) if stretch.circular else 0.0
    shares = np.append(seam, gaps) + np.append(gaps, seam)
    if len(places) == 1:
        shares = np.ones(1)
    return np.asarray((shares / points)[which])


def _weighted_median(values: Array, weights: Array) -> float:
    """The value (of k) below and above which half the weight lies."""
    order = np.argsort(values, kind="stable")
    below = np.cumsum(weights[order])
    return float(values[order[np.searchsorted(below, below[-1] / 2)]])


def _put_together(station: Array, share: Array, heavy: Array, deviation: Array, cells: tuple[float, int]) -> tuple[Array, Array, Array]:
    """The points between two nodes of an even grid put together to one, at their mean place, which their robust weights do not move.

    Gives the place, the weight and the weighted mean deviation of each.
    """
    step, count = cells
    node = np.minimum((station / step).astype(np.int64), count - 1)
    sums = [np.bincount(node, weights, count) for weights in (share, share * station, heavy, heavy * deviation)]
    filled = np.flatnonzero(sums[0] > 0)
    shares, places, total, mean = (np.asarray(each[filled], dtype=np.float64) for each in sums)
    return places / shares, total, np.divide(mean, total, out=np.zeros(len(filled)), where=total > 0)


class _Known(NamedTuple):
    """A kernel, with what it was made for: stations (k,) of the points, places (n,), and the point (w,) of each that it takes."""

    station: Array
    at: Array
    row: Rows
    kernel: "_Kernel"


class _Block(NamedTuple):
    """Places (b,) near each other, the points (w,) in their windows, and the kernel (b, w) between them where it is kept."""

    places: slice
    points: slice
    kernel: Array | None


class _Kernel:
    """The regression of points (k,) to places (n,), both at rising stations, of which weights and deviations alone change.

    The sums over g x^k about each place are found from those about the middle of a block of places, which are one product of matrices;
    the binomial theorem leads from one to the other.
    """

    def __init__(self, station: Array, at: Array, wanted: ProfileFilter) -> None:
        self._station, self._places, self._filter = station, at, wanted
        self.pairs_kept, self.pairs_anew = 0, 0  # kernel values that are worked out once, and those that are for each use
        self._blocks: list[_Block] = []
        middles: list[float] = []
        for places, points, middle in self._cut():
            block = _Block(places, points, None)
            pairs = (places.stop - places.start) * (points.stop - points.start)
            if self.pairs_kept + pairs <= _MOST_PAIRS:
                self.pairs_kept += pairs
                block = block._replace(kernel=self._values_of(block))
            else:
                self.pairs_anew += pairs
            self._blocks.append(block)
            middles.append(middle)
        counts = [(block.places.stop - block.places.start, block.points.stop - block.points.start) for block in self._blocks]
        of_place, of_point = (np.repeat(middles, [count[i] for count in counts]) for i in (0, 1))
        self._rows = np.concatenate([np.arange(b.points.start, b.points.stop) for b in self._blocks] or [np.empty(0, np.int64)])
        self._away = (self._places - of_place) / wanted.cutoff_mm
        self._powers = ((station[self._rows] - of_point) / wanted.cutoff_mm)[:, None] ** np.arange(2 * wanted.order + 1)

    def values(self, heavy: Array, deviation: Array) -> Array:
        """The polynomial's value (n,) at the places, of points that weigh `heavy` (k,). NaN where they do not determine it."""
        weights = heavy[self._rows, None]
        columns = np.hstack([self._powers, self._powers[:, : self._filter.order + 1] * deviation[self._rows, None]]) * weights
        sums, begin = np.empty((len(self._places), columns.shape[1])), 0
        for block in self._blocks:
            end = begin + block.points.stop - block.points.start
            np.matmul(self._values_of(block) if block.kernel is None else block.kernel, columns[begin:end], out=sums[block.places])
            begin = end
        return _polynomial_values(sums, self._away, self._filter.order)

    def _cut(self) -> Iterator[tuple[slice, slice, float]]:
        """Blocks of places, with the points in their windows, and their middles."""
        at, cutoff, first = self._places, self._filter.cutoff_mm, 0
        window = _WINDOW[self._filter.order] * cutoff
        while first < len(at):
            stop = min(first + _BLOCK, int(np.searchsorted(at, at[first] + _BLOCK_REACH * cutoff, side="right")))
            low = int(np.searchsorted(self._station, at[first] - window, "left"))
            high = int(np.searchsorted(self._station, at[stop - 1] + window, "right"))
            yield slice(first, stop), slice(low, high), float(at[first] + at[stop - 1]) / 2
            first = stop

    def _values_of(self, block: _Block) -> Array:
        """The kernel (b, w) of a block, zero beyond the window."""
        x = (self._station[block.points] - self._places[block.places, None]) / self._filter.cutoff_mm
        g = np.exp(-math.pi / _GAMMA[self._filter.order] ** 2 * x * x)
        g[np.abs(x) > _WINDOW[self._filter.order]] = 0.0
        return g


def _polynomial_values(sums: Array, away: Array, order: FilterOrder) -> Array:
    """Values (n,) at places `away` (n,) from the middles that sums (n, ...) are about: those over g x^k, then over g z x^k."""
    total = sums[:, 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        if order == 0:
            return np.asarray(np.where(total > 0, sums[:, 1] / total, np.nan))
        m = [sums[:, k] / total for k in range(8)]
        d = -away
        s1 = m[1] + d
        s2 = m[2] + d * (2 * m[1] + d)
        s3 = m[3] + d * (3 * m[2] + d * (3 * m[1] + d))
        s4 = m[4] + d * (4 * m[3] + d * (6 * m[2] + d * (4 * m[1] + d)))
        t0, t1, t2 = m[5], m[6] + d * m[5], m[7] + d * (2 * m[6] + d * m[5])
        c0, c1, c2 = s2 * s4 - s3 * s3, s2 * s3 - s1 * s4, s1 * s3 - s2 * s2  # cofactors of the first row of the normal matrix
        determinant = c0 + s1 * c1 + s2 * c2
        return np.asarray(np.where(determinant > _DETERMINED, (c0 * t0 + c1 * t1 + c2 * t2) / determinant, np.nan))
