"""A nominal surface given by points alone: a jet, a polynomial of degree two, through the neighbours of each, with a stated error.

Jets overlap, and the nearest one answers. Where neighbouring jets disagree, so does the surface that they stand for: their disagreement is
the error that is stated. Around the edge of a cloud there are no jets: a foot there is beyond an edge.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import breadth_first_order, minimum_spanning_tree
from scipy.spatial import cKDTree

from inspection.errors import NominalError
from inspection.kernels.surfaces import PatchTables, project_on_patches
from inspection.kernels.surfaces.layout import BORDER_STEPS, GRID_WIDTH, INNER, LINKS, PLACE_WIDTH, SIDES, WIDTH_CUBIC
from inspection.surface.feet import FootKind, SurfaceFeet, points_in_space, surface_feet
from inspection.surface.item_tree import item_tree
from inspection.surface.patch_pieces import PatchPieces, boxes_along_axes, piece_rows
from inspection.surface.spread import shares_of

Array = NDArray[np.float64]
Index = NDArray[np.int64]

_NEIGHBOURS = 24  # through which a jet is laid
_NEAR = 8  # that jets are compared with
_REACH = 1.0  # half the side of a jet, in distances of its nearest neighbours
_WIDEST_GAP = 0.6 * np.pi  # between the directions of neighbours: at the edge of a cloud it is wider
_SURE = 0.95  # of the places that the stated error holds for
_SAFETY = 1.75  # times their disagreement: neighbours share most of their points, and err alike
_MOST_POINTS = 500_000


class CloudSurface:
    """A surface through points (n, 3); `project` gives closest points on its jets. It satisfies `NominalSurface`.

    normals     : (n, 3) outward, of any length, where the cloud has them; a point without one, zero or NaN, takes that of the nearest. None
                  lets them agree with each other, and away from the middle of the points
    sides_known : whether the outside is known: by normals, or because the cloud is closed. Else deviations may have the wrong sign

    Points that are not finite are left out. Raises NominalError for points that lie on no surface.
    """

    __slots__ = ("_frames", "_jets", "_places", "_tables", "area_mm2", "nominal_error_mm", "normals", "notes", "sides_known", "size_mm")

    def __init__(self, points_mm: ArrayLike, normals: ArrayLike | None = None) -> None:
        points, given = _usable(points_in_space(points_mm), normals)
        if not _NEIGHBOURS < len(points) <= _MOST_POINTS:
            raise NominalError(f"a cloud needs more than {_NEIGHBOURS} and at most {_MOST_POINTS:,} finite points, got {len(points)}")
        self.size_mm = float(np.ptp(points, axis=0).max())
        near, around = _neighbours(points)
        frames = _frames(points, around)
        is_edge = _is_at_edge(points, around, frames)
        _turn_outward(frames, points, around, given)
        self.sides_known = given is not None or not is_edge.any()
        self.notes = _words_on_sides(given is not None, self.sides_known)
        spacing = near[:, 1 : _NEAR + 1].mean(axis=1)
        jets = _jets(points, around, frames)
        inner = np.flatnonzero(~is_edge)
        if not len(inner):
            raise NominalError("the points lie on no surface: every one of them is at an edge of the cloud")
        self.nominal_error_mm = _disagreement(points, around, frames, jets, inner)
        pieces = _pieces(points, frames, jets, spacing, inner)
        beside_edge = np.asarray(is_edge[around[inner, 1 : _NEAR + 1]].any(axis=1))
        self._places, self._frames, self._jets = points[inner], frames[inner], jets[inner]
        self.normals = self._frames[:, 2]
        self._tables = _tables_of(pieces, self.normals, beside_edge, self.size_mm)
        self.area_mm2 = float((near[inner, _NEAR] ** 2).sum() * np.pi / (_NEAR + 0.5))

    def __len__(self) -> int:
        return len(self._places)

    def project(self, points_mm: ArrayLike, threads: int | None = None) -> SurfaceFeet:
        """Closest points of the jets to points (m, 3); see `NominalSurface`. The face of a foot is the number of its jet.

        A place that no jet covers, in a hole of the cloud, is beyond an edge: from the side of a jet it is farther than from the surface.
        """
        points = points_in_space(points_mm)
        feet = surface_feet(project_on_patches(points, self._tables, threads), self.nominal_error_mm)
        rows = np.flatnonzero(feet.kind == FootKind.EDGE)
        along = np.abs(((points[rows] - feet.foot_mm[rows]) * self._normals_at(feet.face[rows], feet.parameter[rows])).sum(axis=1))
        kind = feet.kind.copy()
        kind[rows[np.abs(feet.distance_mm[rows]) - along > self.nominal_error_mm]] = FootKind.BORDER
        return replace(feet, kind=kind)

    def _normals_at(self, jet: NDArray[np.int32], place: Array) -> Array:
        """Unit normals (m, 3) of jets (m,) at places (m, 2) over their tangents."""
        a, (x, y) = self._jets[jet].T, place.T
        up = np.stack([-a[1] - 2 * a[3] * x - a[4] * y, -a[2] - a[4] * x - 2 * a[5] * y, np.ones(len(x))], axis=1)
        normal = np.einsum("ma,mad->md", up, self._frames[jet])
        return np.asarray(normal / np.linalg.norm(normal, axis=1)[:, None])

    def sample(self, count: int) -> tuple[Array, Array]:
        """The points that jets stand on, each as often as it takes to have `count` (n, 3), and the outward normals (n, 3) there."""
        owner = shares_of(np.ones(len(self._places)), max(count, len(self._places)))
        return self._places[owner], self.normals[owner]


def _neighbours(points: Array) -> tuple[Array, Index]:
    """Distances and numbers (n, _NEIGHBOURS + 1) of the nearest points, each point itself first."""
    distance, number = cKDTree(points).query(points, k=_NEIGHBOURS + 1)
    return np.asarray(distance), np.asarray(number)


def _frames(points: Array, around: Index) -> Array:
    """Two tangents and the normal (n, 3, 3) by the principal axes of the neighbours."""
    off = points[around] - points[around].mean(axis=1, keepdims=True)
    _, axes = np.linalg.eigh(np.einsum("nki,nkj->nij", off, off))
    frames = axes.transpose(0, 2, 1)[:, ::-1].copy()
    frames[:, 2] = np.cross(frames[:, 0], frames[:, 1])
    return frames


def _usable(points: Array, normals: ArrayLike | None) -> tuple[Array, Array | None]:
    """The finite points (n, 3) that differ, with their normals (n, 3); those without a normal take that of the nearest."""
    if normals is None:
        return np.unique(points[np.isfinite(points).all(axis=1)], axis=0), None
    given = np.asarray(normals, dtype=np.float64)
    if given.shape != points.shape:
        raise NominalError(f"normals must have shape {points.shape}, got {given.shape}")
    finite = np.isfinite(points).all(axis=1)
    kept, first = np.unique(points[finite], axis=0, return_index=True)
    given = given[finite][first]
    has_one = np.isfinite(given).all(axis=1) & (given != 0).any(axis=1)
    if not has_one.any():
        return kept, None
    if not has_one.all():
        given[~has_one] = given[has_one][cKDTree(kept[has_one]).query(kept[~has_one])[1]]
    return kept, given


def _words_on_sides(has_normals: bool, sides_known: bool) -> tuple[str, ...]:
    if has_normals:
        return ()
    if sides_known:
        return ("the cloud has no normals; it is closed, and its outside is away from the middle of its points",)
    return (
        "the cloud has no normals and is not closed: the side away from the middle of its points is taken for the outside, but it may be "
        "the other one. Deviations have no sure sign, and only their size may be judged: bring the cloud with normals",
    )


def _turn_outward(frames: Array, points: Array, around: Index, normals: Array | None) -> None:
    """Turn frames so that their normals point out of material, as far as that is known."""
    if normals is not None:
        _turn_over(frames, (frames[:, 2] * normals).sum(axis=1) < 0)
        return
    n = len(points)
    rows = np.repeat(np.arange(n, dtype=np.int32), _NEAR)  # scipy before 1.16 walks graphs with 32-bit numbers only
    columns = around[:, 1 : _NEAR + 1].ravel().astype(np.int32)
    differs = 1.0 - np.abs((frames[rows, 2] * frames[columns, 2]).sum(axis=1)) + 1e-9
    tree = minimum_spanning_tree(coo_array((differs, (rows, columns)), shape=(n, n)).tocsr())
    order, parent = breadth_first_order(tree, 0, directed=False, return_predecessors=True)
    if len(order) < n:
        raise NominalError("the cloud falls into parts that do not hang together: bring it with normals")
    sign = np.ones(n)
    for i in order[1:]:
        sign[i] = sign[parent[i]] * (1.0 if frames[i, 2] @ frames[parent[i], 2] >= 0 else -1.0)
    _turn_over(frames, sign < 0)
    outward = ((points - points.mean(axis=0)) * frames[:, 2]).sum()
    if outward < 0:
        _turn_over(frames, np.ones(n, dtype=bool))


def _turn_over(frames: Array, which: NDArray[np.bool_]) -> None:
    frames[which, 1:] *= -1.0  # the frame stays right-handed


def _is_at_edge(points: Array, around: Index, frames: Array) -> NDArray[np.bool_]:
    """Whether the neighbours of a point leave a wide angle free."""
    off = points[around[:, 1:]] - points[:, None]
    angle = np.sort(np.arctan2(np.einsum("nkd,nd->nk", off, frames[:, 1]), np.einsum("nkd,nd->nk", off, frames[:, 0])), axis=1)
    gaps = np.diff(np.concatenate([angle, angle[:, :1] + 2 * np.pi], axis=1), axis=1)
    return np.asarray(gaps.max(axis=1) > _WIDEST_GAP)


def _jets(points: Array, around: Index, frames: Array) -> Array:
    """Coefficients (n, 6) of the heights 1, x, y, x^2, x y, y^2 over each point's tangents, by least squares, near ones weighing more."""
    local = np.einsum("nkd,nad->nka", points[around] - points[:, None], frames)
    x, y = local[..., 0], local[..., 1]
    reach = np.sqrt((x**2 + y**2).max(axis=1, keepdims=True))
    weight = np.exp(-2.0 * (x**2 + y**2) / reach**2)
    basis = np.stack([np.ones_like(x), x / reach, y / reach, (x / reach) ** 2, x * y / reach**2, (y / reach) ** 2], axis=2)
    normal = np.einsum("nki,nkj,nk->nij", basis, basis, weight) + 1e-12 * np.eye(6)
    right = np.einsum("nki,nk,nk->ni", basis, weight, local[..., 2])
    found = np.linalg.solve(normal, right[..., None])[..., 0]
    return np.asarray(found / reach ** np.array([0, 1, 1, 2, 2, 2]))


