"""Check an inspection run without the program that made it.

    python verify.py FOLDER [--head SHA256]

FOLDER is what `cmmlink export RUN --out FOLDER` wrote. This file needs Python 3.11 and numpy, imports nothing of cmmlink and shares no
algorithm with it. It says in words what it proved, what is not true, and what it did not check. Exit status: 0 nothing is untrue,
1 something is, 2 the evidence cannot be read. --head is the hash that was printed in the report, or sent elsewhere, on the day.

The formulas, in the order in which they are used:

    chain       hash_k = SHA-256(hash_{k-1}, number, run, kind, time, count, length, body)
    placement   p = R(angle) s + t, where s are the coordinates of a point in the section's plane
    deviation   d = sign * min_u |p - C(u)| - r, positive out of material; r is the radius of the probe's tip, 0 for surface points
    station     s(u) = integral of |C'| from the start of the curve
    coverage    sum of the gaps between neighbouring stations that are no longer than allowed, by the length of the curve
    refutation  |d(p) - d(q)| <= |p - q|. So a box of placements, in which point i moves by at most m_i, holds none that passes where
                d_i - m_i > upper limit or d_i + m_i < lower limit for one i. Boxes that are not refuted are halved.
"""

import csv
import hashlib
import json
import math
import sys
from pathlib import Path
from typing import Any

import numpy as np

Array = Any  # of numpy; docstrings give the shapes
Bodies = dict[str, list[bytes]]  # of the records, by kind
Plan = dict[str, Any]  # values by their dotted paths

SAME_MM = 1e-9  # two numbers of millimetres that differ by less are taken as one
SMALLEST_MM, MOST_BOXES = 1e-6, 100_000  # boxes of placements are halved until points move by less in them, or there are more
ZONE = ("lower_mm", "upper_mm", "uncertainty_mm")
OTHER_REASONS = ("begun-anew", "announced", "fit", "outline", "ends")
ORDER = ["conform", "uncertain", "nonconform"]  # from the best verdict to the worst
GAUSS, GAUSS_WEIGHTS = np.polynomial.legendre.leggauss(16)


class Findings(dict[str, list[str]]):
    """Sentences by what became of them: Proved, NOT TRUE, Not checked."""

    def say(self, holds: object, sentence: str, detail: str = "") -> None:
        """Put a sentence where it belongs; None says that nothing was checked."""
        heap = "Not checked" if holds is None else "Proved" if holds else "NOT TRUE"
        self.setdefault(heap, []).append(sentence + (f" ({detail})" if detail else ""))


def read_records(folder: Path, findings: Findings, head: str | None) -> Bodies:
    """Bodies by kind, after recomputing every hash over them."""
    data, offset = (folder / "records.bin").read_bytes(), 0
    bodies: Bodies = {}
    before, last, broken = None, "", []
    run = json.loads((folder / "run.json").read_text(encoding="utf-8"))["run"]
    for row in csv.DictReader((folder / "chain.csv").read_text(encoding="utf-8").splitlines()):
        number, body = int(row["number"]), data[offset : offset + int(row["bytes"])]
        offset += int(row["bytes"])
        stated = f"{number}\n{run}\n{row['kind']}\n{float(row['time_s'])!r}\n{int(row['count'])}\n{len(body)}\n".encode()
        sound = hashlib.sha256(bytes.fromhex(row["previous_sha256"]) + stated + body).hexdigest() == row["sha256"]
        if not sound or (before and not last and before != (number - 1, row["previous_sha256"])):  # others may stand behind the end
            broken.append(f"not so: record {number}, {row['kind']}")
        before = number, row["sha256"]
        bodies.setdefault(row["kind"], []).append(body)
        last = row["sha256"] if row["kind"] == "end" else last
    findings.say(
        not broken and offset == len(data), f"Every record of run {run} is as it was hashed, and none is missing.", "; ".join(broken[:3])
    )
    findings.say("end" in bodies, "The records reach to the end of the run.")
    anew = "Nothing, hashes included, was written anew since: the last hash is the one that was kept elsewhere."
    findings.say(last == head.lower() if head else None, anew, "" if head else "give the hash from the report with --head")
    return bodies


