"""How the cost grows: with points, samples, triangles and minutes of a scan. Drawn into docs/performance-growth.png."""

import tempfile
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure

from drivers.surface.cut import NumpyCutter, cut_surface
from drivers.surface.stl_file import read_stl
from inspection import LiveInspection, deviations, discretize
from inspection.synthetic import even_stations
from tests.benchmarks.ct_benchmark import blade
from tests.benchmarks.history import DOCS, Run
from tests.benchmarks.parts import cross_section, nominal, random_pose
from tests.benchmarks.projection_benchmark import measured_points
from tests.benchmarks.waits import ZONE
from tests.inspection import profiles

PICTURE = DOCS / "performance-growth.png"
Line = list[tuple[float, float]]
RATE_HZ = 10_000
PANELS = {
    "deviations": ("points", "ns a point"),
    "discretize": ("samples", "us a sample"),
    "reading and cutting a surface": ("triangles", "ns a triangle"),
    "a batch of 64 points of a scan": (f"minutes at {RATE_HZ:,} points/s", "us, median"),
}


def lines() -> dict[str, Line]:
    """The figure of every panel at each of its sizes, the best of three."""
    return {
        "deviations": _points(),
        "discretize": _samples(),
        "reading and cutting a surface": _triangles(),
        "a batch of 64 points of a scan": _minutes(),
    }


def _best_s(way: Callable[[], object]) -> float:
    taken = []
    for _ in range(3):
        begin = time.perf_counter()
        way()
        taken.append(time.perf_counter() - begin)
    return min(taken)


def _points() -> Line:
    curve = profiles.p3()
    profile = nominal(curve)
    line = []
    for count in (1_000, 10_000, 100_000, 1_000_000, 4_000_000):
        points = measured_points(curve, count, np.random.default_rng(1), False)
        line.append((float(count), 1e9 * _best_s(partial(deviations, points, profile)) / count))
    return line


def _samples() -> Line:
    curve = profiles.p3()
    counts = (1_000, 3_000, 10_000, 30_000, 100_000)
    return [(float(count), 1e6 * _best_s(partial(discretize, curve, samples=count, step_min=1 / count)) / count) for count in counts]


def _triangles() -> Line:
    line = []
    heights = np.linspace(5.0, 95.0, 10).tolist()
    with tempfile.TemporaryDirectory() as folder:
        for along in (10, 30, 100, 300):
            file = blade(Path(folder) / "blade.stl", around=2_000, along=along)
            count = 2 * 2_000 * along
            line.append((float(count), 1e9 * _best_s(partial(_cut, file, heights)) / count))
    return line


def _cut(file: Path, heights: list[float]) -> None:
    assert all(found.contours for found in cut_surface(read_stl(file), [0.0, 0.0, 1.0], heights, cutter=NumpyCutter()))


def _minutes() -> Line:
    profile = nominal(profiles.p3())
    rng = np.random.default_rng(3)
    part = cross_section(profile, even_stations(profile, 60_000), random_pose(rng), rng)
    live = LiveInspection(profile, ZONE, datum=part.nominal_from_section)
    line = []
    for minute in range(1, 11):
        for _ in range(60 * RATE_HZ // len(part.points_mm) - 1):
            live.add(part.points_mm)
        us = []
        for k in range(0, len(part.points_mm), 64):
            begin = time.perf_counter_ns()
            live.add(part.points_mm[k : k + 64])
            us.append((time.perf_counter_ns() - begin) / 1e3)
        line.append((float(minute), float(np.median(us))))
    return line


def draw(run: Run) -> None:
    """Draw the panels of a run."""
    with mpl.rc_context({"font.size": 9, "axes.spines.top": False, "axes.spines.right": False}):
        figure = Figure(figsize=(9.0, 5.6), layout="constrained")
        for axes, (name, (size, unit)) in zip(figure.subplots(2, 2).flat, PANELS.items(), strict=True):
            axes.plot(*np.array(run.growth[name]).T, marker="o", markersize=4, color="#1f5f99")
            axes.set(title=name, xlabel=size, ylabel=unit)
            axes.set_ylim(bottom=0.0)
            if "minutes" not in size:
                axes.set_xscale("log")
            axes.grid(color="#dddddd", linewidth=0.6)
        figure.savefig(PICTURE, dpi=110)
