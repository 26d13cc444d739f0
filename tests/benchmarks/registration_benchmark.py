"""How fast, how exactly and from how little a scan is brought onto its nominal, and how long a batch of points takes.

    python -m tests.benchmarks.registration_benchmark [--mh42 FILE] [--quick]

Writes tests/benchmarks/registration.md. Ways that are compared take turns in one process and the median round counts, and times are
the processor's, of all threads together, so that a busy machine changes them little and slows all of them alike. engeom comes from the
package index: pip install 'cmmlink[bench]'.
"""

import argparse
import importlib.util
import sys
import time
from collections.abc import Callable, Iterable, Iterator
from functools import partial
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.progress import track

from inspection import (
    LiveInspection,
    NominalProfile,
    RigidTransform,
    ToleranceZone,
    deviations,
    register,
    register_coarse,
    register_fine,
    rehearse,
)
from inspection.synthetic import even_stations
from tests.benchmarks import published_method
from tests.benchmarks.machine import load, machine
from tests.benchmarks.parts import FORM_MM, Missing, best_place, cross_section, farthest_mm, nominals, random_pose
from tests.benchmarks.warm_up import compile_kernels
from tests.inspection import profiles
from tests.inspection.oracle import closest_point
from tests.inspection.profiles import Array

RESULT = Path(__file__).with_name("registration.md")
Profiles = dict[str, NominalProfile | Missing]
POINTS = 2000
PARTIAL_CASES = ((0.4, False), (0.4, True), (0.25, False))  # coverage, and whether the part has form error
ZONE = ToleranceZone(-0.05, 0.05, 0.005)


# --- time and exactness against the published iteration and engeom ---------------------------------------------------------


def speed(every: Profiles, rounds: int) -> Iterator[str]:
    yield "| profile | start | way | steps | ms | off mm | times ours |"
    yield "|---|---|---|---|---|---|---|"
    for name, nominal in every.items():
        if isinstance(nominal, Missing):
            yield f"| {name} | {nominal.reason} |" + " |" * 5
            continue
        rng = np.random.default_rng(1)
        part = cross_section(nominal, even_stations(nominal, POINTS), random_pose(rng), rng)
        points = part.points_mm
        place, _ = best_place(nominal.curve, part.nominal_from_section.apply(points))
        starts = {"ours": register_coarse(points, nominal).nominal_from_section, "published": _published_coarse(points, nominal)}
        for kind, start in starts.items():
            for row in _compared(points, nominal, start, place, rounds):
                yield f"| {name} | {kind} | {row} |"


def _published_coarse(points: Array, nominal: NominalProfile) -> RigidTransform:
    return published_method.tuned(points, published_method.boxes(points, nominal), nominal)


Aligned = tuple[RigidTransform, int | None]  # a pose and the steps made, where the way tells


def _compared(points: Array, nominal: NominalProfile, start: RigidTransform, place: Array, rounds: int) -> Iterator[str]:
    ways: dict[str, Callable[[], Aligned]] = {
        "Gauss-Newton": lambda: _ours(points, nominal, start),
        "ICP, point inversion": lambda: published_method.icp(points, nominal, start),
    }
    for package, make in {"engeom": _engeom, "small_gicp": _small_gicp, "open3d": _open3d}.items():
        if importlib.util.find_spec(package) is not None:
            ways[package] = make(points, nominal, start)
    ms = _medians_ms(ways, rounds)
    for way, align in ways.items():
        pose, steps = align()
        off = farthest_mm(pose, points, place)
        yield f"{way} | {steps or ''} | {ms[way]:.3g} | {off:.0e} | {ms[way] / ms['Gauss-Newton']:.0f}"


def _ours(points: Array, nominal: NominalProfile, start: RigidTransform) -> Aligned:
    found = register_fine(points, nominal, start)
    return found.nominal_from_section, found.iterations


