"""Two checkouts, the same inputs: every deviation, verdict, hash and JSON must be equal to the last bit.

A proof for changes that only move code: `python -m tests.benchmarks.identity OLD NEW --airfoils FOLDER` lets each checkout work in
processes of its own over the paper's curves, the airfoils, the CT phantom, the demonstration and recorded runs on faulty lines. Runs
are recorded by OLD and replayed by both, so records written before the change are read as well.
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from tests.drivers.surface.ct_phantom import Defect, make_phantom, write_nominal, write_stl
from tests.integration.test_replay import FAULTS

SCAN = ["--count", "1500", "--seed", "5", "--tip-radius-mm", "1", "--noise-mm", "0.01", "--form-error-mm", "0.02"]
METHODS = ("exact", "circle", "chord", "pcp", "veaw", "hermite", "inversion")
FITS = ("best-fit", "minimum-zone", "none")
PASSING_KEYS = {"run", "started", "finished", "records", "previous", "device", "address"}  # of this one run, not of what it found

# Uses nothing but the names that are promised to stay.
LIBRARY = """
import sys
import numpy as np
from inspection import (LiveInspection, NurbsCurve, RigidTransform, ToleranceZone, deviations, discretize, fit_minimum_zone, register,
                        register_coarse, register_fine)
inputs, out = np.load(sys.argv[1]), {}
for name in sorted({key.partition("/")[0] for key in inputs}):
    given = {key.partition("/")[2]: inputs[key] for key in inputs if key.startswith(name + "/")}
    weights = given["weights"] if given["weights"].size else None
    curve = NurbsCurve(int(given["degree"]), given["control"], given["knots"], weights, closed=bool(given["closed"]))
    nominal = discretize(curve, samples=3000)
    rng = np.random.default_rng(7)
    u = np.linspace(curve.knots[curve.degree], curve.knots[-curve.degree - 1], 1500, endpoint=not curve.closed)
    points = curve.point(u) + 0.02 * np.sin(40 * u)[:, None] + 0.003 * rng.standard_normal((len(u), 2))
    for method in ("exact", "circle", "chord", "pcp", "veaw", "hermite", "inversion"):
        d = deviations(points, nominal, method=method)
        for field in ("deviation_mm", "foot_mm", "parameter", "station_mm", "beyond_end"):
            out[f"{name} {method} {field}"] = getattr(d, field)
    moved = RigidTransform(1.1, np.array([30.0, -5.0])).apply(points)
    for label, r in (("coarse", register_coarse(moved, nominal)), ("register", register(moved, nominal)),
                     ("part", register(moved[:700], nominal)), ("robust", register(moved, nominal, robust=True)),
                     ("icp", register_fine(moved, nominal, register_coarse(moved, nominal).nominal_from_section, scheme="icp"))):
        pose = r.nominal_from_section
        out[f"{name} {label}"] = np.array([pose.rotation_rad, *pose.translation_mm, r.rms_mm, r.iterations, r.converged])
    z = fit_minimum_zone(points, nominal)
    out[f"{name} zone"] = np.array([z.nominal_from_section.rotation_rad, *z.nominal_from_section.translation_mm])
    live = LiveInspection(nominal, ToleranceZone(-0.03, 0.03, 0.004), tip_radius_mm=0.0)
    for first in range(0, len(moved), 37):
        update = live.add(moved[first : first + 37])
        out[f"{name} live {first}"] = np.concatenate([update.deviation_mm, update.verdicts, [update.can_move_mm]])
    result = live.finish()
    out[f"{name} result"] = np.concatenate([result.deviation_mm, result.verdicts, result.station_mm, [result.verdict, result.coverage]])
np.savez(sys.argv[2], **out)
"""
PART_PATH = """
import sys
from pathlib import Path
from cmmlink.demo import plan_file, write_part_path
from cmmlink.nominal_files import load_nominal
write_part_path(load_nominal(plan_file().with_name("nominal.csv")).curve, Path(sys.argv[1]))
"""
CURVES = """
import sys
from pathlib import Path
import numpy as np
from cmmlink.nominal_files import load_nominal
from tests.inspection.profiles import p1, p2, p3
curves = {"P1": p1(), "P2": p2(), "P3": p3()}
for path in sorted(Path(sys.argv[1]).glob("*.dat")):
    curves[path.stem] = load_nominal(path, scale=100.0, closed=True).curve
out = {}
for name, c in curves.items():
    out |= {f"{name}/degree": c.degree, f"{name}/control": c.control_points_mm, f"{name}/knots": c.knots, f"{name}/closed": c.closed,
            f"{name}/weights": np.array([]) if c.weights is None else c.weights}
