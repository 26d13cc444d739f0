"""Points laid at known deviations above known feet, moved by a known pose, rounded to the digits of a file; and what is true of them then.

Rounding moves a point by some 1e-13 of its distance from the origin. Its deviation changes by the share of that along the normal, and by
no more than the square of it otherwise, so that the deviations of the rounded points are known to all digits that are written.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from decimal import Decimal
from typing import Any

from cmmlink.reference.case import CaseKind, CaseUnit, KnownPose, KnownVerdict, KnownWorst, ReferenceCase, Truth
from cmmlink.reference.exact_curve import ExactCurve, Foot
from cmmlink.reference.exact_numbers import PI, Number, Pair, as_array, as_float, as_pairs, cosine_and_sine, rounded, total


@dataclass(frozen=True)
class Pose:
    """The motion from measured points to the nominal: a rotation about the origin in degrees, then a translation."""

    degrees: Decimal
    x: Decimal
    y: Decimal

    @classmethod
    def of(cls, degrees: Number, x: Number = 0, y: Number = 0) -> "Pose":
        """A pose by numbers that are written as text, so that none is rounded."""
        return cls(Decimal(degrees), Decimal(x), Decimal(y))

    @property
    def known(self) -> KnownPose:
        """The pose as the truth has it."""
        return KnownPose(as_float(self.degrees), (as_float(self.x), as_float(self.y)))

    @property
    def datum(self) -> dict[str, Any]:
        """The pose as the datum of a plan; its lengths are in mm."""
        return {"rotation_deg": as_float(self.degrees), "translation_mm": [as_float(self.x), as_float(self.y)]}

    @property
    def half_turn(self) -> "Pose":
        """The pose behind which a nominal that half a turn about the origin brings onto itself is met just as well."""
        return Pose(self.degrees - 180 if self.degrees > 0 else self.degrees + 180, -self.x, -self.y)

    def apply(self, places: Sequence[Pair]) -> list[Pair]:
        """Places where the pose brings them."""
        c, s = cosine_and_sine(self.degrees * PI / 180)
        return [(c * x - s * y + self.x, s * x + c * y + self.y) for x, y in places]

    def undo(self, places: Sequence[Pair]) -> list[Pair]:
        """Places that the pose brings to these."""
        c, s = cosine_and_sine(self.degrees * PI / 180)
        return [(c * (x - self.x) + s * (y - self.y), c * (y - self.y) - s * (x - self.x)) for x, y in places]


IN_PLACE = Pose.of(0)


@dataclass(frozen=True)
class Laid:
    """Measured points as a file holds them, and their deviations at the pose.

    measured  : (m,) places in section coordinates, of 15 digits
    placed    : (m,) the same where the pose brings them
    deviation : (m,) of these
    """

    pose: Pose
    measured: list[Pair]
    placed: list[Pair]
    deviation: list[Decimal]

    @property
    def rms(self) -> float:
        """The root of the mean square of the deviations."""
        return as_float((total(d * d for d in self.deviation) / len(self.deviation)).sqrt())

    @property
    def worst(self) -> KnownWorst:
        """The point that deviates most, the first of several."""
        row = max(range(len(self.deviation)), key=lambda i: abs(self.deviation[i]))
        x, y = self.placed[row]
        return KnownWorst(row, as_float(x), as_float(y), as_float(self.deviation[row]))


def lay(feet: Sequence[Foot], deviation: Sequence[Decimal], pose: Pose = IN_PLACE, tip_radius: Decimal = Decimal(0)) -> Laid:
    """Points (m,) at deviations above feet, as they are measured before the pose."""
    meant = [(f.x + (d + tip_radius) * f.nx, f.y + (d + tip_radius) * f.ny) for f, d in zip(feet, deviation, strict=True)]
    measured = [(rounded(x), rounded(y)) for x, y in pose.undo(meant)]
    placed = pose.apply(measured)
    left = [(x - f.x) * f.nx + (y - f.y) * f.ny - tip_radius for (x, y), f in zip(placed, feet, strict=True)]
    return Laid(pose, measured, placed, left)


@dataclass(frozen=True)
class Asked:
    """How a case is named and judged."""

    name: str
    kind: CaseKind
    about: str
    limits_mm: tuple[float, float]
    verdict: KnownVerdict
    settings: Mapping[str, Any]
    unit: CaseUnit = "mm"
    tip_radius: Decimal = Decimal(0)


def case_of(asked: Asked, curve: ExactCurve, laid: Laid, **more: Any) -> ReferenceCase:
    """The case of points that were laid: pose, deviations, the worst point and the root mean square are true of every one.

    more : what else is true of it, by the names of `Truth`
    """
    deviation = as_array(laid.deviation)
    truth = Truth(asked.verdict, pose=laid.pose.known, deviation=deviation, worst=laid.worst, rms=laid.rms)
    return ReferenceCase(
        asked.name,
        asked.kind,
        asked.about,
        asked.unit,
        curve.nominal,
        as_pairs(laid.measured),
        as_float(asked.tip_radius),
        asked.limits_mm,
        asked.settings,
        replace(truth, **more),
    )


def at_datum(pose: Pose, mm_per_unit: Number = 1) -> dict[str, Any]:
    """Settings of a plan in which the pose is known."""
    scale = Decimal(mm_per_unit)
    return {"registration": {"datum": Pose(pose.degrees, pose.x * scale, pose.y * scale).datum}}
