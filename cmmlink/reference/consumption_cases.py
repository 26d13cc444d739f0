"""Cases about the least consumption of a zone that varies along the profile: four points hold it, as they hold a minimum zone.

Where the limits do not change along the profile, a share of the zone changes with a motion as the deviation does, divided by half the
width. The points that hold the consumption lie in such stretches; those where the limits run from one to another are well inside.
"""

from collections.abc import Iterator
from decimal import Decimal
from typing import NamedTuple

from cmmlink.reference.balance import held_by_four
from cmmlink.reference.case import KnownVerdict, ReferenceCase
from cmmlink.reference.deviation_cases import COUNT, Build, feet_of
from cmmlink.reference.exact_curve import ExactCurve
from cmmlink.reference.exact_numbers import Number, as_float, scattered
from cmmlink.reference.laying import Asked, Pose, case_of, lay
from cmmlink.reference.shapes import cam, open_wave, rational_wave

_LENGTH_MM = {"cam": Decimal("283.9"), "open": Decimal("181.1"), "rational": Decimal("184.7")}  # rounded down, for stations alone
_MARGIN = Decimal("0.005")  # of the length, to which a share of it is known


class _Stretch(NamedTuple):
    """Limits from one share of the length to another."""

    first: str
    last: str
    lower: str
    upper: str

    @property
    def middle(self) -> Decimal:
        """The deviation in the middle of the limits."""
        return (Decimal(self.lower) + Decimal(self.upper)) / 2

    @property
    def half(self) -> Decimal:
        """Half the distance of the limits."""
        return (Decimal(self.upper) - Decimal(self.lower)) / 2


class _Limits(NamedTuple):
    """The limits at a place, and whether they are the same around it."""

    middle: Decimal
    half: Decimal
    constant: bool


def builders() -> Iterator[Build]:
    """What builds each case."""
    tight_back = (
        _Stretch("0.02", "0.2", "-0.03", "0.03"),
        _Stretch("0.24", "0.46", "-0.02", "0.06"),
        _Stretch("0.5", "0.72", "-0.05", "0.05"),
        _Stretch("0.76", "0.98", "-0.1", "0.02"),
    )
    halves = (_Stretch("0", "0.45", "-0.02", "0.02"), _Stretch("0.5", "1", "-0.06", "0.06"))
    yield lambda: _case("consumption-closed", cam(), _LENGTH_MM["cam"], tight_back, Pose.of("-52", "9", "-40"), "0.8")
    yield lambda: _case("consumption-open", open_wave(), _LENGTH_MM["open"], halves, Pose.of("110", "21", "2"), "0.9", first=11)
    yield lambda: _case("consumption-rational", rational_wave(), _LENGTH_MM["rational"], halves, Pose.of("-9", "3", "4"), "0.75", first=31)
    yield lambda: _case("consumption-ball-centres", cam(), _LENGTH_MM["cam"], tight_back, Pose.of("14", "-6", "6"), "0.7", tip=2, first=51)
    yield lambda: _case("consumption-beyond", cam(), _LENGTH_MM["cam"], tight_back, Pose.of("86", "2", "5"), "1.2", first=90)


def _case(
    name: str,
    curve: ExactCurve,
    length_mm: Decimal,
    stretches: tuple[_Stretch, ...],
    pose: Pose,
    share: Number,
    tip: Number = 0,
    first: int = 0,
) -> ReferenceCase:
    """Points that consume a share of the zone and no less at any other pose. first : where the search for the four begins."""
    feet = feet_of(curve)
    limits = [_limits_at(Decimal(2 * i + 1) / (2 * COUNT), stretches) for i in range(COUNT)]
    held = held_by_four(feet, curve.arm, [10 * at.half if at.constant else None for at in limits], first)
    deviation = [
        at.middle + Decimal("0.55") * s * Decimal(share) * at.half for at, s in zip(limits, scattered(COUNT, 3 + first), strict=True)
    ]
    for row, sign in zip(held.rows, held.signs, strict=True):
        deviation[row] = limits[row].middle + sign * Decimal(share) * limits[row].half
    laid = lay(feet, deviation, pose, Decimal(tip))

    def consumed(row: int) -> Decimal:
        return abs(laid.deviation[row] - limits[row].middle) / limits[row].half

    about = f"{share} of a zone that varies is consumed, and no placement consumes less: four points hold it, their gradients cancel."
    verdict: KnownVerdict = "conform" if Decimal(share) <= 1 else "nonconform"
    settings = {"characteristics": [{"name": "zone", "type": "line-profile", "fit": "tolerance", "zone": _zone(stretches, length_mm)}]}
    lowest, highest = min(float(s.lower) for s in stretches), max(float(s.upper) for s in stretches)
    asked = Asked(name, "consumption", about, (lowest, highest), verdict, settings, tip_radius=Decimal(tip))
    return case_of(asked, curve, laid, consumption=held.known(consumed), worst=None)


def _limits_at(share: Decimal, stretches: tuple[_Stretch, ...]) -> _Limits:
    """The limits at a share of the length, as well as it is known where they change."""
    for stretch in stretches:
        first, last = Decimal(stretch.first), Decimal(stretch.last)
        if first <= share <= last:
            inside = (first == 0 or first + _MARGIN <= share) and (last == 1 or share <= last - _MARGIN)
            return _Limits(stretch.middle, stretch.half, inside)
    before = next((s for s in stretches[::-1] if Decimal(s.last) < share), stretches[-1])
    after = next((s for s in stretches if Decimal(s.first) > share), stretches[0])
    way, length = ((end - Decimal(before.last) + 1) % 1 for end in (share, Decimal(after.first)))  # also over the seam
    t = way / length
    return _Limits(before.middle + t * (after.middle - before.middle), before.half + t * (after.half - before.half), False)


def _zone(stretches: tuple[_Stretch, ...], length_mm: Decimal) -> dict[str, list[float]]:
    """The zone as a plan has it: limits at stations, which run straight from one to the next."""
    ends = [(as_float(round(Decimal(end) * length_mm, 1)), s) for s in stretches for end in (s.first, s.last)]
    return {
        "stations_mm": [station for station, _ in ends],
        "lower_mm": [float(stretch.lower) for _, stretch in ends],
        "upper_mm": [float(stretch.upper) for _, stretch in ends],
    }
