"""The cells of space around spline faces, each with the piece from which its closest points are found, where that is certain."""

import numpy as np
from numpy.typing import NDArray

from inspection.kernels.surfaces import PatchNets, PatchTables, fill_patch_cells
from inspection.kernels.surfaces.layout import FAR
from inspection.surface.blocks_near import blocks_near
from inspection.surface.patch_pieces import PatchPieces

Array = NDArray[np.float64]

_BAND = 0.008  # of the size: how far from the surface cells are made; what is farther off is searched in the tree
_BLOCK = 2.0  # of the band, along a block
_DEEPEST = 3
_MOST = 8_000_000  # cells: 32 MB


def with_patch_cells(tables: PatchTables, pieces: PatchPieces, low: Array, high: Array, size_mm: float) -> PatchTables:
    """The tables with cells filled in, for pieces in boxes low (p, 3) and high (p, 3) of a surface of a size."""
    reach_mm = _BAND * size_mm
    block_mm = _BLOCK * reach_mm
    first = low.min(axis=0) - reach_mm
    begin, end = (low - reach_mm - first) / block_mm, (high + reach_mm - first) / block_mm
    blocks = (np.floor(end.max(axis=0)) + 1).astype(np.int64)
    near = blocks_near(begin, end, blocks)
    cells = np.empty(near.size + _MOST, dtype=np.int32)
    cells[: near.size] = FAR
    used = np.array([near.size])
    tables = tables._replace(grid=np.array([*first, 1 / block_mm, block_mm]), blocks=blocks)
    fill_patch_cells(tables, _nets_of(pieces), near.ravel(), reach_mm, _DEEPEST, cells, used)
    return tables._replace(cells=cells[: used[0]].copy())


def _nets_of(pieces: PatchPieces) -> PatchNets:
    """Where pieces lie; a net ends at a crease, and at the border of its face."""
    net, column, line, nets = [], [], [], 0
    for (k, m), (crease_u, crease_v) in zip(pieces.grid, pieces.creases, strict=True):
        part_u, part_v = np.cumsum(crease_u[:-1]) - 1, np.cumsum(crease_v[:-1]) - 1
        net.append((nets + part_v[:, None] * (part_u[-1] + 1) + part_u).ravel())
        column.append(np.tile(np.arange(k), m))
        line.append(np.repeat(np.arange(m), k))
        nets += int((part_u[-1] + 1) * (part_v[-1] + 1))
    return PatchNets(*(np.concatenate(parts).astype(np.int32) for parts in (net, column, line)))
