"""What a method of projection says about each actual point."""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Method = Literal["exact", "circle", "chord", "pcp", "veaw", "inversion"]


@dataclass(frozen=True, slots=True, eq=False)
class Deviations:
    """Signed deviations of m actual points from the nominal.

    deviation_mm : (m,) positive out of material; for ball centres the tip radius is already taken off
    foot_mm      : (m, 2) the nominal point each deviation is measured from
    parameter    : (m,) curve parameter of the foot
    station_mm   : (m,) arc length of the foot from the start of the curve
    normal       : (m, 2) unit direction in which the deviation grows
    curvature    : (m,) 1/mm of the nominal at the foot, positive where it turns left; 0 at corners and ends
    beyond_end   : (m,) the foot is an end of an open profile, so the sign is not reliable: kept out of fit and verdict
    at_vertex    : (m,) the foot is an end or a corner, to which the distance is that to a point
    """

    deviation_mm: Array
    foot_mm: Array
    parameter: Array
    station_mm: Array
    normal: Array
    curvature: Array
    beyond_end: NDArray[np.bool_]
    at_vertex: NDArray[np.bool_]

    def __post_init__(self) -> None:
        m = len(self.deviation_mm)
        for name, shape in self._shapes(m).items():
            array = getattr(self, name)
            if array.shape != shape:
                raise ValueError(f"{name}: expected {shape}, got {array.shape}")
            array.setflags(write=False)

    @staticmethod
    def _shapes(m: int) -> dict[str, tuple[int, ...]]:
        flat = ("deviation_mm", "parameter", "station_mm", "curvature", "beyond_end", "at_vertex")
        return dict.fromkeys(flat, (m,)) | {"foot_mm": (m, 2), "normal": (m, 2)}

    def __len__(self) -> int:
        return len(self.deviation_mm)


def profile_error_mm(deviations: Deviations) -> float:
    """Width of the smallest equally disposed zone that holds all points: 2 * max |deviation|, beyond-end points left out.

    Not the range max - min; a report shows both.
    """
    inside = deviations.deviation_mm[~deviations.beyond_end]
    return 2.0 * float(np.abs(inside).max(initial=0.0))
