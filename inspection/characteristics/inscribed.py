"""Circles inside a section that touch both of its sides, and the camber line that their centres draw.

The circle that touches the outline at C(u), with the unit normal n into the section there, and passes through another place C(v), has
the radius r(u, v) = |d|^2 / (2 n.d) with d = C(v) - C(u). The circle inscribed at u is the one of least r over v: it touches the other side
and holds no place of it. So one search in one parameter gives each circle, and Newton's method on dr/dv = 0 makes it exact.
"""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from inspection.characteristics.outline import AirfoilSection
from inspection.errors import InspectionError
from inspection.kernels import nearest_squared, settle_contacts, smallest_touching

Array = NDArray[np.float64]

_STATIONS = 300  # circles of a camber line before its ends are sought
_NEWTON_STEPS = 12
_SETTLED = 1e-14  # of the range of the parameter
_NARROWEST_DEG = 30.0  # contacts that a centre sees closer together than this tell too little of where the circle is
_END_ROUNDS = 8  # narrowing of the place at which the camber line can be followed no farther, 16-fold each
_TANGENT = 1e-6  # cosine between the radius to a contact and the outline there: more is a search that did not settle
_AS_LARGE = 1e-9  # of a radius: circles that differ by less are equal
_OSCULATING = 2e-2  # radius times curvature of the outline, short of one: along an arc all circles are one, and touch it anywhere
_LONGEST_AT_ROUND = 2.0  # radii of the last circle that the line may be continued by at a round edge; where it is followed it is one
_FARTHEST_FROM_END = 0.01  # of the outline: where contacts at a trailing edge with ends must have come, one of them at least
_INSIDE = 1e-7  # of the section's length: a place that lies this deep in a circle is taken as in it


@dataclass(frozen=True, slots=True, eq=False)
class InscribedCircles:
    """k circles, each touching the first side of a section at `u` and the other side at `v`.

    u, v       : (k,) parameters of the contacts
    contact_u  : (k, 2) mm, contact_v : (k, 2) mm
    centre_mm  : (k, 2)
    radius_mm  : (k,)
    is_whole   : (k,) the circle touches both sides between their ends, holds no place of the outline, and its centre sees the
                 contacts at least 30 degrees apart
    """

    u: Array
    v: Array
    contact_u: Array
    contact_v: Array
    centre_mm: Array
    radius_mm: Array
    is_whole: NDArray[np.bool_]

    def along(self) -> Array:
        """Unit directions (k, 2) of the camber line at the centres, from the nose to the tail: square to the line between contacts."""
        across = self.contact_u - self.contact_v
        across = across / np.hypot(*across.T)[:, None]
        return np.asarray(np.column_stack([-across[:, 1], across[:, 0]]))


@dataclass(frozen=True, slots=True, eq=False)
class CamberLine:
    """The medial axis between the two sides, from the leading to the trailing edge.

    circles      : the inscribed circles whose centres it joins, from nose to tail
    points_mm    : (k + 2, 2) nose point, the k centres, tail point
    nose_mm      : (2,) where the line leaves the section at the leading edge
    tail_mm      : (2,) where it leaves at the trailing edge
    nose_along   : (2,) its unit direction at the nose point, towards the tail
    tail_along   : (2,) its unit direction at the tail point, away from the nose
    continued_mm : length of the straight continuation at the nose and at the tail; no circle was inscribed there
    notes        : how both ends were continued
    """

    circles: InscribedCircles
    points_mm: Array
    nose_mm: Array
    tail_mm: Array
    nose_along: Array
    tail_along: Array
    continued_mm: tuple[float, float]
    notes: tuple[str, ...] = field(default=())

    def __post_init__(self) -> None:
        for array in (self.points_mm, self.nose_mm, self.tail_mm, self.nose_along, self.tail_along):
            array.setflags(write=False)