np.savez(sys.argv[2], **out)
"""


class Checkout:
    """One of the two checkouts, at work in processes of its own."""

    def __init__(self, root: Path, folder: Path) -> None:
        self.root, self.folder = root.resolve(), folder
        folder.mkdir(parents=True)
        self.found: dict[str, Any] = {}

    def python(self, *words: object) -> subprocess.CompletedProcess[str]:
        """Run this checkout's Python with its packages before any installed ones."""
        environment = os.environ | {"PYTHONPATH": str(self.root)}
        return subprocess.run(
            [sys.executable, *map(str, words)], cwd=self.root, env=environment, capture_output=True, text=True, timeout=900, check=False
        )

    def cmmlink(self, label: str, *words: object, out: bool = False) -> None:
        """Run one command and keep its exit code, its JSON and the files it writes, without what belongs to that one run."""
        target = self.folder / label.replace(" ", "_").replace("/", "_")
        done = self.python("-m", "cmmlink", *words, "--json", *(["--out", target] if out else []))
        self.found[label] = (done.returncode, without_passing_keys(json.loads(done.stdout)) if done.stdout.strip() else done.stderr)
        if out and target.is_dir():
            for path in sorted(target.rglob("*.csv")):
                self.found[f"{label} {path.relative_to(target)}"] = path.read_bytes()


def without_passing_keys(value: Any) -> Any:
    """Drop ids, times and addresses, which differ between any two runs."""
    if isinstance(value, dict):
        return {key: without_passing_keys(item) for key, item in value.items() if key not in PASSING_KEYS}
    return [without_passing_keys(item) for item in value] if isinstance(value, list) else value


def compare_library(checkout: Checkout, curves: Path) -> None:
    """Deviations, poses, zones and live verdicts on every curve."""

    target = checkout.folder / "library.npz"
    done = checkout.python("-c", LIBRARY, curves, target)
    if done.returncode:
        raise SystemExit(done.stderr)
    with np.load(target) as arrays:
        checkout.found |= {f"library {name}": arrays[name].tobytes() for name in arrays}


def compare_files(checkout: Checkout, scans: Path, airfoils: list[Path]) -> None:
    """`inspect` and `nominal` on every airfoil, all methods and fits on the first."""
    for number, path in enumerate(airfoils):
        nominal = ("--nominal", path, "--scale", 100, "--closed", "--tolerance", -0.05, 0.05)
        checkout.cmmlink(f"nominal {path.stem}", "nominal", path, "--scale", 100, "--closed")
        checkout.cmmlink(f"inspect {path.stem}", "inspect", scans / f"{path.stem}.csv", *nominal, "--uncertainty", 0.004, out=True)
        if number == 0:
            for method in METHODS:
                checkout.cmmlink(f"inspect {method}", "inspect", scans / f"{path.stem}.csv", *nominal, "--method", method, out=True)
            for fit in FITS:
                checkout.cmmlink(f"inspect {fit}", "inspect", scans / f"{path.stem}.csv", *nominal, "--fit", fit, out=True)
            checkout.cmmlink("inspect robust", "inspect", scans / f"{path.stem}.csv", *nominal, "--reject-outliers", out=True)


def compare_surface(checkout: Checkout, mesh: Path, nominal: Path, heights: list[float], normal: list[float]) -> None:
    """Sections of the CT phantom by both cutters."""
    for cutter in ("numpy", "open3d"):
        words = ("ct", mesh, "--nominal", nominal, "--tolerance", -0.1, 0.1, "--normal", *normal, "--heights", *heights)
        checkout.cmmlink(f"ct {cutter}", *words, "--cutter", cutter, "--closed", "--no-pictures", out=True)


def write_scans(old: Checkout, curves: Path, folder: Path) -> None:
    """A scan of each curve, turned and moved, with form error, noise and a dent."""
    program = """
import sys
import numpy as np
from inspection import NurbsCurve, RigidTransform
inputs = np.load(sys.argv[1])
for name in sorted({key.partition("/")[0] for key in inputs}):
    w = inputs[name + "/weights"]
    curve = NurbsCurve(int(inputs[name + "/degree"]), inputs[name + "/control"], inputs[name + "/knots"], w if w.size else None,
                       closed=bool(inputs[name + "/closed"]))
    u = np.linspace(curve.knots[curve.degree], curve.knots[-curve.degree - 1], 2000, endpoint=False)
    rng = np.random.default_rng(3)
    d = 0.015 * np.sin(9 * u) + 0.003 * rng.standard_normal(len(u)) - 0.09 * np.exp(-(((np.arange(len(u)) - 700) / 15) ** 2))
    t = curve.derivatives(u, 1)[1]
    n = np.column_stack([t[:, 1], -t[:, 0]]) / np.hypot(t[:, 0], t[:, 1])[:, None]
    np.savetxt(f"{sys.argv[2]}/{name}.csv", RigidTransform(0.4, np.array([5.0, 6.0])).apply(curve.point(u) + d[:, None] * n), delimiter=",")
"""
    folder.mkdir()
    done = old.python("-c", program, curves, folder)
    if done.returncode:
        raise SystemExit(done.stderr)


