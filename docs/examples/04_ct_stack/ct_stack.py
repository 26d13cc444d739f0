"""Sections of a CT surface: an STL file is cut every 2 mm, and each section is judged like a scan.

The surface is made here: the cam of the other examples, 10 mm high, with a bulge of 0.25 mm on one side at half its height.

It prints:

    height 1 mm: conform
    height 3 mm: conform
    height 5 mm: nonconform, +0.23 mm
    height 7 mm: conform
    height 9 mm: conform
    the part: nonconform
"""

import json
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
import yaml
from numpy.typing import NDArray

from inspection import NurbsCurve

HERE = Path(__file__).parent
NOMINAL = HERE.parent / "data" / "cam.yaml"


def write_surface(path: Path) -> None:
    """Write the side of the part as binary STL: rings of points every quarter of a millimetre, two triangles between four of them."""
    given = yaml.safe_load(NOMINAL.read_text(encoding="utf-8"))
    curve = NurbsCurve(given["degree"], np.array(given["control_points_mm"]), np.array(given["knots"]), closed=True)
    outline_mm = curve.point(np.linspace(0.0, 1.0, 1200, endpoint=False))  # (n, 2), the parameter runs from 0 to 1
    radius_mm = np.hypot(*outline_mm.T)
    beside = np.hypot(*(outline_mm - outline_mm[0]).T)  # distance from the middle of the bulge
    heights_mm = np.linspace(0.0, 10.0, 41)
    rings = []
    for height_mm in heights_mm:
        bulge_mm = 0.25 * np.exp(-((beside / 3.0) ** 2)) * np.exp(-(((height_mm - 5.0) / 0.7) ** 2))
        xy = outline_mm * (1.0 + bulge_mm / radius_mm)[:, None]
        rings.append(np.column_stack([xy, np.full(len(xy), height_mm)]))
    write_stl(path, np.array(rings))


def write_stl(path: Path, rings: NDArray[np.float64]) -> None:
    """Write the triangles between rings (k, n, 3) of points."""
    a, b = rings[:-1], np.roll(rings[:-1], -1, axis=1)
    d, c = rings[1:], np.roll(rings[1:], -1, axis=1)
    triangles = np.concatenate([np.stack([a, b, c], axis=2).reshape(-1, 3, 3), np.stack([a, c, d], axis=2).reshape(-1, 3, 3)])
    facets = np.zeros(len(triangles), np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")]))
    facets["corners"] = triangles
    path.write_bytes(b"cam".ljust(80) + np.uint32(len(triangles)).tobytes() + facets.tobytes())


with tempfile.TemporaryDirectory() as name:
    folder = Path(name)
    shutil.copy(HERE / "plan.yaml", folder)
    shutil.copy(NOMINAL, folder)
    write_surface(folder / "cam.stl")
    command = [sys.executable, "-m", "cmmlink", "ct", "plan.yaml", "--json"]
    ended = subprocess.run(command, cwd=folder, stdout=subprocess.PIPE, text=True, check=False)

stack = json.loads(ended.stdout)
for section in stack["slices"]:
    worst = f", {section['worst']['deviation_mm']:+.2f} mm" if section["out_of_tolerance"] else ""
    print(f"height {section['height_mm']:g} mm: {section['verdict']}{worst}")
print(f"the part: {stack['verdict']}")
