from pathlib import Path

import pytest

from cmmlink.console.choice import CheckedPlan, check_choice

from .played import PLAN, write_plan


@pytest.mark.parametrize(
    ("text", "line", "says"),
    [
        (PLAN.replace("upper_mm: 0.05", "upper_mm: 5 cm"), 4, "expected a number"),
        (PLAN + "colour: red\n", 6, "colour is not a known key"),
        (PLAN.replace("section.yaml", "missing.yaml"), 3, "missing.yaml"),
        ("{", 2, "not valid YAML"),
        ("", None, "blade.yaml: the file is empty"),
    ],
)
def test_plan_that_cannot_be_run_is_shown_with_its_line(tmp_path: Path, text: str, line: int | None, says: str) -> None:
    choice = check_choice("blade.yaml", write_plan(tmp_path, text=text))
    assert choice.checked is None
    assert choice.shown.line == line
    assert says in choice.shown.problem
    assert choice.shown.text == text


def test_plan_that_is_gone_says_so(tmp_path: Path) -> None:
    choice = check_choice("gone.yaml", tmp_path / "gone.yaml")
    assert choice.checked is None
    assert choice.shown.problem == "gone.yaml: No such file or directory"


def test_plan_that_can_be_run_is_described_with_its_limits_and_its_device(tmp_path: Path) -> None:
    choice = check_choice("blade.yaml", write_plan(tmp_path))
    assert choice.checked is not None
    assert (choice.shown.problem, choice.shown.part, choice.shown.has_address) == ("", "blade 7", True)
    facts = dict(choice.shown.facts)
    assert facts["Tolerance"] == "-0.05 to +0.05 mm"
    assert facts["Device"] == "serial played"
    assert isinstance(choice.checked, CheckedPlan)
    assert facts["Nominal"] == f"section.yaml, {choice.checked.profile.length_mm:.1f} mm, closed"
