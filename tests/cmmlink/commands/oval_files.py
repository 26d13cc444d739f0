"""The oval as files: its nominal, points off it, plans of it; and a peanut, which is concave at its waist."""

from pathlib import Path
from typing import Any

import numpy as np

from tests.cmmlink.command import Ended, cmmlink
from tests.cmmlink.oval_part import oval_points, write_points

TOLERANCE = ("--tolerance", -0.05, 0.05)


def inspect_oval(nominal: Path, deviation_mm: Any, *options: object) -> Ended:
    """Inspect an oval with these deviations where it lies: turned by half, it is the same."""
    points = write_points(nominal.parent / "points.csv", oval_points(deviation_mm))
    return cmmlink("inspect", points, "--nominal", nominal, *TOLERANCE, "--fit", "none", *options)


def one_off(value_mm: float) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    deviation = np.zeros(360)
    deviation[100] = value_mm
    return deviation


def peanut(folder: Path) -> tuple[Path, np.ndarray[Any, np.dtype[np.float64]]]:
    """r = 20 + 6 cos 2t in mm: at its waist concave with radius (r^2 + r'^2)^1.5 / |r^2 + 2 r'^2 - r r''| = 14^3 / 140 = 19.6 mm."""
    t = np.linspace(0, 2 * np.pi, 401)
    points = (20 + 6 * np.cos(2 * t))[:, None] * np.column_stack([np.cos(t), np.sin(t)])
    points[-1] = points[0]
    return write_points(folder / "peanut.csv", points), points[:-1]


PLAN = """\
part: {name: oval, serial_number: 0012}
operator: A. Operator
nominal: {file: oval.yaml}
tolerance:
  lower_mm: -0.05
  upper_mm: 0.05
device: {type: file, file: points.csv}
probe: {tip_radius_mm: 0}
registration: {datum: {}}
discretisation: {samples: 400}
"""


def write_plan(nominal: Path, deviation_mm: Any = 0.0, text: str = PLAN) -> Path:
    write_points(nominal.parent / "points.csv", oval_points(deviation_mm))
    plan = nominal.parent / "plan.yaml"
    plan.write_text(text, encoding="utf-8")
    return plan
