"""Two recorded runs of one surface compared, place by place of the nominal: what the second deviates from the first.

Places are spread evenly over the nominal, so neither density nor order of the points has a say. At each the deviation of a scan is that of
its nearest points on the same side of the part; a place without points near it was not measured.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from cmmlink.errors import PlanError, RunError
from cmmlink.exports import sound_run
from cmmlink.nominal_files.surface_file import SurfaceFile
from cmmlink.record import RecordedRun, Store, recorded_surface, recorded_surface_plan, unpack_surface
from cmmlink.result_json import number
from cmmlink.surface_rows import SurfaceRows, joined_surface_rows
from cmmlink.words import utc_words
from inspection import NOT_JUDGED

if TYPE_CHECKING:
    from inspection.surface import NominalSurface

Array = NDArray[np.float64]

_PLACES = 20_000
_NEAREST = 4  # points that tell of a place
_SAME_SIDE = 0.5  # cosine of 60 degrees
_TOLD = 10  # places where the two differ most, none of them near another


@dataclass(frozen=True, slots=True, eq=False)
class SurfaceComparison:
    """What two runs of one surface differ by, the second less the first.

    places_mm : (n, 3) of the nominal, each standing for the same area; face : (n,) the number of its face, from 0
    first_mm, second_mm : (n,) the deviations there; NaN where a run has none
    told      : the places where the two differ most, the largest difference first
    """

    first: RecordedRun
    second: RecordedRun
    area_mm2: float
    places_mm: Array
    face: NDArray[np.int32]
    first_mm: Array
    second_mm: Array
    told: tuple[int, ...]

    @property
    def difference_mm(self) -> Array:
        """The second less the first (n,)."""
        return self.second_mm - self.first_mm

    @property
    def notes(self) -> list[str]:
        """How the poses were found."""
        known = [recorded.result is not None and recorded.result["rule"] == "datum" for recorded in (self.first, self.second)]
        told = {
            0: "Each has a fit of its own: what moves or turns a part as a whole is no difference here.",
            1: "One has a fit of its own and the other lies where it was measured: a difference may be one of place or direction.",
            2: "Both lie where they were measured: what moves or turns a part as a whole is part of the difference.",
        }
        return [told[sum(known)]]

    def place(self, index: int) -> dict[str, Any]:
        """What both have at a place."""
        values = {"first_mm": self.first_mm, "second_mm": self.second_mm, "difference_mm": self.difference_mm}
        place = {"place_mm": self.places_mm[index].tolist(), "face": int(self.face[index]) + 1}
        return place | {name: float(column[index]) for name, column in values.items()}

    def to_json(self) -> dict[str, Any]:
        """The comparison with the keys that the command line promises."""
        difference = self.difference_mm[np.isfinite(self.difference_mm)]
        places = [self.place(index) for index in self.told]
        return {
            "first": _run_json(self.first),
            "second": _run_json(self.second),
            "nominal": self.first.header["nominal"],
            "area_mm2": self.area_mm2,
            "compared": len(difference) / len(self.places_mm),
            "largest": places[0],
            "mean_mm": number(float(difference.mean())),
            "rms_mm": number(float(np.sqrt((difference**2).mean()))),
            "places": places,
            "notes": self.notes,
        }


def compare_surfaces(store: Store, runs: Sequence[str]) -> SurfaceComparison:
    """Compare two runs of surfaces. Raises PlanError where their nominals are not the same, RunError where one has no judged points."""
    first, second = (sound_run(store, run) for run in runs)
    plans = [recorded_surface_plan(recorded) for recorded in (first, second)]
    read_so = [plan.surface.model_dump(exclude={"file"}) for plan in plans]
    if first.nominal != second.nominal or read_so[0] != read_so[1]:
        raise PlanError(f"{first.run} and {second.run} have different nominals, {first.header['nominal']} and {second.header['nominal']}")
    file = recorded_surface(plans[0], first)
    places, normals = file.nominal.sample(_PLACES)
    columns = [_at_places(store, recorded, places, normals) for recorded in (first, second)]
    difference = np.abs(columns[1] - columns[0])
    if not np.isfinite(difference).any():
        raise PlanError(f"{first.run} and {second.run} have no place of the surface in common that both measured")
    told = _apart(places, difference, 0.05 * file.nominal.size_mm)
    return SurfaceComparison(first, second, file.nominal.area_mm2, places, _faces(file, places), columns[0], columns[1], told)


def _faces(file: SurfaceFile, places: Array) -> NDArray[np.int32]:
    nominal: NominalSurface = file.nominal
    return nominal.project(places).face


def _at_places(store: Store, recorded: RecordedRun, places: Array, normals: Array) -> Array:
    """The deviations of a run at places of the nominal (n,); NaN where it has no point of that side near enough to count as measured."""
    if recorded.result is None or not recorded.result["judged"]:
        raise RunError(f"run {recorded.run}: it has no judged points to compare")
    rows = joined_surface_rows(unpack_surface(record.body) for record in store.records(recorded.run, "deviations"))
    judged = rows.verdicts != NOT_JUDGED
    return _nearest_deviations(rows, judged, places, normals, recorded.result["gap_max_mm"] / 2)


def _nearest_deviations(rows: SurfaceRows, judged: NDArray[np.bool_], places: Array, normals: Array, reach_mm: float) -> Array:
    """The mean deviation of the nearest points, each counting by one over the square of its distance."""
    feet, outward, deviation = rows.foot_mm[judged], rows.normal[judged].astype(np.float64), rows.deviation_mm[judged]
    found = cKDTree(feet).query(places, k=min(_NEAREST, len(feet)), distance_upper_bound=reach_mm)
    distance, index = (np.asarray(column).reshape(len(places), -1) for column in found)
    there = np.isfinite(distance)
    index = np.where(there, index, 0)
    there &= np.einsum("nki,ni->nk", outward[index], normals) > _SAME_SIDE
    weight = np.where(there, 1.0 / np.maximum(np.where(there, distance, 1.0), 1e-9) ** 2, 0.0)
    total = weight.sum(axis=1)
    with np.errstate(invalid="ignore"):
        return np.asarray(np.where(total > 0, (weight * deviation[index]).sum(axis=1) / np.where(total > 0, total, 1.0), np.nan))


def _apart(places: Array, difference: Array, apart_mm: float) -> tuple[int, ...]:
    """The places of the largest differences, none nearer to another one than that."""
    told: list[int] = []
    for index in np.argsort(-np.nan_to_num(difference, nan=-1.0), kind="stable").tolist():
        if not np.isfinite(difference[index]) or len(told) == _TOLD:
            break
        if all(np.linalg.norm(places[index] - places[other]) > apart_mm for other in told):
            told.append(index)
    return tuple(told)


def _run_json(recorded: RecordedRun) -> dict[str, Any]:
    found, header = recorded.result or {}, recorded.header
    kept = ("judged", "verdict", "fit", "rule", "coverage", "max_deviation_mm", "min_deviation_mm", "rms_mm")
    identity = {"run": recorded.run, "part": header["part"], "serial_number": header["serial_number"] or None}
    return {**identity, "measured_at": utc_words(datetime.fromisoformat(header["started"])), **{key: found[key] for key in kept}}
