"""Cases about numbers of a section: a drop of two arcs and two lines, a bow of even thickness, and parts that are parallel to them.

A curve at an even distance from the drop is a drop again: its edge radii are larger by the distance, its chord and its thickness by twice
that. Both edges are arcs as far as 85 degrees to either side, so that no window and no method changes their radius. It is the same with a
bow, whose middle line is an arc, drawn on straight through both edges.
"""

from collections.abc import Iterator
from decimal import Decimal
from typing import Any

from cmmlink.reference.case import KnownValue, ReferenceCase
from cmmlink.reference.deviation_cases import Build, feet_of
from cmmlink.reference.exact_curve import ExactCurve
from cmmlink.reference.exact_numbers import Number, as_float
from cmmlink.reference.laying import Asked, Pose, at_datum, case_of, lay
from cmmlink.reference.shapes import bow, drop

_LARGE, _SMALL, _LENGTH = Decimal(6), Decimal("1.26"), Decimal("62.5")
_SINE, _COSINE = Decimal("0.07584"), Decimal("0.99712")  # of the lean of the straight parts
_OFFSET_MM = 15  # from the leading edge, where the thickness of the straight parts is asked for
_LIMITS = (-0.3, 0.3)


def builders() -> Iterator[Build]:
    """What builds each case."""
    yield lambda: _parallel("section-as-drawn", "0", Pose.of("24", "10", "-5"))
    yield lambda: _parallel("section-too-large", "0.05", Pose.of("-135", "30", "44"))
    yield lambda: _parallel("section-too-small", "-0.08", Pose.of("3", "0.5", "0.25"))
    yield lambda: _parallel("section-ball-centres", "0.02", Pose.of("60", "-20", "12"), tip="1.5")
    yield lambda: _bent("section-bent-as-drawn", "0", Pose.of("-51", "4", "9"))
    yield lambda: _bent("section-bent-too-large", "0.04", Pose.of("118", "70", "-8"))


def _parallel(name: str, distance: Number, pose: Pose, tip: Number = 0) -> ReferenceCase:
    """A part at an even distance from the drop."""
    d = Decimal(distance)
    at = _OFFSET_MM - _LARGE - d  # from the centre of the large arc, towards the small one
    values = {
        "leading edge radius": _LARGE + d,
        "trailing edge radius": _SMALL + d,
        "leading edge radius by curvature": _LARGE + d,
        "chord": _LENGTH + _LARGE + _SMALL + 2 * d,
        "largest thickness": 2 * (_LARGE + d),
        "leading edge thickness": 2 * (_LARGE + d - at * _SINE) / _COSINE,
    }
    about = f"A part {distance} mm beside a section of arcs and lines: its edge radii, its chord and its thickness follow."
    return _beside(name, about, drop(), d, values, pose, Decimal(tip))


def _bent(name: str, distance: Number, pose: Pose) -> ReferenceCase:
    """A part at an even distance from the bow, whose middle line rises by 10 from the centre of one edge to that of the other."""
    d = Decimal(distance)
    radius = Decimal("1.5") + d
    tip = Decimal("0.6") * radius  # how far the tips lie below the centres of their edges, and 0.8 of the radius beyond them
    values = {
        "leading edge radius": radius,
        "trailing edge radius": radius,
        "leading edge radius by curvature": radius,
        "chord": 60 + 2 * radius,
        "chord by nose and tail": 60 + Decimal("1.6") * radius,
        "largest thickness": 2 * radius,
        "largest camber": 10 + tip,
    }
    about = f"A part {distance} mm beside a bent section of even thickness: its edge radii, chords, thickness and camber follow."
    return _beside(name, about, bow(), d, values, pose, Decimal(0))


def _beside(
    name: str, about: str, curve: ExactCurve, distance: Decimal, values: dict[str, Decimal], pose: Pose, tip: Decimal
) -> ReferenceCase:
    """A part at an even distance from a section, of which the plan asks for some numbers."""
    feet = feet_of(curve, 400)
    laid = lay(feet, [distance] * len(feet), pose, tip)
    profile = {"name": "profile", "type": "line-profile", "fit": "none", "zone": {"lower_mm": _LIMITS[0], "upper_mm": _LIMITS[1]}}
    asked = [profile, *({"name": words, **_NUMBERS[words], "lower_mm": -0.5, "upper_mm": 0.5} for words in values)]
    known = tuple(KnownValue(words, "mm", as_float(value)) for words, value in values.items())
    settings = at_datum(pose) | {"characteristics": asked}
    return case_of(Asked(name, "section", about, _LIMITS, "conform", settings, tip_radius=tip), curve, laid, values=known, worst=None)


_NUMBERS: dict[str, dict[str, Any]] = {
    "leading edge radius": {"type": "edge-radius", "edge": "leading", "method": "circle", "window_deg": 60},
    "trailing edge radius": {"type": "edge-radius", "edge": "trailing", "method": "circle", "window_deg": 60},
    "leading edge radius by curvature": {"type": "edge-radius", "edge": "leading", "method": "curvature"},
    "chord": {"type": "chord", "method": "maximum-distance"},
    "chord by nose and tail": {"type": "chord", "method": "nose-tail"},
    "largest thickness": {"type": "thickness", "method": "inscribed"},
    "leading edge thickness": {"type": "edge-thickness", "edge": "leading", "offset_mm": _OFFSET_MM},
    "largest camber": {"type": "camber"},
}
