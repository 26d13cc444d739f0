"""How fast and how exact the closest point is, next to other ways to measure a point against a profile.

    python -m tests.benchmarks.projection_benchmark [--quick] [--rivals] [--millions]

Every table is one process: the ways are timed in turn, round after round, and the median round counts, so that a busy
machine slows all of them alike. Points lie evenly in the parameter, at random up to 1 mm off the curve, in order or
shuffled. Errors are of the distance, against the oracle of the tests, which shares no code with the kernels.
Rivals that are not installed are left out: pip install 'cmmlink[bench]'. With --rivals and --millions the tables are written to
tests/benchmarks/projection.md.
"""

import argparse
import importlib
import importlib.util
import time
from collections.abc import Callable, Iterator
from functools import partial
from itertools import chain
from pathlib import Path

import numpy as np
from scipy.spatial import cKDTree

from inspection import NurbsCurve
from inspection.foot_grid import FootGrid, build_foot_grid
from inspection.kernels import project, project_on_samples
from inspection.nominal import NominalProfile, discretize
from tests.benchmarks.machine import machine
from tests.benchmarks.warm_up import compile_kernels
from tests.inspection import profiles
from tests.inspection import projections_reference as reference
from tests.inspection.oracle import closest_point
from tests.inspection.profiles import Array

RESULT = Path(__file__).with_name("projection.md")
Distances = Callable[[Array], Array]
PROFILES: dict[str, Callable[[], NurbsCurve]] = {
    "P1": profiles.p1,
    "P2": profiles.p2,
    "P3": profiles.p3,
    "NACA 4412": lambda: profiles.naca("4412", sharp=False),
}
SAMPLES = 10_000


def measured_points(curve: NurbsCurve, count: int, rng: np.random.Generator, shuffled: bool) -> Array:
    u = np.sort(rng.uniform(*curve.domain, count))
    points = profiles.offset_points(curve, u, rng.uniform(-1.0, 1.0, count))
    return points[rng.permutation(count)] if shuffled else points


def point_inversion(tree: cKDTree, nominal: NominalProfile) -> Distances:
    """The published method's comparison, no more than it needs: nearest sample by KD-tree, three Newton steps in numpy."""
    curve = nominal.curve
    start, end = curve.domain

    def distances(points: Array) -> Array:
        u = nominal.parameter[tree.query(points)[1]]
        for _ in range(3):
            c, c1, c2 = curve.derivatives(u, 2)
            v = c - points
            u = u - (c1 * v).sum(axis=1) / ((c1 * c1).sum(axis=1) + (c2 * v).sum(axis=1))
            u = start + np.mod(u - start, end - start) if curve.closed else np.clip(u, start, end)
        return np.asarray(np.hypot(*(curve.point(u) - points).T))

    return distances


def rounds_ns(ways: dict[str, Callable[[Array], object]], points: Array, rounds: int) -> dict[str, float]:
    """Median time per point of each way, taken in turn."""
    taken: dict[str, list[float]] = {name: [] for name in ways}
    for _ in range(rounds):
        for name, way in ways.items():
            begin = time.perf_counter_ns()
            way(points)
            taken[name].append((time.perf_counter_ns() - begin) / len(points))
    return {name: float(np.median(times)) for name, times in taken.items()}


def errors_mm(way: Distances, points: Array, truth: Array) -> str:
    """Largest and mean error of the distance, against the true ones of some of the points."""
    error = np.abs(way(_some(points)) - truth)
    return f"{error.max():.0e} / {error.mean():.0e}"


def true_distances(points: Array, curve: NurbsCurve) -> Array:
    return np.abs(closest_point(curve, _some(points)).left_mm)


