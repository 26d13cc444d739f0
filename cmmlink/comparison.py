"""Two scans of one profile compared: two recorded runs, two files of points, or a run and the points that another program exported.

Each is at a pose of its own, which is stated: a run at that of its record, a file at the fit that is asked for. What is compared are
deviations from the nominal at equal stations, so the nominal has to be the same curve for both.
"""

import math
import threading
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from datetime import datetime
from typing import Any

import numpy as np

from cmmlink.devices import connect, words_of
from cmmlink.errors import PlanError, RunError, StoreError
from cmmlink.events import RunStarted
from cmmlink.from_plan import inspection_of
from cmmlink.pipeline import run_inspection
from cmmlink.plan import Plan
from cmmlink.record import Store, find_run, recorded_plan, recorded_profile, recorded_run, unpack_judged
from cmmlink.result_json import number, result_json
from cmmlink.scratch import scratch_in
from cmmlink.words import utc_words
from inspection import Course, Difference, NominalProfile, RegistrationError, difference_along

_STRETCHES = 12  # of the profile, of each of which the largest difference is told


@dataclass(frozen=True, slots=True, eq=False)
class ComparedScan:
    """One of two scans: what it is, the result that it was judged with, and the course of its deviations.

    kind        : run or file
    document    : the keys of result.json
    measured_at : in UTC; empty for a file, which does not say
    course      : of the judged points
    """

    kind: str
    name: str
    part: str
    serial_number: str
    measured_at: str
    plan: Plan
    profile: NominalProfile
    document: Mapping[str, Any]
    course: Course
    notes: tuple[str, ...] = ()

    @property
    def words(self) -> str:
        """The scan in a few words."""
        return ", ".join(filter(None, [f"{self.kind} {self.name}", " ".join(filter(None, [self.part, self.serial_number]))]))

    @property
    def pose_words(self) -> str:
        """How it came onto the nominal, and where that left it."""
        pose = self.document["registration"]
        x, y = pose["translation_mm"]
        return (
            f"fit {self.document['fit']}, target {self.document['target_mm']:g} mm: "
            f"turned {pose['rotation_deg']:.4f} deg, moved ({x:.4f}, {y:.4f}) mm"
        )


@dataclass(frozen=True, slots=True, eq=False)
class Comparison:
    """What two scans of one profile differ by, the second less the first.

    limits_mm : the lower and the upper limit that are drawn; None where nobody stated any
    """

    first: ComparedScan
    second: ComparedScan
    difference: Difference
    limits_mm: tuple[float, float] | None

    @property
    def profile(self) -> NominalProfile:
        """The nominal of both."""
        return self.first.profile

    @property
    def notes(self) -> list[str]:
        """What the reader has to know: how the poses were found, and what else is not the same for both."""
        first, second = self.first.document, self.second.document
        fitted = [found["fit"] != "none" for found in (first, second)]
        told = {
            2: "Each has a fit of its own: what moves or turns a part as a whole is no difference here.",
            1: "One has a fit of its own and the other lies where it was measured: a difference may be one of place or direction.",
            0: "Both lie where they were measured: what moves or turns a part as a whole is part of the difference.",
        }
        found = [told[sum(fitted)]]
        if all(fitted) and first["target_mm"] != second["target_mm"]:
            found.append(f"The fits have different targets: {first['target_mm']:g} and {second['target_mm']:g} mm.")
        if any(one["registration"].get("other_poses") for one in (first, second)):
            found.append("The part fits in other poses as well, so that one station may be another place of the part in each scan.")
        if first["method"] != second["method"]:
            found.append(f"Deviations were found by different methods: {first['method']} and {second['method']}.")
        return [*found, *self.first.notes, *self.second.notes]

    def place(self, index: int | None) -> dict[str, float | None] | None:
        """What stands at an index of the difference, with the place of the nominal there."""
        if index is None:
            return None
        found, profile = self.difference, self.profile
        station = float(found.station_mm[index])
        around = [
            (np.append(axis, axis[0]), np.append(profile.station_mm, profile.length_mm))
            if profile.curve.closed
            else (axis, profile.station_mm)
            for axis in profile.points_mm.T
        ]
        x, y = (float(np.interp(station, stations, values)) for values, stations in around)
        columns = {"first_mm": found.first_mm, "second_mm": found.second_mm, "difference_mm": found.difference_mm}
        return {"station_mm": station, "x_mm": x, "y_mm": y} | {name: number(float(column[index])) for name, column in columns.items()}

    def stretches(self) -> list[dict[str, Any]]:
        """The largest difference in each of equal stretches along the profile; None where a stretch was not measured by both."""
        found, length = self.difference, self.profile.length_mm
        rows = []
        for first, end in zip(*(np.linspace(0, length, _STRETCHES + 1)[part] for part in (slice(-1), slice(1, None))), strict=True):
            inside = np.flatnonzero((found.station_mm >= first) & (found.station_mm <= end) & np.isfinite(found.difference_mm))
            at = int(inside[np.abs(found.difference_mm[inside]).argmax()]) if len(inside) else None
            rows.append({"from_mm": float(first), "to_mm": float(end), "largest": self.place(at)})
        return rows

    def to_json(self) -> dict[str, Any]:
        """The comparison as `compare --json` prints it."""
        return {
            "first": _scan_json(self.first),
            "second": _scan_json(self.second),
            "nominal": self.first.plan.nominal.file.name,
            "length_mm": self.profile.length_mm,
            "compared": self.difference.compared,
            "largest": self.place(self.difference.largest),
            "mean_mm": number(self.difference.mean_mm),
            "rms_mm": number(self.difference.rms_mm),
            "stretches": self.stretches(),
            "notes": self.notes,
        }


