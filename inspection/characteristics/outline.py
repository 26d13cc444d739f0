"""An airfoil section: its outline from the trailing edge over the leading edge back to the trailing edge, and its two sides.

The leading edge is the place of largest curvature in the front of the section, the trailing edge is where the outline is open,
has a corner, or ends in a flat between two corners. On an outline that is smooth all around, the two edges are its tips, and the
leading one is the blunter: the one with the smaller curvature (the convention of PC-DMIS Blade, "Nominal File Keywords").
"""

from dataclasses import dataclass, field, replace
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from inspection.characteristics.zoom import find_maximum
from inspection.curve import NurbsCurve
from inspection.errors import NominalError
from inspection.first_use import OnFirstUse
from inspection.nominal import NominalProfile
from inspection.rigid import RigidTransform, rotate

Array = NDArray[np.float64]
TrailingEdge = Literal["open", "sharp", "blunt", "round"]
Edge = Literal["leading", "trailing"]
Side = Literal["upper", "lower"]

_SAMPLES = 1200
FRONT = 0.1  # of the section's length: how far from the foremost place its nose may lie
_WIDEST_GAP = 0.2  # of the section's length: an outline that is open wider than this has lost a part, and is no section
_SCOUT = 2000
_CLOSEST = 0.2  # of the steps beside it: over a step shorter than this, round-off would bend a spline
_AS_LARGE = 1e-6  # of a curvature: samples that differ by less lie on one arc
_END_ROUNDS = 9  # each narrows the end of an arc sixteenfold


class Stations(NamedTuple):
    """Stations in mm along the curve of a section, rising from its first end through the seam of a closed curve.

    ends        : of both ends; those of a round outline are a whole turn apart
    at_sample   : (n,) of the samples
    fine        : (j,) parameters of the samples without very close pairs, and of the middles between them; fine_mm : (j,) their stations
    """

    ends: tuple[float, float]
    at_sample: Array
    fine: Array
    fine_mm: Array


@dataclass(frozen=True, slots=True, eq=False)
class AirfoilSection:
    """The outline of an airfoil section, seen as one way from trailing edge to trailing edge.

    curve         : the curve that it lies on
    first, last   : parameters of its two ends at the trailing edge; `last` may lie beyond the domain of a closed curve, which wraps
    nose          : parameter of the largest curvature in the front: the leading edge, between the two sides
    trailing      : "open" where the curve has two ends, "sharp" at a corner, "blunt" at a flat between two corners, "round" on a
                    smooth outline, whose tip is then at `first` and at `last`
    upper_first   : the side from `first` to `nose` is the upper one. The upper side is on the left of who looks from the leading
                    to the trailing edge: it lies above in the usual drawing, with the leading edge on the left
    inward        : 1 where the inside lies on the left of the curve, else -1
    outward       : 1 where out of material is on the left of the curve, else -1; the material of a bare curve lies inside
    parameter     : (n,) rising from first to last, dense where the outline turns
    points_mm     : (n, 2)
    normal        : (n, 2) unit vectors into the section
    nose_sample   : the number of the sample at the nose
    length_mm     : largest distance of two samples, the size of the section
    stations      : see `Stations`; those of a section that was moved are the same
    """

    curve: NurbsCurve
    first: float
    last: float
    nose: float
    trailing: TrailingEdge
    upper_first: bool
    inward: float
    outward: float
    parameter: Array = field(repr=False)
    points_mm: Array = field(repr=False)
    normal: Array = field(repr=False)
    nose_sample: int
    length_mm: float
    stations: "OnFirstUse[Stations]" = field(repr=False)

    def __post_init__(self) -> None:
        for array in (self.parameter, self.points_mm, self.normal):
            array.setflags(write=False)

    def point(self, u: ArrayLike) -> Array:
        """Points (m, 2) at the parameters u (m,)."""
        return np.asarray(self.derivatives(np.asarray(u), 0)[0])

    def derivatives(self, u: Array, order: int) -> Array:
        """Point and derivatives by u up to `order`: (order + 1, m, 2)."""
        return self.curve.few_derivatives(self._on_outline(u), order)

    def frame(self, u: Array) -> tuple[Array, Array, Array, Array]:
        """Point (m, 2), derivative by u (m, 2), second derivative (m, 2) and unit normal into the section (m, 2)."""
        point, first, second = self.derivatives(u, 2)
        unit = first / np.hypot(first[:, 0], first[:, 1])[:, None]
        return point, first, second, self.inward * np.column_stack([-unit[:, 1], unit[:, 0]])

    def moved(self, motion: RigidTransform) -> "AirfoilSection":
        """The same section after a rigid motion."""
        control, curve = motion.apply(self.curve.control_points_mm), self.curve
        moved = NurbsCurve(curve.degree, control, curve.knots, curve.weights, curve.closed)
        return replace(self, curve=moved, points_mm=motion.apply(self.points_mm), normal=rotate(self.normal, motion.rotation_rad))

    def neighbourhood(self, sample: int) -> tuple[float, float]:
        """The parameters of the samples before and after one of them, so far as there are any; around a round edge there always are."""
        u, last = self.parameter, len(self.parameter) - 1
        low, high = float(u[max(sample - 1, 0)]), float(u[min(sample + 1, last)])
        if self.trailing == "round" and sample == 0:
            low = float(u[-2]) - (self.last - self.first)
        if self.trailing == "round" and sample == last:
            high = float(u[1]) + (self.last - self.first)
        return low, high

    def _on_outline(self, u: ArrayLike) -> Array:
        """Parameters (m,) within the outline: those beyond an end become that end, and a round outline has none."""
        return np.asarray(u if self.trailing == "round" else np.minimum(np.maximum(u, self.first), self.last), dtype=np.float64)

    def side_of(self, u: float) -> Side:
        """The side that a parameter lies on."""
        return "upper" if (u < self.nose) == self.upper_first else "lower"

    def sides(self) -> dict[Side, tuple[float, float]]:
        """First and last parameter of each side; one ends at the nose, and the other begins there."""
        one, other = (self.first, self.nose), (self.nose, self.last)
        return {"upper": one, "lower": other} if self.upper_first else {"upper": other, "lower": one}

    def ends_mm(self) -> Array:
        """The two ends (2, 2) of the outline at the trailing edge; they are one place where it is sharp or round."""
        return self.curve.point(np.array([self.first, self.last]))

    def support(self, direction: Array) -> float:
        """The parameter at which the outline reaches farthest in a direction (2,)."""
        best = int(np.argmax(self.points_mm @ direction))
        return find_maximum(lambda u: self.point(u) @ direction, *self.neighbourhood(best))


