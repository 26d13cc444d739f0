"""What a plan may say of the answer to a machine."""

from pathlib import Path

import pytest

from cmmlink.errors import PlanError
from cmmlink.plan import Plan, load_plan

PLAN = """part: {{name: blade}}
nominal: {{file: blade.dat}}
tolerance: {{lower_mm: -0.05, upper_mm: 0.05}}
device: {{{device}}}
answer: {{{answer}}}
"""
LINES = "type: lines, address: COM3, unit: mm"
PATTERN = "pattern: 'X(?P<x>.*)Y(?P<y>.*)', end: M30"


def read(folder: Path, answer: str, device: str = LINES) -> Plan:
    (folder / "plan.yaml").write_text(PLAN.format(answer=answer, device=device), encoding="utf-8")
    return load_plan(folder / "plan.yaml")


def test_the_file_of_the_answer_is_seen_from_the_plan(tmp_path: Path) -> None:
    plan = read(tmp_path, "file: dnc/O9100.nc, characteristics: {profile: 160}")
    assert plan.answer is not None
    assert plan.answer.file == tmp_path / "dnc" / "O9100.nc"
    assert read(tmp_path, "file: O9100.nc", f"{LINES}, format: {{{PATTERN}, request: 'REQUEST(?P<number>.*)'}}").answer is not None


@pytest.mark.parametrize(
    ("answer", "device", "told"),
    [
        ("file: O9100.nc", "type: serial, address: COM3", "an answer only beside a device of type lines"),
        ("file: O9100.nc", f"{LINES}, format: {{{PATTERN}}}", "device.format.request beside a pattern"),
        ("file: O9100.nc, characteristics: {chord: 160}", LINES, "characteristics of this plan; chord is none of profile"),
        ("file: O9100.nc, variables: {worst: 150}", LINES, "a variable of its own for each value; #150 stands twice"),
        ("file: O9100.nc, variables: {verdict: 0}", LINES, "answer.variables.verdict is '0'"),
        ("program: 9100", LINES, "answer.file is missing"),
    ],
)
def test_what_cannot_be_is_told_with_what_is_allowed(answer: str, device: str, told: str, tmp_path: Path) -> None:
    with pytest.raises(PlanError, match=told.replace("#", ".")):
        read(tmp_path, answer, device)
