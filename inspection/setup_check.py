"""Whether the set-up contradicts the points: then nothing was measured, and the likely mend is named in a sentence.

A part that merely fails is none of this file's business: every check asks for a signature that no defect leaves. Sizes differ by a
quarter; the points lie in another plane or in several; a few lie where no part is; all are out by the same; the mirror image fits far
better; or the pose that was given lies far off although the points fit.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from inspection.cloud import MANY, Cloud, few_of, row_blocks
from inspection.coarse import FEWEST_POINTS
from inspection.contour_order import trace_contour
from inspection.errors import NotMeasured
from inspection.far_points import Away, far_points, refuse_beyond_a_kilometre, space_of, words_of_far
from inspection.fine import MISFIT, register
from inspection.plane_check import STRAIGHT, check_plane, check_section
from inspection.registration import Registration, no_outliers
from inspection.scan_rows import ScanRows
from inspection.shift_words import SHIFT_SCATTERS, away_mm, is_a_radius, shift_of, words_of_shift
from inspection.signed_deviations import deviations
from inspection.terms import Terms
from inspection.unit_factors import UNIT_FACTORS

Array = NDArray[np.float64]

_FAR_STRAIGHTER = 0.1  # of the rms at the best fit
_SIZES_APART = 1.25
_SURELY_APART = _SIZES_APART * (1 - 1e-9)  # and rounding changes nothing
_LOOKS = 16  # directions: what lies between two of them shows at least 99.5 % of its length
_LOOKED_AT = 1 << 12  # points together
_GROUPS_APART = 0.2  # of the size: no gap of a scan that still goes round is so wide
_FACTOR_NEAR = 1.05
_NEARLY_CLOSED = 3.0  # steps between the two ends of the line on which the points lie
_WAY_ROUND = (0.8, 3.0)  # times the length round the points: a shorter line does not go round, a longer one leaps to and fro
_MOST_STEPS = 2000  # of that line
_MIRROR_FAR_BETTER = 0.35  # of the rms: no defect makes the mirror image fit so much better
_MIRROR_BETTER = 0.5  # and this with every point inside the zone
_SHIFT_ZONES, _SHIFT_MM = 3.0, 0.2  # widths of the zone, and mm, by which all points are out
_SHIFT_HINT = 3.0  # scatters at a fit about 0, which spoils a shift
_FITS_INSTEAD = 0.2  # of the rms at the known pose


def check_points(rows: ScanRows, points: Cloud, terms: Terms) -> NDArray[np.bool_]:
    """Raise NotMeasured where the points cannot be a scan of this section, whatever their pose; what size and plane say of many, few tell.

    points : the usable ones of the rows
    Returns which of them (m,) lie far from all others; there are none unless outliers are to be rejected.
    """
    check_section(rows, len(points), terms.off_section_max_mm)
    if len(points) < FEWEST_POINTS:
        return no_outliers(len(points))
    space = few_of(lambda: space_of(rows, points), len(points))
    refuse_beyond_a_kilometre(space, len(points))
    away = Away.of(space, terms.nominal)
    far = far_points(rows, points, away)
    if far.any() and not terms.reject_outliers:
        raise NotMeasured(words_of_far(rows, points, far))
    near = few_of(lambda: space_of(rows, points, far), len(points) - int(np.count_nonzero(far))) if far.any() else space
    check_plane(near, rows.plane, terms)
    _check_size(near[:, :2], terms)
    return far


def check_fit(points: Cloud, registration: Registration, terms: Terms) -> None:
    """Raise NotMeasured where the points, at the pose that was found or is known, are not of this part as it was set up."""
    points = points.without(registration.outliers)
    if len(points) > MANY and all(_is_inside(block, registration, terms) for block in points.blocks()):
        return
    kept = points.few()
    found = _Found.at(kept, registration, terms)
    if found is None or found.worst_mm <= terms.zone.uncertainty_mm:
        return
    _check_ball(kept, found, terms)
    direct = _fit(kept, terms) if terms.known_pose is not None else registration
    if direct is None:
        return
    size = terms.nominal.size_mm
    _check_straight(kept, direct)
    _check_unit_of_part(kept, direct, terms)
    if terms.known_pose is not None and found.rms_mm > MISFIT * size and direct.rms_mm < _FITS_INSTEAD * found.rms_mm:
        raise NotMeasured(_words_of_pose(found.rms_mm, direct, registration))
    _check_mirrored(kept, direct, terms)
    if max(direct.rms_mm, found.rms_mm) > MISFIT * size:
        raise NotMeasured(
            f"the points do not fit the nominal: rms {direct.rms_mm:.4g} mm after the best registration; they span "
            f"{np.hypot(*np.ptp(kept, axis=0)):.4g} mm, the nominal {size:.4g} mm. Check the unit, the scale and the nominal"
        )


def _check_unit_of_part(points_mm: Array, direct: Registration, terms: Terms) -> None:
    """Raise NotMeasured where points (m, 2), a scan of a part of the profile, fit far better in a larger unit."""
    for factor, mend in UNIT_FACTORS:
        if factor <= 1.0 or factor * _across(points_mm) > _SIZES_APART * _across(terms.nominal.points_mm):
            continue
        fitted = _fit(points_mm * factor, terms)
        if fitted is not None and fitted.rms_mm < _FITS_INSTEAD * direct.rms_mm:
            raise NotMeasured(
                f"the points fit the nominal to {fitted.rms_mm:.4g} mm (rms) when they are taken {factor:g} times as large, instead of to "
                f"{direct.rms_mm:.4g} mm: {mend}"
            )


def _check_straight(points_mm: Array, direct: Registration) -> None:
    """Raise NotMeasured where the points (m, 2) lie on a straight line and the nominal does not: a curve was looked at from its edge."""
    length, width = np.linalg.svd(points_mm - points_mm.mean(axis=0), compute_uv=False) / np.sqrt(len(points_mm))
    if width <= STRAIGHT * length and width <= _FAR_STRAIGHTER * direct.rms_mm:
        raise NotMeasured(
            f"the points lie on a straight line (within {width:.2g} mm rms), the nominal does not (rms {direct.rms_mm:.4g} mm at the best "
            "fit): are these the columns of x and y (--columns), and is this the plane of the section (--plane)?"
        )


def _is_inside(points_mm: Array, registration: Registration, terms: Terms) -> bool:
    found = _Found.at(points_mm, registration, terms)
    return found is None or found.worst_mm <= terms.zone.uncertainty_mm


@dataclass(frozen=True, slots=True, eq=False)
class _Found:
    """What the points are at a pose: deviations (k,) in mm, their rms, and how far the worst lies outside the zone."""

    deviation_mm: Array
    rms_mm: float
    worst_mm: float

    @classmethod
    def at(cls, points_mm: Array, registration: Registration, terms: Terms) -> "_Found | None":
        """The deviations of points (m, 2), without those beyond an end; None where no point is left."""
        found = deviations(registration.nominal_from_section.apply(points_mm), terms.nominal, "exact", terms.tip_radius_mm)
        deviation = found.deviation_mm[~found.beyond_end]
        if not len(deviation):
            return None
        middle, half = terms.zone.middle_mm, (terms.zone.upper_mm - terms.zone.lower_mm) / 2
        away = np.abs(deviation - middle)
        return cls(deviation, float(np.sqrt((away**2).mean())), float(away.max()) - half)


def _check_size(points_mm: Array, terms: Terms) -> None:
    """Raise NotMeasured where a scan that goes round is not of the nominal's size, or where a known factor would make all of it fit."""
    nominal = terms.nominal
    if _are_as_wide(points_mm, nominal.points_mm):
        return
    scan, want = _across(points_mm), _across(nominal.points_mm)
    if not scan > 0 or 1 / _SIZES_APART < want / scan < _SIZES_APART:
        return
    factor = want / scan
    known = next((each for each in UNIT_FACTORS if 1 / _FACTOR_NEAR < factor / each[0] < _FACTOR_NEAR), None)
    closed = nominal.curve.closed and (factor < 1 or _goes_round(points_mm))
    if not closed and not (known and _fits_whole(points_mm * known[0], terms)):
        return
    if known:
        mend = f", a factor of {factor:.4g}: {known[1]}"
    elif want <= 2.0 or scan <= 2.0:
        which, size = ("is the nominal", scan / want) if want <= 2.0 else ("are the points", factor)
        mend = f", a factor of {factor:.4g}: {which} in chord units? Give the scale, about {size:.4g}"
    else:
        mend = _words_of_groups(points_mm, want) or ". Check the unit, the scale and the nominal"
    raise NotMeasured(f"the points do not fit the nominal: they are {scan:.4g} mm across, the nominal {want:.4g} mm{mend}")


