"""How fast and how exact the closest point of a surface is, next to other ways to measure points against faces and meshes.

    python -m tests.benchmarks.surface_benchmark [--points N] [--rounds N] [--million] [--signs N]

One process and one thread, processor time. The ways are timed in turn, round after round, and the median counts, so that a busy machine
slows all of them alike: compare figures of one table only. Points lie beside a twisted blade, in the order of a scan, up to 1 mm off on
either side. The error of a way is against our splines for faces, and against our triangles for meshes; that those are right is proven by
tests, and a distance that is farther cannot be the least. Signs are held against the winding number. Rivals that are not installed are
left out, each with a line that says why: pip install 'cmmlink[bench,open3d]'.
"""

import argparse
import importlib.metadata
import time

import numpy as np
from numpy.typing import NDArray

from inspection.surface import PatchSurface, RigidMotion, SplineFace, TriangleSurface, register_surface
from tests.benchmarks.machine import load, machine
from tests.benchmarks.surface_rivals import LeftOut, Way, ways_on_face, ways_on_mesh
from tests.benchmarks.surface_signs import wrong_signs
from tests.inspection.surface import faces
from tests.inspection.surface.meshes import triangles_of_grid

Array = NDArray[np.float64]
_READ = 2_000  # points of a way whose answer is read one by one
_APART_MM = 2e-5  # single precision tells a part of 150 mm to 8e-6


def mesh_of(face: SplineFace, count: int) -> Array:
    """About `count` triangles with their corners on a face."""
    along_v = max(2, int(np.sqrt(count / 2 * 1.2)))
    u, v = np.linspace(0, 1, count // (2 * along_v) + 1), np.linspace(0, 1, along_v + 1)
    return triangles_of_grid(face.on_grid(u, v, 0)[0, 0])[:, ::-1]


def ours(kind: str, surface: PatchSurface | TriangleSurface) -> Way:
    return Way(f"cmmlink, {kind}", lambda points: surface.project(points, threads=1).distance_mm)


def given(way: Way, points: Array, most: int) -> Array:
    """So many points as a way is given, spread over all of them in their order."""
    return points[:: max(1, -(-len(points) // min(way.most, most)))]


def table(title: str, ways: list[Way], left: list[LeftOut], points: Array, rounds: int) -> None:
    """Print the median of each way, and how far its distances lie from those of the first; then what was left out."""
    spent: dict[str, list[float]] = {way.name: [] for way in ways}
    apart = {way.name: _apart(way, ways[0], given(way, points, _READ if way.is_one_by_one else len(points))) for way in ways}
    for _ in range(rounds):
        for way in ways:
            few = given(way, points, len(points))
            begin = time.process_time()
            way.ask(few)
            spent[way.name].append((time.process_time() - begin) / len(few))
    print(f"\n### {title}\n\n| | ns a point | times ours | largest difference of distances, mm | farther, nearer | sign |")
    print("|---|---|---|---|---|---|")
    own = float(np.median(spent[ways[0].name]))
    for way in ways:
        each = float(np.median(spent[way.name]))
        print(f"| {way.name} | {each * 1e9:,.0f} | {each / own:.1f} | {apart[way.name]} | {'yes' if way.is_signed else 'no'} |")
    for way in ways:
        if way.is_one_by_one:
            print(f"\n{way.name}: to find them; its answers are read one by one, which takes longer and is not counted.")
    for one in left:
        print(f"\n{one.words}")


def _apart(way: Way, first: Way, points: Array) -> str:
    """The largest difference of distances, and of how many points a way finds one farther or nearer; what takes part is warm afterwards."""
    more = np.abs(way.distances(points)) - np.abs(first.distances(points))
    return f"{np.nanmax(np.abs(more)):.2g} | {(more > _APART_MM).sum():,}, {(more < -_APART_MM).sum():,} of {len(points):,}"


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
    parser.add_argument("--points", type=int, default=100_000)
    parser.add_argument("--rounds", type=int, default=7)
    parser.add_argument("--million", action="store_true", help="a mesh of a million triangles as well")
    parser.add_argument("--signs", type=int, default=100_000, metavar="N", help="points of which the signs are checked")
    asked = parser.parse_args()
    face = faces.blade(95, 10)
    begin = time.process_time()
    surface = PatchSurface([face])
    built = time.process_time() - begin
    places, normals = surface.sample(asked.points)
    off = np.random.default_rng(1).uniform(-1, 1, len(places))
    points = places + off[:, None] * normals
    brought_by = importlib.metadata.packages_distributions().get("open3d", ["open3d"])  # it has another name without a graphics processor
    print(machine("numba", "cadquery-ocp-novtk", brought_by[0], "libigl", "fcpw", "engeom", "trimesh", "rtree"))
    print(load())
    rivals, left = ways_on_face(face)
    title = f"A spline blade, {len(points):,} points; built in {built:.1f} s"
    table(title, [ours("splines", surface), *rivals], left, points, asked.rounds)
    for count in (100_000, 1_000_000) if asked.million else (100_000,):
        on_mesh(mesh_of(face, count), points, asked.rounds)
    registration(surface, places)
    print("\n### Wrong signs\n")
    for line in wrong_signs(face, asked.signs):
        print(line)


def on_mesh(triangles: Array, points: Array, rounds: int) -> None:
    begin = time.process_time()
    mesh = TriangleSurface(triangles)
    built = time.process_time() - begin
    held = sum(values.nbytes for values in mesh._tables if isinstance(values, np.ndarray)) / 1e6
    rivals, left = ways_on_mesh(triangles)
    title = f"A mesh of {len(mesh):,} triangles; built in {built:.1f} s, held in {held:.0f} MB"
    table(title, [ours("triangles", mesh), *rivals], left, points, rounds)


if __name__ == "__main__":
    main()
