"""Spline faces for tests: a blade, a mould, a rational cylinder, a sphere with its poles, a box of six planes."""

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import make_interp_spline

from inspection.surface import SplineFace

Array = NDArray[np.float64]


def through(grid: Array) -> SplineFace:
    """The bicubic face through a grid (a, b, 3) of places."""
    u, v = np.linspace(0, 1, len(grid)), np.linspace(0, 1, len(grid[0]))
    along_u = make_interp_spline(u, grid, k=3)
    along_v = make_interp_spline(v, along_u.c.transpose(1, 0, 2), k=3)
    return SplineFace((3, 3), np.ascontiguousarray(along_v.c.transpose(1, 0, 2)), np.asarray(along_u.t), np.asarray(along_v.t))


def blade(places: int = 60, sections: int = 8) -> SplineFace:
    """A twisted, tapered blade of span 150 with round edges of some 0.4 mm, all round in u; its outside is S_u x S_v."""
    angle = np.linspace(0, 2 * np.pi, places)
    made = []
    for z in np.linspace(0, 150, sections):
        chord, twist = 60 - 18 * z / 150, np.radians(40) * z / 150
        x = chord / 2 * np.cos(angle)
        y = 0.06 * chord * np.sin(angle) * (1 + 0.5 * np.cos(angle)) + 0.2 * np.sin(angle) + 0.08 * chord * np.cos(angle) ** 2
        made.append(np.column_stack([x * np.cos(twist) - y * np.sin(twist), x * np.sin(twist) + y * np.cos(twist), np.full(places, z)]))
    return through(np.stack(made, axis=1))


def mould(places: int = 24) -> SplineFace:
    """A wavy sheet of 120 mm, concave and convex."""
    x = np.linspace(0, 120, places)
    return through(
        np.stack([*np.meshgrid(x, x, indexing="ij"), 9 * np.outer(np.sin(x / 17), np.cos(x / 23)) + 0.001 * np.outer(x, x)], axis=-1)
    )


def _circle() -> tuple[Array, Array, Array]:
    """The unit circle as four rational quadratics: control points (9, 2), weights (9,), knots."""
    h = np.sqrt(0.5)
    points = np.array([(1, 0), (1, 1), (0, 1), (-1, 1), (-1, 0), (-1, -1), (0, -1), (1, -1), (1, 0)], dtype=float)
    weights = np.array([1, h, 1, h, 1, h, 1, h, 1])
    return points, weights, np.repeat([0.0, 0.25, 0.5, 0.75, 1.0], [3, 2, 2, 2, 3])


def cylinder(radius: float = 30.0, height: float = 80.0) -> SplineFace:
    """A whole cylinder about z, rational of degree 2 by 1; its outside is away from the axis."""
    points, weights, knots = _circle()
    flat = np.column_stack([radius * points, np.zeros(9)])
    grid = np.stack([flat, flat + np.array([0, 0, height])], axis=1)
    return SplineFace((2, 1), grid, knots, np.array([0.0, 0, 1, 1]), np.column_stack([weights, weights]))


def sphere(radius: float = 20.0) -> SplineFace:
    """A whole sphere, rational of degree 2 by 2: a half circle turned about z, with both poles."""
    points, weights, knots = _circle()
    half = np.array([(0, -1), (1, -1), (1, 0), (1, 1), (0, 1)], dtype=float)
    h = np.sqrt(0.5)
    across = np.array([1, h, 1, h, 1])
    grid = np.concatenate([points[:, None] * half[None, :, :1], np.broadcast_to(half[None, :, 1:], (9, 5, 1))], axis=2) * radius
    return SplineFace((2, 2), grid, knots, np.repeat([0.0, 0.5, 1.0], [3, 2, 3]), weights[:, None] * across)


def plane(corner: Array, along_u: Array, along_v: Array, name: str = "") -> SplineFace:
    """A bilinear face."""
    grid = np.array([[corner, corner + along_v], [corner + along_u, corner + along_u + along_v]])
    line = np.array([0.0, 0, 1, 1])
    return SplineFace((1, 1), grid, line, line, name=name)


def box(size: tuple[float, float, float] = (4.0, 3.0, 2.0)) -> list[SplineFace]:
    """The six faces of a box with a corner at zero, outsides outward."""
    x, y, z = np.diag(size)
    o = np.zeros(3)
    return [plane(o, y, x), plane(z, x, y), plane(o, x, z), plane(y, z, x), plane(o, z, y), plane(x, y, z)]
