"""Cases about best fits and minimum zones: points in place whose deviations no placement makes smaller, moved away from there."""

from collections.abc import Iterator
from decimal import Decimal

from cmmlink.reference.balance import held_by_four, without_motion
from cmmlink.reference.case import ReferenceCase
from cmmlink.reference.deviation_cases import Build, form
from cmmlink.reference.exact_curve import ExactCurve
from cmmlink.reference.exact_numbers import Number, scattered
from cmmlink.reference.laying import Asked, Pose, case_of, lay
from cmmlink.reference.shapes import cam, open_wave, stadium

_BEST_FIT = {"registration": {"fit": "best-fit"}, "weights": "points", "rule": "best-fit"}
_MINIMUM_ZONE = {"registration": {"fit": "minimum-zone"}}


def builders() -> Iterator[Build]:
    """What builds each case."""
    yield lambda: _best_fit("best-fit-closed", cam(), Pose.of("117.25", "18", "-33.5"))
    yield lambda: _best_fit("best-fit-open", open_wave(), Pose.of("-25.5", "40", "12"))
    yield lambda: _minimum_zone("minimum-zone-closed", cam(), Pose.of("64", "-7.5", "21"), "0.08")
    yield lambda: _minimum_zone("minimum-zone-open", open_wave(), Pose.of("-160", "75", "3.5"), "0.08")
    yield lambda: _minimum_zone("minimum-zone-straight-parts", stadium(30, 12), Pose.of("5", "1", "2"), "0.08")


def _best_fit(name: str, curve: ExactCurve, pose: Pose) -> ReferenceCase:
    feet = [curve.foot(u) for u in curve.spread(160)]
    laid = lay(feet, without_motion(feet, form(160, "0.03")), pose)
    about = "The pose is that of least squares, all points counting alike: the deviations are orthogonal to every small motion."
    return case_of(Asked(name, "best-fit", about, (-0.06, 0.06), "conform", _BEST_FIT), curve, laid)


def _minimum_zone(name: str, curve: ExactCurve, pose: Pose, zone: Number, limit_mm: float = 0.05) -> ReferenceCase:
    feet = [curve.foot(u) for u in curve.spread(160)]
    held = held_by_four(feet, Decimal(30), [Decimal(1)] * 160)
    half = Decimal(zone) / 2
    deviation = [Decimal("0.6") * half * s for s in scattered(160, 5)]
    for row, sign in zip(held.rows, held.signs, strict=True):
        deviation[row] = sign * half
    laid = lay(feet, deviation, pose)
    about = f"The minimum zone is {zone} mm wide: four points hold it, and their gradients cancel with positive multipliers."
    asked = Asked(
        name, "minimum-zone", about, (-limit_mm, limit_mm), "conform" if half <= Decimal(str(limit_mm)) else "nonconform", _MINIMUM_ZONE
    )
    return case_of(asked, curve, laid, zone=held.known(lambda row: abs(laid.deviation[row]), 2))
