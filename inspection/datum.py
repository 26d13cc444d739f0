"""A datum that is measured: the pose at which stated features of the measured profile lie on the nominal.

Every feature asks that certain weighted sums of the deviations of its points vanish. A line asks for two, those of least squares over
a rotation and a shift across it. An edge asks for two as well, those of least squares over both shifts. A point asks for one, the
deviation at its place, read from the straight line that best fits the deviations around it. Three sums fix the three motions of the
plane, so that the pose follows by Newton steps, begun at a pose near by, and how an error of any point moves it stands in closed form.
"""

from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from inspection.errors import InspectionError
from inspection.freedoms import gradients
from inspection.gaps import measure_region, weigh_by_station
from inspection.methods import Method, WeightName
from inspection.nominal import NominalProfile
from inspection.rigid import RigidTransform, rotation_about
from inspection.signed_deviations import Deviations, deviations

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
DatumKind = Literal["line", "edge", "point"]

_FIXED: dict[DatumKind, int] = {"line": 2, "edge": 2, "point": 1}  # motions that a feature fixes
_MOST_ROUNDS, _MOST_STEPS, _HALVINGS = 20, 60, 12
_STANDSTILL_MM = 1e-9
_WIDER = 0.1  # of the profile's length: points so far beside a feature are looked at too, for the pose may bring them into it
_LEAST_SHARE = 1e-3  # of the largest effect of a motion on the sums: what has less is not fixed
_LINE_TURNS = 0.5  # cosine: the nominal of a line may turn by 60 degrees to either side, beyond which it fixes no one direction
_LINE_PIECES = 4  # a line or an edge must have a point in every quarter of it at least


@dataclass(frozen=True, slots=True)
class DatumFeature:
    """A feature of the nominal that the part is placed by: a stretch of stations in mm, above `to_mm` where it crosses the seam.

    Of a point the stretch are the points around its place, which is in the middle.
    """

    kind: DatumKind
    from_mm: float
    to_mm: float
    words: str

    def span_mm(self, nominal: NominalProfile) -> float:
        """The length of its stretch."""
        span = self.to_mm - self.from_mm
        return span % nominal.length_mm if nominal.curve.closed else span


@dataclass(frozen=True, slots=True)
class DatumFeatures:
    """Features that fix all three motions of a part in the plane. Raises ValueError for those that do not."""

    features: tuple[DatumFeature, ...]

    def __post_init__(self) -> None:
        if sum(_FIXED[one.kind] for one in self.features) != 3:
            raise ValueError("a datum fixes three motions: by a line and a point, by an edge and a point, or by three points")

    @property
    def words(self) -> str:
        """What the datum is made of, such as "line station 10 .. 60 mm, point at station 103 mm"."""
        return ", ".join(one.words for one in self.features)


@dataclass(frozen=True, slots=True)
class SeenFeature:
    """What was seen of a feature at the datum's pose: how many points, their rms deviation, and the longest gap between them."""

    feature: DatumFeature
    points: int
    rms_mm: float
    gap_mm: float


@dataclass(frozen=True, slots=True, eq=False)
class FoundDatum:
    """A datum that was found.

    pose       : nominal from section
    seen       : of every feature
    station_mm, at_mm, normal : (m,), (m, 2), (m, 2) of the points that it rests on, at the pose, in nominal coordinates
    gain       : (3, m) how a unit of each of their deviations moves the pose: shift in mm and rotation in rad about `pivot_mm`
    pivot_mm   : (2,)
    """

    pose: RigidTransform
    seen: tuple[SeenFeature, ...]
    station_mm: Array
    at_mm: Array
    normal: Array
    gain: Array
    pivot_mm: Array

    def __post_init__(self) -> None:
        for array in (self.station_mm, self.at_mm, self.normal, self.gain, self.pivot_mm):
            array.setflags(write=False)

    @property
    def words(self) -> str:
        """What it was found by."""
        return ", ".join(one.feature.words for one in self.seen)

    def amplification(self, at_mm: Array, normal: Array) -> Array:
        """By how much (n,) a deviation at places (n, 2) may be off, for every mm that each point of the datum may be off at worst."""
        return np.asarray(np.abs(gradients(normal, at_mm - self.pivot_mm) @ self.gain).sum(axis=1))


