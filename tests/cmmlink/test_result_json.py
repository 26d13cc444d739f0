"""The result as JSON: its keys, and that it says what was put in."""

import json

import numpy as np
import pytest

from cmmlink.events import Counts, RunStarted
from cmmlink.result_json import identity_json, result_json
from inspection import LiveInspection, NominalProfile, RigidTransform, ToleranceZone
from tests.cmmlink.judged_oval import bumped, inspect_oval
from tests.cmmlink.oval_part import LENGTH_MM, oval_points, station_mm

PROMISED = {
    "verdict": str,
    "received": int,
    "judged": int,
    "rejected": int,
    "lost": int,
    "out_of_tolerance": int,
    "max_deviation_mm": float,
    "min_deviation_mm": float,
    "rms_mm": float,
    "profile_error_mm": float,
    "worst": dict,
    "fit": str,
    "method": str,
    "registration": dict,
    "stretches": list,
}
FURTHER = {"characteristics", "coverage", "largest_gap_mm", "largest_gap", "complete", "tolerance", "rejected_by_reason", "damaged_bytes"}
FURTHER |= {"zone_error_mm", "best_fit_error_mm", "minimum_zone_mm", "reasons", "rule", "target_mm", "weights", "uncertainty"}


def test_the_summary_has_the_promised_keys_and_says_what_was_put_in(profile: NominalProfile) -> None:
    result = inspect_oval(profile, bumped())
    facts = result_json(result, Counts(received=360, judged=360, lost=2))
    assert set(facts) == set(PROMISED) | FURTHER
    assert {key: type(facts[key]) for key in PROMISED} == PROMISED
    assert facts["verdict"] == "nonconform"
    assert (facts["received"], facts["judged"], facts["rejected"], facts["lost"], facts["out_of_tolerance"]) == (360, 360, 0, 2, 6)
    assert facts["max_deviation_mm"] == pytest.approx(0.2, abs=1e-9)
    assert facts["min_deviation_mm"] == pytest.approx(-0.09, abs=1e-9)
    assert facts["rms_mm"] == pytest.approx(np.sqrt(np.mean(bumped() ** 2)), abs=1e-9)
    assert facts["profile_error_mm"] == pytest.approx(0.4, abs=1e-9)
    assert (facts["fit"], facts["method"]) == ("none", "exact")
    rule = "ISO 14253-1: conform inside the zone less U, nonconform outside the zone plus U, U = 0.01 mm"
    assert facts["tolerance"] == {"lower_mm": -0.05, "upper_mm": 0.07, "uncertainty_mm": 0.01, "decision_rule": rule}
    assert facts["zone_error_mm"] == pytest.approx(2 * (0.2 - 0.01), abs=1e-9)
    assert (facts["rule"], facts["target_mm"], facts["weights"]) == ("datum", pytest.approx(0.01), "arc-length")
    assert facts["reasons"][0]["kind"] == "out-of-tolerance"


def test_the_worst_point_and_the_stretches_are_where_they_were_made(profile: NominalProfile) -> None:
    facts = result_json(inspect_oval(profile, bumped()), Counts())
    worst, (x, y) = facts["worst"], oval_points(bumped())[42]
    assert set(worst) == {"station_mm", "x_mm", "y_mm", "deviation_mm"}
    at = (station_mm(42), x, y, 0.2)
    assert (worst["station_mm"], worst["x_mm"], worst["y_mm"], worst["deviation_mm"]) == pytest.approx(at, abs=1e-6)
    first, second = facts["stretches"]
    assert set(first) == {"from_mm", "to_mm", "worst_mm"}
    assert (first["from_mm"], first["to_mm"], first["worst_mm"]) == pytest.approx((station_mm(40), station_mm(44), 0.2), abs=1e-6)
    assert (second["from_mm"], second["to_mm"], second["worst_mm"]) == pytest.approx((station_mm(200), station_mm(200), -0.09), abs=1e-6)


def test_the_registration_is_told_in_degrees_and_mm(profile: NominalProfile) -> None:
    pose = RigidTransform(np.radians(90.0), np.array([1.0, -2.0]))
    live = LiveInspection(profile, ToleranceZone(-0.05, 0.05), datum=pose)
    live.add(RigidTransform(np.radians(-90.0), np.zeros(2)).apply(oval_points(0.0) - [1.0, -2.0]))
    registration = result_json(live.finish(), Counts())["registration"]
    assert {"rotation_deg", "translation_mm", "iterations", "converged"} <= set(registration)
    assert registration["rotation_deg"] == pytest.approx(90.0)
    assert registration["translation_mm"] == [1.0, -2.0]
    assert registration["converged"] is True


def test_a_summary_without_a_result_has_the_same_keys_and_proves_nothing(profile: NominalProfile) -> None:
    nothing = result_json(None, Counts(received=3, rejected=3, rejected_by_reason={"not registered": 3}))
    assert set(nothing) == set(result_json(inspect_oval(profile, 0.0), Counts()))
    assert (nothing["verdict"], nothing["received"], nothing["judged"], nothing["rejected"]) == ("uncertain", 3, 0, 3)
    assert nothing["worst"] is None


def test_a_summary_is_strict_json_also_when_nothing_was_judged(profile: NominalProfile) -> None:
    live = LiveInspection(profile, ToleranceZone(-0.05, 0.05), datum=RigidTransform.identity())
    live.add(np.full((9, 2), np.nan))
    for facts in (
        result_json(live.finish(), Counts()),
        result_json(inspect_oval(profile, bumped()), Counts()),
        result_json(None, Counts()),
    ):
        assert json.loads(json.dumps(facts, allow_nan=False)) == facts


def test_the_identity_of_a_run_stands_beside_its_numbers() -> None:
    facts = identity_json(RunStarted("blade", "0012", "", "serial COM3", True, ("decimal commas",)))
    identity = {"part": "blade", "serial_number": "0012", "operator": None, "device": "serial COM3", "simulated": True}
    assert facts == identity | {"qualification": None, "notes": ["decimal commas"]}
    assert not set(facts) & (set(PROMISED) | FURTHER)


def test_the_oval_is_as_long_as_its_circumference(profile: NominalProfile) -> None:
    assert profile.length_mm == pytest.approx(LENGTH_MM, rel=1e-12)
