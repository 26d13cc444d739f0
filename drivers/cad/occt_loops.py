"""What the child of occt_process.py finds of the loops that trim a face: straight segments in the parameters of its exact spline.

A loop is drawn on the surface as the file has it, whose parameters need not be those of the spline: those of a cylinder are an angle, the
spline's are not. So each place is found again on the spline, and a loop that does not come to lie where it was is refused.
"""

from collections.abc import Callable, Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Places = Callable[[Array], Array]  # parameters (m, 2) to places (m, 3), or to other parameters
Line = Callable[[Array], Array]  # parameters (m,) along it to places (m, 3)

_FIRST_STEPS, _MOST_STEPS = 8, 1 << 13
_BETWEEN = np.array([0.25, 0.5, 0.75])  # of a step, at which a loop may leave its segments
_SAFETY = 1.5  # times the largest distance found there
_SAME_MM = 1e-7  # that a place on the spline may lie off the same one on the surface
_TABLE, _NEWTON_STEPS = 400, 20


def loop_of(edges: Iterable[tuple[Any, float]], surface: Any, spline: Any, stray_mm: float) -> tuple[Array, float] | None:
    """The segments (s, 2, 5) of all loops of a face, u, v on the spline and x, y, z at each end, and how far off loops may lie in mm.

    None where the spline does not hold the loops. They lie off by the tolerance of the edges, and by how far segments stray.

    edges    : each as a curve in the parameters of the surface, and its tolerance in mm
    stray_mm : by how much segments may leave the loop, about
    """
    on_surface, on_spline = _places_of(surface), _places_of(spline)
    onto_spline = _onto_spline(spline, on_surface, on_spline)
    segments, off, tolerance = [], 0.0, 0.0
    for curve, edge_mm in edges:
        found = _followed(curve, on_surface, on_spline, onto_spline, stray_mm)
        if found is None:
            return None
        nodes, strays = found
        segments.append(np.stack([nodes[:-1], nodes[1:]], axis=1))
        off, tolerance = max(off, strays), max(tolerance, edge_mm)
    return np.concatenate(segments), tolerance + off


def _places_of(surface: Any) -> Places:
    def places(at: Array) -> Array:
        found = [surface.Value(float(u), float(v)) for u, v in at]
        return np.array([(p.X(), p.Y(), p.Z()) for p in found]).reshape(-1, 3)

    return places


def _followed(curve: Any, on_surface: Places, on_spline: Places, onto_spline: Places, stray_mm: float) -> tuple[Array, float] | None:
    """Nodes (k, 5) along an edge, closer and closer until the segments between them stay near it, and how far they do not."""
    begin, end = float(curve.FirstParameter()), float(curve.LastParameter())
    steps = 1
    while True:
        t = np.linspace(begin, end, steps + 1)
        drawn = _drawn(curve, t)
        at, places = onto_spline(drawn), on_surface(drawn)
        if np.abs(on_spline(at) - places).max() > _SAME_MM:
            return None
        strays = 0.0
        for share in _BETWEEN:
            exact = on_surface(_drawn(curve, t[:-1] + share * np.diff(t)))
            for straight in (on_spline(at[:-1] + share * np.diff(at, axis=0)), places[:-1] + share * np.diff(places, axis=0)):
                strays = max(strays, _off_steps(straight, exact, places))
        if _SAFETY * strays <= stray_mm or steps >= _MOST_STEPS:
            return np.column_stack([at, places]), _SAFETY * strays
        steps = max(_FIRST_STEPS, 2 * steps)


def _off_steps(straight: Array, exact: Array, places: Array) -> float:
    """How far places (k, 3) lie from others, off the directions of the steps between the nodes: along these nothing strays."""
    step, off = np.diff(places, axis=0), straight - exact
    length = (step**2).sum(axis=1)
    along = (off * step).sum(axis=1) / np.where(length > 0, length, 1.0)
    return float(np.linalg.norm(off - along[:, None] * step, axis=1).max())


def _drawn(curve: Any, t: Array) -> Array:
    found = [curve.Value(float(each)) for each in t]
    return np.array([(p.X(), p.Y()) for p in found])


def _onto_spline(spline: Any, on_surface: Places, on_spline: Places) -> Places:
    """Brings parameters (m, 2) on the surface to those on the spline.

    They are the same, or along each of the two the spline runs through the same places at another pace.
    """
    u0, u1, v0, v1 = spline.Bounds()
    low, high = np.array([u0, v0]), np.array([u1, v1])
    inner = low + np.array([[0.3, 0.4], [0.6, 0.2], [0.45, 0.7]]) * (high - low)
    if np.abs(on_surface(inner) - on_spline(inner)).max() <= _SAME_MM:
        return lambda at: at
    paces = []
    for axis in range(2):
        across = _farther_side(on_spline, axis, low, high)
        lines = (_line(on_surface, axis, across), _line(on_spline, axis, across))
        paces.append(_pace(*lines, float(low[axis]), float(high[axis])))
    return lambda at: np.column_stack([pace(at[:, axis]) for axis, pace in enumerate(paces)])


def _line(places: Places, axis: int, across: float) -> Line:
    """The line of a surface at a fixed parameter of the other axis."""
    return lambda values: places(np.insert(values[:, None], 1 - axis, across, axis=1))


def _farther_side(on_spline: Places, axis: int, low: Array, high: Array) -> float:
    """The side of the rectangle along which the places spread farther: the other one may be a pole. Sides are the same on both surfaces."""
    values = np.linspace(low[axis], high[axis], 5)
    sides = [float(low[1 - axis]), float(high[1 - axis])]
    return max(sides, key=lambda across: float(np.ptp(_line(on_spline, axis, across)(values), axis=0).max()))


def _pace(line: Line, spline_line: Line, begin: float, end: float) -> Callable[[Array], Array]:
    """Finds the parameters (m,) at which a line of the spline comes to the places of another one, both drawn from `begin` to `end`.

    The way gone along either gives the first guess, and Newton's method the rest.
    """
    table, step = np.linspace(begin, end, _TABLE), (end - begin) * 1e-6
    ways = [np.append(0.0, np.cumsum(np.linalg.norm(np.diff(each(table), axis=0), axis=1))) for each in (line, spline_line)]

    def found(wanted: Array) -> Array:
        values = np.asarray(np.interp(np.interp(wanted, table, ways[0]), ways[1], table))
        places = line(wanted)
        for _ in range(_NEWTON_STEPS):
            off = places - spline_line(values)
            speed = (spline_line(values + step) - spline_line(values - step)) / (2 * step)
            change = (off * speed).sum(axis=1) / np.maximum((speed**2).sum(axis=1), 1e-300)
            values = np.asarray(np.clip(values + change, begin, end))
            if np.abs(change).max() < 1e-14 * (end - begin):
                break
        return values

    return found
