"""What a user waits for, each measured once: a command from its start to its end, a stage, a batch, a point.

A wait gives one or more figures, named by their unit. Its goal is what we want to reach, and its limit what stands in the way of more.
Everything it needs is made before the clock starts.
"""

import gc
import json
import os
import shutil
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import nullcontext
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from unittest.mock import patch

import numpy as np

from inspection import LiveInspection, NominalProfile, NurbsCurve, RigidTransform, ToleranceZone, deviations, discretize, register_fine
from inspection.kernels import project, project_on_samples
from inspection.synthetic import even_stations
from tests.benchmarks.parts import cross_section, nominal, random_pose
from tests.benchmarks.projection_benchmark import measured_points, point_inversion, rounds_ns
from tests.benchmarks.wire_to_verdict import latencies_ms
from tests.drivers.surface.meshes import binary_stl, tube
from tests.inspection import profiles
from tests.inspection.profiles import Array

ROOT = Path(__file__).resolve().parents[2]
ZONE = ToleranceZone(-0.05, 0.05, 0.005)
Figures = dict[str, float]  # unit: value

# Why what is not reached is not; "judging" is from the last point read to the verdict.
POLES = "Qhull alone takes 0.11, and poles found in another way differ in their last bits; the exact method makes none"
LOADING = (
    "loading, 0.75: numba with 17 compiled loops 0.3, data classes and plan models 0.25, numpy, typer and rich 0.2; "
    "the nominal 0.08, judging 0.05"
)
DRAWING = "the same; pictures and report by another process, which loads matplotlib and reportlab meanwhile, 0.4, and then draws 0.5"
MILLION = "loading 0.8, the nominal 0.13, reading 0.3, judging 0.9, then pictures and report 0.65 beside deviations.csv 0.4"
MILLIONS = "all but loading goes with the points: reading 0.3 a million, judging 0.9, deviations.csv 0.4"
PICTURES = (
    "100 pictures by matplotlib, each drawn once and written as PNG and as SVG: six tenths of that to lay out and draw text anew "
    "in either, a sixth to pack the PNG; without pictures the stack takes 4"
)
PASSES = (
    "three to four passes, 20 ns a point; of 100,000 points 1.1 ms on one core, 0.6 of them to draw every 25th, and 4 shared by all cores"
)
COMPILER = (
    "107 compilations, 18 in two processes: numba's types and lowering 5.5, LLVM 8.5, loading 1.8; `cmmlink prepare` does it beforehand"
)

# Runs a command line in a process that tells at its end how much memory it held at most.
MEASURED = """
import atexit, pathlib, sys
status = pathlib.Path("/proc/self/status")
if status.is_file():
    atexit.register(lambda: sys.stderr.write([line for line in status.read_text().splitlines() if line.startswith("VmHWM")][0]))
from cmmlink.__main__ import main
main()
"""


@dataclass(frozen=True, slots=True)
class Wait:
    """One thing that a user waits for.

    name    : what it is, with its size
    once    : measures it once
    goals   : a goal for a unit of the figures, where there is one
    limit   : what stands in the way of more; of commands in seconds of one core, as profiles of them showed
    rounds  : how often it is measured
    """

    name: str
    once: Callable[[], Figures]
    goals: Figures
    limit: str = ""
    rounds: int = 5


def waits(folder: Path, long: bool) -> Iterator[Wait]:
    """Everything, the quick first; `long` adds what takes minutes."""
    yield from _of_deviations()
    yield from _of_registration()
    yield from _of_discretising()
    yield from _of_a_batch(long)
    yield from _of_the_wire()
    yield from _of_commands(folder, long)


