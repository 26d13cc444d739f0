"""Characteristics of a stack of sections, such as those of a blade from root to tip.

All heights are along the stacking direction z; a value of a section enters with the height that it was measured at. Straight lines over
the height are of least squares unless a root and a tip are named.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from inspection.characteristics.section_value import SectionValue, angle_within_half_a_turn, no_places

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class StackedSections:
    """What is known of k sections of one part, from root to tip.

    height_mm       : (k,) rising
    twist_deg       : (k,) of each section against its nominal, all by one method
    displacement_mm : (k, 2) of each section's stacking point against the nominal one, in the nominal's coordinates
    stacking_mm     : (k, 2) the nominal stacking points
    """

    height_mm: Array
    twist_deg: Array
    displacement_mm: Array
    stacking_mm: Array

    def __post_init__(self) -> None:
        k = len(self.height_mm)
        if k < 2 or np.any(np.diff(self.height_mm) <= 0):
            raise ValueError("a stack needs at least two sections, at rising heights")
        for name, shape in {"twist_deg": (k,), "displacement_mm": (k, 2), "stacking_mm": (k, 2)}.items():
            if getattr(self, name).shape != shape:
                raise ValueError(f"{name}: expected {shape}, got {getattr(self, name).shape}")
        for array in (self.height_mm, self.twist_deg, self.displacement_mm, self.stacking_mm):
            if not np.isfinite(array).all():
                raise ValueError("a stack of sections needs finite numbers")
            array.setflags(write=False)


@dataclass(frozen=True, slots=True, eq=False)
class StackingAxis:
    """The straight line through the actual stacking points.

    origin_mm    : (2,) where it crosses the height of the first section
    direction    : (3,) unit vector, its z component positive
    lean_x_deg   : angle by which it leans towards x more than the nominal line of stacking points does
    lean_y_deg   : the same towards y
    residual_mm  : (k, 2) of the actual stacking points from it, in the planes of the sections
    """

    origin_mm: Array
    direction: Array
    lean_x_deg: SectionValue
    lean_y_deg: SectionValue
    residual_mm: Array

    def __post_init__(self) -> None:
        for array in (self.origin_mm, self.direction, self.residual_mm):
            array.setflags(write=False)


def relative_twist(stack: StackedSections, reference: int = 0) -> tuple[SectionValue, ...]:
    """The twist in degrees of every section against that of the section numbered `reference`, from 0."""
    base = float(stack.twist_deg[reference])
    window = (("reference_height_mm", float(stack.height_mm[reference])),)
    differences = (angle_within_half_a_turn(float(twist) - base) for twist in stack.twist_deg)
    return tuple(SectionValue("relative twist", "difference", value, "deg", no_places(), (), window) for value in differences)


def bow(stack: StackedSections, root: int = 0, tip: int = -1) -> tuple[SectionValue, ...]:
    """How far in mm every section lies from the straight line between the displacements of root and tip, in its plane.

    The line is drawn through the displacements, so that a stack that is curved by design has no bow where it is as designed.
    """
    low, high = stack.height_mm[root], stack.height_mm[tip]
    if low == high:
        raise ValueError("root and tip must be different sections")
    share = ((stack.height_mm - low) / (high - low))[:, None]
    offsets = stack.displacement_mm - (1 - share) * stack.displacement_mm[root] - share * stack.displacement_mm[tip]
    window = (("root_height_mm", float(low)), ("tip_height_mm", float(high)))
    actual = stack.stacking_mm + stack.displacement_mm
    return tuple(
        SectionValue(
            "bow", "root-tip", float(np.hypot(*offset)), "mm", np.vstack([place, place - offset]), ("actual", "on the line"), window
        )
        for offset, place in zip(offsets, actual, strict=True)
    )


def fit_stacking_axis(stack: StackedSections) -> StackingAxis:
    """The axis of least squares through the actual stacking points, and how it leans against that of the nominal ones."""
    actual = stack.stacking_mm + stack.displacement_mm
    (origin, slope), (_, nominal_slope) = _line_over_height(stack.height_mm, actual), _line_over_height(stack.height_mm, stack.stacking_mm)
    direction = np.append(slope, 1.0)
    lean = np.degrees(np.arctan(slope) - np.arctan(nominal_slope))
    rest = actual - origin - (stack.height_mm - stack.height_mm[0])[:, None] * slope
    residual = float(np.hypot(*rest.T).max())
    along_x, along_y = (
        SectionValue(f"lean towards {axis}", "least-squares", float(angle), "deg", actual[[0, -1]], ("root", "tip"), residual_mm=residual)
        for axis, angle in zip("xy", lean, strict=True)
    )
    return StackingAxis(origin, direction / np.linalg.norm(direction), along_x, along_y, rest)


def taper(height_mm: Array, values: tuple[SectionValue, ...]) -> SectionValue:
    """The change of a length per height, such as that of the chord from root to tip: the slope of the line of least squares.

    height_mm : (k,) of the sections whose values are given. Raises ValueError for values of different methods or that are no lengths.
    """
    heights = np.asarray(height_mm, dtype=np.float64)
    if len(values) < 2 or heights.shape != (len(values),) or np.ptp(heights) == 0:
        raise ValueError("taper needs the values of two sections or more, and one height for each")
    if len({value.key for value in values}) > 1 or values[0].unit != "mm":
        raise ValueError(f"taper needs lengths of one method, not {sorted({(value.name, value.method, value.unit) for value in values})}")
    lengths = np.array([[value.value] for value in values])
    origin, slope = _line_over_height(heights, lengths)
    residual = float(np.abs(lengths - origin - (heights - heights[0])[:, None] * slope).max())
    name = f"taper of {values[0].name}"
    return SectionValue(name, values[0].method, float(slope[0]), "1", no_places(), (), values[0].window, residual)


def _line_over_height(height_mm: Array, values: Array) -> tuple[Array, Array]:
    """Value at the first height (d,) and slope (d,) of the lines of least squares through values (k, d)."""
    z = height_mm - height_mm.mean()
    slope = (z[:, None] * values).sum(axis=0) / (z * z).sum()
    return values.mean(axis=0) + slope * (height_mm[0] - height_mm.mean()), slope