def find_airfoil(nominal: NurbsCurve | NominalProfile, leading_near_mm: ArrayLike | None = None) -> AirfoilSection:
    """The edges and sides of the airfoil section that a curve or nominal profile draws.

    leading_near_mm : (2,) a place nearer to the leading edge than to the trailing one, for a smooth outline whose blunter tip is
                      not the leading one. Elsewhere the trailing edge is where the outline is open or has its corners.

    Raises NominalError where the outline is no airfoil section: open wider than a fifth of its length, or with corners that are
    not those of a trailing edge.
    """
    curve = nominal.curve if isinstance(nominal, NominalProfile) else nominal
    first, last, trailing = _outline_range(curve, None if leading_near_mm is None else np.asarray(leading_near_mm, dtype=np.float64))
    return section_on(curve, first, last, trailing, nominal.outward if isinstance(nominal, NominalProfile) else None)


def section_on(
    curve: NurbsCurve, first: float, last: float, trailing: TrailingEdge, outward: float | None = None, nose: float | None = None
) -> AirfoilSection:
    """The section whose outline runs from parameter `first` to `last` of a curve.

    outward : None where the material lies inside
    nose    : where it is known, as on an actual section, whose largest curvature wanders with noise
    """
    u = dense_parameters(curve, first, last)
    points = curve.point(u)
    ends = points[[0, -1]]
    tail = ends.mean(axis=0)
    tip = points[int(np.argmax(np.hypot(*(points - tail).T)))]
    length = float(np.hypot(*(tip - tail)))
    gap = float(np.hypot(*(ends[1] - ends[0])))
    if gap > _WIDEST_GAP * length:
        what = f"its two corners lie {gap:.4g} mm apart" if curve.closed else f"it is open {gap:.4g} mm wide"
        raise NominalError(
            f"this outline is no airfoil section: {what}, and it is {length:.4g} mm long; "
            f"corners and openings are taken at a trailing edge only, up to {_WIDEST_GAP:.0%} of the length"
        )
    if nose is None:
        nose = largest_curvature(curve, u, tip, FRONT * length)
    u = np.unique(np.concatenate([u, [nose]]))
    points, tangent = curve.derivatives(u, 1)
    tangent = tangent / np.hypot(*tangent.T)[:, None]
    inward = 1.0 if _area(points) > 0 else -1.0
    return AirfoilSection(
        curve=curve,
        first=first,
        last=last,
        nose=nose,
        trailing=trailing,
        upper_first=inward > 0,  # anticlockwise from the trailing edge: the first side lies on the left of who looks at the trailing edge
        inward=inward,
        outward=-inward if outward is None else float(outward),
        parameter=u,
        points_mm=points,
        normal=inward * np.column_stack([-tangent[:, 1], tangent[:, 0]]),
        nose_sample=int(np.searchsorted(u, nose)),
        length_mm=length,
        stations=OnFirstUse(lambda: _stations_on(curve, (first, last), trailing, u)),
    )


