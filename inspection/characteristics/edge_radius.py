"""The radius of an edge, by the largest curvature or by a circle through a stated window.

An edge of an airfoil is no arc. The radius of curvature at its tip and that of a circle fitted around it differ by 6 to 130 % on common
sections, so the window belongs to the value: it is how far the tangent turns to either side of the tip. The circle is that of least
squares of the distances, through points that lie evenly in arc length (the middles of equal arcs, so that their number does not matter),
and its largest distance from the window stands beside it.
"""

from typing import Literal

import numpy as np
from numpy.typing import NDArray

from inspection.characteristics.outline import FRONT, AirfoilSection, Edge, dense_parameters, largest_curvature
from inspection.characteristics.section_value import SectionValue
from inspection.curve import NurbsCurve
from inspection.errors import InspectionError

Array = NDArray[np.float64]
EdgeRadiusMethod = Literal["curvature", "circle"]

_POINTS = 1000  # of a fitted circle: more of them change its radius by less than 1e-6 of itself
_STEPS = 100
_SETTLED = 1e-13


def edge_radius(
    section: AirfoilSection, edge: Edge = "leading", method: EdgeRadiusMethod = "circle", window_deg: float = 30.0
) -> SectionValue:
    """The radius in mm of the leading edge, or of a round trailing edge.

    window_deg : for `circle`, how far the tangent turns from the tip to either end of the window. Where the outline ends before, the
                 window does, and a note says so.

    The places are the tip and the centre of the circle; for `circle` both ends of the window too. Raises InspectionError for a trailing
    edge that is not round.
    """
    tip, low, high = _edge_range(section, edge)
    if method == "curvature":
        near = section.point(np.array([tip]))[0]
        u = dense_parameters(section.curve, low, high)
        return _by_curvature(section, edge, largest_curvature(section.curve, u, near, FRONT * section.length_mm))
    if method != "circle":
        raise ValueError(f"the method must be curvature or circle, not {method!r}")
    if not 0 < window_deg <= 180:
        raise ValueError(f"the window must be an angle up to 180 degrees, not {window_deg:g}")
    return _by_circle(section.curve, edge, window_deg, (low, tip, high))


def _edge_range(section: AirfoilSection, edge: Edge) -> tuple[float, float, float]:
    """The parameter of an edge's tip, and the range around it; it may leave the domain of a closed curve, which wraps."""
    if edge == "leading":
        return section.nose, section.first, section.last
    if section.trailing != "round":
        raise InspectionError(f"the trailing edge is {section.trailing}: it has no radius")
    return section.first, section.nose - (section.last - section.first), section.nose


def _by_curvature(section: AirfoilSection, edge: Edge, tip: float) -> SectionValue:
    """The radius of curvature at the tip."""
    point, first = section.curve.derivatives(np.array([tip]), 1)[:, 0]
    radius = 1 / abs(float(section.curve.curvature(np.array([tip]))[0]))
    inward = section.inward * np.array([-first[1], first[0]]) / np.hypot(*first)
    return SectionValue(f"{edge} edge radius", "curvature", radius, "mm", np.vstack([point, point + radius * inward]), ("tip", "centre"))


def _by_circle(curve: NurbsCurve, edge: Edge, window_deg: float, around: tuple[float, float, float]) -> SectionValue:
    """The circle of least squares through the window around the tip."""
    low, tip, high = around
    ends, notes = [], []
    for name, limit in (("before", low), ("behind", high)):
        end, turned_deg = _turn_by(curve, tip, limit, window_deg)
        ends.append(end)
        if turned_deg < window_deg:
            notes.append(f"the window ends {name} the tip after {turned_deg:.1f} degrees of turning, where the outline does")
    points = _arc_even(curve, ends[0], ends[1])
    centre, radius = _fit_circle(points)
    borders = curve.point(np.array(ends))
    residual = float(np.abs(np.hypot(*(np.vstack([points, borders]) - centre).T) - radius).max())
    places = np.vstack([curve.point(np.array([tip])), centre, borders])
    names = ("tip", "centre", "beginning of the window", "end of the window")
    window = (("window_deg", float(window_deg)),)
    return SectionValue(f"{edge} edge radius", "circle", radius, "mm", places, names, window, residual, tuple(notes))


def _turn_by(curve: NurbsCurve, tip: float, limit: float, window_deg: float) -> tuple[float, float]:
    """The parameter towards `limit` at which the tangent has turned by the window, and how far it has turned there in degrees."""
    from scipy.optimize import brentq  # noqa: PLC0415 - it takes half a second, and a plan knows only names of this file

    u = dense_parameters(curve, min(tip, limit), max(tip, limit))
    u = u if limit > tip else u[::-1]
    heading = np.unwrap(_heading(curve, u))
    turned = np.abs(heading - heading[0])
    window = float(np.radians(window_deg))
    beyond = np.flatnonzero(turned >= window)
    if not beyond.size:
        return float(limit), float(np.degrees(turned.max()))
    k = int(beyond[0])

    def excess(at: float) -> float:
        step = _heading(curve, np.array([at]))[0] - heading[k]
        turned_there = heading[k] + (step + np.pi) % (2 * np.pi) - np.pi - heading[0]
        return float(np.abs(turned_there)) - window

    return float(brentq(excess, float(u[k - 1]), float(u[k]), xtol=1e-15)), window_deg


def _heading(curve: NurbsCurve, u: Array) -> Array:
    """Directions (m,) of the tangent in radians."""
    first = curve.derivatives(u, 1)[1]
    return np.asarray(np.arctan2(first[:, 1], first[:, 0]))


def _arc_even(curve: NurbsCurve, low: float, high: float) -> Array:
    """The middles (n, 2) of equal arcs from one parameter to another."""
    u = np.linspace(low, high, 2 * _POINTS)
    points = curve.point(u)
    travelled = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(points, axis=0).T))])
    return curve.point(np.interp((np.arange(_POINTS) + 0.5) / _POINTS * travelled[-1], travelled, u))


def _fit_circle(points: Array) -> tuple[Array, float]:
    """Centre (2,) and radius of the circle of least squared distances from points (n, 2): Gauss-Newton from the algebraic circle."""
    origin = points.mean(axis=0)
    x = points - origin
    algebraic = np.linalg.lstsq(np.column_stack([2 * x, np.ones(len(x))]), (x * x).sum(axis=1), rcond=None)[0]
    centre, radius = algebraic[:2], float(np.sqrt(algebraic[2] + algebraic[:2] @ algebraic[:2]))
    for _ in range(_STEPS):
        d = x - centre
        distance = np.hypot(*d.T)
        slope = np.column_stack([d / distance[:, None], np.ones(len(d))])  # of (distance - radius), with the sign turned
        step = np.linalg.lstsq(slope, distance - radius, rcond=None)[0]
        centre, radius = centre + step[:2], radius + float(step[2])
        if np.abs(step).max() < _SETTLED * radius:
            break
    return centre + origin, radius
