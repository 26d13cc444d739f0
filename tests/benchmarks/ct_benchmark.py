"""Surfaces of CT scans: loading and cutting against Open3D alone, stacks of sections against trimesh, and the growth of the cost.

Run from the repository's root, on a quiet machine:  python -m tests.benchmarks.ct_benchmark [--quick]
Every figure comes from a process of its own; memory is the peak of that process and of the Open3D process it starts, added.
Times run from the opening of the file to the result; "whole process" includes the start of Python and all imports.
"""

import argparse
import json
import platform
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drivers.surface.cut import NumpyCutter, cut_surface, height_range_mm
from drivers.surface.open3d_process import Open3DProcess, load_open3d
from drivers.surface.stl_file import RECORD, read_stl

ROOT = Path(__file__).resolve().parents[2]
BLADE_PLANES = [20.0, 50.0, 80.0]


def blade(path: Path, around: int, along: int, seed: int = 1) -> Path:
    """A binary STL of a 100 mm tall, thin closed profile, every vertex moved by 4 um: 2 x around x along triangles."""
    angle = 2 * np.pi * np.arange(around) / around
    profile = np.column_stack([30 * np.cos(angle), 4 * np.sin(angle) + 3 * np.cos(angle) ** 2])
    rng = np.random.default_rng(seed)
    rings = np.empty((along + 1, around, 3), dtype=np.float32)
    rings[:, :, :2] = profile + rng.normal(0, 0.004, (along + 1, around, 2))
    rings[:, :, 2] = np.linspace(0, 100, along + 1)[:, None]
    with path.open("wb") as file:
        file.write(b"blade".ljust(80) + np.uint32(2 * around * along).tobytes())
        for low, high in pairwise(rings):
            records = np.zeros(2 * around, RECORD)
            records["corners"][:around] = np.stack([low, np.roll(low, -1, 0), np.roll(high, -1, 0)], axis=1)
            records["corners"][around:] = np.stack([low, np.roll(high, -1, 0), high], axis=1)
            records.tofile(file)
    return path


# What runs in the processes ------------------------------------------------------------------------------------------


def role_open3d(path: Path, normal: NDArray[np.float64], heights: list[float]) -> dict[str, object]:
    """Open3D alone: its reader, one slice_plane for all planes. Nothing is chained."""
    open3d = load_open3d()
    start = time.perf_counter()
    mesh = open3d.t.io.read_triangle_mesh(str(path))
    loaded = time.perf_counter()
    lines = mesh.slice_plane([0.0, 0.0, 0.0], normal.tolist(), heights)
    done = time.perf_counter()
    return {"load_s": loaded - start, "cut_s": done - loaded, "segments": len(lines.line.indices)}


def role_ours(path: Path, normal: NDArray[np.float64], heights: list[float], cutter: str) -> dict[str, object]:
    """Checked reading, cutting, chaining to contours."""
    if cutter == "numpy":
        return _ours(path, normal, heights, NumpyCutter())
    with Open3DProcess() as process:
        process.status()
        return _ours(path, normal, heights, process)


def _ours(path: Path, normal: NDArray[np.float64], heights: list[float], cutter: NumpyCutter | Open3DProcess) -> dict[str, object]:
    start = time.perf_counter()
    mesh = read_stl(path)
    loaded = time.perf_counter()
    slices = list(cut_surface(mesh, normal.tolist(), heights, cutter=cutter))
    done = time.perf_counter()
    points = sum(len(contour.points_mm) for found in slices for contour in found.contours)
    return {"load_s": loaded - start, "cut_s": done - loaded, "segments": sum(found.triangles for found in slices), "points": points}


def role_trimesh(path: Path, normal: NDArray[np.float64], heights: list[float], how: str) -> dict[str, object]:
    """Load with trimesh; all sections at once (section_multiplane), or one by one (section)."""
    import trimesh

    start = time.perf_counter()
    mesh: Any = trimesh.load_mesh(str(path))
    loaded = time.perf_counter()
    if how == "multiplane":
        sections = mesh.section_multiplane(plane_origin=np.zeros(3), plane_normal=normal, heights=heights)
    else:
        sections = [mesh.section(plane_origin=normal * height, plane_normal=normal) for height in heights]
    done = time.perf_counter()
    return {"load_s": loaded - start, "cut_s": done - loaded, "points": sum(len(section.vertices) for section in sections)}