def _engeom(points: Array, nominal: NominalProfile, start: RigidTransform) -> Callable[[], Aligned]:
    """Its least-squares alignment of points to the polygon of the 10,000 samples, without the robust rounds that follow by default."""
    from engeom.align2 import AlignParams2, points_to_curve
    from engeom.geom2 import Curve2, Point2

    polygon = Curve2(nominal.points_mm, tol=1e-9, force_closed=nominal.curve.closed)

    def align() -> Aligned:
        placed = start.apply(points)
        params = AlignParams2(center=Point2(*placed.mean(axis=0).tolist()))
        found = points_to_curve(placed, polygon, params, ignore_off_target=True, refinement_steps=0)
        matrix = found.alignment.full_transform.as_numpy()
        return _planar(matrix).after(start), None

    return align


def _small_gicp(points: Array, nominal: NominalProfile, start: RigidTransform) -> Callable[[], Aligned]:
    """Its point-to-point ICP onto the 10,000 samples on one thread; tree and target are made before."""
    import small_gicp

    target = small_gicp.PointCloud(_solid(nominal.points_mm))
    tree = small_gicp.KdTree(target)

    def align() -> Aligned:
        source = small_gicp.PointCloud(_solid(start.apply(points)))
        found = small_gicp.align(
            target,
            source,
            tree,
            registration_type="ICP",
            max_correspondence_distance=10.0,
            num_threads=1,
            max_iterations=500,
            rotation_epsilon=1e-8,
            translation_epsilon=1e-6,
        )
        return _planar(found.T_target_source[:, [0, 1, 3]]).after(start), found.iterations

    return align


def _open3d(points: Array, nominal: NominalProfile, start: RigidTransform) -> Callable[[], Aligned]:
    """Its point-to-plane ICP onto the 10,000 samples with the nominal's normals; the target is made before."""
    import open3d

    target = open3d.geometry.PointCloud(open3d.utility.Vector3dVector(_solid(nominal.points_mm)))
    target.normals = open3d.utility.Vector3dVector(_solid(nominal.normal))
    kind = open3d.pipelines.registration
    until = kind.ICPConvergenceCriteria(relative_fitness=1e-6, relative_rmse=1e-6, max_iteration=500)

    def align() -> Aligned:
        source = open3d.geometry.PointCloud(open3d.utility.Vector3dVector(_solid(start.apply(points))))
        found = kind.registration_icp(source, target, 10.0, np.eye(4), kind.TransformationEstimationPointToPlane(), until)
        return _planar(found.transformation[:, [0, 1, 3]]).after(start), None

    return align


def _solid(vectors: Array) -> Array:
    return np.column_stack([vectors, np.zeros(len(vectors))])


def _planar(matrix: Array) -> RigidTransform:
    """The motion whose first two rows are those of a homogeneous matrix."""
    return RigidTransform(float(np.arctan2(matrix[1, 0], matrix[0, 0])), matrix[:2, 2])


def _medians_ms(ways: dict[str, Callable[[], Aligned]], rounds: int) -> dict[str, float]:
    """Median time of each way, taken in turn; quick ways are repeated within a round."""
    taken: dict[str, list[float]] = {name: [] for name in ways}
    for _ in range(rounds):
        for name, way in ways.items():
            for _ in range(1 if name.startswith("ICP") else 5):
                begin = time.process_time_ns()
                way()
                taken[name].append((time.process_time_ns() - begin) / 1e6)
    return {name: float(np.median(times)) for name, times in taken.items()}


def _shown(trials: int, what: str) -> Iterable[int]:
    """Their numbers, with a progress bar beside the tables that go to standard output."""
    return track(range(trials), what, console=Console(stderr=True), transient=True, disable=not sys.stderr.isatty())


# --- partial scans ---------------------------------------------------------------------------------------------------------


