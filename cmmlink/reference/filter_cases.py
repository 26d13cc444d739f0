"""Cases about filters: waves on a circle, of which a known share is left, and a parabola, which order 2 leaves as it is.

Of a wave of length w, a Gaussian filter of the cutoff c (ISO 16610-21) leaves exp(-ln 2 (c / w)^2). Gaussian regression of order 2 (of
ISO 16610-28 and -31) leaves (1 + z) exp(-z) with z = z0 (c / w)^2, where z0 solves (1 + z) exp(-z) = 1/2. The linear spline of
ISO 16610-22, over points a step d apart, leaves 1 / (1 + (sin(pi d / w) / sin(pi d / c))^4). The points are dense and go round without an
end, so that sums over them are the integrals of these forms to all digits; programs cut the Gaussian off where it is small, some at 1e-6.
"""

from collections.abc import Iterator, Sequence
from decimal import Decimal
from typing import Any, NamedTuple

from cmmlink.reference.case import KnownFilter, KnownValue, ReferenceCase
from cmmlink.reference.deviation_cases import Build
from cmmlink.reference.exact_curve import ExactCurve, Foot
from cmmlink.reference.exact_numbers import PI, Number, as_array, as_float, cosine_and_sine, rounded, sine, total
from cmmlink.reference.laying import Asked, Laid, Pose, at_datum, case_of, lay
from cmmlink.reference.shapes import ellipse, straight_line

_ROUND = 720
_RADIUS = Decimal(25)


class Wave(NamedTuple):
    """A sine around the circle: how often it swings, its amplitude, and its phase in radians."""

    swings: int
    size: Decimal
    phase: Decimal = Decimal(0)


def builders() -> Iterator[Build]:
    """What builds each case."""
    one = [Wave(20, Decimal("0.02"))]
    three = [Wave(4, Decimal("0.02"), Decimal("0.3")), Wave(15, Decimal("0.01"), Decimal(1)), Wave(60, Decimal("0.006"), Decimal(2))]
    yield lambda: _waves("filter-at-the-cutoff", "A wave as long as the cutoff, of which half is left.", one, 2 * PI * _RADIUS / 20, 0)
    yield lambda: _waves("filter-gaussian", "Three waves through a Gaussian filter.", three, Decimal(8), 0)
    yield lambda: _waves("filter-order-two", "Three waves through Gaussian regression of order 2.", three, Decimal(8), 2)
    yield lambda: _waves("filter-short-cutoff", "Three waves through a filter that leaves the longest two.", three, Decimal("2.5"), 2)
    yield lambda: _parabola("filter-parabola", "", {})
    yield lambda: _parabola("filter-spikes", "robust ", {40: "-0.03", 41: "-0.035", 120: "0.02", 200: "-0.04", 288: "0.045"})


def share_left(order: int, cutoff: Decimal, wave: Decimal) -> Decimal:
    """The share of a wave that Gaussian regression of order 0 or 2 leaves."""
    if order == 0:
        return (-Decimal(2).ln() * (cutoff / wave) ** 2).exp()
    z = _at_half() * (cutoff / wave) ** 2
    return (1 + z) * (-z).exp()


def _at_half() -> Decimal:
    """The solution of (1 + z) exp(-z) = 1/2, by Newton's method."""
    z = Decimal("1.678")
    for _ in range(6):
        z += ((1 + z) * (-z).exp() - Decimal("0.5")) / (z * (-z).exp())
    return z


def _share_by_spline(cutoff: Decimal, wave: Decimal, step: Decimal) -> Decimal:
    return 1 / (1 + (sine(PI * step / wave) / sine(PI * step / cutoff)) ** 4)


def _waves(name: str, what: str, waves: Sequence[Wave], cutoff: Decimal, order: int) -> ReferenceCase:
    """Waves on a circle, filtered by the order and, for other programs, by the other order and by a spline."""
    cutoff = rounded(cutoff)
    angles = [2 * PI * i / _ROUND for i in range(_ROUND)]
    feet = [Foot(_RADIUS * c, _RADIUS * s, c, s) for c, s in map(cosine_and_sine, angles)]
    around = 2 * PI * _RADIUS
    step = around / _ROUND

    def left(shares: Sequence[Decimal]) -> list[Decimal]:
        return [
            total(share * wave.size * sine(wave.swings * angle + wave.phase) for wave, share in zip(waves, shares, strict=True))
            for angle in angles
        ]

    laid = lay(feet, left([Decimal(1)] * len(waves)), Pose.of("30", "5", "-60"))
    lengths = [around / wave.swings for wave in waves]
    known = {f"Gaussian regression of order {k}": left([share_left(k, cutoff, each) for each in lengths]) for k in (0, 2)}
    known["spline"] = left([_share_by_spline(cutoff, each, step) for each in lengths])
    about = f"{what} The share of a wave that a filter leaves is known in closed form."
    return _filtered(name, about, ellipse(_RADIUS, _RADIUS), laid, cutoff, order, known)


def _filtered(
    name: str, about: str, curve: ExactCurve, laid: Laid, cutoff: Decimal, order: int, known: dict[str, list[Decimal]], robust: str = ""
) -> ReferenceCase:
    """The case of points whose waviness the plan asks for, at the datum, by regression of an order. robust : that it is, as a word."""
    profile: dict[str, Any] = {"name": "profile", "type": "line-profile", "fit": "none", "zone": {"width_mm": 0.1}}
    waviness = profile | {"name": "waviness", "filter": {"cutoff_mm": as_float(cutoff), "order": order, "robust": bool(robust)}}
    settings = at_datum(laid.pose) | {"characteristics": [profile, waviness]}
    wanted = known[f"{robust}Gaussian regression of order {order}"]
    value = KnownValue("waviness", "mm", as_float(2 * max(abs(each) for each in wanted)))
    filters = tuple(KnownFilter(words, as_float(cutoff), as_array(deviation)) for words, deviation in known.items())
    asked = Asked(name, "filter", about, (-0.05, 0.05), "conform", settings)
    return case_of(asked, curve, laid, filtered=filters, values=(value,))


def _parabola(name: str, robust: str, spikes: dict[int, Number]) -> ReferenceCase:
    """A straight part that is bent: order 2 leaves a parabola as it is, up to the ends and however points are spaced.

    robust, spikes : the robust filter also leaves it where some points spike off it, by row: all others lie on it, and spikes count nothing
    """
    count, length = 300, Decimal(100)
    along = [length * (Decimal(i) / (count - 1) + _bent(i, count)) for i in range(count)]
    feet = [Foot(s, Decimal(0), Decimal(0), Decimal(1)) for s in along]
    bent = [Decimal("0.03") - Decimal("0.0016") * s + Decimal("0.000014") * s * s for s in along]
    deviation = [Decimal(spikes[row]) if row in spikes else d for row, d in enumerate(bent)]
    laid = lay(feet, deviation, Pose.of("-15", "8", "2"))
    left = [bent[row] if row in spikes else d for row, d in enumerate(laid.deviation)]
    what = (
        f", of which {len(spikes)} points are spikes: the robust filter leaves the parabola" if spikes else ": order 2 leaves it as it is"
    )
    about = f"A parabola on a straight part, unevenly spaced{what}, up to both ends."
    return _filtered(name, about, straight_line(100), laid, Decimal(12), 2, {f"{robust}Gaussian regression of order 2": left}, robust)


def _bent(i: int, count: int) -> Decimal:
    """How far the spacing leaves an even one, as a share of the length; nothing at the ends."""
    t = Decimal(i) / (count - 1)
    return Decimal("0.4") * t * (1 - t) * (t - Decimal("0.5"))
