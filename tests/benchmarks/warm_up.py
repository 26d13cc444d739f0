"""Compiles the inspection before a benchmark measures it, or before tests that have a time limit. `python -m tests.benchmarks.warm_up`"""

from typing import get_args

from inspection import Outline, RigidTransform, discretize, find_airfoil, register_fine, rehearse
from inspection.methods import Method
from inspection.surface import CloudSurface, PatchSurface, RigidMotion, TriangleSurface, register_surface
from tests.inspection import profiles
from tests.inspection.surface import faces, meshes


def compile_kernels() -> None:
    """Compile the projections, the registration by every method, what characteristics ask and surfaces, or load them from the cache."""
    nominal = discretize(profiles.p3(), samples=400)
    for method in get_args(Method):
        rehearse(nominal, method, reject_outliers=True)
        register_fine(nominal.points_mm, nominal, RigidTransform.identity(), method=method)
    assert len(Outline(find_airfoil(nominal)).camber.points_mm)
    patches = PatchSurface(faces.box())
    for surface in (patches, TriangleSurface(meshes.sphere(8)), CloudSurface(*patches.sample(2000))):
        register_surface(surface.sample(200)[0], surface, RigidMotion.identity())


if __name__ == "__main__":
    compile_kernels()
