"""Cases about best fits and minimum zones: points in place whose deviations no placement makes smaller, moved away from there."""

from collections.abc import Iterator
from decimal import Decimal
from typing import Any

import numpy as np

from cmmlink.reference.balance import held_by_four, without_motion
from cmmlink.reference.case import CaseUnit, KnownHold, KnownVerdict, ReferenceCase
from cmmlink.reference.deviation_cases import COUNT, Build, feet_of, form
from cmmlink.reference.exact_curve import ExactCurve, Foot
from cmmlink.reference.exact_numbers import PI, Number, as_array, as_float, cosine_and_sine, scattered
from cmmlink.reference.laying import Asked, Pose, case_of, lay
from cmmlink.reference.shapes import cam, ellipse, lens, open_wave, rational_wave, stadium

_ALL_ALIKE = {"registration": {"fit": "best-fit"}, "weights": "points", "rule": "best-fit"}
_BY_LENGTH = {"registration": {"fit": "best-fit"}, "rule": "best-fit"}
_MINIMUM_ZONE = {"registration": {"fit": "minimum-zone"}}


def builders() -> Iterator[Build]:
    """What builds each case."""
    yield lambda: _best_fit("best-fit-closed", cam(), Pose.of("117.25", "18", "-33.5"))
    yield lambda: _best_fit("best-fit-open", open_wave(), Pose.of("-25.5", "40", "12"))
    yield lambda: _best_fit("best-fit-rational", rational_wave(), Pose.of("91.5", "-4", "220"))
    yield lambda: _best_fit("best-fit-ball-centres", cam(), Pose.of("-75", "6", "1.5"), tip=3)
    yield lambda: _best_fit("best-fit-sharp-edges", lens(), Pose.of("25", "3", "-7"), turns=True)
    yield lambda: _best_fit("best-fit-symmetric", ellipse(40, 15), Pose.of("10", "-6", "5"), turns=True)
    yield lambda: _best_fit("best-fit-inch", cam().scaled("0.05"), Pose.of("-140", "1.5", "0.75"), size="0.0012", unit="inch")
    yield lambda: _best_fit("best-fit-no-deviation", cam(), Pose.of("133", "-51", "17"), size=0)
    yield _best_fit_uneven
    yield _best_fit_by_length
    yield lambda: _minimum_zone("minimum-zone-closed", cam(), Pose.of("64", "-7.5", "21"))
    yield lambda: _minimum_zone("minimum-zone-open", open_wave(), Pose.of("-160", "75", "3.5"))
    yield lambda: _minimum_zone("minimum-zone-rational", rational_wave(), Pose.of("31", "-14", "-3"), first=17)
    yield lambda: _minimum_zone("minimum-zone-straight-parts", stadium(30, 12), Pose.of("5", "1", "2"), turns=True)
    yield lambda: _minimum_zone("minimum-zone-symmetric", ellipse(40, 15), Pose.of("-20", "8", "13"), turns=True)
    yield lambda: _minimum_zone("minimum-zone-ball-centres", cam(), Pose.of("77.5", "3", "3"), tip=2, first=40)
    yield lambda: _minimum_zone("minimum-zone-too-wide", cam(), Pose.of("150", "-30", "9"), limit_mm=0.03, first=70)
    yield lambda: _minimum_zone("minimum-zone-beside-the-nominal", cam(), Pose.of("-48", "2", "-2"), middle="0.03", first=90)
    yield lambda: _minimum_zone("minimum-zone-inch", cam().scaled("0.05"), Pose.of(12, 2, -1), zone="0.003", unit="inch", first=110)
    yield lambda: _minimum_zone("minimum-zone-tiny", cam().scaled("0.01"), Pose.of("-12", "0.5", "-0.5"), zone="0.002", limit_mm=0.0015)
    yield _lobes


_LEAST_SQUARES = "The pose is that of least squares: the deviations are orthogonal to every small motion"


def _best_fit(
    name: str, curve: ExactCurve, pose: Pose, size: Number = "0.03", unit: CaseUnit = "mm", tip: Number = 0, turns: bool = False
) -> ReferenceCase:
    """Points that count alike. turns : half a turn brings the nominal onto itself."""
    feet = feet_of(curve)
    laid = lay(feet, without_motion(feet, form(COUNT, size)), pose, Decimal(tip))
    asked = Asked(
        name, "best-fit", f"{_LEAST_SQUARES}, all points counting alike.", (-0.06, 0.06), "conform", _ALL_ALIKE, unit, Decimal(tip)
    )
    return case_of(asked, curve, laid, **_equal(pose, turns))


def _equal(pose: Pose, turns: bool) -> dict[str, Any]:
    return {"equal_poses": (pose.half_turn.known,)} if turns else {}


