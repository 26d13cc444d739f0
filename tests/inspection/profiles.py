"""Nominal profiles and measured points whose truth is known, for every test of the inspection.

P1, P2 and P3 are the project's fixed test curves (degrees 2, 3 and 4; open, rational open, periodic closed). Conics are
exact rational curves. NACA four-digit sections are computed from their equation (NACA Report 460, public domain).
The other airfoils are read from coordinate files beside the checkout, because some may not be shipped.
"""

from collections.abc import Callable
from dataclasses import replace
from functools import cache, lru_cache
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import ArrayLike, NDArray

from inspection import Material, NominalProfile, NurbsCurve, discretize

Array = NDArray[np.float64]

AIRFOILS = Path(__file__).resolve().parents[3] / "shared" / "data" / "airfoils"

P1_POINTS = [(0, 0), (15, 28), (42, 36), (60, 10), (85, -6), (112, 14), (130, 40), (150, 30)]
P2_POINTS = [(0, 0), (12, 22), (30, 30), (48, 12), (66, -8), (86, 4), (100, 28), (122, 34), (140, 10)]
P2_WEIGHTS = [1, 1, 1.2, 1, 0.8, 1, 1.3, 1, 1]
P3_POINTS = [(60, 0), (52, 26), (24, 34), (-4, 30), (-34, 38), (-58, 18), (-50, -8), (-28, -26), (6, -20), (38, -30)]


def clamped(degree: int, points: ArrayLike, weights: ArrayLike | None = None) -> NurbsCurve:
    """Open curve on clamped uniform knots in [0, 1]."""
    control = np.array(points, dtype=float)
    inner = np.linspace(0.0, 1.0, len(control) - degree + 1)
    knots = np.concatenate([np.zeros(degree), inner, np.ones(degree)])
    return NurbsCurve(degree, control, knots, None if weights is None else np.array(weights, dtype=float))


def periodic(degree: int, points: ArrayLike) -> NurbsCurve:
    """Closed curve on uniform knots, domain [0, 1], its first control points repeated at the end."""
    control = np.array(points, dtype=float)
    k = len(control)
    knots = np.arange(-degree, k + degree + 1) / k
    return NurbsCurve(degree, np.vstack([control, control[:degree]]), knots, closed=True)


def p1() -> NurbsCurve:
    return clamped(2, P1_POINTS)


def p2() -> NurbsCurve:
    return clamped(3, P2_POINTS, P2_WEIGHTS)


def p3() -> NurbsCurve:
    return periodic(4, P3_POINTS)


def ellipse(a_mm: float, b_mm: float, clockwise: bool = False) -> NurbsCurve:
    """Exact rational ellipse of nine control points, from (a, 0), counter-clockwise unless told."""
    control = np.array([(1, 0), (1, 1), (0, 1), (-1, 1), (-1, 0), (-1, -1), (0, -1), (1, -1), (1, 0)], dtype=float) * (a_mm, b_mm)
    w = np.sqrt(0.5)
    if clockwise:
        control = control[::-1].copy()
    return NurbsCurve(2, control, np.array([0, 0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 4]) / 4.0, np.array([1, w, 1, w, 1, w, 1, w, 1]), closed=True)


def circle(radius_mm: float, clockwise: bool = False) -> NurbsCurve:
    return ellipse(radius_mm, radius_mm, clockwise)


def stadium(half_length_mm: float, radius_mm: float) -> NurbsCurve:
    """Two straight parts of length 2 `half_length_mm` and two half circles, counter-clockwise from the lower left."""
    ll, r = half_length_mm, radius_mm
    w = np.sqrt(0.5)
    control = [(-ll, -r), (0, -r), (ll, -r), (ll + r, -r), (ll + r, 0), (ll + r, r), (ll, r)]
    control += [(0, r), (-ll, r), (-ll - r, r), (-ll - r, 0), (-ll - r, -r), (-ll, -r)]
    weights = [1, 1, 1, w, 1, w, 1, 1, 1, w, 1, w, 1]
    knots = np.array([0, 0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 5, 5, 6, 6, 6]) / 6.0
    return NurbsCurve(2, np.array(control, dtype=float), knots, np.array(weights, dtype=float), closed=True)


