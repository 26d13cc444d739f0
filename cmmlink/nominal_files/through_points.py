"""The curve through the points of a nominal file: closed or open, and what happens at the seam.

The points are interpolated (cubic, centripetal parameter), not smoothed: they are the nominal, to the last digit.
"""

import numpy as np
from numpy.typing import NDArray

from cmmlink.nominal_files import NominalFile
from inspection import NominalError, NurbsCurve, find_crossings

Array = NDArray[np.float64]
Lines = NDArray[np.int64]

_DEGREE = 3
_SAME_POINT = 1e-9  # of the size: two points as near as this are one
_SAME_END = 1e-6  # of the size: a last point as near the first as this was written to repeat it
_SMALLEST_MM = 1e-6
_RESOLVED = 1e-6  # of the distance from the origin: a smaller profile drowns in round-off
_SHARP_DEG = 60.0
_ABOVE_NEIGHBOURS = 3.0
_BLUNT_EDGE = 0.02  # of the size: a gap up to this, with its ends side by side, is the edge of a closed profile
_FACING_DEG = 90.0  # both turns together: the sides run towards the edge within 90 deg of one direction
_OPEN = 0.25  # of the size: a profile with a larger gap is open
_STEPS_ALONG_LINES = (0, 1, 2, 4, 8)  # tried in turn: so many steps before an edge are laid along the lines between their points
_INTO_THE_EDGE = "runs into the edge along the lines from the neighbouring points"
_PARTS = 4  # of each of those steps
_LIKE_A_STEP = 1.5  # a gap no larger than the steps beside it may be a step itself: a loop that does not repeat its first point


def through_points(
    points_mm: Array, lines: Lines, closed: bool | None, source_format: str, notes: tuple[str, ...], place: str = "line"
) -> NominalFile:
    """Interpolate points (m, 2), given on the lines (m,) of the file, or in the rows of an array. Raises NominalError, naming these.

    place : what messages call them, line or row

    closed None: closed if the last point repeats the first, or if a small gap lies between them as a blunt edge does; a gap that
    may be either is asked about. A gap joined because `closed` says so is bridged smoothly where the points run on (a circle),
    with a straight line where they do not (a blunt trailing edge).
    """
    _require_distinct(points_mm, lines, place)
    gap = float(np.hypot(*(points_mm[-1] - points_mm[0])))
    repeats = len(points_mm) > 2 and gap <= _SAME_END * _size(points_mm)
    distinct = points_mm[:-1] if repeats else points_mm
    if len(distinct) < _DEGREE + 1:
        raise NominalError(f"{len(distinct)} different points; expected at least {_DEGREE + 1} for a cubic curve")
    join = (repeats or _is_blunt_edge(points_mm, gap)) if closed is None else closed
    ends = "the last point repeats the first" if repeats else f"a gap of {gap:.6g} mm from last to first point"
    asked = "" if closed is repeats or closed is None else ", as asked"
    if join:
        curve, seam, mended = _close(distinct, repeats)
        kept_open = "" if repeats or asked else "; to keep it open, say so: --open, or closed: false"
        note = f"closed{asked}: {ends}, {seam}{kept_open}"
    else:
        curve, mended = _without_crossing(points_mm, corner_at_seam=False)
        note = f"open{asked}: {ends}"
    return NominalFile(curve, source_format, (*notes, note, *mended, *_notes_on_corners(distinct, lines, repeats, place)))


def _is_blunt_edge(points: Array, gap: float) -> bool:
    """Whether the gap from last to first point is a blunt edge. Raises NominalError where it may be one, or an open profile.

    It is one when it is small and both sides run towards it side by side, so that a straight line closes it with a corner at
    one end at least. The profile is open when its ends lie far apart, seen from its size and from the steps beside the gap.
    """
    share = gap / _size(points)
    turn, sharp = _sharp_turns(points)
    if share <= _BLUNT_EDGE and (sharp[0] or sharp[-1]) and _FACING_DEG <= turn[0] + turn[-1] <= 360 - _FACING_DEG:
        return True
    step = max(float(np.hypot(*(points[i + 1] - points[i]))) for i in (0, -2))
    if share > _OPEN and gap > _LIKE_A_STEP * step:
        return False
    raise NominalError(
        f"a gap of {gap:.6g} mm from last to first point, {100 * share:.2g} % of the size: the profile may be closed or open; "
        "expected to be told which: closed: true or closed: false in the plan, or --closed or --open"
    )


def _close(points: Array, repeats: bool) -> tuple[NurbsCurve, str, list[str]]:
    """Close the curve through different points (m, 2), say what was made of its seam, and what was mended."""
    turn, sharp = _sharp_turns(points)
    if repeats and sharp[0]:
        curve, mended = _without_crossing(points, corner_at_seam=True)
        return curve, f"a corner of {turn[0]:.0f} deg kept there (sharp trailing edge)", mended
    if not repeats and (sharp[0] or sharp[-1]):
        body, mended = _without_crossing(points, corner_at_seam=False)
        return _with_straight_join(points, body), "joined by a straight line with a corner at each end (blunt trailing edge)", mended
    return NurbsCurve.interpolate(points, _DEGREE, closed=True), "smooth there" if repeats else "joined smoothly", []


