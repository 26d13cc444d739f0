"""Results that earlier versions recorded, with the keys of today.

What an earlier version did not say follows from how it judged: by points at their best fit or at the known pose, with the nominal as the
target, in one zone for the whole profile. What it did not find is null.
"""

from collections.abc import Mapping
from typing import Any

from cmmlink.events import Counts
from cmmlink.result_json import result_json
from inspection import ToleranceZone

_ADDED: Mapping[str, Any] = {"datum": None}  # to characteristics, since they were first recorded


def with_keys_of_today(recorded: Mapping[str, Any]) -> dict[str, Any]:
    """The document of a recorded result with every key that one of today has; what it says itself is left as it is."""
    implied = {} if "rule" in recorded else _implied(recorded)
    document = {**result_json(None, Counts()), **implied, **recorded}
    document["tolerance"] = {"decision_rule": _decision(recorded["tolerance"]), **recorded["tolerance"]}
    found = recorded.get("characteristics") or [_profile(document)]
    document["characteristics"] = [{**_ADDED, **one} for one in found]
    return document


def earlier_notes(recorded: Mapping[str, Any]) -> list[str]:
    """The reservation about a result that was judged by other rules than those of today."""
    if not recorded or "rule" in recorded:
        return []
    how = "at one pose and without looking for gaps"
    return [f"judged by an earlier version of cmmlink, {how}; `cmmlink replay` judges it by the rules of today"]


def _implied(recorded: Mapping[str, Any]) -> dict[str, Any]:
    lower, upper = recorded["tolerance"]["lower_mm"], recorded["tolerance"]["upper_mm"]
    middle, most, least = (lower + upper) / 2, recorded["max_deviation_mm"], recorded["min_deviation_mm"]
    error = None if most is None or least is None else 2 * max(most - middle, middle - least)
    known = recorded["fit"] == "none"
    return {
        "zone_error_mm": error,
        "best_fit_error_mm": None if known else error,
        "rule": "datum" if known else "best-fit",
        "target_mm": 0.0,
        "weights": "points",
    }


def _decision(tolerance: Mapping[str, Any]) -> str:
    limits = tolerance["lower_mm"], tolerance["upper_mm"], tolerance["uncertainty_mm"]
    return ToleranceZone(*limits, provable=False).decision_rule


def _profile(document: Mapping[str, Any]) -> dict[str, Any]:
    """The one characteristic that there was: the tolerance of the plan around the whole profile."""
    zone, worst, error, pose = (document[key] for key in ("tolerance", "worst", "zone_error_mm", "registration"))
    width = zone["upper_mm"] - zone["lower_mm"]
    return {
        "name": "profile",
        "type": "line-profile",
        "method": document["method"],
        "value": error,
        "nominal": None,
        "unit": "mm",
        "lower": zone["lower_mm"],
        "upper": zone["upper_mm"],
        "deviation": worst and worst["deviation_mm"],
        "consumption": None if error is None else error / width,
        "uncertainty": zone["uncertainty_mm"],
        "rule": f"{document['rule']}; {zone['decision_rule']}",
        "verdict": document["verdict"],
        "reasons": document["reasons"],
        "worst": worst,
        "fit": document["fit"],
        "filter": "none",
        "weights": document["weights"],
        "region": None,
        "region_words": "whole profile",
        "zone": f"{zone['lower_mm']:+g} .. {zone['upper_mm']:+g} mm",
        "pose": pose and {key: pose[key] for key in ("rotation_deg", "translation_mm")},
        "coverage": document["coverage"],
        "largest_gap_mm": document["largest_gap_mm"],
        "places": [],
        "notes": [],
        "certificate": None,
    }
