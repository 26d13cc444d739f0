"""The same results elsewhere: runs of every kind are recorded and exported here, and replayed as on other machines.

    python -m tests.benchmarks.elsewhere [FOLDER] [--python PATH ...]

FOLDER keeps the exported runs, so that they can be taken to another machine; there `replayed_there.py` replays them. Every setting is a
process of its own, whose libraries are told that the processor has less, or the system another language, time zone or number of
threads. `--python` replays with another Python, such as that of the lowest versions. Printed is how many runs have the recorded decision,
how many are identical to the last bit, and how far numbers lie apart. Exit status 1 where a decision is another one, or a number is.
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from cmmlink.nominal_files.nurbs_yaml import save_nurbs_yaml
from cmmlink.record.agreement import LAST_BITS
from inspection import RigidTransform, discretize
from inspection.synthetic import form_error_mm, scan
from tests.cmmlink.command import cmmlink
from tests.inspection import profiles

ROOT = Path(__file__).resolve().parents[2]
THERE = Path(__file__).with_name("replayed_there.py")
COUNT, SEED = 1200, 19
MOVED = RigidTransform(np.radians(20.0), np.array([5.0, -3.0]))

NO_VECTORS = "NPY_DISABLE_CPU_FEATURES"
SETTINGS: Mapping[str, Mapping[str, str]] = {
    "as here": {},
    "numpy without AVX2 and FMA": {NO_VECTORS: "X86_V3 X86_V4 AVX512_ICL AVX512_SPR"},
    "numpy without AVX-512": {NO_VECTORS: "X86_V4 AVX512_ICL AVX512_SPR"},
    "OpenBLAS for Nehalem": {"OPENBLAS_CORETYPE": "Nehalem"},
    "OpenBLAS for Haswell": {"OPENBLAS_CORETYPE": "Haswell"},
    "OpenBLAS for Skylake-X": {"OPENBLAS_CORETYPE": "SkylakeX"},
    "OpenBLAS for Zen": {"OPENBLAS_CORETYPE": "Zen"},
    "the C library without AVX2 and FMA": {"GLIBC_TUNABLES": "glibc.cpu.hwcaps=-FMA,-FMA4,-AVX2,-AVX512F"},
    "one thread": {"OPENBLAS_NUM_THREADS": "1", "NUMBA_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"},
    "two threads": {"OPENBLAS_NUM_THREADS": "2", "NUMBA_NUM_THREADS": "2", "OMP_NUM_THREADS": "2"},
    "German, Chatham Islands": {"LC_ALL": "de_DE.UTF-8", "TZ": "Pacific/Chatham", "PYTHONHASHSEED": "7"},
    "compiled for the plainest x86-64": {"NUMBA_CPU_NAME": "generic", "NUMBA_CPU_FEATURES": ""},
    "compiled for Haswell": {"NUMBA_CPU_NAME": "haswell", "NUMBA_CPU_FEATURES": "+avx2,+fma,+bmi2"},
    "all of the plainest": {
        NO_VECTORS: "X86_V3 X86_V4 AVX512_ICL AVX512_SPR",
        "OPENBLAS_CORETYPE": "Nehalem",
        "OPENBLAS_NUM_THREADS": "1",
        "GLIBC_TUNABLES": "glibc.cpu.hwcaps=-FMA,-FMA4,-AVX2,-AVX512F",
        "NUMBA_CPU_NAME": "generic",
        "NUMBA_CPU_FEATURES": "",
    },
}

METHODS = ("circle", "chord", "pcp", "veaw", "hermite", "inversion")
WAYS: Mapping[str, Mapping[str, Any]] = {
    "best fit": {"rule": "best-fit"},
    "minimum zone": {"registration": {"fit": "minimum-zone"}},
    "every point counts alike": {"weights": "points"},
    "without outliers": {"registration": {"reject_outliers": True}},
    "datum": {"registration": {"fit": "none", "datum": {"rotation_deg": 20.0, "translation_mm": [5.0, -3.0]}}},
    **{f"method {method}": {"registration": {"method": method}} for method in METHODS},
}


def give(folder: Path, *arguments: object) -> None:
    """Run a command that records into a folder; whatever its verdict, it has to give one."""
    ended = cmmlink(*arguments, "--records", folder / "records")
    if ended.code not in (0, 1, 3):
        raise SystemExit(f"{arguments}: {ended.err}")


def plans() -> Iterator[tuple[str, dict[str, Any]]]:
    """Plans of one scan of a blade, each with its name."""
    head: dict[str, Any] = {"part": {"name": "blade"}, "nominal": {"file": "blade.yaml"}, "device": {"type": "file", "file": "points.npy"}}
    head["discretisation"] = {"samples": 1500}
    zone = {"tolerance": {"lower_mm": -0.05, "upper_mm": 0.06, "uncertainty_mm": 0.004}}
    for name, way in WAYS.items():
        yield name, head | zone | dict(way)
    page = (ROOT / "docs" / "characteristics.md").read_text(encoding="utf-8")
    drawing = yaml.safe_load(page.split("```yaml\n")[1].split("```")[0])
    yield "twelve characteristics", drawing | head


def measure(folder: Path) -> None:
    """Record runs of every kind: a device with faults, files, characteristics, and the sections of a surface."""
    folder.mkdir(parents=True, exist_ok=True)
    curve = profiles.naca("4412", 100.0)
    nominal = discretize(curve, samples=1500)
    rng = np.random.default_rng(SEED)
    station = np.sort(rng.uniform(0.0, nominal.length_mm, COUNT))
    deviation = form_error_mm(station, nominal.length_mm, rng, 0.02) + rng.normal(0.0, 0.003, COUNT)
    save_nurbs_yaml(curve, folder / "blade.yaml")
    np.save(folder / "points.npy", scan(nominal, station, deviation, MOVED).points_mm)
    for name, plan in plans():
        file = folder / f"{name}.yaml"
        file.write_text(yaml.safe_dump(plan | {"out": None}), encoding="utf-8")
        give(folder, "run", file, "--headless")
    give(folder, "demo", "--headless", "--out", folder / "demo")
    give(folder, "demo", "--headless", "--out", folder / "demo", "--defect", "0.08@100", "--seed", 3)
    cmmlink("example", folder / "example")
    for name in ("file-plan", "characteristics-plan"):
        give(folder, "run", folder / "example" / f"{name}.yaml", "--headless")
    give(folder, "ct", folder / "example" / "ct-plan.yaml")


def export(folder: Path) -> int:
    """Export every run that was recorded; gives how many there are."""
    runs = [run["run"] for run in cmmlink("runs", "--json", "--records", folder / "records").json()["runs"]]
    for run in runs:
        give(folder, "export", run, "--out", folder / "evidence" / run)
    return len(runs)


def replayed(folder: Path, python: str, setting: Mapping[str, str]) -> tuple[str, list[str]]:
    """How runs came out in a process with a setting, and what was not the same, in words."""
    environment = os.environ | {"PYTHONPATH": str(ROOT)} | dict(setting)
    command = [python, str(THERE), str(folder / "evidence")]
    ended = subprocess.run(command, capture_output=True, text=True, check=False, env=environment, cwd=folder)
    if ended.returncode:
        return "", [ended.stderr.strip().splitlines()[-1]]
    rows = [json.loads(line) for line in ended.stdout.splitlines()]
    apart = max(row["apart"] for row in rows)
    wrong = [f"{row['run']}: {', '.join(row['differs'][:3])}" for row in rows if not row["same_decision"] or row["apart"] > LAST_BITS]
    return f"{sum(row['same_decision'] for row in rows):8} {sum(row['identical'] for row in rows):9} {apart:10.1e}", wrong


def main() -> int:
    """Print a line for every setting. Returns 1 where a bit is not the same."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", nargs="?", type=Path)
    parser.add_argument("--python", nargs="*", default=[], help="Python programs with the libraries that cmmlink needs")
    asked = parser.parse_args()
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as own:
        folder = (asked.folder or Path(own)).resolve()
        if not (folder / "evidence").is_dir():
            measure(folder)
            sys.stdout.write(f"{export(folder)} runs were recorded, exported and are replayed:\n")
        settings = [(name, sys.executable, setting) for name, setting in SETTINGS.items()]
        settings += [(python, python, {}) for python in asked.python]
        failed = 0
        sys.stdout.write(f"{'setting':38} decision identical numbers apart\n")
        for name, python, setting in settings:
            found, told = replayed(folder, python, setting)
            failed += bool(told)
            sys.stdout.write(f"{name:38} {found}" + "".join(f"\n    NOT THE SAME {line}" for line in told) + "\n")
            sys.stdout.flush()
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