def compare_files(folder: Path, bodies: Bodies, findings: Findings) -> Any:
    """The files that people read, against the records that are hashed. Gives the result as recorded."""
    for path, kind in ((folder / "plan.yaml", "plan"), (next(folder.glob("nominal-*")), "nominal")):
        findings.say(path.read_bytes() == bodies[kind][0], f"{path.name} is what was recorded.")
    told, kept = json.loads((folder / "result.json").read_text(encoding="utf-8")), json.loads(bodies["result"][0])
    findings.say({**told, **kept} == told, "result.json says what was recorded.")
    return kept


def read_plan(text: str) -> Plan:
    """Values of a plan as it is recorded, YAML in block style, by their dotted paths: probe.tip_radius_mm, section.normal.0."""
    values: Plan = {}
    items: dict[Any, int] = {}
    path: list[tuple[int, Any]] = []  # depth and name of every key and list item that is open
    for row in text.splitlines():
        depth, line = len(row) - len(row.lstrip()), row.strip()
        while line.startswith("- "):
            path = [(d, name) for d, name in path if d < depth or (d == depth and not isinstance(name, int))]
            items[tuple(path)] = items.get(tuple(path), -1) + 1
            path.append((depth, items[tuple(path)]))
            depth, line = depth + 2, line[2:]
        key, colon, value = line.partition(":")
        if colon:
            path = [(d, name) for d, name in path if d < depth] + [(depth, key)]
        if value.strip() or not colon:
            values[".".join(str(name) for _, name in path)] = read_scalar(value.strip() if colon else line)
    return values


def read_scalar(text: str) -> Any:
    """A plain value of YAML."""
    try:
        return {"null": None, "true": True, "false": False, "[]": None, "{}": None}.get(text, text) if text[:1] in "ntf[{" else float(text)
    except ValueError:
        return text.strip("'\"")


