"""A stack of CT sections with twenty characteristics each, every section recorded, as a command of its own.

Run from the repository's root, on a quiet machine:  python -m tests.benchmarks.stack_benchmark [--sections N] [--checkout FOLDER ...]
The surface is an airfoil of 160,000 triangles whose form differs from height to height, cut by numpy. Seconds are those of the wall and of
the processor, the other processes' included. Several checkouts are measured in turn, and what they found is compared.
"""

import argparse
import hashlib
import json
import os
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np

from cmmlink.nominal_files import load_nominal
from inspection import discretize
from inspection.synthetic import even_stations
from tests.benchmarks.characteristics_benchmark import FILE
from tests.benchmarks.machine import machine
from tests.drivers.surface.meshes import binary_stl, tube

ROOT = Path(__file__).resolve().parents[2]
AROUND, RINGS, HEIGHT_MM = 4000, 21, 40.0
EVEN = {"lower_mm": -0.06, "upper_mm": 0.06}
VARYING = {"stations_mm": [0, 60, 120, 180], "lower_mm": [-0.05, -0.06, -0.05, -0.04], "upper_mm": [0.05, 0.05, 0.06, 0.05]}
DATUM = {"datum": {"edge": "LE", "points": [{"near": [70.0, 5.0]}]}}
IN_MM, IN_DEG = {"lower_mm": -0.1, "upper_mm": 0.1}, {"lower_deg": -0.1, "upper_deg": 0.1}
PROFILES: dict[str, dict[str, Any]] = {
    "contour": {"fit": "minimum-zone"},
    "LE form": {"region": "LE", "within_mm": 15.0},
    "flank": {"from": {"station_mm": 20.0}, "to": {"station_mm": 70.0}, "fit": "none"},
    "location": {"fit": "datum", **DATUM},
    "varying": {"zone": VARYING, "fit": "tolerance"},
    "waviness": {"fit": "none", "filter": {"cutoff_mm": 8.0, "order": 0}},
    "upper form": {"region": "UPPER", "fit": "minimum-zone"},
    "lower form": {"region": "LOWER"},
}
NUMBERS: dict[str, dict[str, Any]] = {
    "chord": {"type": "chord", "method": "tangent"},
    "longest chord": {"type": "chord", "method": "maximum-distance"},
    "x extent": {"type": "chord", "method": "x-extent"},
    "thickness": {"type": "thickness", "method": "inscribed"},
    "two-point thickness": {"type": "thickness", "method": "two-point"},
    "LE radius": {"type": "edge-radius", "edge": "leading", "method": "circle", "window_deg": 40.0},
    "camber": {"type": "camber"},
    "LE thickness": {"type": "edge-thickness", "edge": "leading", "offset_mm": 5.0},
    "TE thickness": {"type": "edge-thickness", "edge": "trailing", "offset_mm": 5.0},
    "angle": {"type": "chord-angle", "method": "nose-tail", **DATUM},
    "twist": {"type": "twist", "method": "nose-tail", **DATUM},
    "displacement": {"type": "displacement", "place_mm": [40.0, 3.0], "axis": "x", **DATUM},
}


def write_stack(folder: Path, sections: int) -> Path:
    """Write the surface and the plan of so many sections; gives the plan."""
    nominal = discretize(load_nominal(FILE, 100.0, None, None).curve)
    station = even_stations(nominal, AROUND)
    place, along = nominal.curve.derivatives(np.interp(station, nominal.station_mm, nominal.parameter), 1)
    normal = nominal.outward * np.column_stack([-along[:, 1], along[:, 0]]) / np.hypot(*along.T)[:, None]
    heights, rng = np.linspace(0.0, HEIGHT_MM, RINGS), np.random.default_rng(7)
    surface = tube(place, heights)
    noise = rng.normal(0.0, 0.003, (RINGS, AROUND))
    ring, corner = np.searchsorted(heights, surface[:, :, 2]), _corners()
    turn = 2 * np.pi * station[corner] / nominal.length_mm
    form = 0.01 * np.sin(2 * turn + 0.4 * ring) + 0.006 * np.sin(5 * turn - 0.7 * ring) + 0.004 * np.sin(13 * turn + 1.1 * ring)
    surface[:, :, :2] += (form + noise[ring, corner])[:, :, None] * normal[corner]
    (folder / "blade.stl").write_bytes(binary_stl(surface))
    asked = [{"name": name, "type": "line-profile", "zone": EVEN} | told for name, told in PROFILES.items()]
    asked += [{"name": name} | (IN_DEG if told["type"] in ("chord-angle", "twist") else IN_MM) | told for name, told in NUMBERS.items()]
    plan = {
        "part": {"name": "blade"},
        "mesh": {"file": "blade.stl"},
        "nominal": {"file": str(FILE), "scale": 100.0},
        "tolerance": EVEN,
        "sections": {"heights_mm": np.linspace(0.5, HEIGHT_MM - 0.5, sections).round(4).tolist()},
        "cut": {"cutter": "numpy"},
        "characteristics": [one | ({"lower_mm": -0.01, "upper_mm": 0.01} if one["name"] == "camber" else {}) for one in asked],
    }
    (folder / "ct.yaml").write_text(json.dumps(plan), encoding="utf-8")  # which is YAML as well
    return folder / "ct.yaml"


def _corners() -> Any:
    """The number around the profile (t, 3) of each corner of a triangle, in the order of `tube`."""
    one = np.tile(np.arange(AROUND), RINGS - 1)
    other = (one + 1) % AROUND
    return np.concatenate([np.stack([one, other, other], axis=1), np.stack([one, other, one], axis=1)])


def seconds_of(plan: Path, checkout: Path, records: Path) -> tuple[float, float, str]:
    """Seconds of the wall and of the processor of one inspection by a checkout, and the hash of what it found."""
    before, began = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    command = [sys.executable, "-m", "cmmlink", "ct", str(plan), "--json", "--records", str(records)]
    done = subprocess.run(
        command, cwd=checkout, env=os.environ | {"PYTHONPATH": str(checkout)}, capture_output=True, text=True, check=False
    )
    wall, after = time.perf_counter() - began, resource.getrusage(resource.RUSAGE_CHILDREN)
    assert done.returncode in (0, 1, 3), done.stderr
    found = [(one["verdict"], one["rms_mm"], one["characteristics"]) for one in json.loads(done.stdout)["slices"]]
    told = hashlib.sha256(json.dumps(found).encode()).hexdigest()[:16]
    return wall, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime, told


def main() -> None:
    """Print the figures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sections", type=int, default=200)
    parser.add_argument("--checkout", type=Path, nargs="+", default=[ROOT], help="checkouts to measure in turn")
    options = parser.parse_args()
    print(machine("numpy", "scipy", "numba"))
    with tempfile.TemporaryDirectory() as folder:
        plan = write_stack(Path(folder), options.sections)
        for number, checkout in enumerate(options.checkout):
            wall, processor, told = seconds_of(plan, checkout.resolve(), Path(folder) / f"records-{number}")
            print(f"{checkout}: {options.sections} sections in {wall:.1f} s, {processor:.1f} s of the processor; found {told}", flush=True)


if __name__ == "__main__":
    main()