def _stations_on(curve: NurbsCurve, ends: tuple[float, float], trailing: TrailingEdge, u: Array) -> Stations:
    """The stations of a section between two parameters of a curve, and those of its samples u (n,)."""
    start = float(curve.station_mm(ends[0])[0])
    end = start + curve.length_mm
    if trailing != "round":
        end = float(curve.station_mm(ends[1])[0])
        end = end if end > start else end + curve.length_mm
    fine = _without_close_pairs(u)
    fine = np.sort(np.concatenate([fine, (fine[1:] + fine[:-1]) / 2]))
    found = Stations((start, end), _rising_stations(curve, u, start), fine, _rising_stations(curve, fine, start))
    for array in found[1:]:
        array.setflags(write=False)
    return found


def _rising_stations(curve: NurbsCurve, u: Array, start: float) -> Array:
    """Stations (n,) of rising parameters (n,) of an outline that begins at a station, rising through the seam."""
    found = unwrap(curve, curve.station_mm(u), start)
    if curve.closed and found[-1] < found[-2]:  # the end of a full turn has the station of its beginning
        found[-1] += curve.length_mm
    return found


def unwrap(curve: NurbsCurve, station_mm: Array, start: float) -> Array:
    """Stations (m,) at or above that of an outline's beginning."""
    return np.where(station_mm < start, station_mm + curve.length_mm, station_mm) if curve.closed else station_mm


def _without_close_pairs(u: Array) -> Array:
    """Rising parameters (n,) without those that lie much nearer to the one before than their neighbours do to each other."""
    step = np.diff(u)
    beside = np.maximum(np.append(step[1:], 0.0), np.concatenate([[0.0], step[:-1]]))
    keep = np.concatenate([[True], step >= _CLOSEST * beside])
    keep[-1] = True
    return np.asarray(u[keep])


def _outline_range(curve: NurbsCurve, leading_near: Array | None) -> tuple[float, float, TrailingEdge]:
    """First and last parameter of the outline, and what its trailing edge is."""
    start, end = curve.domain
    if not curve.closed:
        return start, end, "open"
    period = end - start
    corners = curve.corners
    if not corners.size:
        return *_round_range(curve, leading_near), "round"
    if len(corners) == 1:
        return float(corners[0]), float(_just_before(corners[0] + period)), "sharp"
    if len(corners) == 2:
        lengths = np.diff(curve.station_mm(corners))[0]
        flat_first = lengths <= curve.length_mm / 2  # the flat is the short way from corner to corner
        first, last = (corners[1], corners[0] + period) if flat_first else (corners[0], corners[1])
        return float(first), float(_just_before(last)), "blunt"
    raise NominalError(f"the outline has {len(corners)} corners: an airfoil section has at most two, at its trailing edge")


def _just_before(u: float) -> float:
    """The parameter before a corner at which the curve still has the tangent from before it."""
    return float(np.nextafter(u, -np.inf))


def _round_range(curve: NurbsCurve, leading_near: Array | None) -> tuple[float, float]:
    """The range of a smooth closed outline from its trailing tip once around: the tips are the curvature maxima at its far ends."""
    start, end = curve.domain
    u = dense_parameters(curve, start, end)[:-1]
    points = curve.point(u)
    one = int(np.argmax(np.hypot(*(points - points[0]).T)))
    for _ in range(3):  # the farthest of the farthest settles at once on the two ends of the section
        other = one
        one = int(np.argmax(np.hypot(*(points - points[other]).T)))
    length = float(np.hypot(*(points[one] - points[other])))
    tips = [start + (_tip_around(curve, u, k, FRONT * length) - start) % (end - start) for k in (one, other)]
    place, curvature = curve.point(tips), np.abs(curve.curvature(np.array(tips)))
    if leading_near is not None:
        trailing = int(np.argmax(np.hypot(*(place - leading_near).T)))
    elif abs(curvature[0] - curvature[1]) > 1e-6 * curvature.max():
        trailing = int(np.argmax(curvature))
    else:  # two equal tips, as of an ellipse: the trailing one has the larger x, or above it the larger y
        trailing = int(np.argmax(place[:, 0] if abs(np.ptp(place[:, 0])) > 1e-6 * length else place[:, 1]))
    return tips[trailing], tips[trailing] + end - start