def partial_scans(every: Profiles, trials: int, cases: tuple[tuple[float, bool], ...]) -> Iterator[str]:
    yield "| profile | coverage | form error | with the profile | against it | at its best pose | farthest mm | of best poses mm | ms |"
    yield "|---|---|---|---|---|---|---|---|---|"
    for name, nominal in every.items():
        if isinstance(nominal, Missing):
            yield f"| {name} | {nominal.reason} |" + " |" * 7
            continue
        for coverage, formed in cases:
            off, best_off, apart, ms = _partial_trials(name, nominal, trials, coverage, formed)
            found = off < 1.0
            with_it, against = (f"{way.sum()} of {len(way)}" for way in (found[::2], found[1::2]))
            yield (
                f"| {name} | {coverage:.0%} | {'30 um' if formed else 'none'} | {with_it} | {against} | {(apart < 1e-6).sum()} of {trials} "
                f"| {off.max():.3f} | {best_off.max():.3f} | {np.median(ms):.1f} |"
            )


def _partial_trials(name: str, nominal: NominalProfile, trials: int, coverage: float, formed: bool) -> tuple[Array, ...]:
    """For each trial, in mm: farthest point from where the full scan puts it, that of the best pose of the part, and of one from the other.

    And the time in ms. The best pose is the fine registration begun at the truth; every second scan runs backwards.
    """
    rng = np.random.default_rng(2)
    rows = np.empty((trials, 4))
    for trial in _shown(trials, f"partial scans of {name}, {coverage:.0%}"):
        whole = cross_section(nominal, even_stations(nominal, POINTS), random_pose(rng), rng, FORM_MM if formed else ())
        full = register_fine(whole.points_mm, nominal, whole.nominal_from_section).nominal_from_section
        part = _window(whole.points_mm, coverage, nominal.curve.closed, rng)
        best = register_fine(part, nominal, full).nominal_from_section
        moved = random_pose(rng)
        seen = moved.apply(part[::-1] if trial % 2 else part)
        begin = time.process_time_ns()
        found = register(seen, nominal).nominal_from_section.after(moved)
        ms = (time.process_time_ns() - begin) / 1e6
        where = full.apply(part)
        rows[trial] = farthest_mm(found, part, where), farthest_mm(best, part, where), farthest_mm(found, part, best.apply(part)), ms
    return tuple(rows.T)


def _window(points: Array, coverage: float, closed: bool, rng: np.random.Generator) -> Array:
    """A random run of neighbouring points: that share of them."""
    count = round(coverage * len(points))
    first = int(rng.integers(len(points) if closed else len(points) - count + 1))
    return np.roll(points, -first, axis=0)[:count]


# --- outliers --------------------------------------------------------------------------------------------------------------


def outliers(every: Profiles, trials: int) -> Iterator[str]:
    yield "| profile | trials | moved um, median / most | not robust um, median | reported | least of a trial | sound points reported |"
    yield "|---|---|---|---|---|---|---|"
    for name, nominal in every.items():
        if isinstance(nominal, Missing):
            yield f"| {name} | {nominal.reason} |" + " |" * 5
            continue
        rows = [
            _outlier_trial(nominal, np.random.default_rng(seed)) for seed in track(range(trials), f"outliers on {name}", transient=True)
        ]
        moved, plain, gross, found, false, sound = (np.array(column) for column in zip(*rows, strict=True))
        yield (
            f"| {name} | {trials} | {np.median(moved):.2f} / {moved.max():.2f} | {np.median(plain):.0f} | {found.sum() / gross.sum():.2%} "
            f"| {(found / gross).min():.1%} | {false.sum()} of {sound.sum():,} |"
        )