def _height(jets: Array, x: Array, y: Array) -> Array:
    a = np.moveaxis(jets, -1, 0)
    return np.asarray(a[0] + a[1] * x + a[2] * y + a[3] * x**2 + a[4] * x * y + a[5] * y**2)


def _disagreement(points: Array, around: Index, frames: Array, jets: Array, inner: Index) -> float:
    """How far jets lie off each other half way to their neighbours and at their own feet, at 95 % of such places.

    Of jets that overlap the nearest one answers, so that scatter of the points does not average out among them: it is added.
    """
    own, other = np.repeat(inner, _NEAR), around[inner, 1 : _NEAR + 1].ravel()
    off = []
    for share in (0.0, 0.5):
        step = np.einsum("md,mad->ma", share * (points[other] - points[own]), frames[own])
        place = points[own] + np.einsum(
            "ma,mad->md", np.column_stack([step[:, :2], _height(jets[own], step[:, 0], step[:, 1])]), frames[own]
        )
        seen = np.einsum("md,mad->ma", place - points[other], frames[other])
        off.append(np.abs(seen[:, 2] - _height(jets[other], seen[:, 0], seen[:, 1])))
    local = np.einsum("nkd,nad->nka", points[around[inner]] - points[inner, None], frames[inner])
    scatter = float(np.median(np.abs(local[..., 2] - _height(jets[inner][:, None], local[..., 0], local[..., 1]))))
    return float(np.hypot(_SAFETY * np.quantile(np.concatenate(off), _SURE), scatter))