def _of_deviations() -> Iterator[Wait]:
    curve = profiles.p3()
    profile = nominal(curve)
    grid, tree, inversion = profile.grid, profile.tree, point_inversion(profile.tree, profile)
    for count in (1_000, 100_000, 1_000_000):
        points = measured_points(curve, count, np.random.default_rng(count), False)
        one = partial(_ns_a_point, partial(deviations, points, profile), count, 1)
        kernel = partial(_ns_a_point, partial(project, points, grid, 1), count, None)
        limit = "the kernel below, and 6 us a call: 2 for marks and signs, 3 for a frozen record of 8 arrays, 1 to check what was asked for"
        yield Wait(f"deviations of {count:,} points, one thread", one, {}, limit, 15)
        goal = {100_000: 21.5, 1_000_000: 26.5}.get(count)
        limit = "instructions of the closed form and memory of the results"
        yield Wait(f"the kernel alone, {count:,} points", kernel, {"ns a point": goal} if goal else {}, limit, 15)
        if count >= 100_000:
            ways: dict[str, Callable[[Array], object]] = {
                "ours": partial(project, grid=grid, threads=1),
                "tree": tree.query,
                "inversion": inversion,
            }
            rivals = partial(_rivals, ways, points)
            goals = {"of a KD-tree query, times": 20.0, "of point inversion, times": 75.0}
            yield Wait(f"what rivals take for {count:,} points, times ours", rivals, goals, "the kernel", 5)
    two = partial(_ns_a_point, partial(deviations, points, profile), count, None)
    yield Wait(
        f"deviations of {count:,} points, all cores",
        two,
        {"ns a point": 17.0},
        "half the kernel, and pages for the results that the system has to give",
        15,
    )
    points = measured_points(curve, 20_000, np.random.default_rng(4), False)
    for method, goal, limit in (("pcp", 60.0, "the rows of the samples"), ("veaw", 90.0, "two arctangents and a hypotenuse: 41 ns")):
        way = partial(project_on_samples, points, grid, profile.sample_table, method, 1)
        yield Wait(f"{method}, 20,000 points", partial(_ns_a_point, way, len(points), None), {"ns a point": goal}, limit, 7)


def _ns_a_point(way: Callable[[], object], count: int, cores: int | None) -> Figures:
    """Time of a point; `cores` makes the program believe that it has so many."""
    with patch("os.cpu_count", lambda: cores) if cores else nullcontext():
        return {"ns a point": 1e9 * _seconds(way, 0.02) / count}


def _seconds(way: Callable[[], object], at_least_s: float) -> float:
    """Mean time of a call, over as many as fill `at_least_s`."""
    gc.collect()
    calls, begin = 0, time.perf_counter()
    while (taken := time.perf_counter() - begin) < at_least_s or not calls:
        way()
        calls += 1
    return taken / calls


def _rivals(ways: dict[str, Callable[[Array], object]], points: Array) -> Figures:
    ns = rounds_ns(ways, points, 1)
    return {"of a KD-tree query, times": ns["tree"] / ns["ours"], "of point inversion, times": ns["inversion"] / ns["ours"]}


def _of_registration() -> Iterator[Wait]:
    profile = nominal(profiles.p3())
    for count, goal in ((2_000, 0.25), (100_000, 4.0)):
        rng = np.random.default_rng(count)
        part = cross_section(profile, even_stations(profile, count), random_pose(rng), rng)
        start = RigidTransform(1e-3, np.array([0.05, -0.03])).after(part.nominal_from_section)
        plain = partial(register_fine, part.points_mm, profile, start)
        robust = partial(register_fine, part.points_mm, profile, start, robust=True)
        yield Wait(f"registration of {count:,} points", partial(_ms, plain), {"ms": goal}, PASSES, 9)
        limit = "three passes find the outliers, each with a median, before the two that are left of the plain fit"
        yield Wait(f"robust registration of {count:,} points", partial(_times_as_long, robust, plain), {"times plain": 2.0}, limit, 9)


def _ms(way: Callable[[], object]) -> Figures:
    return {"ms": 1e3 * _seconds(way, 0.02)}


def _times_as_long(way: Callable[[], object], other: Callable[[], object]) -> Figures:
    return {"times plain": _seconds(way, 0.02) / _seconds(other, 0.02)}


def _of_discretising() -> Iterator[Wait]:
    curve = profiles.p3()
    for samples, exact_s, poles_s in ((10_000, 0.1, 0.15), (100_000, 1.0, None)):
        make = partial(discretize, curve, samples=samples, step_min=1 / samples)
        rounds = 5 if samples < 50_000 else 1
        limit = "half of it the grid of cells and the proof that a cell holds all nearest pieces, half evaluating the curve"
        yield Wait(f"discretize, {samples:,} samples", partial(_s, make), {"s": exact_s}, limit, rounds)
        goals = {"s": poles_s} if poles_s else {}
        yield Wait(f"the same with its poles, {samples:,} samples", partial(_with_poles, make), goals, POLES, rounds)


