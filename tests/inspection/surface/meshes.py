"""Meshes for tests, and an oracle of their closest points that shares nothing with the product: every triangle, in extended precision."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Long = NDArray[np.longdouble]


def sphere(cuts: int, radius: float = 30.0) -> Array:
    """A closed mesh (n, 3, 3) of a sphere about zero; its poles are fans of slivers."""
    u, v = np.linspace(0, 2 * np.pi, 2 * cuts + 1), np.linspace(0, np.pi, cuts + 1)
    grid = radius * np.stack(
        [np.outer(np.cos(u), np.sin(v)), np.outer(np.sin(u), np.sin(v)), np.outer(np.ones_like(u), np.cos(v))], axis=-1
    )
    grid[-1] = grid[0]
    grid[:, 0], grid[:, -1] = (0, 0, radius), (0, 0, -radius)
    return triangles_of_grid(grid)


def triangles_of_grid(grid: Array) -> Array:
    """Two triangles for every cell of a grid (a, b, 3) of places; outward is d/da x d/db reversed."""
    a, b, c, d = grid[:-1, :-1], grid[1:, :-1], grid[1:, 1:], grid[:-1, 1:]
    return np.concatenate([np.stack([a, d, c], axis=-2).reshape(-1, 3, 3), np.stack([a, c, b], axis=-2).reshape(-1, 3, 3)])


def prism(outline: Array, height: float) -> Array:
    """A closed prism over an anticlockwise outline (k, 2), capped by fans about its first corner, which sees all of them."""
    k = len(outline)
    low, high = np.column_stack([outline, np.zeros(k)]), np.column_stack([outline, np.full(k, height)])
    made = []
    for i in range(k):
        j = (i + 1) % k
        made += [(low[i], low[j], high[j]), (low[i], high[j], high[i])]
        if 0 < i < k - 1:
            made += [(low[0], low[i + 1], low[i]), (high[0], high[i], high[i + 1])]
    return np.array(made)


NOTCHED = np.array([(1.0, 1.0), (1.0, 3.0), (0.0, 3.0), (0.0, 0.0), (4.0, 0.0), (4.0, 1.0)])  # an L; its hollow corner sees all of it


def is_inside_notched(points: Array, height: float) -> NDArray[np.bool_]:
    """Whether points (m, 3) lie in the prism over NOTCHED."""
    x, y, z = points.T
    flat = ((x > 0) & (x < 1) & (y > 0) & (y < 3)) | ((x > 0) & (x < 4) & (y > 0) & (y < 1))
    return np.asarray(flat & (z > 0) & (z < height))


def wave(cuts: int, size: float = 60.0) -> Array:
    """An open mesh of a wavy sheet over [0, size]^2, its outside above."""
    x = np.linspace(0, size, cuts + 1)
    grid = np.stack([*np.meshgrid(x, x, indexing="ij"), 4 * np.outer(np.sin(x / 7), np.cos(x / 9))], axis=-1)
    return triangles_of_grid(grid)[:, ::-1]


def exhaustive(points: Array, triangles: Array) -> Long:
    """Distances (m,) of points from the nearest of all triangles, by barycentric regions (Ericson), in extended precision."""
    result = np.empty(len(points), dtype=np.longdouble)
    a, b, c = (triangles[:, i].astype(np.longdouble) for i in range(3))
    for row, point in enumerate(points.astype(np.longdouble)):
        result[row] = np.sqrt(((_closest(point, a, b, c) - point) ** 2).sum(axis=1).min())
    return result


def _closest(p: Long, a: Long, b: Long, c: Long) -> Long:
    ab, ac, ap, bp, cp = b - a, c - a, p - a, p - b, p - c
    d1, d2, d3, d4, d5, d6 = (np.asarray((u * v).sum(axis=1)) for u, v in ((ab, ap), (ac, ap), (ab, bp), (ac, bp), (ab, cp), (ac, cp)))
    va, vb, vc = d3 * d6 - d5 * d4, d5 * d2 - d1 * d6, d1 * d4 - d3 * d2
    with np.errstate(divide="ignore", invalid="ignore"):
        total = va + vb + vc
        result = a + (vb / total)[:, None] * ab + (vc / total)[:, None] * ac
        on_bc = b + ((d4 - d3) / ((d4 - d3) + (d5 - d6)))[:, None] * (c - b)
        on_ac = a + (d2 / (d2 - d6))[:, None] * ac
        on_ab = a + (d1 / (d1 - d3))[:, None] * ab
    for where, what in (
        ((va <= 0) & (d4 >= d3) & (d5 >= d6), on_bc),
        ((vb <= 0) & (d2 >= 0) & (d6 <= 0), on_ac),
        ((d6 >= 0) & (d5 <= d6), c),
        ((vc <= 0) & (d1 >= 0) & (d3 <= 0), on_ab),
        ((d3 >= 0) & (d4 <= d3), b),
        ((d1 <= 0) & (d2 <= 0), a),
    ):
        result = np.where(where[:, None], what, result)
    return np.asarray(result)