def _some(points: Array) -> Array:
    return points[:: max(1, len(points) // 1000)]


def exact_way(grid: FootGrid, threads: int | None) -> Distances:
    return lambda points: np.abs(project(points, grid, threads).distance_mm)


def main_table(sizes: list[int], rounds: int) -> Iterator[str]:
    yield "| profile | points | order | exact ns | two threads | gain | KD-tree ns | ratio | inversion ns | ratio | max / mean error mm |"
    yield "|---|---|---|---|---|---|---|---|---|---|---|"
    for name, make in PROFILES.items():
        curve = make()
        nominal = discretize(curve, samples=SAMPLES, step_min=1 / SAMPLES)
        grid = nominal.grid
        inversion = point_inversion(nominal.tree, nominal)
        for count in sizes:
            for shuffled in (False, True):
                points = measured_points(curve, count, np.random.default_rng(count), shuffled)
                ways: dict[str, Callable[[Array], object]] = {
                    "exact": partial(project, grid=grid, threads=1),
                    "two": partial(project, grid=grid, threads=2),
                    "tree": nominal.tree.query,
                    "inversion": inversion,
                }
                ns = rounds_ns(ways, points, rounds)
                errors = errors_mm(exact_way(grid, 1), points, true_distances(points, curve))
                yield (
                    f"| {name} | {count:,} | {'shuffled' if shuffled else 'ordered'} | {ns['exact']:.1f} | {ns['two']:.1f} "
                    f"| {ns['exact'] / ns['two']:.2f} | {ns['tree']:.0f} | **{ns['tree'] / ns['exact']:.1f}** | {ns['inversion']:.0f} "
                    f"| **{ns['inversion'] / ns['exact']:.0f}** | {errors} |"
                )


def growth_in_points(millions: bool) -> Iterator[str]:
    """Cost per point as the batch grows; the results' memory is new in every call."""
    curve = profiles.p3()
    grid = build_foot_grid(curve)
    counts = [1_000, 10_000, 100_000, 1_000_000] + ([10_000_000] if millions else [])
    yield "| points | exact, one thread, ns a point | all cores |"
    yield "|---|---|---|"
    for count in counts:
        points = measured_points(curve, count, np.random.default_rng(1), False)
        ns = rounds_ns(
            {"one": partial(project, grid=grid, threads=1), "all": partial(project, grid=grid)}, points, 5 if count > 2e6 else 15
        )
        yield f"| {count:,} | {ns['one']:.1f} | {ns['all']:.1f} |"


def growth_in_samples(rounds: int) -> Iterator[str]:
    """Cost against the number of samples n of the nominal; the exact method does not look at samples."""
    curve = profiles.p3()
    points = measured_points(curve, 100_000, np.random.default_rng(2), False)
    start, end = curve.domain
    counts = (1_000, 10_000, 100_000)
    trees = {n: cKDTree(curve.point(start + (end - start) * np.arange(n) / n)) for n in counts}
    begin = time.perf_counter()
    grid = build_foot_grid(curve)
    built = 1e3 * (time.perf_counter() - begin)
    yield f"The grid of P3 was built in {built:.0f} ms."
    yield ""
    yield "| samples | exact ns | KD-tree ns |"
    yield "|---|---|---|"
    for n in counts:
        ns = rounds_ns({"exact": partial(project, grid=grid, threads=1), "tree": trees[n].query}, points, rounds)
        yield f"| {n:,} | {ns['exact']:.1f} | {ns['tree']:.0f} |"


def small_batches() -> Iterator[str]:
    curve = profiles.p3()
    grid = build_foot_grid(curve)
    yield "| points in a call | us a call |"
    yield "|---|---|"
    for count in (1, 8, 64, 512):
        points = measured_points(curve, count, np.random.default_rng(3), False)
        ns = rounds_ns({"exact": partial(project, grid=grid)}, points, 3000)["exact"]
        yield f"| {count} | {ns * count / 1e3:.1f} |"


def methods_table(rounds: int) -> Iterator[str]:
    """The paper's methods, compiled, against their plain numpy versions."""
    curve = profiles.p3()
    nominal = discretize(curve, samples=SAMPLES, step_min=1 / SAMPLES)
    grid = nominal.grid
    points = measured_points(curve, 20_000, np.random.default_rng(4), False)
    plain = {"circle": reference.circle, "chord": reference.chord, "pcp": reference.pcp, "veaw": reference.veaw}
    yield "| method | compiled ns | numpy ns | exact ns |"
    yield "|---|---|---|---|"
    for method, numpy_way in plain.items():
        ways: dict[str, Callable[[Array], object]] = {
            "compiled": partial(project_on_samples, grid=grid, table=nominal.sample_table, method=method, threads=1),
            "numpy": partial(numpy_way, nominal=nominal),
            "exact": partial(project, grid=grid, threads=1),
        }
        ns = rounds_ns(ways, points, rounds)
        yield f"| {method} | {ns['compiled']:.0f} | {ns['numpy']:.0f} | {ns['exact']:.1f} |"


# --- rivals from the package index; each maker returns a way to get distances, built once ---------------------------------


def engeom_way(curve: NurbsCurve, samples: Array) -> Distances:
    engeom = importlib.import_module("engeom.geom2")
    polyline = engeom.Curve2(samples, tol=1e-9)

    def distances(points: Array) -> Array:
        feet = [polyline.at_closest_to_point(engeom.Point2(x, y)).point for x, y in points.tolist()]
        return np.asarray(np.hypot(*(np.array([(foot.x, foot.y) for foot in feet]) - points).T))

    return distances


def opencascade_way(curve: NurbsCurve, samples: Array) -> Distances:
    geom, api, gp, arrays = (importlib.import_module(f"OCP.{part}") for part in ("Geom", "GeomAPI", "gp", "collections"))
    values, counts = np.unique(curve.knots, return_counts=True)
    assert curve.weights is not None
    k = len(curve.control_points_mm)
    poles, weights, knots, multiplicities = (
        maker(1, n)
        for maker, n in (
            (arrays.Array1_gp_Pnt, k),
            (arrays.Array1_double, k),
            (arrays.Array1_double, len(values)),
            (arrays.Array1_int, len(values)),
        )
    )
    for i, ((x, y), weight) in enumerate(zip(curve.control_points_mm.tolist(), curve.weights.tolist(), strict=True), 1):
        poles.SetValue(i, gp.gp_Pnt(x, y, 0.0))
        weights.SetValue(i, weight)
    for i, (value, count) in enumerate(zip(values.tolist(), counts.tolist(), strict=True), 1):
        knots.SetValue(i, value)
        multiplicities.SetValue(i, count)
    spline = geom.Geom_BSplineCurve(poles, weights, knots, multiplicities, curve.degree)
    first, last = curve.domain
    projector = api.GeomAPI_ProjectPointOnCurve()
    projector.Init(spline, first, last)
    ends = curve.point(np.array([first, last]))

    def distances(points: Array) -> Array:
        found = np.min(np.hypot(*(points[:, None] - ends[None]).transpose(2, 0, 1)), axis=1)
        for i, (x, y) in enumerate(points.tolist()):
            projector.Perform(gp.gp_Pnt(x, y, 0.0))
            if projector.NbPoints():
                found[i] = min(found[i], projector.LowerDistance())
        return np.asarray(found)

    return distances


def geomdl_way(curve: NurbsCurve, samples: Array) -> Distances:
    """geomdl has no projection of its own: its derivatives in the published Newton iteration, started at the nearest sample."""
    nurbs = importlib.import_module("geomdl.NURBS")
    assert curve.weights is not None
    first, last = curve.domain
    spline = nurbs.Curve(normalize_kv=False)
    spline.degree = curve.degree
    spline.set_ctrlpts(np.column_stack([curve.control_points_mm * curve.weights[:, None], curve.weights]).tolist())
    spline.knotvector = curve.knots.tolist()
    tree = cKDTree(samples)

    def distance(x: float, y: float, u: float) -> float:
        for _ in range(3):
            c, c1, c2 = spline.derivatives(u, 2)
            vx, vy = c[0] - x, c[1] - y
            u -= (c1[0] * vx + c1[1] * vy) / (c1[0] ** 2 + c1[1] ** 2 + c2[0] * vx + c2[1] * vy)
            u = first + (u - first) % (last - first) if curve.closed else min(max(u, first), last)
        c = spline.evaluate_single(u)
        return float(np.hypot(c[0] - x, c[1] - y))

    def distances(points: Array) -> Array:
        start = first + (last - first) * np.asarray(tree.query(points)[1]) / (len(samples) - 1)
        return np.array([distance(x, y, u) for (x, y), u in zip(points.tolist(), start.tolist(), strict=True)])

    return distances


def splipy_way(curve: NurbsCurve, samples: Array) -> Distances:
    """splipy: values and derivatives of all points at once in the published Newton iteration, started at the nearest sample."""
    splipy = importlib.import_module("splipy")
    assert curve.weights is not None
    first, last = curve.domain
    rational = np.column_stack([curve.control_points_mm * curve.weights[:, None], curve.weights])
    spline = splipy.Curve(splipy.BSplineBasis(curve.degree + 1, curve.knots), rational, rational=True, raw=True)
    tree = cKDTree(samples)

    def distances(points: Array) -> Array:
        u = first + (last - first) * np.asarray(tree.query(points)[1]) / (len(samples) - 1)
        for _ in range(3):
            v, c1, c2 = spline(u) - points, spline.derivative(u, 1), spline.derivative(u, 2)
            u = u - (c1 * v).sum(axis=1) / ((c1 * c1).sum(axis=1) + (c2 * v).sum(axis=1))
            u = first + np.mod(u - first, last - first) if curve.closed else np.clip(u, first, last)
        return np.asarray(np.hypot(*(spline(u) - points).T))

    return distances


def libigl_way(curve: NurbsCurve, samples: Array) -> Distances:
    igl = importlib.import_module("igl")
    vertices = np.column_stack([samples, np.zeros(len(samples))])
    edges = np.column_stack([np.arange(len(samples) - 1), np.arange(1, len(samples))])

    def distances(points: Array) -> Array:
        solid = np.column_stack([points, np.zeros(len(points))])
        return np.asarray(np.sqrt(igl.point_mesh_squared_distance(solid, vertices, edges)[0]))

    return distances


def small_gicp_way(curve: NurbsCurve, samples: Array) -> Distances:
    small_gicp = importlib.import_module("small_gicp")
    tree = small_gicp.KdTree(np.column_stack([samples, np.zeros(len(samples))]))

    def distances(points: Array) -> Array:
        return np.asarray(np.sqrt(tree.batch_nearest_neighbor_search(np.column_stack([points, np.zeros(len(points))]))[1]))

    return distances


def open3d_way(curve: NurbsCurve, samples: Array) -> Distances:
    o3d = importlib.import_module("open3d")
    cloud_of_samples = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(np.column_stack([samples, np.zeros(len(samples))])))

    def distances(points: Array) -> Array:
        cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(np.column_stack([points, np.zeros(len(points))])))
        return np.asarray(cloud.compute_point_cloud_distance(cloud_of_samples))

    return distances


