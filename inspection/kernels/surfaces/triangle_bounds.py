"""How near each triangle of a cluster may be, sixteen at once in single precision, rounding included: what is farther needs no look.

The distance from a triangle is no less than that from its plane together with how far a place lies beyond one of its edges. Bounds of
squares are kept as whole numbers, which rise with them; their last bits hold the lane, so that the least one says where it is.
"""

from typing import Any

import numpy as np

from inspection.kernels.compiling import as_wide_as_can_be, bits_of, fma, inlined_uncounted_kernel
from inspection.kernels.surfaces.layout import (
    CLUSTER,
    LANE_BITS,
    LANES,
    ORIGIN_WIDTH,
    OWN_PLANE,
    PLANE_AB,
    PLANE_AC,
    PLANE_BC,
    REACH,
)

_ROUND_OFF: Any = np.float32(1e-6)  # of the lengths that go into the distance from a plane: ten operations of 6e-8 each
_LESS: Any = np.float32(1.0 - 1e-6)  # the square and the sum are rounded, too
_MORE = 1.0 + 1e-6
_MORE_SINGLE: Any = np.float32(_MORE)
_ANY = 0x7FFFFFFFFFFF  # tells the compiler that an index is not negative
NEVER: Any = np.int32(0x7FFFFFFF)  # a bound that is no longer asked for
_ZERO: Any = np.float32(0.0)


@inlined_uncounted_kernel
def enter_bounds(planes: Any, origins: Any, cluster: Any, x: float, y: float, z: float, bounds: Any, first: int) -> None:
    """Enter the bounds of the triangles of a cluster in places from `first` on; the lane of a bound is its place."""
    as_wide_as_can_be()
    row, first = cluster * CLUSTER & _ANY, first & _ANY
    wx, wy, wz, round_off = _from_origin(origins, cluster, x, y, z)
    for j in range(LANES):
        height, beyond = _height_and_beyond(planes, row + j, wx, wy, wz)
        height, beyond = max(height - round_off, _ZERO), max(beyond - round_off, _ZERO)
        bounds[first + j] = np.int32((bits_of(fma(height, height, beyond * beyond) * _LESS) & ~LANE_BITS) | (first + j))


@inlined_uncounted_kernel
def may_be_closest(
    planes: Any, origins: Any, cluster: Any, x: float, y: float, z: float, radius: float, tangent: float, within: float
) -> bool:
    """Whether a triangle of a cluster may be the closest of a place no farther than a radius from (x, y, z).

    tangent : of the most that the way from a foot to its place leans from the normal of the foot's triangle
    within  : the distance that the closest point of (x, y, z) and twice the radius make
    """
    as_wide_as_can_be()
    row = cluster * CLUSTER & _ANY
    wx, wy, wz, round_off = _from_origin(origins, cluster, x, y, z)
    near, lean, limit = np.float32(radius) + round_off, np.float32(tangent), np.float32(within * within * _MORE)
    found = np.int32(0)
    for j in range(LANES):
        height, beyond = _height_and_beyond(planes, row + j, wx, wy, wz)
        leans = beyond - near <= (height + near) * lean * _MORE_SINGLE
        height, beyond = max(height - round_off, _ZERO), max(beyond - round_off, _ZERO)
        found |= np.int32(1) if leans & (fma(height, height, beyond * beyond) * _LESS <= limit) else np.int32(0)
    return bool(found != 0)


@inlined_uncounted_kernel
def _from_origin(origins: Any, cluster: Any, x: float, y: float, z: float) -> tuple[Any, ...]:
    """A place from the origin of a cluster, and the round-off of distances from its planes."""
    at = cluster * ORIGIN_WIDTH
    wx, wy, wz = np.float32(x - origins[at]), np.float32(y - origins[at + 1]), np.float32(z - origins[at + 2])
    return wx, wy, wz, _ROUND_OFF * (abs(wx) + abs(wy) + abs(wz) + np.float32(origins[at + REACH]))


@inlined_uncounted_kernel
def _height_and_beyond(planes: Any, here: int, wx: Any, wy: Any, wz: Any) -> tuple[Any, Any]:
    """The distance from the plane of a triangle, and how far beyond one of its edges."""
    beyond = max(_off(planes, here + PLANE_AB * LANES, wx, wy, wz), _off(planes, here + PLANE_AC * LANES, wx, wy, wz))
    return abs(_off(planes, here + OWN_PLANE * LANES, wx, wy, wz)), max(beyond, _off(planes, here + PLANE_BC * LANES, wx, wy, wz))


@inlined_uncounted_kernel
def _off(planes: Any, at: int, wx: Any, wy: Any, wz: Any) -> Any:
    """The distance from a plane, with its side."""
    return fma(planes[at], wx, fma(planes[at + LANES], wy, fma(planes[at + 2 * LANES], wz, planes[at + 3 * LANES])))


@inlined_uncounted_kernel
def least_bound(bounds: Any, count: int) -> Any:
    """The least of the bounds at the first places."""
    least = bounds[0]
    for q in range(count):
        least = min(least, bounds[q])
    return least


@inlined_uncounted_kernel
def bound_of(square: float) -> Any:
    """What no bound of a triangle as near as the root of a square exceeds."""
    return bits_of(np.float32(square * _MORE)) | np.int32(LANE_BITS)
