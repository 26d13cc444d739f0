"""The check of a minimum zone, or of a least consumption, by whoever doubts it: zone.json in, yes or no out.

It shares nothing with the code that found the zone.

What is checked needs a dense polygon of the nominal and the distance to it. First that the pose brings the points into the zone and that
those which hold it balance, so that no small motion makes it smaller. Then that no rigid motion at all brings the witnesses into a zone
narrower by the stated gap: a box of motions moves a point by at most a known length, so a point that is farther out than that refutes
the whole box; a box that no point refutes is cut. The distance to the curve is known between two bounds, and only the kinder one counts.
Limits that vary along the profile are those of wherever a point's nearest place may come to, the loosest of them.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import BSpline
from scipy.spatial import cKDTree

from cmmlink.zone_limits import LoosestLimits, StatedLimits

Array = NDArray[np.float64]

_SAMPLES = 400_000
_MOST_BOXES = 2_000_000
_WAVE = 2048
_SAME_MM = 2e-6  # deviations at the pose are those that were stated, to the rounding of the pose
_SAME_SQUARE_MM2 = 1e-11  # of squares of distances, by round-off: 3 um along the curve
_STEP_MM = 1e-3  # of motions by which it is seen what the points consume more and less
_BALANCED_BY_STEPS = 5e-3  # of the largest rate
_BALANCED = 1e-4  # what may be left of the sum of unit gradients: the normals of a polygon are off by its steps


@dataclass(frozen=True, slots=True)
class ZoneCheck:
    """What the check of one zone found. `problem` is empty where everything that was stated is so.

    half_mm, gap_mm : of a minimum zone; consumption, bound : of a least consumption, 0 of a minimum zone
    """

    name: str
    half_mm: float
    gap_mm: float
    boxes: int
    problem: str
    consumption: float = 0.0
    bound: float = 0.0

    @property
    def words(self) -> str:
        """The outcome in one line."""
        if self.problem:
            return f"{self.name}: NOT VERIFIED: {self.problem}"
        if self.consumption:
            found = f"{self.name}: verified: least consumption {self.consumption:.6f} of the zone"
            return f"{found}; no rigid motion brings the witnesses into {self.bound:.6f} of it ({self.boxes:,} boxes)"
        bound = f"no rigid motion brings the witnesses within {self.half_mm - self.gap_mm:.6f} mm of its middle"
        if self.half_mm <= self.gap_mm:
            bound = f"half of it is no wider than {self.gap_mm:.6f} mm, and nothing smaller by so much can be"
        return f"{self.name}: verified: minimum zone {2 * self.half_mm:.6f} mm; {bound} ({self.boxes:,} boxes)"


def check_zones(document: Mapping[str, Any]) -> tuple[ZoneCheck, ...]:
    """Check every zone of a zone.json. Raises ValueError for a document that is none."""
    try:
        curve = _Polygon(document["nominal"])
        return tuple((_check_consumption if zone.get("kind") == "consumption" else _check)(zone, curve) for zone in document["zones"])
    except KeyError as error:
        raise ValueError(f"is no zone.json: {error} is missing; expected the file that a run wrote beside its result") from None
    except (TypeError, IndexError, AttributeError):
        raise ValueError("is no zone.json: its values have other types; expected the file that a run wrote beside its result") from None


class _Polygon:
    """The nominal as a dense polygon (n, 2), and how far it may be from the curve."""

    def __init__(self, nominal: Mapping[str, Any]) -> None:
        degree, knots = int(nominal["degree"]), np.array(nominal["knots"], dtype=np.float64)
        points, weights = np.array(nominal["control_points_mm"], dtype=np.float64), np.array(nominal["weights"], dtype=np.float64)
        spline = BSpline(knots, np.column_stack([points * weights[:, None], weights]), degree)
        breaks = np.unique(knots[degree : len(knots) - degree])
        each = max(2, _SAMPLES // (len(breaks) - 1))
        u = np.unique(np.concatenate([np.linspace(a, b, each) for a, b in pairwise(breaks)]))
        lifted = spline(u)
        self.places = lifted[:, :2] / lifted[:, 2:]
        self.closed = bool(nominal["closed"])
        if self.closed:
            self.places = self.places[:-1]
        ahead = np.roll(self.places, -1, axis=0) - self.places
        if not self.closed:
            ahead[-1] = ahead[-2]
        self.step = np.hypot(*ahead.T)
        normal = np.column_stack([-ahead[:, 1], ahead[:, 0]]) / np.where(self.step > 0, self.step, 1.0)[:, None]
        self.normal = normal if nominal["material"] == "right" else -normal
        before = np.roll(self.normal, 1, axis=0)
        if not self.closed:
            before[0] = self.normal[0]
        self.at_vertex = self.normal + before
        turning = np.arccos(np.clip((self.normal * before).sum(axis=1), -1.0, 1.0))
        smooth = np.where(turning < 0.1, turning, 0.0)  # what turns more at once is a corner, where the polygon is exact
        self.reach = float(self.step.max()) / 2  # no place of the curve is farther from a vertex along the polygon
        self.sag = float((self.step * smooth).max()) / 4  # an arc of this turning stands off its chord by an eighth of step times turning
        self.tree = cKDTree(self.places)
        travelled = np.concatenate([[0.0], np.cumsum(self.step if self.closed else self.step[:-1])])
        self.station, self.length = travelled[: len(self.places)], float(travelled[-1])

    def is_at(self, places: Array, station_mm: Array) -> NDArray[np.bool_]:
        """Whether the curve is nearest to places (k, 2) at stations (k,); where both sides are as near, two stations are."""
        inside = (station_mm >= 0) & (station_mm <= self.length + 2 * self.reach)
        at = np.clip(np.searchsorted(self.station, station_mm), 1, len(self.places) - 1)
        square = [np.square(places - self.places[at - back]).sum(axis=1) for back in (0, 1)]
        nearest = np.square(self.tree.query(places)[0])
        return np.asarray(inside & (np.minimum(*square) <= nearest + (4 * self.reach) ** 2 + _SAME_SQUARE_MM2))

    def bounds(self, places: Array, moves: Array) -> tuple[Array, Array, NDArray[np.bool_]]:
        """Lowest and highest signed distance (k,) of places (k, 2), and where the sign may be either, as beyond an open end."""
        distance, vertex = self.tree.query(places)
        low = np.sqrt(np.maximum(distance**2 - self.reach**2, 0.0)) - self.sag
        off = places - self.places[vertex]
        sign = np.where((off * self.at_vertex[vertex]).sum(axis=1) >= 0, 1.0, -1.0)
        either = np.asarray(distance <= 4 * self.reach)  # so near the curve the side is not told by a vertex
        low = np.where(either, 0.0, np.maximum(low, 0.0))
        high = distance + self.sag
        if not self.closed:
            ends = self.places[[0, -1]]
            to_end = np.hypot(*(places[:, None, :] - ends).T).min(axis=0)
            either = either | (to_end <= distance + 2 * moves + 2 * self.reach)
        return np.where(sign > 0, low, -high), np.where(sign > 0, high, -low), either


def _check(zone: Mapping[str, Any], curve: _Polygon) -> ZoneCheck:
    """Check one zone."""
    half, middle, gap, tip = zone["zone_mm"] / 2, zone["middle_mm"], zone["gap_mm"], zone["tip_radius_mm"]
    active, witnesses = (_places(zone[which]) for which in ("active", "witnesses"))
    found = ZoneCheck(str(zone["name"]), half, gap, 0, "")
    problem = _problem_at_pose(zone, active, curve)
    if not problem and half <= gap and zone["proven"]:
        return found  # no zone is narrower than none at all
    if problem or not zone["proven"]:
        return ZoneCheck(found.name, half, gap, 0, problem or "what the file says is not proven over every placement")
    limits = np.array(middle + tip - half + gap), np.array(middle + tip + half - gap)
    boxes, refuted = _refute(witnesses, curve, lambda places, radius: limits, half + abs(middle))
    problem = "" if refuted else f"after {boxes:,} boxes of motions it is not shown that every other placement needs a wider zone"
    return ZoneCheck(found.name, half, gap, boxes, problem)


def _check_consumption(zone: Mapping[str, Any], curve: _Polygon) -> ZoneCheck:
    """Check one least consumption: what the points consume at the pose, how they balance, and the proof of every other motion."""
    limits = StatedLimits.of(zone["limits"], curve.length, curve.closed)
    found = ZoneCheck(str(zone["name"]), 0.0, 0.0, 0, "", float(zone["consumption"]), float(zone["bound"]))
    problem = limits.problem or _problem_of_consumption(zone, curve, limits)
    if problem or not zone["proven"]:
        return replace(found, problem=problem or "what the file says is not proven over every placement")
    loosest, tip = LoosestLimits(curve.places, curve.station, limits, found.bound), float(zone["tip_radius_mm"])

    def allowed(places: Array, radius: Array) -> tuple[Array, Array]:
        lower, upper = loosest.near(places, radius)
        return lower + tip, upper + tip

    boxes, refuted = _refute(_places(zone["witnesses"]), curve, allowed, loosest.farthest + tip)
    problem = "" if refuted else f"after {boxes:,} boxes of motions it is not shown that every other placement consumes more"
    return replace(found, boxes=boxes, problem=problem)


def _problem_of_consumption(zone: Mapping[str, Any], curve: _Polygon, limits: StatedLimits) -> str:
    """What is not as stated at the pose of a least consumption."""
    angle, shift = math.radians(zone["pose"]["rotation_deg"]), np.array(zone["pose"]["translation_mm"], dtype=np.float64)

    def consumed(points: Array, motion: Array) -> Array:
        moved = _moved(points, angle, shift)
        middle = moved.mean(axis=0)
        distance, _, station = _signed_distances(curve, _moved(moved - middle, float(motion[2]), middle + motion[:2]))
        lower, upper = limits.at(station)
        return np.asarray((2 * (distance - zone["tip_radius_mm"]) - lower - upper) / (upper - lower))

    active, witnesses, still = _places(zone["active"]), _places(zone["witnesses"]), np.zeros(3)
    same = 2 * _SAME_MM / float((limits.upper_mm - limits.lower_mm).min())
    here = consumed(active, still)
    if not len(here) or np.abs(np.abs(here) - zone["consumption"]).max() > same:
        return "the points that hold it do not consume as much as is stated"
    if np.abs(consumed(witnesses, still)).max() > zone["consumption"] + same:
        return "a witness consumes more at the pose, so that it is not shown to be a point that the consumption is of"
    problem = _problem_of_points(zone, curve, _moved(active, angle, shift)) or _problem_of_multipliers(zone)
    if problem or not zone["bound"] < zone["consumption"]:
        return problem or "what is to be proven is not below what is consumed"
    share = np.array([point["multiplier"] for point in zone["active"]]) * np.sign(here)
    reach = float(np.hypot(*(active - active.mean(axis=0)).T).max())
    left = []  # where limits turn at a point, its rate either way is another one, and any between them may be what balances
    for step in _STEP_MM * np.diag([1.0, 1.0, 1.0 / reach]):
        both = np.stack([share * (consumed(active, step) - here), share * (here - consumed(active, -step))])
        size = np.abs(both).max()
        left.append(max(both.min(axis=0).sum(), -both.max(axis=0).sum()) / size if size else 0.0)
    return f"the points do not balance: {max(left):.1e} of a unit is left" if max(left) > _BALANCED_BY_STEPS else ""


def _places(points: Sequence[Mapping[str, float]]) -> Array:
    """Where points (k, 2) were measured."""
    return np.array([[point["x_mm"], point["y_mm"]] for point in points], dtype=np.float64).reshape(-1, 2)


def _moved(places: Array, angle: float, shift: Array) -> Array:
    """Places (k, 2) turned by an angle in rad, then shifted."""
    c, s = math.cos(angle), math.sin(angle)
    return np.asarray(places @ np.array([[c, s], [-s, c]]) + shift)


def _problem_of_points(zone: Mapping[str, Any], curve: _Polygon, holding: Array) -> str:
    """What tells that the points named are not those of the zone; `holding` (a, 2) is where the pose brings those that hold it."""
    place_of: dict[Any, tuple[float, float]] = {}
    for point in (*zone["active"], *zone["witnesses"]):
        place = (point["x_mm"], point["y_mm"])
        if place_of.setdefault(point["index"], place) != place:
            return f"point {point['index']} is told to be in two places"
    if not {point["index"] for point in zone["active"]} <= {point["index"] for point in zone["witnesses"]}:
        return "a point that holds the zone is none of the witnesses"
    stated = np.array([point["station_mm"] for point in zone["active"]], dtype=np.float64)
    return "" if curve.is_at(holding, stated).all() else "a point that holds the zone is not at the station that is told"


def _problem_of_witnesses(zone: Mapping[str, Any], curve: _Polygon, angle: float, shift: Array) -> str:
    """What tells that the witnesses are not points that the zone holds. A point from elsewhere refutes whatever one likes."""
    moved = _moved(_places(zone["witnesses"]), angle, shift)
    off = _signed_distances(curve, moved)[0] - zone["tip_radius_mm"] - zone["middle_mm"]
    problem = _problem_of_points(zone, curve, _moved(_places(zone["active"]), angle, shift))
    if np.abs(off).max(initial=0.0) > zone["zone_mm"] / 2 + _SAME_MM and "station" not in problem:
        return problem or "a witness is not in the zone at its pose, so that it is not shown to be a point that the zone is of"
    return problem


def _problem_of_multipliers(zone: Mapping[str, Any]) -> str:
    """What is wrong with the multipliers alone."""
    share = np.array([point["multiplier"] for point in zone["active"]])
    sound = len(share) and share.min() > 0 and abs(share.sum() - 1) <= 1e-6
    return "" if sound else "the multipliers are not positive with the sum 1"


def _problem_at_pose(zone: Mapping[str, Any], active: Array, curve: _Polygon) -> str:
    """What is not as stated at the pose: the deviations of the points that hold the zone, or their balance."""
    angle, shift = math.radians(zone["pose"]["rotation_deg"]), np.array(zone["pose"]["translation_mm"], dtype=np.float64)
    moved = _moved(active, angle, shift)
    distance, normal, _ = _signed_distances(curve, moved)
    off = distance - zone["tip_radius_mm"] - zone["middle_mm"]
    problem = _problem_of_witnesses(zone, curve, angle, shift)
    if problem:
        return problem
    stated = np.array([point["deviation_mm"] for point in zone["active"]])
    if np.abs(off - stated).max(initial=0.0) > _SAME_MM or np.abs(np.abs(stated) - zone["zone_mm"] / 2).max(initial=0.0) > _SAME_MM:
        return "the points that hold the zone are not at its limits"
    if zone["zone_mm"] / 2 <= zone["gap_mm"]:
        return ""  # points all on the nominal need not balance
    problem, share = _problem_of_multipliers(zone), np.array([point["multiplier"] for point in zone["active"]])
    if problem:
        return problem
    arms = moved - moved.mean(axis=0)
    reach = float(np.hypot(*arms.T).max())
    rates = np.column_stack([normal, (arms[:, 0] * normal[:, 1] - arms[:, 1] * normal[:, 0]) / reach])
    left = float(np.linalg.norm((share * np.sign(stated)) @ rates))
    return f"the points do not balance: {left:.1e} of a unit is left" if left > _BALANCED else ""


def _signed_distances(curve: _Polygon, places: Array) -> tuple[Array, Array, Array]:
    """Signed distances (k,) of places (k, 2) to the polygon, positive out of material, the ways (k, 2) they grow, and stations (k,)."""
    _, vertex = curve.tree.query(places)
    n, best, direction, station = len(curve.places), np.full(len(places), np.inf), np.zeros_like(places), np.zeros(len(places))
    for first in (vertex - 1, vertex):
        a, b = curve.places[first % n], curve.places[(first + 1) % n]
        along = b - a
        t = np.clip(((places - a) * along).sum(axis=1) / np.maximum((along * along).sum(axis=1), 1e-300), 0.0, 1.0)
        off = places - (a + t[:, None] * along)
        distance = np.hypot(*off.T)
        nearer = distance < np.abs(best)
        inner = (t > 0) & (t < 1)
        normal = np.where(inner[:, None], curve.normal[first % n], curve.at_vertex[vertex])
        sign = np.where((off * normal).sum(axis=1) >= 0, 1.0, -1.0)
        best = np.where(nearer, sign * distance, best)
        grown = np.where((distance > 1e-12)[:, None], sign[:, None] * off / np.maximum(distance, 1e-12)[:, None], normal)
        direction = np.where(nearer[:, None], grown, direction)
        station = np.where(nearer, curve.station[first % n] + t * curve.step[first % n], station)
    return best, direction, station


Allowed = Callable[[Array, Array], tuple[Array, Array]]  # the loosest limits (k,) near places (k, 2), within radii (k,)


def _refute(points: Array, curve: _Polygon, allowed: Allowed, farthest: float) -> tuple[int, bool]:
    """Refute every rigid motion that would bring points (w, 2) between limits. Gives the boxes, and whether all fell.

    farthest : the largest deviation that is allowed anywhere, either way
    """
    arms = points - points[0]
    lengths = np.hypot(*arms.T)
    low, high = curve.places.min(axis=0), curve.places.max(axis=0)
    side = float((high - low).max()) / 2 + farthest
    boxes = np.array([[*((low + high) / 2), 0.0, side, math.pi]])  # x, y, angle, half widths
    looked_at = 0
    while len(boxes):
        wave, boxes = boxes[-_WAVE:], boxes[:-_WAVE]
        looked_at += len(wave)
        if looked_at > _MOST_BOXES:
            return looked_at, False
        left = wave
        for arm, length in zip(arms, lengths, strict=True):
            if not len(left):
                break
            left = left[~_is_out(left, arm, float(length), curve, allowed)]
        if len(left) and left[:, 3].max() < 1e-9 and left[:, 4].max() < 1e-12:
            return looked_at, False
        boxes = np.concatenate([boxes, *_cut(left, float(lengths.max()))])
    return looked_at, True


def _is_out(boxes: Array, arm: Array, length: float, curve: _Polygon, allowed: Allowed) -> NDArray[np.bool_]:
    """Which boxes (k, 5) a point refutes, that lies at `arm` from the anchor: whatever motion of the box, it is out of the limits."""
    c, s = np.cos(boxes[:, 2]), np.sin(boxes[:, 2])
    places = boxes[:, :2] + np.column_stack([c * arm[0] - s * arm[1], s * arm[0] + c * arm[1]])
    moves = math.sqrt(2) * boxes[:, 3] + 2 * np.sin(np.minimum(boxes[:, 4], math.pi) / 2) * length
    low, high, either = curve.bounds(places, moves)
    # Wherever the point goes in the box, its nearest place on the curve stays so near to where the box's centre puts it.
    near = np.maximum(np.abs(low), np.abs(high)) + 2 * moves + curve.reach + 1e-6
    lower, upper = allowed(places, near)
    room = moves + 1e-9
    above, below = low - upper > room, high - lower < -room
    nearest = np.minimum(np.abs(low), np.abs(high))
    both = (nearest - upper > room) & (-nearest - lower < -room)
    return np.where(either, both, above | below)


def _cut(boxes: Array, reach: float) -> list[Array]:
    """Cut boxes (k, 5) in place, into four, or in angle, into two: whichever moves points more."""
    in_place = math.sqrt(2) * boxes[:, 3] >= 0.7 * 2 * np.sin(boxes[:, 4] / 2) * reach
    wide, long = boxes[in_place], boxes[~in_place]
    step, turn, same = wide[:, 3] / 2, long[:, 4] / 2, np.zeros(len(wide))
    quarters = [wide + np.column_stack([x * step, y * step, same, -step, same]) for x in (-1, 1) for y in (-1, 1)]
    none = np.zeros(len(long))
    return quarters + [long + np.column_stack([none, none, way * turn, none, -turn]) for way in (-1, 1)]
