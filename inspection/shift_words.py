"""Where all points are out by the same, as the centres of a ball are: by how much, and what may be wrong."""

import numpy as np
from numpy.typing import NDArray

from inspection.tolerance import ToleranceZone

Array = NDArray[np.float64]

SHIFT_SCATTERS = 10.0  # by which all points are out
_NINE_OF_TEN = 3.29  # standard deviations of a normal distribution between its quantiles of 5 % and 95 %
_RADIUS_NEAR = 0.05


def shift_of(deviation_mm: Array) -> tuple[float, float]:
    """By how much all deviations (k,) are out, and their scatter: the standard deviation that nine of ten of them suggest."""
    low, middle, high = np.quantile(deviation_mm, [0.05, 0.5, 0.95])
    return float(middle), float(high - low) / _NINE_OF_TEN


def away_mm(shift_mm: float, zone: ToleranceZone) -> float:
    """How far from what was to be expected: a part as its nominal is nothing shifted, whatever zone lies beside it."""
    return min(abs(shift_mm), abs(shift_mm - zone.middle_mm))


def is_a_radius(shift_mm: float, radius_mm: float) -> bool:
    """Tell whether points are inside by what is known of the ball: its radius, its diameter, or half of what was given."""
    return radius_mm > 0 and any(abs(shift_mm + times * radius_mm) < _RADIUS_NEAR * radius_mm for times in (0.5, 1, 2))


def words_of_shift(shift_mm: float, scatter_mm: float, radius_mm: float, option: str = " (--material)") -> str:
    """By how much all points are out or inside, and what may be wrong with the ball or its side, which an option may turn."""
    side = f"or is the material on the other side{option}?"
    if radius_mm > 0 and abs(shift_mm + radius_mm) < _RADIUS_NEAR * radius_mm:
        mend = f"was the radius of the ball taken off twice? Leave out the tip radius of {radius_mm:g} mm (--tip-radius)"
    elif radius_mm > 0 and abs(shift_mm + 2 * radius_mm) < _RADIUS_NEAR * radius_mm:
        mend = f"is the ball on the other side of the material{option}?"
    elif radius_mm > 0 and radius_mm + shift_mm > 0:
        mend = f"is {radius_mm:g} mm the radius of the tip? With {radius_mm + shift_mm:.3g} mm the points would fit (--tip-radius), {side}"
    elif shift_mm > 0:
        mend = f"ball centres? Give the radius of the tip (--tip-radius {shift_mm:.3g}), {side}"
    else:
        mend = f"was the radius of a ball taken off twice, {side}"
    return f"{abs(shift_mm):.3f} mm {'out' if shift_mm > 0 else 'inside'} (scatter {scatter_mm:.3f} mm): {mend}"


def shift_reservation(deviation_mm: Array, zone: ToleranceZone, tip_radius_mm: float, option: str = " (--material)") -> str:
    """What is to be said of a part that does not conform where all deviations (k,) are out by the same, as ball centres are; or nothing.

    The part itself may be too large, so this is no reason to refuse it.
    """
    shift, scatter = shift_of(deviation_mm)
    if away_mm(shift, zone) <= max((zone.upper_mm - zone.lower_mm) / 2, SHIFT_SCATTERS * scatter):
        return ""
    return f"All points are {words_of_shift(shift, scatter, tip_radius_mm, option)}"