def _tip_around(curve: NurbsCurve, u: Array, sample: int, within_mm: float) -> float:
    """The parameter of the largest curvature near one of the samples u (n,) of a closed outline, wherever its seam lies.

    An edge that is an arc may run through the seam, which is then no end of it: the samples are taken from the far side of the outline.
    """
    start, end = curve.domain
    turn, row = np.divmod(np.arange(len(u)) + sample - len(u) // 2, len(u))
    return largest_curvature(curve, u[row] + turn * (end - start), curve.point(u[[sample]])[0], within_mm)


def dense_parameters(curve: NurbsCurve, first: float, last: float) -> Array:
    """Parameters (n,) from first to last, spread evenly over the arc length and the turning of the tangent, half each."""
    u = np.linspace(first, last, _SCOUT)
    tangent = curve.derivatives(u, 1)[1]
    heading = np.unwrap(np.arctan2(tangent[:, 1], tangent[:, 0]))
    travelled = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(curve.point(u), axis=0).T))])
    turned = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(heading)))])
    measure = travelled / travelled[-1] + (turned / turned[-1] if turned[-1] > 0 else 0.0)
    dense = np.interp(np.linspace(0.0, measure[-1], _SAMPLES), measure, u)
    dense[[0, -1]] = first, last
    return np.asarray(dense)


def largest_curvature(curve: NurbsCurve, u: Array, near_mm: Array, within_mm: float) -> float:
    """The parameter of the largest curvature, in either sense, among samples u (n,) that lie near a place (2,).

    Where an edge is an arc, the curvature is as large all along it: then it is the middle of the arc, by its length.
    """
    curvature = np.abs(curve.curvature(u))
    size = np.where(np.hypot(*(curve.point(u) - near_mm).T) < within_mm, curvature, -1.0)
    best = int(np.argmax(size))
    least = (1 - _AS_LARGE) * size[best]
    low, high = _run_around(curvature >= least, best)
    if high - low > 2:
        return _middle_of_arc(curve, u, (low, high), least)
    beside = u[max(best - 1, 0)], u[min(best + 1, len(u) - 1)]
    return find_maximum(lambda at: np.abs(curve.curvature(at)), float(beside[0]), float(beside[1]))


def _middle_of_arc(curve: NurbsCurve, u: Array, run: tuple[int, int], least: float) -> float:
    """The parameter in the middle of an arc, by its length, between the samples of a run: its ends lie within a step beyond them."""
    low, high = run
    if low == 0 and high == len(u) - 1:
        return float(u[low] + u[high]) / 2
    start = _end_of_arc(curve, float(u[low - 1]), float(u[low]), least) if low > 0 else float(u[low])
    end = _end_of_arc(curve, float(u[high + 1]), float(u[high]), least) if high < len(u) - 1 else float(u[high])
    before = float(curve.station_mm(start)[0])

    def travelled(at: ArrayLike) -> Array:
        return np.asarray(unwrap(curve, curve.station_mm(at), before) - before)

    half = float(travelled(end)[0]) / 2
    return find_maximum(lambda at: -np.abs(travelled(at) - half), start, end)


def _end_of_arc(curve: NurbsCurve, outside: float, inside: float, least: float) -> float:
    """The parameter between one outside of an arc and one inside of it at which the curvature begins to be at least so large."""
    for _ in range(_END_ROUNDS):
        looked = np.linspace(outside, inside, 17)
        first = int(np.argmax(np.append(np.abs(curve.curvature(looked))[:-1] >= least, True)))
        outside, inside = float(looked[max(first - 1, 0)]), float(looked[first])
    return inside


def _run_around(chosen: NDArray[np.bool_], at: int) -> tuple[int, int]:
    """First and last of the samples in a row that are chosen, around one of them."""
    others = np.flatnonzero(~chosen)
    before, behind = others[others < at], others[others > at]
    return (int(before[-1]) + 1 if before.size else 0), (int(behind[0]) - 1 if behind.size else len(chosen) - 1)


def _area(points: Array) -> float:
    """Signed area of the polygon of points (n, 2), positive when they run anticlockwise."""
    x, y = points[:, 0] - points[0, 0], points[:, 1] - points[0, 1]
    return float((x * np.roll(y, -1) - y * np.roll(x, -1)).sum() / 2)
