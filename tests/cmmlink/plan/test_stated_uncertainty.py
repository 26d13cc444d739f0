"""What a plan may say of uncertainty, temperature and the decision rule, and what a run makes of it, by hand from its own files."""

import csv
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cmmlink.errors import PlanError
from cmmlink.from_plan import check_plan, inspection_of, profile_of, stated_by, zone_of
from cmmlink.plan import CtPlan, Plan, load_ct_plan, load_plan
from cmmlink.plan.uncertainty import Mpe
from cmmlink.result_keys import Recorded
from tests.cmmlink.command import cmmlink
from tests.cmmlink.oval_part import oval_points, write_nominal, write_points

ZONE = "tolerance: {lower_mm: -0.05, upper_mm: 0.05}"
BUDGET = "uncertainty: {mpe: {a_mm: 0.0018, per_length: 300}, tip_radius_mm: 0.0005, repeatability_mm: 0.001}"
WARM = "temperature: {part_c: 33, cte_per_k: 11.5e-6, compensate: true, fixed_mm: [3, -2]}"
GROWTH = 11.5e-6 * 13
Made = Callable[..., Path]


@pytest.fixture
def made(tmp_path: Path) -> Made:
    """Writes a plan of the oval, which lies in nominal coordinates, with further lines."""
    write_nominal(tmp_path / "oval.yaml")
    write_points(tmp_path / "points.csv", oval_points(0.01 * np.sin(np.arange(360) / 9)))

    def make(*lines: str, fit: str = "none", zone: str = ZONE) -> Path:
        head = f"part: {{name: oval}}\nnominal: {{file: oval.yaml}}\n{zone}\ndevice: {{type: file, file: points.csv}}\nrecords: records\n"
        path = tmp_path / "plan.yaml"
        path.write_text(head + f"out: out\nregistration: {{fit: {fit}}}\n" + "\n".join(lines) + "\n", encoding="utf-8")
        return path

    return make


def test_the_error_of_a_device_is_spelled_in_mm_or_as_in_a_data_sheet(made: Made) -> None:
    micro = ("um", "\N{MICRO SIGN}m", "\N{GREEK SMALL LETTER MU}m")
    for spelled in ("{a_mm: 0.0018, per_length: 300}", *(f"1.8 + L/300 {unit}" for unit in micro), "1.8+L / 300um"):
        plan = load_plan(made(f"uncertainty: {{mpe: {spelled}}}"))
        stated = stated_by(plan)
        assert stated is not None
        assert (stated.budget.mpe_mm, stated.budget.mpe_share) == pytest.approx((0.0018, 1 / 300e3), rel=1e-12)
    assert Mpe(a_mm=0.002).share == 0.0


ZONE_AND_U = "tolerance: {lower_mm: -0.05, upper_mm: 0.05, uncertainty_mm: 0.004}"
REFUSED = {
    "two sources of U": ([BUDGET], ZONE_AND_U, "either uncertainty or tolerance.uncertainty_mm"),
    "no budget at all": (["uncertainty: {coverage_factor: 2}"], ZONE, "one of mpe, tip_radius_mm, repeatability_mm and temperature"),
    "a length in the wrong unit": (["uncertainty: {mpe: {a_mm: 0.002, per_length: 300000}}"], ZONE, "per_length is '300000'"),
    "an unknown notation": (["uncertainty: {mpe: 1.8 + L/300}"], ZONE, "1.8 \\+ L/300 um"),
    "a budget beyond the zone": (["uncertainty: {repeatability_mm: 0.03}"], ZONE, "line 8: uncertainty: an uncertainty of 0.06 mm"),
    "two temperatures": (
        ["uncertainty: {repeatability_mm: 0.001, temperature: {part_c: 20, cte_per_k: 1e-5, compensate: true}}", WARM],
        ZONE,
        "either temperature or uncertainty.temperature",
    ),
    "compensation left open": (["temperature: {part_c: 23, cte_per_k: 1e-5}"], ZONE, "temperature.compensate"),
    "no fixed place at a known pose": (
        ["temperature: {part_c: 23, cte_per_k: 1e-5, compensate: true}"],
        ZONE,
        "line 8: temperature: found no fixed_mm; the pose is known",
    ),
    "uncertainties of nothing": ([f"{WARM[:-1]}, u_part_k: 1}}"], ZONE, "no u_part_k and u_cte_per_k without"),
    "an unknown rule": (["decision_rule: asme"], ZONE, "'iso-14253-1', 'ilac-g8' or 'simple'"),
}  # fmt: skip


