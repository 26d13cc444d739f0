"""Where the list of what may be closest stands for a place in space: blocks in a grid, each halved along x, y and z where it has to be."""

from typing import Any

import numpy as np

from inspection.kernels.compiling import inlined_uncounted_kernel
from inspection.kernels.surfaces.layout import FAR, GRID_LOW, GRID_PER_MM, LISTED


@inlined_uncounted_kernel
def list_at(grid: Any, blocks: Any, cells: Any, x: float, y: float, z: float) -> Any:
    """Where the list of the cell of a place begins; FAR for a place off the grid, or in a cell without one."""
    per = grid[GRID_PER_MM]
    ux, uy, uz = (x - grid[GRID_LOW]) * per, (y - grid[GRID_LOW + 1]) * per, (z - grid[GRID_LOW + 2]) * per
    if not (ux >= 0.0 and uy >= 0.0 and uz >= 0.0 and ux < blocks[0] and uy < blocks[1] and uz < blocks[2]):
        return np.int64(FAR)
    i, j, k = np.int64(ux), np.int64(uy), np.int64(uz)
    content = np.int64(cells[(i * blocks[1] + j) * blocks[2] + k])
    ux, uy, uz = ux - i, uy - j, uz - k
    while content >= 0:
        ux, uy, uz = 2.0 * ux, 2.0 * uy, 2.0 * uz
        i, j, k = np.int64(ux), np.int64(uy), np.int64(uz)
        ux, uy, uz = ux - i, uy - j, uz - k
        content = np.int64(cells[content + 4 * i + 2 * j + k])
    return LISTED - content if content != FAR else np.int64(FAR)