def inscribe_circles(section: AirfoilSection, u: Array) -> InscribedCircles:
    """The circles that touch the side from `first` to `nose` at the parameters u (k,), and the other side."""
    place, first, second, normal = section.frame(u)
    v = _touch_other_side(section, place, normal)
    contact, v_first, v_second = section.derivatives(v, 2)
    d = contact - place
    facing = dot(normal, d)
    with np.errstate(divide="ignore", invalid="ignore"):
        radius = np.where(facing > 0, dot(d, d) / (2 * facing), np.nan)
    centre = place + radius[:, None] * normal
    is_whole = (v > section.nose) & (v < section.last) & (u > section.first) & (u < section.nose)
    with np.errstate(invalid="ignore"):
        is_whole &= np.hypot(*d.T) >= 2 * radius * np.sin(np.radians(_NARROWEST_DEG / 2))
        is_whole &= radius > _INSIDE * section.length_mm
        for a, b in ((first, second), (v_first, v_second)):
            curvature = section.inward * (a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]) / np.hypot(*a.T) ** 3
            is_whole &= radius * curvature <= 1 - _OSCULATING
        slip = np.abs(dot(centre - contact, v_first)) / np.hypot(*v_first.T)
        is_whole &= slip <= _TANGENT * radius
        nearest = np.sqrt(nearest_squared(centre, section.points_mm))
        is_whole &= nearest >= radius - _INSIDE * section.length_mm
    return InscribedCircles(u, v, place, contact, centre, radius, is_whole)


def dot(one: Array, other: Array) -> Array:
    """The products (k,) of vectors (k, 2); a sum over rows of two takes several times as long."""
    return np.asarray(one[:, 0] * other[:, 0] + one[:, 1] * other[:, 1])


def _touch_other_side(section: AirfoilSection, place: Array, normal: Array) -> Array:
    """Parameters (k,) at which the circles at `place` (k, 2) touch the side from nose to last."""
    side = slice(section.nose_sample, None)
    parameter = section.parameter[side]
    best = smallest_touching(place, normal, section.points_mm[side])
    low, high = parameter[np.maximum(best - 1, 0)], parameter[np.minimum(best + 1, len(parameter) - 1)]
    settled = _SETTLED * (section.last - section.first)
    curve, start = section.curve, parameter[best]
    return settle_contacts(curve.spline, curve.domain, place, normal, start, (low, high), _NEWTON_STEPS, settled)