@pytest.mark.parametrize("mistake", REFUSED)
def test_a_mistake_is_named_with_its_place(made: Made, mistake: str) -> None:
    lines, zone, words = REFUSED[mistake]
    path = made(*lines, zone=zone)
    with pytest.raises(PlanError, match=words) as refused:
        check_plan(load_plan(path), path)
    assert f"{path}: line " in str(refused.value)


def test_the_effective_plan_means_the_same(made: Made, tmp_path: Path) -> None:
    plan = load_plan(made(BUDGET, WARM, "decision_rule: ilac-g8"))
    again = tmp_path / "again.yaml"
    again.write_text(plan.effective_yaml(), encoding="utf-8")
    assert load_plan(again).named(plan.file_name) == plan
    assert stated_by(load_plan(again)) == stated_by(plan)


def run(path: Path) -> tuple[dict[str, Any], list[dict[str, str]]]:
    """The result of a run as JSON, which knows no other key, and its uncertainty.csv."""
    found = cmmlink("run", path, "--headless", "--json").json()
    Recorded.model_validate(found)
    with (path.parent / "out" / "uncertainty.csv").open(encoding="utf-8", newline="") as file:
        return found, list(csv.DictReader(file))


def test_a_run_states_its_budget_and_every_number_of_it_can_be_worked_out_by_hand(made: Made) -> None:
    warm = "temperature: {part_c: 23, cte_per_k: 11.5e-6, compensate: false, fixed_mm: [0, 0], u_part_k: 0.5, u_cte_per_k: 1e-6}"
    path = made(BUDGET, warm)
    found, rows = run(path)
    told = found["uncertainty"]
    assert found["tolerance"]["uncertainty_mm"] == told["used_mm"] == told["largest_mm"]
    assert told["basis"] == "the known pose"
    lines = {line["name"]: line for line in told["budget"]}
    u = np.sqrt(sum(line["contributed_mm"] ** 2 for line in lines.values()))
    assert told["standard_mm"] == pytest.approx(u)
    assert told["largest_mm"] == pytest.approx(2 * u + abs(told["growth_left_mm"]))
    assert sum(line["share"] for line in lines.values()) == pytest.approx(1)
    profile = profile_of(load_plan(path))
    farthest = np.abs((profile.points_mm * profile.outward * profile.normal).sum(axis=1)).max()
    assert lines["temperature"]["contributed_mm"] == pytest.approx(11.5e-6 * 0.5 * farthest, rel=1e-6)
    assert lines["expansion"]["contributed_mm"] == pytest.approx(1e-6 * 3 * farthest, rel=1e-6)
    assert abs(told["growth_left_mm"]) == pytest.approx(11.5e-6 * 3 * farthest, rel=1e-6)
    assert lines["device"]["contributed_mm"] == pytest.approx((0.0018 + profile.size_mm / 300e3) / np.sqrt(3), rel=1e-6)
    assert len(rows) == len(told["stations"]) <= 200
    for row, at in zip(rows, told["stations"], strict=True):
        number = {name: float(value) for name, value in row.items()}
        parts = [number[f"{name}_mm"] for name in ("repeatability", "device", "tip_radius", "temperature", "expansion")]
        assert number["standard_mm"] == pytest.approx(np.sqrt(np.sum(np.square(parts))), abs=3e-6)
        assert number["expanded_mm"] == pytest.approx(2 * number["standard_mm"] + abs(number["growth_left_mm"]), abs=4e-6)
        assert at["expanded_mm"] == pytest.approx(number["expanded_mm"], abs=1e-6)
        assert at["expanded_mm"] <= told["used_mm"]
    assert any("not compensated" in note for note in found["notes"])


