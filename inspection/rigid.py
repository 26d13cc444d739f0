"""Rigid motions of the plane, and the best one between paired points."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]

_ANGLE_GRID, _SHIFT_GRID = 2.0**40, 2.0**30  # steps per rad and per mm, exact in binary: 0.9e-12 rad and 0.9e-9 mm


@dataclass(frozen=True, slots=True, eq=False)
class RigidTransform:
    """A rotation about the origin followed by a translation, named target_from_source where it is held.

    rotation_rad   : anticlockwise
    translation_mm : (2,)
    """

    rotation_rad: float
    translation_mm: Array

    def __post_init__(self) -> None:
        translation = np.array(self.translation_mm, dtype=np.float64)
        if translation.shape != (2,) or not (math.isfinite(self.rotation_rad) and all(map(math.isfinite, translation.tolist()))):
            raise ValueError(f"need a finite angle and a translation (2,), got {self.rotation_rad} and {self.translation_mm}")
        translation.setflags(write=False)
        object.__setattr__(self, "rotation_rad", float(self.rotation_rad))
        object.__setattr__(self, "translation_mm", translation)

    @classmethod
    def identity(cls) -> "RigidTransform":
        """The motion that moves nothing."""
        return cls(0.0, np.zeros(2))

    def apply(self, points_mm: ArrayLike) -> Array:
        """Moved points (m, 2), worked out element by element, so that a point's result does not depend on its batch."""
        points = np.asarray(points_mm, dtype=np.float64)
        turned = rotate(points, self.rotation_rad)
        turned[:, 0] += self.translation_mm[0]  # column by column, because numpy is slow on rows of two
        turned[:, 1] += self.translation_mm[1]
        return turned

    def snap_to_grid(self) -> "RigidTransform":
        """The motion on a grid of 2**-40 rad and 2**-30 mm: without the last bits, in which processors and their libraries differ."""
        angle, shift = round(self.rotation_rad * _ANGLE_GRID) / _ANGLE_GRID, np.round(self.translation_mm * _SHIFT_GRID) / _SHIFT_GRID
        return RigidTransform(angle, shift)

    def inverse(self) -> "RigidTransform":
        """The motion that undoes this one."""
        x, y = _turn(self.translation_mm, -self.rotation_rad)
        return RigidTransform(-self.rotation_rad, np.array([-x, -y]))

    def after(self, first: "RigidTransform") -> "RigidTransform":
        """The motion that makes `first` and then this one."""
        x, y = self.translation_mm.tolist()
        return _after(self.rotation_rad, x, y, first)


def rotate(vectors: Array, angle_rad: float) -> Array:
    """Vectors (m, 2) turned anticlockwise about the origin."""
    c, s = math.cos(angle_rad), math.sin(angle_rad)
    turned = np.empty((len(vectors), 2))
    x, y = vectors[:, 0], vectors[:, 1]
    np.subtract(c * x, s * y, out=turned[:, 0])
    np.add(s * x, c * y, out=turned[:, 1])
    return turned


def _turn(vector: Array, angle_rad: float) -> tuple[float, float]:
    """One vector (2,) turned as `rotate` turns many, to the last bit, in a fraction of the time."""
    c, s = math.cos(angle_rad), math.sin(angle_rad)
    x, y = vector.tolist()
    return c * x - s * y, s * x + c * y


def _after(rotation_rad: float, x_mm: float, y_mm: float, first: RigidTransform) -> RigidTransform:
    """The motion that makes `first`, then a rotation about the origin, then a shift."""
    angle = rotation_rad + first.rotation_rad
    x, y = _turn(first.translation_mm, rotation_rad)
    return RigidTransform(float(np.arctan2(math.sin(angle), math.cos(angle))), np.array([x + x_mm, y + y_mm]))


def rotation_about(centre_mm: Array, angle_rad: float, shift_mm: Array) -> RigidTransform:
    """Rotation about a centre (2,), then a shift (2,)."""
    return RigidTransform(angle_rad, np.array(_shift_about(centre_mm, angle_rad, *shift_mm.tolist())))


def turned_about(first: RigidTransform, centre_mm: Array, angle_rad: float, x_mm: float, y_mm: float) -> RigidTransform:
    """The motion that makes `first`, then a rotation about a centre (2,), then a shift: one motion for two, in less than half the time."""
    return _after(angle_rad, *_shift_about(centre_mm, angle_rad, x_mm, y_mm), first)


def _shift_about(centre_mm: Array, angle_rad: float, x_mm: float, y_mm: float) -> tuple[float, float]:
    """The shift of a motion that turns about a centre (2,) and then shifts."""
    x, y = centre_mm.tolist()
    turned_x, turned_y = _turn(centre_mm, angle_rad)
    return x + x_mm - turned_x, y + y_mm - turned_y


def best_motion(source_mm: Array, target_mm: Array) -> RigidTransform:
    """The motion that brings source (m, 2) closest to target (m, 2) in the least-squares sense (Kabsch in the plane)."""
    from_mean, to_mean = source_mm.mean(axis=0), target_mm.mean(axis=0)
    a, b = source_mm - from_mean, target_mm - to_mean
    angle = float(np.arctan2((a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]).sum(), (a * b).sum()))
    return rotation_about(from_mean, angle, to_mean - from_mean)
