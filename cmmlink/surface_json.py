"""The result of a surface as the JSON object of `--json` and `result.json`: the keys of a section where they mean the same."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from cmmlink.events import Counts
from cmmlink.result_json import number
from inspection import Rejection, Verdict

if TYPE_CHECKING:
    from inspection.surface import Defect, RigidMotion, SurfaceRegistration, SurfaceResult, Unmeasured


@dataclass(frozen=True, slots=True)
class NominalWords:
    """What is said of a nominal surface: what kind it is, of how many pieces, and how far it may lie off what it stands for.

    kind  : patches, triangles or cloud
    faces : of CAD files; None of others. triangles : of a mesh, or of trimmed faces; None of others
    """

    kind: str
    source_format: str
    faces: int | None
    triangles: int | None
    error_mm: float
    area_mm2: float

    def to_json(self) -> dict[str, Any]:
        """The same with the keys of results."""
        return {
            "kind": self.kind,
            "source_format": self.source_format,
            "faces": self.faces,
            "triangles": self.triangles,
            "error_mm": self.error_mm,
            "area_mm2": self.area_mm2,
        }


def surface_json(result: "SurfaceResult | None", counts: Counts, nominal: NominalWords | None) -> dict[str, Any]:
    """The result with the keys that the command line promises. Without a result: the counts, the verdict uncertain, and nulls."""
    head = {"received": counts.received, "judged": counts.judged, "rejected": counts.rejected, "lost": counts.lost}
    tail = {
        "nominal": None if nominal is None else nominal.to_json(),
        "rejected_by_reason": dict(counts.rejected_by_reason),
        "damaged_bytes": counts.damaged_bytes,
    }
    if result is None:
        return {"verdict": Verdict.UNCERTAIN.word, **head, **_NOTHING, **tail}
    zone = result.zone
    return {
        "verdict": result.verdict.word,
        **head,
        "out_of_tolerance": result.out_of_tolerance,
        "max_deviation_mm": number(result.max_deviation_mm),
        "min_deviation_mm": number(result.min_deviation_mm),
        "rms_mm": number(result.rms_mm),
        "profile_error_mm": number(result.profile_error_mm),
        "zone_error_mm": number(result.zone_error_mm),
        "worst": _worst(result),
        "reasons": [{"kind": reason.kind, "words": reason.words} for reason in result.reasons],
        "assumed": list(result.notes),
        "rule": result.rule,
        "fit": result.fit,
        "target_mm": zone.middle_mm,
        "registration": _registration(result.registration, result.nominal_from_scan),
        "regions": [_region(region) for region in result.regions],
        "coverage": result.coverage,
        "area_covered": result.coverage,
        "unmeasured": [_unmeasured(place) for place in result.unmeasured],
        "widest_gap_mm": number(result.gap_mm),
        "gap_max_mm": result.gap_max_mm,
        "beyond_edge": result.rejected_by_reason.get(Rejection.BEYOND_EDGE.words, 0),
        "beyond_edge_mm": number(result.beyond_edge_mm),
        "complete": result.complete,
        "tolerance": {
            "lower_mm": zone.lower_mm,
            "upper_mm": zone.upper_mm,
            "uncertainty_mm": zone.uncertainty_mm,
            "decision_rule": zone.decision_rule,
        },
        **tail,
    }


_NOTHING: Mapping[str, Any] = {
    "out_of_tolerance": 0,
    "max_deviation_mm": None,
    "min_deviation_mm": None,
    "rms_mm": None,
    "profile_error_mm": None,
    "zone_error_mm": None,
    "worst": None,
    "reasons": [],
    "assumed": [],
    "rule": None,
    "fit": None,
    "target_mm": None,
    "registration": None,
    "regions": [],
    "coverage": 0.0,
    "area_covered": 0.0,
    "unmeasured": [],
    "widest_gap_mm": None,
    "gap_max_mm": None,
    "beyond_edge": 0,
    "beyond_edge_mm": None,
    "complete": False,
    "tolerance": None,
}


def _worst(result: "SurfaceResult") -> dict[str, Any] | None:
    at = result.worst
    if at is None:
        return None
    x, y, z = result.nominal_from_scan.apply(result.points_mm[at : at + 1])[0].tolist()
    foot = result.feet.foot_mm[at].tolist()
    return {
        "x_mm": x,
        "y_mm": y,
        "z_mm": z,
        "foot_mm": foot,
        "deviation_mm": float(result.feet.distance_mm[at]),
        "face": int(result.feet.face[at]) + 1,
    }


def _region(region: "Defect") -> dict[str, Any]:
    return {
        "area_mm2": region.area_mm2,
        "worst_mm": region.worst_mm,
        "worst_at_mm": list(region.worst_at_mm),
        "centre_mm": list(region.centre_mm),
        "face": region.face + 1,
        "points": region.points,
    }


def _unmeasured(place: "Unmeasured") -> dict[str, Any]:
    return {"area_mm2": place.area_mm2, "centre_mm": list(place.centre_mm), "face": place.face + 1, "width_mm": place.width_mm}


def _registration(registration: "SurfaceRegistration | None", pose: "RigidMotion") -> dict[str, Any]:
    """The pose that points were judged at; where it was known, nothing was fitted and nothing is weak."""
    found = {
        "rotation": pose.rotation.tolist(),
        "translation_mm": pose.translation_mm.tolist(),
        "rotation_deg": float(np.degrees(pose.angle_rad)),
    }
    if registration is None:
        fitted: dict[str, Any] = {"steps": 0, "converged": True, "settles_within_mm": 0.0, "rms_mm": None, "rivals": 0}
        return found | fitted | {"weakest_direction": None, "weakest_95_mm": None, "undetermined": 0}
    weakest = registration.weakest
    return found | {
        "steps": registration.steps,
        "converged": registration.converged,
        "settles_within_mm": number(registration.settles_within_mm),
        "rms_mm": number(registration.rms_mm),
        "rivals": registration.rivals,
        "weakest_direction": weakest.words or None,
        "weakest_95_mm": number(weakest.shift_95_mm),
        "undetermined": weakest.undetermined,
    }