def role_phantom(path: Path, voxel_mm: float) -> dict[str, object]:
    """Write the phantom; apart, because Linux counts what the starting process held towards the peak of the started one."""
    from tests.drivers.surface.ct_phantom import Defect, make_phantom

    scan = make_phantom(seed=1, voxel_mm=voxel_mm, height_mm=10.0, defect=Defect(0.1, 40.0, 5.0))
    records = np.zeros(len(scan.corners_mm), RECORD)
    records["corners"] = scan.corners_mm
    path.write_bytes(b"phantom".ljust(80) + np.uint32(len(records)).tobytes() + records.tobytes())
    return {"load_s": 0.0, "cut_s": 0.0, "normal": scan.normal.tolist()}


def role_truth(path: Path, voxel_mm: float) -> dict[str, object]:
    """Three sections of the phantom, registered and judged, against what is known of it."""
    import threading

    from cmmlink.plan.surface import CtPlan
    from cmmlink.stack import inspect_stack
    from tests.drivers.surface.ct_phantom import Defect, make_phantom, noise_mm, write_nominal, write_stl

    defect = Defect(0.1, 40.0, 5.0)
    scan = make_phantom(seed=1, voxel_mm=voxel_mm, height_mm=10.0, specks=25, defect=defect)
    stl, nominal = write_stl(scan, path), write_nominal(scan, path.with_suffix(".yaml"))
    part_heights = [2.5, 5.0, 7.5]
    settings = {
        "part": {"name": "phantom"},
        "mesh": {"file": stl},
        "nominal": {"file": nominal},
        "tolerance": {"lower_mm": -0.06, "upper_mm": 0.06},
        "sections": {"normal": tuple(scan.normal), "heights_mm": tuple(scan.machine_height_mm(height) for height in part_heights)},
    }
    start = time.perf_counter()
    stack = inspect_stack(CtPlan.model_validate(settings), clock=time.monotonic, stop=threading.Event())
    lines = [f"  {stack.mesh.triangles:,} triangles, read, cut, registered and judged in {time.perf_counter() - start:.1f} s"]
    for section, height in zip(stack.sections, part_heights, strict=True):
        result = section.run.result
        assert result is not None
        assert result.worst is not None
        judged = np.isfinite(result.deviation_mm)
        noise = 1e3 * noise_mm(scan, height, result.station_mm[judged], result.deviation_mm[judged])
        true = float(scan.form_error_mm(result.station_mm[[result.worst]], height)[0])
        rest = f"mean {noise.mean():+5.2f} um, sigma {noise.std():5.2f} um"
        worst = f"worst {result.deviation_mm[result.worst]:+.4f} mm (true {true:+.4f}) at station {result.station_mm[result.worst]:.2f} mm"
        head = f"  part height {height:.1f} mm: {result.verdict.word:10}"
        lines.append(f"{head} found minus true form: {rest}; {worst}; set aside {section.slice.set_aside}")
    return {"load_s": 0.0, "cut_s": 0.0, "lines": lines}


