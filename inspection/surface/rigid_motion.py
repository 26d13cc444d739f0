"""Rigid motions in space."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]

_ORTHOGONAL = 1e-9
_TURN_GRID, _SHIFT_GRID = 2.0**44, 2.0**30  # a turn about 100 mm and a shift of 1e-9 mm are worth the same
_TINY_RAD = 1e-8  # below it the sine of an angle is the angle


@dataclass(frozen=True, slots=True, eq=False)
class RigidMotion:
    """A rotation about zero followed by a translation, named target_from_source where it is held.

    rotation       : (3, 3) proper: its rows and columns are unit vectors at right angles, its determinant is 1
    translation_mm : (3,)
    """

    rotation: Array
    translation_mm: Array

    def __post_init__(self) -> None:
        rotation, translation = np.array(self.rotation, dtype=np.float64), np.array(self.translation_mm, dtype=np.float64)
        if rotation.shape != (3, 3) or translation.shape != (3,) or not np.isfinite(translation).all():
            raise ValueError(f"need a rotation (3, 3) and a finite translation (3,), got {rotation.shape} and {self.translation_mm}")
        if not (np.abs(rotation @ rotation.T - np.eye(3)).max() < _ORTHOGONAL and np.linalg.det(rotation) > 0):
            raise ValueError(f"no rotation: rows and columns must be unit vectors at right angles, right-handed, got {rotation.tolist()}")
        for array in (rotation, translation):
            array.setflags(write=False)
        object.__setattr__(self, "rotation", rotation)
        object.__setattr__(self, "translation_mm", translation)

    @classmethod
    def identity(cls) -> "RigidMotion":
        """The motion that moves nothing."""
        return cls(np.eye(3), np.zeros(3))

    @classmethod
    def about(cls, centre_mm: ArrayLike, turn_rad: ArrayLike, shift_mm: ArrayLike) -> "RigidMotion":
        """A turn about a centre (3,) by a vector along its axis (3,), as long as its angle, then a shift (3,)."""
        centre, rotation = np.asarray(centre_mm, dtype=np.float64), rotation_of(np.asarray(turn_rad, dtype=np.float64))
        return cls(rotation, centre - rotation @ centre + np.asarray(shift_mm, dtype=np.float64))

    def apply(self, points_mm: ArrayLike) -> Array:
        """Moved points (m, 3), worked out element by element, so that a point's result does not depend on its batch."""
        x, y, z = np.asarray(points_mm, dtype=np.float64).T
        return np.stack([r[0] * x + r[1] * y + r[2] * z + t for r, t in zip(self.rotation, self.translation_mm, strict=True)], axis=1)

    def turn(self, vectors: ArrayLike) -> Array:
        """Turned directions (m, 3)."""
        return RigidMotion(self.rotation, np.zeros(3)).apply(vectors)

    def inverse(self) -> "RigidMotion":
        """The motion that undoes this one."""
        return RigidMotion(self.rotation.T, -(self.rotation.T @ self.translation_mm))

    def after(self, first: "RigidMotion") -> "RigidMotion":
        """The motion that makes `first` and then this one."""
        u, _, v = np.linalg.svd(self.rotation @ first.rotation)  # the nearest rotation: round-off must not add up
        return RigidMotion(u @ v, self.rotation @ first.translation_mm + self.translation_mm)

    def snap_to_grid(self) -> "RigidMotion":
        """The motion on a grid of 2**-44 and 2**-30 mm: without the last bits, in which processors and their libraries differ."""
        turn, shift = np.round(self.rotation * _TURN_GRID) / _TURN_GRID, np.round(self.translation_mm * _SHIFT_GRID) / _SHIFT_GRID
        return RigidMotion(turn, shift)

    @property
    def angle_rad(self) -> float:
        """The angle of the rotation, from 0 to pi."""
        axis = np.array([self.rotation[(i + 2) % 3, (i + 1) % 3] - self.rotation[(i + 1) % 3, (i + 2) % 3] for i in range(3)])
        return float(np.arctan2(np.linalg.norm(axis), np.trace(self.rotation) - 1))


def rotation_of(turn_rad: Array) -> Array:
    """The rotation (3, 3) about a vector (3,) by its length, by Rodrigues's formula."""
    angle = float(np.linalg.norm(turn_rad))
    x, y, z = turn_rad
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    if angle < _TINY_RAD:
        u, _, v = np.linalg.svd(np.eye(3) + cross + cross @ cross / 2)
        return np.asarray(u @ v)
    half = np.sin(angle / 2) / (angle / 2)
    return np.asarray(np.eye(3) + np.sin(angle) / angle * cross + half * half / 2 * cross @ cross)
