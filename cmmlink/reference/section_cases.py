"""Cases about numbers of a section: a drop of two arcs and two lines, and parts that are parallel to it.

A curve at an even distance from the drop is a drop again: its edge radii are larger by the distance, its chord and its thickness by twice
that. Both edges are arcs as far as 85 degrees to either side, so that no window and no method changes their radius.
"""

from collections.abc import Iterator
from decimal import Decimal
from typing import Any

from cmmlink.reference.case import KnownValue, ReferenceCase
from cmmlink.reference.deviation_cases import Build, feet_of
from cmmlink.reference.exact_numbers import Number, as_float
from cmmlink.reference.laying import Asked, Pose, at_datum, case_of, lay
from cmmlink.reference.shapes import drop

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


def _parallel(name: str, distance: Number, pose: Pose, tip: Number = 0) -> ReferenceCase:
    """A part at an even distance from the drop."""
    curve, d = drop(), Decimal(distance)
    feet = feet_of(curve, 400)
    laid = lay(feet, [d] * len(feet), pose, Decimal(tip))
    at = _OFFSET_MM - _LARGE - d  # from the centre of the large arc, towards the small one
    values = {
        "leading edge radius": _LARGE + d,
        "trailing edge radius": _SMALL + d,
        "leading edge radius by curvature": _LARGE + d,
        "chord": _LENGTH + _LARGE + _SMALL + 2 * d,
        "largest thickness": 2 * (_LARGE + d),
        "leading edge thickness": 2 * (_LARGE + d - at * _SINE) / _COSINE,
    }
    known = tuple(KnownValue(words, "mm", as_float(value)) for words, value in values.items())
    about = f"A part {distance} mm beside a section of arcs and lines: its edge radii, its chord and its thickness follow."
    asked = Asked(name, "section", about, _LIMITS, "conform", at_datum(pose) | {"characteristics": _asked()}, tip_radius=Decimal(tip))
    return case_of(asked, curve, laid, values=known, worst=None)


def _asked() -> list[dict[str, Any]]:
    limits = {"lower_mm": -0.5, "upper_mm": 0.5}
    return [
        {"name": "profile", "type": "line-profile", "fit": "none", "zone": {"lower_mm": _LIMITS[0], "upper_mm": _LIMITS[1]}},
        {"name": "leading edge radius", "type": "edge-radius", "edge": "leading", "method": "circle", "window_deg": 60, **limits},
        {"name": "trailing edge radius", "type": "edge-radius", "edge": "trailing", "method": "circle", "window_deg": 60, **limits},
        {"name": "leading edge radius by curvature", "type": "edge-radius", "edge": "leading", "method": "curvature", **limits},
        {"name": "chord", "type": "chord", "method": "maximum-distance", **limits},
        {"name": "largest thickness", "type": "thickness", "method": "inscribed", **limits},
        {"name": "leading edge thickness", "type": "edge-thickness", "edge": "leading", "offset_mm": _OFFSET_MM, **limits},
    ]