def _words_of_groups(points_mm: Array, across_mm: float) -> str:
    """Say where the points (m, 2) lie in two groups, far apart: another part, or a fixture, is among them."""
    centred = points_mm - points_mm.mean(axis=0)
    axis = np.linalg.svd(centred, full_matrices=False)[2][0]
    along = centred @ (axis * np.sign(axis[np.argmax(np.abs(axis))]))  # the sign of an axis may depend on the order of the points
    order = np.argsort(along)
    gaps = np.diff(along[order])
    cut = int(np.argmax(gaps)) + 1
    if gaps[cut - 1] < _GROUPS_APART * max(across_mm, np.ptp(along)):
        return ""
    groups = (points_mm[order[:cut]], points_mm[order[cut:]])
    places = " and ".join(f"{len(group)} around ({group.mean(axis=0)[0]:.4g}, {group.mean(axis=0)[1]:.4g})" for group in groups)
    return f". They lie in two groups, {places}, {gaps[cut - 1]:.4g} mm apart: leave out what is not of this part"


def _are_as_wide(points_mm: Array, others_mm: Array) -> bool:
    """Tell whether the largest distances between two of either points (m, 2) are alike for certain, looked at from a few directions."""
    (low, high), (other_low, other_high) = _bounds_across(points_mm), _bounds_across(others_mm)
    return low * _SURELY_APART > other_high and other_low * _SURELY_APART > high


