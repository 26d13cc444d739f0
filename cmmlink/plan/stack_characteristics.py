"""What a drawing asks of a stack of sections, such as a blade from root to tip: twist, bow, lean and the like, each with a tolerance.

Every field says in its description what it means; docs/ct-plan.md is written from these descriptions.
"""

from typing import Annotated, Literal, get_args

from pydantic import Field, ValidationInfo, field_validator

from cmmlink.plan.characteristics import LOWER, UPPER, InDeg, InMm, Limited, U, limits_of
from inspection import ChordMethod, StackingAxisMethod, ThicknessMethod

PLACE = "the stacking point, in the coordinates of the nominals"
TwistMethod = Literal["best-fit", "nose-tail", "caliper", "maximum-distance"]
TWIST = "by the best fit of the whole outline, or by the chord angle of that name"


class StackTwist(InDeg):
    """How each section is turned against its nominal."""

    type: Literal["twist"] = Field(description="how each section is turned against its nominal, positive counterclockwise; needs a datum")
    method: TwistMethod = Field(default="best-fit", description=TWIST)


class RelativeTwist(InDeg):
    """How each section is turned against its nominal more than one of them is."""

    type: Literal["relative-twist"] = Field(
        description="how much more each section is turned against its nominal than the section at reference_mm is; needs no datum"
    )
    method: TwistMethod = Field(default="best-fit", description=TWIST)
    reference_mm: float | None = Field(default=None, description="the height of that section; null: the lowest")


class StackDisplacement(InMm):
    """How far the stacking point of each section lies from the nominal one."""

    type: Literal["displacement"] = Field(description="how far the stacking point of each section lies from its nominal; needs a datum")
    method: Literal["best-fit"] = Field(default="best-fit", description="by the best fit of the whole outline")
    axis: Literal["total", "x", "y"] = Field(default="total", description="along x, along y, or in all")
    place_mm: tuple[float, float] = Field(default=(0.0, 0.0), description=PLACE)


class Bow(InMm):
    """How far the stacking point of each section lies from the line between two of them."""

    type: Literal["bow"] = Field(
        description="how far the stacking point of each section lies from the straight line between root and tip, beyond the design"
    )
    method: Literal["root-tip"] = Field(default="root-tip", description="from the line between the sections at root_mm and tip_mm")
    place_mm: tuple[float, float] = Field(default=(0.0, 0.0), description=PLACE)
    root_mm: float | None = Field(default=None, description="the height of one of them; null: the lowest")
    tip_mm: float | None = Field(default=None, description="the height of the other; null: the highest")


class Lean(InDeg):
    """How the axis through the stacking points leans."""

    type: Literal["lean"] = Field(description="the angle between sections.normal and the axis through the stacking points")
    method: Literal["least-squares"] = Field(default="least-squares", description="the axis of least squares")
    axis: Literal["total", "x", "y"] = Field(default="total", description="towards x, towards y, or in all")
    place_mm: tuple[float, float] = Field(default=(0.0, 0.0), description=PLACE)


class StackingAxis(InMm):
    """The axis of least squares through the stacking points."""

    type: Literal["stacking-axis"] = Field(description="the axis of least squares through the stacking points")
    method: StackingAxisMethod = Field(
        default="straightness",
        description="the largest distance of a stacking point from it, or (location, which needs a datum) its largest distance from the "
        "nominal axis between the lowest and the highest section",
    )
    place_mm: tuple[float, float] = Field(default=(0.0, 0.0), description=PLACE)


class Taper(Limited):
    """The slope of the line of least squares through the chords of the sections, or through their largest thicknesses."""

    type: Literal["taper"] = Field(description="how a length changes with the height: mm a mm, positive where it grows along the normal")
    of: Literal["chord", "thickness"] = Field(default="chord", description="the length that changes: the chord, or the largest thickness")
    method: ChordMethod | ThicknessMethod | None = Field(
        default=None,
        validate_default=True,
        description="how it is measured, by a method of that length; null: tangent for a chord, inscribed for a thickness",
    )
    nominal: float | None = Field(default=None, description="the value of the drawing; null: that of the nominals at the same heights")
    lower: float | None = Field(default=None, description=LOWER)
    upper: float | None = Field(default=None, description=UPPER)
    uncertainty: float = Field(default=0.0, ge=0, description=U)

    @field_validator("method")
    @classmethod
    def _of_that_length(cls, method: str | None, info: ValidationInfo) -> str | None:
        of = info.data.get("of", "chord")
        known = get_args(ChordMethod if of == "chord" else ThicknessMethod)
        if method is None:
            return "tangent" if of == "chord" else "inscribed"
        if method not in known:
            raise ValueError(f"a method of {of}: {', '.join(known)}")
        return method

    @property
    def limits_of_deviation(self) -> tuple[float, float]:
        """Lower and upper limit of the deviation, infinite where there is none."""
        return limits_of(self.lower, self.upper)

    @property
    def expanded_uncertainty(self) -> float:
        """U, in mm a mm."""
        return self.uncertainty


AskedOfStack = Annotated[StackTwist | RelativeTwist | StackDisplacement | Bow | Lean | StackingAxis | Taper, Field(discriminator="type")]