def compare_scans(first: ComparedScan, second: ComparedScan, limits_mm: tuple[float, float] | None = None) -> Comparison:
    """Compare two scans. Raises PlanError where their nominals are not the same curve, or no place was measured by both."""
    if not _is_same_curve(first.profile, second.profile):
        files = [f"{one.plan.nominal.file.name} ({one.profile.length_mm:.4f} mm long)" for one in (first, second)]
        raise PlanError(f"{first.name} and {second.name} have different nominals, {files[0]} and {files[1]}: their stations do not match")
    profile, tolerance = first.profile, first.document["tolerance"]
    found = difference_along(first.course, second.course, profile.length_mm, profile.curve.closed)
    if found.largest is None:
        raise PlanError(f"{first.name} and {second.name} have no place of the profile in common that both measured")
    if limits_mm is None and "run" in (first.kind, second.kind):
        limits_mm = tolerance["lower_mm"], tolerance["upper_mm"]
    return Comparison(first, second, found, limits_mm)


def scan_of_run(store: Store, name: str) -> ComparedScan:
    """A recorded run as it was judged. Raises RunError where there is none of that name or it gave no result, StoreError."""
    run = find_run(store, name)
    altered, _, _ = store.first_alteration(run)
    if altered is not None:
        raise StoreError(f"{store.path}: {altered}; what was altered is not compared")
    recorded = recorded_run(store, run)
    plan, found = recorded_plan(recorded), recorded.result
    if found is None or found.get("rule") is None or not found["judged"]:
        raise RunError(f"run {run}: it has no judged points to compare")
    profile = recorded_profile(plan, recorded)
    blocks = [unpack_judged(record.body) for record in store.records(run, "deviations")]
    station, deviation = (np.concatenate([getattr(rows, column) for rows in blocks]) for column in ("station_mm", "deviation_mm"))
    judged = np.isfinite(deviation)
    header = recorded.header
    return ComparedScan(
        "run",
        run,
        header["part"],
        header["serial_number"],
        utc_words(datetime.fromisoformat(header["started"])),
        plan,
        profile,
        found,
        Course(station[judged], deviation[judged], found["largest_gap"]["allowed_mm"]),
    )


def scan_of_file(plan: Plan, profile: NominalProfile, clock: Callable[[], float]) -> ComparedScan:
    """The points of a file, fitted and judged here as a plan says, whose nominal `profile` is.

    Raises PlanError, PointFileError for what cannot be used, RegistrationError where the points do not fit the nominal.
    """
    scratch = scratch_in(None)
    with connect(plan, scratch) as device:
        live = inspection_of(plan, profile, scratch, provisional=False)
        started = RunStarted(plan.part.name, "", "", words_of(plan.device), simulated=False)
        outcome = run_inspection(device.source, live, [], started, buffer_points=plan.buffer_points, clock=clock, stop=threading.Event())
    if outcome.refusal is not None:
        raise type(outcome.refusal)(f"{plan.part.name}: {outcome.refusal}")
    if outcome.failure is not None:
        raise outcome.failure
    result = outcome.result
    if result is None or not result.judged:
        raise RegistrationError(f"{plan.part.name}: none of its points could be judged")
    judged = np.isfinite(result.deviation_mm)
    course = Course(result.station_mm[judged], result.deviation_mm[judged], result.gap_max_mm)
    return ComparedScan("file", plan.part.name, "", "", "", plan, profile, result_json(result, outcome.counts), course, tuple(device.notes))


def _is_same_curve(first: NominalProfile, second: NominalProfile) -> bool:
    """Whether two nominals are one curve, to the last bit, with the material on the same side."""
    one, other = first.curve, second.curve
    arrays = [(one.control_points_mm, other.control_points_mm), (one.knots, other.knots), (one.weights, other.weights)]
    plain = (one.degree, one.closed, first.outward) == (other.degree, other.closed, second.outward)
    return plain and all(a is b or (a is not None and b is not None and np.array_equal(a, b)) for a, b in arrays)


def _scan_json(scan: ComparedScan) -> dict[str, Any]:
    found = scan.document
    kept = ("judged", "fit", "rule", "target_mm", "method", "coverage", "max_deviation_mm", "min_deviation_mm", "rms_mm")
    pose = found["registration"]
    return {
        "kind": scan.kind,
        "name": scan.name,
        "part": scan.part or None,
        "serial_number": scan.serial_number or None,
        "measured_at": scan.measured_at or None,
        "verdict": found["verdict"] if scan.kind == "run" else None,
        **{key: found[key] for key in kept},
        "rotation_deg": pose["rotation_deg"],
        "translation_mm": pose["translation_mm"],
    }


def largest_words(comparison: Comparison) -> str:
    """The largest difference and where it is, in a sentence."""
    found = comparison.place(comparison.difference.largest)
    assert found is not None
    told = {name: math.nan if value is None else value for name, value in found.items()}
    return (
        f"largest difference {told['difference_mm']:+.4f} mm at station {told['station_mm']:.2f} mm "
        f"(x {told['x_mm']:.3f}, y {told['y_mm']:.3f} mm): {told['first_mm']:+.4f} and {told['second_mm']:+.4f} mm"
    )
