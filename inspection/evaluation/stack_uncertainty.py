"""The uncertainty of the characteristics of a stack, from that of the numbers of its sections.

How the errors of two sections go together is not known, since what measured one measured the other: they are added as if they all went
the way that changes the value most. What a stack is said to prove, it proves however they go.
"""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from inspection.characteristics.stack_characteristic import MeasuredSection, StackCharacteristic

Array = NDArray[np.float64]

ADDED = "U is that of its sections, added as if all their errors went the same way"


def uncertainty_of_stack(asked: StackCharacteristic, sections: Sequence[MeasuredSection], root: int, tip: int, reference: int) -> Array:
    """U of each value (k,), or of the one value (1,), in its unit; NaN where it needs a number that there is not.

    root, tip : sections that bow is counted from; reference : that of a relative twist
    """
    numbers = np.array([[_u(section, number.name) for number in asked.numbers] for section in sections])  # (k, n)
    heights = np.array([section.height_mm for section in sections])
    if asked.type == "twist":
        return np.asarray(numbers[:, 0])
    if asked.type == "relative-twist":
        return np.where(np.arange(len(heights)) == reference, 0.0, numbers[:, 0] + numbers[reference, 0])
    known = np.isfinite(numbers).all(axis=1)
    if known.sum() < 2 and asked.type != "displacement":
        return np.full(len(heights) if asked.type == "bow" else 1, np.nan)
    if asked.type == "taper":
        return np.array([np.abs(_slopes(heights[known])) @ numbers[known, 0]])
    if asked.type == "displacement":
        return np.asarray(np.hypot(numbers[:, 0], numbers[:, 1]) if asked.axis == "total" else numbers[:, "xy".index(asked.axis)])
    moved = np.hypot(numbers[:, 0], numbers[:, 1])  # (k,) of the stacking points, in whatever direction
    if asked.type == "bow":
        share = (heights - heights[root]) / (heights[tip] - heights[root]) if root != tip else np.full(len(heights), np.nan)
        between = moved + np.abs(1 - share) * moved[root] + np.abs(share) * moved[tip]
        return np.where(np.isin(np.arange(len(heights)), (root, tip)), 0.0, between)
    return np.array([_of_axis(asked, heights[known], moved[known], numbers[known, 2])])


def drawing_of_stack(asked: StackCharacteristic, sections: Sequence[MeasuredSection]) -> float:
    """How far the drawn sections may mislead about a taper, at worst; other values of a stack stand on best fits, which need no drawing."""
    if asked.type != "taper":
        return 0.0
    (number,) = asked.numbers
    found = [(section.height_mm, section.numbers[number.name]) for section in sections if section.numbers]
    known = [(height, one.drawing) for height, one in found if math.isfinite(one.value)]
    if len(known) < 2:
        return 0.0
    heights, drawings = (np.array(column) for column in zip(*known, strict=True))
    return float(np.abs(_slopes(heights)) @ drawings)


def _u(section: MeasuredSection, name: str) -> float:
    return section.numbers[name].uncertainty if section.numbers else math.nan


def _slopes(heights: Array) -> Array:
    """What each of k values adds to the slope of the line of least squares over the heights (k,)."""
    z = heights - heights.mean()
    return np.asarray(z / (z @ z))


def _of_axis(asked: StackCharacteristic, heights: Array, moved: Array, twist_deg: Array) -> float:
    """U of a lean in degrees, whose directions turn with the twist, or of the straightness or the location of the axis in mm."""
    slopes = _slopes(heights)
    if asked.type == "lean":
        return math.degrees(float(np.abs(slopes) @ moved)) + (float(np.mean(twist_deg)) if asked.axis != "total" else 0.0)
    line = 1 / len(heights) + np.outer(heights - heights.mean(), slopes)  # (k, k) how the axis at each height follows each section
    if asked.method == "location":
        return float((np.abs(line[[0, -1]]) @ moved).max())
    return float((np.abs(np.eye(len(heights)) - line) @ moved).max())