def record_runs(old: Checkout, records: Path) -> list[str]:
    """Let OLD record the demonstration and a scan over every faulty line; the labels of the runs, oldest first."""
    labels = []
    for label, words in {"demo": [], "demo with a defect": ["--defect", "0.12@40"], "demo of another part": ["--seed", "7"]}.items():
        done = old.python("-m", "cmmlink", "demo", "--headless", "--json", "--records", records, *words)
        old.found[label] = done.returncode
        labels.append(label)
    plan = (old.root / "cmmlink" / "demo" / "plan.yaml").read_text(encoding="utf-8")
    nominal = old.root / "cmmlink" / "demo"
    path = old.folder / "path.csv"
    old.python("-c", PART_PATH, path)
    for number, faults in enumerate(FAULTS):
        labels.append(f"faulty run {number}")
        words = [word for fault in faults for word in ("--fault", fault)]
        environment = os.environ | {"PYTHONPATH": str(old.root)}
        command = [sys.executable, "-m", "simulators", "serial", "--address", "127.0.0.1:0", "--path", path, *SCAN]
        with subprocess.Popen(
            [*map(str, command), "--rate", "5000", *words], stdout=subprocess.PIPE, text=True, cwd=old.root, env=environment
        ) as device:
            try:
                assert device.stdout is not None
                address = device.stdout.readline().strip()
                device_line = f'device: {{type: serial, address: "{address}", silence_s: 2}}'
                text = "\n".join(device_line if line.startswith("device:") else line for line in plan.splitlines())
                file = old.folder / f"run{number}.yaml"
                file.write_text(text.replace("nominal: {file: ", f"nominal: {{file: {nominal}/"), encoding="utf-8")
                done = old.python("-m", "cmmlink", "run", file, "--headless", "--json", "--records", records)
                old.found[labels[-1]] = (done.returncode, done.stderr)
            finally:
                device.kill()
    return labels


def replay_runs(checkout: Checkout, records: Path) -> None:
    """Replay, show and verify every run that OLD recorded."""
    listed = json.loads(checkout.python("-m", "cmmlink", "runs", "--records", records, "--json").stdout)["runs"]
    checkout.found["runs"] = listed
    for run in listed:
        words = ("--records", records)
        checkout.cmmlink(f"replay {run['run']}", "replay", run["run"], *words, out=True)
        checkout.cmmlink(f"show {run['run']}", "show", run["run"], *words)
    done = checkout.python("-m", "cmmlink", "verify", "--records", records)
    checkout.found["verify"] = done.returncode


def main() -> None:
    """Compare the two and end with 1 when anything differs."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("old", type=Path)
    parser.add_argument("new", type=Path)
    parser.add_argument("--airfoils", type=Path, required=True)
    choice = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        old, new = Checkout(choice.old, folder / "old"), Checkout(choice.new, folder / "new")
        curves, records = folder / "curves.npz", folder / "records"
        done = old.python("-c", CURVES, choice.airfoils.resolve(), curves)
        if done.returncode:
            raise SystemExit(done.stderr)
        write_scans(old, curves, folder / "scans")
        labels = record_runs(old, records)
        for label in labels:
            sys.stdout.write(f"{label}: {old.found.pop(label)}\n")
        phantom = make_phantom(seed=1, voxel_mm=0.1, height_mm=8.0, defect=Defect(0.12, 40.0, 4.0))
        mesh, nominal = write_stl(phantom, folder / "part.stl"), write_nominal(phantom, folder / "nominal.csv")
        heights = [phantom.machine_height_mm(height) for height in (2.0, 4.0, 6.0)]
        for checkout in (old, new):
            compare_library(checkout, curves)
            compare_files(checkout, folder / "scans", sorted(choice.airfoils.glob("*.dat")))
            compare_surface(checkout, mesh, nominal, heights, [float(value) for value in phantom.normal])
            replay_runs(checkout, records)
        different = sorted(key for key in old.found.keys() | new.found.keys() if old.found.get(key) != new.found.get(key))
        for key in different:
            sys.stdout.write(f"DIFFERENT {key}\n  old {str(old.found.get(key))[:800]}\n  new {str(new.found.get(key))[:800]}\n")
        sys.stdout.write(f"{len(old.found)} results compared, {len(different)} differ\n")
        raise SystemExit(bool(different))


if __name__ == "__main__":
    main()
