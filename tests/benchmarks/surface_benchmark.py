"""How fast and how exact the closest point of a surface is, next to other ways to measure points against faces and meshes.

    python -m tests.benchmarks.surface_benchmark [--points N] [--rounds N] [--million]

One process and one thread, processor time. The ways are timed in turn, round after round, and the median counts, so that a busy machine
slows all of them alike: compare figures of one table only. Points lie beside a twisted blade, in the order of a scan, up to 1 mm off on
either side. The error of a way is against our splines for faces, and against our triangles for meshes; that those are right is proven by
tests. Rivals that are not installed are left out: pip install 'cmmlink[bench]'.
"""

import argparse
import importlib
import importlib.metadata
import importlib.util
import time
from collections.abc import Callable, Iterator

import numpy as np
from numpy.typing import NDArray

from inspection.surface import PatchSurface, RigidMotion, SplineFace, TriangleSurface, register_surface
from tests.benchmarks.machine import machine
from tests.inspection.surface import faces
from tests.inspection.surface.meshes import triangles_of_grid

Array = NDArray[np.float64]
Distances = Callable[[Array], Array]
_FEW = 200  # points of a way that takes milliseconds for each


def mesh_of(face: SplineFace, count: int) -> Array:
    """About `count` triangles with their corners on a face."""
    along_v = max(2, int(np.sqrt(count / 2 * 1.2)))
    u, v = np.linspace(0, 1, count // (2 * along_v) + 1), np.linspace(0, 1, along_v + 1)
    return triangles_of_grid(face.on_grid(u, v, 0)[0, 0])[:, ::-1]


def on_faces(face: SplineFace, ours: PatchSurface) -> Iterator[tuple[str, Distances, int]]:
    yield "cmmlink, splines", lambda points: ours.project(points, threads=1).distance_mm, 10**9
    if importlib.util.find_spec("OCP") is None:
        return
    peer = importlib.import_module("tests.inspection.surface.occt_surfaces")
    weights = np.ones(face.control_points_mm.shape[:2])
    surface = peer.surface_of(
        {
            "degree": np.array(face.degree),
            "knots_u": face.knots_u,
            "knots_v": face.knots_v,
            "control_points": face.control_points_mm,
            "weights": weights,
        }
    )
    inside = peer.GeomAPI_ProjectPointOnSurf()
    inside.Init(surface, *surface.Bounds(), peer.Extrema_ExtAlgo.Extrema_ExtAlgo_Tree)

    def by_tree(points: Array) -> Array:
        result = np.empty(len(points))
        for i, point in enumerate(points):
            inside.Perform(peer.gp_Pnt(*point.tolist()))
            result[i] = inside.LowerDistance() if inside.NbPoints() else np.nan
        return result

    yield "Open CASCADE, one object kept, tree", by_tree, _FEW


def on_meshes(triangles: Array, ours: TriangleSurface) -> Iterator[tuple[str, Distances, int]]:
    yield "cmmlink, triangles", lambda points: ours.project(points, threads=1).distance_mm, 10**9
    if importlib.util.find_spec("open3d") is not None:
        o3d = importlib.import_module("open3d")
        scene = o3d.t.geometry.RaycastingScene(nthreads=1)
        scene.add_triangles(triangles.reshape(-1, 3).astype(np.float32), np.arange(3 * len(triangles), dtype=np.uint32).reshape(-1, 3))
        yield "Open3D, float32, no sign", lambda points: scene.compute_distance(points.astype(np.float32), nthreads=1).numpy(), 10**9
    if importlib.util.find_spec("igl") is not None:
        igl = importlib.import_module("igl")
        corners, numbers = triangles.reshape(-1, 3), np.arange(3 * len(triangles)).reshape(-1, 3)
        yield "libigl, no sign", lambda points: np.sqrt(igl.point_mesh_squared_distance(points, corners, numbers)[0]), 10**9
    if importlib.util.find_spec("engeom") is not None:
        made = importlib.import_module("engeom.geom3").Mesh3(
            triangles.reshape(-1, 3), np.arange(3 * len(triangles), dtype=np.uint32).reshape(-1, 3), merge_duplicates=True
        )
        yield "engeom", lambda points: made.measure_deviations(points, "point"), 10**9
    if importlib.util.find_spec("trimesh") is not None and importlib.util.find_spec("rtree") is not None:
        trimesh = importlib.import_module("trimesh")
        mesh = trimesh.Trimesh(triangles.reshape(-1, 3), np.arange(3 * len(triangles)).reshape(-1, 3))
        yield "trimesh, no sign", lambda points: trimesh.proximity.closest_point(mesh, points)[1], 5_000


def table(title: str, ways: list[tuple[str, Distances, int]], points: Array, rounds: int) -> None:
    """Print the median of each way, and how far its distances lie from those of the first."""
    spent: dict[str, list[float]] = {name: [] for name, _, _ in ways}
    found = {name: way(points[:most]) for name, way, most in ways}  # compiles and fills the caches
    for _ in range(rounds):
        for name, way, most in ways:
            begin = time.process_time()
            way(points[:most])
            spent[name].append((time.process_time() - begin) / len(points[:most]))
    print(f"\n### {title}\n\n| | ns a point | times ours | largest difference of distances, mm |\n|---|---|---|---|")
    first = ways[0][0]
    own = float(np.median(spent[first]))
    for name, each in spent.items():
        apart = np.nanmax(np.abs(np.abs(found[name]) - np.abs(found[first][: len(found[name])])))
        print(f"| {name} | {np.median(each) * 1e9:,.0f} | {np.median(each) / own:.1f} | {apart:.2g} |")


def registration(surface: PatchSurface, points: Array) -> None:
    motion = RigidMotion.about((0, 0, 70), np.radians([0.6, -0.5, 0.6]), (0.5, -0.6, 0.6))
    begin = time.process_time()
    found = register_surface(motion.inverse().apply(points), surface, RigidMotion.identity())
    spent = time.process_time() - begin
    far = np.abs(found.nominal_from_scan.apply(points) - motion.apply(points)).max()
    print(f"\nRegistration from 1 degree and 1 mm, {len(points):,} points: {found.steps} steps, {spent:.2f} s, {far:.1g} mm off, ")
    print(f"weakest {found.weakest.words}: {found.weakest.mm_per_mm:.0f} mm for 1 mm rms of deviation.")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--points", type=int, default=50_000)
    parser.add_argument("--rounds", type=int, default=7)
    parser.add_argument("--million", action="store_true", help="a mesh of a million triangles as well")
    asked = parser.parse_args()
    face = faces.blade(95, 10)
    begin = time.process_time()
    surface = PatchSurface([face])
    built = time.process_time() - begin
    places, normals = surface.sample(asked.points)
    off = np.random.default_rng(1).uniform(-1, 1, len(places))
    points = places + off[:, None] * normals
    brought_by = importlib.metadata.packages_distributions().get("open3d", ["open3d"])  # it has another name without a graphics processor
    print(machine("numba", "cadquery-ocp-novtk", brought_by[0], "libigl", "trimesh", "rtree", "engeom"))
    table(f"A spline blade, {len(points):,} points; built in {built:.1f} s", list(on_faces(face, surface)), points, asked.rounds)
    for count in (100_000, 1_000_000) if asked.million else (100_000,):
        triangles = mesh_of(face, count)
        begin = time.process_time()
        mesh = TriangleSurface(triangles)
        built = time.process_time() - begin
        held = sum(values.nbytes for values in mesh._tables if isinstance(values, np.ndarray)) / 1e6
        table(
            f"A mesh of {len(mesh):,} triangles; built in {built:.1f} s, held in {held:.0f} MB",
            list(on_meshes(triangles, mesh)),
            points,
            asked.rounds,
        )
    registration(surface, places)


if __name__ == "__main__":
    main()
