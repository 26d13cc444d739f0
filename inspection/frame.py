"""Algorithm 2 of Hari Ganesh & Samuel (2022): principal axes, oriented bounding box, dominant points."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_DOMINANT_SHARE = 0.1  # of the largest curvature: below it a local maximum is no dominant point (measured: keeps 5 to 8)


@dataclass(frozen=True, slots=True, eq=False)
class Frame:
    """The local frame of a set of points.

    origin_mm  : (2,) weighted mean
    axes       : (2, 2) columns: unit principal axes, the longer spread first, right-handed
    low_mm, high_mm : (2,) extent along the axes, about the origin
    corners_mm : (4, 2) of the oriented bounding box
    """

    origin_mm: Array
    axes: Array
    low_mm: Array
    high_mm: Array
    corners_mm: Array

    @property
    def diagonal_points_mm(self) -> Array:
        """Lowest and highest extents (4,), in the order in which the diagonal rule compares them."""
        return np.concatenate([self.low_mm, self.high_mm])

    @property
    def box_centre_mm(self) -> Array:
        """Centre (2,) of the oriented bounding box."""
        return np.asarray(self.origin_mm + self.axes @ (self.low_mm + self.high_mm) / 2)


def principal_frame(points_mm: Array, weights: Array | None = None) -> Frame:
    """Frame of points (n, 2), equation 7 of the paper; `weights` (n,) make it independent of how densely points lie."""
    share = np.full(len(points_mm), 1.0 / len(points_mm)) if weights is None else weights / weights.sum()
    mean = share @ points_mm
    centred = points_mm - mean
    _, vectors = np.linalg.eigh((centred * share[:, None]).T @ centred)
    axes = vectors[:, ::-1].copy()
    axes[:, 1] *= np.sign(np.linalg.det(axes))
    local = centred @ axes
    low, high = local.min(axis=0), local.max(axis=0)
    box = np.array([[low[0], low[1]], [high[0], low[1]], [high[0], high[1]], [low[0], high[1]]])
    return Frame(mean, axes, low, high, mean + box @ axes.T)


def arc_length_weights(points_mm: Array, closed: bool) -> Array:
    """Half the distance (n,) to both neighbours in scan order: a point's share of the profile's length."""
    steps = np.hypot(*np.diff(points_mm, axis=0, append=points_mm[:1]).T)
    if not closed:
        steps[-1] = 0.0
    return np.asarray((steps + np.roll(steps, 1)) / 2)


def dominant_points(points_mm: Array, closed: bool) -> NDArray[np.int64]:
    """Indices of the marked local maxima of the discrete curvature (Menger's, of three neighbours), and of the ends of an open set."""
    before, after = np.roll(points_mm, 1, axis=0), np.roll(points_mm, -1, axis=0)
    a, b, c = points_mm - before, after - points_mm, after - before
    lengths = np.hypot(*a.T) * np.hypot(*b.T) * np.hypot(*c.T)
    cross = np.abs(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])
    curvature = np.divide(2 * cross, lengths, out=np.zeros(len(cross)), where=lengths > 0)
    if not closed:
        curvature[[0, -1]] = 0.0
    peak = (curvature >= np.roll(curvature, 1)) & (curvature > np.roll(curvature, -1)) & (curvature > _DOMINANT_SHARE * curvature.max())
    if not closed:
        peak[[0, -1]] = True
    return np.flatnonzero(peak)