def test_a_warm_part_is_judged_as_the_cold_one_and_its_replay_is_the_same_to_the_last_bit(made: Made, tmp_path: Path) -> None:
    cold = cmmlink("run", made(), "--headless", "--json").json()
    points = np.loadtxt(tmp_path / "points.csv", delimiter=",", skiprows=1)
    write_points(tmp_path / "points.csv", np.array([3, -2]) + (1 + GROWTH) * (points[:, :2] - [3, -2]))
    warm = cmmlink("run", made(WARM), "--headless", "--json").json()
    assert warm["max_deviation_mm"] == pytest.approx(cold["max_deviation_mm"], abs=2e-6)  # of the digits in the file
    assert any("scaled by 0.99985052 about (3, -2) mm" in note for note in warm["notes"])
    as_measured = cmmlink("run", made(), "--headless", "--json").json()
    assert as_measured["max_deviation_mm"] > cold["max_deviation_mm"] + 0.0015
    replayed = cmmlink("replay", warm["run"], "--records", tmp_path / "records", "--json").json()
    assert replayed["identical"] is True


def test_the_rule_decides_how_u_counts_on_the_way_and_at_the_end(made: Made, tmp_path: Path) -> None:
    """A flat 0.0495 mm is inside the limit of 0.05 and nearer to it than U: proven by none but simple acceptance."""
    write_points(tmp_path / "points.csv", oval_points(np.full(360, 0.0495)))
    verdicts = {}
    for rule in ("iso-14253-1", "ilac-g8", "simple"):
        path = made(BUDGET, f"decision_rule: {rule}")
        plan = load_plan(path)
        live = inspection_of(plan, profile_of(plan))
        on_the_way = live.add(oval_points(np.full(360, 0.0495)))
        found, _ = run(path)
        verdicts[rule] = found["verdict"]
        assert (on_the_way.verdicts == on_the_way.verdicts[0]).all()
        assert (found["verdict"] == "conform") == (on_the_way.verdicts[0] == 0)
        assert found["tolerance"]["decision_rule"] == zone_of(plan, profile_of(plan)).decision_rule
        assert f"U = {found['uncertainty']['used_mm']:g} mm" in found["tolerance"]["decision_rule"]
    assert verdicts == {"iso-14253-1": "uncertain", "ilac-g8": "uncertain", "simple": "conform"}


def test_the_terminal_prints_the_budget(made: Made) -> None:
    said = cmmlink("run", made(BUDGET), "--headless").out
    assert "U of a deviation, by the known pose: at most" in said
    lines = [line.split()[0] for line in said.splitlines() if " normal " in line or " rectangular " in line]
    assert lines == ["repeatability", "device", "tip"]


def test_a_plan_of_a_surface_takes_the_same_keys(tmp_path: Path) -> None:
    path = tmp_path / "ct.yaml"
    head = f"part: {{name: a}}\nmesh: {{file: a.stl}}\nnominal: {{file: a.yaml}}\n{ZONE}\nsections: {{heights_mm: [1]}}\n"
    path.write_text(f"{head}{BUDGET}\n{WARM}\ndecision_rule: simple\n", encoding="utf-8")
    plan = load_ct_plan(path)
    assert plan.zone.rule == "simple"
    assert plan.warmth is not None
    assert {"uncertainty", "temperature", "decision_rule"} <= set(Plan.model_fields) & set(CtPlan.model_fields)
    assert json.loads(json.dumps(plan.model_dump(mode="json")))["uncertainty"]["mpe"] == {"a_mm": 0.0018, "per_length": 300.0}
