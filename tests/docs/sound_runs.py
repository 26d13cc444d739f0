"""Runs of every kind, recorded as a station records them, exported, and checked by docs/verify/verify.py: `make verifier`.

No run was altered, so that the verifier may find nothing untrue. Then some are altered, with the chain computed anew by somebody who
knows how, and each alteration has to be found. Every run follows from its number alone.
"""

import argparse
import sys
import tempfile
import threading
import time
from collections import Counter
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from datetime import UTC, datetime
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from numpy.typing import NDArray

from cmmlink.devices import Connected
from cmmlink.from_plan import profile_of
from cmmlink.nominal_files.nurbs_yaml import save_nurbs_yaml
from cmmlink.plan import load_plan
from cmmlink.record import export_run, open_to_read
from cmmlink.run import carry_out
from docs.verify import verify
from drivers import Damaged, Lost, PointBatch, Rejected, ScanClosed, ScanOpened
from inspection import NurbsCurve
from tests.docs.evidence import ALTERATIONS, Evidence
from tests.inspection import profiles
from tests.integration.listed import Listed

Array = NDArray[np.float64]

CURVES: dict[str, Callable[[], NurbsCurve]] = {
    "NACA 4412, sharp": lambda: profiles.naca("4412"),
    "NACA 2412, blunt": lambda: profiles.naca("2412", sharp=False),
    "open, degree 2": profiles.p1,
    "open, rational": profiles.p2,
    "closed, degree 4": profiles.p3,
    "ellipse": lambda: profiles.ellipse(40.0, 25.0),
    "stadium": lambda: profiles.stadium(30.0, 12.0),
    "square": lambda: profiles.square(50.0),
}
ZONE_MM = 0.05


@dataclass(frozen=True)
class Made:
    """A run as it was recorded and exported: `words` say of what kind it is."""

    folder: Path
    words: tuple[str, ...]
    verdict: str


@cache
def curve_of(name: str) -> NurbsCurve:
    return CURVES[name]()


def make_run(number: int, folder: Path) -> Made | None:
    """Record and export the run of a number; None where its set-up is refused, which is no evidence."""
    rng = np.random.default_rng(number)
    name = list(CURVES)[number % len(CURVES)]
    curve, words = curve_of(name), [name]
    plan: dict[str, Any] = {
        "part": {"name": "part"},
        "nominal": {"file": "nominal.yaml"},
        "device": {"type": "file", "file": "none.csv"},
        "tolerance": {"lower_mm": -ZONE_MM, "upper_mm": ZONE_MM},
        "registration": {},
        "discretisation": {"samples": 600},
        "out": {"folder": None},
    }
    points = _points(curve, rng, plan, words)
    _decide(rng, plan, words, curve)
    arrivals = list(_arrivals(points, rng, words))
    folder.mkdir(parents=True)
    save_nurbs_yaml(curve, folder / "nominal.yaml")
    (folder / "plan.yaml").write_text(yaml.safe_dump(plan), encoding="utf-8")
    read = load_plan(folder / "plan.yaml")
    profile = profile_of(read)
    device = Connected(Listed(arrivals), "listed", simulated=True)
    settings: dict[str, Any] = {
        "records": folder / "kept",
        "clock": time.monotonic,
        "now": lambda: datetime.now(UTC),
        "stop": threading.Event(),
    }
    done = carry_out(read, profile, device, **settings)
    if done.outcome.result is None or done.evidence is None:
        return None
    with open_to_read(folder / "kept", settings["now"]) as store:
        export_run(store, done.evidence.run, folder / "evidence")
    return Made(folder / "evidence", tuple(words), done.outcome.result.verdict.word)