class Curve:
    """The nominal as short Bezier pieces (n, degree + 1, 3) in homogeneous coordinates, each turning by less than a tenth of a radian."""

    def __init__(self, stated: dict[str, Any]) -> None:
        degree, knots = int(stated["degree"]), np.array(stated["knots"], dtype=float)
        weights = np.array(stated["weights"], dtype=float)
        control = np.column_stack([np.array(stated["control_points_mm"], dtype=float) * weights[:, None], weights])
        size = np.hypot(*np.ptp(control[:, :2] / weights[:, None], axis=0))
        waiting = [(k, knots[k], knots[k + 1]) for k in range(degree, len(control)) if knots[k + 1] > knots[k]][::-1]
        found = []
        while waiting:
            span, first, last = waiting.pop()
            piece = np.array([blossom(knots, control, degree, span, [first] * (degree - j) + [last] * j) for j in range(degree + 1)])
            legs = np.diff(piece[:, :2] / piece[:, 2:], axis=0)
            long, turn = np.hypot(*legs.T).sum(), np.ptp(np.unwrap(np.arctan2(legs[:, 1], legs[:, 0])))
            if long > size / 100 or (turn > 0.1 and long > 1e-7 * size):
                waiting += [(span, (first + last) / 2, last), (span, first, (first + last) / 2)]
            else:
                found.append(piece)
        self.pieces, self.closed, self.size = np.array(found), bool(stated["closed"]), float(size)
        self.outward = -1.0 if stated["material"] == "left" else 1.0  # how the left normal points: out of the material or into it
        polygon = self.pieces[:, :, :2] / self.pieces[:, :, 2:]
        self.centre, self.box = polygon.mean(axis=1), (polygon.min(axis=(0, 1)), polygon.max(axis=(0, 1)))
        self.radius = np.linalg.norm(polygon - self.centre[:, None], axis=2).max(axis=1)
        self.start = np.concatenate([[0.0], np.cumsum(self.arc(np.arange(len(found)), np.ones(len(found))))])
        self.length = self.start[-1]

    def at(self, piece: Any, t: Array) -> tuple[Array, Array]:
        """Points and first derivatives (m, 2) at the parameters t (m,) of pieces (m,), by de Casteljau."""
        rows, t = self.pieces[piece], np.asarray(t)[:, None, None]
        while rows.shape[1] > 2:
            rows = (1 - t) * rows[:, :-1] + t * rows[:, 1:]
        value, slope = (1 - t[:, 0]) * rows[:, 0] + t[:, 0] * rows[:, 1], (self.pieces.shape[1] - 1) * (rows[:, 1] - rows[:, 0])
        point = value[:, :2] / value[:, 2:]
        return point, (slope[:, :2] - slope[:, 2:] * point) / value[:, 2:]

    def arc(self, piece: Any, t: Array) -> Array:
        """Length (m,) of pieces from their beginning to t."""
        total = np.zeros(len(piece))
        for node, weight in zip(GAUSS, GAUSS_WEIGHTS, strict=True):
            total += weight / 2 * t * np.linalg.norm(self.at(piece, t * (node + 1) / 2)[1], axis=1)
        return total

    def closest(self, points: Array) -> tuple[Array, Array]:
        """Signed distances (m,), positive out of material, and stations (m,) of the closest points."""
        if len(points) > 2000:
            parts = [self.closest(points[k : k + 2000]) for k in range(0, len(points), 2000)]
            return np.concatenate([part[0] for part in parts]), np.concatenate([part[1] for part in parts])
        apart = np.linalg.norm(points[:, None] - self.centre, axis=2)
        row, piece = np.nonzero(apart - self.radius <= (apart + self.radius).min(axis=1)[:, None])
        q = points[row]

        def along(t: Array) -> Array:  # of the connecting line: it changes its sign where the distance is smallest
            point, slope = self.at(piece, t)
            return ((point - q) * slope).sum(axis=1)

        low, high = np.zeros(len(row)), np.ones(len(row))
        low[along(high) <= 0] = 1.0
        high[along(low) >= 0] = low[along(low) >= 0]
        for _ in range(54):
            middle = (low + high) / 2
            ahead = along(middle) < 0
            low, high = np.where(ahead, middle, low), np.where(ahead, high, middle)
        point, slope = self.at(piece, low)
        away, distance = q - point, np.linalg.norm(q - point, axis=1)
        nearest = np.full(len(points), np.inf)
        np.minimum.at(nearest, row, distance)
        chosen = distance <= nearest[row] + 1e-11 * self.size  # where two pieces meet, the mean of both normals gives the sign
        normal = np.zeros((len(points), 2))
        left = np.column_stack([-slope[:, 1], slope[:, 0]]) / np.linalg.norm(slope, axis=1)[:, None]
        np.add.at(normal, row[chosen], left[chosen])
        side, station = np.zeros(len(points)), np.zeros(len(points))
        np.add.at(side, row[chosen], (away * normal[row]).sum(axis=1)[chosen])
        station[row[distance == nearest[row]]] = (self.start[piece] + self.arc(piece, low))[distance == nearest[row]]
        return self.outward * np.where(side < 0, -nearest, nearest), station


def blossom(knots: Array, control: Array, degree: int, span: int, at: list[Any]) -> Array:
    """Bezier points are values of the polar form of a B-spline, here at the arguments `at` (degree,), by de Boor's recursion."""
    rows = control[span - degree : span + 1].copy()
    for r in range(1, degree + 1):
        for j in range(degree, r - 1, -1):
            first, last = knots[j + span - degree], knots[j + 1 + span - r]
            share = (at[r - 1] - first) / (last - first)
            rows[j] = (1 - share) * rows[j - 1] + share * rows[j]
    return rows[degree]


def read_deviations(bodies: Bodies) -> list[Any]:
    """Of every received point: the actual point (m, 2), station, deviation and reason of rejection (m,), as recorded."""
    columns = []
    for body in bodies.get("deviations", []):
        n = len(body) // 50
        values = [np.frombuffer(body, "<f8", n * width, 8 * n * at).reshape(n, width) for at, width in ((0, 2), (4, 1), (5, 1))]
        columns.append((values[0], values[1][:, 0], values[2][:, 0], np.frombuffer(body, "i1", n, 49 * n)))
    return [np.concatenate(column) for column in zip(*columns, strict=True)]


