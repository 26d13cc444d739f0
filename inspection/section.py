"""The plane of a section in machine coordinates."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class SectionPlane:
    """Where the section lies in machine coordinates.

    origin_mm : (3,) a point of the plane, origin of the section's coordinates
    x_axis    : (3,) the section's x direction (its part along the plane; any length)
    normal    : (3,) perpendicular to the plane (any length); y is normal cross x
    packed    : (12,) origin, x axis, y axis and normal, as `kernels.take_in` takes them
    """

    origin_mm: Array
    x_axis: Array
    normal: Array
    packed: Array = field(init=False, repr=False)

    def __post_init__(self) -> None:
        origin, x, n = (np.array(value, dtype=np.float64) for value in (self.origin_mm, self.x_axis, self.normal))
        if any(v.shape != (3,) or not np.isfinite(v).all() for v in (origin, x, n)):
            raise ValueError("origin, x axis and normal must be three finite numbers each")
        if not np.linalg.norm(n) > 0:
            raise ValueError("the section's normal must not be zero")
        n = n / np.linalg.norm(n)
        x = x - (x @ n) * n
        if not np.linalg.norm(x) > 1e-9:
            raise ValueError("the section's x axis must not be zero or parallel to its normal")
        x = x / np.linalg.norm(x)
        packed = np.concatenate([origin, x, np.cross(n, x), n])
        for name, value in (("origin_mm", origin), ("x_axis", x), ("normal", n), ("packed", packed)):
            value.setflags(write=False)
            object.__setattr__(self, name, value)

    def heights(self, points_mm: Array) -> Array:
        """Heights (m,) of machine points (m, 3) above the plane; section points (m, 2) lie in it. NaN where a point is none."""
        if points_mm.shape[1] == 2:
            return np.zeros(len(points_mm))
        with np.errstate(over="ignore", invalid="ignore"):
            return np.asarray((points_mm - self.origin_mm) @ self.normal)

    def to_machine(self, points_mm: ArrayLike, height_mm: float = 0.0) -> Array:
        """Machine points (m, 3) of section points (m, 2) at a height above the plane. The way there is `kernels.take_in`."""
        p = np.asarray(points_mm, dtype=np.float64)
        y = np.cross(self.normal, self.x_axis)
        return np.asarray(self.origin_mm + p[:, :1] * self.x_axis + p[:, 1:] * y + height_mm * self.normal)


XY_PLANE = SectionPlane(np.zeros(3), np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0]))
