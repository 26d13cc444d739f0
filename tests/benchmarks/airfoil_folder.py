"""Any folder of airfoil coordinates, from the file to the minimum zone, held against the verifier's algorithms.

    python -m tests.benchmarks.airfoil_folder FOLDER [--chord MM] [--no-proof]

Of every .dat file, whatever its dialect, a part is made with form and a placement that are drawn from the file's name. The verifier
(docs/verify/verify.py: polar forms, bisection, branch and bound) derives every deviation anew, seeks the best fit by steps of its own,
and refutes every placement with a smaller zone. A file that is refused is named with its reason.
"""

import argparse
import sys
import time
import zlib
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from cmmlink.nominal_files import load_nominal, material_side
from cmmlink.zone_file import nominal_document
from docs.verify.verify import Curve, placed
from inspection import InspectionError, RigidTransform, deviations, discretize, fit_minimum_zone, register

Array = NDArray[np.float64]

_SAMPLES = 2000
_ROUNDS = 12  # of the verifier's best fit
_STEP = 1e-4  # mm, of its differences
_GAP = 1e-2  # of half the zone, by which no other placement may be better
_HALVINGS = 40


@dataclass(frozen=True, slots=True)
class Row:
    """What came of a file. Differences are the largest between both programs, in mm.

    pose_mm : how far any point lies apart at both best fits; zone_mm : of the width of the zone at its placement
    proven  : the verifier refuted every placement with a zone smaller by a hundredth; None where that was not asked, or remained open
    """

    name: str
    kind: str
    points: int
    deviation_mm: float
    pose_mm: float
    zone_mm: float
    proven: bool | None
    ours_s: float
    theirs_s: float
    refused: str = ""


def hold(path: Path, chord_mm: float = 100.0, count: int = 120, proof: bool = True) -> Row:
    """Hold one file against the verifier."""
    try:
        file = load_nominal(path, chord_mm)
        profile = discretize(file.curve, samples=_SAMPLES, step_min=1.0 / _SAMPLES, material=material_side(file.curve) or "left")
    except (InspectionError, OSError) as error:
        return Row(path.name, "", 0, np.nan, np.nan, np.nan, None, 0.0, 0.0, str(error).removeprefix(f"{path}: "))
    rng = np.random.default_rng(zlib.crc32(path.stem.encode()))
    curve = Curve(nominal_document(profile))
    actual = _part(curve, rng, count, chord_mm)
    start = time.process_time()
    found = deviations(actual, profile).deviation_mm
    motion = RigidTransform(float(rng.uniform(-3, 3)), rng.uniform(-200, 200, 2))
    section = motion.apply(actual)
    try:
        fit = register(section, profile)
        zone = fit_minimum_zone(section, profile, fit)
    except InspectionError as error:
        return Row(path.name, file.source_format, count, np.nan, np.nan, np.nan, None, 0.0, 0.0, str(error))
    ours_s, start = time.process_time() - start, time.process_time()
    off = np.abs(curve.closest(actual)[0] - found).max()
    best = _best_fit(curve, section, fit.nominal_from_section)
    apart = np.hypot(*(best - fit.nominal_from_section.apply(section)).T).max()
    half = np.abs(_distances(curve, zone.nominal_from_section.apply(section))).max()
    proven = curve.search(section, -half * (1 - _GAP), half * (1 - _GAP)) if proof else None
    theirs_s = time.process_time() - start
    kind = f"{file.source_format}, {'closed' if file.curve.closed else 'open'}"
    return Row(path.name, kind, count, float(off), float(apart), float(abs(2 * half - zone.zone_mm)), proven, ours_s, theirs_s)


def _part(curve: Curve, rng: np.random.Generator, count: int, chord_mm: float) -> Array:
    """Points (n, 2) of a part with form, on the verifier's own curve."""
    station = (np.arange(count) + 0.5) / count * curve.length
    piece = np.searchsorted(curve.start, station, side="right") - 1
    rows, share = curve.pieces[:, :, piece], (station - curve.start[piece]) / np.diff(curve.start)[piece]
    point, slope = curve.at(rows, share)
    left = np.array([-slope[1], slope[0]]) / np.hypot(*slope)
    waves = 2 * np.pi * rng.integers(2, 7) * station / curve.length + rng.uniform(0, 6)
    form = chord_mm * (2e-4 * np.sin(waves) + rng.normal(0, 2e-5, count))
    return np.asarray((point + curve.outward * form * left).T)


def _distances(curve: Curve, points: Array) -> Array:
    """Signed distances (m,) of the points that are not beyond an open end, 0 of the others."""
    distance, _, at_end = curve.closest(points, _HALVINGS)
    return np.where(at_end, 0.0, distance)


def _best_fit(curve: Curve, section: Array, start: RigidTransform) -> Array:
    """Where Gauss-Newton with differences of distances brings section points (m, 2), from a placement that is off by a little."""
    middle = section.mean(axis=0)
    arms, reach = section - middle, float(np.hypot(*(section - middle).T).max())
    pose = np.array([start.rotation_rad + 2e-3, *(start.apply(middle[None])[0] + 0.2)])
    for _ in range(_ROUNDS):
        steps = np.diag([_STEP / reach, _STEP, _STEP])
        rates = [
            (_distances(curve, placed(arms, pose + step)) - _distances(curve, placed(arms, pose - step))) / (2 * step.sum())
            for step in steps
        ]
        jacobian = np.column_stack(rates)
        pose = pose - np.linalg.lstsq(jacobian, _distances(curve, placed(arms, pose)), rcond=None)[0]
    return np.asarray(placed(arms, pose))


def table(rows: Iterable[Row]) -> str:
    """The rows as text, the largest differences last."""
    every = list(rows)
    lines = [f"{'name':24} {'kind':24} {'points':>6} {'deviation':>10} {'pose':>10} {'zone':>10}  no smaller zone   ours s  verifier s"]
    for row in every:
        if row.refused:
            lines.append(f"{row.name:24} refused: {row.refused}")
            continue
        proven = {True: "proven", False: "NOT SO", None: "open"}[row.proven]
        numbers = f"{row.deviation_mm:10.1e} {row.pose_mm:10.1e} {row.zone_mm:10.1e}  {proven:15} {row.ours_s:8.2f} {row.theirs_s:11.2f}"
        lines.append(f"{row.name:24} {row.kind:24} {row.points:6d} {numbers}")
    held = [row for row in every if not row.refused]
    if held:
        worst = [max(getattr(row, key) for row in held) for key in ("deviation_mm", "pose_mm", "zone_mm")]
        lines.append(
            f"{len(held)} held, {len(every) - len(held)} refused; largest differences {worst[0]:.1e}, {worst[1]:.1e}, {worst[2]:.1e} mm"
        )
    return "\n".join(lines)


def main() -> int:
    """Hold every .dat file of a folder and print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--chord", type=float, default=100.0, help="the chord in mm, for coordinates in chord units")
    parser.add_argument(
        "--no-proof", action="store_true", help="do not refute every placement with a smaller zone, which takes seconds a file"
    )
    asked = parser.parse_args()
    rows = []
    for path in sorted(asked.folder.glob("*.dat")):
        rows.append(hold(path, asked.chord, proof=not asked.no_proof))
        print(table(rows[-1:]).splitlines()[1], flush=True)
    print(table(rows))
    return 1 if any(row.proven is False or row.deviation_mm > 1e-9 for row in rows) else 0


if __name__ == "__main__":
    sys.exit(main())
