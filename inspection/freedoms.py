"""The motions that a fit may make: which of shift in x, shift in y and rotation are free, about which point, and how far.

A datum locks what it determines, and a drawing may allow a part to turn or to shift by so much and no more. The pivot matters as
soon as a shift is locked, for a rotation about another point is a rotation and a shift.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from inspection.rigid import RigidTransform, rotation_about

Array = NDArray[np.float64]
FreedomName = Literal["x", "y", "rotation"]

ALL: tuple[FreedomName, ...] = ("x", "y", "rotation")


@dataclass(frozen=True, slots=True, eq=False)
class Freedoms:
    """Free motions, counted from where a fit starts.

    pivot_mm    : (2,) what a rotation turns about, in nominal coordinates; it goes along with the shift
    names       : (k,) "x", "y", "rotation", the free ones
    directions  : (k, 3) a unit of each free motion: shift in mm (x, y), rotation in rad
    lower, upper : (k,) how far each may go, mm or rad; infinite where there is no limit
    """

    pivot_mm: Array
    names: tuple[FreedomName, ...]
    directions: Array
    lower: Array
    upper: Array

    def __post_init__(self) -> None:
        for array in (self.pivot_mm, self.directions, self.lower, self.upper):
            array.setflags(write=False)

    @classmethod
    def about(
        cls,
        pivot_mm: ArrayLike,
        free: Sequence[FreedomName] = ALL,
        x_axis_rad: float = 0.0,
        limits: Mapping[FreedomName, tuple[float, float]] | None = None,
    ) -> "Freedoms":
        """Freedoms about a pivot (2,).

        x_axis_rad : direction of the datum's x axis in nominal coordinates, which "x" and "y" follow
        limits     : lowest and highest shift in mm, or rotation in rad, of those that are limited; zero must be allowed

        Raises ValueError for a freedom that there is not, that stands twice or that is limited without being free.
        """
        pivot, bounds = np.array(pivot_mm, dtype=np.float64), dict(limits or {})
        if pivot.shape != (2,) or not np.isfinite(pivot).all():
            raise ValueError(f"the pivot must be a point (x, y) in mm, not {pivot_mm!r}")
        if not set(free) <= set(ALL) or len(set(free)) < len(free) or not set(bounds) <= set(free):
            raise ValueError(f"freedoms are x, y and rotation, each once, and only free ones have limits; got {free} and {sorted(bounds)}")
        for name, (low, high) in bounds.items():
            if not low <= 0 <= high:
                raise ValueError(f"the limits of {name} must include zero, where the fit starts; got {low:g} .. {high:g}")
        names = tuple(name for name in ALL if name in free)
        c, s = np.cos(x_axis_rad), np.sin(x_axis_rad)
        unit = {"x": (c, s, 0.0), "y": (-s, c, 0.0), "rotation": (0.0, 0.0, 1.0)}
        limited = np.array([bounds.get(name, (-np.inf, np.inf)) for name in names], dtype=np.float64).reshape(-1, 2)
        directions = np.array([unit[name] for name in names], dtype=np.float64).reshape(-1, 3)
        return cls(pivot, names, directions, limited[:, 0].copy(), limited[:, 1].copy())

    def __len__(self) -> int:
        return len(self.names)

    @property
    def turning(self) -> NDArray[np.bool_]:
        """Which of the free motions (k,) are rotations."""
        return np.asarray(self.directions[:, 2] != 0)

    def pose(self, start: RigidTransform, amounts: Array) -> RigidTransform:
        """The pose after amounts (k,) of the free motions from the start."""
        x, y, turn = (amounts @ self.directions).tolist()
        return rotation_about(self.pivot_mm, turn, np.array([x, y])).after(start)

    def arms(self, moved_mm: Array, amounts: Array) -> Array:
        """Places (m, 2) seen from the pivot, which amounts (k,) have moved."""
        return moved_mm - (self.pivot_mm + (amounts @ self.directions)[:2])

    def units_mm(self, reach_mm: float) -> Array:
        """What a unit (k,) of each motion moves a point at a distance from the pivot by, in mm: rotations and shifts compare."""
        return np.hypot(np.hypot(self.directions[:, 0], self.directions[:, 1]), self.directions[:, 2] * reach_mm)


def gradients(gradient: Array, arms_mm: Array) -> Array:
    """Rates (m, 3) of values by shift in x, shift in y and rotation, from their gradients by place (m, 2)."""
    return np.column_stack([gradient, arms_mm[:, 0] * gradient[:, 1] - arms_mm[:, 1] * gradient[:, 0]])
