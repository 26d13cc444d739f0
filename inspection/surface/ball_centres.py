"""The surface that centres of a probe's ball lie on: as far out of material as the ball's radius, with its feet on the nominal itself.

A ball that touches the nominal anywhere has its centre exactly one radius from the closest place of it, on edges and corners, too. So the
deviation of what it touched is the distance of its centre less the radius, whatever the shape.
"""

from dataclasses import replace

from numpy.typing import ArrayLike

from inspection.errors import NominalError
from inspection.surface.feet import Array, NominalSurface, SurfaceFeet


class BallCentres:
    """A nominal for points that are centres of a ball. Raises NominalError where the side that the ball comes from is not known.

    tip_radius_mm : that of the ball
    """

    def __init__(self, nominal: NominalSurface, tip_radius_mm: float) -> None:
        if not nominal.sides_known:
            raise NominalError("centres of a ball need a nominal whose sides are known; give points on the part")
        self._nominal, self.tip_radius_mm = nominal, tip_radius_mm

    @property
    def nominal_error_mm(self) -> float:
        """That of the nominal."""
        return self._nominal.nominal_error_mm

    @property
    def sides_known(self) -> bool:
        """True, or it would not be."""
        return True

    @property
    def area_mm2(self) -> float:
        """That of the nominal, which the feet cover."""
        return self._nominal.area_mm2

    @property
    def size_mm(self) -> float:
        """That of the nominal."""
        return self._nominal.size_mm

    @property
    def notes(self) -> tuple[str, ...]:
        """Those of the nominal."""
        return self._nominal.notes

    def project(self, points_mm: ArrayLike) -> SurfaceFeet:
        """Feet on the nominal of centres (m, 3); their distance is that of what the ball touched."""
        feet = self._nominal.project(points_mm)
        return replace(feet, distance_mm=feet.distance_mm - self.tip_radius_mm)

    def sample(self, count: int) -> tuple[Array, Array]:
        """Places of the nominal, as its own `sample` gives them."""
        return self._nominal.sample(count)
