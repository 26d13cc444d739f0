"""The colours of deviations on a surface: fixed to the tolerance zone and not to the data, and told apart by colour-blind eyes too.

Inside the zone the colour runs from a pale blue at the lower limit over white to a pale orange at the upper one. What is out of the zone
is dark, blue below and vermilion above; what is not proven is a strong yellow, and what was not measured is grey.
"""

from enum import IntEnum

import numpy as np
from numpy.typing import ArrayLike, NDArray

from inspection import ToleranceZone, Verdict

Array = NDArray[np.float64]
Colours = NDArray[np.uint8]


class Kind(IntEnum):
    """What is shown of a point of a surface, in the order in which one hides the other."""

    NOT_JUDGED = 0
    WITHIN = 1
    UNCERTAIN = 2
    BELOW = 3
    ABOVE = 4


AT_LOWER, AT_MIDDLE, AT_UPPER = "#8fc1e3", "#f7f5ef", "#fbbe8a"
COLOURS = {Kind.NOT_JUDGED: "#9aa1a8", Kind.UNCERTAIN: "#e8c400", Kind.BELOW: "#123f8f", Kind.ABOVE: "#b3300b"}
NAMED = {
    "lower": AT_LOWER,
    "middle": AT_MIDDLE,
    "upper": AT_UPPER,
    "above": COLOURS[Kind.ABOVE],
    "below": COLOURS[Kind.BELOW],
    "not_proven": COLOURS[Kind.UNCERTAIN],
    "not_measured": COLOURS[Kind.NOT_JUDGED],
}


def kinds_of(verdicts: ArrayLike, deviation_mm: ArrayLike, middle_mm: float) -> NDArray[np.int8]:
    """The kind (m,) of each point from the codes of its verdict (m,) and its deviation (m,); a code that is no verdict is not judged."""
    codes, deviation = np.asarray(verdicts), np.asarray(deviation_mm, dtype=np.float64)
    kinds = np.full(len(codes), Kind.NOT_JUDGED, dtype=np.int8)
    kinds[codes == Verdict.CONFORM] = Kind.WITHIN
    kinds[codes == Verdict.UNCERTAIN] = Kind.UNCERTAIN
    out = codes == Verdict.NONCONFORM
    kinds[out] = np.where(deviation[out] > middle_mm, Kind.ABOVE, Kind.BELOW)
    kinds[~np.isfinite(deviation)] = Kind.NOT_JUDGED
    return kinds


def colours_of(kinds: NDArray[np.int8], deviation_mm: Array, zone: ToleranceZone) -> Colours:
    """The colour (m, 3) of each point, red, green and blue from 0 to 255."""
    table = np.array([rgb_of(COLOURS.get(kind, AT_MIDDLE)) for kind in sorted(Kind)], dtype=np.uint8)
    found: Colours = table[kinds]
    within = kinds == Kind.WITHIN
    found[within] = within_zone(deviation_mm[within], zone)
    return found


def within_zone(deviation_mm: Array, zone: ToleranceZone) -> Colours:
    """The colours (m, 3) of deviations between the limits (m,)."""
    share = np.clip((deviation_mm - zone.lower_mm) / (zone.upper_mm - zone.lower_mm), 0.0, 1.0)
    stops = np.array([rgb_of(colour) for colour in (AT_LOWER, AT_MIDDLE, AT_UPPER)], dtype=np.float64)
    mixed = np.column_stack([np.interp(share, (0.0, 0.5, 1.0), stops[:, channel]) for channel in range(3)])
    return np.round(mixed).astype(np.uint8)


def severity_of(kinds: NDArray[np.int8], deviation_mm: Array, zone: ToleranceZone) -> NDArray[np.float32]:
    """How bad each point is (m,), above zero: a point hides every other that is less so. Which side it is out on makes no difference."""
    far = np.abs(np.nan_to_num(deviation_mm) - zone.middle_mm) / (zone.upper_mm - zone.lower_mm)
    rank = np.minimum(kinds, Kind.BELOW).astype(np.float64)
    return np.asarray(1000.0 * rank + np.minimum(far, 999.0) + 1.0, dtype=np.float32)


def rgb_of(colour: str) -> tuple[int, int, int]:
    """Red, green and blue, from 0 to 255, of a colour spelled like #123abc."""
    return int(colour[1:3], 16), int(colour[3:5], 16), int(colour[5:7], 16)