def _s(way: Callable[[], object]) -> Figures:
    return {"s": _seconds(way, 0.0)}


def _with_poles(make: Callable[[], NominalProfile]) -> Figures:
    begin = time.perf_counter()
    made = make()
    assert len(made.poles.left) == len(made)
    return {"s": time.perf_counter() - begin}


def _of_a_batch(long: bool) -> Iterator[Wait]:
    profile = nominal(profiles.p3())
    rng = np.random.default_rng(3)
    part = cross_section(profile, even_stations(profile, 16_384), random_pose(rng), rng)
    limit = (
        "Python, most of 8 us: 3 copy and freeze what changed; where 64 points are full, 10 more for a pose and a registration of its own. "
        "One batch in 70 seeks or fits a pose anew, or comes after one that did: that is p99"
    )
    yield Wait("a batch of 8 points", partial(_batches, profile, part.points_mm, 8, None), {"us, p99": 8.0}, limit, 5)
    for held in (100_000, 1_000_000, *((10_000_000,) if long else ())):
        once = partial(_late_batches, profile, part.points_mm, held, part.nominal_from_section)
        yield Wait(f"a batch of 64 points after {held:,}", once, {"us, p99": 1000.0}, "", 3 if held < 10_000_000 else 1)


def _batches(profile: NominalProfile, points: Array, size: int, datum: RigidTransform | None) -> Figures:
    live = LiveInspection(profile, ZONE, datum=datum)
    return _percentiles([_us(partial(live.add, points[k : k + size])) for k in range(0, len(points), size)])


def _late_batches(profile: NominalProfile, points: Array, held: int, datum: RigidTransform) -> Figures:
    """Batches, and what their counters cost, of a scan that goes round and round, once it holds so many points."""
    live = LiveInspection(profile, ZONE, datum=datum)
    for _ in range(held // len(points)):
        live.add(points)
    return _percentiles([_us(partial(_add_and_count, live, points[k : k + 64])) for k in range(0, len(points), 64)])


def _add_and_count(live: LiveInspection, batch: Array) -> None:
    live.add(batch)
    assert live.judged + sum(live.rejected_by_reason.values()) <= live.received


def _us(way: Callable[[], object]) -> float:
    begin = time.perf_counter_ns()
    way()
    return (time.perf_counter_ns() - begin) / 1e3


def _percentiles(us: list[float]) -> Figures:
    return {"us, p50": float(np.median(us)), "us, p99": float(np.quantile(us, 0.99))}


def _of_the_wire() -> Iterator[Wait]:
    limit = "threads that take turns in one interpreter: who reads and checks bytes, who judges, who serves the page"
    for rate_hz, goal in ((10_000, 1.0), (50_000, 4.0)):
        for words, looked_at in (("", False), (", a page open", True)):
            name = f"last byte of a point to its verdict, {rate_hz:,} points/s{words}"
            yield Wait(name, partial(_wire, rate_hz, looked_at), {"ms, p99": goal}, limit, 3)


def _wire(rate_hz: int, looked_at: bool) -> Figures:
    p50, p99 = np.percentile(latencies_ms(rate_hz, looked_at), [50, 99])
    return {"ms, p50": float(p50), "ms, p99": float(p99)}


def _of_commands(folder: Path, long: bool) -> Iterator[Wait]:
    """Commands as a user gives them, in processes of their own."""
    yield Wait("cmmlink --help", partial(_command, folder, ["--help"]), {"s": 0.2}, "the start of Python, 0.02 s, and of typer", 7)
    curve = profiles.naca("2412", 60.0)
    file = _nominal_file(curve, folder / "blade.yaml")
    asked = ["--nominal", str(file), "--tolerance", "-0.05", "0.05", "--no-record"]
    out = ["--out", str(folder / "out")]
    sizes: list[tuple[int, list[str], Figures, str, int]] = [
        (1_000, [], {"s": 1.0}, LOADING, 7),
        (1_000, out, {}, DRAWING, 7),
        (1_000_000, out, {"s": 3.0, "MB": 300.0}, MILLION, 3),
    ]
    if long:
        sizes.append((10_000_000, out, {"s": 20.0, "MB": 1000.0}, MILLIONS, 1))
    for count, results, goals, limit, rounds in sizes:
        points = _points_file(curve, count, folder / f"{count}.csv")
        name = f"cmmlink inspect, {count:,} points{', results out' if results else ''}"
        yield Wait(name, partial(_command, folder, ["inspect", str(points), *asked, *results]), goals, limit, rounds)
    surface, heights = _surface_file(curve, folder / "blade.stl", sections=100, around=5_000)
    sections = ["ct", str(surface), *asked, "--heights", *heights, "--pictures", "all", *out]
    yield Wait("cmmlink ct, 100 sections of 5,000 points, results out", partial(_command, folder, sections), {"s": 12.0}, PICTURES, 1)
    yield Wait("first use after installing", partial(_first_use, folder), {"s": 8.0}, COMPILER, 1)


def _command(folder: Path, arguments: list[str]) -> Figures:
    """Seconds and largest resident set of a command in a process of its own. Raises AssertionError where it says that input is bad."""
    own = {name: str(folder) for name in ("HOME", "XDG_DATA_HOME", "XDG_STATE_HOME")}
    command, environment = [sys.executable, "-c", MEASURED, *arguments], _as_installed() | own
    begin = time.perf_counter()
    done = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True, check=False)
    taken = time.perf_counter() - begin
    assert done.returncode in (0, 1, 3), done.stderr
    _, held, kilobytes = done.stderr.rpartition("VmHWM:")
    return {"s": taken} | ({"MB": int(kilobytes.split()[0]) / 1024} if held else {})


