"""Triangles by sixteen: the planes that say how near each may be, and the box and the cone of normals of each cluster."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from inspection.kernels.surfaces.layout import (
    CLUSTER,
    CLUSTER_ROWS,
    HULL_AXES,
    HULL_HALF,
    HULL_MIDDLE,
    HULL_OWN_TANGENT,
    HULL_TANGENT,
    HULL_WIDTH,
    LANES,
    NOT_THERE,
    ORIGIN_WIDTH,
    OWN_PLANE,
    PLANE_AB,
    PLANE_AC,
    PLANE_BC,
    PLANE_WIDTH,
    REACH,
)

Array = NDArray[np.float64]

_SLIVER = 1e-6  # twice its area over the square of its longest edge: the planes of one with less are round-off, and say nothing
_WIDEST = 1.2  # rad that faces may lean from the mean normal of their cluster
_ROUND_OFF_RAD = 1e-6
_ROUND_OFF = 1e-12  # of the farthest coordinate
_AT_ONCE = 4096  # clusters worked out together: what is in between would else take more memory than what is kept


def cluster_planes(corners: Array) -> tuple[NDArray[np.float32], Array]:
    """The planes (c * CLUSTER,) of triangles (n, 3, 3) in clusters, and what they are seen from, (c * ORIGIN_WIDTH,)."""
    clusters = -(-len(corners) // LANES)
    planes, origins = np.zeros((clusters, CLUSTER_ROWS, LANES), dtype=np.float32), np.empty((clusters, ORIGIN_WIDTH))
    for begin in range(0, clusters, _AT_ONCE):
        end = min(begin + _AT_ONCE, clusters)
        here = _in_clusters(corners[begin * LANES : end * LANES])
        origin = (here.min(axis=(1, 2)) + here.max(axis=(1, 2))) / 2
        origins[begin:end, :REACH] = origin
        from_origin = here - origin[:, None, None]
        origins[begin:end, REACH] = np.sqrt((from_origin**2).sum(axis=3).max(axis=(1, 2)))
        planes[begin:end] = _planes(from_origin).transpose(0, 2, 1)
    planes[-1, :, len(corners) - (clusters - 1) * LANES :] = 0.0
    planes[-1, OWN_PLANE + 3, len(corners) - (clusters - 1) * LANES :] = NOT_THERE
    return planes.reshape(clusters * CLUSTER), origins.ravel()


def _in_clusters(values: NDArray[Any]) -> NDArray[Any]:
    """Values (n, ...) of triangles as (c, LANES, ...); the last one is repeated where a cluster is not full."""
    missing = -len(values) % LANES
    full = np.concatenate([values, np.repeat(values[-1:], missing, axis=0)]) if missing else values
    return full.reshape(-1, LANES, *values.shape[1:])


def _planes(corners: Array) -> Array:
    """The four planes (c, LANES, CLUSTER_ROWS) of triangles (c, LANES, 3, 3); zeros, no bound at all, for slivers."""
    a, b, c = (corners[:, :, i] for i in range(3))
    sides = (b - a, c - a, c - b)
    cross = np.cross(sides[0], sides[1])
    twice = np.linalg.norm(cross, axis=2)
    longest = np.max([(side**2).sum(axis=2) for side in sides], axis=0)
    normal = cross / twice[:, :, None]
    result = np.empty((*corners.shape[:2], CLUSTER_ROWS))
    for plane, outward, through in (
        (OWN_PLANE, normal, a),
        (PLANE_AB, np.cross(sides[0], normal), a),
        (PLANE_AC, np.cross(normal, sides[1]), a),
        (PLANE_BC, np.cross(sides[2], normal), b),
    ):
        unit = outward / np.linalg.norm(outward, axis=2)[:, :, None]
        result[:, :, plane : plane + PLANE_WIDTH - 1] = unit
        result[:, :, plane + PLANE_WIDTH - 1] = -(unit * through).sum(axis=2)
    return np.where((twice > _SLIVER * longest)[:, :, None], result, 0.0)


def cluster_hulls(corners_mm: Array, triangles: NDArray[np.int32], is_open: NDArray[np.bool_]) -> Array:
    """The boxes and cones (c * HULL_WIDTH,) of triangles (n, 3), numbers of corners (v, 3), in clusters.

    is_open : (v,) whether a border runs through a corner: there the way to a place may lean as it likes
    """
    normals = unit_normals(corners_mm, triangles)
    mean, lean = _cones_of_corners(normals, triangles, is_open)
    clusters = -(-len(triangles) // LANES)
    hulls = np.empty((clusters, HULL_WIDTH))
    for begin in range(0, clusters, _AT_ONCE):
        end = min(begin + _AT_ONCE, clusters)
        rows = slice(begin * LANES, end * LANES)
        numbers = _in_clusters(triangles[rows]).reshape(end - begin, 3 * LANES)
        axes = _axes(corners_mm[numbers], _in_clusters(normals[rows]).sum(axis=1))
        along = np.einsum("cpd,cad->cpa", corners_mm[numbers], axes)
        low, high = along.min(axis=1), along.max(axis=1)
        hulls[begin:end, HULL_MIDDLE:HULL_AXES] = np.einsum("ca,cad->cd", (low + high) / 2, axes)
        hulls[begin:end, HULL_AXES:HULL_HALF] = axes.reshape(-1, 9)
        hulls[begin:end, HULL_HALF:HULL_TANGENT] = (high - low) / 2 + _ROUND_OFF * np.abs(corners_mm).max()
        hulls[begin:end, HULL_TANGENT] = _tangent(mean[numbers], lean[numbers], axes[:, None, 2])
        own = np.repeat(_in_clusters(normals[rows]), 3, axis=1)
        hulls[begin:end, HULL_OWN_TANGENT] = _tangent(mean[numbers], lean[numbers], own)
    return hulls.ravel()


def _tangent(mean: Array, lean: Array, normal: Array) -> Array:
    """Tangents (c,) of the most that normals about corners with means (c, p, 3) and leans (c, p) lean from others (c, 1 or p, 3)."""
    angle = (np.arccos(np.clip((mean * normal).sum(axis=2), -1.0, 1.0)) + lean).max(axis=1) + _ROUND_OFF_RAD
    return np.where(angle < _WIDEST, np.tan(np.minimum(angle, _WIDEST)), np.inf)


def unit_normals(corners_mm: Array, triangles: NDArray[np.int32]) -> Array:
    """The unit normals (n, 3) of triangles (n, 3), numbers of corners (v, 3)."""
    a, b, c = (corners_mm[triangles[:, i]] for i in range(3))
    cross = np.cross(b - a, c - a)
    return np.asarray(cross / np.linalg.norm(cross, axis=1)[:, None])


def _cones_of_corners(normals: Array, triangles: NDArray[np.int32], is_open: NDArray[np.bool_]) -> tuple[Array, Array]:
    """A mean unit normal (v, 3) of the faces about each corner, and the most that one of them leans from it (v,); infinite on borders."""
    mean, least = np.zeros((len(is_open), 3)), np.ones(len(is_open))
    for i in range(3):
        for axis in range(3):
            mean[:, axis] += np.bincount(triangles[:, i], normals[:, axis], len(mean))
    length = np.linalg.norm(mean, axis=1)
    mean /= np.where(length > 0, length, 1.0)[:, None]
    for i in range(3):
        np.minimum.at(least, triangles[:, i], (normals * mean[triangles[:, i]]).sum(axis=1))
    return mean, np.where(is_open | (length == 0), np.inf, np.arccos(np.clip(least, -1.0, 1.0)))


def _axes(corners: Array, normal_sum: Array) -> Array:
    """Three unit axes (c, 3, 3) of clusters of corners (c, p, 3): two along which they spread most and least, and the mean normal."""
    length = np.linalg.norm(normal_sum, axis=1, keepdims=True)
    normal = np.where(length > 1e-6, normal_sum / np.where(length > 0, length, 1.0), [0.0, 0.0, 1.0])
    first = np.cross(normal, np.where(np.abs(normal[:, :1]) < 0.7, [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]))
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    second = np.cross(normal, first)
    apart = corners - corners.mean(axis=1, keepdims=True)
    x, y = (np.einsum("cpd,cd->cp", apart, axis) for axis in (first, second))
    turn = 0.5 * np.arctan2(2 * (x * y).sum(axis=1), (x**2 - y**2).sum(axis=1))[:, None]
    along = np.cos(turn) * first + np.sin(turn) * second
    return np.stack([along, np.cross(normal, along), normal], axis=1)
