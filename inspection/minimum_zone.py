"""The minimum zone: the pose with the smallest largest deviation (Chebyshev), with its certificate.

ISO 1101 judges form by the minimum zone, not by least squares. See `chebyshev` for how it is found; at most four active points and
their multipliers prove it optimal nearby, and `certificate` proves that no other placement has a smaller one.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from inspection.chebyshev import Values, descend
from inspection.coarse import check_registrable
from inspection.fine import register
from inspection.freedoms import Freedoms
from inspection.methods import Method
from inspection.nominal import NominalProfile
from inspection.registration import Registration
from inspection.rigid import RigidTransform
from inspection.signed_deviations import deviations

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class MinimumZone:
    """The smallest zone, and why no smaller one exists nearby.

    nominal_from_section : pose of the fit
    zone_mm              : width of the zone, 2 * max |deviation - middle_mm|
    middle_mm            : middle of the zone
    active               : (a,) indices of the points that hold the zone
    multipliers          : (a,) of those points, positive, with the sum 1; the gradients of their deviations, weighted by
                           multiplier and sign, add up to zero
    programs             : linear programs solved
    converged            : the last step moved no point by more than 1e-10 mm
    """

    nominal_from_section: RigidTransform
    zone_mm: float
    middle_mm: float
    active: NDArray[np.int64]
    multipliers: Array
    programs: int
    converged: bool


def fit_minimum_zone(
    points_mm: ArrayLike,
    nominal: NominalProfile,
    start: Registration | RigidTransform | None = None,
    method: Method = "exact",
    tip_radius_mm: float = 0.0,
    middle_mm: float = 0.0,
    is_over: Callable[[], bool] = lambda: False,
    freedoms: Freedoms | None = None,
) -> MinimumZone:
    """Minimum zone of section points (m, 2), begun at `start` or at their best fit. Points beyond open ends take no part.

    middle_mm : middle of the tolerance zone that the deviations are held against; zero for an equally disposed zone
    is_over   : asked before every linear program; once it says so, the fit ends where it stands, not converged
    freedoms  : the motions that the fit may make from `start`, which is then needed; None frees all. Multipliers then balance over
                the free motions only, and not where a freedom is at its limit
    """
    points = check_registrable(points_mm)
    if start is None and freedoms is not None:
        raise ValueError("a fit with locked or limited freedoms needs the pose from which they count")
    begin = register(points, nominal, method, tip_radius_mm=tip_radius_mm) if start is None else start
    pose = begin.nominal_from_section if isinstance(begin, Registration) else begin

    def look(moved: Array) -> Values:
        d = deviations(moved, nominal, method, tip_radius_mm)
        return Values(d.deviation_mm - middle_mm, d.normal, d.station_mm, ~d.beyond_end)

    found = descend(points, look, pose, freedoms, nominal.length_mm, is_over)
    return MinimumZone(found.pose, 2 * found.largest, middle_mm, found.active, found.multipliers, found.programs, found.converged)
