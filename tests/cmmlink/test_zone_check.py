"""Whoever doubts a minimum zone finds every number of its certificate that was changed."""

import json
from copy import deepcopy
from functools import cache
from typing import Any

import numpy as np
import pytest

from cmmlink import zone_check
from cmmlink.characteristics_json import characteristic_json
from cmmlink.zone_check import check_zones
from cmmlink.zone_file import zone_document
from cmmlink.zone_limits import LoosestLimits, StatedLimits
from inspection import LineProfile, Transition, VaryingZone
from tests.inspection.evaluation.asked import even, form, named, nominal, points_at, run, stations, stepped

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


CHANGED_CONSUMPTION = {key: by for key, by in CHANGED.items() if key not in ("zone_mm", "middle_mm", "active.1.deviation_mm")} | {
    "consumption": 0.01,
    "bound": 0.1,
    "active.1.multiplier": 0.02,
    "limits.lower_mm.0": 0.001,
    "limits.upper_mm.3": -0.001,
    "limits.station_mm.0": 300.0,
    "limits.border_mm": -1.0,
}

ENOUGH = 20_000  # boxes


def change(at: Any, key: str, by: float) -> None:
    """Add to a number of a document, or turn what is true or false around."""
    *way, last = [int(part) if part.isdigit() else part for part in key.split(".")]
    for part in way:
        at = at[part]
    at[last] = at[last] + by if by else not at[last]


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


@cache
def consumed(between: Transition, tip_radius_mm: float = 0.0) -> dict[str, Any]:
    """A least consumption with its limits, which `between` lets run; with steps, at the nose and on a flank."""
    length, asked = nominal().length_mm, stepped(0.2) if between == "constant" else varying(between)
    points = points_at(stations(), form(stations()) + tip_radius_mm)
    settings: dict[str, Any] = {"tip_radius_mm": tip_radius_mm} if tip_radius_mm else {}
    found = named(run(points, asked=(LineProfile("varying", asked, fit="tolerance"),), **settings))["varying"]
    assert found.certificate is not None
    assert found.certificate.proven, length
    written = zone_document({"characteristics": [characteristic_json(found)]}, nominal())
    told: dict[str, Any] = json.loads(json.dumps(written))
    return told


def varying(between: Transition) -> VaryingZone:
    length = nominal().length_mm
    lower, upper = np.array([-0.03, -0.05, -0.03, -0.03]), np.array([0.03, 0.03, 0.05, 0.03])
    return VaryingZone(np.array([0.0, 0.2, 0.5, 0.8]) * length, lower, upper, length, True, between)


@pytest.mark.parametrize(("between", "tip_radius_mm"), [("linear", 0.0), ("smooth", 0.5), ("constant", 0.0)])
def test_a_least_consumption_that_was_written_is_verified(between: Transition, tip_radius_mm: float) -> None:
    (check,) = check_zones(consumed(between, tip_radius_mm))
    assert check.problem == ""
    assert "verified: least consumption 0." in check.words
    assert 100 < check.boxes < ENOUGH


@pytest.mark.usefixtures("_coarse_polygon")
@pytest.mark.parametrize("key", CHANGED_CONSUMPTION)
def test_a_number_of_a_consumption_that_was_changed_is_found(key: str) -> None:
    told = deepcopy(consumed("linear"))
    change(told["zones"][0], key, CHANGED_CONSUMPTION[key])
    assert problem_of(told)
    assert "boxes" not in problem_of(told)


def test_a_share_that_some_placement_keeps_is_not_refuted(monkeypatch: pytest.MonkeyPatch) -> None:
    """Just above what the points consume at their best, in as many boxes as show all that was written to be so."""
    monkeypatch.setattr(zone_check, "_MOST_BOXES", ENOUGH)
    (zone,), curve = consumed("linear")["zones"], zone_check._Polygon(consumed("linear")["nominal"])
    limits = StatedLimits.of(zone["limits"], curve.length, closed=True)
    loosest = LoosestLimits(curve.places, curve.station, limits, zone["consumption"] + 1e-4)
    assert not zone_check._refute(zone_check._places(zone["witnesses"]), curve, loosest.near, loosest.farthest)[1]


def test_limits_near_a_place_are_no_stricter_than_any_within_the_radius() -> None:
    turn = np.linspace(0.0, 2 * np.pi, 4001)[:-1]
    places = np.column_stack([10 * np.cos(turn), 3 * np.sin(turn)])
    step = np.hypot(*(np.roll(places, -1, axis=0) - places).T)
    station, length = np.concatenate([[0.0], np.cumsum(step)])[:-1], float(step.sum())
    limits = StatedLimits(np.array([5.0, 20.0, 20.0]), -np.array([1.0, 2, 4]), np.array([3.0, 1, 2]), "smooth", 0.0, length, True)
    loosest, rng = LoosestLimits(places, station, limits, 0.7), np.random.default_rng(4)
    where, radius = rng.uniform(-11, 11, (300, 2)), 10.0 ** rng.uniform(-3, 1.2, 300)
    where[::2] = places[rng.integers(0, 4000, 150)]
    lower, upper = loosest.near(where, radius)
    low, high = limits.of_share(station, 0.7)
    for k in range(300):
        inside = np.hypot(*(places - where[k]).T) <= radius[k]
        if inside.any():
            wide = np.hypot(*(places - where[k]).T) <= 6 * radius[k] + 0.2
            assert low[wide].min() - 1e-3 <= lower[k] <= low[inside].min()
            assert high[inside].max() <= upper[k] <= high[wide].max() + 1e-3


def problem_of(told: dict[str, Any]) -> str:
    (check,) = check_zones(told)
    return check.problem


def test_what_was_written_is_verified() -> None:
    assert problem_of(document()) == ""


@pytest.mark.usefixtures("_coarse_polygon")
@pytest.mark.parametrize("key", CHANGED)
def test_a_number_that_was_changed_is_found(key: str) -> None:
    told = deepcopy(document())
    change(told["zones"][0], key, CHANGED[key])
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
