"""From where a part is looked at: four sides that together show all of it, and from straight above a place."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from cmmlink.report.raster import Camera

Array = NDArray[np.float64]

_SIDES = ((1, -1, 1), (-1, -1, -1), (-1, 1, 1), (1, 1, -1))  # the corners of a tetrahedron: every face looks at one of them
_LEAST = 0.3  # of a direction, along any axis, so that no face is only seen from the side
_ROOM = 0.94  # of an image that the part may take
_MOST_UPRIGHT = 0.9  # cosine from which on z is no direction that shows which way is up


def four_sides(places_mm: Array, width_px: int, height_px: int) -> tuple[Camera, ...]:
    """Four cameras around places (n, 3), all with pixels of one size; a part's large faces are seen the straightest."""
    low, high = places_mm.min(axis=0), places_mm.max(axis=0)
    extent = np.maximum(high - low, 1e-3 * max(float(np.ptp(places_mm, axis=0).max()), 1e-9))
    straight = np.maximum(1.0 / np.sqrt(extent), _LEAST / np.sqrt(extent.min()))
    towards = [np.array(side) * straight / float(np.hypot.reduce(straight)) for side in _SIDES]
    frames = [_frame(direction, extent) for direction in towards]
    size = max(_mm_per_px(places_mm, right, up, width_px, height_px) for right, up in frames)
    return tuple(
        Camera(right, up, direction, _middle(places_mm, right, up, direction), size, width_px, height_px)
        for direction, (right, up) in zip(towards, frames, strict=True)
    )


def close_up(place_mm: Sequence[float], normal: Array, across_mm: float, width_px: int, height_px: int) -> Camera:
    """A camera straight above a place that sees so much of the part across."""
    towards = normal / float(np.hypot.reduce(normal))
    right, up = _frame(towards, np.ones(3))
    return Camera(right, up, towards, np.array(place_mm, dtype=np.float64), across_mm / min(width_px, height_px), width_px, height_px)


def _frame(towards: Array, extent: Array) -> tuple[Array, Array]:
    """Unit directions right and up of an image. What is far longer than high lies across it, everything else stands upright."""
    upright = np.array([0.0, 0.0, 1.0]) if abs(towards[2]) < _MOST_UPRIGHT else np.array([0.0, 1.0, 0.0])
    right = _unit(np.cross(upright, towards))
    up = np.cross(towards, right)
    if extent[2] > extent[0] and extent[2] > extent[1]:  # turned a quarter, so that it fills the image
        return up, -right
    return right, up


def _mm_per_px(places_mm: Array, right: Array, up: Array, width_px: int, height_px: int) -> float:
    size: float = max(float(np.ptp(places_mm @ right)) / width_px, float(np.ptp(places_mm @ up)) / height_px) / _ROOM
    return size


def _middle(places_mm: Array, right: Array, up: Array, towards: Array) -> Array:
    middle = [(float((places_mm @ axis).min()) + float((places_mm @ axis).max())) / 2 for axis in (right, up, towards)]
    return np.asarray(middle[0] * right + middle[1] * up + middle[2] * towards)


def _unit(vector: Array) -> Array:
    return np.asarray(vector / float(np.hypot.reduce(vector)))
