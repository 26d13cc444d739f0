"""Which closed contours of a section are holes, and which overlap.

Two contours that do not cross lie inside or beside each other as a whole, so any point of one tells which, as long as it does
not lie on the other: shells that touch share corners. Contours that cross do neither: that is told, and none of them is a hole.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

_ASKED = 64  # points of a contour that are asked where they lie; even along its corners, so some are far from any touch
_BLOCK = 16  # segments in a row that share a box
_PAIRS = 4096  # pairs of blocks compared at once: a million pairs of segments


@dataclass(frozen=True, slots=True, eq=False)
class Nesting:
    """How n closed contours lie.

    hole        : (n,) inside an odd number of others, and crossing none
    overlaps_mm : (k, 2) one place for each pair that crosses or coincides
    """

    hole: NDArray[np.bool_]
    overlaps_mm: NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class _Sides:
    """Points of a contour, (p, 2), that lie in or out of another; those on it are left out."""

    inside_mm: NDArray[np.float64]
    outside_mm: NDArray[np.float64]


def nest(rings: list[NDArray[np.float64]], tie_mm: float) -> Nesting:
    """Tell holes from outer contours; each ring is (m, 2). Points nearer than `tie_mm` to a ring lie on it."""
    around, crossed = np.zeros(len(rings), dtype=np.intp), np.zeros(len(rings), dtype=bool)
    overlaps = []
    for one, other in _near_pairs(rings, tie_mm):
        first, second = rings[one], rings[other]
        place = _crossing(first, second, tie_mm)
        in_second, in_first = _sides(first, second, tie_mm), _sides(second, first, tie_mm)
        if place is None:
            place = _mixed(first, in_second, in_first)
        if place is not None:
            overlaps.append(place)
            crossed[[one, other]] = True
        else:
            around[one] += len(in_second.inside_mm) > 0
            around[other] += len(in_first.inside_mm) > 0
    return Nesting((around % 2 == 1) & ~crossed, np.array(overlaps, dtype=np.float64).reshape(-1, 2))


def _near_pairs(rings: list[NDArray[np.float64]], tie_mm: float) -> Iterator[tuple[int, int]]:
    """Yield the pairs whose boxes meet."""
    low = np.array([ring.min(axis=0) for ring in rings]).reshape(-1, 2) - tie_mm
    high = np.array([ring.max(axis=0) for ring in rings]).reshape(-1, 2) + tie_mm
    for one in range(len(rings)):
        meet = np.all((low[one + 1 :] <= high[one]) & (high[one + 1 :] >= low[one]), axis=1)
        yield from ((one, one + 1 + int(other)) for other in np.flatnonzero(meet))


def _mixed(ring: NDArray[np.float64], of_first: _Sides, of_second: _Sides) -> NDArray[np.float64] | None:
    """Return a place where two contours overlap though none of their segments cross: one lies on both sides, or they coincide."""
    for sides in (of_first, of_second):
        if len(sides.inside_mm) and len(sides.outside_mm):
            return np.asarray(sides.inside_mm[0])
    coincide = not (len(of_first.inside_mm) or len(of_first.outside_mm))
    return np.asarray(ring[0]) if coincide else None


def _sides(ring: NDArray[np.float64], other: NDArray[np.float64], tie_mm: float) -> _Sides:
    """Ask corners and middles of `ring` on which side of `other` they lie."""
    points = np.stack([ring, (ring + np.roll(ring, -1, axis=0)) / 2], axis=1).reshape(-1, 2)
    points = points[np.unique(np.linspace(0, len(points) - 1, _ASKED).round().astype(int))]
    far = np.any((points < other.min(axis=0) - tie_mm) | (points > other.max(axis=0) + tie_mm), axis=1)
    near = points[~far]
    start = other[None, :, :] - near[:, None, :]  # (p, m, 2)
    end = np.roll(start, -1, axis=1)
    inside = _encloses(start, end)
    tied = _distance_mm(start, end) <= tie_mm
    return _Sides(near[inside & ~tied], np.concatenate([points[far], near[~inside & ~tied]]))


def _encloses(start: NDArray[np.float64], end: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Tell whether segments (p, m, 2) run round the origin: a ray towards +x then crosses them an odd number of times."""
    crosses = (start[..., 1] >= 0) != (end[..., 1] >= 0)
    side = start[..., 0] * end[..., 1] - end[..., 0] * start[..., 1]
    return np.asarray(np.count_nonzero(crosses & ((side > 0) == (end[..., 1] > start[..., 1])), axis=1) % 2 == 1)


def _distance_mm(start: NDArray[np.float64], end: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the distances (p,) of the origin from the nearest of its segments (p, m, 2)."""
    if not start.size:
        return np.empty(0)
    along = end - start
    share = np.clip(-(start * along).sum(axis=-1) / np.maximum((along * along).sum(axis=-1), np.finfo(float).tiny), 0.0, 1.0)
    foot = start + share[..., None] * along
    return np.asarray(np.hypot(foot[..., 0], foot[..., 1]).min(axis=1))


def _crossing(first: NDArray[np.float64], second: NDArray[np.float64], tie_mm: float) -> NDArray[np.float64] | None:
    """Return where a segment of one ring crosses one of the other, each by more than `tie_mm` to both sides; None when none does."""
    one, two = _in_blocks(first), _in_blocks(second)  # (b, block, 2 ends, 2)
    low_1, high_1, low_2, high_2 = one.min(axis=(1, 2)), one.max(axis=(1, 2)), two.min(axis=(1, 2)), two.max(axis=(1, 2))
    meet = np.all((low_1[:, None] <= high_2[None]) & (high_1[:, None] >= low_2[None]), axis=2)
    pairs = np.argwhere(meet)
    for at in range(0, len(pairs), _PAIRS):
        a, b = one[pairs[at : at + _PAIRS, 0]][:, :, None], two[pairs[at : at + _PAIRS, 1]][:, None, :]
        of_a, of_b = _offsets_mm(a, b), _offsets_mm(b, a)
        hit = (of_a.min(axis=-1) < -tie_mm) & (of_a.max(axis=-1) > tie_mm) & (of_b.min(axis=-1) < -tie_mm) & (of_b.max(axis=-1) > tie_mm)
        if hit.any():
            pair, of_first, of_second = np.argwhere(hit)[0]
            start, end = of_a[pair, of_first, of_second]
            p, q = a[pair, of_first, 0]
            return np.asarray(p + start / (start - end) * (q - p))
    return None


def _in_blocks(ring: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the segments of a ring in blocks (b, block, 2, 2); the last one is filled with repeats of its last segment."""
    segments = np.stack([ring, np.roll(ring, -1, axis=0)], axis=1)
    fill = -len(segments) % _BLOCK
    return np.concatenate([segments, np.repeat(segments[-1:], fill, axis=0)]).reshape(-1, _BLOCK, 2, 2)


def _offsets_mm(segments: NDArray[np.float64], lines: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return how far both ends of segments lie to the left of lines (..., 2, 2), (..., 2)."""
    along = lines[..., 1, :] - lines[..., 0, :]
    unit = along / np.maximum(np.hypot(along[..., 0], along[..., 1]), np.finfo(float).tiny)[..., None]
    off = segments - lines[..., 0, None, :]
    return np.asarray(unit[..., None, 0] * off[..., 1] - unit[..., None, 1] * off[..., 0])