def _best_fit_uneven() -> ReferenceCase:
    curve, pose = cam(), Pose.of("-99", "45", "-20")
    feet = [curve.foot(u) for first, last, count in (("0", "0.3", 300), ("0.3", "1", 90)) for u in curve.spread(count, first, last)]
    laid = lay(feet, without_motion(feet, form(len(feet), "0.03")), pose)
    about = f"{_LEAST_SQUARES}, all points counting alike although they are denser in places."
    return case_of(Asked("best-fit-uneven", "best-fit", about, (-0.06, 0.06), "conform", _ALL_ALIKE), curve, laid)


def _best_fit_by_length() -> ReferenceCase:
    """Points of a circle and two lines at equal distances along the outline, so that all stand for the same length."""
    half, radius, pose = Decimal(30), Decimal(12), Pose.of("37", "-11", "80")
    length = 4 * half + 2 * PI * radius
    feet = [_on_stadium(length * (2 * i + 1) / (2 * COUNT), half, radius) for i in range(COUNT)]
    laid = lay(feet, without_motion(feet, form(COUNT, "0.03", waves=(3, 5))), pose)
    about = f"{_LEAST_SQUARES}, points counting by the length that each stands for, which is the same for all."
    asked = Asked("best-fit-by-length", "best-fit", about, (-0.06, 0.06), "conform", _BY_LENGTH)
    return case_of(asked, stadium(half, radius), laid, **_equal(pose, True))


def _on_stadium(station: Decimal, half: Decimal, radius: Decimal) -> Foot:
    """The foot at a station of the stadium, from its lower left."""
    straight, arc = 2 * half, PI * radius
    for side in (1, -1):
        if station < straight:
            return Foot(side * (station - half), -side * radius, Decimal(0), Decimal(-side))
        if station - straight < arc:
            cosine, sine = cosine_and_sine((station - straight) / radius - PI / 2)
            return Foot(side * (half + radius * cosine), side * radius * sine, side * cosine, side * sine)
        station -= straight + arc
    raise ValueError("the station lies beyond the end")


def _minimum_zone(
    name: str,
    curve: ExactCurve,
    pose: Pose,
    zone: Number = "0.08",
    limit_mm: float = 0.05,
    unit: CaseUnit = "mm",
    tip: Number = 0,
    middle: Number = 0,
    first: int = 0,
    turns: bool = False,
) -> ReferenceCase:
    """Points four of which hold the minimum zone, about a middle. first : where the search for the four begins."""
    feet, half, mean = feet_of(curve), Decimal(zone) / 2, Decimal(middle)
    held = held_by_four(feet, curve.arm, [Decimal(1)] * COUNT, first)
    deviation = [mean + Decimal("0.6") * half * s for s in scattered(COUNT, 5 + first)]
    for row, sign in zip(held.rows, held.signs, strict=True):
        deviation[row] = mean + sign * half
    laid = lay(feet, deviation, pose, Decimal(tip))
    mm = Decimal("25.4") if unit == "inch" else Decimal(1)
    about = f"The minimum zone is {zone} {unit} wide: four points hold it, and their gradients cancel with positive multipliers."
    limits = float(mean) - limit_mm, float(mean) + limit_mm
    verdict: KnownVerdict = "conform" if half * mm <= Decimal(str(limit_mm)) else "nonconform"
    asked = Asked(name, "minimum-zone", about, limits, verdict, _MINIMUM_ZONE, unit, Decimal(tip))
    known = held.known(lambda row: abs(laid.deviation[row] - mean), 2)
    return case_of(asked, curve, laid, zone=known, worst=None, **_equal(pose, turns))


def _lobes() -> ReferenceCase:
    """A circle with three lobes: whichever way it is shifted, one of the lobes or hollows gets worse."""
    count, radius, lobe = 180, Decimal(25), Decimal("0.03")
    angles = [2 * PI * i / count for i in range(count)]
    feet = [Foot(radius * c, radius * s, c, s) for c, s in map(cosine_and_sine, angles)]
    laid = lay(feet, [lobe * cosine_and_sine(3 * angle)[0] for angle in angles], Pose.of("71", "16", "-24"))
    about = "A circle with three lobes of 0.03 mm has a minimum zone of twice that, centred where the circle is; any rotation is as good."
    asked = Asked("minimum-zone-lobes", "minimum-zone", about, (-0.05, 0.05), "conform", _MINIMUM_ZONE)
    zone = KnownHold(as_float(2 * lobe), np.empty(0, dtype=np.int64), as_array([]))
    return case_of(asked, ellipse(25, 25), laid, zone=zone, pose=None, deviation=None, worst=None)
