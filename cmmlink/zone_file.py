"""zone.json: what a third party needs to check minimum zones and least consumptions, with no more than a routine for the closest point."""

from collections.abc import Mapping
from typing import Any

from inspection import NominalProfile

_OF_BOTH = ("kind", "tip_radius_mm", "pose", "active", "witnesses", "proven")
_STATED = {"minimum-zone": ("zone_mm", "middle_mm", "gap_mm"), "consumption": ("consumption", "bound", "limits")}


def zone_document(result: Mapping[str, Any], profile: NominalProfile) -> dict[str, Any] | None:
    """The minimum zones and the proven least consumptions of a result, as JSON holds it, with their nominal; None where it has none.

    Results of earlier versions do not hold the limits that are consumed, so that nobody can check a consumption of theirs.
    """
    proofs = [(one["name"], one["certificate"]) for one in result.get("characteristics", ()) if one["certificate"] is not None]
    zones = [
        {"name": name, **{key: proof[key] for key in (*_OF_BOTH, *_STATED[proof["kind"]])}}
        for name, proof in proofs
        if proof["kind"] == "minimum-zone" or (proof["proven"] and proof.get("limits") is not None)
    ]
    if not zones:
        return None
    return {"nominal": nominal_document(profile), "zones": zones}


def nominal_document(profile: NominalProfile) -> dict[str, Any]:
    """The curve of a nominal as JSON holds it, exactly, and the side of it on which the material lies."""
    curve = profile.curve
    weights = curve.weights if curve.weights is not None else [1.0] * len(curve.control_points_mm)
    return {
        "degree": curve.degree,
        "knots": [float(knot) for knot in curve.knots],
        "control_points_mm": [[float(x), float(y)] for x, y in curve.control_points_mm],
        "weights": [float(weight) for weight in weights],
        "closed": curve.closed,
        "material": profile.material,
    }