def _without_crossing(points: Array, corner_at_seam: bool) -> tuple[NurbsCurve, list[str]]:
    """Interpolate points between two ends, or from corner to corner, so that the curve does not cross itself; and what was mended.

    A smooth curve can turn itself inside out in the last micrometres before a sharp edge, where nothing but its own smoothness
    holds its tangents. Laid along the lines to the neighbouring points they meet at the angle that the points show. Where the sides
    run so close together that its bends between the points still cross, the curve keeps to the lines between the points there.
    """
    smoothest = NurbsCurve.interpolate(points, _DEGREE, closed=corner_at_seam, corner_at_seam=corner_at_seam)
    crossings = find_crossings(smoothest)
    if not crossings:
        return smoothest, []
    for steps in _STEPS_ALONG_LINES:
        through = _divide_steps(points, steps, corner_at_seam)
        mended = NurbsCurve.interpolate(through, _DEGREE, closed=corner_at_seam, corner_at_seam=corner_at_seam, ends_along_chords=True)
        if not find_crossings(mended):
            break
    else:
        return smoothest, []
    before = [min(crossing.first_mm, smoothest.length_mm - crossing.second_mm) for crossing in crossings]
    place = f"{max(before):.3g} mm before the edge, at ({crossings[-1].x_mm:.6g}, {crossings[-1].y_mm:.6g})"
    way = f"keeps to the lines between the last {steps + 1} points of both sides" if steps else _INTO_THE_EDGE
    return mended, [f"mended: the smoothest curve through the points would cross itself {place}; it {way} instead, through every point"]


def _divide_steps(points: Array, steps: int, closed: bool) -> Array:
    """The points with so many steps at either end divided evenly, by points on the lines between them; closed steps back to the first."""
    ring = np.vstack([points, points[:1]]) if closed else points
    count = len(ring) - 1
    divided = np.minimum(np.arange(count), np.arange(count)[::-1]) < steps
    share = np.arange(_PARTS) / _PARTS
    rows = [ring[i] + np.outer(share if divided[i] else share[:1], ring[i + 1] - ring[i]) for i in range(count)]
    return np.vstack(rows if closed else [*rows, ring[-1:]])


def _with_straight_join(points: Array, body: NurbsCurve) -> NurbsCurve:
    """Join the ends of the curve through the points with a line: a cubic piece behind a knot of multiplicity three."""
    steps = np.sqrt(np.linalg.norm(np.diff(np.vstack([points, points[:1]]), axis=0), axis=1))  # (m,) centripetal, the gap last
    end = steps.sum() / steps[:-1].sum()  # the body's parameter runs from 0 to 1
    first, last = body.control_points_mm[0], body.control_points_mm[-1]
    line = [last + (first - last) / 3, last + (first - last) * 2 / 3, first]
    knots = np.concatenate([body.knots[:-1], np.full(_DEGREE + 1, end)])
    return NurbsCurve(_DEGREE, np.vstack([body.control_points_mm, line]), knots / end, closed=True)


def _sharp_turns(points: Array) -> tuple[Array, NDArray[np.bool_]]:
    """Turn (m,) in degrees at each vertex of the closed polygon, and where it is a corner rather than a coarse bend.

    A corner turns by more than 60 deg and by far more than the vertices beside it; beside the two ends of a gap only the
    vertex away from the gap counts, for a blunt edge has two corners in a row.
    """
    ahead = np.roll(points, -1, axis=0) - points
    behind = np.roll(ahead, 1, axis=0)
    turn = np.degrees(np.abs(np.arctan2(behind[:, 0] * ahead[:, 1] - behind[:, 1] * ahead[:, 0], (behind * ahead).sum(axis=1))))
    beside = np.maximum(np.roll(turn, 1), np.roll(turn, -1))
    beside[0], beside[-1] = turn[1], turn[-2]
    return turn, (turn > _SHARP_DEG) & (turn > _ABOVE_NEIGHBOURS * beside)


def _notes_on_corners(points: Array, lines: Lines, repeats: bool, place: str) -> list[str]:
    """Note the sharp turns between the ends, which the interpolating cubic cannot keep; all but the seam, if the ends meet there."""
    turn, sharp = _sharp_turns(points)
    inner = np.arange(1, len(points) if repeats else len(points) - 1)
    sharp = sharp | _sharp_pairs(np.where(np.isin(np.arange(len(points)), inner), turn, 0.0))
    return [
        f"{place} {lines[i]}: the points turn by {turn[i]:.0f} deg; the curve is smooth there, a corner would need a nurbs yaml"
        for i in inner[sharp[inner]]
    ]


def _sharp_pairs(turn: Array) -> NDArray[np.bool_]:
    """Where two corners follow one another, as those of a blunt edge do: they turn by far more than the vertices beside the two."""
    following = np.roll(turn, -1)
    beside = np.maximum(np.roll(turn, 1), np.roll(turn, -2))
    first = (np.minimum(turn, following) > _SHARP_DEG) & (np.minimum(turn, following) > _ABOVE_NEIGHBOURS * beside)
    return np.asarray(first | np.roll(first, 1))


def _require_distinct(points: Array, lines: Lines, place: str) -> None:
    """Refuse fewer than two points, points that all coincide, and neighbours that coincide."""
    if len(points) < 2:
        raise NominalError(f"{len(points)} point; expected at least {_DEGREE + 1} for a cubic curve")
    size = _size(points)
    step = np.hypot(*np.diff(points, axis=0).T)
    if np.any(step <= _SAME_POINT * size):
        i = int(np.argmax(step <= _SAME_POINT * size))
        point = f"({points[i, 0]:g}, {points[i, 1]:g})"
        told = f"{place} {lines[i + 1]}: repeats the point {point} of {place} {lines[i]}"
        raise NominalError(f"{told}; expected different points: remove one")
    if size < max(_SMALLEST_MM, _RESOLVED * float(np.abs(points).max())):
        raise NominalError(f"all points lie within {size:g} mm; expected a profile in mm: give the scale, or move it nearer to the origin")


def _size(points: Array) -> float:
    return float(np.ptp(points, axis=0).max())
