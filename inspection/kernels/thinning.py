"""Points about a step apart on a walk along a scan."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from inspection.kernels.compiling import kernel

Array = NDArray[np.float64]


def strides(points_mm: Array, step_mm: float) -> NDArray[np.int64]:
    """Indices of points (m, 2) at which a walk along them has come at least one step from the point picked before."""
    picked = np.empty(len(points_mm), dtype=np.int64)
    return picked[: _strides(np.ascontiguousarray(points_mm), step_mm * step_mm, picked)]


@kernel
def _strides(points: Any, least: float, picked: Any) -> int:
    count, last = 1, 0
    picked[0] = 0
    for i in range(1, len(points)):
        dx, dy = points[i, 0] - points[last, 0], points[i, 1] - points[last, 1]
        if dx * dx + dy * dy >= least:
            picked[count] = last = i
            count += 1
    return count