def polygon(corners_mm: ArrayLike) -> NurbsCurve:
    """Closed polygon of degree 1 through the corners given once each."""
    control = np.array(corners_mm, dtype=float)
    control = np.vstack([control, control[:1]])
    u = np.linspace(0.0, 1.0, len(control))
    return NurbsCurve(1, control, np.concatenate([[0.0], u, [1.0]]), closed=True)


def square(side_mm: float) -> NurbsCurve:
    h = side_mm / 2
    return polygon([(-h, -h), (h, -h), (h, h), (-h, h)])


def naca_points(designation: str, chord_mm: float, count: int = 80, sharp: bool = True) -> Array:
    """Selig order (trailing edge, upper side, nose, lower side, trailing edge) of a NACA four-digit section."""
    camber, place, thickness = int(designation[0]) / 100, int(designation[1]) / 10, int(designation[2:]) / 100
    x = (1 - np.cos(np.linspace(0.0, np.pi, count))) / 2
    last = -0.1036 if sharp else -0.1015
    y_t = 5 * thickness * (0.2969 * np.sqrt(x) - 0.1260 * x - 0.3516 * x**2 + 0.2843 * x**3 + last * x**4)
    if sharp:
        y_t[-1] = 0.0
    if camber == 0:
        y_c, slope = np.zeros_like(x), np.zeros_like(x)
    else:
        fore = x < place
        y_c = np.where(fore, camber / place**2 * (2 * place * x - x**2), camber / (1 - place) ** 2 * (1 - 2 * place + 2 * place * x - x**2))
        slope = np.where(fore, 2 * camber / place**2 * (place - x), 2 * camber / (1 - place) ** 2 * (place - x))
    angle = np.arctan(slope)
    upper = np.column_stack([x - y_t * np.sin(angle), y_c + y_t * np.cos(angle)])
    lower = np.column_stack([x + y_t * np.sin(angle), y_c - y_t * np.cos(angle)])
    return chord_mm * np.vstack([upper[::-1], lower[1:]])


def naca(designation: str = "2412", chord_mm: float = 100.0, sharp: bool = True) -> NurbsCurve:
    """Closed section with a sharp trailing edge, or open with the blunt gap of the original equation."""
    points = naca_points(designation, chord_mm, sharp=sharp)
    if sharp:
        return NurbsCurve.interpolate(points, 3, closed=True, corner_at_seam=True)
    return NurbsCurve.interpolate(points, 3)


def airfoil_points(name: str, chord_mm: float) -> Array:
    path = AIRFOILS / f"{name}.dat"
    if not path.is_file():
        pytest.skip(f"{path} is not there: airfoil coordinates that may not be shipped are read from beside the checkout")
    return chord_mm * np.loadtxt(path, skiprows=1)


def airfoil(name: str, chord_mm: float = 100.0) -> NurbsCurve:
    return through_airfoil(airfoil_points(name, chord_mm), chord_mm)


def through_airfoil(points: Array, chord_mm: float) -> NurbsCurve:
    """Cubic centripetal interpolation from trailing edge over the nose to trailing edge, open.

    MH 42 ends in one point; its first and last point are moved apart by 0.15 % of the chord each, as METHOD has it.
    """
    if np.array_equal(points[0], points[-1]):
        points[0, 1] += 0.0015 * chord_mm
        points[-1, 1] -= 0.0015 * chord_mm
    return NurbsCurve.interpolate(points, 3)


def sharp_airfoil(name: str, chord_mm: float = 100.0) -> NurbsCurve:
    """Closed with a corner at the trailing edge; a blunt edge is closed in the middle of its gap."""
    points = airfoil_points(name, chord_mm)
    points[0] = points[-1] = (points[0] + points[-1]) / 2
    return NurbsCurve.interpolate(points, 3, closed=True, corner_at_seam=True)


SMOOTH: dict[str, Callable[[], NurbsCurve]] = {"P1": p1, "P2": p2, "P3": p3}
EVERY: dict[str, Callable[[], NurbsCurve]] = {
    **SMOOTH,
    "ellipse": lambda: ellipse(50.0, 20.0),
    "stadium": lambda: stadium(30.0, 12.0),
    "square": lambda: square(40.0),
    "NACA 2412 sharp": naca,
    "NACA 4412 blunt": lambda: naca("4412", sharp=False),
    "GOE404": lambda: airfoil("goe404"),
    "MH42": lambda: airfoil("mh42"),
    "MH42 sharp": lambda: sharp_airfoil("mh42"),
    "SC(2)-0714": lambda: airfoil("sc20714"),
}
FILES = ("ag35", "clarky", "dae11", "e387", "fx63137", "goe227", "goe404", "mh42", "naca65410", "rae2822", "s1223_hires", "sc20714")
SECTIONS = tuple(f"{camber}{thickness:02d}" for camber in ("00", "24", "65") for thickness in (6, 9, 21))


