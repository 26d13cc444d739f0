"""The result as the JSON object of `--json` and `result.json`: stable keys, numbers or null."""

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from cmmlink.characteristics_json import characteristic_json
from cmmlink.events import Counts, RunStarted
from cmmlink.uncertainty_tables import uncertainty_json
from cmmlink.version import RESULT_SCHEMA
from inspection import Verdict

if TYPE_CHECKING:
    from inspection import InspectionResult, Registration

_PLACES = 50  # of the profile, whose numbers of points are compared
_DENSER = 10.0
_AT_ONCE = 1 << 16  # points looked at together
_SHARE_OF_A_PLACE = 0.05  # of the points: fewer move no fit


def result_json(result: "InspectionResult | None", counts: Counts) -> dict[str, Any]:
    """The result with the keys that the command line promises. Without a result: the counts, the verdict uncertain, and nulls."""
    head = {"received": counts.received, "judged": counts.judged, "rejected": counts.rejected, "lost": counts.lost}
    tail = {"rejected_by_reason": dict(counts.rejected_by_reason), "damaged_bytes": counts.damaged_bytes}
    if result is None:
        return {"verdict": Verdict.UNCERTAIN.word, **head, **_NOTHING, **tail}
    return {
        "verdict": result.verdict.word,
        **head,
        "out_of_tolerance": result.out_of_tolerance,
        "max_deviation_mm": number(result.max_deviation_mm),
        "min_deviation_mm": number(result.min_deviation_mm),
        "rms_mm": number(result.rms_mm),
        "profile_error_mm": number(result.profile_error_mm),
        "zone_error_mm": number(result.zone_error_mm),
        "best_fit_error_mm": number(result.best_fit_error_mm),
        "minimum_zone_mm": number(result.minimum_zone_mm),
        "worst": _worst(result),
        "reasons": [{"kind": reason.kind, "words": reason.words} for reason in result.reasons],
        "rule": result.rule,
        "fit": result.fit,
        "target_mm": result.zone.middle_mm,
        "weights": result.weights,
        "method": result.method,
        "registration": _registration(result.registration),
        "stretches": [{"from_mm": s.from_mm, "to_mm": s.to_mm, "worst_mm": s.worst_mm} for s in result.stretches],
        "coverage": result.coverage,
        "largest_gap_mm": result.gap.length_mm,
        "largest_gap": _gap(result),
        "complete": result.complete,
        "tolerance": {
            "lower_mm": result.zone.lower_mm,
            "upper_mm": result.zone.upper_mm,
            "uncertainty_mm": result.zone.uncertainty_mm,
            "decision_rule": result.zone.decision_rule,
        },
        "characteristics": [characteristic_json(found) for found in result.characteristics],
        "uncertainty": uncertainty_json(result),
        **tail,
    }


def density_of(stations_mm: Iterable[NDArray[np.float64]], length_mm: float) -> NDArray[np.int64]:
    """How many points lie in each of fifty places of the profile, of stations that come piece by piece; NaN where none was judged."""
    counts = np.zeros(_PLACES, dtype=np.int64)
    for station in stations_mm:
        counts += np.histogram(station[np.isfinite(station)], bins=_PLACES, range=(0.0, length_mm))[0]
    return counts


def stations_of(result: "InspectionResult | None") -> Iterator[NDArray[np.float64]]:
    """The stations of a result, piece by piece."""
    for first in range(0, result.received if result is not None else 0, _AT_ONCE):
        assert result is not None
        yield result.station_mm[first : first + _AT_ONCE]


def density_notes(counts: NDArray[np.int64], length_mm: float) -> list[str]:
    """A reservation where the points lie far denser in one place of the profile than in others, for a fit by points follows them."""
    judged = int(counts.sum())
    if not judged:
        return []
    densest, sparse = int(counts.max()), float(np.quantile(counts[counts > 0], 0.1))
    if densest < _SHARE_OF_A_PLACE * judged or densest <= _DENSER * sparse:
        return []
    at = int(counts.argmax()) * length_mm / _PLACES
    return [
        f"the points lie {densest / sparse:.0f} times as dense at station {at:.1f} .. {at + length_mm / _PLACES:.1f} mm as elsewhere: "
        "with weights by points a fit follows them"
    ]


def run_document(
    found: Mapping[str, Any], started: RunStarted, notes: Sequence[str], ending: str, measured_at: str, evidence: Mapping[str, Any]
) -> dict[str, Any]:
    """What result.json says of a run, whether it has just ended or is on record.

    found    : the result, as `result_json` gives it
    evidence : what ties it to its record; nothing where nothing was recorded
    """
    told = {"notes": list(notes), "ending": ending, "measured_at": measured_at}
    return {"schema": RESULT_SCHEMA, **found, **identity_json(started), **told, **evidence}


def identity_json(started: RunStarted) -> dict[str, Any]:
    """What was measured, by whom and with what: the further keys of a run."""
    return {
        "part": started.part,
        "serial_number": started.serial_number or None,
        "operator": started.operator or None,
        "device": started.device,
        "simulated": started.simulated,
        "qualification": None if started.qualification is None else dict(started.qualification),
        "notes": list(started.notes),
    }


_NOTHING: Mapping[str, Any] = {
    "out_of_tolerance": 0,
    "max_deviation_mm": None,
    "min_deviation_mm": None,
    "rms_mm": None,
    "profile_error_mm": None,
    "zone_error_mm": None,
    "best_fit_error_mm": None,
    "minimum_zone_mm": None,
    "worst": None,
    "reasons": [],
    "rule": None,
    "fit": None,
    "target_mm": None,
    "weights": None,
    "method": None,
    "registration": None,
    "stretches": [],
    "coverage": 0.0,
    "largest_gap_mm": None,
    "largest_gap": None,
    "complete": False,
    "tolerance": None,
    "characteristics": [],
    "uncertainty": None,
}


def number(value: float) -> float | None:
    """A number as JSON can hold it: None when it is not finite."""
    return float(value) if math.isfinite(value) else None


def _gap(result: "InspectionResult") -> dict[str, float]:
    gap = result.gap
    return {"from_mm": gap.from_mm, "to_mm": gap.to_mm, "allowed_mm": result.gap_max_mm, "could_hide_mm": gap.could_hide_mm}


def _worst(result: "InspectionResult") -> dict[str, float] | None:
    worst = result.worst_row
    if worst is None:
        return None
    return {
        "station_mm": float(worst.station_mm[0]),
        "x_mm": float(worst.actual_mm[0, 0]),
        "y_mm": float(worst.actual_mm[0, 1]),
        "deviation_mm": float(worst.deviation_mm[0]),
    }


def _registration(registration: "Registration") -> dict[str, Any]:
    pose = registration.nominal_from_section
    return {
        "rotation_deg": math.degrees(pose.rotation_rad),
        "translation_mm": [float(value) for value in pose.translation_mm],
        "iterations": registration.iterations,
        "converged": registration.converged,
        "other_poses": [
            {"rotation_deg": math.degrees(rival.rotation_rad), "translation_mm": [float(value) for value in rival.translation_mm]}
            for rival in registration.rivals
        ],
    }