def run_role(name: str, path: Path, normal: NDArray[np.float64], heights: list[float]) -> None:
    roles: dict[str, Callable[[], dict[str, object]]] = {
        "phantom": lambda: role_phantom(path, heights[0]),
        "truth": lambda: role_truth(path, heights[0]),
        "open3d": lambda: role_open3d(path, normal, heights),
        "ours-open3d": lambda: role_ours(path, normal, heights, "open3d"),
        "ours-numpy": lambda: role_ours(path, normal, heights, "numpy"),
        "trimesh-multiplane": lambda: role_trimesh(path, normal, heights, "multiplane"),
        "trimesh-loop": lambda: role_trimesh(path, normal, heights, "loop"),
    }
    result = roles[name]()
    try:
        import resource  # not on Windows

        unit = 1e6 if sys.platform == "darwin" else 1e3
        used = (resource.getrusage(who).ru_maxrss for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
        result["peak_mb"] = sum(used) / unit
    except ImportError:
        result["peak_mb"] = float("nan")
    print(json.dumps(result))


# The tables ----------------------------------------------------------------------------------------------------------


def measure(name: str, path: Path, normal: NDArray[np.float64], heights: list[float], repeats: int = 1) -> dict[str, Any]:
    """The best of `repeats` runs of a role, each in a process of its own."""
    task = json.dumps({"role": name, "path": str(path), "normal": normal.tolist(), "heights": heights})
    best: dict[str, Any] = {}
    for _ in range(repeats):
        start = time.perf_counter()
        done = subprocess.run([sys.executable, "-m", __spec__.name, "--task", task], cwd=ROOT, check=True, stdout=subprocess.PIPE)
        result: dict[str, Any] = json.loads(done.stdout)
        result["whole_s"] = time.perf_counter() - start
        result["total_s"] = result["load_s"] + result["cut_s"]
        if not best or result["total_s"] < best["total_s"]:
            best = result
    return best


def show(name: str, r: dict[str, Any]) -> None:
    times = f"load {r['load_s']:7.3f} s  cut {r['cut_s']:7.3f} s  both {r['total_s']:7.3f} s  whole process {r['whole_s']:7.3f} s"
    print(f"  {name:34s} {times}  peak {r['peak_mb']:6.0f} MB")


def against_open3d(path: Path, triangles: int) -> None:
    z = np.array([0.0, 0.0, 1.0])
    print(f"\n{triangles:,} triangles, {len(BLADE_PLANES)} planes")
    rival = measure("open3d", path, z, BLADE_PLANES)
    show("Open3D alone (read, slice_plane)", rival)
    for name in ("ours-open3d", "ours-numpy"):
        mine = measure(name, path, z, BLADE_PLANES, repeats=3)
        show(f"{name} (checked, chained)", mine)
        ratios = [rival[key] / mine[key] for key in ("total_s", "whole_s", "peak_mb")]
        print(f"  {'':34s} Open3D alone takes {ratios[0]:.1f} x the time (whole process {ratios[1]:.1f} x), {ratios[2]:.1f} x the memory")


def against_trimesh(path: Path, normal: NDArray[np.float64], planes: int) -> None:
    low, high = height_range_mm(read_stl(path), normal.tolist())
    heights = np.linspace(low, high, planes + 2)[1:-1].tolist()
    print(f"\n{read_stl(path).triangles:,} triangles of the phantom, {planes} planes")
    rivals = [measure(name, path, normal, heights) for name in ("trimesh-multiplane", "trimesh-loop")]
    for name, rival in zip(("trimesh section_multiplane", "trimesh section, one by one"), rivals, strict=True):
        show(name, rival)
    for name in ("ours-numpy", "ours-open3d"):
        mine = measure(name, path, normal, heights, repeats=3)
        show(f"{name} (checked, chained)", mine)
        ratios = [min(rival[key] for rival in rivals) / mine[key] for key in ("cut_s", "total_s")]
        print(f"  {'':34s} the faster trimesh takes {ratios[0]:.1f} x for the sections, {ratios[1]:.1f} x with loading")


def growth(folder: Path, phantom: Path, normal: NDArray[np.float64], sizes: list[int], planes: list[int]) -> None:
    print("\nCost against triangles (3 planes, numpy cutter, load + cut)")
    z = np.array([0.0, 0.0, 1.0])
    for size in sizes:
        path = blade(folder / "growth.stl", around=5000, along=size // 10_000)
        r = measure("ours-numpy", path, z, BLADE_PLANES, repeats=3)
        each = f"{r['total_s'] / size * 1e9:7.1f} ns a triangle"
        print(f"  {size:10,d} triangles  {r['total_s'] * 1e3:8.1f} ms  {each}  peak {r['peak_mb']:5.0f} MB")
    low, high = height_range_mm(read_stl(phantom), normal.tolist())
    print("Cost against planes (phantom, cut and chained)")
    for count in planes:
        r = measure("ours-numpy", phantom, normal, np.linspace(low, high, count + 2)[1:-1].tolist(), repeats=3)
        print(f"  {count:10,d} planes     {r['cut_s'] * 1e3:8.1f} ms  {r['cut_s'] / count * 1e3:7.2f} ms a plane")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true", help="small surfaces: does it run?")
    parser.add_argument("--task", help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.task:
        task = json.loads(arguments.task)
        run_role(task["role"], Path(task["path"]), np.array(task["normal"]), task["heights"])
        return
    quick = arguments.quick
    print(
        f"{platform.platform()}, {platform.processor() or platform.machine()}, Python {platform.python_version()}, numpy {np.__version__}"
    )
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        phantom = folder / "phantom.stl"
        normal = np.array(measure("phantom", phantom, np.zeros(3), [0.2 if quick else 0.05])["normal"])
        print("\nThe phantom: three sections, a defect of 0.1 mm at station 40 mm of the second")
        print("\n".join(measure("truth", folder / "truth.stl", np.zeros(3), [0.1 if quick else 0.05])["lines"]))
        big = 100_000 if quick else 5_000_000
        against_open3d(blade(folder / "blade.stl", around=5000, along=big // 10_000), big)
        against_trimesh(phantom, normal, 20 if quick else 200)
        sizes = [50_000, 100_000] if quick else [312_500, 625_000, 1_250_000, 2_500_000, 5_000_000]
        growth(folder, phantom, normal, sizes, [5, 10] if quick else [1, 10, 50, 100, 200, 400])


if __name__ == "__main__":
    main()
