"""Scans of made-up parts, and the terms on which tests judge them."""

import numpy as np
from numpy.typing import NDArray

from inspection import ToleranceZone
from inspection.surface import NominalSurface, RigidMotion, SurfaceResult, SurfaceTerms, TriangleSurface
from tests.inspection.surface import meshes

Array = NDArray[np.float64]

NOTCHED = TriangleSurface(10 * meshes.prism(meshes.NOTCHED, 2.0))  # 40 by 30 by 20 mm
ZONE = ToleranceZone(-0.05, 0.05, 0.01)
MOTION = RigidMotion.about((20, 10, 10), (0.02, -0.01, 0.03), (0.1, 0.05, -0.1))
NEAR = SurfaceTerms(ZONE, start=RigidMotion.identity(), gap_max_mm=4.0)
WHERE_IT_IS = SurfaceTerms(ZONE, fit="none", gap_max_mm=4.0)


def scan(surface: NominalSurface, count: int, seed: int = 0, noise_mm: float = 0.004) -> tuple[Array, Array, Array]:
    """Places of a surface, the normals there, and points measured there, in the coordinates of the nominal."""
    places, normals = surface.sample(count)
    return places, normals, places + np.random.default_rng(seed).normal(0, noise_mm, len(places))[:, None] * normals


def kinds(result: SurfaceResult) -> list[str]:
    """The kinds of its reasons."""
    return [reason.kind for reason in result.reasons]