def find_datum(
    points_mm: Array,
    nominal: NominalProfile,
    features: DatumFeatures,
    start: RigidTransform,
    gap_max_mm: float,
    method: Method = "exact",
    tip_radius_mm: float = 0.0,
    weights: WeightName = "arc-length",
) -> FoundDatum:
    """The pose at which features of points (m, 2) in section coordinates lie on the nominal, near a start.

    gap_max_mm : the longest stretch of a feature without a point that counts as measured

    Raises InspectionError where a feature was not measured, or where the features do not fix the part.
    """
    at_start = deviations(start.apply(points_mm), nominal, method, tip_radius_mm)
    look = _Look(points_mm[_is_near(at_start, nominal, features)], nominal, features, method, tip_radius_mm, weights)
    pose, members = start, look.members(look(start))
    before: list[bytes] = []
    while members.tobytes() not in before:
        if len(before) == _MOST_ROUNDS:
            raise InspectionError(f"The datum ({features.words}) does not settle: which points belong to it changes with every fit.")
        before.append(members.tobytes())
        pose = _settle(look, pose, members)
        members = look.members(look(pose))
    return _found(look, _settle(look, pose, members).snap_to_grid(), members, gap_max_mm)


class _State(NamedTuple):
    """Points (m, 2) at a pose, their deviations, and the share of the profile that each stands for (m,)."""

    moved: Array
    d: Deviations
    shares: Array


class _Look:
    """The points that features may rest on, at any pose."""

    def __init__(
        self, points: Array, nominal: NominalProfile, features: DatumFeatures, method: Method, tip_radius_mm: float, weights: WeightName
    ) -> None:
        self.points, self.nominal, self.features = points, nominal, features.features
        self.words, self._method, self._tip, self._weights = features.words, method, tip_radius_mm, weights

    def __call__(self, pose: RigidTransform) -> _State:
        moved = pose.apply(self.points)
        d = deviations(moved, self.nominal, self._method, self._tip)
        shares = np.where(d.beyond_end, 0.0, 1.0)
        if self._weights == "arc-length":
            weigh_by_station(np.where(d.beyond_end, np.nan, d.station_mm), shares, self.nominal)
        return _State(moved, d, shares)

    def members(self, state: _State) -> Mask:
        """Which points (f, m) lie on each of the features."""
        return np.stack([(ahead >= 0) & ~state.d.beyond_end for ahead in (self.ahead(one, state.d) for one in self.features)])

    def ahead(self, feature: DatumFeature, d: Deviations) -> Array:
        """How far (m,) points lie behind the beginning of a feature; negative beside it."""
        along, span = d.station_mm - feature.from_mm, feature.span_mm(self.nominal)
        if self.nominal.curve.closed:
            along = np.mod(along, self.nominal.length_mm)
        return np.where(along <= span, along, -1.0)

    def sums(self, state: _State, members: Mask) -> Array:
        """The sums (3, m) of the deviations that vanish at the datum, each with absolute weights that add up to one."""
        rows: list[Array] = []
        for one, inside in zip(self.features, members, strict=True):
            if not inside.any():
                raise InspectionError(f"The datum was not found: nothing was measured at its {one.words}.")
            share = np.where(inside, state.shares, 0.0)
            rows += [self._of_point(one, state, share)] if one.kind == "point" else _of_stretch(one, state, share)
        found = np.stack(rows)
        size = np.abs(found).sum(axis=1, keepdims=True)
        return np.asarray(found / np.where(size > 0, size, 1.0))

    def _of_point(self, one: DatumFeature, state: _State, share: Array) -> Array:
        """The deviation at a place, by the line of least squares through those around it; the nearer to it, the more a point counts."""
        half = one.span_mm(self.nominal) / 2
        off = (self.ahead(one, state.d) - half) / half
        near = share * np.maximum(1.0 - np.abs(off), 0.0)
        if not near.any():
            near = share
        count, first, second = (float((near * off**power).sum()) for power in range(3))
        spread = count * second - first * first
        return near * (second - off * first) / spread if spread > 1e-9 * count * count else near / count


def _of_stretch(one: DatumFeature, state: _State, share: Array) -> list[Array]:
    """The sums of least squares: of a line over a rotation and a shift across it, of an edge over both shifts."""
    normal, total = state.d.normal, float(share.sum())
    if one.kind == "edge":
        return [share * normal[:, 0], share * normal[:, 1]]
    across = (share[:, None] * normal).sum(axis=0)
    across /= max(float(np.hypot(*across)), 1e-300)
    if float((normal[share > 0] @ across).min()) < _LINE_TURNS:
        raise InspectionError(f"The {one.words} turns too far for a line: it fixes no direction.")
    rates = gradients(normal, state.moved - (share[:, None] * state.moved).sum(axis=0) / total)
    return [share * (rates[:, :2] @ across), share * rates[:, 2]]


