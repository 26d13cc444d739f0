"""The cells of space around triangles, each with the clusters that may hold the closest point of a place in it."""

import numpy as np
from numpy.typing import NDArray

from inspection.kernels.surfaces import CellMemory, TriangleTables, fill_cells
from inspection.kernels.surfaces.layout import FAR, HULL_AXES, HULL_HALF, HULL_MIDDLE, HULL_WIDTH
from inspection.surface.blocks_near import blocks_near

Array = NDArray[np.float64]

_BAND = 0.008  # of the size: how far from the surface cells are made; what is farther off is searched in the tree
_FINEST = 0.3  # of the extent of a cluster: a lesser cell has hardly a shorter list
_CELLS = 500_000  # about so many of the finest would fill the band: more of them take longer to fetch from memory than they save
_BLOCK = 8  # of the finest cells along a block
_DEEPEST = 3
_MOST_BLOCKS = 128  # along the longest side
_ENOUGH = 5  # clusters in a list that is not worth being cut
_ROOM, _LEAST_ROOM = 8, 1 << 22  # numbers in lists, and as many cells, for each triangle


def with_cells(tables: TriangleTables, hulls: Array, area_mm2: float, size_mm: float) -> TriangleTables:
    """The tables with cells filled in, for clusters with hulls (c * HULL_WIDTH,) and a surface of an area and a size."""
    rows = hulls.reshape(-1, HULL_WIDTH)
    reach_mm = _BAND * size_mm
    middle, axes = rows[:, HULL_MIDDLE:HULL_AXES], rows[:, HULL_AXES:HULL_HALF].reshape(-1, 3, 3)
    half = np.einsum("ca,cad->cd", rows[:, HULL_HALF : HULL_HALF + 3], np.abs(axes)) + reach_mm
    low, high = middle - half, middle + half
    finest_mm = max(_FINEST * np.sqrt(area_mm2 / len(rows)), np.cbrt(2 * reach_mm * area_mm2 / _CELLS))
    block_mm = max(_BLOCK * finest_mm, size_mm / _MOST_BLOCKS)
    first = low.min(axis=0)
    blocks = (np.floor((high.max(axis=0) - first) / block_mm) + 1).astype(np.int64)
    near = blocks_near((low - first) / block_mm, (high - first) / block_mm, blocks)
    room = max(_LEAST_ROOM, _ROOM * len(tables.triangles) // 3)
    cells, lists = np.empty(near.size + room, dtype=np.int32), np.empty(room, dtype=np.int32)
    cells[: near.size] = FAR
    lists[0] = 0
    memory = CellMemory(cells, lists, np.array([near.size, 0, 0]))
    tables = tables._replace(grid=np.array([*first, 1 / block_mm, block_mm]), blocks=blocks)
    fill_cells(tables, hulls, near.ravel(), reach_mm, _ENOUGH, _DEEPEST, memory)
    return tables._replace(cells=cells[: memory.used[0]].copy(), lists=lists[: memory.used[1]].copy())
