"""A part whose truth is closed-form: a disc of radius 10 mm as an exact rational curve, material inside, stations 10 x angle."""

from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from inspection import NominalProfile, NurbsCurve, discretize

RADIUS_MM = 10.0
LENGTH_MM = 2 * np.pi * RADIUS_MM

_CORNERS = [(1, 0), (1, 1), (0, 1), (-1, 1), (-1, 0), (-1, -1), (0, -1), (1, -1), (1, 0)]
_KNOTS = [0, 0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 4]
_WEIGHTS = [1, np.sqrt(0.5), 1, np.sqrt(0.5), 1, np.sqrt(0.5), 1, np.sqrt(0.5), 1]


def round_curve() -> NurbsCurve:
    return NurbsCurve(2, RADIUS_MM * np.array(_CORNERS, dtype=float), np.array(_KNOTS, dtype=float), np.array(_WEIGHTS), closed=True)


def round_profile() -> NominalProfile:
    return discretize(round_curve(), samples=400)


def round_points(deviation_mm: ArrayLike, count: int = 360) -> NDArray[np.float64]:
    """Points (count, 2) at even angles from half a step on, off the circle by the given deviations."""
    angle = (np.arange(count) + 0.5) * 2 * np.pi / count
    radius = RADIUS_MM + np.broadcast_to(np.asarray(deviation_mm, dtype=np.float64), (count,))
    return np.column_stack([radius * np.cos(angle), radius * np.sin(angle)])


def station_mm(index: int, count: int = 360) -> float:
    return (index + 0.5) / count * LENGTH_MM


def write_nominal(path: Path) -> Path:
    corners = [[RADIUS_MM * x, RADIUS_MM * y] for x, y in _CORNERS]
    weights = [float(weight) for weight in _WEIGHTS]
    path.write_text(f"degree: 2\nknots: {_KNOTS}\ncontrol_points_mm: {corners}\nweights: {weights}\nclosed: true\n", encoding="utf-8")
    return path


def write_points(path: Path, points_mm: NDArray[np.float64]) -> Path:
    np.savetxt(path, points_mm, fmt="%.9f", delimiter=",", header="x_mm,y_mm", comments="")
    return path
