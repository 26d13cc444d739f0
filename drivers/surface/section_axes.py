"""The axes of a cutting plane: a unit normal, and two directions in the plane that follow from it alone.

Convention: the plane's x axis is the machine's x axis projected into the plane (the machine's y axis where the normal lies
within 25 degrees of x); its y axis completes a right-handed set, y = normal cross x. So for the normal z the section keeps
the machine's x and y unchanged. Heights are measured along the unit normal from the machine's origin.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import cos, radians

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, slots=True, eq=False)
class SectionAxes:
    """A right-handed orthonormal set; x, y and normal are (3,) in machine coordinates."""

    x: NDArray[np.float64]
    y: NDArray[np.float64]
    normal: NDArray[np.float64]

    def __post_init__(self) -> None:
        for array in (self.x, self.y, self.normal):
            if array.shape != (3,):
                raise ValueError(f"expected (3,), got {array.shape}")
            array.setflags(write=False)

    def height_mm(self, x_mm: NDArray[np.floating], y_mm: NDArray[np.floating], z_mm: NDArray[np.floating]) -> NDArray[np.float64]:
        """Return the heights of machine points, added up in one order everywhere, so that equal points have bit-equal heights."""
        return _dot(self.normal, x_mm, y_mm, z_mm)

    def section_mm(self, points_mm: NDArray[np.floating]) -> NDArray[np.float64]:
        """Return machine points (..., 3) in the plane's axes, (..., 2); bit-equal points stay bit-equal."""
        x, y, z = points_mm[..., 0], points_mm[..., 1], points_mm[..., 2]
        return np.stack([_dot(self.x, x, y, z), _dot(self.y, x, y, z)], axis=-1)

    def machine_mm(self, section_mm: NDArray[np.float64], height_mm: float) -> NDArray[np.float64]:
        """Return points (m, 2) of the plane at `height_mm` as machine points, (m, 3)."""
        return section_mm[:, :1] * self.x + section_mm[:, 1:] * self.y + height_mm * self.normal


def axes_of(normal: Sequence[float]) -> SectionAxes:
    """Return the axes of the planes with this normal, which may have any length but zero."""
    direction = np.array(normal, dtype=np.float64)
    if direction.shape != (3,) or not np.isfinite(direction).all() or not direction.any():
        raise ValueError(f"the normal {tuple(normal)} must be three finite numbers, not all zero")
    unit = direction / np.abs(direction).max()
    unit /= np.linalg.norm(unit)
    start = np.array([0.0, 1.0, 0.0]) if abs(unit[0]) > cos(radians(25)) else np.array([1.0, 0.0, 0.0])
    x = start - (start @ unit) * unit
    x /= np.linalg.norm(x)
    return SectionAxes(x, np.cross(unit, x) + 0.0, unit + 0.0)  # + 0.0 turns -0.0 into 0.0


def _dot(direction: NDArray[np.float64], x: NDArray[np.floating], y: NDArray[np.floating], z: NDArray[np.floating]) -> NDArray[np.float64]:
    """Return dot products without BLAS, whose rounding depends on the position in the array; zero components cost nothing."""
    total: NDArray[np.float64] | None = None
    for part, coordinate in zip(direction, (x, y, z), strict=True):
        if part != 0.0:
            term = coordinate * np.float64(part)
            total = term if total is None else np.add(total, term, out=total)
    assert total is not None
    return total
