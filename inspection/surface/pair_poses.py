"""Poses of a scan of a part of a surface, by pairs of points with normals: what is as far apart and stands as askew is the same pair.

Pairs of places of the nominal are filed under their distance and three angles (Drost et al. 2010). Pairs of points of the scan, chosen by
lot with a fixed seed, look up what they may be, and every answer is a pose. The best are those at which points lie near places with
normals alike. The normals of a scan have no side here: both are tried.
"""

from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from inspection.surface.rigid_motion import RigidMotion

Array = NDArray[np.float64]
Index = NDArray[np.int64]

_DISTANCE_BINS, _ANGLE_BINS = 60, 12  # of the size; of half a turn
_THIN, _NEIGHBOURS = 20_000, 16  # points of a scan whose normals are looked at, by so many around each
_PAIRS, _MOST_ANSWERS = 150, 150  # pairs of the scan, and answers to each
_NEAREST, _FARTHEST = 0.35, 0.9  # of the extent of the scan: points of a pair
_SCORED_BY, _AT_ONCE = 80, 1 << 13
_GRID, _ROOM = 48, 0.1  # cells along the longest side of the box of the nominal, and room around it, in sizes
_CAP, _ASKEW = 0.05, 0.03  # of the size: a point farther off is as far off, and what a normal at right angles counts
_SEED = 20
_PLACES = 900


def poses_by_pairs(points: Array, places: Array, normals: Array, size_mm: float, most: int) -> list[RigidMotion]:
    """The best poses by pairs, `most` at most and different from each other: motions of points (m, 3) onto the nominal.

    places, normals : (n, 3) of the nominal, spread evenly
    """
    rng = np.random.default_rng(_SEED)
    some = points[np.unique(np.linspace(0, len(points) - 1, _THIN).astype(np.int64))]
    if len(some) <= _NEIGHBOURS:
        return []
    extent = float(np.linalg.norm(np.ptp(some, axis=0)))
    few = rng.permutation(len(places))[:_PLACES]
    filed = _file_pairs(places[few], normals[few], size_mm)
    asked = _choose_pairs(some, extent, rng)
    rotation, translation = _answers(some, asked, filed, places[few], normals[few], size_mm)
    if not len(rotation):
        return []
    scored = rng.permutation(len(some))[:_SCORED_BY]
    own = _normals_of(some, scored)
    score = _scores(rotation, translation, some[scored], own, _Nearby.of(places, normals, size_mm))
    return _distinct(rotation, translation, score, some.mean(axis=0), extent, most)


def _normals_of(points: Array, rows: Index) -> Array:
    """Unit normals (k, 3) of some of the points by the principal axes of what is around them; their side is by chance."""
    _, around = cKDTree(points).query(points[rows], k=_NEIGHBOURS)
    off = points[around] - points[around].mean(axis=1, keepdims=True)
    _, axes = np.linalg.eigh(np.einsum("nki,nkj->nij", off, off))
    return np.asarray(axes[:, :, 0])


def _keys(apart: Array, one: Array, other: Array, size_mm: float) -> Index:
    """Under what pairs are filed: the distance (k,) and the angles of both normals (k, 3) with the way between them and each other."""
    distance = np.linalg.norm(apart, axis=1)
    way = apart / distance[:, None]
    key = np.floor(distance / size_mm * _DISTANCE_BINS).astype(np.int64)
    for a, b in ((one, way), (other, way), (one, other)):
        angle = np.arccos(np.clip((a * b).sum(axis=1), -1.0, 1.0))
        key = key * _ANGLE_BINS + np.minimum((angle / np.pi * _ANGLE_BINS).astype(np.int64), _ANGLE_BINS - 1)
    return np.asarray(key)


@dataclass(frozen=True, slots=True, eq=False)
class _Filed:
    """Pairs of places, sorted by what they are filed under (k,): the first and the second of each."""

    keys: Index
    first: Index
    second: Index


def _file_pairs(places: Array, normals: Array, size_mm: float) -> _Filed:
    n = len(places)
    first, second = (each.ravel() for each in np.indices((n, n)))
    apart = places[second] - places[first]
    kept = (apart**2).sum(axis=1) > 0
    first, second = first[kept], second[kept]
    keys = _keys(apart[kept], normals[first], normals[second], size_mm)
    order = np.argsort(keys, kind="stable")
    return _Filed(keys[order], first[order], second[order])


def _choose_pairs(points: Array, extent: float, rng: np.random.Generator) -> Index:
    """Pairs (k, 2) of points that lie neither near each other nor at opposite ends of the scan, where it has such."""
    drawn = rng.integers(0, len(points), (20 * _PAIRS, 2))
    distance = np.linalg.norm(points[drawn[:, 0]] - points[drawn[:, 1]], axis=1)
    good = (distance > _NEAREST * extent) & (distance < _FARTHEST * extent)
    return np.asarray(drawn[good][:_PAIRS])