def _bounds_across(points_mm: Array) -> tuple[float, float]:
    """Bounds of the largest distance between two of the points (m, 2): from right across all of it shows, from nearby nearly all."""
    turns = np.pi * np.arange(_LOOKS) / _LOOKS
    looks = np.column_stack([np.cos(turns), np.sin(turns)])  # (k, 2)
    low, high = np.full(_LOOKS, np.inf), np.full(_LOOKS, -np.inf)
    for rows in row_blocks(len(points_mm), _LOOKED_AT):  # from all directions at once while the points are in the cache
        along = looks @ points_mm[rows].T
        low, high = np.minimum(low, along.min(axis=1)), np.maximum(high, along.max(axis=1))
    widest = float((high - low).max())
    return widest, widest / float(np.cos(np.pi / (2 * _LOOKS)))


def _across(points_mm: Array) -> float:
    """The largest distance between two of the points (m, 2), in mm."""
    from scipy.spatial import ConvexHull, QhullError  # noqa: PLC0415 - it takes a third of a second, and few sizes are in doubt

    try:
        corners = points_mm[ConvexHull(points_mm).vertices]
    except QhullError:  # all on a line
        return float(np.hypot(*np.ptp(points_mm, axis=0)))
    # Two calipers turned about the hull (Shamos 1978): the corner across from an edge lies where the edges turn back on it. Pairs of
    # all corners would take gigabytes where a nominal has ten thousands of samples.
    x, y = (np.roll(corners, -1, axis=0) - corners).T
    turned = np.arctan2(y, x)
    turned = (turned - turned[0]) % (2 * np.pi)
    across = np.searchsorted(turned, (turned + np.pi) % (2 * np.pi))
    beside = [(across + shift) % len(corners) for shift in (-1, 0, 1)]  # and its neighbours, where edges are parallel up to rounding
    return float(max(np.hypot(*(corners[other] - np.roll(corners, -end, axis=0)).T).max() for other in beside for end in (0, 1)))


def _goes_round(points_mm: Array) -> bool:
    """Tell whether the points (m, 2), in whatever order, lie along a line that ends where it begins and goes round something."""
    from scipy.spatial import ConvexHull, KDTree, QhullError  # noqa: PLC0415

    places = np.unique(points_mm, axis=0)
    try:
        round_mm = float(ConvexHull(places).area)  # of a hull in the plane, the area is its circumference
    except QhullError:
        return False
    apart = float(np.quantile(np.asarray(KDTree(places).query(places, k=2)[0])[:, 1], 0.95))
    walk = trace_contour(Cloud(places).blocks, max(apart, round_mm / _MOST_STEPS)).walk_mm
    steps = np.hypot(*np.diff(walk, axis=0).T)
    gap, length = float(np.hypot(*(walk[-1] - walk[0]))), float(steps.sum())
    goes_along = _WAY_ROUND[0] * round_mm < length < _WAY_ROUND[1] * round_mm
    return goes_along and gap <= _NEARLY_CLOSED * float(np.quantile(steps, 0.95)) and gap < 0.1 * round_mm


