"""What a characteristic of a section is told as: one number, with everything that belongs to it.

Two programs that measure "the chord" of one section may differ by half a percent, because they mean different things. Therefore
no number leaves this package without the name of its method and the window that the method used.
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Unit = Literal["mm", "deg", "1"]


@dataclass(frozen=True, slots=True, eq=False)
class SectionValue:
    """One characteristic of one section.

    name         : what it is, such as "chord"
    method       : how it was found, such as "tangent"; values of different methods must not be compared
    value        : in `unit`
    unit         : mm, deg, or 1 for a ratio
    places_mm    : (k, 2) the places that it was found at, for a drawing; k may be 0
    place_names  : (k,) what each place is, such as "contact on the upper side"
    window       : (name, number with its unit in the name) for everything that the method was told
    residual_mm  : largest distance of what was fitted from the section; None where nothing was fitted
    notes        : what the method had to assume, such as how the ends of a camber line were continued
    other        : what the value would be if the smaller of two were the larger, as of a camber line that bulges to both sides; NaN
                   where there is but one
    """

    name: str
    method: str
    value: float
    unit: Unit
    places_mm: Array
    place_names: tuple[str, ...]
    window: tuple[tuple[str, float], ...] = ()
    residual_mm: float | None = None
    notes: tuple[str, ...] = ()
    other: float = float("nan")

    def __post_init__(self) -> None:
        if self.places_mm.shape != (len(self.place_names), 2):
            raise ValueError(f"expected {len(self.place_names)} places (k, 2), got {self.places_mm.shape}")
        self.places_mm.setflags(write=False)

    @property
    def key(self) -> tuple[str, str, tuple[tuple[str, float], ...]]:
        """What two values must have in common to be comparable."""
        return self.name, self.method, self.window


@dataclass(frozen=True, slots=True, eq=False)
class ComparedValue:
    """A characteristic of the actual section beside that of the nominal one.

    deviation : actual - nominal, in their unit; an angle lies within half a turn
    """

    nominal: SectionValue
    actual: SectionValue
    deviation: float


def compare_values(nominal: SectionValue, actual: SectionValue) -> ComparedValue:
    """The two values side by side. Raises ValueError when they are not of one characteristic, method and window."""
    if nominal.key != actual.key:
        raise ValueError(f"these are not comparable: nominal {nominal.key}, actual {actual.key}")
    difference = actual.value - nominal.value
    return ComparedValue(nominal, actual, angle_within_half_a_turn(difference) if nominal.unit == "deg" else difference)


def angle_within_half_a_turn(angle_deg: float) -> float:
    """The same direction as an angle above -180 and up to 180 degrees."""
    return 180.0 - (180.0 - angle_deg) % 360.0


def angle_of(vector: Array) -> float:
    """Angle of a vector (2,) from the x axis, anticlockwise, in degrees."""
    return float(np.degrees(np.arctan2(vector[1], vector[0])))


def no_places() -> Array:
    """The places (0, 2) of a value that has none."""
    return np.zeros((0, 2))
