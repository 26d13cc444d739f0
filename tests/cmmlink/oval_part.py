"""A part whose truth is closed-form: an ellipse of half axes 10 and 8 mm as an exact rational curve, material inside.

A point off the ellipse by d along the normal at parameter t deviates by d there; its station is an elliptic integral of t.
"""

from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import ellipeinc

from inspection import NominalProfile, NurbsCurve, discretize

A_MM, B_MM = 10.0, 8.0
LENGTH_MM = float(B_MM * ellipeinc(2 * np.pi, 1 - (A_MM / B_MM) ** 2))
COUNT = 360

_CORNERS = [(1, 0), (1, 1), (0, 1), (-1, 1), (-1, 0), (-1, -1), (0, -1), (1, -1), (1, 0)]
_KNOTS = [0, 0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 4]
_WEIGHTS = [1, np.sqrt(0.5), 1, np.sqrt(0.5), 1, np.sqrt(0.5), 1, np.sqrt(0.5), 1]
_CONTROL = np.array(_CORNERS, dtype=float) * (A_MM, B_MM)


def oval_curve() -> NurbsCurve:
    return NurbsCurve(2, _CONTROL, np.array(_KNOTS, dtype=float), np.array(_WEIGHTS), closed=True)


def oval_profile() -> NominalProfile:
    return discretize(oval_curve(), samples=400)


def oval_feet() -> NDArray[np.float64]:
    """Points (COUNT, 2) of the ellipse, even in its parameter from half a step on."""
    t = (np.arange(COUNT) + 0.5) * 2 * np.pi / COUNT
    return np.column_stack([A_MM * np.cos(t), B_MM * np.sin(t)])


def oval_points(deviation_mm: ArrayLike) -> NDArray[np.float64]:
    """Points (COUNT, 2) off those feet by the given deviations, positive outward."""
    feet = oval_feet()
    outward = feet / (A_MM**2, B_MM**2)
    outward /= np.hypot(*outward.T)[:, None]
    return np.asarray(feet + np.broadcast_to(np.asarray(deviation_mm, dtype=np.float64), COUNT)[:, None] * outward)


def station_mm(index: int) -> float:
    return float(B_MM * ellipeinc((index + 0.5) * 2 * np.pi / COUNT, 1 - (A_MM / B_MM) ** 2))


def write_nominal(path: Path) -> Path:
    weights = [float(weight) for weight in _WEIGHTS]
    text = f"degree: 2\nknots: {_KNOTS}\ncontrol_points_mm: {_CONTROL.tolist()}\nweights: {weights}\nclosed: true\n"
    path.write_text(text, encoding="utf-8")
    return path


def write_points(path: Path, points_mm: NDArray[np.float64]) -> Path:
    np.savetxt(path, points_mm, fmt="%.9f", delimiter=",", header="x_mm,y_mm", comments="")
    return path
