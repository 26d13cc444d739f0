"""Characteristics of the sections of a surface: every section is asked the same, and the stack has the worst verdict."""

from pathlib import Path
from typing import Any

import pytest

from cmmlink.errors import PlanError
from cmmlink.from_plan import asked_of, check_plan, profile_of
from cmmlink.plan import Plan, load_plan
from cmmlink.plan.surface import CtPlan
from inspection import Verdict
from tests.cmmlink.blade import inspect
from tests.cmmlink.command import cmmlink

ASKED: list[dict[str, Any]] = [
    {"name": "contour", "type": "line-profile", "zone": {"width_mm": 0.2}, "fit": "minimum-zone"},
    {"name": "edge", "type": "line-profile", "zone": {"width_mm": 0.2}, "region": "LE", "within_mm": 6},
    {"name": "chord", "type": "chord", "lower_mm": -0.1, "upper_mm": 0.1},
    {"name": "thickness", "type": "thickness", "lower_mm": -0.1, "upper_mm": 0.1},
]


def plan_of(blade: tuple[Path, Path], asked: list[dict[str, Any]]) -> CtPlan:
    settings = {
        "part": {"name": "blade"},
        "mesh": {"file": blade[0]},
        "nominal": {"file": blade[1]},
        "sections": {"heights_mm": [5.0, 15.0]},
        "cut": {"cutter": "numpy"},
        "characteristics": asked,
    }
    return CtPlan.model_validate(settings)


def test_every_section_is_asked_for_every_characteristic(blade: tuple[Path, Path]) -> None:
    stack = inspect(plan_of(blade, ASKED))
    assert stack.verdict is Verdict.CONFORM
    for section in stack.sections:
        assert section.run.result is not None
        found = {one.name: one for one in section.run.result.characteristics}
        assert list(found) == ["contour", "edge", "chord", "thickness"]
        assert found["chord"].deviation == pytest.approx(0, abs=0.01)
        assert found["contour"].certificate is not None
    slices = stack.result_json()["slices"]
    assert [[one["verdict"] for one in section["characteristics"]] for section in slices] == [["conform"] * 4] * 2


def test_one_number_out_of_tolerance_makes_the_stack_nonconform(blade: tuple[Path, Path]) -> None:
    wrong = {"name": "chord", "type": "chord", "nominal_mm": 50.0, "lower_mm": -0.1, "upper_mm": 0.1}
    stack = inspect(plan_of(blade, [*ASKED[:2], wrong]))
    assert stack.verdict is Verdict.NONCONFORM
    reasons = stack.result_json()["slices"][0]["reasons"]
    assert reasons[0]["words"].startswith("chord: It is 60.0")


def test_what_the_nominal_does_not_have_is_told_with_its_place_before_anything_is_measured(
    tmp_path: Path, blade: tuple[Path, Path]
) -> None:
    plan = tmp_path / "plan.yaml"
    plan.write_text(
        "part: {name: blade}\n"
        f"nominal: {{file: '{blade[1].as_posix()}'}}\n"
        "tolerance: {lower_mm: -0.05, upper_mm: 0.05}\n"
        "device: {type: file, file: points.csv}\n"
        "discretisation: {samples: 500}\n"
        "characteristics:\n"
        "  - {name: a, type: chord, lower_mm: -1}\n"
        "  - {name: b, type: line-profile, zone: '0.1', fit: datum}\n",
        encoding="utf-8",
    )
    with pytest.raises(PlanError, match=r"plan.yaml: line 8: characteristics\[1\]: fit datum needs a known pose"):
        check_plan(load_plan(plan), plan)
    checked = cmmlink("check", plan)
    assert checked.code == 2
    assert "line 8: characteristics[1]: fit datum needs a known pose" in checked.err


def test_a_section_that_is_no_airfoil_has_no_chord(tmp_path: Path) -> None:
    (tmp_path / "wave.csv").write_text("0,0\n10,5\n20,3\n30,9\n40,0\n50,1\n", encoding="utf-8")
    plan = Plan.model_validate(
        {
            "part": {"name": "wave"},
            "nominal": {"file": tmp_path / "wave.csv", "material": "left"},
            "tolerance": {"lower_mm": -1, "upper_mm": 1},
            "device": {"type": "file", "file": tmp_path / "points.csv"},
            "discretisation": {"samples": 500},
            "characteristics": [{"name": "a", "type": "chord", "lower_mm": -1}],
        }
    )
    with pytest.raises(PlanError, match=r"characteristics\[0\], a: "):
        asked_of(plan, profile_of(plan))
