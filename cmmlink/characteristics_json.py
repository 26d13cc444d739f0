"""The characteristics of a result as `--json` and result.json hold them: stable keys, numbers or null."""

import math
from typing import TYPE_CHECKING, Any

from inspection import ZoneCertificate

if TYPE_CHECKING:
    from inspection import CharacteristicResult, ConsumptionCertificate, FoundDatum, RigidTransform, VaryingZone, WorstPlace


def characteristic_json(found: "CharacteristicResult") -> dict[str, Any]:
    """One characteristic with everything that its value depends on."""
    return {
        "name": found.name,
        "type": found.type,
        "method": found.method,
        "value": number(found.value),
        "nominal": number(found.nominal),
        "unit": found.unit,
        "lower": number(found.lower),
        "upper": number(found.upper),
        "deviation": number(found.deviation),
        "consumption": number(found.consumption),
        "uncertainty": found.uncertainty,
        "rule": found.rule,
        "verdict": found.verdict.word,
        "reasons": [{"kind": reason.kind, "words": reason.words} for reason in found.reasons],
        "worst": None if found.worst is None else _worst(found.worst),
        "fit": found.fit,
        "filter": found.filter,
        "weights": found.weights,
        "region": None if found.region is None else {"from_mm": found.region.from_mm, "to_mm": found.region.to_mm},
        "region_words": found.region_words,
        "zone": found.zone_words,
        "pose": None if found.pose is None else pose_json(found.pose),
        "coverage": number(found.coverage),
        "largest_gap_mm": number(found.gap_mm),
        "datum": None if found.datum is None else _datum(found.datum),
        "places": [{"name": name, "x_mm": x, "y_mm": y} for name, x, y in found.places_mm],
        "notes": list(found.notes),
        "certificate": certificate_json(found.certificate),
    }


def certificate_json(proof: "ZoneCertificate | ConsumptionCertificate | None") -> dict[str, Any] | None:
    """What proves a minimum zone or a least consumption; the points have the numbers of their rows in deviations.csv."""
    if proof is None:
        return None
    of_zone = isinstance(proof, ZoneCertificate)
    fit = proof if isinstance(proof, ZoneCertificate) else proof.fit
    off = proof.active_deviation_mm.tolist() if isinstance(proof, ZoneCertificate) else [None] * len(fit.active)
    columns = (fit.active.tolist(), proof.active_place_mm.tolist(), off, fit.active_station_mm.tolist(), fit.multipliers.tolist())
    held = zip(*columns, strict=True)
    seen = zip(proof.witnesses.tolist(), proof.witness_place_mm.tolist(), strict=True)
    return {
        "kind": "minimum-zone" if of_zone else "consumption",
        "zone_mm": proof.zone_mm if isinstance(proof, ZoneCertificate) else None,
        "middle_mm": proof.middle_mm if isinstance(proof, ZoneCertificate) else None,
        "consumption": None if isinstance(proof, ZoneCertificate) else proof.fit.consumption,
        "bound": proof.zone_mm / 2 - proof.gap_mm if isinstance(proof, ZoneCertificate) else proof.bound,
        "gap_mm": proof.gap_mm if isinstance(proof, ZoneCertificate) else None,
        "tip_radius_mm": proof.tip_radius_mm,
        "limits": None if isinstance(proof, ZoneCertificate) else _limits(proof.zone),
        "pose": pose_json(fit.nominal_from_section),
        "active": [
            {"index": row, "x_mm": x, "y_mm": y, "deviation_mm": e, "station_mm": s, "multiplier": share}
            for row, (x, y), e, s, share in held
        ],
        "imbalance": number(proof.imbalance) if isinstance(proof, ZoneCertificate) else None,
        "proven": proof.proven,
        "witnesses": [{"index": row, "x_mm": x, "y_mm": y} for row, (x, y) in seen],
        "boxes": proof.boxes,
        "finest_mm": number(proof.finest_mm),
        "words": proof.words,
    }


def _limits(zone: "VaryingZone") -> dict[str, Any]:
    """Limits that vary along the profile."""
    columns = {"station_mm": zone.station_mm, "lower_mm": zone.lower_mm, "upper_mm": zone.upper_mm}
    return {name: values.tolist() for name, values in columns.items()} | {"between": zone.between, "border_mm": zone.border_mm}


def _datum(datum: "FoundDatum") -> list[dict[str, Any]]:
    """The features that a part was placed by."""
    return [
        {
            "kind": seen.feature.kind,
            "words": seen.feature.words,
            "from_mm": seen.feature.from_mm,
            "to_mm": seen.feature.to_mm,
            "points": seen.points,
            "rms_mm": seen.rms_mm,
            "largest_gap_mm": seen.gap_mm,
        }
        for seen in datum.seen
    ]


def pose_json(pose: "RigidTransform") -> dict[str, Any]:
    """A motion from section to nominal coordinates."""
    return {"rotation_deg": math.degrees(pose.rotation_rad), "translation_mm": [float(value) for value in pose.translation_mm]}


def _worst(worst: "WorstPlace") -> dict[str, float]:
    return {"station_mm": worst.station_mm, "x_mm": worst.x_mm, "y_mm": worst.y_mm, "deviation_mm": worst.deviation_mm}


def number(value: float) -> float | None:
    """A number, or null where it is infinite or none."""
    return float(value) if math.isfinite(value) else None
