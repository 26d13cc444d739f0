"""Cases about deviations: the pose is known, and every point lies at a known distance from the nominal."""

from collections.abc import Callable, Iterator
from decimal import Decimal

from cmmlink.reference.case import ReferenceCase
from cmmlink.reference.exact_curve import ExactCurve
from cmmlink.reference.exact_numbers import PI, Number, scattered, sine, total
from cmmlink.reference.laying import Asked, Pose, at_datum, case_of, lay
from cmmlink.reference.shapes import cam, ellipse, open_wave, rational_wave, stadium

Build = Callable[[], ReferenceCase]


def form(count: int, size: Number, waves: tuple[int, ...] = (3, 7), seed: int = 1) -> list[Decimal]:
    """Deviations (count,) as of a worn machine: waves, and a fifth of scatter; no larger than the size."""
    scatter = scattered(count, seed)
    share = Decimal(size) * 4 / (5 * len(waves))
    sums = [total(share * sine(2 * PI * k * i / count + k) for k in waves) for i in range(count)]
    return [each + Decimal(size) / 5 * s for each, s in zip(sums, scatter, strict=True)]


def builders() -> Iterator[Build]:
    """What builds each case."""
    yield lambda: _form_of("open-curve", "An open cubic curve with hollows.", open_wave(), Pose.of("12.5", "3.25", "-8.5"))
    yield lambda: _form_of("rational-curve", "An open rational cubic curve.", rational_wave(), Pose.of("-41", "120.5", "64"))
    yield lambda: _form_of("closed-curve", "A smooth closed cubic curve without symmetry.", cam(), Pose.of("203.7", "-15", "40.125"))
    yield lambda: _form_of("circle", "An exact circle.", ellipse(25, 25), Pose.of("77", "250", "-130"))
    yield lambda: _form_of("thin-ellipse", "An exact ellipse whose ends are as thin as an edge.", ellipse(40, 4), Pose.of("33.3", "5", "7"))
    yield lambda: _form_of("stadium", "Straight parts that run into arcs.", stadium(30, 12), Pose.of("-8.75", "0.5", "-0.25"))


def _form_of(name: str, what: str, curve: ExactCurve, pose: Pose) -> ReferenceCase:
    feet = [curve.foot(u) for u in curve.spread(160)]
    laid = lay(feet, form(160, "0.04"), pose)
    asked = Asked(name, "deviation", f"{what} Every deviation is known, and so is the pose.", (-0.05, 0.05), "conform", at_datum(pose))
    return case_of(asked, curve, laid)
