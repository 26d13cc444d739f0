"""How thick a section is: at its thickest place, and at a stated way in from an edge.

inscribed   diameter of the largest circle inside the section; it touches both sides at places that face each other square
two-point   largest distance of both sides along a line square to the camber line: a calliper that is turned with the camber

The thickness of an edge is measured through a place on the camber line at the stated offset, which the first part of its method says:

tip-arc     the place is on a circle about the edge point whose radius is the offset
offset-flat it is on a line parallel to the outline at the edge point, the offset away from it

The distance of both sides is taken square to the camber line, or with "-square" parallel to the flat that a blunt edge ends in. The edge
point is where the camber line leaves the section. The names follow PC-DMIS Blade: TIPARC and OFFSETFLAT, with NORMAL and SQUARE, which
it has for square ends only.
"""

from collections.abc import Callable
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from inspection.characteristics.inscribed import CamberLine, InscribedCircles, dot, inscribe_circles
from inspection.characteristics.outline import AirfoilSection, Edge
from inspection.characteristics.section_value import SectionValue
from inspection.characteristics.zoom import find_maximum
from inspection.errors import InspectionError

Array = NDArray[np.float64]
ThicknessMethod = Literal["inscribed", "two-point"]
EdgeThicknessMethod = Literal["tip-arc", "tip-arc-square", "offset-flat", "offset-flat-square"]

_CONTACTS = ("contact on the upper side", "contact on the lower side")


def maximum_thickness(section: AirfoilSection, camber: CamberLine, method: ThicknessMethod = "inscribed") -> SectionValue:
    """The largest thickness in mm, by a method of those above. Its places are both contacts, then the centre of the circle."""
    if method == "two-point":
        return _two_point(section, camber)
    if method != "inscribed":
        raise ValueError(f"the method must be inscribed or two-point, not {method!r}")
    circle = largest_circle(section, camber)
    places = np.vstack([*_upper_then_lower(section, circle.contact_u[0], circle.contact_v[0]), circle.centre_mm[0]])
    return SectionValue("maximum thickness", method, 2 * float(circle.radius_mm[0]), "mm", places, (*_CONTACTS, "centre"))


def largest_circle(section: AirfoilSection, camber: CamberLine) -> InscribedCircles:
    """The largest circle inside the section, as one of one."""
    low, high = _around(camber.circles.u, camber.circles.radius_mm)

    def radius(u: Array) -> Array:
        return np.nan_to_num(inscribe_circles(section, u).radius_mm, nan=-1.0)

    return inscribe_circles(section, np.array([find_maximum(radius, low, high)]))


def _two_point(section: AirfoilSection, camber: CamberLine) -> SectionValue:
    """The largest distance of both sides square to the camber line."""
    low, high = _around(camber.circles.u, _across(section, camber.circles))

    def width(u: Array) -> Array:
        return _across(section, inscribe_circles(section, u))

    circle = inscribe_circles(section, np.array([find_maximum(width, low, high)]))
    one, other = (section.point(u)[0] for u in _crossings(section, circle))
    places = np.vstack(_upper_then_lower(section, one, other))
    return SectionValue("maximum thickness", "two-point", float(np.hypot(*(one - other))), "mm", places, _CONTACTS)


def _around(u: Array, height: Array) -> tuple[float, float]:
    """The parameters beside the one of largest height."""
    best = int(np.argmax(height))
    beside = u[max(best - 1, 0)], u[min(best + 1, len(u) - 1)]
    return float(min(beside)), float(max(beside))


def _across(section: AirfoilSection, circles: InscribedCircles) -> Array:
    """Distances (k,) of both sides along the lines through the centres square to the camber line."""
    one, other = _crossings(section, circles)
    return np.asarray(np.hypot(*(section.point(one) - section.point(other)).T))


def _crossings(section: AirfoilSection, circles: InscribedCircles) -> tuple[Array, Array]:
    """Parameters (k,) on both sides where the lines through the centres square to the camber line cross, from the contacts on."""
    along, centre = circles.along(), circles.centre_mm
    found = []
    for start, low, high in ((circles.u, section.first, section.nose), (circles.v, section.nose, section.last)):
        u = start.copy()
        for _ in range(8):
            point, first = section.derivatives(u, 1)
            off, rise = dot(point - centre, along), dot(first, along)
            before, u = u, np.minimum(np.maximum(u - off / rise, low), high)
            if np.array_equal(u, before):  # every further step would give the same
                break
        found.append(u)
    return found[0], found[1]


