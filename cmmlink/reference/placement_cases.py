"""Cases about how a section sits: a part turned about a known point and shifted by a known way from its datum."""

from collections.abc import Iterator
from decimal import Decimal

from cmmlink.reference.balance import without_motion
from cmmlink.reference.case import KnownValue, ReferenceCase
from cmmlink.reference.deviation_cases import COUNT, Build, feet_of, form
from cmmlink.reference.exact_curve import ExactCurve
from cmmlink.reference.exact_numbers import PI, Number, Pair, as_float, cosine_and_sine, rounded
from cmmlink.reference.laying import Asked, Pose, case_of, lay
from cmmlink.reference.shapes import cam, drop


def builders() -> Iterator[Build]:
    """What builds each case."""
    yield lambda: _moved("twist", cam(), "0.5", ("10", "5"), ("0", "0"))
    yield lambda: _moved("twist-with-form", cam(), "-0.75", ("-20", "12"), ("0.1", "-0.05"), size="0.03")
    yield lambda: _moved("displacement", cam(), "0", ("0", "0"), ("0.3", "-0.4"))
    yield lambda: _moved("twist-of-a-section", drop(), "-0.4", ("30", "0"), ("0.05", "0.12"))
    yield lambda: _moved("twist-with-form-of-a-section", drop(), "0.25", ("0", "0"), ("-0.1", "0.1"), size="0.02")


def _moved(
    name: str, curve: ExactCurve, degrees: Number, pivot: tuple[Number, Number], shift: tuple[Number, Number], size: Number = "0"
) -> ReferenceCase:
    """A part turned about a pivot and then shifted, whose deviations no small motion makes smaller."""
    turned, place = Decimal(degrees), (Decimal(pivot[0]), Decimal(pivot[1]))
    pose = _undoing(turned, place, (Decimal(shift[0]), Decimal(shift[1])))
    feet = feet_of(curve, 2 * COUNT)
    laid = lay(feet, without_motion(feet, form(len(feet), size)), pose)
    ((x, y),) = pose.undo([place])
    dx, dy = x - place[0], y - place[1]  # of the pose as it is written, whose digits are fifteen
    values = {
        "twist": ("deg", turned),
        "displacement along x": ("mm", dx),
        "displacement along y": ("mm", dy),
        "displacement": ("mm", (dx * dx + dy * dy).sqrt()),
    }
    at = {"type": "displacement", "place_mm": [float(each) for each in place], "lower_mm": -2, "upper_mm": 2}
    asked = [
        {"name": "profile", "type": "line-profile", "fit": "none", "zone": {"lower_mm": -2, "upper_mm": 2}},
        {"name": "twist", "type": "twist", "method": "best-fit", "lower_deg": -2, "upper_deg": 2},
        {"name": "displacement along x", "axis": "x", **at},
        {"name": "displacement along y", "axis": "y", **at},
        {"name": "displacement", "axis": "total", **at},
    ]
    about = (
        f"A part turned by {degrees} degrees about ({pivot[0]}, {pivot[1]}), then shifted by ({shift[0]}, {shift[1]}) mm from its datum."
    )
    settings = {"registration": {"datum": Pose.of(0).datum}, "weights": "points", "characteristics": asked}
    known = tuple(KnownValue(words, "deg" if unit == "deg" else "mm", as_float(value)) for words, (unit, value) in values.items())
    return case_of(Asked(name, "placement", about, (-2.0, 2.0), "conform", settings), curve, laid, values=known)


def _undoing(degrees: Decimal, pivot: Pair, shift: Pair) -> Pose:
    """The pose that turns a part back about where its pivot has come to, and shifts it back."""
    c, s = cosine_and_sine(-degrees * PI / 180)
    x, y = pivot[0] + shift[0], pivot[1] + shift[1]
    return Pose(-degrees, rounded(pivot[0] - (c * x - s * y)), rounded(pivot[1] - (s * x + c * y)))
