"""The actual section: the nominal outline moved along its normals by measured deviations, as one smooth curve.

Characteristics such as a radius or a camber line need a curve with a curvature, and points with noise have none. The deviations
are therefore drawn as a cubic spline over the station first, by least squares with arc-length weights (so that dwelling does not pull
it), with knots at a stated distance. The actual place at station s is foot(s) + D(s) normal(s). What the spline leaves of the
deviations stands beside it, and so do the stretches without a measured point: no value is given that was found in one.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from inspection.characteristics.outline import AirfoilSection, section_on, unwrap
from inspection.characteristics.section_value import SectionValue
from inspection.characteristics.tail import ON_FIRST, ON_FLAT, ON_LAST, ON_NONE, TailEnd, end_at_points
from inspection.curve import NurbsCurve
from inspection.errors import InspectionError
from inspection.filters import ProfileFilter
from inspection.first_use import OnFirstUse
from inspection.rigid import RigidTransform
from inspection.signed_deviations import Deviations

Array = NDArray[np.float64]
Rows = NDArray[np.int64]

_DEGREE = 3
_EDGE = 0.1  # of the section's length: to either side of a tip, what moves with its edge where edges move as a whole
_KNOTS = 200  # on the outline, unless their distance is given
_BETWEEN = 4  # places from knot to knot at which the noise left in the spline is looked at: where points are few it swings between knots
_GAP_KNOTS = 2.0  # a stretch without points that is longer than this many knot distances is drawn by no point
_BRIDGING = 1e-10  # weight of smoothness beside that of the points; it acts where there are none
_FEWEST = 6  # samples between two joints of the outline: a piece of it has as many places
_JUMP = 0.02  # of a curvature: by less it does not jump
_CLOSE = 0.2  # of a step: over a shorter one, round-off would bend a spline
_BESIDE = 1e-9  # of the parameter's range: how far beside a joint the curvature is looked at
_ON_OUTLINE = 1e-4  # of the section's length: a place nearer to the outline than this lies on it


@dataclass(frozen=True, slots=True, eq=False)
class ActualSection:
    """A measured airfoil section as a smooth curve, beside the nominal one.

    section   : the actual outline; its parameter is the station on the nominal one, and so its edges are where those of the nominal are
    nominal   : the nominal outline
    source    : "raw", or the filter that the deviations went through
    knots_mm  : distance of the knots of the spline of deviations
    points    : number of measured points that it was drawn from
    rms_mm    : root mean square of what the spline leaves of the deviations, weighted by arc length
    noise     : (j,) share of the noise of single points that is left, the largest beside each of the stations of `knots_on`
    unseen_mm : (k, 2) stretches of stations without a measured point, from and to; a station beyond the nominal's length wraps
    is_unseen : (n,) which samples of the outline lie in one
    notes     : all this in words
    """

    section: AirfoilSection
    nominal: AirfoilSection
    source: str
    knots_mm: float
    points: int
    rms_mm: float
    noise: OnFirstUse[Array]
    unseen_mm: Array
    is_unseen: NDArray[np.bool_]
    notes: tuple[str, ...]

    def __post_init__(self) -> None:
        self.unseen_mm.setflags(write=False)
        self.is_unseen.setflags(write=False)

    def moved(self, motion: RigidTransform) -> "ActualSection":
        """The same section after a rigid motion; its stations stay."""
        return replace(self, section=self.section.moved(motion))

    def unseen_place(self, value: SectionValue) -> str | None:
        """The name of a place of a value that lies where nothing was measured; None where there is none."""
        if not self.is_unseen.any():
            return None
        outline = self.section.points_mm
        for place, name in zip(value.places_mm, value.place_names, strict=True):
            distance = np.hypot(*(outline - place).T)
            near = int(np.argmin(distance))
            if self.is_unseen[near] and distance[near] < max(_ON_OUTLINE * self.section.length_mm, self._spacing(near)):
                return name
        if "end of the window" in value.place_names:
            tip, ends = value.places_mm[0], value.places_mm[2:]
            inside = np.hypot(*(outline - tip).T) < np.hypot(*(ends - tip).T).max()
            return "inside the window" if (self.is_unseen & inside).any() else None
        return None

    def _spacing(self, sample: int) -> float:
        """Distance of a sample from its farther neighbour."""
        points = self.section.points_mm
        beside = points[[max(sample - 1, 0), min(sample + 1, len(points) - 1)]]
        return float(np.hypot(*(beside - points[sample]).T).max())


def draw_actual_section(
    nominal: AirfoilSection,
    deviations: Deviations,
    filtered_mm: Array | None = None,
    filtered_by: ProfileFilter | None = None,
    knots_mm: float | None = None,
    gap_max_mm: float | None = None,
    edges_as_wholes: bool = False,
) -> ActualSection:
    """The actual section of m points with their deviations from the nominal's curve.

    deviations  : of the points at the pose of the fit or datum; points beyond an end and those whose foot is a corner are left out
    filtered_mm : (m,) filtered deviations in place of the raw ones, NaN where the filter gives none (`filter_profile`)
    filtered_by : the filter that gave them; no value may hide that it is of filtered points
    knots_mm    : distance of the spline's knots; a two-hundredth of the outline unless given. Finer detail is not drawn
    gap_max_mm  : a stretch without points longer than this is unseen; two knot distances unless given
    edges_as_wholes : also let every round edge move as a whole, which the spline cannot follow where the radius is below its knots.
                  Held against the section without it, that tells how well a number is drawn

    Raises InspectionError where fewer than eight points are left.
    """
    if (filtered_mm is None) != (filtered_by is None):
        raise ValueError("filtered deviations and the filter that gave them belong together: give both, or none")
    values = deviations.deviation_mm if filtered_mm is None else np.asarray(filtered_mm, dtype=np.float64)
    if values.shape != deviations.deviation_mm.shape:
        raise ValueError(f"expected {len(deviations)} filtered deviations, got shape {values.shape}")
    start, end = nominal.stations.value.ends
    station = unwrap(nominal.curve, deviations.station_mm, start)
    used = ~deviations.beyond_end & ~deviations.at_vertex & np.isfinite(values) & (station <= end)
    off = _flat_off_mm(nominal, deviations, station > end)
    used &= (station >= start + off) & (station <= end - off)
    station, values = station[used], values[used]
    if len(station) < 8:
        raise InspectionError(f"only {len(station)} points lie on the sides of the section: too few to draw it")
    order = np.lexsort((values, station))
    station, values = station[order], values[order]
    spacing = (end - start) / _KNOTS if knots_mm is None else float(knots_mm)
    if not 0 < spacing < (end - start) / 4:
        raise ValueError(f"the distance of knots must be positive and below a quarter of the outline, not {spacing:g} mm")
    spline, rms, noise = _draw_deviations(nominal, station, values, (start, end), spacing, edges_as_wholes)
    unseen = _find_unseen(station, (start, end), _GAP_KNOTS * spacing if gap_max_mm is None else gap_max_mm, nominal.trailing == "round")
    moved = _move_outline(nominal, spline, _drawn_range(station, (start, end), spacing))
    tail = None if nominal.trailing == "round" else _end_at_tail(moved, nominal, deviations, (start, end), off)
    section = moved if tail is None else tail.section
    at = section.parameter
    is_unseen = np.any((at[:, None] > unseen[:, 0]) & (at[:, None] < unseen[:, 1]), axis=1)
    if tail is not None:
        is_unseen |= tail.is_unseen
    source = "raw" if filtered_by is None else f"filtered ({filtered_by.words})"
    drawn = f"drawn from {len(station)} {source} deviations as a cubic spline with knots every {spacing:.4g} mm"
    left = len(deviations) - len(station)
    gaps = tuple(f"nothing was measured from station {a:.3f} to {b:.3f} mm" for a, b in unseen)
    idle = (f"{left} points took no part: beyond an end, at a corner or on the flat of the trailing edge, or without a filtered value",)
    notes = (
        f"{drawn}, which leaves {rms:.3g} mm rms",
        *((tail.words,) if tail is not None and tail.words else ()),
        *(idle if left else ()),
        *gaps,
    )
    return ActualSection(section, nominal, source, spacing, len(station), rms, noise, unseen, is_unseen, notes)


def knots_on(nominal: AirfoilSection) -> tuple[Array, Array]:
    """Stations (k,) in mm at the distance of the knots of an actual section, from end to end of its outline, and their parameters (k,)."""
    stations = np.linspace(*nominal.stations.value.ends, _KNOTS + 1)
    return stations, np.interp(stations, nominal.stations.value.at_sample, nominal.parameter)


def move_section(nominal: AirfoilSection, station_mm: Array, moved_mm: Array) -> AirfoilSection:
    """The section whose outline is the nominal one moved outward by `moved_mm` (k,) at stations (k,) from end to end, smoothly between."""
    from scipy.interpolate import make_interp_spline  # noqa: PLC0415 - it takes half a second

    if nominal.trailing == "round":
        spline = make_interp_spline(station_mm, np.append(moved_mm[:-1], moved_mm[0]), k=_DEGREE, bc_type="periodic")
    else:
        spline = make_interp_spline(station_mm, moved_mm, k=_DEGREE)
    return _move_outline(nominal, spline)


def _flat_off_mm(nominal: AirfoilSection, deviations: Deviations, on_flat: NDArray[np.bool_]) -> float:
    """How near to a corner of a blunt edge a foot on a side may belong to a point of its flat, or the other way round.

    At a corner of 40 degrees and more it is less than three times how far the flat itself is off.
    """
    on_flat = on_flat & ~deviations.at_vertex & np.isfinite(deviations.deviation_mm)
    if nominal.trailing != "blunt" or not on_flat.any():
        return 0.0
    return 3.0 * float(np.median(np.abs(deviations.deviation_mm[on_flat])))


def _end_at_tail(
    section: AirfoilSection, nominal: AirfoilSection, deviations: Deviations, ends: tuple[float, float], corner_mm: float
) -> TailEnd:
    """The drawn section with its trailing edge where the points (m,) end; places are raw, whatever the sides were drawn from.

    corner_mm : nearer to a corner than this it is not known whether a point is of the flat
    """
    places = deviations.foot_mm + deviations.normal * deviations.deviation_mm[:, None]
    station = unwrap(nominal.curve, deviations.station_mm, ends[0])
    nose = float(unwrap(nominal.curve, nominal.curve.station_mm(nominal.nose), ends[0])[0])
    on = np.where(station > ends[1], ON_FLAT, np.where(station <= nose, ON_FIRST, ON_LAST))
    flat_to = ends[0] + nominal.curve.length_mm - corner_mm
    unclear = (on == ON_FLAT) & ((station < ends[1] + corner_mm) | (station > flat_to))
    on = np.where(deviations.at_vertex | deviations.beyond_end | unclear, ON_NONE, on)
    known = np.isfinite(places).all(axis=1)
    return end_at_points(section, places[known], on[known].astype(np.int8))


def _draw_deviations(
    nominal: AirfoilSection, station: Array, values: Array, ends: tuple[float, float], spacing: float, edges_as_wholes: bool
) -> tuple[Callable[[Array], Array], float, OnFirstUse[Array]]:
    """The spline of least squares over rising stations (m,), the weighted root mean square of what it leaves, and the noise left in it."""
    from scipy.interpolate import BSpline  # noqa: PLC0415 - it takes half a second, and a plan knows only names of this file
    from scipy.sparse import block_diag, csr_array, diags_array, eye_array, hstack  # noqa: PLC0415
    from scipy.sparse.linalg import spsolve  # noqa: PLC0415

    start, end = ends
    count = max(4, round((end - start) / spacing))
    step = (end - start) / count
    knots = start + step * np.arange(-_DEGREE, count + _DEGREE + 1)
    is_round = nominal.trailing == "round"
    columns = count if is_round else count + _DEGREE
    fold = csr_array((np.ones(count + _DEGREE), (np.arange(count + _DEGREE), np.arange(count + _DEGREE) % columns)))

    def basis_at(at: Array) -> "csr_array":
        """What every coefficient does at stations (k,)."""
        local = csr_array(csr_array(BSpline.design_matrix(np.clip(at, start, np.nextafter(end, start)), knots, _DEGREE)) @ fold)
        return csr_array(hstack([local, csr_array(_edges_moved(nominal, at, ends))])) if edges_as_wholes else local

    basis = basis_at(station)
    weight = _arc_shares(station, ends, is_round)
    bend = diags_array([1.0, -2.0, 1.0], offsets=[0, 1, 2], shape=(count + _DEGREE - 2, count + _DEGREE)) @ fold
    smooth = block_diag([bend.T @ bend, eye_array(basis.shape[1] - columns)]) if edges_as_wholes else bend.T @ bend
    normal_matrix = basis.T @ (basis * weight[:, None]) + _BRIDGING * weight.sum() / columns * smooth
    coefficients = spsolve(normal_matrix.tocsc(), basis.T @ (weight * values))
    rest = values - basis @ coefficients
    rms = float(np.sqrt((weight * rest * rest).sum() / weight.sum()))

    def noise() -> Array:
        places = np.linspace(start, np.nextafter(end, start), _KNOTS * _BETWEEN + 1)
        there = basis_at(places)
        gains = np.linalg.solve(normal_matrix.toarray(), there.toarray().T)  # (columns, places) of the values there by sums over the points
        squares = (basis.T @ (basis * np.square(weight)[:, None])).toarray()
        left = np.sqrt(np.maximum(((squares @ gains) * gains).sum(axis=0), 0.0))
        return np.array([left[max(at - _BETWEEN, 0) : at + _BETWEEN + 1].max() for at in range(0, len(places), _BETWEEN)])

    if edges_as_wholes:
        return lambda at: np.asarray(basis_at(at) @ coefficients), rms, OnFirstUse(noise)
    return BSpline(knots, np.asarray(fold @ coefficients), _DEGREE), rms, OnFirstUse(noise)


def _edges_moved(nominal: AirfoilSection, station: Array, ends: tuple[float, float]) -> Array:
    """Deviations (m, 2) at stations (m,) of an outline whose leading edge moves as a whole by 1 mm along x or y, fading into both sides.

    With a round trailing edge (m, 4), the last two for that one. They follow the normal around an edge, however few knots lie there.
    """
    samples = nominal.stations.value.at_sample
    inward = nominal.frame(np.interp(station, samples, nominal.parameter))[3]
    away = [np.abs(station - samples[nominal.nose_sample])]
    if nominal.trailing == "round":
        away.append(np.minimum(station - ends[0], ends[1] - station))
    shares = [np.maximum(1.0 - np.square(one / (_EDGE * nominal.length_mm)), 0.0) ** 3 for one in away]
    return np.column_stack([(nominal.outward * nominal.inward * share)[:, None] * inward for share in shares])


def _arc_shares(station: Array, ends: tuple[float, float], is_round: bool) -> Array:
    """The length of outline (m,) that each of rising stations (m,) stands for: half the way to both neighbours."""
    before, behind = (station[-1] - (ends[1] - ends[0]), station[0] + (ends[1] - ends[0])) if is_round else (station[0], station[-1])
    steps = np.diff(np.concatenate([[before], station, [behind]]))
    shares = (steps[:-1] + steps[1:]) / 2
    return np.asarray(np.maximum(shares, 1e-9 * shares.max()))


def _find_unseen(station: Array, ends: tuple[float, float], gap_max_mm: float, is_round: bool) -> Array:
    """Stretches (k, 2) of stations without a point that are longer than `gap_max_mm`."""
    borders = np.concatenate([station[-1:] - (ends[1] - ends[0]), station]) if is_round else np.concatenate([ends[:1], station, ends[1:]])
    wide = np.flatnonzero(np.diff(borders) > gap_max_mm)
    stretches = np.column_stack([borders[wide], borders[wide + 1]])
    if is_round and len(stretches) and stretches[0, 0] < ends[0]:  # around the tip: once before its end, and once behind its beginning
        stretches = np.vstack([stretches, stretches[0] + (ends[1] - ends[0])])
    return stretches


def _drawn_range(station: Array, ends: tuple[float, float], spacing: float) -> tuple[float, float]:
    """Between which stations the spline stands on points (m,): up to an end from less than half a knot, and not into what is unmeasured."""
    first, last = float(station[0]), float(station[-1])
    return first if first - ends[0] > spacing / 2 else ends[0], last if ends[1] - last > spacing / 2 else ends[1]


def _move_outline(
    nominal: AirfoilSection, spline: Callable[[Array], Array], within: tuple[float, float] = (-np.inf, np.inf)
) -> AirfoilSection:
    """The section whose outline is the nominal one moved along its normals by the spline of deviations over stations.

    within : the stations between which the spline holds; beyond them an outline with ends has the deviation from there
    """
    along = nominal.stations.value
    parameter, station, joints = _with_joints(nominal, along.fine, along.fine_mm)
    point, _, _, inward = nominal.frame(parameter)
    at = station if nominal.trailing == "round" else np.clip(station, *within)
    moved = point + (nominal.outward * nominal.inward * spline(at))[:, None] * inward
    nose = float(along.at_sample[nominal.nose_sample])
    if nominal.trailing == "round":
        moved[-1] = moved[0]
    curve = _curve_through(station, moved, joints, nominal.trailing == "round")  # over the station it does not feel the parameter
    return section_on(curve, float(station[0]), float(station[-1]), nominal.trailing, nominal.outward, nose)


def _with_joints(nominal: AirfoilSection, parameter: Array, station: Array) -> tuple[Array, Array, Rows]:
    """Rising samples (j,) of an outline by parameter and station, with its joints among them, and which they are.

    At a joint the curvature of the nominal jumps, as where a line runs into an arc. A spline through places on both sides of it would
    swing there, its curvature by a sixth of the jump, however dense the places are.
    """
    joints = _joints(nominal)
    at = unwrap(nominal.curve, nominal.curve.station_mm(joints), float(station[0])) if len(joints) else joints
    inside = (at > station[_FEWEST]) & (at < station[-1 - _FEWEST])
    joints, at = joints[inside], at[inside]
    after = np.searchsorted(station, at)
    step = station[after] - station[after - 1]
    kept = np.ones(len(station), dtype=np.bool_)
    kept[after[station[after] - at < _CLOSE * step]] = False
    kept[after[at - station[after - 1] < _CLOSE * step] - 1] = False
    station, parameter = np.append(station[kept], at), np.append(parameter[kept], joints)
    order = np.argsort(station, kind="stable")
    rows = np.flatnonzero(order >= kept.sum())
    return parameter[order], station[order], rows[np.diff(rows, prepend=0) >= _FEWEST]


def _joints(nominal: AirfoilSection) -> Array:
    """Parameters (q,) within an outline at which the curvature of the nominal jumps."""
    curve = nominal.curve
    start, end = curve.domain
    knots = np.unique(curve.knots[(curve.knots >= start) & (curve.knots <= end)])
    every = np.unique(np.concatenate([knots, knots + (end - start)]) if curve.closed else knots)
    beside = _BESIDE * (end - start)
    every = every[(every > nominal.first + beside) & (every < nominal.last - beside)]
    if not len(every):
        return every
    before, behind = (curve.curvature(every + way) for way in (-beside, beside))
    return np.asarray(every[np.abs(behind - before) > _JUMP * np.maximum(np.abs(before), np.abs(behind))])


def _curve_through(station: Array, places: Array, joints: Rows, closed: bool) -> NurbsCurve:
    """The cubic through places (j, 2) at rising stations (j,), in one piece from each of the joints to the next."""
    from scipy.interpolate import make_interp_spline  # noqa: PLC0415 - it takes half a second

    if not len(joints):
        drawn = make_interp_spline(station, places, k=_DEGREE, bc_type="periodic" if closed else None)
        return NurbsCurve(_DEGREE, drawn.c, drawn.t, closed=closed)
    cuts = [0, *joints.tolist(), len(station) - 1]
    drawn_pieces = [make_interp_spline(station[a : b + 1], places[a : b + 1], k=_DEGREE) for a, b in pairwise(cuts)]
    first, *others = drawn_pieces
    control = np.vstack([first.c, *(piece.c[1:] for piece in others)])
    knots = np.concatenate([first.t[:-1], *(piece.t[_DEGREE + 1 : -1] for piece in others), others[-1].t[-1:]])
    return NurbsCurve(_DEGREE, control, knots, closed=closed)