def read_points(bodies: Bodies, plan: Plan) -> Array:
    """Coordinates (m, 2) in the plane of the section as the points came, at the reference temperature where the plan says so."""
    counts = [len(body) // 40 for body in bodies.get("points", [])]
    parts = [np.frombuffer(body, "<f8", 3 * n, 16 * n).reshape(n, 3) for body, n in zip(bodies.get("points", []), counts, strict=True)]
    origin, normal, x = (np.array([plan[f"section.{key}.{k}"] for k in range(3)]) for key in ("origin_mm", "normal", "x_axis"))
    normal /= np.linalg.norm(normal)
    x -= (x @ normal) * normal
    x /= np.linalg.norm(x)
    flat = (np.concatenate(parts) - origin) @ np.column_stack([x, np.cross(normal, x)])
    if plan.get("temperature.compensate"):
        fixed = np.array([plan["temperature.fixed_mm.0"], plan["temperature.fixed_mm.1"]])
        growth = plan["temperature.cte_per_k"] * (plan["temperature.part_c"] - plan["temperature.reference_c"])
        flat = fixed + (flat - fixed) / (1 + growth)
    return flat


def placed(points: Array, angle: float, shift: Array) -> Array:
    """R(angle) s + t of points s (m, 2)."""
    c, s = math.cos(angle), math.sin(angle)
    return points @ np.array([[c, s], [-s, c]]) + shift


def measured_share(stations: Array, curve: Curve, allowed: float) -> tuple[float, float]:
    """Coverage and the longest gap."""
    s = np.sort(stations)
    gaps = np.diff(s, append=s[0] + curve.length) if curve.closed else np.diff(s, prepend=0.0, append=curve.length)
    return gaps[gaps <= allowed].sum() / curve.length, gaps.max()


def refute_every_placement(flat: Array, curve: Curve, radius: float, lower: float, upper: float) -> Array | None:
    """Show that no placement has all deviations within lower .. upper. Gives None, or a placement that was not refuted.

    Starts from all angles and all places where the middle of the points lies in the box of the curve. Few points are tried at first,
    and of every box that resists the worst at its middle.
    """
    arms = flat - flat.mean(axis=0)
    reach = np.hypot(arms[:, 0], arms[:, 1])
    low, high = curve.box
    step = np.array([math.pi, *((high - low) / 2 + max(abs(lower), abs(upper)) + radius)])
    boxes, telling = np.array([[0.0, *((low + high) / 2)]]), np.unique(np.linspace(0, len(flat) - 1, 24).astype(int))
    while len(boxes):
        axis = int(np.argmax(step * [max(reach.max(), 1e-9), 1, 1]))  # the side along which points move farthest is halved
        step = np.where(np.arange(3) == axis, step / 2, step)
        offset = np.where(np.arange(3) == axis, step, 0)
        boxes = np.concatenate([boxes - offset, boxes + offset])
        travel = 2 * reach * np.sin(min(step[0], math.pi) / 2) + np.hypot(step[1], step[2])
        places = np.stack([placed(arms[telling], box[0], box[1:]) for box in boxes])
        excess = excesses(places.reshape(-1, 2), curve, radius, lower, upper).reshape(len(boxes), -1)
        held = ~(excess > travel[telling]).any(axis=1)
        boxes = boxes[held][np.argsort(excess[held].max(axis=1))]
        for box in boxes[:2]:
            beyond = excesses(placed(arms, box[0], box[1:]), curve, radius, lower, upper)
            if beyond.max() <= 0:
                return box
            telling = np.union1d(telling, [np.argmax(beyond)])
        if len(boxes) > MOST_BOXES or (len(boxes) and travel.max() < SMALLEST_MM):
            return boxes[0]
    return None


def excesses(points: Array, curve: Curve, radius: float, lower: float, upper: float) -> Array:
    """How far (m,) the deviations of points (m, 2) lie beyond the limits, negative inside."""
    deviation = curve.closest(points)[0] - radius
    return np.maximum(deviation - upper, lower - deviation)


def check_deviations(bodies: Bodies, plan: Plan, result: Any, curve: Curve, findings: Findings) -> tuple[Array, Array, Array]:
    """Every deviation anew. Gives the section points, and the deviations and stations of the points that were judged."""
    flat, radius, pose = read_points(bodies, plan), plan["probe.tip_radius_mm"], result["registration"]
    actual, station, recorded, rejection = read_deviations(bodies)
    findings.say(len(flat) == len(rejection), "Every point that came has a deviation, or a reason to have none.")
    kept, flat = rejection == 0, np.resize(flat, (len(rejection), 2))
    judged = placed(flat[kept], math.radians(pose["rotation_deg"]), np.array(pose["translation_mm"]))
    distance, along = curve.closest(judged)
    off = np.abs(distance - radius - recorded[kept]).max(initial=0)
    findings.say(off <= SAME_MM, "Every deviation follows from points, placement and nominal.", f"largest difference {off:.1e} mm")
    moved = np.abs(np.linalg.norm(actual[kept] - judged, axis=1) - radius).max(initial=0)
    apart = np.abs(along - station[kept])
    apart = np.minimum(apart, curve.length - apart if curve.closed else apart).max(initial=0)
    findings.say(moved <= SAME_MM and apart <= 1e-6, "So do the places and the stations.", f"largest difference {max(moved, apart):.1e} mm")
    counts = [result[key] for key in ("received", "judged", "rejected")]
    findings.say(counts == [len(kept), kept.sum(), (~kept).sum()], "The received, judged and rejected points are counted rightly.")
    return flat[kept], distance - radius, along


def stated_zone(plan: Plan, result: Any, findings: Findings) -> list[float] | None:
    """Lower limit, upper limit and U of the first profile, held against the plan; None where that is no plain zone."""
    wanted, found = [plan.get(f"tolerance.{key}") for key in ZONE], [result["tolerance"][key] for key in ZONE]
    if wanted[0] is None:  # then the zone is one of the characteristics
        first = next((f"characteristics.{k}." for k in range(999) if plan.get(f"characteristics.{k}.type") == "line-profile"), "")
        told = {key.removeprefix(first): value for key, value in plan.items() if key.startswith(first)}
        if not first or any(told.get(key) is not None for key in ("region", "from", "filter", "within_mm", "zone.stations_mm")):
            return None
        wanted = [told["zone.lower_mm"], told["zone.upper_mm"], told["uncertainty_mm"]]
        if told["zone.width_mm"] is not None:
            half = told["zone.width_mm"] / 2 + (told["zone.offset_mm"] or 0.0)
            outward = half if told["zone.outward_mm"] is None else told["zone.outward_mm"]
            wanted[:2] = [outward - told["zone.width_mm"], outward]
    if any(key.startswith(("uncertainty.", "temperature.")) for key in plan):
        findings.say(None, f"How U = {found[2]:g} mm follows from the budget: it is taken as stated.")
        wanted[2] = None
    same = all(value is None or abs(value - stated) < SAME_MM for value, stated in zip(wanted, found, strict=True))
    findings.say(same, f"The limits, {found[0]:g} .. {found[1]:g} mm, and U are those of the plan.")
    return found


def check_verdict(flat: Array, deviation: Array, along: Array, plan: Plan, result: Any, curve: Curve, findings: Findings) -> None:
    """The verdict on the first profile, from what was derived anew and from nothing else."""
    zone = stated_zone(plan, result, findings)
    if zone is None:
        findings.say(None, "The verdict on the first profile: it has a region, a filter or a varying zone.")
        return
    lower, upper, uncertainty = zone
    guard = 0.0 if plan["decision_rule"] == "simple" else uncertainty
    beyond = (deviation > upper + guard) | (deviation < lower - guard)
    extremes = {"max_deviation_mm": deviation.max(), "min_deviation_mm": deviation.min(), "profile_error_mm": 2 * abs(deviation).max()}
    right = all(abs(result[key] - value) <= 2 * SAME_MM for key, value in extremes.items()) and result["out_of_tolerance"] == beyond.sum()
    findings.say(right, "The extreme deviations and the number of points out of tolerance are right.")
    allowed, unseen = plan["gap_max_mm"] or curve.length / 100, plan["allow.unseen_mm"]
    share, gap = measured_share(along, curve, allowed)
    same = abs(share - result["coverage"]) < 1e-6 and abs(gap - result["largest_gap_mm"]) < 1e-6
    findings.say(same, f"{share:.1%} of the profile was measured, and the longest gap is {gap:.3f} mm.")
    missing = result["lost"] > 0 or result["damaged_bytes"] or result["received"] != result["judged"]
    doubts = {
        "the scan did not come to its end": not result["complete"],
        "points are missing": missing and (unseen is None or gap > unseen),
        "too little was measured": share < plan["registration.coverage_min"],
        "a gap is too long": gap > allowed * (1 + 1e-9),
        "points are out or in doubt": ((deviation > upper - guard) | (deviation < lower + guard)).any(),
        "the record names another reason": any(one["kind"] in OTHER_REASONS for one in result["reasons"]),
    }
    doubt = "; ".join(words for words, holds in doubts.items() if holds)
    verdict = next((one["verdict"] for one in result["characteristics"] if one["type"] == "line-profile"), result["verdict"])
    if verdict != "nonconform":
        findings.say((verdict == "conform") != bool(doubt), f"{'CONFORM' if verdict == 'conform' else 'NOT PROVEN'} follows.", doubt)
    elif result["fit"] == "none":
        findings.say(beyond.any(), "NOT CONFORM follows: a point is out at the known placement.")
    elif result["rule"] == "best-fit":
        findings.say(None, "NOT CONFORM by the best fit: that the placement is the best fit.")
    else:
        left = refute_every_placement(flat, curve, plan["probe.tip_radius_mm"], lower - guard, upper + guard)
        findings.say(left is None, "NOT CONFORM follows: no placement passes.", "" if left is None else f"not refuted: {left}")
    worst = max((one["verdict"] for one in result["characteristics"]), key=ORDER.index, default=verdict)
    findings.say(result["verdict"] == worst, f"The verdict on the part is the worst of all, {worst}.")
    for one in result["characteristics"][1:]:
        findings.say(None, f"The value of the characteristic {one['name']}.")


def check_nominal(bodies: Bodies, plan: Plan, curve: Curve, findings: Findings) -> None:
    """Whether the curve runs through the points of the nominal's file, where that holds a pair of numbers in every line."""
    rows = [line.replace(",", " ").replace(";", " ").split() for line in bodies["nominal"][0].decode("latin-1").splitlines()]
    try:
        points = np.array([[float(a), float(b)] for a, b in [row for row in rows if row][1:]]) * float(plan["nominal.scale"])
    except ValueError:
        findings.say(None, "That the curve in nominal.json is the one of the nominal's file.")
        return
    off = np.abs(curve.closest(points)[0]).max()
    findings.say(off <= 1e-7, f"The curve runs through the {len(points)} points of the nominal's file.", f"largest distance {off:.1e} mm")


def check(folder: Path, head: str | None = None) -> Findings:
    """Check the evidence in a folder. Raises what reading raises: OSError, ValueError, LookupError, TypeError."""
    findings = Findings()
    bodies = read_records(folder, findings, head)
    if "NOT TRUE" in findings:  # nothing that is derived from altered records would prove anything
        return findings
    result = compare_files(folder, bodies, findings)
    plan = read_plan(bodies["plan"][0].decode("utf-8"))
    curve = Curve(json.loads((folder / "nominal.json").read_text(encoding="utf-8")))
    check_nominal(bodies, plan, curve, findings)
    check_verdict(*check_deviations(bodies, plan, result, curve, findings), plan, result, curve, findings)
    return findings


def main(arguments: list[str]) -> int:
    """Check what the command line names, print the findings and give the exit status."""
    if len(arguments) not in (1, 3):
        print(__doc__)
        return 2
    try:
        findings = check(Path(arguments[0]), arguments[2] if len(arguments) == 3 else None)
    except (OSError, ValueError, LookupError, TypeError, StopIteration) as error:
        print(f"The evidence cannot be read: {type(error).__name__}: {error}")
        return 2
    print(*(f"{heap}: {sentence}" for heap, sentences in findings.items() for sentence in sentences), sep="\n")
    return 1 if "NOT TRUE" in findings else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
