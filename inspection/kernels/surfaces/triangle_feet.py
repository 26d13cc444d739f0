"""The closest point of one triangle to a place, and the side by the pseudonormal of what it lies on.

The pseudonormal is that of Baerentzen and Aanaes, "Signed distance computation using the angle weighted pseudonormal" (2005).
"""

from typing import Any

import numpy as np

from inspection.kernels.compiling import inlined_uncounted_kernel, uncounted_kernel
from inspection.kernels.surfaces.layout import (
    CORNER_1,
    CORNER_2,
    CORNER_3,
    EDGE_1,
    EDGE_2,
    EDGE_3,
    IN_TRIANGLE,
    NOTHING,
    ON_BORDER,
    ON_CORNER,
    ON_EDGE,
)


@inlined_uncounted_kernel
def _dot(ax: float, ay: float, az: float, bx: float, by: float, bz: float) -> float:
    return ax * bx + ay * by + az * bz


@inlined_uncounted_kernel
def _cross(ax: float, ay: float, az: float, bx: float, by: float, bz: float) -> tuple[float, float, float]:
    return ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx


@inlined_uncounted_kernel
def _held(t: float) -> float:
    return min(max(t, 0.0), 1.0)


@inlined_uncounted_kernel
def _square_off(wx: float, wy: float, wz: float, t: float, ex: float, ey: float, ez: float) -> float:
    """Square of w - t e."""
    dx, dy, dz = wx - t * ex, wy - t * ey, wz - t * ez
    return dx * dx + dy * dy + dz * dz


@inlined_uncounted_kernel
def _edges(corners: Any, triangles: Any, triangle: Any) -> tuple[Any, ...]:
    """The corner A of a triangle and its edges AB and AC."""
    a, b, c = 3 * triangles[3 * triangle], 3 * triangles[3 * triangle + 1], 3 * triangles[3 * triangle + 2]
    ax, ay, az = corners[a], corners[a + 1], corners[a + 2]
    return ax, ay, az, corners[b] - ax, corners[b + 1] - ay, corners[b + 2] - az, corners[c] - ax, corners[c + 1] - ay, corners[c + 2] - az


@inlined_uncounted_kernel
def closest_on_triangle(corners: Any, triangles: Any, triangle: Any, x: float, y: float, z: float) -> tuple[Any, ...]:
    """Square of the distance of the closest point of a triangle, what it lies on, and its weights of B and C."""
    ax, ay, az, ex, ey, ez, gx, gy, gz = _edges(corners, triangles, triangle)
    wx, wy, wz = x - ax, y - ay, z - az
    mx, my, mz = _cross(ex, ey, ez, gx, gy, gz)
    per = 1.0 / _dot(mx, my, mz, mx, my, mz)
    sx, sy, sz = _cross(wx, wy, wz, gx, gy, gz)
    tx, ty, tz = _cross(ex, ey, ez, wx, wy, wz)
    s, t = _dot(sx, sy, sz, mx, my, mz) * per, _dot(tx, ty, tz, mx, my, mz) * per
    if s > 0.0 and t > 0.0 and s + t < 1.0:
        height = _dot(wx, wy, wz, mx, my, mz)
        return height * height * per, IN_TRIANGLE, s, t
    bx, by, bz, ux, uy, uz = gx - ex, gy - ey, gz - ez, wx - ex, wy - ey, wz - ez
    first = _held(_dot(wx, wy, wz, ex, ey, ez) / _dot(ex, ey, ez, ex, ey, ez))
    second = _held(_dot(wx, wy, wz, gx, gy, gz) / _dot(gx, gy, gz, gx, gy, gz))
    third = _held(_dot(ux, uy, uz, bx, by, bz) / _dot(bx, by, bz, bx, by, bz))
    square = _square_off(wx, wy, wz, first, ex, ey, ez)
    place, p, q = CORNER_1 if first == 0.0 else CORNER_2 if first == 1.0 else EDGE_1, first, 0.0
    other = _square_off(wx, wy, wz, second, gx, gy, gz)
    if other < square:
        square, place, p, q = other, CORNER_1 if second == 0.0 else CORNER_3 if second == 1.0 else EDGE_2, 0.0, second
    other = _square_off(ux, uy, uz, third, bx, by, bz)
    if other < square:
        square, place, p, q = other, CORNER_2 if third == 0.0 else CORNER_3 if third == 1.0 else EDGE_3, 1.0 - third, third
    return square, place, p, q


@inlined_uncounted_kernel
def _unit_normal(ex: float, ey: float, ez: float, gx: float, gy: float, gz: float) -> tuple[float, float, float]:
    mx, my, mz = _cross(ex, ey, ez, gx, gy, gz)
    length = np.sqrt(_dot(mx, my, mz, mx, my, mz))
    return mx / length, my / length, mz / length


@inlined_uncounted_kernel
def foot_in_triangle(corners: Any, triangles: Any, triangle: Any, x: float, y: float, z: float) -> tuple[Any, ...]:
    """The foot (3) inside a triangle, the distance with its side, and the direction (3) in which that grows."""
    ax, ay, az, ex, ey, ez, gx, gy, gz = _edges(corners, triangles, triangle)
    nx, ny, nz = _unit_normal(ex, ey, ez, gx, gy, gz)
    height = _dot(x - ax, y - ay, z - az, nx, ny, nz)
    return x - height * nx, y - height * ny, z - height * nz, height, nx, ny, nz


@uncounted_kernel
def foot_on_edge(
    corners: Any,
    triangles: Any,
    beyond: Any,
    corner_normals: Any,
    corner_is_open: Any,
    grain_mm: float,
    x: float,
    y: float,
    z: float,
    triangle: Any,
    place: int,
    p: float,
    q: float,
) -> tuple[Any, ...]:
    """The same for a foot on an edge or a corner, which `closest_on_triangle` found, and what it is."""
    ax, ay, az, ex, ey, ez, gx, gy, gz = _edges(corners, triangles, triangle)
    nx, ny, nz = _unit_normal(ex, ey, ez, gx, gy, gz)
    wx, wy, wz = x - ax, y - ay, z - az
    dx, dy, dz = wx - p * ex - q * gx, wy - p * ey - q * gy, wz - p * ez - q * gz
    px, py, pz = nx, ny, nz
    if place <= EDGE_3:
        neighbour = beyond[3 * triangle + place - EDGE_1]
        kind = ON_BORDER if neighbour == NOTHING else ON_EDGE
        if neighbour != NOTHING:
            _, _, _, kx, ky, kz, lx, ly, lz = _edges(corners, triangles, neighbour)
            ox, oy, oz = _unit_normal(kx, ky, kz, lx, ly, lz)
            px, py, pz = nx + ox, ny + oy, nz + oz
    else:
        corner = triangles[3 * triangle + place - CORNER_1]
        kind = ON_BORDER if corner_is_open[corner] else ON_CORNER
        px, py, pz = corner_normals[3 * corner], corner_normals[3 * corner + 1], corner_normals[3 * corner + 2]
    distance = np.sqrt(dx * dx + dy * dy + dz * dz)
    sign = 1.0 if _dot(dx, dy, dz, px, py, pz) >= 0.0 else -1.0
    length = np.sqrt(px * px + py * py + pz * pz)
    if distance > grain_mm:
        px, py, pz, length = dx, dy, dz, sign * distance
    elif length == 0.0:  # two faces back to back
        px, py, pz, length = nx, ny, nz, 1.0
    fx, fy, fz = ax + p * ex + q * gx, ay + p * ey + q * gy, az + p * ez + q * gz
    return fx, fy, fz, sign * distance, px / length, py / length, pz / length, kind