RIVALS: dict[str, tuple[str, str, Callable[[NurbsCurve, Array], Distances], int]] = {
    # name, what it is measured with, its module, its maker, most points at a time
    "engeom": ("distance to the polyline, a Python call a point", "engeom", engeom_way, 100_000),
    "OpenCASCADE": ("its own projection, a Python call a point", "OCP", opencascade_way, 1_000),
    "geomdl": ("Newton on its derivatives", "geomdl", geomdl_way, 1_000),
    "splipy": ("Newton on its derivatives, all points at once", "splipy", splipy_way, 100_000),
    "libigl": ("distance to the polyline", "igl", libigl_way, 1_000_000),
    "small_gicp": ("nearest sample", "small_gicp", small_gicp_way, 1_000_000),
    "Open3D": ("nearest sample, all cores", "open3d", open3d_way, 1_000_000),
}


PACKAGES = ("engeom", "cadquery-ocp-novtk", "geomdl", "splipy", "libigl", "small_gicp", "open3d-cpu")


def rivals_table(sizes: list[int], rounds: int) -> Iterator[str]:
    missing = [rival for rival, (_, module, _, _) in RIVALS.items() if importlib.util.find_spec(module) is None]
    yield f"Not installed: {', '.join(missing) or 'none'}. Ours: one thread."
    yield ""
    yield "| profile | points | order | rival | what | ns a point | exact ns | ratio | max / mean error mm | of exact |"
    yield "|---|---|---|---|---|---|---|---|---|---|"
    for name, make in PROFILES.items():
        curve = make()
        ours = exact_way(build_foot_grid(curve), 1)
        samples = curve.point(np.linspace(*curve.domain, SAMPLES))
        ways = {rival: maker(curve, samples) for rival, (_, _, maker, _) in RIVALS.items() if rival not in missing}
        for count, shuffled in ((count, shuffled) for count in sizes for shuffled in (False, True)):
            points = measured_points(curve, count, np.random.default_rng(5), shuffled)
            truth = true_distances(points, curve)
            able = {rival: way for rival, way in ways.items() if count <= RIVALS[rival][3]}
            ns = rounds_ns({**able, "exact": ours}, points, rounds)
            errors = errors_mm(ours, points, truth)
            for rival, way in able.items():
                yield (
                    f"| {name} | {count:,} | {'shuffled' if shuffled else 'ordered'} | {rival} | {RIVALS[rival][0]} | {ns[rival]:,.0f} "
                    f"| {ns['exact']:.1f} | **{ns[rival] / ns['exact']:,.0f}** | {errors_mm(way, points, truth)} | {errors} |"
                )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="1e5 points only")
    parser.add_argument("--rivals", action="store_true", help="also the rivals from the package index that are installed")
    parser.add_argument("--millions", action="store_true", help="also 1e7 points (needs 1.5 GB)")
    options = parser.parse_args()
    begin = time.perf_counter()
    compile_kernels()
    versions = machine("numpy", "scipy", "numba", *PACKAGES)
    lines = ["# Closest points", "", f"{versions} n = {SAMPLES:,} samples; kernels ready after {time.perf_counter() - begin:.1f} s.", ""]
    print(*lines, sep="\n")
    sizes = [100_000] if options.quick else [1_000, 100_000, 1_000_000]
    tables = [main_table(sizes, 9), growth_in_points(options.millions), growth_in_samples(9), small_batches(), methods_table(5)]
    if options.rivals:
        tables.append(rivals_table(sizes, 5))
    for table in tables:
        for line in chain(table, [""]):
            lines.append(line)
            print(line, flush=True)
    if options.rivals and options.millions and not options.quick:
        RESULT.write_text("\n".join(lines), encoding="utf-8")


if __name__ == "__main__":
    main()
