"""zone.json: what a third party needs to check the minimum zones of a result, with no more than a routine for the closest point."""

from collections.abc import Mapping
from typing import Any

from inspection import NominalProfile

_STATED = ("zone_mm", "middle_mm", "gap_mm", "tip_radius_mm", "pose", "active", "witnesses", "proven")


def zone_document(result: Mapping[str, Any], profile: NominalProfile) -> dict[str, Any] | None:
    """The minimum zones of a result, as JSON holds it, with the nominal that they are about; None where it has none."""
    zones = [
        {"name": one["name"], **{key: one["certificate"][key] for key in _STATED}}
        for one in result.get("characteristics", ())
        if one["certificate"] is not None and one["certificate"]["kind"] == "minimum-zone"
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
