"""The datum of a characteristic that is measured on the part itself, by its features, on the points of a run.

Which points a feature has follows from the pose of the run on. So where the part fits the nominal in another pose as well, or where
its fit did not settle, there is no datum.
"""

import numpy as np
from numpy.typing import NDArray

from inspection.characteristics.characteristic import LineProfile
from inspection.datum import DatumFeatures, FoundDatum, find_datum
from inspection.errors import InspectionError
from inspection.evaluation.basis import Basis
from inspection.evaluation.region import is_inside
from inspection.nominal import NominalProfile
from inspection.profile_uncertainty import StatedUncertainty, uncertainty_at_datum
from inspection.rigid import RigidTransform

Array = NDArray[np.float64]

UNSTATED = "no uncertainty is stated, so that none of the datum is counted"


def check_datum(nominal: NominalProfile, features: DatumFeatures) -> None:
    """Raise ValueError for features that do not fix a part, as the nominal itself shows."""
    find_datum(nominal.points_mm, nominal, features, RigidTransform.identity(), np.inf)


def datum_of(features: DatumFeatures, basis: Basis) -> FoundDatum:
    """The datum that the points of a run give. Raises InspectionError where they give none."""
    if features in basis.datums:
        return basis.datums[features]
    registration, terms = basis.result.registration, basis.terms
    if terms.known_pose is None and registration.rivals:
        raise InspectionError("The part fits the nominal in another pose as well: which of its features are the datum is not known.")
    if not basis.result.findings.converged:
        raise InspectionError("The fit of the run did not settle, so that it is not known which points are the datum.")
    points = basis.result.section_at(basis.drawn(basis.rows(None)))
    if not len(points):
        raise InspectionError("The datum was not found: no point was judged.")
    settings = (terms.limits.gap_max_mm, terms.method, terms.tip_radius_mm, terms.weights)
    basis.datums[features] = find_datum(points, basis.nominal, features, basis.pose, *settings)
    return basis.datums[features]


def uncertainty_at(datum: FoundDatum, asked: LineProfile, basis: Basis) -> float:
    """U of a deviation at a measured datum, the largest in the region, with what the datum's own points bring in.

    By the budget where there is one. Else one U is all that is stated of a deviation: then as if the errors of all points had the worst
    signs, for nothing is known of how they hang together.
    """
    nominal, region = basis.nominal, asked.region
    if basis.terms.uncertainty is None:
        if not basis.result.zone.uncertainty_mm:
            return 0.0
        inside = np.ones(len(nominal), dtype=np.bool_) if region is None else is_inside(nominal.station_mm, region, nominal)
        if not inside.any():
            inside[:] = True
        at, outward = nominal.points_mm[inside], nominal.outward * nominal.normal[inside]
        return basis.result.zone.uncertainty_mm * (1.0 + float(datum.amplification(at, outward).max()))
    stated = basis.terms.uncertainty.stated
    along = uncertainty_at_datum(nominal, stated, datum, fixed_place(stated, datum))
    if region is None:
        return along.largest_mm
    ends = along.at([region.from_mm, region.to_mm])
    return float(along.expanded_mm[is_inside(along.station_mm, region, nominal)].max(initial=float(ends.max())))


def fixed_place(stated: StatedUncertainty, datum: FoundDatum) -> Array:
    """What stays where it is as the part grows (2,), in the coordinates of the nominal at the datum."""
    return np.asarray(datum.pose.apply(np.array([stated.fixed_mm]))[0])
