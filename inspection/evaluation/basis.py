"""What every characteristic of a run is judged on: the run's result, its terms, and what is known to be missing."""

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from inspection.characteristics.characteristic import Region
from inspection.cloud import MANY, drawn_rows, row_blocks
from inspection.conclusion import Conclusion, Missing, Reason, conclude
from inspection.datum import DatumFeatures, FoundDatum
from inspection.evaluation.region import is_inside
from inspection.filters import FilteredProfile, ProfileFilter, filter_profile
from inspection.gaps import Measured, measure_region, weigh_by_station
from inspection.nominal import NominalProfile
from inspection.result import InspectionResult
from inspection.rigid import RigidTransform
from inspection.signed_deviations import Deviations, deviations
from inspection.telling_points import telling_rows
from inspection.terms import Terms
from inspection.verdict import NOT_JUDGED, Verdict

Array = NDArray[np.float64]
Rows = NDArray[np.int64]

_SHARES = 8192  # of the length, of which the lowest and the highest point tell where a scan has more than MANY points


@dataclass(frozen=True, slots=True, eq=False)
class Basis:
    """A run that is over, as far as its characteristics depend on it.

    result   : the profile as the run judged it
    terms    : what it was held against
    missing  : points that are known to be missing; complete : the scan came to its end
    datums   : those that were found of its points, by their features: several characteristics are placed by the same
    """

    result: InspectionResult
    terms: Terms
    missing: Missing
    complete: bool
    datums: dict[DatumFeatures, FoundDatum] = field(default_factory=dict, repr=False)

    @property
    def nominal(self) -> NominalProfile:
        """What the section is held against."""
        return self.terms.nominal

    @property
    def pose(self) -> RigidTransform:
        """Nominal from section, where the run judged its points."""
        return self.result.registration.nominal_from_section

    def guard(self, uncertainty: float) -> float:
        """How far inside or outside its limits a value must lie for that to be proven, by the decision rule of the run."""
        return 0.0 if self.terms.zone.rule == "simple" else uncertainty

    def rows(self, region: Region | None) -> Rows:
        """Rows (k,) of the judged points in a region."""
        judged = self.result.verdicts != NOT_JUDGED
        if region is not None:
            judged &= is_inside(self.result.station_mm, region, self.nominal)
        return np.flatnonzero(judged)

    def drawn(self, rows: Rows) -> Rows:
        """The same rows in such an order; of very many some that are drawn by their coordinates and stand for the others on average."""
        if len(rows) > MANY:
            rows = rows[drawn_rows(self.result.section_at(rows[part]) for part in row_blocks(len(rows)))]
        return self._in_any_order(rows)

    def few(self, rows: Rows) -> Rows:
        """The rows (k,) in an order that does not depend on when they came; of very many those that tell how far all of them go."""
        if len(rows) > MANY:
            rows = rows[telling_rows(self.result.station_mm[rows], self.result.deviation_mm[rows], self.nominal.length_mm, _SHARES)]
        return self._in_any_order(rows)

    def _in_any_order(self, rows: Rows) -> Rows:
        """The rows (k,) in an order that does not depend on when they came."""
        points = self.result.section_at(rows)
        return rows[np.lexsort((points[:, 1], points[:, 0]))]

    def shares(self, rows: Rows) -> Array | None:
        """How much of the profile rows (k,) of a region stand for, at the pose of the run; None where all points count alike.

        The neighbours outside count too, so that the last points of a region do not stand for what lies beyond it.
        """
        if self.terms.weights != "arc-length":
            return None
        station = self.result.station_mm
        weights = np.where(np.isnan(station), 0.0, 1.0)
        weigh_by_station(station, weights, self.nominal)
        return weights[rows]

    def deviations_at(self, rows: Rows, pose: RigidTransform) -> Deviations:
        """Deviations of rows (k,) at a pose."""
        moved = pose.apply(self.result.section_at(rows))
        return deviations(moved, self.nominal, self.terms.method, self.terms.tip_radius_mm)

    def measured(self, region: Region | None) -> Measured:
        """How much of a region was measured, at the pose of the run."""
        if region is None:
            return Measured(self.result.coverage, self.result.gap)
        return measure_region(self.result.station_mm, self.nominal, self.result.gap_max_mm, region.from_mm, region.to_mm)

    def conclude(
        self,
        points: Verdict,
        why: Reason | None,
        measured: Measured,
        judged: int,
        converged: bool = True,
        beyond_end: tuple[float, int] = (0.0, 0),
    ) -> Conclusion:
        """The verdict on a characteristic by the rules of the whole profile, with what was measured of its region.

        points, why : the verdict on the characteristic alone, NONCONFORM only where proven, and its reason
        beyond_end  : how far points lie beyond an end of an open profile at a pose of its own, and how many
        """
        whole = self.result.findings
        beyond_end_mm, beyond_end_count = max((whole.beyond_end_mm, whole.beyond_end_count), beyond_end)
        found = replace(
            whole,
            points=points,
            why=why,
            judged=judged,
            coverage=measured.coverage,
            gap=measured.gap,
            converged=whole.converged and converged,
            beyond_end_mm=beyond_end_mm,
            beyond_end_count=beyond_end_count,
        )
        return conclude(found, self.missing, self.terms.limits, self.complete)


def filter_deviations(d: Deviations, nominal: NominalProfile, wanted: ProfileFilter) -> FilteredProfile:
    """Filtered deviations of points (k,) along the profile, cut at its corners; points beyond an end take no part."""
    raw = np.where(d.beyond_end, np.nan, d.deviation_mm)
    corners = nominal.curve.station_mm(nominal.curve.corners)
    return filter_profile(d.station_mm, raw, nominal.length_mm, nominal.curve.closed, wanted, corners)
