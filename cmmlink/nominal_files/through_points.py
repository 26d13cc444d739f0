"""The curve through the points of a nominal file: closed or open, and what happens at the seam.

The points are interpolated (cubic, centripetal parameter), not smoothed: they are the nominal, to the last digit.
"""

import numpy as np
from numpy.typing import NDArray

from cmmlink.nominal_files import NominalFile
from inspection import NominalError, NurbsCurve

Array = NDArray[np.float64]
Lines = NDArray[np.int64]

_DEGREE = 3
_SAME_POINT = 1e-9  # of the size: two points as near as this are one
_SAME_END = 1e-6  # of the size: a last point as near the first as this was written to repeat it
_SMALLEST_MM = 1e-6
_RESOLVED = 1e-6  # of the distance from the origin: a smaller profile drowns in round-off
_SHARP_DEG = 60.0
_ABOVE_NEIGHBOURS = 3.0


def through_points(points_mm: Array, lines: Lines, closed: bool | None, source_format: str, notes: tuple[str, ...]) -> NominalFile:
    """Interpolate points (m, 2), given on the lines (m,) of the file. Raises NominalError, naming lines.

    closed None: closed if the last point repeats the first. A gap joined because `closed` says so is bridged smoothly
    where the points run on (a circle), with a straight line where they do not (a blunt trailing edge).
    """
    _require_distinct(points_mm, lines)
    gap = float(np.hypot(*(points_mm[-1] - points_mm[0])))
    repeats = len(points_mm) > 2 and gap <= _SAME_END * _size(points_mm)
    distinct = points_mm[:-1] if repeats else points_mm
    if len(distinct) < _DEGREE + 1:
        raise NominalError(f"{len(distinct)} different points; expected at least {_DEGREE + 1} for a cubic curve")
    ends = "the last point repeats the first" if repeats else f"a gap of {gap:.6g} mm from last to first point"
    asked = "" if closed is repeats or closed is None else ", as asked"
    if repeats if closed is None else closed:
        curve, seam = _close(distinct, repeats)
        note = f"closed{asked}: {ends}, {seam}"
    else:
        curve, note = NurbsCurve.interpolate(points_mm, _DEGREE), f"open{asked}: {ends}"
    return NominalFile(curve, source_format, (*notes, note, *_notes_on_corners(distinct, lines)))


def _close(points: Array, repeats: bool) -> tuple[NurbsCurve, str]:
    """Close the curve through distinct points (m, 2). Returns the curve and a note on how the seam was joined."""
    turn, sharp = _sharp_turns(points)
    if repeats and sharp[0]:
        curve = NurbsCurve.interpolate(points, _DEGREE, closed=True, corner_at_seam=True)
        return curve, f"a corner of {turn[0]:.0f} deg kept there (sharp trailing edge)"
    if not repeats and (sharp[0] or sharp[-1]):
        return _with_straight_join(points), "joined by a straight line with a corner at each end (blunt trailing edge)"
    return NurbsCurve.interpolate(points, _DEGREE, closed=True), "smooth there" if repeats else "joined smoothly"


def _with_straight_join(points: Array) -> NurbsCurve:
    """Join the ends of the interpolating curve with a line: a cubic piece behind a knot of multiplicity three."""
    body = NurbsCurve.interpolate(points, _DEGREE)
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


def _notes_on_corners(points: Array, lines: Lines) -> list[str]:
    """Note the sharp turns between the ends, which the interpolating cubic cannot keep."""
    turn, sharp = _sharp_turns(points)
    return [
        f"line {lines[i]}: the points turn by {turn[i]:.0f} deg; the curve is smooth there, a corner would need a nurbs yaml"
        for i in np.flatnonzero(sharp[1:-1]) + 1
    ]


def _require_distinct(points: Array, lines: Lines) -> None:
    """Refuse fewer than two points, points that all coincide, and neighbours that coincide."""
    if len(points) < 2:
        raise NominalError(f"{len(points)} point; expected at least {_DEGREE + 1} for a cubic curve")
    size = _size(points)
    step = np.hypot(*np.diff(points, axis=0).T)
    if np.any(step <= _SAME_POINT * size):
        i = int(np.argmax(step <= _SAME_POINT * size))
        place = f"({points[i, 0]:g}, {points[i, 1]:g})"
        raise NominalError(f"line {lines[i + 1]}: repeats the point {place} of line {lines[i]}; expected different points: remove one")
    if size < max(_SMALLEST_MM, _RESOLVED * float(np.abs(points).max())):
        raise NominalError(f"all points lie within {size:g} mm; expected a profile in mm: give the scale, or move it nearer to the origin")


def _size(points: Array) -> float:
    return float(np.ptp(points, axis=0).max())
