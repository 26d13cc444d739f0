"""Check an inspection run without the program that made it.

    python verify.py FOLDER [--head SHA256] [--key HEX]

FOLDER is what `cmmlink export RUN --out FOLDER` wrote. Needs Python 3.11 and numpy. Exit status: 0 nothing is untrue, 1 something is, 2 the
evidence cannot be read. --head is the hash that left the station on the day; --key is the station's public key, or the first 16 digits of
its SHA-256. Take both from elsewhere than the folder: README.md, which stands beside this file, says from where, and has the formulas.
"""

import csv
import hashlib
import json
import math
import re
import sys
from pathlib import Path
from typing import Any

import numpy as np

Array = Any  # of numpy; docstrings give the shapes
SAME_MM, FITTED_MM = 1e-9, 1e-6  # numbers of millimetres that differ by less are taken as one; those that come of a fit
SMALLEST_MM, MOST_BOXES, BEYOND_END = 1e-6, 50_000, 3  # where a search ends; the code of a point that lies beyond an end
HARMLESS = ("frame repeated", "point repeated", "value repeated", "older than the scan")  # of such points none is missing
UNPROVED = ("aborted", "fit", "outline", "placement", "datum", "no-value", "proven-out")  # reasons that are taken from the record
NUMBER = re.compile(r"-?(0|[1-9]\d*)(\.\d+)?(e[+-]?\d+)?$|(null|true|false|\[\]|\{\})$")  # what YAML and JSON spell alike
GAUSS = np.transpose(np.polynomial.legendre.leggauss(16))  # nodes and weights of the quadrature
PRIME, GROUP = 2**255 - 19, 2**252 + 27742317777372353535851937790883648493  # of RFC 8032: the field, and the order of B
CURVE_D, BASE = -121665 * pow(121666, -1, 2**255 - 19) % PRIME, bytes([0x58] + [0x66] * 31)


def is_signed(key: bytes, message: bytes, signature: bytes) -> bool:
    """Whether an Ed25519 signature holds: RFC 8032, 5.1.7."""
    digest, s = hashlib.sha512(signature[:32] + key + message).digest(), int.from_bytes(signature[32:], "little")
    base, r, public = (unpack(data) for data in (BASE, signature[:32], key))
    whole = (0, 0) not in (r, public) and len(signature) == 64 and s < GROUP
    return whole and multiply(s, base) == add(r, multiply(int.from_bytes(digest, "little") % GROUP, public))


