"""Whether any placement at all brings measured points into the tolerance zone: branch and bound over every rigid motion.

A motion is told by the place of one of the points, the anchor, and by an angle. The distance to the nominal changes by no more
than a point moves, so in a box of motions (anchor within half widths h, angle within t) the point i moves from where the box's
centre puts it by at most rho_i = sqrt(2) h + 2 sin(t / 2) |p_i - anchor|. A box is refuted by any point whose deviation at the
centre is farther out of the zone than rho_i, and where the zone varies along the profile, out of the loosest zone of all stations
that its foot may come to (see `bands`). When every box is refuted, no placement of the part can pass: whatever fit is
used, whatever datum, and whatever points are still to come, since the maximum over more points is never smaller. The root of the
search is every anchor in the nominal's box grown by the zone, and every angle, so the answer depends on no start. Where a fit is
locked or limited, the root is what it may do from its known start (see `motions`), and the answer is of those motions alone.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from inspection.bands import Band, EvenBand
from inspection.coarse import check_registrable
from inspection.freedoms import Freedoms
from inspection.kernels import project
from inspection.kernels.layout import OPEN_END
from inspection.motions import Motions, every_motion, motions_within
from inspection.nominal import NominalProfile
from inspection.rigid import RigidTransform
from inspection.telling_points import MANY, telling_rows

Array = NDArray[np.float64]
Rows = NDArray[np.int64]

_WAVE = 256  # boxes looked at together
_STAGES = ((0, 4), (4, 12), (12, 40))  # positions in the list of witnesses: most boxes fall to the first few points
_EVEN_WITNESSES = 24
_SMALL = 4.0  # boxes that move points by less than this many half zones, where they are narrowest, are asked with every point
_FULL_LOOKS = 16  # of those boxes, per wave
_TURN_SHARE = 0.7  # a box is cut in place while that moves points at least this much as the angle does
_ROUNDING_MM = 1e-9  # of a distance: far above what the projection errs by


@dataclass(frozen=True, slots=True)
class PlacementProof:
    """What a search over every placement found.

    outcome   : "refuted" (no placement passes), "fits" (`pose` passes), "undecided" (the search ended before it knew)
    pose      : nominal from section, a placement that passes
    witnesses : points (indices) whose deviations refuted boxes, the most telling first
    boxes     : boxes of motions that were looked at
    finest_mm : the least by which a refuted box moves the point that refutes it; infinite where none was refuted
    """

    outcome: Literal["refuted", "fits", "undecided"]
    pose: RigidTransform | None
    witnesses: tuple[int, ...]
    boxes: int
    finest_mm: float = np.inf


@dataclass(slots=True)
class _Boxes:
    """Boxes of motions: centre shift (k, 2), angle (k,), half widths (k, 2), (k,), and how far out of the zone their parent was (k,)."""

    place: Array
    angle: Array
    half: Array
    turn: Array
    excess: Array

    def __len__(self) -> int:
        return len(self.angle)

    def rows(self, picked: NDArray[np.generic]) -> "_Boxes":
        return _Boxes(self.place[picked], self.angle[picked], self.half[picked], self.turn[picked], self.excess[picked])

    def joined(self, others: Sequence["_Boxes"]) -> "_Boxes":
        every = [self, *others]
        return _Boxes(*(np.concatenate([getattr(boxes, name) for boxes in every]) for name in self.__slots__))

    def moves_mm(self, reach_mm: Array | float) -> Array:
        """How far (k,), or (k, j), each box moves points that are so far from the anchor, at most."""
        turns = 2 * np.sin(self.turn / 2)
        shifts = np.hypot(self.half[:, 0], self.half[:, 1])
        return np.asarray(shifts + turns * reach_mm if isinstance(reach_mm, float) else shifts[:, None] + turns[:, None] * reach_mm)


class PlacementSearch:
    """The search for a placement that passes, over the points of a growing scan.

    allowed       : the deviations between which every point must lie for a placement to pass: a band, or half the width of one that
                    is the same everywhere, about zero. With an uncertainty U it is the tolerance zone, wider by U on both sides
    tip_radius_mm : the points are centres of a ball of this radius
    freedoms      : only the motions that they allow from the start of a look count; None lets every motion count

    A search remembers which points refuted most, and a placement that passed, so that the next one is quick. Points beyond an open
    end count with their distance to that end; hand over only points that belong to the profile.
    """

    def __init__(
        self, nominal: NominalProfile, allowed: Band | float, tip_radius_mm: float = 0.0, freedoms: Freedoms | None = None
    ) -> None:
        self._band = EvenBand(allowed) if isinstance(allowed, float) else allowed
        self._nominal, self._tip, self._freedoms = nominal, tip_radius_mm, freedoms
        self._start: RigidTransform | None = None
        self._ends = np.empty((0, 2)) if nominal.curve.closed else nominal.curve.point(np.array(nominal.curve.domain))
        self._hits: dict[int, int] = {}
        self._passed: RigidTransform | None = None
        self._finest_mm = np.inf

    def look(
        self,
        points_mm: ArrayLike,
        start: RigidTransform | None = None,
        most_boxes: int = 60_000,
        is_over: Callable[[], bool] = lambda: False,
    ) -> PlacementProof:
        """Search every placement of section points (m, 2). Earlier ones the same as in the last call make the search quick.

        start      : a pose near which a placement that passes is sought first; None begins at the points' best fit. With freedoms it
                     is where these count from, and is needed
        most_boxes : the search gives up after so many boxes, undecided
        is_over    : asked every few milliseconds, between two waves of boxes or programs; the search gives up once it says so, undecided
        """
        points = check_registrable(points_mm)
        if self._freedoms is not None:
            if start is None:
                raise ValueError("a search within locked or limited freedoms needs the pose from which they count")
            self._start = start
        if self._passed is not None and self._excess(points, self._passed) <= 0:
            return PlacementProof("fits", self._passed, (), 0)
        pose, active = self._band.fit(points, self._nominal, start, self._tip, is_over, self._freedoms)
        if self._excess(points, pose) <= 0:
            self._passed = pose
            return PlacementProof("fits", pose, (), 0)
        if len(points) <= MANY:
            return self._search(points, active.tolist(), most_boxes, is_over)
        return self._search_by_few(points, pose, active, most_boxes, is_over)

    def look_with(
        self, points_mm: Array, rows: Rows, most_boxes: int = 400_000, is_over: Callable[[], bool] = lambda: False
    ) -> tuple[PlacementProof, Rows]:
        """Search every placement with few of points (m, 2), beginning with `rows` alone, and give the rows (w,) that it needed.

        While a placement suits them, the point that it leaves farthest out joins them. What they refute, any later check can refute
        with these points and nothing else.
        """
        return self._search_with(points_mm, rows, rows, self._worst, most_boxes, is_over)

    def _search_by_few(
        self, points: Array, pose: RigidTransform, active: Rows, most_boxes: int, is_over: Callable[[], bool]
    ) -> PlacementProof:
        """Search with few points that stand for all."""

        def telling(points: Array, pose: RigidTransform) -> Rows:
            feet = project(pose.apply(points), self._nominal.grid)
            lower, upper = self._band.limits(feet)
            share = (self._nominal.outward * feet.distance_mm - self._tip - (lower + upper) / 2) / (upper - lower)
            return np.union1d(telling_rows(feet.station_mm, share, self._nominal.length_mm), self._worst(points, pose))

        rows = np.union1d(active, telling(points, pose))
        return self._search_with(points, rows, active, telling, most_boxes, is_over)[0]

    def _search_with(
        self,
        points: Array,
        rows: Rows,
        active: Rows,
        joining: Callable[[Array, RigidTransform], Rows],
        most_boxes: int,
        is_over: Callable[[], bool],
    ) -> tuple[PlacementProof, Rows]:
        """Search with few rows: what they refute is refuted, and what fits them is asked of all the others, some of which join."""
        boxes = 0
        while True:
            proof = self._search(points[rows], np.flatnonzero(np.isin(rows, active)).tolist(), most_boxes - boxes, is_over)
            boxes += proof.boxes
            proof = replace(proof, boxes=boxes, witnesses=tuple(rows[list(proof.witnesses)].tolist()))
            if proof.pose is None or self._excess(points, proof.pose) <= 0:
                return proof, rows
            if boxes >= most_boxes or is_over():
                return replace(proof, outcome="undecided", pose=None), rows
            rows = np.union1d(rows, joining(points, proof.pose))

    def _worst(self, points: Array, pose: RigidTransform) -> Rows:
        """The row (1,) of the point that a pose leaves farthest out of the zone."""
        return np.array([self._outside(pose.apply(points)).argmax()])

    def _search(self, points: Array, active: list[int], most_boxes: int, is_over: Callable[[], bool]) -> PlacementProof:
        """Refute boxes of motions until none is left, best first; `active` are the points that hold the minimum zone nearby."""
        motions = self._motions(points)
        even = np.linspace(0, len(points) - 1, _EVEN_WITNESSES).astype(int).tolist()
        hits = {row: count for row, count in self._hits.items() if row < len(points)}
        self._hits = dict.fromkeys([*hits, *active, *even], 0) | hits
        waiting, looked_at = _root(motions), 0
        while len(waiting):
            if looked_at >= most_boxes or is_over():
                return PlacementProof("undecided", None, self._witnesses(), looked_at)
            wave, waiting = _best(waiting)
            looked_at += len(wave)
            left = self._not_refuted(wave, motions)
            if len(left):
                left, passing = self._asked_of_all(left, motions)
                if passing is not None:
                    self._passed = motions.pose(*passing)
                    return PlacementProof("fits", self._passed, self._witnesses(), looked_at)
                if float(left.moves_mm(motions.reach_mm).min(initial=np.inf)) < _ROUNDING_MM:
                    return PlacementProof("undecided", None, self._witnesses(), looked_at)  # nothing that is left to cut tells more
                waiting = waiting.joined(_halves(left, motions))
        return PlacementProof("refuted", None, self._witnesses(), looked_at, self._finest_mm)

    def _motions(self, points: Array) -> Motions:
        """Every motion of points (m, 2) that could pass."""
        low, high = self._nominal.points_mm.min(axis=0), self._nominal.points_mm.max(axis=0)
        bounds = points, low, high, self._band.farthest_mm + self._tip
        if self._freedoms is None or self._start is None:
            return every_motion(*bounds)
        return motions_within(*bounds, self._start, self._freedoms)

    def _not_refuted(self, wave: _Boxes, motions: Motions) -> _Boxes:
        """Return the boxes that none of the witnesses refutes, each with how far out its centre is."""
        alive = np.arange(len(wave))
        ordered = sorted(self._hits, key=lambda row: -self._hits[row])
        for first, stop in _STAGES:
            rows = np.array(ordered[first:stop], dtype=np.int64)
            if not len(alive) or not len(rows):
                break
            boxes = wave.rows(alive)
            margin, excess = self._margins(boxes, motions, rows)
            wave.excess[alive] = np.maximum(wave.excess[alive], excess.max(axis=1))
            refuted = margin.max(axis=1) > 0
            by = margin[refuted].argmax(axis=1)
            moves = excess[refuted, by] - margin[refuted, by]
            self._finest_mm = min(self._finest_mm, float(moves.min(initial=np.inf)))
            for row in rows[by].tolist():
                self._hits[row] += 1
            alive = alive[~refuted]
        return wave.rows(alive)

    def _asked_of_all(self, boxes: _Boxes, motions: Motions) -> tuple[_Boxes, tuple[Array, float] | None]:
        """Ask the small boxes with every point; return what is left, and the shift and angle of a centre that passes."""
        every = np.arange(len(motions.arms))
        small = np.flatnonzero(boxes.moves_mm(motions.reach_mm) < _SMALL * self._band.narrowest_mm)
        left = np.ones(len(boxes), dtype=bool)
        first = small[np.argsort(boxes.excess[small])][:_FULL_LOOKS]
        if not len(first):
            return boxes, None
        margins, excesses = self._margins(boxes.rows(first), motions, every)
        for box, margin, excess in zip(first.tolist(), margins, excesses, strict=True):
            if excess.max() <= 0 and self._outside(_moved(boxes, box, motions)).max() <= 0:
                return boxes, (boxes.place[box], float(boxes.angle[box]))
            left[box] = margin.max() <= 0
            if not left[box]:
                self._finest_mm = min(self._finest_mm, float((excess - margin)[margin.argmax()]))
            self._hits.setdefault(int(excess.argmax()), 1)
            boxes.excess[box] = max(boxes.excess[box], float(excess.max()))
        return boxes.rows(left), None

    def _margins(self, boxes: _Boxes, motions: Motions, rows: Rows) -> tuple[Array, Array]:
        """By how much each of rows (j,) refutes each box (k), and how far out of the zone the box's centre puts it, both (k, j)."""
        arms = motions.arms[rows]
        moves = boxes.moves_mm(np.hypot(*arms.T))
        places = motions.places(boxes.place, boxes.angle, arms)
        excess = self._outside(places.reshape(-1, 2), moves.reshape(-1)).reshape(moves.shape)
        return excess - moves - _ROUNDING_MM, excess

    def _excess(self, points: Array, pose: RigidTransform) -> float:
        return float(self._outside(pose.apply(points)).max())

    def _outside(self, places: Array, moves: Array | None = None) -> Array:
        """How far places (j, 2) lie out of the zone, or of the loosest one that they may come to when they move by `moves` (j,).

        The sign of a distance turns round in the region beyond an open end. Where a place may come there, the kinder sign counts,
        so that the bound holds across the jump. Within freedoms such a place says nothing, for at the pose of a fit it takes no part.
        """
        feet = project(places, self._nominal.grid)
        lower, upper = self._band.limits(feet) if moves is None else self._band.loosest(places, feet, moves)

        def outside(outward: float) -> Array:
            deviation = outward * feet.distance_mm - self._tip
            return np.maximum(lower - deviation, deviation - upper)

        found = outside(self._nominal.outward)
        if len(self._ends):
            to_end = np.hypot(*(places[:, None, :] - self._ends).T).min(axis=0)
            either = (feet.vertex == OPEN_END) | (to_end <= np.abs(feet.distance_mm) + (0.0 if moves is None else 2 * moves))
            kinder = np.minimum(outside(1.0), outside(-1.0)) if self._freedoms is None else -np.inf
            found = np.where(either, kinder, found)
        return found

    def _witnesses(self) -> tuple[int, ...]:
        return tuple(row for row in sorted(self._hits, key=lambda row: -self._hits[row]) if self._hits[row])


