"""The audit of verdicts: parts whose truth is known, inspected, and how often what was said was not so.

    python -m tests.benchmarks.verdict_audit [live] [zones] [partial] [mirrored]

live      300 scans of six kinds of form, looked at twenty times each: words that were not so
zones     170 minimum zones, held against successive linear programs that share no line with the inspection
partial   200 scans of a part of the profile, in the order of the contour and out of it
mirrored  100 mirrored parts of nearly symmetric profiles

Nothing but the front door of `inspection` is used, and of that only what has been there from the beginning, so that the same table
can be made of any earlier version: run this file by its path, with that version first on PYTHONPATH.
"""

import sys
import time
from collections import Counter
from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linprog
from scipy.spatial import cKDTree

import inspection
from inspection import InspectionError, LiveInspection, NominalProfile, NurbsCurve, ToleranceZone, Verdict, discretize, fit_minimum_zone

Array = NDArray[np.float64]

ZONE = ToleranceZone(-0.05, 0.05)
GOE404 = Path(__file__).resolve().parents[1] / "data" / "airfoils" / "goe404.dat"
KINDS = ("good", "noise only", "dent", "step", "late form", "dense side")
LOOKS = 20
COUNT = 600
DENSE = 100_000


def say(text: str) -> None:
    sys.stdout.write(text + "\n")
    sys.stdout.flush()


# ---- parts


def naca_points(camber: float, thickness: float) -> Array:
    """Points (m, 2) of a NACA 4-digit profile of chord 1 from the trailing edge over the upper side, camber at 40 %."""
    x = (1 - np.cos(np.linspace(0, np.pi, 60))) / 2
    half = 5 * thickness * (0.2969 * np.sqrt(x) - 0.1260 * x - 0.3516 * x**2 + 0.2843 * x**3 - 0.1036 * x**4)
    line = np.where(x < 0.4, camber / 0.16 * (0.8 * x - x**2), camber / 0.36 * (0.2 + 0.8 * x - x**2))
    return np.concatenate([np.column_stack([x, line + half])[::-1], np.column_stack([x, line - half])[1:]])


def rounded(points: Array, chord_mm: float) -> NominalProfile:
    """The profile through these points but for the last two hundredths before its edge, which a smooth curve closes."""
    return discretize(NurbsCurve.interpolate(chord_mm * points[points[:, 0] < 0.98], closed=True), samples=2000)


@cache
def nominal_of(number: int) -> NominalProfile:
    """One of four nominals of chord 100 mm."""
    if number >= 4:
        return nominal_of(number % 4)
    if number == 0:
        return rounded(np.loadtxt(GOE404, skiprows=1), 100.0)
    return rounded(naca_points(*((0.02, 0.12), (0.04, 0.15), (0.03, 0.09))[number - 1]), 100.0)


@cache
def _dense(number: int) -> tuple[Array, Array, Array]:
    """Parameters (DENSE,), their points, and stations by summing chords."""
    if number >= 4:
        return _dense(number % 4)
    curve = nominal_of(number).curve
    u = np.linspace(*curve.domain, DENSE)
    points = curve.point(u)
    return u, points, np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(points, axis=0).T))])


def outward_of(curve: NurbsCurve, u: Array) -> Array:
    """Normals (m, 2) out of a closed curve."""
    tangent = curve.derivatives(u, 1)[1]
    corners = curve.point(np.linspace(*curve.domain, 400))
    turns_left = np.sum(corners[:, 0] * np.roll(corners[:, 1], -1) - corners[:, 1] * np.roll(corners[:, 0], -1)) > 0
    right = np.column_stack([tangent[:, 1], -tangent[:, 0]]) / np.hypot(*tangent.T)[:, None]
    return np.asarray(right if turns_left else -right)


def part(number: int, form: Array) -> Array:
    """Points (m, 2) of a part, even in arc length, moved by `form` (m,) along the outward normal; not yet placed anywhere."""
    u, _, station = _dense(number)
    at = np.interp((np.arange(len(form)) + 0.5) / len(form) * station[-1], station, u)
    curve = nominal_of(number).curve
    return np.asarray(curve.point(at) + form[:, None] * outward_of(curve, at))


def placed(points: Array, rng: np.random.Generator) -> tuple[Array, float, Array]:
    """The points turned and shifted at random, the angle and the shift."""
    angle, shift = float(rng.uniform(-np.pi, np.pi)), rng.uniform(-30, 30, 2)
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    return np.asarray(points @ turn.T + shift), angle, shift


def waves(share: Array, rng: np.random.Generator, amplitude_mm: float) -> Array:
    """Three waves around (m,) at shares (m,) of the length, and noise of 3 um."""
    heights = amplitude_mm * np.array([0.5, 0.33, 0.17])
    form = sum(h * np.sin(2 * np.pi * n * share + rng.uniform(0, 7)) for h, n in zip(heights, (2, 5, 13), strict=True))
    return np.asarray(form + rng.normal(0, 0.003, len(share)))


