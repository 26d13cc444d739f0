"""Where a drawn section ends at its trailing edge: where its points say, and not where the nominal does.

Sides that are drawn from deviations over the nominal's stations end where the nominal does, and a part that is shorter or longer there
would have the nominal's chord. So a flat is laid through the points that lie on it, and sides are continued to the farthest point
beyond their ends. Where the last point lies farther before the end than points lie from each other, nobody has seen the end: a part
that is broken off there looks like one that was not measured to its end.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from inspection.characteristics.outline import AirfoilSection, section_on
from inspection.curve import NurbsCurve

Array = NDArray[np.float64]

_WINDOW = 0.05  # of the section's length: what is farther from the trailing edge tells nothing of where it is
_WITHIN_SPACINGS = 1.5  # of the points: an end that is farther from the last point was not seen
_ROUNDING_MM = 1e-9
ON_NONE, ON_FIRST, ON_LAST, ON_FLAT = range(4)  # what a point lies on
_FEWEST_ON_FLAT = 3
_DEGREE = 3


class TailEnd(NamedTuple):
    """A section with its trailing edge where it was measured.

    is_unseen : (n,) which samples of its outline lie farther out than what was measured
    words     : how the end was found; empty where it is where the nominal's sides end
    """

    section: AirfoilSection
    is_unseen: NDArray[np.bool_]
    words: str


class _Line(NamedTuple):
    """A line that both sides end at: its height out of the section, and how that changes on the way across."""

    height: float
    slope: float

    def above(self, sides: "_Sides", places: Array) -> Array:
        """How far places (m, 2) lie beyond it."""
        return np.asarray(places @ sides.out - self.height - self.slope * (places @ sides.across))


class _Sides(NamedTuple):
    """Both sides near the trailing edge, straight beyond their ends; `e` is how far along a side from its end, inwards."""

    section: AirfoilSection
    out: Array  # (2,) unit direction out of the section between both sides
    across: Array  # (2,) square to it
    ends: Array  # (2, 2)
    inward: Array  # (2, 2) unit tangents at the ends, into the section

    def place(self, side: int, e: float) -> Array:
        """The place (2,) on a side."""
        if e <= 0:
            return np.asarray(self.ends[side] + e * self.inward[side])
        at = self.section.first + e if side == 0 else self.section.last - e
        return np.asarray(self.section.curve.point(np.array([at]))[0])

    def reach(self, side: int, line: _Line, window_mm: float) -> float | None:
        """How far along a side it meets a line; None: nowhere near."""
        from scipy.optimize import brentq  # noqa: PLC0415

        def above(e: float) -> float:
            return float(line.above(self, self.place(side, e)[None])[0])

        if above(-window_mm) * above(window_mm) > 0:
            return None
        return float(brentq(above, -window_mm, window_mm, xtol=1e-12))


def end_at_points(section: AirfoilSection, places_mm: Array, on: NDArray[np.int8]) -> TailEnd:
    """The section with its sides shortened or lengthened to where measured places (m, 2) end.

    section   : drawn up to the ends of the nominal; its parameter is a length along it
    places_mm : all that were measured, those beyond the ends and at corners among them
    on        : (m,) what they lie on: ON_FIRST or ON_LAST for either side, ON_FLAT for the flat of a blunt edge, ON_NONE for what lies
                beyond the ends or at a corner
    """
    sides, window = _sides(section), _WINDOW * section.length_mm
    ends = _through(sides, section.ends_mm())
    near = ends.above(sides, places_mm) > -window
    flat = places_mm[near & (on == ON_FLAT)]
    if len(flat) >= _FEWEST_ON_FLAT and np.ptp(flat @ sides.across) > np.ptp(section.ends_mm() @ sides.across) / 2:
        return _cut(sides, _through(sides, flat), window, f"its flat trailing edge lies through {len(flat)} points")
    beyond = ends.above(sides, places_mm)
    last = float(beyond[near].max(initial=-window))
    if last > 0:
        words = f"its sides are continued by {last:.3g} mm to the farthest point at the trailing edge" if last > _ROUNDING_MM else ""
        return _cut(sides, ends._replace(height=ends.height + last), window, words)
    spacing = max(_spacing(np.sort(beyond[near & (on == side)])) for side in (ON_FIRST, ON_LAST))
    if last >= -_WITHIN_SPACINGS * spacing:
        return TailEnd(section, np.zeros(len(section.parameter), dtype=bool), "")
    words = f"the last point lies {-last:.3g} mm before its trailing edge"
    return TailEnd(section, ends.above(sides, section.points_mm) > last, words)


def _through(sides: "_Sides", places: Array) -> _Line:
    """The line of least squares through places (k, 2)."""
    across, out = places @ sides.across, places @ sides.out
    if np.ptp(across) <= _ROUNDING_MM:
        return _Line(float(out.max()), 0.0)
    slope, height = np.polyfit(across, out, 1)
    return _Line(float(height), float(slope))


def _cut(sides: "_Sides", line: _Line, window_mm: float, words: str) -> TailEnd:
    """The section with both sides ended at a line; as it is where one of them does not come near it."""
    one, other = (sides.reach(side, line, window_mm) for side in (0, 1))
    if one is None or other is None:
        beyond = np.ones(len(sides.section.parameter), dtype=bool)
        return TailEnd(sides.section, beyond & (line.above(sides, sides.section.points_mm) > -window_mm), f"not found: {words}")
    ended = _ended(sides.section, sides, (0.0 if abs(one) < _ROUNDING_MM else one, 0.0 if abs(other) < _ROUNDING_MM else other))
    return TailEnd(ended, np.zeros(len(ended.parameter), dtype=bool), words)


def _sides(section: AirfoilSection) -> _Sides:
    """The sides of a section at its trailing edge."""
    _, first, _, _ = section.frame(np.array([section.first, section.last]))
    inward = first / np.hypot(*first.T)[:, None] * np.array([[1.0], [-1.0]])
    out = -inward.sum(axis=0)
    out = out / np.hypot(*out)
    return _Sides(section, out, np.array([-out[1], out[0]]), section.ends_mm(), inward)


def _spacing(rising: Array) -> float:
    """The spacing of the points of a side, whose heights rise: half of the way is in steps no longer than it."""
    steps = np.sort(np.diff(rising))
    if not len(steps) or steps[-1] <= 0:
        return 0.0
    passed = np.cumsum(steps)
    return float(steps[int(np.searchsorted(passed, passed[-1] / 2))])


def _ended(section: AirfoilSection, sides: _Sides, cut: tuple[float, float]) -> AirfoilSection:
    """The section with its sides cut off, or continued straight, by lengths from their ends."""
    curve = section.curve
    control, knots = curve.control_points_mm, curve.knots
    thirds = np.array([1.0, 2 / 3, 1 / 3])[:, None]  # the control points of a straight piece, which goes on as the side ends
    if cut[0] < 0:
        control = np.vstack([sides.ends[0] + cut[0] * thirds * sides.inward[0], control])
        knots = np.concatenate([np.full(_DEGREE + 1, section.first + cut[0]), knots[1:]])
    if cut[1] < 0:
        control = np.vstack([control, sides.ends[1] + cut[1] * thirds[::-1] * sides.inward[1]])
        knots = np.concatenate([knots[:-1], np.full(_DEGREE + 1, section.last - cut[1])])
    extended = NurbsCurve(_DEGREE, control, knots)
    return section_on(extended, section.first + cut[0], section.last - cut[1], section.trailing, section.outward, section.nose)