def edge_thickness(
    section: AirfoilSection, camber: CamberLine, edge: Edge, offset_mm: float, method: EdgeThicknessMethod = "tip-arc"
) -> SectionValue:
    """The thickness at `offset_mm` from an edge point, by a method of those above.

    The places are both contacts, then the place on the camber line. Raises InspectionError where the offset reaches no camber line,
    where the line across meets no side, and for a method that asks for a flat, or for the outline at the edge point, where there is none.
    """
    if not offset_mm > 0:
        raise ValueError(f"the offset must be a positive length, not {offset_mm:g} mm")
    if method not in get_args(EdgeThicknessMethod):
        raise ValueError(f"the method must be one of {', '.join(get_args(EdgeThicknessMethod))}, not {method!r}")
    tip = camber.nose_mm if edge == "leading" else camber.tail_mm
    if method.endswith("-square") and (edge == "leading" or section.trailing != "blunt"):
        kind = "round" if edge == "leading" else section.trailing
        raise InspectionError(f"the {edge} edge is {kind}: {method} needs one that ends in a flat; choose {method.removesuffix('-square')}")
    inward = None if method == "tip-arc" else _inward_at_edge(section, edge, tip)

    def away(places: Array) -> Array:
        return np.asarray(np.hypot(*(places - tip).T) if inward is None or method == "tip-arc-square" else (places - tip) @ inward)

    centre, along = _meet_camber_line(section, camber, edge, offset_mm, away)
    square_to = along if inward is None or method == "offset-flat" else inward
    half = section.nose_sample
    one = _cross_side(section, centre, square_to, slice(0, half + 1))
    other = _cross_side(section, centre, square_to, slice(half, None))
    continued = camber.continued_mm[0 if edge == "leading" else 1] > float(np.hypot(*(centre - tip)))
    return SectionValue(
        f"{edge} edge thickness",
        method,
        float(np.hypot(*(one - other))),
        "mm",
        np.vstack([*_upper_then_lower(section, one, other), centre]),
        (*_CONTACTS, "on the camber line"),
        (("offset_mm", float(offset_mm)),),
        notes=(camber.notes[0 if edge == "leading" else 1],) if continued else (),
    )


def _inward_at_edge(section: AirfoilSection, edge: Edge, tip: Array) -> Array:
    """The unit normal (2,) into the section of the outline at an edge point: of the curve at a round edge, of the flat at a blunt one."""
    if edge == "trailing" and section.trailing in ("open", "sharp"):
        raise InspectionError(f"the trailing edge is {section.trailing}: the outline has no direction at its edge point; choose tip-arc")
    if edge == "trailing" and section.trailing == "blunt":
        flat = np.subtract(*section.ends_mm())
    else:
        u = (
            section.parameter
            if edge == "leading"
            else np.concatenate([section.parameter, section.parameter + section.last - section.first])
        )
        nearest = int(np.argmin(np.hypot(*(section.point(u) - tip).T)))
        low, high = u[max(nearest - 1, 0)], u[min(nearest + 1, len(u) - 1)]
        at = find_maximum(lambda v: -np.hypot(*(section.point(v) - tip).T), float(low), float(high))
        flat = section.frame(np.array([at]))[1][0]
    across = np.array([-flat[1], flat[0]]) / np.hypot(*flat)
    return np.asarray(across if (section.points_mm.mean(axis=0) - tip) @ across > 0 else -across)


def _meet_camber_line(
    section: AirfoilSection, camber: CamberLine, edge: Edge, offset_mm: float, away: Callable[[Array], Array]
) -> tuple[Array, Array]:
    """The first place (2,) on the camber line that is the offset away from the edge point, and the direction (2,) of the line there."""
    leading = edge == "leading"
    tip = camber.nose_mm if leading else camber.tail_mm
    along = camber.nose_along if leading else camber.tail_along
    order = slice(None) if leading else slice(None, None, -1)
    u, centres = camber.circles.u[order], camber.circles.centre_mm[order]
    distance = away(centres)
    if offset_mm <= distance[0]:
        inward = along if leading else -along
        return tip + offset_mm / float(away((tip + inward)[None, :])[0]) * inward, along
    beyond = np.flatnonzero(distance >= offset_mm)
    if not beyond.size:
        raise InspectionError(f"the {edge} edge thickness at {offset_mm:g} mm lies beyond the other edge of the section")

    def excess(at: float) -> float:
        return float(away(inscribe_circles(section, np.array([at])).centre_mm)[0]) - offset_mm

    from scipy.optimize import brentq  # noqa: PLC0415 - it takes half a second, and a plan knows only names of this file

    circle = inscribe_circles(section, np.array([brentq(excess, u[beyond[0] - 1], u[beyond[0]], xtol=1e-14)]))
    return circle.centre_mm[0], circle.along()[0]


def _cross_side(section: AirfoilSection, centre: Array, along: Array, side: slice) -> Array:
    """The place (2,) nearest to `centre` where the line through it, square to `along`, crosses the samples of a side."""
    from scipy.optimize import brentq  # noqa: PLC0415 - it takes half a second, and a plan knows only names of this file

    u, points = section.parameter[side], section.points_mm[side]
    height = (points - centre) @ along
    changes = np.flatnonzero(height[:-1] * height[1:] <= 0)
    if not changes.size:
        raise InspectionError("the line across the camber line does not meet both sides: the offset is too small for this edge")
    nearest = changes[int(np.argmin(np.hypot(*(points[changes] - centre).T)))]

    def aside(at: float) -> float:
        return float((section.point(np.array([at]))[0] - centre) @ along)

    return np.asarray(section.point(np.array([brentq(aside, u[nearest], u[nearest + 1], xtol=1e-15)]))[0])


def _upper_then_lower(section: AirfoilSection, on_first: Array, on_other: Array) -> tuple[Array, Array]:
    """Two places (2,), one of each side, with that of the upper side first."""
    return (on_first, on_other) if section.upper_first else (on_other, on_first)