def _root(motions: Motions) -> _Boxes:
    """Return the one box that holds every motion which could pass."""
    return _Boxes(motions.shift_mm[None], np.array([motions.angle]), motions.half_mm[None], np.array([motions.turn]), np.zeros(1))


def _moved(boxes: _Boxes, box: int, motions: Motions) -> Array:
    """The places (m, 2) to which the centre of a box brings the points, as the pose of that motion does."""
    return RigidTransform(float(boxes.angle[box]), motions.origin + boxes.place[box] @ motions.axes).apply(motions.arms)


def _best(waiting: _Boxes) -> tuple[_Boxes, _Boxes]:
    """Take the most promising boxes off those that wait."""
    if len(waiting) <= _WAVE:
        return waiting, waiting.rows(np.empty(0, dtype=np.int64))
    order = np.argpartition(waiting.excess, _WAVE)
    return waiting.rows(order[:_WAVE]), waiting.rows(order[_WAVE:])


def _halves(boxes: _Boxes, motions: Motions) -> list[_Boxes]:
    """Cut every box in place, into four, or in angle, into two: whichever moves points more. What is locked is not cut."""
    in_place = np.hypot(*boxes.half.T) >= _TURN_SHARE * 2 * np.sin(boxes.turn / 2) * motions.reach_mm
    wide, long = boxes.rows(in_place), boxes.rows(~in_place)
    h, t = wide.half / 2, long.turn / 2
    quarters = [_Boxes(wide.place + np.array(way) * h, wide.angle, h, wide.turn, wide.excess) for way in motions.ways]
    return quarters + [_Boxes(long.place, long.angle + way * t, long.half, t, long.excess) for way in (-1, 1)]
