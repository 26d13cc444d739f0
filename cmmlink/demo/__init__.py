"""The demonstration: a plan, its nominal, and the path of the part that the simulated device walks along."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from cmmlink.demo.section import nominal_points
from inspection import NurbsCurve

_LIFTED_MM = 10.0  # so that a distance sensor at y = 0 has the whole section in its range
_CHORD_ERROR_MM = 1e-5  # between polyline and curve: far below the last digit of any deviation that is shown


def plan_file() -> Path:
    """Path of the demonstration's plan; its device address is filled in when the simulated device is up."""
    return Path(__file__).with_name("plan.yaml")


def part_path(curve: NurbsCurve, points: int = 20_000) -> NDArray[np.float64]:
    """Points (k, 2) in mm along the curve, k at least `points`: even in arc length, denser where it bends sharply.

    The path has no form error, defect or probe radius: the simulated device adds them. A closed curve's last point repeats its first.
    """
    if points < 2:
        raise ValueError(f"a path has at least two points, not {points}")
    u = np.linspace(*curve.domain, 4 * points + 1)
    station = curve.station_mm(u)
    station[-1] = curve.length_mm  # a closed curve's end is its beginning, at station 0
    sagging = np.sqrt(np.abs(curve.curvature(u)) / (8 * _CHORD_ERROR_MM))  # sag of a chord h: h^2 curvature / 8
    density = np.maximum(points / curve.length_mm, sagging)
    count = np.concatenate([[0.0], np.cumsum((density[1:] + density[:-1]) / 2 * np.diff(station))])
    path = curve.point(np.interp(np.linspace(0.0, count[-1], int(np.ceil(count[-1])) + 1), count, u))
    if curve.closed:
        path[-1] = path[0]
    return path


def section_on_machine() -> NDArray[np.float64]:
    """Points (k, 2) along the demonstration's section where simulated devices have it: its chord at y = 10 mm."""
    return np.asarray(part_path(NurbsCurve.interpolate(nominal_points(), closed=True)) + [0.0, _LIFTED_MM])  # noqa: RUF005 - numbers are added


def path_csv(path_mm: NDArray[np.float64]) -> str:
    """Spell points (k, 2) of a path as csv with columns x_mm, y_mm, for a simulated device to read."""
    return "x_mm,y_mm\n" + "".join(f"{x:.9f},{y:.9f}\n" for x, y in path_mm)


def write_part_path(curve: NurbsCurve, path: Path, points: int = 20_000) -> None:
    """Write `part_path` as csv."""
    path.write_text(path_csv(part_path(curve, points)), encoding="utf-8", newline="\n")
