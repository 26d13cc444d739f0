"""The curve that samples tell by themselves: a cubic piece from each to its neighbour, for nominals of few samples.

The published method interpolates between the sample whose Voronoi region a point lies in and the neighbour whose region it leans to, by
circles; its last sentence asks for better interpolation where samples are few. Such a pair tells more than its circles: two places, two
tangents and the arc length between them, which is a cubic Hermite piece. Its error falls with the fourth power of the spacing, theirs with
the second. The closest of all pieces is taken, so that at a thin edge, too, the foot lies on the branch that is nearest.
"""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from inspection.curve import NurbsCurve
from inspection.foot_grid import FootGrid, build_foot_grid

if TYPE_CHECKING:
    from inspection.sample_table import ProfileSamples

Array = NDArray[np.float64]

_DEGREE = 3
_SAME_PLACE = 1e-12  # of the length: the two samples of a corner


@dataclass(frozen=True, slots=True, eq=False)
class HermiteProfile:
    """The cubic pieces between the samples of a nominal, ready for the search of closest points.

    grid      : finds the closest point of the pieces; the parameter that it gives is the arc length of the nominal at the samples
    curve     : the pieces as one curve
    parameter : (k,) parameters of the nominal at the samples, in order
    speed     : (k,) how fast the nominal runs there, in mm per unit of its parameter
    station_mm : (k,) the arc lengths there
    """

    grid: FootGrid
    curve: NurbsCurve
    parameter: Array
    speed: Array
    station_mm: Array

    def parameters_of_nominal(self, along: Array) -> Array:
        """Parameters (m,) of the nominal at parameters (m,) of the pieces, by a cubic between the samples."""
        last = len(self.station_mm) - 2
        piece = np.clip(np.searchsorted(self.station_mm, along, side="right") - 1, 0, last)
        start, end = self.station_mm[piece], self.station_mm[piece + 1]
        length = end - start
        t = (along - start) / np.where(length > 0, length, 1.0)
        begin, rise = self.parameter[piece], self.parameter[piece + 1] - self.parameter[piece]
        leave, reach = length / self.speed[piece], length / self.speed[piece + 1]
        return np.asarray(begin + t * (leave + t * (3 * rise - 2 * leave - reach + t * (leave + reach - 2 * rise))))


def hermite_profile(samples: "ProfileSamples", curve: NurbsCurve) -> HermiteProfile:
    """The cubic pieces through the samples of a curve, each as long as the curve between its ends.

    At a corner one piece ends with the tangent before it, and another begins with that behind it. A closed curve is cut where its parameter
    begins; if no sample lies there, one is added.
    """
    start, end = curve.domain
    inside = np.where(samples.parameter > end, samples.parameter - (end - start), samples.parameter)  # pieces run on across the seam
    order = np.argsort(inside, kind="stable")
    parameter, speed = inside[order], samples.speed[order]
    station, place, tangent = samples.station_mm[order], samples.points_mm[order], samples.tangent[order]
    if curve.closed and parameter[-1] < np.nextafter(end, start):
        parameter, station, place, tangent, speed = _joined_at_seam(parameter, station, place, tangent, speed, curve)
    station[-1] = curve.length_mm if curve.closed else station[-1]
    return HermiteProfile(build_foot_grid(found := _pieces(station, place, tangent, curve.closed)), found, parameter, speed, station)


def _joined_at_seam(
    parameter: Array, station: Array, place: Array, tangent: Array, speed: Array, curve: NurbsCurve
) -> tuple[Array, Array, Array, Array, Array]:
    """The samples of a closed curve with one at the beginning and one at the end of its parameter."""
    start, end = curve.domain
    there, first = (row[0] for row in curve.derivatives(start, 1))
    fast = float(np.hypot(*first))
    if parameter[0] > start:
        parameter, station, speed = np.append(start, parameter), np.append(0.0, station), np.append(fast, speed)
        place, tangent = np.vstack([there, place]), np.vstack([first / fast, tangent])
    place, tangent = np.vstack([place, place[:1]]), np.vstack([tangent, tangent[:1]])
    return np.append(parameter, end), np.append(station, curve.length_mm), place, tangent, np.append(speed, speed[0])


def _pieces(station: Array, place: Array, tangent: Array, closed: bool) -> NurbsCurve:
    """Cubic pieces between places (k, 2) with unit tangents (k, 2), over arc lengths (k,): a cubic B-spline with double knots.

    A corner is two places at one arc length: there the knot is threefold, and the corner is a control point.
    """
    step = np.diff(station)
    is_piece = step > _SAME_PLACE * station[-1]
    third = step[:, None] / 3
    inner = np.stack([place[:-1] + tangent[:-1] * third, place[1:] - tangent[1:] * third], axis=1)  # (k - 1, 2, 2)
    control, knots = [place[:1]], [np.full(_DEGREE + 1, station[0])]
    ends = np.flatnonzero(is_piece)
    for k in ends.tolist():
        control.append(inner[k])
        is_corner = k + 1 < len(is_piece) and not is_piece[k + 1]
        if is_corner and k != ends[-1]:
            control.append(place[k + 1 : k + 2])
        knots.append(np.full(_DEGREE if is_corner else _DEGREE - 1, station[k + 1]))
    control.append(place[-1:])
    knots[-1] = np.full(_DEGREE + 1, station[-1])
    return NurbsCurve(_DEGREE, np.concatenate(control), np.concatenate(knots), closed=closed)
