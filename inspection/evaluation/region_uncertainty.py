"""The uncertainty of the deviations that a characteristic of the profile is judged by, from the budget of the run.

At a known pose it is that of the known pose. At a free fit of which every placement may pass, a deviation may be freed of any motion
(inspection/profile_uncertainty.py says why that holds). Where the pose of the fit itself decides, because the best fit does, because
motions are locked or because the deviations are filtered, it is what that fit leaves of the errors of its own points. A filter lowers
the part of noise; it is not counted on.
"""

import numpy as np
from numpy.typing import NDArray

from inspection.characteristics.characteristic import LineProfile
from inspection.evaluation.basis import Basis
from inspection.evaluation.datum import uncertainty_at
from inspection.evaluation.placing import Placed
from inspection.evaluation.region import is_inside
from inspection.profile_uncertainty import ProfileUncertainty, StatedUncertainty, uncertainty_along, uncertainty_at_fit

Rows = NDArray[np.int64]

_FEWEST_POINTS = 4  # of a fit


def uncertainty_of(asked: LineProfile, basis: Basis, few: Rows, placed: Placed) -> float:
    """U of one deviation of a characteristic, the largest in its region: its own where it states one, else what is stated for the run.

    few : rows (k,) of its region
    """
    if asked.uncertainty_mm is not None:
        return asked.uncertainty_mm
    if placed.datum is not None:
        return uncertainty_at(placed.datum, asked, basis)
    known_before = basis.terms.uncertainty
    if known_before is None:
        return basis.result.zone.uncertainty_mm
    found = _along(asked, basis, few, placed, known_before.stated)
    if asked.region is None or found.basis == "the best fit of the points":
        return found.largest_mm
    inside = is_inside(found.station_mm, asked.region, basis.nominal)
    ends = found.at([asked.region.from_mm, asked.region.to_mm])
    return float(found.expanded_mm[inside].max(initial=float(ends.max())))


def _along(asked: LineProfile, basis: Basis, few: Rows, placed: Placed, stated: StatedUncertainty) -> ProfileUncertainty:
    """The uncertainty along the profile, or at the points of the region where their own fit decides."""
    known = asked.datum if asked.datum is not None else basis.terms.known_pose
    if asked.fit in ("none", "datum"):
        run = basis.result.uncertainty
        assert run is not None
        return uncertainty_along(basis.nominal, stated, known) if known is not None else run
    decides = asked.freedoms is not None or asked.filter is not None or (asked.fit == "best-fit" and asked.rule == "best-fit")
    if not decides or len(few) < _FEWEST_POINTS:
        return uncertainty_along(basis.nominal, stated, None)
    points = placed.pose.apply(basis.result.section_at(few))
    fixed = placed.pose.apply(np.array([stated.fixed_mm]))[0]
    at_fit = uncertainty_at_fit(points, basis.nominal, stated, basis.terms.tip_radius_mm, basis.terms.weights, asked.freedoms, fixed)
    if known is None or asked.freedoms is None or not np.isfinite([asked.freedoms.lower, asked.freedoms.upper]).any():
        return at_fit
    locked = uncertainty_along(basis.nominal, stated, known)  # a motion that has come to its limit is fitted no more
    return locked if locked.largest_mm > at_fit.largest_mm else at_fit