@cache
def curve_of(name: str) -> NurbsCurve:
    """One of EVERY, an airfoil of FILES, or a section of SECTIONS (blunt where its thickness is 9 %)."""
    if name in EVERY:
        return EVERY[name]()
    return airfoil(name) if name in FILES else naca(name, sharp=name[2:] != "09")


@cache
def nominal_of(name: str, samples: int = 2000, material: Material = "left") -> NominalProfile:
    """A nominal whose smallest step is the starting step, so that it has about that many samples; the side changes none of them."""
    if material == "right":
        return replace(nominal_of(name, samples), material=material)
    return discretize(curve_of(name), samples=samples, step_min=1.0 / samples)


def moved_curve(curve: NurbsCurve, rotation_deg: float, translation_mm: tuple[float, float]) -> NurbsCurve:
    """The curve turned about the origin, then moved."""
    control = rotated(curve.control_points_mm, rotation_deg, translation_mm)
    if curve.closed and curve.knots[0] == curve.domain[0]:
        control[-1] = control[0]
    return NurbsCurve(curve.degree, control, curve.knots.copy(), None if curve.weights is None else curve.weights.copy(), curve.closed)


def left_normal(curve: NurbsCurve, u: Array) -> Array:
    tangent = curve.derivatives(u, 1)[1]
    tangent = tangent / np.hypot(tangent[:, 0], tangent[:, 1])[:, None]
    return np.column_stack([-tangent[:, 1], tangent[:, 0]])


def inner_parameters(curve: NurbsCurve, count: int, rng: np.random.Generator, clearance: float = 1e-3) -> Array:
    """Random parameters, none within `clearance` (of the range) of an end, the seam or a corner."""
    first, last = curve.domain
    u = rng.uniform(first, last, 4 * count)
    taboo = np.concatenate([[first, last], curve.corners])
    free = np.abs(u[:, None] - taboo).min(axis=1) > clearance * (last - first)
    return np.sort(u[free][:count])


def offset_points(curve: NurbsCurve, u: Array, offset_mm: ArrayLike) -> Array:
    """Points off the curve by `offset_mm` to the left."""
    return np.asarray(curve.point(u) + np.asarray(offset_mm)[..., None] * left_normal(curve, u))


def even_in_arc_length(curve: NurbsCurve, count: int) -> Array:
    """Parameters of points even in arc length, the seam or the ends left out by half a step."""
    u, station_mm = _stations(curve)
    return np.asarray(np.interp((np.arange(count) + 0.5) / count * curve.length_mm, station_mm, u))


@lru_cache(maxsize=64)
def _stations(curve: NurbsCurve) -> tuple[Array, Array]:
    u = np.linspace(*curve.domain, 20_001)
    return u, curve.station_mm(u)


def rotated(points_mm: Array, rotation_deg: float, translation_mm: ArrayLike = (0.0, 0.0)) -> Array:
    """Points turned anticlockwise about the origin, then moved; written out, so that it shares no code with the inspection."""
    a = np.deg2rad(rotation_deg)
    x, y = points_mm[:, 0], points_mm[:, 1]
    moved = np.column_stack([np.cos(a) * x - np.sin(a) * y, np.sin(a) * x + np.cos(a) * y])
    return np.asarray(moved + np.asarray(translation_mm))


def measured(name: str, count: int, seed: int, *, noise_mm: float = 0.01, start: float = 0.0, coverage: float = 1.0) -> Array:
    """Points even in arc length over a share of the profile, on the nominal but for noise along the normal."""
    u = even_in_arc_length(curve_of(name), round(count / coverage))
    first = int(start * len(u))
    u = np.roll(u, -first)[:count] if curve_of(name).closed else u[min(first, len(u) - count) :][:count]
    return offset_points(curve_of(name), u, np.random.default_rng(seed).normal(0, noise_mm, count))
