"""What was found of every point of a scan, row by row, as results hand it out and records keep it."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class JudgedRows:
    """A row for every received point, in the order of arrival; those of rejected points are NaN, their verdict NOT_JUDGED.

    actual_mm    : (m, 2) actual surface points in nominal coordinates (ball centres are already compensated)
    foot_mm      : (m, 2) the nominal points they are compared with
    station_mm   : (m,) arc length of the foot points
    deviation_mm : (m,) positive out of material
    verdicts     : (m,) codes of `Verdict`
    rejection    : (m,) codes of `Rejection`
    """

    actual_mm: Array
    foot_mm: Array
    station_mm: Array
    deviation_mm: Array
    verdicts: NDArray[np.int8]
    rejection: NDArray[np.int8]

    def __post_init__(self) -> None:
        pairs, columns = (self.actual_mm, self.foot_mm), (self.station_mm, self.deviation_mm, self.verdicts, self.rejection)
        m = len(self.verdicts)
        if any(array.shape != (m, 2) for array in pairs) or any(array.shape != (m,) for array in columns):
            raise ValueError(f"expected ({m}, 2) twice and ({m},), got {[array.shape for array in (*pairs, *columns)]}")
        for array in (*pairs, *columns):
            array.setflags(write=False)

    def __repr__(self) -> str:
        return f"<JudgedRows of {self.received} points, {np.count_nonzero(np.isfinite(self.deviation_mm))} with a deviation>"

    @property
    def received(self) -> int:
        """Points received; always judged + rejected."""
        return len(self.verdicts)