def _outlier_trial(nominal: NominalProfile, rng: np.random.Generator) -> tuple[float, float, int, int, int, int]:
    """Pose change in um with and without `robust`; gross outliers and those reported; sound points reported, and sound points.

    Every tenth point is thrown up to 3 mm off along its normal. Through a thin edge it may land on the other side: gross is
    what then lies 0.3 mm or more from the profile, by the independent closest point. What lies beyond an open end is rejected as such.
    """
    clean = cross_section(nominal, even_stations(nominal, POINTS), random_pose(rng), rng)
    place = clean.nominal_from_section.apply(clean.points_mm)
    bad = np.zeros(POINTS, dtype=bool)
    bad[rng.choice(POINTS, POINTS // 10, replace=False)] = True
    size = rng.uniform(0.3, 3.0, POINTS) * rng.choice([-1.0, 1.0], POINTS) * bad
    normal = profiles.left_normal(nominal.curve, closest_point(nominal.curve, place).parameter)
    thrown = place + size[:, None] * normal
    landed = closest_point(nominal.curve, thrown)
    gross = bad & (np.abs(landed.left_mm) >= 0.3) & ~landed.beyond_end
    points = clean.nominal_from_section.inverse().apply(thrown)
    best = register_fine(clean.points_mm, nominal, clean.nominal_from_section).nominal_from_section.apply(clean.points_mm)
    robust = register(points, nominal, robust=True)
    plain = register(points, nominal)
    moved, biased = (1e3 * farthest_mm(r.nominal_from_section, clean.points_mm, best) for r in (robust, plain))
    flagged = robust.outliers
    return moved, biased, int(gross.sum()), int((gross & flagged).sum()), int((~bad & flagged).sum()), int((~bad).sum())


# --- streaming -------------------------------------------------------------------------------------------------------------


def streaming(every: Profiles, points: int) -> Iterator[str]:
    yield "| profile | pose | batch | batches | median us | p99 us | most us | whole scan ms |"
    yield "|---|---|---|---|---|---|---|---|"
    for name in ("P3", "NACA 2412 sharp"):
        nominal = every[name]
        assert not isinstance(nominal, Missing)
        rehearse(nominal)
        rng = np.random.default_rng(3)
        part = cross_section(nominal, even_stations(nominal, points), random_pose(rng), rng)
        for kind, datum in (("sought while scanning", None), ("datum", part.nominal_from_section)):
            for size in (1, 8, 64, 512):
                us = np.concatenate([_batch_us(nominal, part.points_mm, size, datum) for _ in range(3)])
                yield (
                    f"| {name} | {kind} | {size} | {len(us):,} | {np.median(us):.1f} | {np.quantile(us, 0.99):.1f} | {us.max():,.0f} "
                    f"| {us.sum() / 3e3:.0f} |"
                )


def _batch_us(nominal: NominalProfile, points: Array, size: int, datum: RigidTransform | None) -> Array:
    live = LiveInspection(nominal, ZONE, datum=datum)
    batches = [points[k : k + size] for k in range(0, len(points), size)]
    us = np.empty(len(batches))
    for k, batch in enumerate(batches):
        begin = time.process_time_ns()
        live.add(batch)
        us[k] = (time.process_time_ns() - begin) / 1e3
    return us


# --- growth ----------------------------------------------------------------------------------------------------------------


def growth(every: Profiles, most: int) -> Iterator[str]:
    """Points of one scan repeated with fresh noise, so that 1e7 of them need not be made on the curve."""
    nominal = every["P3"]
    assert not isinstance(nominal, Missing)
    rng = np.random.default_rng(4)
    part = cross_section(nominal, even_stations(nominal, 1000), random_pose(rng), rng)
    start = register_coarse(part.points_mm, nominal).nominal_from_section
    yield "| points | deviations ns a point | of processor time | registration ns a point | of processor time | steps |"
    yield "|---|---|---|---|---|---|"
    count = 1000
    while count <= most:
        points = np.repeat(part.points_mm, count // 1000, axis=0)
        points += rng.normal(0, 0.005, points.shape)
        placed = start.apply(points)
        rounds = 1 if count > 2_000_000 else 3 if count > 200_000 else 15
        judged = _ns_a_point(partial(deviations, placed, nominal), count, rounds)
        fitted = _ns_a_point(partial(register_fine, points, nominal, start), count, rounds)
        steps = register_fine(points, nominal, start).iterations
        yield f"| {count:,} | {judged[0]:.0f} | {judged[1]:.0f} | {fitted[0]:.0f} | {fitted[1]:.0f} | {steps} |"
        count *= 10


def _ns_a_point(way: Callable[[], object], count: int, rounds: int) -> tuple[float, float]:
    """Median wall time and processor time (all threads) a point, after one round to warm up."""
    taken = []
    for _ in range(rounds + 1):
        wall, processor = time.perf_counter_ns(), time.process_time_ns()
        way()
        taken.append(((time.perf_counter_ns() - wall) / count, (time.process_time_ns() - processor) / count))
    wall_ns, processor_ns = np.median(taken[1:], axis=0)
    return float(wall_ns), float(processor_ns)


SPEED = """Section of 2,000 points, even in arc length, with form error of 20 and 10 um and noise of 6.5 um; nominal of 10,000 samples.
Start: our coarse pose (arc-length weights), or the published one (unweighted axes, tuned on dominant points).
Gauss-Newton: ours, `register_fine` on exact feet. ICP: KD-tree, three Newton steps of inversion and best motion in numpy, until
the mean square changes by less than 1e-6 of itself. engeom: least squares to the polygon of the samples; small_gicp: ICP point to
point; Open3D: ICP point to plane on all cores; all three native code, onto the same samples. The others run on one thread. Processor
time, of all cores together. Off: farthest point from the optimum, which is found with the tests' own closest point. Demanded: 6 steps,
1e-9 mm, 300 times ICP, 8 times engeom."""
PARTIAL = """A random run of neighbouring points of a scan of 2,000, at a random pose, every second one against the profile's direction.
Counted: scans of which no point lies farther than 1 mm from where the full scan's pose puts it; demanded: all at 40 %. Best pose: the
least-squares pose of those points alone, reached from the truth; where it lies farther than 1 mm off, form error has moved a nearly
straight or nearly circular part along itself, and no fit of these points can do better."""
OUTLIERS = """Every tenth of 2,000 points is thrown 0.3 to 3 mm to either side; `register(..., robust=True)`. Moved: farthest point,
against the pose of the same scan before. Counted as gross: 0.3 mm or more from the profile where it landed, seen from the true
pose, and not beyond an open end (those take no part in any fit). Demanded: below 2 um, 99 % reported."""
STREAMING = """`LiveInspection.add` from the first point to the last of a scan, three scans; processor time. The longest calls are those
in which the pose is sought or fitted anew: sought after 64 points and whenever the scan has grown by 30 % until found, fitted anew at
every doubling. Demanded: median below 20 us for batches of 8."""
GROWTH = "P3; the engine spreads large sets over all cores, so processor time says what a point costs and wall time what is waited for."


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--mh42", type=Path, metavar="FILE", help="coordinates of MH 42 in UIUC format")
    parser.add_argument("--quick", action="store_true", help="few trials and rounds, 1e6 points at most; nothing is written")
    options = parser.parse_args()
    compile_kernels()
    every = nominals(options.mh42)
    quick = options.quick
    tables = {
        "Speed and exactness": (SPEED, speed(every, 2 if quick else 7)),
        "Partial scans": (PARTIAL, partial_scans(every, 10 if quick else 200, PARTIAL_CASES)),
        "Outliers": (OUTLIERS, outliers(every, 2 if quick else 20)),
        "Streaming": (STREAMING, streaming(every, 2_000 if quick else 16_384)),
        "Growth with the number of points": (GROWTH, growth(every, 1_000_000 if quick else 10_000_000)),
    }
    text = f"# Registration\n\n{machine('numpy', 'scipy', 'numba', 'engeom', 'small_gicp', 'open3d-cpu')} {load()}\n"
    print(text)
    for title, (explained, lines) in tables.items():
        text += f"\n## {title}\n\n{explained}\n\n"
        print(f"\n## {title}\n", flush=True)
        for line in lines:
            text += line + "\n"
            print(line, flush=True)
    if not quick:
        RESULT.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
