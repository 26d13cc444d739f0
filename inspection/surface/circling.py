"""Steps of a fit that go round in circles: whether they do, and how far they move the points.

On coarse facets the squares have a kink at every edge, and where deviations are brought to a value other than zero they may have their
least value in one. Gauss and Newton's steps then jump from side to side about it and never become short.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from inspection.surface.rigid_motion import RigidMotion

Array = NDArray[np.float64]

_HALF = 12  # steps; a circle is told by two times as many
_SAME_PLACE = 0.5  # of how wide the steps are spread: what the middles of both halves may lie apart, else the fit still goes somewhere
_NO_SHORTER = 0.5  # times as wide as the first half the second one is at least, else the steps still become shorter
_NO_BETTER = 0.25  # of how much the mean square varies: by how much the best of the second half may be better, else the fit still gains


@dataclass(frozen=True, slots=True, eq=False)
class PoseOnTheWay:
    """A pose that a step of a fit came to, and the mean square of the deviations there."""

    motion: RigidMotion
    mean_square: float


def find_circle(way: Sequence[PoseOnTheWay], centre_mm: Array, radius_mm: float) -> tuple[PoseOnTheWay, ...]:
    """The last poses of a fit, where they go round in circles; none where they go somewhere or the steps still become shorter.

    centre_mm, radius_mm : the middle (3,) of the points on the nominal, and how far the farthest of them is from it
    """
    last = tuple(way[-2 * _HALF :])
    if len(last) < 2 * _HALF:
        return ()
    off = np.array([_way_from(last[-1].motion, one.motion, centre_mm, radius_mm) for one in last])
    first, second = off[:_HALF], off[_HALF:]
    spreads = [float(np.linalg.norm(half - half.mean(axis=0), axis=1).max()) for half in (first, second)]
    drift = float(np.linalg.norm(first.mean(axis=0) - second.mean(axis=0)))
    squares = np.array([one.mean_square for one in last])
    gain = squares[:_HALF].min() - squares[_HALF:].min()
    stays = drift <= _SAME_PLACE * max(spreads) and gain <= _NO_BETTER * np.ptp(squares)
    return last if stays and spreads[1] >= _NO_SHORTER * spreads[0] else ()


def width_mm(circle: Sequence[PoseOnTheWay], points_mm: Array) -> float:
    """How far apart two poses of a circle at most bring one of the points (m, 3): the longest diagonal of a box that holds its places."""
    lowest = highest = circle[0].motion.apply(points_mm)
    for one in circle[1:]:
        placed = one.motion.apply(points_mm)
        lowest, highest = np.minimum(lowest, placed), np.maximum(highest, placed)
    return float(np.sqrt(((highest - lowest) ** 2).sum(axis=1).max()))


def best_of(circle: Sequence[PoseOnTheWay]) -> RigidMotion:
    """The pose of the least mean square."""
    return min(circle, key=lambda one: one.mean_square).motion


def _way_from(one: RigidMotion, other: RigidMotion, centre_mm: Array, radius_mm: float) -> Array:
    """The shift of the centre and the turn (6,) that lead from a pose to another one near it, turns by the way that the rim goes."""
    between = other.after(one.inverse())
    skew = (between.rotation - between.rotation.T) / 2
    turn = np.array([skew[2, 1], skew[0, 2], skew[1, 0]])
    return np.concatenate([between.apply(centre_mm[None])[0] - centre_mm, radius_mm * turn])
