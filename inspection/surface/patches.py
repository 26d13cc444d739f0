"""A nominal surface of spline faces, projected on the splines themselves: no tessellation, no chord error."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from inspection.errors import NominalError
from inspection.kernels.surfaces import PatchTables, project_on_patches
from inspection.kernels.surfaces.layout import GRID_WIDTH, PIECE_STRIDE
from inspection.surface.feet import KILOMETRE_MM, SurfaceFeet, points_in_space, surface_feet
from inspection.surface.item_tree import item_tree
from inspection.surface.orientation import which_to_turn
from inspection.surface.patch_borders import NO_ADJOINING, agreeing_faces, border_rows, find_adjoining, find_borders, vertex_rows
from inspection.surface.patch_cells import with_patch_cells
from inspection.surface.patch_pieces import PatchPieces, boxes_along_axes, cut_into_patches, piece_rows
from inspection.surface.spline_face import SplineFace
from inspection.surface.spread import shares_of, spread_within

Array = NDArray[np.float64]
Index = NDArray[np.int64]

_ADJOINS = 1e-5  # of the size: borders that are nearer to each other are one edge, as CAD systems promise it
_GRAIN = 1e-12  # of the size
_IN_A_CELL = 16.0  # places: a cell that has one less or one more stands out little
_PHASES = np.array([0.7548776662466927, 0.5698402909980532])  # one over the plastic number, and its square: their multiples spread evenly
_GAUSS = np.array([-np.sqrt(0.6), 0.0, np.sqrt(0.6)]) / 2
_GAUSS_WEIGHTS = np.array([5.0, 8.0, 5.0]) / 18


class PatchSurface:
    """A surface of whole spline faces; `project` gives exact closest points. It satisfies `NominalSurface`.

    edge_tolerance_mm : borders of faces nearer to each other are one edge; None for a hundred-thousandth of the size
    joined            : whether borders of faces adjoin at all; not where the faces of a part are cut out of them, so that their own borders
                        are none of the part. Their outsides are then taken as they are given
    nominal_error_mm  : 0, for the faces are the nominal

    Raises NominalError where there is no face, or faces have no two sides.
    """

    __slots__ = ("_area", "_pieces", "_tables", "faces", "is_closed", "nominal_error_mm", "notes", "sides_known", "size_mm")

    def __init__(self, faces: Sequence[SplineFace], edge_tolerance_mm: float | None = None, joined: bool = True) -> None:
        if not faces:
            raise NominalError("there is no face")
        if not all((np.abs(face.control_points_mm) <= KILOMETRE_MM).all() for face in faces):
            raise NominalError("a control point is farther than a kilometre from zero")
        every = np.concatenate([face.control_points_mm.reshape(-1, 3) for face in faces])
        self.faces = tuple(faces)
        self.sides_known = True
        self.size_mm = float(np.ptp(every, axis=0).max())
        self.nominal_error_mm = 0.0
        pieces = self._pieces = cut_into_patches(faces, self.size_mm)
        self._area, flux = _areas(pieces, every.mean(axis=0))
        near_mm = _ADJOINS * self.size_mm if edge_tolerance_mm is None else edge_tolerance_mm
        outward, notes = np.where([face.reversed for face in faces], -1.0, 1.0), []
        borders = find_borders(pieces)
        adjoining = find_adjoining(pieces, borders, near_mm) if joined else NO_ADJOINING
        by_face = np.bincount(pieces.face, self._area).astype(np.float64)
        turned, hopeless = which_to_turn(by_face, *agreeing_faces(pieces, borders, adjoining, outward))
        if len(hopeless):
            raise NominalError(f"the surface has no two sides at face {hopeless[0] + 1}: it cannot be turned to agree with its neighbours")
        outward[turned] *= -1.0
        if turned.any():
            notes.append(f"{np.count_nonzero(turned)} faces were turned over, so that they agree with their neighbours")
        sides = border_rows(pieces, borders, adjoining, outward)
        self.is_closed = not sides[:, :, 3].any()
        if self.is_closed and float((flux * outward[pieces.face]).sum()) < 0:
            outward, sides = -outward, sides * np.array([-1.0, -1.0, -1.0, 1.0])
            notes.append("the surface is closed and its faces faced inwards: all were turned over")
        vertices = vertex_rows(pieces, borders, sides, outward, near_mm)
        self.notes = tuple(notes)
        rows = piece_rows(pieces, outward[pieces.face])
        rows[:, PIECE_STRIDE] = np.array([k for k, _ in pieces.grid])[pieces.face]
        middle, low, high = boxes_along_axes(rows)
        tree = item_tree(middle, low, high, 1)
        tables = PatchTables(
            nodes=tree.nodes,
            links=tree.links,
            members=tree.members.ravel().astype(np.int32),
            rows=rows.ravel(),
            beyond=borders.links.ravel().astype(np.int32),
            borders=sides.ravel(),
            vertices=vertices.ravel(),
            width=pieces.coefficients.shape[-1],
            row_width=rows.shape[1],
            grid=np.zeros(GRID_WIDTH),
            blocks=np.zeros(3, dtype=np.int64),
            cells=np.empty(0, dtype=np.int32),
            grain_mm=_GRAIN * self.size_mm,
        )
        self._tables = with_patch_cells(tables, pieces, low, high, self.size_mm)

    def __len__(self) -> int:
        return len(self.faces)

    @property
    def area_mm2(self) -> float:
        """Area of all faces."""
        return float(self._area.sum())

    def project(self, points_mm: ArrayLike, threads: int | None = None) -> SurfaceFeet:
        """Closest points of the surface to points (m, 3); see `NominalSurface`. The number of threads changes no bit."""
        found = project_on_patches(points_in_space(points_mm), self._tables, threads)
        return surface_feet(found, self.nominal_error_mm, self._pieces.face.astype(np.int32))

    def sample(self, count: int) -> tuple[Array, Array]:
        """At least `count` places (n, 3) spread over the area, and the outward normals (n, 3) there."""
        cells = _cut_evenly(self._pieces, self._area, count)
        owner = shares_of(cells.area, count)
        is_cut = (cells.size[owner] < 1).any(axis=1)
        within = np.column_stack(spread_within(owner)) + (owner * is_cut)[:, None] * _PHASES  # or those of all cells stand in the same rows
        at_s, at_t = (cells.low[owner] + cells.size[owner] * (within % 1.0)).T
        places, _, _ = self._pieces.at(cells.piece[owner], at_s, at_t)
        return places, self.project(places).normal


@dataclass(frozen=True, slots=True, eq=False)
class _Cells:
    """Rectangles of the parameters of pieces: whose they are (c,), where they begin and how large they are (c, 2), their area (c,)."""

    piece: Index
    low: Array
    size: Array
    area: Array


def _cut_evenly(pieces: PatchPieces, area: Array, count: int) -> _Cells:
    """Cut pieces (p,) of these areas into cells about as long as wide, each for a few of `count` places that are spread over all.

    A piece alone may be long and thin, and may run fast over one end and slowly over the other.
    """
    every, middle = np.arange(len(area)), np.zeros(len(area))
    _, by_s, by_t = pieces.at(every, middle, middle)
    length_s, length_t = (np.maximum(np.linalg.norm(by, axis=1), 1e-300) for by in (by_s, by_t))
    wanted = np.maximum(count * area / area.sum() / _IN_A_CELL, 1.0)
    along = np.clip(np.round(np.sqrt(wanted * (length_s / length_t))), 1, np.ceil(wanted)).astype(np.int64)
    across = np.ceil(wanted / along).astype(np.int64)
    piece = np.repeat(every, along * across)
    number = np.arange(len(piece)) - np.searchsorted(piece, piece)
    size = np.column_stack([1.0 / along, 1.0 / across])[piece]
    low = np.column_stack([number // across[piece], number % across[piece]]) * size - 0.5
    _, by_s, by_t = pieces.at(piece, *(low + size / 2).T)
    density = np.linalg.norm(np.cross(by_s, by_t), axis=1) * size.prod(axis=1)
    whole = np.bincount(piece, density, len(area))[piece]
    return _Cells(piece, low, size, np.where(whole > 0, density / np.where(whole > 0, whole, 1.0), size.prod(axis=1)) * area[piece])


def _areas(pieces: PatchPieces, middle_mm: Array) -> tuple[Array, Array]:
    """The area (p,) of each piece, and three times the volume (p,) of the cone from a place to it, by Gauss's rule."""
    every = np.arange(len(pieces.face))
    area, flux = np.zeros(len(every)), np.zeros(len(every))
    for s, weight_s in zip(_GAUSS, _GAUSS_WEIGHTS, strict=True):
        for t, weight_t in zip(_GAUSS, _GAUSS_WEIGHTS, strict=True):
            value, by_s, by_t = pieces.at(every, np.full(len(every), s), np.full(len(every), t))
            normal = np.cross(by_s, by_t)
            area += weight_s * weight_t * np.linalg.norm(normal, axis=1)
            flux += weight_s * weight_t * ((value - middle_mm) * normal).sum(axis=1)
    return area, flux