def _is_near(d: Deviations, nominal: NominalProfile, features: DatumFeatures) -> Mask:
    """Which points (m,) lie on a feature or not far beside one, so that another pose may bring them onto it."""
    near, wider = np.zeros(len(d), dtype=np.bool_), _WIDER * nominal.length_mm
    for one in features.features:
        along, span = d.station_mm - one.from_mm, one.span_mm(nominal)
        if nominal.curve.closed:
            along = np.mod(along + wider, nominal.length_mm) - wider
        near |= (along >= -wider) & (along <= span + wider)
    return near


def _settle(look: _Look, pose: RigidTransform, members: Mask) -> RigidTransform:
    """Go to where the sums vanish. Raises InspectionError where they do not, or do not depend on every motion."""
    state = look(pose)
    left = _left_of(look, state, members)
    for _ in range(_MOST_STEPS):
        step, pivot = _step(look, state, members)
        reach = float(np.hypot(*(state.moved - pivot).T).max(initial=0.0))
        share = 1.0
        for _ in range(_HALVINGS):
            onward = rotation_about(pivot, share * float(step[2]), share * step[:2]).after(pose)
            trial = look(onward)
            after = _left_of(look, trial, members)
            if after <= left or after < _STANDSTILL_MM:
                break
            share /= 2
        else:
            break
        pose, state, left = onward, trial, after
        if share * (float(np.hypot(*step[:2])) + reach * abs(float(step[2]))) <= _STANDSTILL_MM:
            return pose
    raise InspectionError(f"The datum ({look.words}) does not settle: its points do not lie on the nominal together.")


def _left_of(look: _Look, state: _State, members: Mask) -> float:
    """How far from zero the sums are together."""
    return float(np.abs(look.sums(state, members) @ state.d.deviation_mm).sum())


def _step(look: _Look, state: _State, members: Mask) -> tuple[Array, Array]:
    """The motion (3,) that brings the sums to zero, and the pivot (2,) that it turns about."""
    sums = look.sums(state, members)
    turned_back, pivot = _inverse(look, state, sums)
    return -(turned_back @ (sums @ state.d.deviation_mm)), pivot


def _inverse(look: _Look, state: _State, sums: Array) -> tuple[Array, Array]:
    """The motions (3, 3) by the sums, about a pivot (2,) in the middle of the points that count."""
    counted = np.abs(sums).sum(axis=0) > 0
    pivot = state.moved[counted].mean(axis=0)
    arms = state.moved - pivot
    units = np.array([1.0, 1.0, 1.0 / max(float(np.hypot(*arms[counted].T).max(initial=0.0)), 1e-9)])
    effects = (sums @ gradients(state.d.normal, arms)) * units
    values = np.linalg.svd(effects, compute_uv=False)
    if values[-1] <= _LEAST_SHARE * values[0]:
        raise InspectionError(f"The datum ({look.words}) does not fix the part: it can still shift or turn without any of it changing.")
    return np.linalg.inv(effects) * units[:, None], pivot


def _found(look: _Look, pose: RigidTransform, members: Mask, gap_max_mm: float) -> FoundDatum:
    """The datum at its pose. Raises InspectionError where a feature was not measured throughout."""
    state = look(pose)
    stations = np.where(state.d.beyond_end, np.nan, state.d.station_mm)
    seen = []
    for one, inside in zip(look.features, members, strict=True):
        span = one.span_mm(look.nominal)
        allowed = min(gap_max_mm, span / 2 if one.kind == "point" else span / _LINE_PIECES)
        gap = measure_region(stations, look.nominal, allowed, one.from_mm, one.to_mm).gap
        if gap.length_mm > allowed * (1 + 1e-9):
            where = f"from station {gap.from_mm:.4g} to {gap.to_mm:.4g} mm nothing was measured, and {allowed:.3g} mm are allowed"
            raise InspectionError(f"The datum was not found: of its {one.words} {where}.")
        e = state.d.deviation_mm[inside]
        seen.append(SeenFeature(one, int(inside.sum()), float(np.sqrt(np.mean(e * e))), gap.length_mm))
    sums = look.sums(state, members)
    turned_back, pivot = _inverse(look, state, sums)
    counted = np.flatnonzero(np.abs(sums).sum(axis=0) > 0)
    gain = -(turned_back @ sums[:, counted])
    d = state.d
    return FoundDatum(pose, tuple(seen), d.station_mm[counted], state.moved[counted], d.normal[counted], gain, pivot)