def find_camber_line(section: AirfoilSection) -> CamberLine:
    """The camber line of a section: the centres of the circles that touch both sides, continued straight to both edges.

    A circle near an edge is held by contacts that merge: the line is followed until a centre sees them 30 degrees apart, or until
    one of them reaches the end of its side. From there it is continued in its last direction until it leaves the section;
    in a sharp trailing edge it ends in the corner. Raises InspectionError where no circle touches both sides.
    """
    step = -(-section.nose_sample // _STATIONS)
    u = section.parameter[: section.nose_sample : step]
    circles = inscribe_circles(section, u)
    if not circles.is_whole.any():
        raise InspectionError("no circle inside the outline touches both of its sides: it is no airfoil section")
    size = np.where(circles.is_whole, circles.radius_mm, -1.0)
    largest = np.flatnonzero(size >= (1 - _AS_LARGE) * size.max())  # many, where both sides are parallel
    best = int(largest[len(largest) // 2])
    run = _run_around(circles, best)
    low, high = int(run[0]), int(run[-1])
    towards_tail = _last_whole(section, u[low], u[low - 1] if low else section.first)
    towards_nose = _last_whole(section, u[high], u[high + 1] if high + 1 < len(u) else section.nose)
    found = inscribe_circles(section, np.concatenate([[towards_nose], u[run][::-1], [towards_tail]]))
    return continue_to_edges(section, found)


def _goes_on(circles: InscribedCircles) -> NDArray[np.bool_]:
    """Whether each circle (k - 1,) is whole and followed by a whole one with both contacts farther along their sides."""
    farther = np.diff(circles.v) * np.diff(circles.u) <= 0
    return np.asarray(circles.is_whole[:-1] & circles.is_whole[1:] & farther)


def _run_around(circles: InscribedCircles, at: int) -> NDArray[np.int64]:
    """The whole circles (j,) around circle `at` of which every one has both contacts farther along their sides than the one before.

    Between two of them others may touch no other side: those on the flanks of a bump, past which the line goes on.
    """
    whole = np.flatnonzero(circles.is_whole)
    stops = np.flatnonzero(np.diff(circles.v[whole]) * np.diff(circles.u[whole]) > 0)
    place = int(np.searchsorted(whole, at))
    before, behind = stops[stops < place], stops[stops >= place]
    return np.asarray(whole[int(before[-1]) + 1 if before.size else 0 : int(behind[0]) + 1 if behind.size else len(whole)])


def _last_whole(section: AirfoilSection, whole: float, beyond: float) -> float:
    """The parameter between one with a whole circle and one without, up to which circles are whole."""
    for _ in range(_END_ROUNDS):
        looked = np.linspace(whole, beyond, 17)
        goes_on = _goes_on(inscribe_circles(section, looked))
        if goes_on.all():
            return float(beyond)
        stop = int(np.argmin(goes_on))
        whole, beyond = looked[stop], looked[stop + 1]
    return float(whole)


def continue_to_edges(section: AirfoilSection, circles: InscribedCircles) -> CamberLine:
    """The line of centres with its two ends continued. Raises InspectionError where they are not near the edges."""
    along = circles.along()
    if along[0] @ (circles.centre_mm[-1] - circles.centre_mm[0]) < 0:
        along = -along
    nose = _leave_between(section, circles.centre_mm[0], -along[0], float(circles.u[0]), float(circles.v[0]))
    tail, way = _leave_at_tail(section, circles.centre_mm[-1], along[-1], float(circles.u[-1]), float(circles.v[-1]))
    reach = tail - circles.centre_mm[-1]
    tail_along = reach / np.hypot(*reach) if np.hypot(*reach) > 0 else along[-1]
    lengths = float(np.hypot(*(nose - circles.centre_mm[0]))), float(np.hypot(*reach))
    _refuse_early_end(section, circles, lengths)
    return CamberLine(
        circles=circles,
        points_mm=np.vstack([nose, circles.centre_mm, tail]),
        nose_mm=nose,
        tail_mm=tail,
        nose_along=along[0].copy(),
        tail_along=tail_along,
        continued_mm=lengths,
        notes=(
            f"the camber line is continued straight over the last {lengths[0]:.4g} mm at the leading edge",
            f"the camber line is continued {way} over the last {lengths[1]:.4g} mm at the trailing edge",
        ),
    )


def _refuse_early_end(section: AirfoilSection, circles: InscribedCircles, continued_mm: tuple[float, float]) -> None:
    """Raise InspectionError where the line was followed to no edge: continued straight from there, it would lead anywhere."""
    is_short = [length <= _LONGEST_AT_ROUND * circles.radius_mm[end] for length, end in zip(continued_mm, (0, -1), strict=True)]
    if section.trailing != "round":
        left = min(circles.u[-1] - section.first, section.last - circles.v[-1])
        is_short[1] = bool(left <= _FARTHEST_FROM_END * (section.last - section.first))
    for is_followed, length, edge in zip(is_short, continued_mm, ("leading", "trailing"), strict=True):
        if not is_followed:
            raise InspectionError(
                f"no circle touches both sides over the last {length:.4g} mm before the {edge} edge, so there is no camber line to it: "
                "the outline is dented or bulges there"
            )


def _leave_between(section: AirfoilSection, centre: Array, direction: Array, low: float, high: float) -> Array:
    """Where the ray from a centre (2,) crosses the outline between two parameters of it; they may run past a round edge."""
    from scipy.optimize import brentq  # noqa: PLC0415 - it takes half a second, and a plan knows only names of this file

    square = np.array([-direction[1], direction[0]])

    def aside(u: float) -> float:
        return float((section.curve.point(np.array([u]))[0] - centre) @ square)

    u = brentq(aside, low, high, xtol=1e-15 * max(1.0, abs(high)))
    return np.asarray(section.curve.point(np.array([u]))[0])


def _leave_at_tail(section: AirfoilSection, centre: Array, direction: Array, u: float, v: float) -> tuple[Array, str]:
    """Where the camber line leaves at the trailing edge, and how it was continued to there."""
    ends = section.ends_mm()
    if section.trailing == "sharp":
        return ends.mean(axis=0), "straight to the corner"
    if section.trailing == "round":
        start, end = section.curve.domain
        return _leave_between(section, centre, direction, v - (end - start), u), "straight"
    gap = ends[1] - ends[0]
    square = np.array([-direction[1], direction[0]])
    share = float(np.clip(((centre - ends[0]) @ square) / (gap @ square), 0.0, 1.0)) if abs(gap @ square) > 0 else 0.5
    return ends[0] + share * gap, "straight to the line between the ends of both sides"