def _fits_whole(points_mm: Array, terms: Terms) -> bool:
    """Tell whether the points (m, 2) would fit the nominal and reach all round it."""
    fitted = _fit(points_mm, terms)
    if fitted is None or fitted.rms_mm > 0.25 * MISFIT * terms.nominal.size_mm:
        return False
    station = np.sort(deviations(fitted.nominal_from_section.apply(points_mm), terms.nominal).station_mm)
    return bool(np.diff(station, prepend=0.0, append=terms.nominal.length_mm).max() < 0.1 * terms.nominal.length_mm)


def _fit(points_mm: Array, terms: Terms) -> Registration | None:
    """The best fit of points (m, 2), about the middle of the zone; None where there are too few for one."""
    if len(points_mm) < FEWEST_POINTS:
        return None
    return register(points_mm, terms.nominal, tip_radius_mm=terms.tip_radius_mm)


def _check_ball(points_mm: Array, found: _Found, terms: Terms) -> None:
    """Raise NotMeasured where all points (m, 2) are out by the same, far above their scatter, as ball centres are."""
    width, radius = terms.zone.upper_mm - terms.zone.lower_mm, terms.tip_radius_mm
    shift, scatter = shift_of(found.deviation_mm)
    away = away_mm(shift, terms.zone)
    if away <= width or away <= _SHIFT_HINT * scatter:
        return
    if terms.known_pose is None:  # fitted about the shift, for a fit about 0 shares a part of it out among the points
        shift, scatter = _fitted_shift(points_mm, shift, terms)
        away = away_mm(shift, terms.zone)
    if away <= width or away <= SHIFT_SCATTERS * scatter:
        return
    if not is_a_radius(shift, radius) and away < max(_SHIFT_ZONES * width, _SHIFT_MM):
        return
    raise NotMeasured(f"all points are {words_of_shift(shift, scatter, radius)}")


def _fitted_shift(points_mm: Array, shift_mm: float, terms: Terms) -> tuple[float, float]:
    """The same of points (m, 2) at the best fit to the profile that lies so far out."""
    fitted = register(points_mm, terms.nominal, tip_radius_mm=terms.tip_radius_mm + shift_mm)
    found = _Found.at(points_mm, fitted, terms)
    return shift_of(found.deviation_mm) if found is not None else (0.0, 0.0)


def _words_of_pose(rms_mm: float, fitted: Registration, known: Registration) -> str:
    moved = fitted.centre_mm - known.nominal_from_section.apply(fitted.nominal_from_section.inverse().apply(fitted.centre_mm[None, :]))[0]
    turned = np.degrees(fitted.nominal_from_section.rotation_rad - known.nominal_from_section.rotation_rad)
    return (
        f"the points lie {rms_mm:.4g} mm (rms) from the nominal where they are, but fit it to {fitted.rms_mm:.4g} mm when moved by "
        f"x {moved[0]:.4g}, y {moved[1]:.4g} mm and turned by {(turned + 180) % 360 - 180:.4g} deg: is the datum right? Or let them be "
        "fitted (--fit best-fit)"
    )


def _check_mirrored(points_mm: Array, direct: Registration, terms: Terms) -> None:
    """Raise NotMeasured where the mirror image of points (m, 2) fits far better."""
    image = points_mm[:, ::-1]
    mirrored = _fit(image, terms)
    if mirrored is None or mirrored.rms_mm >= _MIRROR_BETTER * direct.rms_mm:
        return
    found = _Found.at(image, mirrored, terms)
    if mirrored.rms_mm < _MIRROR_FAR_BETTER * direct.rms_mm or (found is not None and found.worst_mm <= 0):
        raise NotMeasured(
            f"the points fit the nominal only mirrored (rms {mirrored.rms_mm:.4g} mm instead of {direct.rms_mm:.4g} mm): "
            "are the x and y columns swapped, or does the section's normal point the other way?"
        )
