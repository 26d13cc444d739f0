"""Airfoil sections whose characteristics are known, for the tests of this folder."""

from functools import cache

import numpy as np
from numpy.typing import NDArray

from inspection import AirfoilSection, AirfoilValues, NurbsCurve, SectionValue, evaluate_airfoil, find_airfoil
from tests.inspection.profiles import airfoil_points, ellipse

Array = NDArray[np.float64]

INVERTED_ABOUT = np.array([8.0, -180.0])  # far below the ellipse, so that its image is bent, not turned inside out
INVERSION_RADIUS = 180.0


@cache
def file_section(name: str) -> AirfoilSection:
    """The section of an airfoil file as it stands, chord 100 mm: open at the trailing edge, though its ends may be one place."""
    return find_airfoil(NurbsCurve.interpolate(airfoil_points(name, 100.0), 3))


@cache
def file_values(name: str) -> AirfoilValues:
    return evaluate_airfoil(file_section(name), windows_deg=(30.0, 60.0), offsets_mm=(1.0, 5.0))


def value_of(values: tuple[SectionValue, ...], name: str, method: str, *window: float) -> SectionValue:
    """The one value of that name, method and window."""
    (found,) = (v for v in values if (v.name, v.method) == (name, method) and (not window or tuple(n for _, n in v.window) == window))
    return found


def invert(points: Array) -> Array:
    """The image of points (n, 2) under an inversion: it takes circles to circles and keeps contacts, so the medial axis is known."""
    d = points - INVERTED_ABOUT
    return np.asarray(INVERTED_ABOUT + INVERSION_RADIUS**2 * d / (d * d).sum(axis=1)[:, None])


def invert_circles(centres: Array, radii: Array) -> tuple[Array, Array]:
    """Centres (k, 2) and radii (k,) of the images of circles that the point of inversion lies outside of."""
    d = centres - INVERTED_ABOUT
    power = (d * d).sum(axis=1) - radii**2
    return INVERTED_ABOUT + INVERSION_RADIUS**2 * d / power[:, None], INVERSION_RADIUS**2 * radii / power


@cache
def bent_ellipse() -> AirfoilSection:
    """An ellipse of half axes 50 and 6 mm, bent by inversion; the spline runs within 1e-7 mm of it."""
    t = np.linspace(0.0, 2 * np.pi, 1201)[:-1]
    curve = NurbsCurve.interpolate(invert(np.column_stack([50 * np.cos(t), 6 * np.sin(t)])), 3, closed=True)
    return find_airfoil(curve, leading_near_mm=invert(np.array([[-50.0, 0.0]]))[0])


def ellipse_circles(x: Array, a: float = 50.0, b: float = 6.0) -> tuple[Array, Array]:
    """The inscribed circles of an ellipse with centres at x (k,) on its long axis, |x| <= (a^2 - b^2) / a: closed form."""
    return np.column_stack([x, np.zeros_like(x)]), b * np.sqrt(1 - x**2 / (a**2 - b**2))


@cache
def ellipse_section(a: float = 50.0, b: float = 6.0) -> AirfoilSection:
    return find_airfoil(ellipse(a, b))