def unpack(data: bytes) -> tuple[int, int]:
    """The point of the curve that 32 bytes stand for, or (0, 0), which is none: RFC 8032, 5.1.3."""
    y, odd = int.from_bytes(data, "little") % 2**255, data[-1] >> 7
    square = (y * y - 1) * pow(CURVE_D * y * y + 1, -1, PRIME) % PRIME
    x = pow(square, (PRIME + 3) // 8, PRIME)
    x = x if x * x % PRIME == square else x * pow(2, (PRIME - 1) // 4, PRIME) % PRIME
    return (x if x % 2 == odd else PRIME - x, y) if len(data) == 32 and y < PRIME and x * x % PRIME == square and (x or not odd) else (0, 0)


def add(p: tuple[int, int], q: tuple[int, int]) -> tuple[int, int]:
    """The sum of two points of the curve: RFC 8032, 5.1.4."""
    both = CURVE_D * p[0] * q[0] * p[1] * q[1]
    return (p[0] * q[1] + q[0] * p[1]) * pow(1 + both, -1, PRIME) % PRIME, (p[1] * q[1] + p[0] * q[0]) * pow(1 - both, -1, PRIME) % PRIME


def multiply(factor: int, p: tuple[int, int]) -> tuple[int, int]:
    """A multiple of a point, by doubling and adding."""
    return add(multiply(factor // 2, add(p, p)), p if factor % 2 else (0, 1)) if factor else (0, 1)


def read_plan(text: str) -> dict[str, Any]:
    """Values of a plan as it is recorded, YAML in block style, by their dotted paths: probe.tip_radius_mm, section.normal.0."""
    values, items, path = dict[str, Any](), dict[Any, int](), list[tuple[int, Any]]()  # path: depth and name of all that is open
    for row in text.splitlines():
        depth, line = len(row) - len(row.lstrip()), row.strip()
        while line.startswith("- "):
            path = [(d, name) for d, name in path if d < depth or (d == depth and not isinstance(name, int))]
            items[tuple(path)] = items.get(tuple(path), -1) + 1
            path.append((depth, items[tuple(path)]))
            depth, line = depth + 2, line[2:]
        key, colon, value = line.partition(":")
        path = [*((d, name) for d, name in path if d < depth), (depth, key)] if colon else path
        if value.strip() or not colon:
            text = value.strip() if colon else line
            values[".".join(str(name) for _, name in path)] = json.loads(text) if NUMBER.match(text) else text.strip("'\"")
    return values


class Curve:
    """The nominal as short Bezier pieces (degree + 1, 3, n) in homogeneous coordinates, each turning by less than a tenth of a radian."""

    def __init__(self, stated: dict[str, Any]) -> None:
        degree, knots, weights = int(stated["degree"]), np.array(stated["knots"], dtype=float), np.array(stated["weights"], dtype=float)
        control = np.column_stack([np.array(stated["control_points_mm"], dtype=float) * weights[:, None], weights])
        size = np.hypot(*np.ptp(control[:, :2] / weights[:, None], axis=0))
        waiting, found = [(k, knots[k], knots[k + 1]) for k in range(degree, len(control)) if knots[k + 1] > knots[k]][::-1], list[Array]()
        while waiting:
            span, first, last = waiting.pop()
            piece = np.array([blossom(knots, control, degree, span, [first] * (degree - j) + [last] * j) for j in range(degree + 1)])
            legs = np.diff(piece[:, :2] / piece[:, 2:], axis=0)
            long, turn = np.hypot(*legs.T).sum(), np.ptp(np.unwrap(np.arctan2(legs[:, 1], legs[:, 0])))
            if long > size / 100 or (turn > 0.1 and long > 1e-7 * size):
                waiting += [(span, (first + last) / 2, last), (span, first, (first + last) / 2)]
            else:
                found.append(piece)
        self.pieces, self.closed, self.size = np.moveaxis(np.array(found), 0, 2).copy(), bool(stated["closed"]), float(size)
        self.outward = -1.0 if stated["material"] == "left" else 1.0  # how the left normal points: out of the material or into it
        polygon = self.pieces[:, :2] / self.pieces[:, 2:]
        self.ends, self.box = polygon[[0, -1], :, [0, -1]], (polygon.min(axis=(0, 2)), polygon.max(axis=(0, 2)))
        self.centre = self.at(self.pieces, np.full(len(found), 0.5))[0]  # (2, n), places of the curve
        self.radius = np.hypot(*np.moveaxis(polygon - self.centre, 1, 0)).max(axis=0)
        self.start = np.concatenate([[0.0], np.cumsum(self.arc(self.pieces, np.ones(len(found))))])
        self.length = self.start[-1]

    def at(self, rows: Array, t: Array) -> tuple[Array, Array]:
        """Points and first derivatives (2, m) of pieces (degree + 1, 3, m) at parameters t (m,), by de Casteljau."""
        while len(rows) > 2:
            rows = (1 - t) * rows[:-1] + t * rows[1:]
        value, slope = (1 - t) * rows[0] + t * rows[1], (len(self.pieces) - 1) * (rows[1] - rows[0])
        return value[:2] / value[2], (slope[:2] - slope[2] * value[:2] / value[2]) / value[2]

    def arc(self, rows: Array, t: Array) -> Array:
        """Length (m,) of pieces from their beginning to t."""
        return sum(weight / 2 * t * np.hypot(*self.at(rows, t * (node + 1) / 2)[1]) for node, weight in GAUSS)

    def closest(self, points: Array, halvings: int = 54) -> tuple[Array, ...]:
        """Signed distances (m,) of points (m, 2), positive out of material, stations, and whether the closest point is an open end."""
        if len(points) > 2000:
            parts = [self.closest(points[k : k + 2000], halvings) for k in range(0, len(points), 2000)]
            return tuple(np.concatenate(column) for column in zip(*parts, strict=True))
        apart = np.sqrt(np.maximum((points**2).sum(1)[:, None] + (self.centre**2).sum(0) - 2 * points @ self.centre, 0.0))
        row, piece = np.nonzero(apart - self.radius <= apart.min(axis=1)[:, None] + 1e-7 * self.size)  # the last is for round-off
        q, rows, low, high = points[row].T.copy(), self.pieces[:, :, piece], np.zeros(len(row)), np.ones(len(row))

        def along(t: Array) -> Array:  # of the connecting line: it changes its sign where the distance is smallest
            point, slope = self.at(rows, t)
            return ((point - q) * slope).sum(axis=0)

        low[along(high) <= 0] = 1.0
        high[along(low) >= 0] = low[along(low) >= 0]
        for _ in range(halvings):
            ahead = along((low + high) / 2) < 0
            low, high = np.where(ahead, (low + high) / 2, low), np.where(ahead, high, (low + high) / 2)
        (point, slope), nearest = self.at(rows, low), np.full(len(points), np.inf)
        distance = np.hypot(*(q - point))
        np.minimum.at(nearest, row, distance)
        best, same = distance == nearest[row], distance <= nearest[row] + 1e-11 * self.size
        side, station, left = np.zeros(len(points)), np.zeros(len(points)), np.array([-slope[1], slope[0]]) / np.hypot(*slope)
        np.add.at(side, row[same], ((q - point) * left).sum(axis=0)[same])  # where pieces meet, the mean of both normals gives the sign
        station[row[best]] = self.start[piece[best]] + self.arc(rows[:, :, best], low[best])
        at_end = (not self.closed) & ((station <= SAME_MM) | (station >= self.length - SAME_MM))
        return np.where(self.outward * side < 0, -nearest, nearest), station, at_end

    def out(self, points: Array, low: float, high: float, travel: float) -> Array:
        """How far the distances of points (m, 2) lie beyond limits, wherever they move by no more than is said; negative inside."""
        if travel > 8 * self.radius.max():  # then circles around the pieces tell enough
            return (np.sqrt(((points[:, None] - self.centre.T) ** 2).sum(axis=2)) - self.radius).min(axis=1) - max(-low, high)
        signed = self.closest(points, 24)[0]
        beside = np.linalg.norm(points[:, None] - self.ends, axis=2).min(axis=1) <= abs(signed) + 2 * travel + SAME_MM
        out, other = np.maximum(low - signed, signed - high), np.maximum(low + signed, -signed - high)
        return np.where(beside & (not self.closed), np.minimum(out, other), out)  # beside an end either sign may be right

    def search(self, flat: Array, low: float, high: float) -> bool | None:
        """Whether no placement brings all distances of points (m, 2) between limits; None where that remains open."""
        arms, (left, right) = flat - flat.mean(axis=0), self.box
        reach, boxes = np.hypot(*arms.T), np.array([[0.0, *((left + right) / 2)]])
        step = np.array([math.pi, *((right - left) / 2 + max(-low, high))])  # all angles, the middle of the points near the curve's box
        hits = dict.fromkeys(np.linspace(0, len(flat) - 1, 24).astype(int).tolist(), 0)
        while True:
            axis = np.arange(3) == np.argmax(step * [max(reach.max(), 1e-9), 1, 1])  # the side along which points move farthest
            step = np.where(axis, step / 2, step)
            boxes = np.concatenate([boxes + way * np.where(axis, step, 0) for way in (-1, 1)])
            travel, worst = 2 * reach * np.sin(min(step[0], math.pi) / 2) + np.hypot(step[1], step[2]), np.full(len(boxes), -np.inf)
            for k in sorted(hits, key=lambda k: -hits[k]):  # those first by which most boxes were refuted
                c, s = np.cos(boxes[:, 0]), np.sin(boxes[:, 0])
                places = boxes[:, 1:] + np.column_stack([c * arms[k, 0] - s * arms[k, 1], s * arms[k, 0] + c * arms[k, 1]])
                out = self.out(places, low, high, travel[k])
                held, worst = out <= travel[k] + SAME_MM, np.maximum(worst, out)
                hits[k] += int((~held).sum())
                boxes, worst = boxes[held], worst[held]
            if not len(boxes):
                return True
            for box in boxes[np.argsort(worst)[:2]]:
                out = self.out(placed(arms, box), low, high, 0.0)
                if out.max() <= 0:
                    return False
                hits.setdefault(int(np.argmax(out)), 0)
            if len(boxes) > MOST_BOXES or travel.max() < SMALLEST_MM:
                return None


def blossom(knots: Array, control: Array, degree: int, k: int, at: list[Any]) -> Array:
    """Bezier points are values of the polar form of a B-spline, here at the arguments `at`, by de Boor's recursion from control points."""
    if not at:
        return control[k]
    share = (at[-1] - knots[k]) / (knots[k + 1 + degree - len(at)] - knots[k])
    return (1 - share) * blossom(knots, control, degree, k - 1, at[:-1]) + share * blossom(knots, control, degree, k, at[:-1])


def placed(points: Array, pose: Any) -> Array:
    """R(angle) s + t of points s (m, 2); pose holds the angle and both coordinates of t."""
    return points @ [[math.cos(pose[0]), math.sin(pose[0])], [-math.sin(pose[0]), math.cos(pose[0])]] + np.asarray(pose[1:])


class Check:
    """The check of the evidence in a folder; `findings` are its sentences. Raises what reading raises."""

    def __init__(self, folder: Path, head: str = "", key: str = "") -> None:
        self.folder, self.findings, self.bodies = folder, dict[str, list[str]](), dict[str, list[bytes]]()
        self.read_records(head.lower(), key.lower())
        if "NOT TRUE" in self.findings:  # nothing that is derived from altered records would prove anything
            return
        for path, kind in ((folder / "plan.yaml", "plan"), (next(folder.glob("nominal-*")), "nominal")):  # the files that people read
            self.say(path.read_bytes() == self.bodies[kind][0], f"{path.name} is what was recorded.")
        now = {path.stem: json.loads(path.read_text(encoding="utf-8")) for path in folder.glob("*.json")}
        run, result, end = (json.loads(self.bodies[kind][0]) for kind in ("run", "result", "end"))
        text, found, zone = self.bodies["plan"][0].decode(), result["characteristics"], now.get("zone", {})
        self.plan, self.result, own = read_plan(text), result, {"run": run["run"], "chain_sha256": self.head}
        both = [(now["result"], result | {"ending": end["state"]}), (now["run"], run | end | own | {"result": result, "plan": text})]
        both += [(end, result), (now.get("signature", {}), own | (now["run"]["signature"] or {})), (zone, {"nominal": now.get("nominal")})]
        both += [(said, one["certificate"] or {}) for said in zone.get("zones", ()) for one in found if one["name"] == said["name"]]
        same = all(said[k] == x for said, right in both for k, x in right.items() if k in said) and result.keys() <= now["result"].keys()
        self.say(same, "result.json, run.json, zone.json and signature.json say what was recorded, and nothing contradicts itself.")
        if self.result["registration"] is None:
            self.say(self.result["verdict"] == "uncertain", "NOT PROVEN follows: no point was judged.")
            return
        self.curve = Curve(json.loads((folder / "nominal.json").read_text(encoding="utf-8")))
        pairs = re.findall(r"^\s*([-+.\de]+)[\s,;]+([-+.\de]+)\s*$", self.bodies["nominal"][0].decode("latin-1"), re.MULTILINE)
        points = np.array(pairs, dtype=float).reshape(-1, 2)
        points = points[(points % 1 != 0).any(axis=1)] * self.plan["nominal.scale"]  # whole numbers may be counts
        known, off = len(pairs) > 9 and self.plan["nominal.unit"] in (None, "mm"), np.abs(self.curve.closest(points)[0]).max(initial=0.0)
        self.say(off <= 1e-7 if known else None, f"The curve runs through {len(points)} points of the nominal.", f"within {off:.1e} mm")
        self.check_deviations()
        for at, one in enumerate(found, -1 if "tolerance.lower_mm" in self.plan else 0):
            self.check_profile(one, at)
        worst = next(verdict for verdict in ("nonconform", "uncertain", "conform") if verdict in [one["verdict"] for one in found])
        self.say(self.result["verdict"] == worst, f"The verdict on the part is the worst of all, {worst}.")

    def say(self, holds: object, sentence: str, detail: str = "") -> None:
        """Put a sentence where it belongs; None says that nothing was checked."""
        heap = self.findings.setdefault("Not checked" if holds is None else "Proved" if holds else "NOT TRUE", [])
        heap.append(sentence + (f" ({detail})" if detail else ""))

    def read_records(self, head: str, key: str) -> None:
        """The bodies of the records by kind, after recomputing every hash over them, and the signature over the last hash."""
        data, offset, before, last, broken = (self.folder / "records.bin").read_bytes(), 0, None, "", []
        run = json.loads((self.folder / "run.json").read_text(encoding="utf-8"))["run"]
        for row in csv.DictReader((self.folder / "chain.csv").read_text(encoding="utf-8").splitlines()):
            number, body, offset = int(row["number"]), data[offset : offset + int(row["bytes"])], offset + int(row["bytes"])
            stated = f"{number}\n{run}\n{row['kind']}\n{float(row['time_s'])!r}\n{int(row['count'])}\n{len(body)}\n".encode()
            sound = hashlib.sha256(bytes.fromhex(row["previous_sha256"]) + stated + body).hexdigest() == row["sha256"]
            if not sound or (before and not last and before != (number - 1, row["previous_sha256"])):  # others may stand behind the end
                broken.append(f"not so: record {number}, {row['kind']}")
            self.bodies.setdefault(row["kind"], []).append(body)
            before, last = (number, row["sha256"]), row["sha256"] if row["kind"] == "end" else last
        whole, self.head = not broken and offset == len(data) and last, last
        self.say(whole, f"Every record of run {run} is as it was hashed, and none is missing up to its end.", "; ".join(broken[:3]))
        anew = "Nothing, hashes included, was written anew since: the last hash is the one that was kept elsewhere."
        self.say(whole and last == head if head else None, anew, "" if head else "give the hash from the report with --head")
        path, message = self.folder / "signature.json", f"cmmlink run\n{run}\n{last}\n".encode()
        told = json.loads(path.read_text(encoding="utf-8")) if path.exists() else {"public_key": "", "signature": ""}
        public, signature = bytes.fromhex(told["public_key"]), bytes.fromhex(told["signature"])
        name = hashlib.sha256(public).hexdigest()[:16] if public else "none"
        signed, known = whole and public and is_signed(public, message, signature), key in (name, public.hex())
        self.say(signed if public or key else None, f"The run is signed, by the key {name}.")
        why = "give it with --key" if not key else "it is, but did not sign this run" if known and not signed else ""
        self.say(None if why else known, "That key is the station's.", why)

    def column(self, kind: str, of: int, at: int, numbers: str) -> Array:
        """A column of records of points, which have `of` bytes a point and hold column after column; `at` of them stand before it."""
        return np.concatenate([np.frombuffer(b, numbers, len(b) // of, len(b) // of * at) for b in self.bodies.get(kind, [b""])])

    def check_counts(self, rejection: Array) -> None:
        """Counts anew, from what arrived: points with their numbers, and what the device said."""
        events = [one for body in self.bodies.get("events", []) for one in json.loads(body)]
        told = {k: [e["values"] for e in events if e["event"] == k] for k in ("Rejected", "Lost", "Damaged", "ScanOpened", "ScanClosed")}
        dropped, lost, damaged = (sum(one.get("count", one.get("byte_count")) for one in told[kind]) for kind in list(told)[:3])
        came, harmless = len(rejection) + dropped, sum(one["count"] for one in told["Rejected"] if one["reason"] in HARMLESS)
        judged, number = int((rejection == 0).sum()), self.column("points", 40, 0, "<i8")
        counts = {"received": came, "judged": judged, "rejected": came - judged, "lost": lost, "damaged_bytes": damaged}
        self.say(all(self.result[key] == value for key, value in counts.items()), f"The points are counted rightly: {counts}.")
        holes = int(np.ptp(number)) + 1 - len(np.unique(number))
        self.say(holes <= lost + dropped, f"Of the points' own numbers {holes} are missing, no more than were told to be lost or unusable.")
        announced = max((one.get("expected", one.get("sent")) or 0 for one in told["ScanOpened"] + told["ScanClosed"]), default=0)
        self.missing = lost > 0 or damaged > 0 or dropped > harmless or announced > came - harmless + max(lost, 0)
        self.missing |= not np.isin(rejection, (0, BEYOND_END)).all()
        anew, end = any(one["event"] == "ScanOpened" and one["points"] > 0 for one in events), json.loads(self.bodies["end"][0])
        self.doubts = {"the scan did not end": not (self.result["complete"] and end["state"] == "complete"), "the device began anew": anew}

    def check_deviations(self) -> None:
        """Every deviation anew, at the recorded placement."""
        result, plan, curve, self.radius = self.result, self.plan, self.curve, self.plan["probe.tip_radius_mm"]
        origin, normal, x = (np.array([plan[f"section.{key}.{k}"] for k in range(3)]) for key in ("origin_mm", "normal", "x_axis"))
        x = x - (x @ normal) * normal / (normal @ normal)
        axes = np.column_stack([x, np.cross(normal, x)])  # of the section's plane, in which points have places (m, 2)
        flat = (self.column("points", 40, 16, "<3f8") - origin) @ (axes / np.linalg.norm(axes, axis=0))
        if plan.get("temperature.compensate"):  # to the reference temperature
            fixed = np.array([plan["temperature.fixed_mm.0"], plan["temperature.fixed_mm.1"]])
            size = 1 + plan["temperature.cte_per_k"] * (plan["temperature.part_c"] - plan["temperature.reference_c"])
            flat, self.radius = fixed + (flat - fixed) / size, self.radius / size
        at = ((0, "<2f8"), (32, "<f8"), (40, "<f8"), (49, "i1"))
        actual, station, recorded, rejection = (self.column("deviations", 50, *place) for place in at)
        self.say(len(flat) == len(rejection), "Every point that came has a deviation, or a reason to have none.")
        self.check_counts(rejection)
        kept, flat = rejection == 0, np.resize(flat, (len(rejection), 2))
        self.placement = {key: result["registration"][key] for key in ("rotation_deg", "translation_mm")}
        pose = np.array([math.radians(self.placement["rotation_deg"]), *self.placement["translation_mm"]])
        datum = [plan.get(f"registration.datum.{key}") or 0.0 for key in ("rotation_deg", "translation_mm.0", "translation_mm.1")]
        self.known = "registration.datum.rotation_deg" in plan or plan["registration.fit"] == "none"
        same = not self.known or np.abs(pose - [math.radians(datum[0]), *datum[1:]]).max() <= SAME_MM
        self.say(same, "The placement is the one that the plan states, where it states one.")
        self.every, self.flat, self.station, judged = flat, flat[kept], station[kept], placed(flat[kept], pose)
        distance, along, at_end = curve.closest(judged)
        apart, self.deviation = np.abs(along - self.station), recorded[kept]
        off = np.abs([distance - self.radius - self.deviation, np.linalg.norm(actual[kept] - judged, axis=1) - self.radius]).max()
        apart = np.minimum(apart, curve.length - apart if curve.closed else apart).max()
        same = off <= SAME_MM and apart <= FITTED_MM if plan["registration.method"] == "exact" else None
        self.say(same, "Every deviation, place and station follows from points, placement and nominal.", f"within {max(off, apart):.1e} mm")
        beyond, _, there = curve.closest(placed(flat[rejection == BEYOND_END], pose))
        self.say(there.all() and not at_end.any(), "The points that were left out as beyond an end lie there, and no others.")
        self.beyond_mm = float(np.abs(np.abs(beyond) - self.radius).max(initial=0.0))
        self.zone = zone = [result["tolerance"][key] for key in ("lower_mm", "upper_mm", "uncertainty_mm")]
        d, s, guard = self.deviation, np.sort(self.station), zone[2] * (plan["decision_rule"] != "simple")
        self.gap_mm = plan["gap_max_mm"] or max(curve.length / 100, plan["allow.unseen_mm"] or 0.0)
        gaps = np.diff(s, append=s[0] + curve.length) if curve.closed else np.diff(s, prepend=0.0, append=curve.length)
        self.facts = {"coverage": gaps[gaps <= self.gap_mm].sum() / curve.length, "largest_gap_mm": gaps.max()}
        found = {"max_deviation_mm": d.max(), "min_deviation_mm": d.min(), "profile_error_mm": 2 * np.abs(d).max()} | self.facts
        found |= {"rms_mm": math.sqrt((d @ d) / len(d)), "zone_error_mm": 2 * np.abs(d - sum(zone[:2]) / 2).max()}
        out = int(((d > zone[1] + guard) | (d < zone[0] - guard)).sum())
        there = {"best-fit": "best_fit_error_mm", "minimum-zone": "minimum_zone_mm" if not out else ""}.get(result["fit"], "")
        found |= {key: found["zone_error_mm"] for key in [there] if result.get(key) is not None}  # what it is at this very placement
        same = all(abs(result[key] - value) < FITTED_MM for key, value in found.items()) and result["out_of_tolerance"] == out
        self.say(same, f"The longest gap is {gaps.max():.3f} mm; {self.facts['coverage']:.1%} was measured; {out} points are out.")

    def zone_of(self, at: int) -> list[float] | None:
        """Both limits of a characteristic as the plan states them; None where it is no line-profile with one zone everywhere."""
        first = f"characteristics.{at}.zone." if at >= 0 else "tolerance."
        told = {key.removeprefix(first).removesuffix(".0"): value for key, value in self.plan.items() if key.startswith(first)}
        if told.get("width_mm") is not None:
            outward = told["width_mm"] / 2 + (told["offset_mm"] or 0.0) if told["outward_mm"] is None else told["outward_mm"]
            return [outward - told["width_mm"], outward]
        return None if told.get("stations_mm") is not None or "lower_mm" not in told else [told["lower_mm"], told["upper_mm"]]

    def check_profile(self, one: Any, at: int) -> None:
        """A line-profile of the whole profile at the run's placement: its value, its verdict, and the proof of its minimum zone."""
        zone, name, plan, d, proof = self.zone_of(at), one["name"], self.plan, self.deviation, one["certificate"]
        self.check_twice(one, zone)
        if zone is None or one["region"] or one["pose"] != self.placement or one["filter"] != "none":
            self.say(None, f"{name}: its value, {one['value']} {one['unit']}, and its verdict, {one['verdict']}.")
            return
        u, found = one["uncertainty"], {"value": 2 * np.abs(d - sum(zone) / 2).max(), "lower": zone[0], "upper": zone[1], **self.facts}
        same = (at > 0 or [one["lower"], one["upper"], u] == self.zone) and all(abs(one[k] - x) < FITTED_MM for k, x in found.items())
        self.say(same, f"{name}: it is {found['value']:.6f} mm, and its zone {zone[0]:g} .. {zone[1]:g} mm that of the plan.")
        own = plan.get(f"characteristics.{at}.uncertainty_mm", plan.get("tolerance.uncertainty_mm"))
        self.say(own if own is None else own == u, f"{name}: U = {u:g} mm is stated by the plan.")
        guard, rule = 0.0 if plan["decision_rule"] == "simple" else u, plan.get(f"characteristics.{at}.rule") or plan["rule"]
        low, high, beyond = zone[0] + self.radius, zone[1] + self.radius, bool(((d > zone[1] + guard) | (d < zone[0] - guard)).any())
        (share, gap), end_mm, unseen_mm = self.facts.values(), plan["end_allowance_mm"], plan["allow.unseen_mm"]
        doubts = self.doubts | {  # what keeps it from being proven to conform
            "points are missing": self.missing and gap > (-1 if unseen_mm is None else unseen_mm),
            "too little was measured": share < plan["registration.coverage_min"],
            "a gap is too long": gap > self.gap_mm * (1 + 1e-9),
            "points lie beyond an end": self.beyond_mm > ((zone[1] - zone[0]) / 2 if end_mm is None else end_mm),
            "points are out or in doubt": bool(((d > zone[1] - guard) | (d < zone[0] + guard)).any()),
            "the record names another reason": any(reason["kind"] in UNPROVED for reason in one["reasons"]),
        }
        doubt = "; ".join(words for words, holds in doubts.items() if holds)
        known, verdict = self.known and one["fit"] in ("none", "datum"), f"{name}: {one['verdict'].upper()} follows"
        if known or one["verdict"] != "nonconform":
            self.say(one["verdict"] == ("nonconform" if known and beyond else "uncertain" if doubt else "conform"), f"{verdict}.", doubt)
        elif rule == "best-fit" and one["fit"] in ("best-fit", "none"):
            self.say(None if beyond else False, f"{verdict}, as long as its placement is the best fit.")
        else:
            self.say(self.curve.search(self.flat, low - guard, high + guard), f"{verdict}, for no placement passes.")
        if proof and proof["proven"]:
            none = proof["bound"] < 0 or self.curve.search(self.flat, *((low + high) / 2 + np.array([-1, 1]) * proof["bound"]))
            self.say(none, f"{name}: no placement has a zone of less than {2 * proof['bound']:.6f} mm.")

    def check_twice(self, one: Any, zone: list[float] | None) -> None:
        """Whether a characteristic says the same wherever it says it twice, and its certificate what its points say."""
        value, off, limits, proof, apart = one["value"], one["deviation"], (one["lower"], one["upper"]), one["certificate"], [0.0]
        if off is not None:
            apart += [value - abs(2 * off - sum(zone))] if zone else []
            turn, worst = 360.0 if one["unit"] == "deg" else math.inf, one["worst"]
            apart += [worst["deviation_mm"] - off if worst else math.remainder(value - (one["nominal"] or 0.0) - off, turn)]
            apart += [] if None in limits else [one["consumption"] * (limits[1] - limits[0]) - abs(2 * off - sum(limits))]
        if proof:
            held, half, pose, of_zone = proof["active"], (proof["zone_mm"] or 0.0) / 2, proof["pose"], proof["kind"] == "minimum-zone"
            places, told = self.every[[point["index"] for point in held]], [point["deviation_mm"] for point in held]
            apart += [x for at, point in zip(places, held, strict=True) for x in at - [point["x_mm"], point["y_mm"]]]
            apart += [half - proof["gap_mm"] - proof["bound"]] if of_zone else []
            apart += [f"{x:.9f}" not in proof["words"] for x in ([half] if of_zone else [proof["consumption"], proof["bound"]])]
            off = self.curve.closest(placed(places, [math.radians(pose["rotation_deg"]), *pose["translation_mm"]]))[0] - self.radius
            apart += [not np.allclose(np.abs([off - proof["middle_mm"], told]), half, 0, FITTED_MM)] if of_zone else []
        self.say(np.abs(apart).max() <= SAME_MM, f"{one['name']}: its numbers agree with each other, and its certificate with its points.")


def main(arguments: list[str]) -> int:
    """Check what the command line names, print the findings and give the exit status."""
    try:
        named = zip(arguments[1::2], arguments[2::2], strict=True)
        findings = Check(Path(arguments[0]), **{name.removeprefix("--"): value for name, value in named}).findings
    except (OSError, ValueError, LookupError, TypeError, StopIteration) as error:
        print(f"The evidence cannot be read: {type(error).__name__}: {error}" if len(arguments) % 2 else __doc__)
        return 2
    print(*(f"{heap}: {sentence}" for heap, sentences in findings.items() for sentence in sentences), sep="\n")
    return 1 if "NOT TRUE" in findings else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