def _answers(points: Array, asked: Index, filed: _Filed, places: Array, normals: Array, size_mm: float) -> tuple[Array, Array]:
    """Rotations (k, 3, 3) and translations (k, 3) that lay pairs of the scan on pairs of the nominal with the same key."""
    own = _normals_of(points, asked.ravel()).reshape(-1, 2, 3)
    p, q = points[asked[:, 0]], points[asked[:, 1]]
    found = []
    for sign_p, sign_q in product((1.0, -1.0), repeat=2):
        one, other = sign_p * own[:, 0], sign_q * own[:, 1]
        keys = _keys(q - p, one, other, size_mm)
        begin, end = (np.searchsorted(filed.keys, keys, side=side) for side in ("left", "right"))
        many = end - begin
        taken = np.minimum(many, _MOST_ANSWERS)
        pair = np.repeat(np.arange(len(asked)), taken)
        step = np.arange(len(pair)) - np.repeat(np.cumsum(taken) - taken, taken)
        at = begin[pair] + step * many[pair] // np.maximum(taken[pair], 1)  # spread over all of its answers
        first, second = filed.first[at], filed.second[at]
        here = _frames(p[pair], q[pair], one[pair], other[pair])
        there = _frames(places[first], places[second], normals[first], normals[second])
        rotation = np.einsum("kai,kaj->kij", there, here)
        middle, to_middle = (p[pair] + q[pair]) / 2, (places[first] + places[second]) / 2
        found.append((rotation, to_middle - np.einsum("kij,kj->ki", rotation, middle)))
    rotations, translations = (np.concatenate(each) for each in zip(*found, strict=True))
    good = np.isfinite(rotations).all(axis=(1, 2))
    return rotations[good], translations[good]


def _frames(p: Array, q: Array, one: Array, other: Array) -> Array:
    """Right-handed axes (k, 3, 3) of pairs: the way between them, the sum of the normals across it, and what is left."""
    way = (q - p) / np.linalg.norm(q - p, axis=1)[:, None]
    up = one + other
    up = np.where((np.abs((up * way).sum(axis=1)) > 0.95 * np.linalg.norm(up, axis=1) + 0.1)[:, None], one, up)
    up = up - (up * way).sum(axis=1)[:, None] * way
    with np.errstate(divide="ignore", invalid="ignore"):
        up /= np.linalg.norm(up, axis=1)[:, None]
    return np.stack([way, up, np.cross(way, up)], axis=1)


@dataclass(frozen=True, slots=True, eq=False)
class _Nearby:
    """Which place of the nominal is nearest to the middle of each cell of a grid around it.

    low, per_mm : (3,) where the grid begins, and cells in a mm
    nearest     : (a, b, c) the number of the place
    places, normals : (n, 3) of the nominal
    size_mm     : of the nominal
    """

    low: Array
    per_mm: float
    nearest: NDArray[np.int64]
    places: Array
    normals: Array
    size_mm: float

    @classmethod
    def of(cls, places: Array, normals: Array, size_mm: float) -> "_Nearby":
        low, high = places.min(axis=0) - _ROOM * size_mm, places.max(axis=0) + _ROOM * size_mm
        per_mm = _GRID / float((high - low).max())
        counts = np.maximum(1, np.ceil((high - low) * per_mm)).astype(np.int64)
        cells = np.stack(np.meshgrid(*(np.arange(k) for k in counts), indexing="ij"), axis=-1)
        _, nearest = cKDTree(places).query(low + (cells.reshape(-1, 3) + 0.5) / per_mm)
        return cls(low, per_mm, np.asarray(nearest).reshape(counts), places, normals, size_mm)

    def off(self, at: Array, directions: Array) -> Array:
        """How far (k,) points (k, 3) with normals lie off, and are askew, at most so far as it matters."""
        counts = np.array(self.nearest.shape)
        cell = np.clip(np.floor((at - self.low) * self.per_mm).astype(np.int64), 0, counts - 1)
        place = self.nearest[cell[:, 0], cell[:, 1], cell[:, 2]]
        apart, normal = at - self.places[place], self.normals[place]
        height = np.abs((apart * normal).sum(axis=1))
        beside = np.maximum(np.sqrt(np.maximum((apart**2).sum(axis=1) - height**2, 0.0)) - 2 / self.per_mm, 0.0)
        askew = 1 - np.abs((directions * normal).sum(axis=1))
        return np.asarray(np.minimum(np.hypot(height, beside), _CAP * self.size_mm) + _ASKEW * self.size_mm * askew)


def _scores(rotation: Array, translation: Array, points: Array, normals: Array, nearby: _Nearby) -> Array:
    """The mean (k,) of how far points lie off at each pose."""
    result = np.empty(len(rotation))
    for begin in range(0, len(rotation), _AT_ONCE):
        part = slice(begin, begin + _AT_ONCE)
        at = np.einsum("kij,mj->kmi", rotation[part], points) + translation[part, None]
        turned = np.einsum("kij,mj->kmi", rotation[part], normals)
        result[part] = nearby.off(at.reshape(-1, 3), turned.reshape(-1, 3)).reshape(len(at), -1).mean(axis=1)
    return result


def _distinct(rotation: Array, translation: Array, score: Array, middle: Array, extent: float, most: int) -> list[RigidMotion]:
    """The best poses of which none moves the scan nearly as another does."""
    corners = middle + extent / 2 * np.concatenate([np.eye(3), -np.eye(3)])
    kept: list[RigidMotion] = []
    seen: list[Array] = []
    for i in np.argsort(score, kind="stable"):
        moved = corners @ rotation[i].T + translation[i]
        if all(np.abs(moved - other).max() > 0.05 * extent for other in seen):
            u, _, v = np.linalg.svd(rotation[i])
            kept.append(RigidMotion(u @ v, translation[i]))
            seen.append(moved)
        if len(kept) == most:
            break
    return kept
