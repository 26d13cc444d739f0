"""Points of a warm part as they would be at the reference temperature: scaled about the place that stays where it is as the part grows."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from inspection.section import SectionPlane

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Compensation:
    """Takes the growth of a part out of its measured points, within the plane of the section; their heights above it stay.

    growth   : how much larger the part was than at the reference temperature, mm a mm
    fixed_mm : the place that stayed where it is, in section coordinates. After a free fit it does not matter
    """

    growth: float
    fixed_mm: tuple[float, float] = (0.0, 0.0)

    def __post_init__(self) -> None:
        if not (np.isfinite([self.growth, *self.fixed_mm]).all() and self.growth > -1):
            raise ValueError(f"a growth of {self.growth:g} about {self.fixed_mm} is none that a part can have")

    @property
    def factor(self) -> float:
        """The size at the reference temperature, by the size as measured."""
        return 1.0 / (1.0 + self.growth)

    def apply(self, points_mm: Array, plane: SectionPlane) -> Array:
        """Section points (m, 2) or machine points (m, 3) of the part at the reference temperature.

        Every coordinate is worked out by itself, so that a point does not depend on the batch that it came in.
        """
        with np.errstate(over="ignore", invalid="ignore"):  # a device may send what is no point
            if points_mm.shape[1] == 2:
                return np.asarray(points_mm + (self.factor - 1.0) * (points_mm - np.array(self.fixed_mm)))
            away = points_mm - plane.to_machine(np.array([self.fixed_mm]))[0]
            height = (away[:, 0] * plane.normal[0] + away[:, 1] * plane.normal[1]) + away[:, 2] * plane.normal[2]
            return np.asarray(points_mm + (self.factor - 1.0) * (away - height[:, None] * plane.normal))
