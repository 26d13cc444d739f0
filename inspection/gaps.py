"""How much of the profile was measured: gaps between neighbouring stations, and the coverage that follows from them.

What lies between two neighbouring points was not seen. It counts as measured where the gap is no longer than a stated length, so
only the places of the points decide, never their density: a further point never lowers the coverage, a lost one never raises it.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from inspection.nominal import NominalProfile

Array = NDArray[np.float64]

_UNDULATIONS = 50  # on the whole profile: the shortest form that a part is taken to have, as roundness filters have it
_GAPS_A_WAVE = 2  # a gap of half a wave still has a point on every crest and in every hollow


@dataclass(frozen=True, slots=True)
class Gap:
    """The longest stretch of the profile without a judged point; `from_mm` is above `to_mm` where it crosses the seam.

    length_mm     : its length; the whole profile where nothing was judged
    could_hide_mm : how far the nominal stands off the straight line across it: so much of the part could be missing there unseen
    """

    from_mm: float
    to_mm: float
    length_mm: float
    could_hide_mm: float


def default_gap_max_mm(nominal: NominalProfile) -> float:
    """The longest gap that counts as measured where nobody says otherwise: half a wave of 50 undulations, a hundredth of the length."""
    return nominal.length_mm / (_UNDULATIONS * _GAPS_A_WAVE)


def gap_lengths(sorted_mm: Array, nominal: NominalProfile) -> Array:
    """Distances between neighbouring stations (j,) in rising order: over the seam as the last, or from both ends as first and last."""
    if nominal.curve.closed:
        return np.diff(np.append(sorted_mm, sorted_mm[0] + nominal.length_mm))
    return np.diff(np.concatenate([[0.0], sorted_mm, [nominal.length_mm]]))


def coverage(station_mm: Array, nominal: NominalProfile, gap_max_mm: float | None = None) -> float:
    """Share of the nominal's length between neighbouring judged points at stations (j,) that are no more than `gap_max_mm` apart.

    gap_max_mm : None takes `default_gap_max_mm`
    """
    if not len(station_mm):
        return 0.0
    limit = default_gap_max_mm(nominal) if gap_max_mm is None else gap_max_mm
    gaps = gap_lengths(np.sort(station_mm), nominal)
    return float(gaps[gaps <= limit].sum() / nominal.length_mm)


def largest_gap(station_mm: Array, nominal: NominalProfile) -> Gap:
    """The longest stretch without a judged point among stations (j,)."""
    length, closed = nominal.length_mm, nominal.curve.closed
    if not len(station_mm):
        return Gap(0.0, length, length, nominal.size_mm)
    stations = np.sort(station_mm)
    gaps = gap_lengths(stations, nominal)
    longest = int(gaps.argmax())
    if closed:
        first, last = stations[longest], stations[(longest + 1) % len(stations)]
    else:
        first, last = np.concatenate([[0.0], stations, [length]])[longest : longest + 2]
    return Gap(float(first), float(last), float(gaps[longest]), _off_the_line_mm(float(first), float(gaps[longest]), nominal))


def _off_the_line_mm(first_mm: float, length_mm: float, nominal: NominalProfile) -> float:
    """How far the nominal from a station on, over a length, stands off the straight line between its two ends."""
    ahead = np.mod(nominal.station_mm - first_mm, nominal.length_mm) if nominal.curve.closed else nominal.station_mm - first_mm
    inside = np.flatnonzero((ahead >= 0) & (ahead <= length_mm))
    if len(inside) < 3:
        return 0.0
    arc = nominal.points_mm[inside[np.argsort(ahead[inside], kind="stable")]]
    chord, arms = arc[-1] - arc[0], arc - arc[0]
    span = float(np.hypot(*chord))
    if span <= 1e-9 * length_mm:
        return float(np.hypot(*arms.T).max())
    return float(np.abs(chord[0] * arms[:, 1] - chord[1] * arms[:, 0]).max() / span)


def station_weights(station_mm: Array, takes_part: NDArray[np.bool_], nominal: NominalProfile) -> Array:
    """How much of the profile each point (m,) stands for, divided by the mean: half the distance to both neighbours in station order.

    A side counts with half the default gap at most, so that the points beside a hole do not stand for what was not measured. Points
    in one place share what that place stands for, so that neither dwelling nor a dense side draws the fit to itself. Points that
    take no part have weight 1.
    """
    weights = np.ones(len(station_mm))
    rows = np.flatnonzero(takes_part)
    if len(rows) < 2:
        return weights
    rows = rows[np.argsort(station_mm[rows], kind="stable")]
    stations, cap = station_mm[rows], default_gap_max_mm(nominal) / 2
    gaps = gap_lengths(stations, nominal)
    before, after = (np.roll(gaps, 1), gaps) if nominal.curve.closed else (gaps[:-1], gaps[1:])
    sides = np.minimum(before / 2, cap) + np.minimum(after / 2, cap)
    if not nominal.curve.closed:  # an end belongs to its point alone
        sides[0] += min(before[0], cap) - min(before[0] / 2, cap)
        sides[-1] += min(after[-1], cap) - min(after[-1] / 2, cap)
    weights[rows] = sides / sides.mean()
    return weights