def _points(curve: NurbsCurve, rng: np.random.Generator, plan: dict[str, Any], words: list[str]) -> Array:
    """Points (n, 3) of a part, as a device would send them."""
    count = int(rng.integers(120, 260))
    u = profiles.even_in_arc_length(curve, count)
    s = np.arange(count) / count
    form = 0.4 * ZONE_MM * np.sin(2 * np.pi * (rng.integers(2, 6) * s + rng.random())) + rng.normal(0, 0.05 * ZONE_MM, count)
    kind = rng.choice(["good", "good", "good", "dent", "large waves", "near the limit"])
    if kind == "dent":
        form[count // 3 : count // 3 + 6] += 5 * ZONE_MM
    form *= {"large waves": 4.0, "near the limit": 2.2}.get(kind, 1.0)
    tip = float(rng.choice([0.0, 0.0, 0.5]))
    u_kept = np.ones(count, dtype=bool)
    hole = rng.choice(["whole", "whole", "whole", "a gap", "partial"])
    u_kept[: {"a gap": 6, "partial": count // 3}.get(hole, 0)] = False
    outward = np.asarray(-(form + tip)) * (1 if _is_left(curve) else -1)
    flat = profiles.offset_points(curve, u, outward)[u_kept]
    if rng.random() < 0.15:
        flat, kind = rng.permutation(flat), f"{kind}, out of order"
    words += [kind, hole] + (["ball centres"] if tip else [])
    plan["probe"] = {"tip_radius_mm": tip}
    if not curve.closed and rng.random() < 0.4:
        ends = curve.point(np.array(curve.domain))
        way = ends[1] - curve.point(np.array([curve.domain[1] - 1e-3]))[0]
        flat = np.vstack([flat, ends[1] + way / np.hypot(*way) * rng.choice([0.02, 2.0])])
        words.append("beyond an end")
    pose = rng.choice(["fitted", "fitted", "fitted", "datum", "none"])
    if rng.random() < 0.1 and pose == "fitted":
        flat = np.vstack([flat, flat[0] + 3.0])
        plan["registration"]["reject_outliers"] = True
        words.append("an outlier")
    words.append({"fitted": "free"}.get(pose, str(pose)))
    angle, shift = float(rng.uniform(-180, 180)), rng.uniform(-200, 200, 2)
    if pose == "none":
        plan["registration"]["fit"] = "none"
        angle, shift = 0.0, np.zeros(2)
    elif pose == "datum":
        back = profiles.rotated(shift[None], -angle)[0]
        plan["registration"]["datum"] = {"rotation_deg": -angle, "translation_mm": [-float(back[0]), -float(back[1])]}
    flat = profiles.rotated(flat, angle, shift)
    if not tip and rng.random() < 0.1:
        words.append("warm")
        flat = (1 + 11.5e-6 * 40.0) * flat
        plan["temperature"] = {"part_c": 60.0, "cte_per_k": 11.5e-6, "compensate": True, "fixed_mm": [0, 0]}
    machine = np.column_stack([flat, np.zeros(len(flat))])
    if rng.random() < 0.2:
        plan["section"] = {"origin_mm": [1.0, 2.0, 3.0], "normal": [0.0, -1.0, 0.0], "x_axis": [1.0, 0.0, 0.0], "off_plane_max_mm": 0.5}
        machine = np.array([1.0, 2.0, 3.0]) + np.column_stack([flat[:, 0], np.zeros(len(flat)), flat[:, 1]])
        machine[7, 1] += float(rng.choice([0.0, 2.0]))
        words.append("x z plane")
    return machine


def _is_left(curve: NurbsCurve) -> bool:
    """Whether material is on the left of a curve: it is inside a closed one, and an open one is told so."""
    if not curve.closed:
        return True
    points = curve.point(np.linspace(*curve.domain, 400))
    turn = points[:-1, 0] * points[1:, 1] - points[:-1, 1] * points[1:, 0]
    return bool(turn.sum() > 0)


def _decide(rng: np.random.Generator, plan: dict[str, Any], words: list[str], curve: NurbsCurve) -> None:
    """What decides: rule, weights, U, what may be missing, and what is asked besides the profile."""
    free = "free" in words
    if not curve.closed:
        plan["nominal"]["material"] = "left"
    if free:
        plan["registration"]["fit"] = str(rng.choice(["best-fit", "best-fit", "minimum-zone"]))
        plan["rule"] = str(rng.choice(["minimum-zone", "best-fit"]))
        plan["weights"] = str(rng.choice(["arc-length", "arc-length", "points"]))
        words += [plan["registration"]["fit"], f"rule {plan['rule']}"]
    if "temperature" not in plan and rng.random() < 0.4:
        plan["tolerance"]["uncertainty_mm"] = 0.004
        plan["decision_rule"] = str(rng.choice(["iso-14253-1", "ilac-g8", "simple"]))
        words.append(plan["decision_rule"])
    if rng.random() < 0.2:
        plan["tolerance"] |= {"lower_mm": -0.02, "upper_mm": 0.08}
        words.append("unequal zone")
    if rng.random() < 0.3:
        plan["allow"] = {"unseen_mm": float(rng.choice([1.0, 20.0, 200.0]))}
        words.append("unseen allowed")
    if rng.random() < 0.2:
        plan["gap_max_mm"] = 12.0
    if rng.random() < 0.2:
        plan["registration"]["coverage_min"] = 0.5
    if rng.random() < 0.06:
        plan["registration"]["method"] = "pcp"
        words.append("pcp")
    if rng.random() < 0.3:
        words.append("characteristics")
        plan["characteristics"] = [
            {"name": "form", "type": "line-profile", "zone": {"width_mm": 0.1}, "fit": "best-fit", "rule": "best-fit"},
            {
                "name": "part of it",
                "type": "line-profile",
                "zone": "0.12 UZ +0.01",
                "from": {"station_mm": 10},
                "to": {"station_mm": 60},
                "fit": "none",
            },
            {"name": "smallest", "type": "line-profile", "zone": {"lower_mm": -0.05, "upper_mm": 0.05}, "fit": "minimum-zone"},
        ]
        if rng.random() < 0.5:
            zone = {"stations_mm": [0, 30, 60], "lower_mm": [-0.05, -0.06, -0.04], "upper_mm": [0.05, 0.04, 0.05], "between": "linear"}
            plan["characteristics"].append({"name": "varying", "type": "line-profile", "zone": zone, "fit": "tolerance"})


def _arrivals(points: Array, rng: np.random.Generator, words: list[str]) -> Iterable[Any]:
    """What a device would say: the points in batches, and what is wrong with them."""
    fault = str(rng.choice(["sound"] * 8 + ["lost", "damaged", "repeated", "unusable", "announced", "not closed", "not a number"]))
    if fault != "sound":
        words.append(fault)
    sequence, announced, half = np.arange(len(points), dtype=np.int64), len(points), len(points) // 2
    if fault == "lost":
        sequence[half:] += 3
        announced += 3
    if fault == "not a number":
        points = points.copy()
        points[half] = np.nan
    yield ScanOpened("listed", "1", announced + 5 * (fault == "announced"))
    time_s: Array = np.arange(len(points), dtype=np.float64) / 1000
    yield PointBatch(sequence[:half].copy(), time_s[:half].copy(), points[:half].copy())
    if fault == "lost":
        yield Lost(3, "the counter says so")
    if fault == "damaged":
        yield Damaged(20, "no frame")
    if fault == "repeated":
        yield Rejected(2, "point repeated")
    if fault == "unusable":
        yield Rejected(2, "marked invalid by the device")
    yield PointBatch(sequence[half:].copy(), time_s[half:].copy(), points[half:].copy())
    if fault != "not closed":
        yield ScanClosed(None)


def main() -> int:
    """Make runs, check them, alter some, and print what came of it."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("runs", type=int, nargs="?", default=200)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--altered", type=int, default=60)
    asked = parser.parse_args()
    seen, wrong, unsaid, kept = Counter[str](), list[str](), Counter[str](), list[tuple[int, Made]]()
    with tempfile.TemporaryDirectory() as folder:
        number, sound, took = asked.first, 0, 0.0
        while sound < asked.runs:
            made = make_run(number, Path(folder) / str(number))
            if made is not None:
                sound += 1
                start = time.process_time()
                findings = verify.Check(made.folder).findings
                took += time.process_time() - start
                kept.append((number, made))
                seen.update([*made.words, f"verdict {made.verdict}"])
                unsaid.update(one.split(" (")[0].split(": ")[-1] for one in findings.get("Not checked", []))
                for untrue in findings.get("NOT TRUE", []):
                    wrong.append(f"{number} ({', '.join(made.words)}; {made.verdict}): {untrue}")
                    print(wrong[-1], flush=True)
            else:
                seen["refused as NOT MEASURED"] += 1
            number += 1
        found = _alter(kept, asked.altered, Path(folder), wrong)
    for word, many in sorted(seen.items()):
        print(f"{many:5d}  {word}")
    print(f"{sound} sound runs, {len(wrong)} untrue sentences, {took:.0f} s of the processor for the verifier; {found} alterations found")
    for sentence, many in unsaid.most_common(12):
        print(f"{many:5d}  not checked: {sentence}")
    print(*wrong, sep="\n")
    return 1 if wrong else 0


def _alter(kept: list[tuple[int, Made]], most: int, folder: Path, wrong: list[str]) -> int:
    """Alter runs, each in one way; tell those that are not found."""
    rng, found, tried = np.random.default_rng(1), 0, 0
    names = list(ALTERATIONS)
    while tried < most and kept:
        number, made = kept[int(rng.integers(len(kept)))]
        name = names[tried % len(names)]
        evidence = Evidence(made.folder).copy(folder / f"altered-{tried}")
        tried += 1
        if not ALTERATIONS[name](evidence):
            continue
        if "NOT TRUE" in verify.Check(evidence.folder).findings:
            found += 1
        else:
            wrong.append(f"{number} ({', '.join(made.words)}; {made.verdict}), altered: {name}: NOT FOUND")
    return found


if __name__ == "__main__":
    sys.exit(main())
