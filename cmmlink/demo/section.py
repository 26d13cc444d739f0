"""The demonstration part: a NACA four-digit section, chord 100 mm, its blunt trailing edge closed by a rounded cap.

The section is given by its equation (NACA Report 460, 1933): thickness laid off at right angles to the camber line. The
digits are 4512: cambered, so that no symmetry leaves its pose open, and with the camber's highest point at half chord,
where the two parabolas of the camber line are one (elsewhere they meet with a small corner). A cap continues
position, tangent and curvature of both sides, so that the cubic through the points has nothing to ring at.
"""

from math import comb

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]

CHORD_MM = 100.0
CAMBER, CAMBER_PLACE, THICKNESS = 0.04, 0.5, 0.12
CAP_START = 0.998  # of the chord, where the cap takes over from the equation

_CAP_STRETCH = 0.34  # of the thickness there: legs of the cap's control polygon; with this the curvature rises to one peak and falls
_STEP_EDGE_MM, _STEP_NOSE_MM, _STEP_MM = 0.012, 0.1, 1.0
_GROWTH = 0.12  # of a step to the next, away from edge and nose


def naca_four_digit(s: ArrayLike, camber: float, place: float, thickness: float) -> Array:
    """Points (k, 2) of a section of chord 1 at s (k,): x/c along the camber line is s squared, s > 0 above it, s < 0 below.

    The square root of the chord as parameter makes the round nose a smooth curve.
    """
    side = np.asarray(s, dtype=np.float64)
    x = side**2
    half = 5 * thickness * (0.2969 * np.abs(side) - 0.126 * x - 0.3516 * x**2 + 0.2843 * x**3 - 0.1015 * x**4)
    fore = x < place
    line = np.where(fore, camber / place**2 * (2 * place * x - x**2), camber / (1 - place) ** 2 * (1 - 2 * place + 2 * place * x - x**2))
    slope = np.where(fore, 2 * camber / place**2 * (place - x), 2 * camber / (1 - place) ** 2 * (place - x))
    across = np.column_stack([-slope, np.ones_like(slope)]) / np.sqrt(1 + slope**2)[:, None]
    return np.asarray(np.column_stack([x, line]) + (np.sign(side) * half)[:, None] * across)


def outline(w: ArrayLike) -> Array:
    """Points (k, 2) in mm of the closed section at w (k,) in [-2, 2], counter-clockwise from tip to tip.

    From w = -2 the upper half of the cap, from -1 the upper side to the nose at 0, to 1 the lower side, to 2 the cap back.
    """
    place = np.asarray(w, dtype=np.float64)
    on_side = np.abs(place) <= 1
    points = np.empty((len(place), 2))
    points[on_side] = _side(place[on_side])
    points[~on_side] = _cap(np.where(place > 0, (place - 1) / 2, (place + 3) / 2)[~on_side])
    return points


def nominal_points() -> Array:
    """Points (m, 2) of the nominal: dense at the edge and the nose, a millimetre apart between; the last repeats the first."""
    w = np.linspace(-2.0, 2.0, 400_001)
    points = outline(w)
    station = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(points, axis=0).T))])
    from_edge = np.minimum(station - station[w >= -1][0], station[w <= 1][-1] - station)
    from_nose = np.abs(station - station[len(w) // 2])
    step = np.minimum(_STEP_EDGE_MM + _GROWTH * np.maximum(from_edge, 0.0), _STEP_NOSE_MM + _GROWTH * from_nose)
    density = 1 / np.minimum(step, _STEP_MM)
    count = np.concatenate([[0.0], np.cumsum((density[1:] + density[:-1]) / 2 * np.diff(station))])
    chosen = outline(np.interp(np.linspace(0.0, count[-1], int(np.ceil(count[-1])) + 1), count, w))
    return np.vstack([chosen[:-1], chosen[:1]])


def _side(w: Array) -> Array:
    """Points (k, 2) in mm of the sides at w in [-1, 1], the upper one first."""
    return CHORD_MM * naca_four_digit(-w * np.sqrt(CAP_START), CAMBER, CAMBER_PLACE, THICKNESS)


def _cap(v: Array) -> Array:
    """Points (k, 2) in mm of the cap at v in [0, 1], from the lower side to the upper."""
    lower, upper = _end(1.0), _end(-1.0)
    leg = _CAP_STRETCH * float(np.hypot(*(upper[0] - lower[0])))
    control = np.vstack([_legs(*lower, leg), _legs(*upper, -leg)[::-1]])  # (8, 2)
    t = v[:, None]
    return np.asarray(sum(comb(7, i) * (1 - t) ** (7 - i) * t**i * control[i] for i in range(8)))


def _legs(point: Array, tangent: Array, curvature: float, leg: float) -> Array:
    """First four control points (4, 2) of a Bezier curve of degree 7 that begins with this tangent and curvature.

    Even legs along the tangent make the curve's run along it linear to third order, so the curvature at the end is
    6/7 of the third point's height over the leg squared, and three times that height at the fourth keeps it from changing.
    """
    height = np.array([0.0, 0.0, 1.0, 3.0])[:, None] * (7 / 6 * curvature * leg**2)
    return np.asarray(point + np.arange(4)[:, None] * leg * tangent + height * np.array([-tangent[1], tangent[0]]))


def _end(w: float) -> tuple[Array, Array, float]:
    """Point, unit tangent along the outline and signed curvature (1/mm) where a side meets the cap, by central differences."""
    h = 1e-4  # leaves 1e-8 relative in the curvature, from truncation and round-off alike
    before, here, after = _side(np.array([w - h, w, w + h]))
    first, second = (after - before) / (2 * h), (after - 2 * here + before) / h**2
    speed = float(np.hypot(*first))
    return here, first / speed, float(first[0] * second[1] - first[1] * second[0]) / speed**3


def nominal_csv() -> str:
    """Spell the nominal file that is shipped; `python -m cmmlink.demo` writes it."""
    head = "# NACA 4512, chord 100 mm, rounded trailing edge; computed by cmmlink.demo.section\nx_mm,y_mm\n"
    return head + "".join(f"{x:.9f},{y:.9f}\n" for x, y in nominal_points())
