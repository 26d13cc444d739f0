"""How surely the pose of a scan is found without a start, and whether the stated error of a cloud covers its own.

    python -m tests.benchmarks.surface_poses [--poses N]

Scans in random poses with noise of 5 um: whole ones of a blade and a mould; of 60 and 30 % of the blade's span, all round and from one
side; of a quarter of the mould. A pose is found where no point lies farther from its true place than 0.05 mm, or than twice what the
registration states for its weakest direction (95 %). Otherwise it may be refused, or `said`: the registration itself knows other poses that
fit as well, or a direction along which the part slides. What is left is wrong without a word, and has to be none.
"""

import argparse
import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from inspection import RegistrationError, Rejection
from inspection.surface import CloudSurface, PatchSurface, RigidMotion, SurfaceRegistration, register_surface, rejections
from tests.benchmarks.machine import machine
from tests.inspection.surface import faces

Array = NDArray[np.float64]
_NOISE_MM = 0.005
_POINTS = 6000
_NEAR_MM = 0.05
_RING_MM, _TUBE_MM = 40.0, 12.0


@dataclass(frozen=True, slots=True)
class Case:
    """A part, and which of its places (n, 3) with their normals are scanned."""

    name: str
    surface: PatchSurface
    is_seen: Callable[[Array, Array, np.random.Generator], NDArray[np.bool_]]


def span(share: float, one_side: bool = False) -> Callable[[Array, Array, np.random.Generator], NDArray[np.bool_]]:
    """A share of the height, somewhere, seen from all sides or from one."""

    def is_seen(places: Array, normals: Array, rng: np.random.Generator) -> NDArray[np.bool_]:
        low, height = places[:, 2].min(), np.ptp(places[:, 2])
        begin = low + (1 - share) * height * rng.uniform()
        inside = (places[:, 2] >= begin) & (places[:, 2] <= begin + share * height)
        return np.asarray(inside & (normals[:, 1] > 0.3) if one_side else inside)

    return is_seen


def quarter(places: Array, normals: Array, rng: np.random.Generator) -> NDArray[np.bool_]:
    """What lies beyond a place near the middle in x and in y, on sides chosen by lot."""
    del normals
    off = (places[:, :2] - places[:, :2].mean(axis=0)) * rng.choice([-1.0, 1.0], 2)
    return np.asarray((off > rng.uniform(-6, 6, 2)).all(axis=1))


def row(case: Case, poses: int) -> str:
    """A row of the table of poses."""
    rng = np.random.default_rng(1)
    counts = dict.fromkeys(("found", "said", "refused", "wrong"), 0)
    worst, weakest, spent = 0.0, 0.0, []
    places, normals = case.surface.sample(_POINTS)
    for _ in range(poses):
        seen = case.is_seen(places, normals, rng)
        points = places[seen] + rng.normal(0, _NOISE_MM, (np.count_nonzero(seen), 1)) * normals[seen]
        motion = RigidMotion.about(rng.normal(0, 30, 3), rng.normal(size=3) * 2, rng.uniform(-200, 200, 3))
        scan = motion.inverse().apply(points)
        begin = time.process_time()
        try:
            found = register_surface(scan, case.surface)
        except RegistrationError:
            counts["refused"] += 1
            continue
        spent.append(time.process_time() - begin)
        far = float(np.abs(found.nominal_from_scan.apply(scan) - points).max())
        good = far <= max(_NEAR_MM, 2 * found.weakest.shift_95_mm)
        counts["found" if good else "said" if tells(found) else "wrong"] += 1
        weakest = max(weakest, found.weakest.mm_per_mm)
        worst = max(worst, far) if good else worst
    told = " | ".join(str(value) for value in counts.values())
    return f"| {case.name} | {told} | {worst:.3f} | {weakest:.0f} | {np.median(spent):.2f} |"


def tells(found: SurfaceRegistration) -> bool:
    """Whether a registration itself says that its pose is not the only one."""
    return bool(found.rivals or found.weakest.slides)


def coverage_row(noise_mm: float, spacing_mm: float) -> str:
    """A row of the table of clouds: samples by chance on a sixth of a ring, and how many feet the stated error covers."""
    rng = np.random.default_rng(8)

    def places(count: int, off: Array) -> Array:
        along, about = rng.uniform(0, np.pi / 3, count), rng.uniform(0, 2 * np.pi, count)
        outward = np.column_stack([np.cos(about) * np.cos(along), np.cos(about) * np.sin(along), np.sin(about)])
        middle = _RING_MM * np.column_stack([np.cos(along), np.sin(along), np.zeros(count)])
        return np.concatenate([middle + (_TUBE_MM + off)[:, None] * outward, outward], axis=1)

    count = int(4 * np.pi**2 * _RING_MM * _TUBE_MM / 6 / spacing_mm**2)
    sampled = places(count, rng.normal(0, noise_mm, count))
    cloud = CloudSurface(sampled[:, :3], sampled[:, 3:])
    off = rng.uniform(-0.5, 0.5, 20_000)
    feet = cloud.project(places(len(off), off)[:, :3])
    judged = rejections(feet, 5.0) == Rejection.NONE
    error = np.abs(feet.distance_mm - off)[judged]
    covered = float((error <= feet.error_mm[judged]).mean())
    median, most, stated = np.median(error) * 1e3, error.max() * 1e3, cloud.nominal_error_mm * 1e3
    return f"| {spacing_mm} | {noise_mm * 1e3:g} | {median:.2f} | {most:.1f} | {stated:.2f} | {covered:.1%} | {judged.mean():.1%} |"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--poses", type=int, default=100)
    asked = parser.parse_args()
    print(machine("numba"))
    print("\n### Clouds\n")
    print("| spacing mm | noise um | median error um | largest | stated (95 %) | covered | judged |")
    print("|---|---|---|---|---|---|---|")
    for noise_mm in (0.0, 0.005, 0.02):
        for spacing_mm in (0.8, 1.6, 3.0):
            print(coverage_row(noise_mm, spacing_mm), flush=True)
    blade, mould = PatchSurface([faces.blade(95, 10)]), PatchSurface([faces.mould()])
    print(f"\n### {asked.poses} random poses each\n")
    print("| scan | found | said | refused | wrong | farthest off where found, mm | mm a mm rms at the weakest | s a pose |")
    print("|---|---|---|---|---|---|---|---|")
    for case in (
        Case("blade, whole", blade, span(1.0)),
        Case("mould, whole", mould, span(1.0)),
        Case("blade, 60 % of the span, all round", blade, span(0.6)),
        Case("blade, 30 % of the span, all round", blade, span(0.3)),
        Case("blade, 60 % of the span, one side", blade, span(0.6, one_side=True)),
        Case("blade, 30 % of the span, one side", blade, span(0.3, one_side=True)),
        Case("mould, a quarter", mould, quarter),
    ):
        print(row(case, asked.poses), flush=True)


if __name__ == "__main__":
    main()
