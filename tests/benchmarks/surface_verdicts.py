"""How long the verdict on a million points of a surface takes, and that a small defect among them is found.

    python -m tests.benchmarks.surface_verdicts [--points N]

A twisted blade of splines and one of triangles, scanned with 3 um of noise and 10 um of form from one degree and one millimetre off: once
as it should be, once with a place of 2 mm2 that stands 0.3 mm out. Times are of the clock and of the processor, all threads together; the
machine's load stands beside them, for a busy machine is slower.
"""

import argparse
import time

import numpy as np
from numpy.typing import NDArray

from inspection import ToleranceZone
from inspection.surface import NominalSurface, PatchSurface, RigidMotion, SurfaceTerms, TriangleSurface, judge_surface
from tests.benchmarks.machine import load, machine
from tests.benchmarks.surface_benchmark import mesh_of
from tests.inspection.surface import faces

Array = NDArray[np.float64]

_AREA_MM2, _OUT_MM = 2.0, 0.3
_MOTION = RigidMotion.about((0, 0, 70), np.radians((0.6, -0.5, 0.6)), (0.5, -0.6, 0.6))
_TERMS = SurfaceTerms(ToleranceZone(-0.05, 0.05, 0.01), start=RigidMotion.identity(), edge_allowance_mm=0.3)


def scans(surface: NominalSurface, count: int) -> tuple[tuple[str, Array], tuple[str, Array]]:
    """The points of a good part and of one with a defect, off the nominal, in an order of chance."""
    places, normals = surface.sample(count)
    rng = np.random.default_rng(1)
    form = 0.01 * np.sin(places[:, 2] / 20) + rng.normal(0, 0.003, len(places))
    at = len(places) // 3
    is_out = (np.linalg.norm(places - places[at], axis=1) < np.sqrt(_AREA_MM2 / np.pi)) & (normals @ normals[at] > 0.5)
    order = rng.permutation(len(places))
    made = (("good", form), ("defect", form + _OUT_MM * is_out))
    good, bad = ((name, _MOTION.inverse().apply(places + off[:, None] * normals)[order]) for name, off in made)
    return good, bad


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--points", type=int, default=1_000_000)
    count = parser.parse_args().points
    face = faces.blade(60, 8)
    print(machine("numpy", "scipy", "numba"))
    print(f"{count:,} points. {load()}")
    for kind, surface in (("splines", PatchSurface([face])), ("100,000 triangles", TriangleSurface(mesh_of(face, 100_000)))):
        surface.project(surface.sample(5000)[0])  # the first use compiles
        for name, points in scans(surface, count):
            clock, processor = time.perf_counter(), time.process_time()
            found = judge_surface(points, surface, _TERMS)
            clock, processor = time.perf_counter() - clock, time.process_time() - processor
            steps = found.registration.steps if found.registration is not None else 0
            print(f"{kind}, {name}: {found.verdict.word}, {clock:.1f} s ({processor:.1f} s of the processor), {steps} steps")
            print(f"    covered {found.coverage:.1%}, widest place without points {found.gap_mm:.2f} mm")
            for reason in found.reasons:
                print(f"    {reason.words}")
            for region in found.regions[:3]:
                at = ", ".join(f"{value:.2f}" for value in region.centre_mm)
                print(f"    {region.points} points on {region.area_mm2:.2f} mm2 at ({at}), worst {region.worst_mm:+.3f} mm")


if __name__ == "__main__":
    main()