# ---- live scans


def live_form(kind: str, share: Array, rng: np.random.Generator) -> Array:
    form = rng.normal(0, 0.003, len(share)) if kind == "noise only" else waves(share, rng, 0.024)
    at = rng.uniform(0.2, 0.8)
    if kind == "dent":
        form -= 0.18 * np.exp(-(((share - at) / 0.012) ** 2))
    if kind == "step":
        form += 0.13 * ((share > at) & (share < at + 0.25))
    if kind == "late form":
        form += 0.09 * np.clip((share - 0.6) / 0.4, 0, 1) * np.sin(3 * np.pi * share + rng.uniform(0, 7))
    return form


def is_red(live: LiveInspection, verdicts: NDArray[np.int8], search: "inspection.PrefixSearch | None") -> bool:
    """Whether the word NOT CONFORM stands over the scan: where there is a proof in mid-scan, by it alone."""
    if search is None:
        return bool((verdicts == Verdict.NONCONFORM).any())
    prefix = live.prefix()
    return prefix is not None and search.refutes(prefix)


def follow(kind: str, seed: int) -> Counter[str]:
    """What became of one scan."""
    rng = np.random.default_rng([seed, KINDS.index(kind)])
    share = (np.arange(COUNT) + 0.5) / COUNT
    points = np.roll(placed(part(seed, live_form(kind, share, rng)), rng)[0], -int(rng.integers(COUNT)), axis=0)
    if kind == "dense side":
        points = np.repeat(points, np.where(np.arange(COUNT) < COUNT // 4, 4, 1), axis=0)
        points = points + rng.normal(0, 0.002, points.shape)
    live = LiveInspection(nominal_of(seed), ZONE, coverage_min=0.95)
    search = live.prefix_search() if hasattr(live, "prefix_search") else None
    looks, red = [], 0
    for first in range(0, len(points), -(-len(points) // LOOKS)):
        live.add(points[first : first + -(-len(points) // LOOKS)])
        looks.append(live.snapshot())
        red += (search is None or not red) and looks[-1].state == "provisional" and is_red(live, looks[-1].verdicts, search)
    result = live.finish()
    said = Counter(scans=1, red=red > 0, false_red=red > 0 and result.verdict != Verdict.NONCONFORM)
    said[result.verdict.name] = 1
    for look in looks[:-1]:
        if look.state != "provisional":
            continue
        rows = (look.verdicts >= 0) & (result.verdicts[: look.stop] >= 0)
        moved = np.abs(look.deviation_mm[rows] - result.deviation_mm[: look.stop][rows]).max(initial=0.0)
        told = rows & np.isin(look.verdicts, (Verdict.CONFORM, Verdict.NONCONFORM))
        said.update(looks=1, bound_broken=bool(moved > look.can_move_mm), told=int(told.sum()))
        said["changed"] += int((look.verdicts[told] != result.verdicts[: look.stop][told]).sum())
    return said


def live_table() -> None:
    say("live: kind, scans, [CONFORM, NOT PROVEN, NOT CONFORM], red on the way, red and not so in the end, bound broken/looks, changed")
    for kind in KINDS:
        total = sum((follow(kind, seed) for seed in range(50)), Counter[str]())
        ends = [total[verdict.name] for verdict in (Verdict.CONFORM, Verdict.UNCERTAIN, Verdict.NONCONFORM)]
        changed = total["changed"] / max(1, total["told"])
        say(f"{kind:11} {total['scans']} {ends} {total['red']} {total['false_red']} {total['bound_broken']}/{total['looks']} {changed:.2%}")


# ---- minimum zones


def distances(number: int, points: Array) -> tuple[Array, Array]:
    """Signed distances (m,), positive outward, and their directions (m, 2), by Newton steps from the nearest of many samples."""
    curve = nominal_of(number).curve
    dense_u, dense, _ = _dense(number)
    low, high = curve.domain
    u = dense_u[cKDTree(dense).query(points)[1]]
    for _ in range(4):
        place, first, second = curve.derivatives(u, 2)
        off = place - points
        slope = (first**2).sum(axis=1) + (off * second).sum(axis=1)
        u = low + (u - (off * first).sum(axis=1) / slope - low) % (high - low)
    normal = outward_of(curve, u)
    return ((points - curve.point(u)) * normal).sum(axis=1), normal


def smallest_zone(number: int, points: Array) -> float:
    """Width of the minimum zone about 0 near where the points lie, by linear programs over all points with a shrinking trust region."""
    trust = 1.0
    e, normal = distances(number, points)
    for _ in range(60):
        centre = points.mean(axis=0)
        arm = points - centre
        reach = np.hypot(*arm.T).max()
        J = np.column_stack([normal, (arm[:, 0] * normal[:, 1] - arm[:, 1] * normal[:, 0]) / reach, -np.ones(len(e))])
        A = np.vstack([J, np.column_stack([-J[:, :3], J[:, 3]])])
        bounds = [(-trust, trust)] * 3 + [(0, None)]
        step = np.asarray(linprog([0, 0, 0, 1], A_ub=A, b_ub=np.concatenate([-e, e]), bounds=bounds, method="highs").x)
        turn = step[2] / reach
        moved = arm @ np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]]) + centre + step[:2]
        then, then_normal = distances(number, moved)
        gain = np.abs(e).max() - np.abs(then).max()
        if gain > 0:
            points, e, normal = moved, then, then_normal
        if gain <= 0 or np.abs(step[:3]).max() < 0.5 * trust:
            trust = min(trust, float(np.abs(step[:3]).max())) / 2
        if trust < 1e-10:
            break
    return 2 * float(np.abs(e).max())


def zones_table() -> None:
    apart, tally, ratios = [], Counter[str](), []
    for seed in range(170):
        rng = np.random.default_rng([seed, 77])
        share = (np.arange(300) + 0.5) / 300
        at_home = part(seed, waves(share, rng, float(rng.uniform(0.01, 0.09))))
        points = placed(at_home, rng)[0]
        known, found = smallest_zone(seed, at_home), fit_minimum_zone(points, nominal_of(seed)).zone_mm
        apart.append(found - known)
        live = LiveInspection(nominal_of(seed), ZONE, coverage_min=0.95, provisional=False)
        live.add(points)
        result = live.finish()
        passes = known <= 0.1
        tally["passes" if passes else "fails"] += 1
        tally["scrapped though it passes"] += passes and result.verdict == Verdict.NONCONFORM
        tally["passed though it fails"] += not passes and result.verdict == Verdict.CONFORM
        best_fit = getattr(result, "best_fit_error_mm", result.profile_error_mm)
        ratios.append(best_fit / known)
        tally["out at best fit, inside at the minimum zone"] += passes and best_fit > 0.1
    say(f"zones: 170; ours minus the independent one: {min(apart):.2e} .. {max(apart):.2e} mm; {dict(tally)}")
    say(f"zones: error at best fit over the minimum zone: median {np.median(ratios):.2f}, largest {max(ratios):.2f}")


# ---- partial scans


def partial_table() -> None:
    tally: dict[str, Counter[str]] = {"in order": Counter(), "out of order": Counter()}
    for seed in range(200):
        rng = np.random.default_rng([seed, 99])
        share = (np.arange(1200) + 0.5) / 1200
        at_home = part(seed, waves(share, rng, 0.024))
        kept = (int(rng.integers(1200)) + np.arange(int(rng.uniform(0.12, 0.6) * 1200))) % 1200
        points = placed(at_home, rng)[0][kept]
        for name, given in (("in order", points), ("out of order", rng.permutation(points))):
            live = LiveInspection(nominal_of(seed), ZONE, coverage_min=0.95)
            live.add(given)
            try:
                result = live.finish()
            except InspectionError:
                tally[name]["refused"] += 1
                continue
            back = result.registration.nominal_from_section.apply(points)
            tally[name][result.verdict.name] += 1
            tally[name]["placed wrong by more than 1 mm"] += bool(np.hypot(*(back - at_home[kept]).T).max() > 1.0)
    for name, counts in tally.items():
        say(f"partial, {name}: 200 good parts; {dict(counts)}")


# ---- mirrored parts


def mirrored_table() -> None:
    tally = Counter[str]()
    for seed in range(100):
        rng = np.random.default_rng([seed, 55])
        nominal = rounded(naca_points(float(rng.uniform(0.002, 0.03)), float(rng.uniform(0.06, 0.15))), float(rng.uniform(20, 120)))
        u = np.linspace(*nominal.curve.domain, 1201)[:-1]
        share = np.arange(1200) / 1200
        form = waves(share, rng, 0.016) - 0.2 * np.exp(-(((share - rng.uniform(0.1, 0.4)) / 0.01) ** 2))
        points = placed((nominal.curve.point(u) + form[:, None] * outward_of(nominal.curve, u)) * (1.0, -1.0), rng)[0]
        live = LiveInspection(nominal, ZONE, coverage_min=0.95, provisional=False)
        live.add(points)
        try:
            tally[f"{live.finish().verdict.name}, not named"] += 1
        except InspectionError as error:
            tally["named as mirrored" if "mirror" in str(error).lower() else "refused for another reason"] += 1
    say(f"mirrored: 100 parts with a dent of 0.2 mm; {dict(tally)}")


TABLES = {"live": live_table, "zones": zones_table, "partial": partial_table, "mirrored": mirrored_table}


def main(names: list[str]) -> None:
    say(f"inspection from {Path(inspection.__file__).parent}")
    for name in names or list(TABLES):
        began = time.process_time()
        TABLES[name]()
        say(f"{name}: {time.process_time() - began:.0f} s of processor time")


if __name__ == "__main__":
    main(sys.argv[1:])
