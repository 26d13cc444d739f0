"""What a drawing asks of a stack of sections, such as those of a blade from root to tip, and what was found of it.

A characteristic of a stack stands on numbers of its sections, each with a verdict that says whether anything about it is in doubt.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal

from inspection.characteristics.characteristic import CharacteristicResult, SectionCharacteristic
from inspection.conclusion import Reason
from inspection.rigid import RigidTransform
from inspection.verdict import Verdict

StackKind = Literal["twist", "relative-twist", "displacement", "bow", "lean", "stacking-axis", "taper"]
StackingAxisMethod = Literal["straightness", "location"]
Axis = Literal["total", "x", "y"]

_AXES: tuple[Axis, ...] = ("x", "y")


@dataclass(frozen=True, slots=True, eq=False)
class StackCharacteristic:
    """A number of a stack, or one for each of its sections, within limits of its deviation from the nominal one.

    type         : what it is, and `method` by which method of a section; of a stacking axis its straightness or its location
    lower, upper : limits of the deviation, in the unit of the value; infinite where there is none
    uncertainty  : expanded uncertainty U of the value
    nominal_value : what the deviation is counted from; NaN for what follows from the nominal sections
    axis         : of displacement and lean: along x, along y, or in all
    place_mm     : the stacking point in the nominal's coordinates
    of           : the length that tapers
    reference_mm : height of the section that a relative twist is counted from; None for the lowest
    root_mm, tip_mm : heights of the sections that bow is counted from; None for the lowest and the highest
    datum        : the known pose of all sections, from section to nominal; None where there is none
    """

    name: str
    type: StackKind
    method: str
    lower: float
    upper: float
    uncertainty: float = 0.0
    nominal_value: float = math.nan
    axis: Axis = "total"
    place_mm: tuple[float, float] = (0.0, 0.0)
    of: Literal["chord", "thickness"] = "chord"
    reference_mm: float | None = None
    root_mm: float | None = None
    tip_mm: float | None = None
    datum: RigidTransform | None = None

    @property
    def counts_from_datum(self) -> bool:
        """Whether it has a value only where the pose of the part is known."""
        return self.type in ("twist", "displacement") or (self.type, self.method) == ("stacking-axis", "location")

    @property
    def numbers(self) -> tuple[SectionCharacteristic, ...]:
        """The numbers of each section that it stands on, without limits; equal names are equal numbers."""
        seen = self.datum
        if seen is None and not self.counts_from_datum:
            seen = RigidTransform.identity()  # how the sections lie to each other is seen from anywhere
        if self.type == "taper":
            return (_number(self.of, self.method, None),)
        turned = _number("twist", self.method if self.type in ("twist", "relative-twist") else "best-fit", seen)
        if self.type in ("twist", "relative-twist"):
            return (turned,)
        moved = tuple(
            replace(_number("displacement", "best-fit", seen, f"along {axis} at {self.place_mm}"), axis=axis, place_mm=self.place_mm)
            for axis in _AXES
        )
        return (*moved, turned)


def _number(
    kind: Literal["chord", "thickness", "twist", "displacement"], method: str, seen: RigidTransform | None, further: str = ""
) -> SectionCharacteristic:
    words = [kind, method, further, "of the section" if seen is None else "as seen from a pose"]
    return SectionCharacteristic(" ".join(filter(None, words)), kind, method, -math.inf, math.inf, datum=seen)


@dataclass(frozen=True, slots=True, eq=False)
class MeasuredSection:
    """One section of a stack, as far as the stack's characteristics depend on it.

    numbers : what was found of each number by its name; empty where the section has no result, `reasons` then say why
    """

    height_mm: float
    numbers: Mapping[str, CharacteristicResult]
    reasons: tuple[Reason, ...] = ()


@dataclass(frozen=True, slots=True)
class SectionShare:
    """What one section has of a characteristic of its stack; NaN where it has none."""

    height_mm: float
    value: float
    deviation: float
    verdict: Verdict


@dataclass(frozen=True, slots=True, eq=False)
class StackCharacteristicResult:
    """What was found of a characteristic of a stack.

    found     : as of a characteristic of a section; where each section has a value of its own, that of the worst of them
    height_mm : of that section; NaN where the stack has one value
    sections  : in rising order, where each has a value of its own
    """

    found: CharacteristicResult
    height_mm: float = math.nan
    sections: tuple[SectionShare, ...] = ()


def numbers_of(asked: Sequence[StackCharacteristic]) -> tuple[SectionCharacteristic, ...]:
    """Every number of a section that characteristics of its stack stand on, each once."""
    return tuple({number.name: number for one in asked for number in one.numbers}.values())
