"""Shapes of nominal files whose truth is known: a NACA section, a circle, a quarter circle; and how files are read in the tests."""

from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from cmmlink.nominal_files import NominalFile, load_nominal
from inspection import NominalError, NurbsCurve

Array = NDArray[np.float64]


def naca_sides(thickness: float, points: int, last: float = 0.1036) -> tuple[Array, Array]:
    """Upper and lower side of a symmetric NACA section, chord 1, leading edge first; last = 0.1036 makes the edge sharp, 0.1015 blunt."""
    x = (1 - np.cos(np.linspace(0, np.pi, points))) / 2
    half = 5 * thickness * (0.2969 * np.sqrt(x) - 0.126 * x - 0.3516 * x**2 + 0.2843 * x**3 - last * x**4)
    half[-1] = 0.0 if last == 0.1036 else half[-1]
    return np.column_stack([x, half]), np.column_stack([x, -half])


def rows(points: ArrayLike, form: str = "{:.17g} {:.17g}") -> str:
    return "".join(form.format(x, y) + "\n" for x, y in np.asarray(points))


UPPER, LOWER = naca_sides(0.12, 41)
BLUNT_UPPER, BLUNT_LOWER = naca_sides(0.12, 41, last=0.1015)
LOOP = np.vstack([UPPER[::-1], LOWER[1:]])
BLUNT_LOOP = np.vstack([BLUNT_UPPER[::-1], BLUNT_LOWER[1:]])


def write_text(folder: Path, text: str | bytes, name: str) -> Path:
    path = folder / name
    path.write_bytes(text.encode() if isinstance(text, str) else text)
    return path


def same_curve(one: NurbsCurve, other: NurbsCurve) -> None:
    assert (one.degree, one.closed) == (other.degree, other.closed)
    for name in ("knots", "control_points_mm", "weights"):
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name))


def reference(loop: Array, scale: float = 100.0) -> NurbsCurve:
    return NurbsCurve.interpolate(loop[:-1] * scale, closed=True, corner_at_seam=True)


def circle_points(count: int, radius: float = 20.0) -> Array:
    angle = np.linspace(0, 2 * np.pi, count + 1)
    return radius * np.column_stack([np.cos(angle), np.sin(angle)])


QUARTER = """\
degree: 2
knots: [0, 0, 0, 1, 1, 1]
control_points_mm: [[1, 0], [1, 1], [0, 1]]
weights: [1, 0.7071067811865476, 1]
"""


def read_or_refuse(path: Path, scale: float = 1.0, closed: bool | None = None) -> NominalFile | None:
    """Either a curve of finite length comes back, or the one named error that names the file."""
    nominal, message = None, f"{path}: read"
    try:
        nominal = load_nominal(path, scale, closed)
    except NominalError as error:
        message = str(error)
    assert message.startswith(f"{path}: ")
    assert nominal is None or 0 < nominal.curve.length_mm < np.inf
    return nominal
