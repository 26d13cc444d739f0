"""Cases about deviations: the pose is known, and every point lies at a known distance from the nominal."""

from collections.abc import Callable, Iterator, Sequence
from decimal import Decimal

from cmmlink.reference.case import CaseUnit, KnownVerdict, ReferenceCase
from cmmlink.reference.exact_curve import ExactCurve, Foot
from cmmlink.reference.exact_numbers import PI, Number, cosine_and_sine, rounded, scattered, sine, total
from cmmlink.reference.laying import IN_PLACE, Asked, Pose, at_datum, case_of, lay
from cmmlink.reference.shapes import angle_piece, cam, ellipse, lens, open_wave, rational_wave, stadium

Build = Callable[[], ReferenceCase]

COUNT = 160  # points of a case, which leave no gap of a hundredth of the length
_MM_PER_INCH = "25.4"


def form(count: int, size: Number, waves: tuple[int, ...] = (3, 7), seed: int = 1) -> list[Decimal]:
    """Deviations (count,) as of a worn machine: waves, and a fifth of scatter; no larger than the size."""
    scatter = scattered(count, seed)
    share = Decimal(size) * 4 / (5 * len(waves))
    sums = [total(share * sine(2 * PI * k * i / count + k) for k in waves) for i in range(count)]
    return [each + Decimal(size) / 5 * s for each, s in zip(sums, scatter, strict=True)]


def feet_of(curve: ExactCurve, count: int = COUNT) -> list[Foot]:
    """Feet (count,) at even distances along the curve."""
    return [curve.foot(u) for u in curve.spread(count)]


def builders() -> Iterator[Build]:
    """What builds each case."""
    yield from _curves()
    yield from _sizes_and_units()
    yield from _balls()
    yield from _corners()
    yield _bump
    yield _uneven
    yield _in_no_order
    yield _beside_zero


def _curves() -> Iterator[Build]:
    yield lambda: _known("open-curve", "An open cubic curve with hollows.", open_wave(), Pose.of("12.5", "3.25", "-8.5"))
    yield lambda: _known("rational-curve", "An open rational cubic curve.", rational_wave(), Pose.of("-41", "120.5", "64"))
    yield lambda: _known("closed-curve", "A smooth closed cubic curve without symmetry.", cam(), Pose.of("-156.3", "-15", "40.125"))
    yield lambda: _known("circle", "An exact circle.", ellipse(25, 25), Pose.of("77", "250", "-130"))
    yield lambda: _known("thin-ellipse", "An exact ellipse that is thin at its ends.", ellipse(40, 4), Pose.of("33.3", "5", "7"))
    yield lambda: _known("edge-of-an-eighth", "An exact ellipse whose edges have a radius of 0.125 mm.", ellipse(50, "2.5"), IN_PLACE)
    yield lambda: _known("straight-parts", "Straight parts that run into arcs.", stadium(30, 12), Pose.of("-8.75", "0.5", "-0.25"))
    yield lambda: _known("clockwise", "The closed curve clockwise, material on its right.", cam().reversed(), Pose.of("21", "4", "-9"))
    yield lambda: _known("open-material-right", "The open curve backwards, material on its right.", open_wave().reversed(), IN_PLACE)


def _sizes_and_units() -> Iterator[Build]:
    huge, tiny = cam().scaled(200), cam().scaled("0.002")
    yield lambda: _known("huge", "A closed curve 24 m across.", huge, Pose.of("140", "-2000", "512.5"))
    yield lambda: _known("tiny", "A closed curve a quarter of a millimetre across.", tiny, Pose.of("-66", "0.0625", "0.125"), size="0.0004")
    yield lambda: _known("far-away", "An open curve a hundred metres from zero.", open_wave(), Pose.of("57", "98304.5", "-65536.25"))
    inches = cam().scaled("0.05")
    yield lambda: _known("inch-closed", "A closed curve in inches.", inches, Pose.of("18", "2.5", "-1.25"), size="0.0016", unit="inch")
    small, pose, what = open_wave().scaled("0.05"), Pose.of("-95", "4", "3"), "Ball centres and an open curve in inches."
    yield lambda: _known("inch-ball-centres", what, small, pose, size="0.0016", unit="inch", tip="0.0625")


def _balls() -> Iterator[Build]:
    yield lambda: _known("ball-centres-open", "Centres of a ball on an open curve.", open_wave(), Pose.of("170", "66", "8"), tip="1.5")
    yield lambda: _known("ball-centres-closed", "Centres of a ball on a closed curve.", cam(), Pose.of("-3", "-80", "31"), tip=4)
    yield lambda: _known("ball-centres-thin", "Centres of a ball around thin ends.", ellipse(40, 4), Pose.of("45", "1", "1"), tip="0.5")


def _known(
    name: str, what: str, curve: ExactCurve, pose: Pose, size: Number = "0.04", unit: CaseUnit = "mm", tip: Number = 0
) -> ReferenceCase:
    """A case of even points with form, all of which lie within the zone."""
    return known_at(
        name, f"{what} Every deviation is known, and so is the pose.", curve, feet_of(curve), form(COUNT, size), pose, unit, tip
    )


