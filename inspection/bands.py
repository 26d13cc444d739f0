"""What is allowed of deviations wherever points may lie: limits that are the same everywhere, or that vary along the profile.

A search over motions asks for more than the limits of a point at one pose: while a point moves, its foot moves along the profile, and
only what lies beyond the loosest limits that it may come to is out for certain.
"""

from collections.abc import Callable
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from inspection.consumption import fit_least_consumption
from inspection.freedoms import Freedoms
from inspection.kernels import Feet
from inspection.minimum_zone import fit_minimum_zone
from inspection.nominal import NominalProfile
from inspection.registration import Registration
from inspection.rigid import RigidTransform
from inspection.zones import VaryingZone

Array = NDArray[np.float64]
Rows = NDArray[np.int64]
Limits = tuple[Array, Array]
Start = Registration | RigidTransform | None


class Band(Protocol):
    """The deviations between which every point must lie for a placement to pass."""

    @property
    def narrowest_mm(self) -> float:
        """Half its width where that is smallest."""

    @property
    def farthest_mm(self) -> float:
        """The largest deviation that it allows, either way."""

    def limits(self, feet: Feet) -> Limits:
        """The lower and the upper limit (m,) at feet (m,)."""

    def loosest(self, places: Array, feet: Feet, moves_mm: Array) -> Limits:
        """The lowest lower and the highest upper limit (m,) that places (m, 2) may come to while they move by `moves_mm` (m,)."""

    def fit(
        self, points: Array, nominal: NominalProfile, start: Start, tip: float, is_over: Callable[[], bool], freedoms: Freedoms | None
    ) -> tuple[RigidTransform, Rows]:
        """A pose at which points (m, 2) reach least far towards its limits, nearby, and the points that hold it there.

        start : where the fit begins, and from where its freedoms count; tip : radius of the ball of which points are the centre, mm
        """


class EvenBand:
    """Limits that are the same everywhere: |deviation - middle_mm| <= half_mm."""

    def __init__(self, half_mm: float, middle_mm: float = 0.0) -> None:
        self.narrowest_mm, self.farthest_mm = half_mm, half_mm + abs(middle_mm)
        self._middle_mm = middle_mm
        self._limits = np.array(middle_mm - half_mm), np.array(middle_mm + half_mm)

    def limits(self, feet: Feet) -> Limits:
        """See `Band`."""
        return self._limits

    def loosest(self, places: Array, feet: Feet, moves_mm: Array) -> Limits:
        """See `Band`."""
        return self._limits

    def fit(
        self, points: Array, nominal: NominalProfile, start: Start, tip: float, is_over: Callable[[], bool], freedoms: Freedoms | None
    ) -> tuple[RigidTransform, Rows]:
        """See `Band`."""
        zone = fit_minimum_zone(points, nominal, start, "exact", tip, self._middle_mm, is_over, freedoms)
        return zone.nominal_from_section, zone.active


class VaryingBand:
    """Limits that vary along the profile: those of a zone of which points consume no more than a given share.

    share : 1 is the zone itself; another share makes its half width so many times as large about its middle
    """

    def __init__(self, nominal: NominalProfile, zone: VaryingZone, share: float = 1.0) -> None:
        self._zone, self._share = zone, share
        self._reach = nominal.reach.value
        lower, upper = self._of(zone.lower_mm, zone.upper_mm)
        self.narrowest_mm = float((upper - lower).min()) / 2
        self.farthest_mm = float(np.maximum(np.abs(lower), np.abs(upper)).max())

    def limits(self, feet: Feet) -> Limits:
        """See `Band`."""
        limits = self._zone.limits(feet.station_mm)
        return self._of(limits.lower_mm, limits.upper_mm)

    def loosest(self, places: Array, feet: Feet, moves_mm: Array) -> Limits:
        """See `Band`."""
        lower_low, lower_high, upper_low, upper_high = self._zone.extremes(*self._reach.stretches(places, feet, moves_mm))
        if self._share <= 1:
            return self._of(lower_low, upper_low)[0], self._of(lower_high, upper_high)[1]
        return self._of(lower_low, upper_high)

    def fit(
        self, points: Array, nominal: NominalProfile, start: Start, tip: float, is_over: Callable[[], bool], freedoms: Freedoms | None
    ) -> tuple[RigidTransform, Rows]:
        """See `Band`."""
        found = fit_least_consumption(points, nominal, self._zone, start, "exact", tip, is_over, freedoms)
        return found.nominal_from_section, found.active

    def _of(self, lower: Array, upper: Array) -> Limits:
        """Both limits of the band where those of the zone are these."""
        return ((1 + self._share) * lower + (1 - self._share) * upper) / 2, ((1 - self._share) * lower + (1 + self._share) * upper) / 2
