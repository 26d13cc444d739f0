from pathlib import Path

import pytest

from cmmlink.console.choice import check_choice
from cmmlink.console.entry import Entry
from cmmlink.console.refused import Refused
from cmmlink.plan.serial_numbers import next_serial_number

from .played import PLAN, write_plan


def test_another_plan_brings_its_part_and_the_same_plan_leaves_what_was_entered(tmp_path: Path) -> None:
    first = check_choice("blade.yaml", write_plan(tmp_path))
    other = check_choice("other.yaml", write_plan(tmp_path, "other.yaml", PLAN.replace("B-0041", "C-7").replace("played", "COM9")))
    entry = Entry().with_choice(first)
    assert (entry.serial_number, entry.operator, entry.address) == ("B-0041", "Ada", "played")
    entry = entry.with_values("X-1", None, "COM3").with_choice(first)
    assert (entry.serial_number, entry.operator, entry.address) == ("X-1", "Ada", "COM3")
    entry = Entry().with_choice(first).with_values(None, "Grace", None).with_choice(other)
    assert (entry.serial_number, entry.operator, entry.address) == ("C-7", "Grace", "COM9")


def test_what_the_operator_typed_is_not_replaced_by_a_check_that_comes_back_later(tmp_path: Path) -> None:
    other = check_choice("other.yaml", write_plan(tmp_path, "other.yaml", PLAN.replace("B-0041", "C-7")))
    entry = Entry().with_choice(check_choice("blade.yaml", write_plan(tmp_path))).with_values("X-1", "Grace", None).with_choice(other)
    assert (entry.serial_number, entry.operator) == ("X-1", "Grace")
    entry = entry.for_next_part()
    assert entry.serial_number == "X-2"
    following = check_choice("next.yaml", write_plan(tmp_path, "next.yaml", PLAN.replace("B-0041", "D-1")))
    assert entry.with_choice(following).serial_number == "D-1", "what was suggested is not what was typed"


def test_a_run_is_planned_with_what_was_entered(tmp_path: Path) -> None:
    entry = Entry().with_choice(check_choice("blade.yaml", write_plan(tmp_path))).with_values("X-1", "", "COM3")
    plan = entry.planned().plan
    assert (plan.part.serial_number, plan.operator) == ("X-1", None)
    assert plan.device.model_dump()["address"] == "COM3"


def test_nothing_is_planned_without_a_plan_that_can_be_run(tmp_path: Path) -> None:
    with pytest.raises(Refused, match="choose a plan first"):
        Entry().planned()
    with pytest.raises(Refused, match="the file is empty"):
        Entry().with_choice(check_choice("blade.yaml", write_plan(tmp_path, text=""))).planned()


@pytest.mark.parametrize(
    ("serial", "following"),
    [("B-0041", "B-0042"), ("B-0099", "B-0100"), ("999", "1000"), ("7a", "8a"), ("A1-09x", "A1-10x"), ("", ""), ("K", "")],
)
def test_next_serial_number_counts_the_last_number_up(serial: str, following: str) -> None:
    assert next_serial_number(serial) == following