def known_at(
    name: str,
    about: str,
    curve: ExactCurve,
    feet: Sequence[Foot],
    deviation: Sequence[Decimal],
    pose: Pose = IN_PLACE,
    unit: CaseUnit = "mm",
    tip: Number = 0,
    limits_mm: tuple[float, float] | None = None,
    verdict: KnownVerdict = "conform",
) -> ReferenceCase:
    """A case whose pose is the datum of its plan; without limits these are a quarter farther than the largest deviation."""
    mm = Decimal(_MM_PER_INCH) if unit == "inch" else Decimal(1)
    laid = lay(feet, deviation, pose, Decimal(tip))
    wide = float(round(max(abs(each) for each in deviation) * mm * 5 / 4, 6))
    asked = Asked(name, "deviation", about, limits_mm or (-wide, wide), verdict, at_datum(pose, mm), unit, Decimal(tip))
    return case_of(asked, curve, laid)


def _corners() -> Iterator[Build]:
    yield lambda: known_at("sharp-edges", _SHARP, lens(), *_around_edges(0), pose=Pose.of("-30", "9", "2"))
    yield lambda: known_at("ball-around-sharp-edges", _SHARP, lens(), *_around_edges(3), pose=Pose.of("100", "-9", "2"), tip="1.25")
    yield lambda: known_at("corners", _HOLLOW, angle_piece(), *_angle_points(), pose=Pose.of("61", "12", "-3"))


_SHARP = "Two arcs that meet in sharp edges: the deviation of a point beyond an edge is its distance from the edge."
_HOLLOW = "Straight parts with five corners and a hollow one: beyond a corner the deviation is the distance from the corner, with its sign."


def fan(x: Number, y: Number, from_deg: int, to_deg: int, count: int) -> list[Foot]:
    """Feet (count,) that all are one corner, with the directions out of material between two angles."""
    angles = [PI / 180 * (from_deg + Decimal(to_deg - from_deg) * (2 * i + 1) / (2 * count)) for i in range(count)]
    return [Foot(Decimal(x), Decimal(y), *cosine_and_sine(angle)) for angle in angles]


def _around_edges(seed: int) -> tuple[list[Foot], list[Decimal]]:
    """Points of the lens at its arcs, and beyond its edges where the normal of neither arc points."""
    arcs, edges = feet_of(lens()), [*fan(40, 0, -36, 36, 9), *fan(-40, 0, 144, 216, 9)]
    return [*arcs, *edges], [*form(COUNT, "0.04", seed=1 + seed), *(Decimal("0.02") * (1 + abs(s)) for s in scattered(18, 9))]


def _angle_points() -> tuple[list[Foot], list[Decimal]]:
    """Points of the angle section at its sides, away from the corners, and in the sectors of the corners that belong to no side."""
    curve, feet = angle_piece(), []
    for side in range(6):
        feet += [curve.foot(rounded(side + Decimal(2 * i + 1) / 60)) for i in range(30)]
    deviation = form(len(feet), "0.04")
    outer = [(0, 0, 180), (60, 0, 270), (60, 20, 0), (25, 50, 0), (0, 50, 90)]
    for x, y, start in outer:
        feet += fan(x, y, start, start + 90, 4)
        deviation += [Decimal("0.01") * k for k in (1, 2, 3, 4)]
    feet += fan(25, 20, 0, 90, 4)  # material around the hollow corner lies opposite to these directions
    return feet, [*deviation, *(Decimal("-0.01") * k for k in (1, 2, 3, 4))]


def _bump() -> ReferenceCase:
    curve = cam()
    deviation = form(COUNT, "0.02")
    for i in range(9):
        deviation[70 + i] += Decimal("0.06") * (25 - (i - 4) ** 2) / 25
    about = "A bump that rises beyond the limit: which point is the worst is known, and by how much."
    return known_at("bump", about, curve, feet_of(curve), deviation, Pose.of("8", "-2", "6"), limits_mm=(-0.04, 0.04), verdict="nonconform")


def _uneven() -> ReferenceCase:
    curve = cam()
    shares = [("0", "0.2", 400), ("0.2", "0.7", 60), ("0.7", "0.75", 150), ("0.75", "1", 40)]
    feet = [curve.foot(u) for first, last, count in shares for u in curve.spread(count, first, last)]
    about = "Points forty times denser in places: spacing changes no deviation."
    return known_at("uneven-spacing", about, curve, feet, form(len(feet), "0.04"), Pose.of("-120", "10", "10"))


def _in_no_order() -> ReferenceCase:
    curve = open_wave()
    feet, deviation = feet_of(curve), form(COUNT, "0.04")
    order = sorted(range(COUNT), key=scattered(COUNT, 77).__getitem__)
    about = "Points in no order: order changes no deviation."
    return known_at("in-no-order", about, curve, [feet[i] for i in order], [deviation[i] for i in order], Pose.of("5", "1", "-1"))


def _beside_zero() -> ReferenceCase:
    curve = cam()
    deviation = [Decimal("0.05") + each for each in form(COUNT, "0.03")]
    about = "All deviations lie on one side of the nominal, within a zone whose middle is beside it."
    return known_at("zone-beside-the-nominal", about, curve, feet_of(curve), deviation, Pose.of("90", "1", "1"), limits_mm=(0.01, 0.09))
