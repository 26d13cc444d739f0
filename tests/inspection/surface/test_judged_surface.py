"""Whole surfaces judged: the verdict, its reasons, defects and what was not measured, against what is known of made-up parts."""

import numpy as np
import pytest
from numpy.typing import NDArray

from inspection import ToleranceZone, Verdict
from inspection.surface import NominalSurface, RigidMotion, SurfaceResult, SurfaceTerms, TriangleSurface, judge_surface
from tests.inspection.surface import meshes

Array = NDArray[np.float64]
NOTCHED = TriangleSurface(10 * meshes.prism(meshes.NOTCHED, 2.0))  # 40 by 30 by 20 mm
ZONE = ToleranceZone(-0.05, 0.05, 0.01)
MOTION = RigidMotion.about((20, 10, 10), (0.02, -0.01, 0.03), (0.1, 0.05, -0.1))
NEAR = SurfaceTerms(ZONE, start=RigidMotion.identity(), gap_max_mm=4.0)


def scan(surface: NominalSurface, count: int, seed: int = 0, noise_mm: float = 0.004) -> tuple[Array, Array, Array]:
    """Places of a surface, the normals there, and points measured there, in the coordinates of the nominal."""
    places, normals = surface.sample(count)
    return places, normals, places + np.random.default_rng(seed).normal(0, noise_mm, len(places))[:, None] * normals


def kinds(result: SurfaceResult) -> list[str]:
    return [reason.kind for reason in result.reasons]


def test_a_good_part_conforms_and_one_with_a_dent_does_not() -> None:
    places, normals, points = scan(NOTCHED, 8000)
    good = judge_surface(MOTION.inverse().apply(points), NOTCHED, NEAR)
    assert (good.verdict, good.reasons, good.regions, good.unmeasured) == (Verdict.CONFORM, (), (), ())
    assert (good.coverage, good.rule, good.judged) == (1.0, "best-fit", len(points))
    assert good.gap_mm <= good.gap_max_mm
    dent = (np.linalg.norm(places - (20, 5, 20), axis=1) < 1.5) & (normals[:, 2] > 0.9)
    bad = judge_surface(MOTION.inverse().apply(points - 0.3 * dent[:, None] * normals), NOTCHED, NEAR)
    assert bad.verdict is Verdict.NONCONFORM
    assert kinds(bad)[0] == "out-of-tolerance"
    (region,) = bad.regions
    assert region.points == bad.out_of_tolerance == np.count_nonzero(dent)
    assert region.area_mm2 == pytest.approx(np.pi * 1.5**2, rel=0.2)
    assert region.worst_mm == pytest.approx(-0.3, abs=0.03)
    assert region.centre_mm == pytest.approx((20, 5, 20), abs=0.5)