def _as_installed() -> dict[str, str]:
    """The environment, in which Python may keep the files that it has compiled, as it does for users."""
    return {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}


def _first_use(folder: Path) -> Figures:
    """A copy of the package with no compiled code beside it, until a first scan could begin."""
    copy = folder / "fresh"
    shutil.rmtree(copy, ignore_errors=True)
    for package in ("inspection", "tests"):
        shutil.copytree(ROOT / package, copy / package, ignore=shutil.ignore_patterns("__pycache__", "node_modules"))
    code = "from inspection import discretize, rehearse; from tests.inspection import profiles; rehearse(discretize(profiles.p3()))"
    begin = time.perf_counter()
    subprocess.run([sys.executable, "-c", code], cwd=copy, env=_as_installed() | {"PYTHONPATH": str(copy)}, check=True)
    return {"s": time.perf_counter() - begin}


def _nominal_file(curve: NurbsCurve, file: Path) -> Path:
    """The curve as a nominal file."""
    content = {
        "degree": curve.degree,
        "closed": curve.closed,
        "knots": curve.knots.tolist(),
        "control_points_mm": curve.control_points_mm.tolist(),
    }
    file.write_text(json.dumps(content | ({} if curve.weights is None else {"weights": curve.weights.tolist()})), encoding="utf-8")
    return file


def _points_file(curve: NurbsCurve, count: int, file: Path) -> Path:
    """A csv of a scan with form error and noise, in order, in a pose of its own."""
    rng = np.random.default_rng(count)
    profile = discretize(curve)
    part = cross_section(profile, even_stations(profile, count), random_pose(rng), rng, ((0.008, (2,)), (0.004, (5,))))
    np.savetxt(file, part.points_mm, fmt="%.6f", delimiter=",", header="x_mm,y_mm", comments="")
    return file


def _surface_file(curve: NurbsCurve, file: Path, sections: int, around: int) -> tuple[Path, list[str]]:
    """A blade whose every section has so many points, and heights between its rings."""
    u = np.linspace(*curve.domain, around // 2, endpoint=False)
    rings = np.linspace(0.0, 10.0, 3)
    file.write_bytes(binary_stl(tube(curve.point(u), rings)))
    return file, [f"{height:.4f}" for height in np.linspace(0.5, 9.5, sections)]