def _pieces(points: Array, frames: Array, jets: Array, spacing: Array, inner: Index) -> PatchPieces:
    """The jets of inner points as pieces: squares over the tangents, a polynomial of degree two along the normal."""
    side = 2 * _REACH * spacing[inner]
    a, frame = jets[inner], frames[inner]
    c = np.zeros((len(inner), 3, WIDTH_CUBIC, WIDTH_CUBIC))
    c[:, :, 0, 0] = points[inner] + a[:, :1] * frame[:, 2]
    c[:, :, 1, 0] = side[:, None] * (frame[:, 0] + a[:, 1:2] * frame[:, 2])
    c[:, :, 0, 1] = side[:, None] * (frame[:, 1] + a[:, 2:3] * frame[:, 2])
    for column, (i, j) in ((3, (2, 0)), (4, (1, 1)), (5, (0, 2))):
        c[:, :, i, j] = (side**2 * a[:, column])[:, None] * frame[:, 2]
    place = np.column_stack([np.zeros((len(inner), 2)), side, side])
    return PatchPieces(c, place, np.arange(len(inner)), (), ())


def _tables_of(pieces: PatchPieces, normals: Array, beside_edge: NDArray[np.bool_], size_mm: float) -> PatchTables:
    """The tables for the loops. A foot at the side of a jet is beyond an edge where the cloud ends, and else between jets."""
    count = len(normals)
    rows = piece_rows(pieces, np.ones(count))
    middle, low, high = boxes_along_axes(rows)
    tree = item_tree(middle, low, high, 1)
    beyond = np.full((count, LINKS), INNER)
    beyond[:, :SIDES] = np.arange(count)[:, None]
    border = np.concatenate([normals, beside_edge[:, None].astype(float)], axis=1)
    return PatchTables(
        nodes=tree.nodes,
        links=tree.links,
        members=tree.members.ravel().astype(np.int32),
        rows=rows.ravel(),
        beyond=beyond.ravel().astype(np.int32),
        borders=np.repeat(border[:, None], BORDER_STEPS + 1, axis=1).ravel(),
        vertices=np.empty((0, PLACE_WIDTH)).ravel(),
        width=WIDTH_CUBIC,
        row_width=rows.shape[1],
        grid=np.zeros(GRID_WIDTH),
        blocks=np.zeros(3, dtype=np.int64),
        cells=np.empty(0, dtype=np.int32),
        grain_mm=1e-12 * size_mm,
    )
