"""Whoever doubts a minimum zone finds every number of its certificate that was changed."""

import json
from copy import deepcopy
from functools import cache
from typing import Any

import pytest

from cmmlink import zone_check
from cmmlink.characteristics_json import characteristic_json
from cmmlink.zone_check import check_zones
from cmmlink.zone_file import zone_document
from inspection import LineProfile
from tests.inspection.evaluation.asked import even, form, named, nominal, points_at, run, stations

CHANGED = {
    "zone_mm": 1e-4,
    "middle_mm": 1e-4,
    "tip_radius_mm": 1e-4,
    "proven": 0,
    "pose.rotation_deg": 1e-3,
    "pose.translation_mm.0": 1e-4,
    "pose.translation_mm.1": 1e-4,
    "active.1.index": 1,
    "active.1.x_mm": 1e-4,
    "active.1.y_mm": 1e-4,
    "active.1.deviation_mm": 1e-4,
    "active.1.station_mm": 0.1,
    "active.1.multiplier": 1e-3,
    "witnesses.0.index": 1,
    "witnesses.0.x_mm": 1e-4,
    "witnesses.0.y_mm": -1e-4,
}


@pytest.fixture
def _coarse_polygon(monkeypatch: pytest.MonkeyPatch) -> None:
    """A twentieth of the samples: fine enough for what is found at the pose, before any box of motions is looked at."""
    monkeypatch.setattr(zone_check, "_SAMPLES", 20_000)


@cache
def document() -> dict[str, Any]:
    asked = LineProfile("contour", even(-0.03, 0.05), fit="minimum-zone")
    found = named(run(points_at(stations(), form(stations())), asked=(asked,)))["contour"]
    written = zone_document({"characteristics": [characteristic_json(found)]}, nominal())
    assert written is not None
    told: dict[str, Any] = json.loads(json.dumps(written))
    return told


def problem_of(told: dict[str, Any]) -> str:
    (check,) = check_zones(told)
    return check.problem


def test_what_was_written_is_verified() -> None:
    assert problem_of(document()) == ""


@pytest.mark.usefixtures("_coarse_polygon")
@pytest.mark.parametrize("key", CHANGED)
def test_a_number_that_was_changed_is_found(key: str) -> None:
    told = deepcopy(document())
    *way, last = [int(part) if part.isdigit() else part for part in key.split(".")]
    at = told["zones"][0]
    for part in way:
        at = at[part]
    at[last] = at[last] + CHANGED[key] if CHANGED[key] else not at[last]
    assert problem_of(told)
    assert "boxes" not in problem_of(told)


@pytest.mark.usefixtures("_coarse_polygon")
def test_points_from_elsewhere_are_no_witnesses() -> None:
    """A point a millimetre off the part refutes every placement, and would prove any zone to be the smallest."""
    told = deepcopy(document())
    told["zones"][0]["witnesses"].append({"index": 9999, "x_mm": 30.0, "y_mm": 40.0})
    assert "witness is not in the zone" in problem_of(told)
    told["zones"][0]["witnesses"] = told["zones"][0]["witnesses"][1:-1]
    assert "none of the witnesses" in problem_of(told)
