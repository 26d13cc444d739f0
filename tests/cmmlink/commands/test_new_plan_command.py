"""`plan new`: the questions it asks, what options take their place, and the plan that comes of it."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import typer

from cmmlink.plan import load_plan
from tests.cmmlink.command import cmmlink
from tests.cmmlink.oval_part import oval_points, write_points


@pytest.fixture
def oval(tmp_path: Path) -> Path:
    write_points(tmp_path / "points.csv", oval_points(0.0))
    return write_points(tmp_path / "oval.csv", np.vstack([oval_points(0.0), oval_points(0.0)[:1]]))


class Terminal:
    """Someone at a terminal, who gives these answers; an empty one takes what is offered."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, *answers: str) -> None:
        self.asked: list[str] = []
        self._answers = list(answers)
        monkeypatch.setattr("sys.stdin.isatty", lambda: True, raising=False)
        monkeypatch.setattr(typer, "prompt", self._prompt)
        monkeypatch.setattr(typer, "confirm", self._confirm)

    def _prompt(self, text: str, default: str | None = None, **_: Any) -> str:
        self.asked.append(text)
        return self._answers.pop(0) or str(default)

    def _confirm(self, text: str, **_: Any) -> bool:
        self.asked.append(text)
        return self._answers.pop(0) == "y"


def test_questions_make_a_plan_that_can_be_run(tmp_path: Path, oval: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    points = str(tmp_path / "points.csv")
    terminal = Terminal(monkeypatch, "cam 3", "huge", "0.02", points, "", "none")
    ended = cmmlink("plan", "new", oval)
    assert ended.code == 0, ended.err
    assert len(terminal.asked) == len(["name", "tolerance", "tolerance once more", "source", "tip", "results"])
    assert "'huge': expected the lower and the upper limit" in ended.err
    plan = load_plan(tmp_path / "oval-plan.yaml")
    assert (plan.part.name, plan.zone.upper_mm, plan.probe.tip_radius_mm) == ("cam 3", 0.02, 0.0)
    assert "oval-plan.yaml can be run: cam 3" in ended.out
    assert (tmp_path / "oval-plan.png").read_bytes()[:4] == b"\x89PNG", "no terminal for the picture"
    assert cmmlink("run", tmp_path / "oval-plan.yaml", "--headless").code == 0


def test_options_take_the_place_of_every_question(tmp_path: Path, oval: Path) -> None:
    told = ("--part", "cam", "--tolerance", -0.1, 0.2, "--device", "COM3", "--results", "out/{run}", "--tip-radius", 0.5)
    assert cmmlink("plan", "new", oval, "-o", tmp_path / "a.yaml", *told, "--nominal-unit", "um").code == 0
    plan = load_plan(tmp_path / "a.yaml")
    assert (plan.part.name, plan.zone.lower_mm, plan.zone.upper_mm, plan.probe.tip_radius_mm) == ("cam", -0.1, 0.2, 0.5)
    assert (plan.nominal.unit, plan.out.folder) == ("um", tmp_path / "out/{run}")
    assert "is there already" in cmmlink("plan", "new", oval, "-o", tmp_path / "a.yaml", *told).refused()
    assert cmmlink("plan", "new", oval, "-o", tmp_path / "a.yaml", *told, "--overwrite").code == 0
    assert load_plan(tmp_path / "a.yaml").nominal.unit is None


def test_what_decides_about_parts_is_never_taken_unseen(oval: Path) -> None:
    assert cmmlink("plan", "new", oval, "--device", "COM3").refused().startswith("--tolerance is missing, and nobody can be asked here")
    assert cmmlink("plan", "new", oval, "--tolerance", -1, 1).refused().startswith("--device is missing, and nobody can be asked here")
    assert not oval.with_name("oval-plan.yaml").exists()


def test_a_plan_that_is_there_is_asked_about_before_anything_else(oval: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    there = oval.with_name("oval-plan.yaml")
    there.write_text("mine", encoding="utf-8")
    terminal = Terminal(monkeypatch, "n")
    assert "is there already" in cmmlink("plan", "new", oval).refused()
    assert len(terminal.asked) == 1
    assert there.read_text(encoding="utf-8") == "mine"


def test_no_nominal_leads_to_more_than_six_questions(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    line = "".join(f"0\nLINE\n8\n0\n10\n{x}\n20\n0\n11\n{x + 10}\n21\n{5}\n" for x in (0, 100))
    (tmp_path / "lines.dxf").write_text(f"0\nSECTION\n2\nENTITIES\n{line}0\nENDSEC\n0\nEOF\n", encoding="utf-8")
    terminal = Terminal(monkeypatch, "1", "mm", "a line", "left", "0.1", "COM3", "1", "never asked")
    ended = cmmlink("plan", "new", tmp_path / "lines.dxf")
    assert ended.code == 0, ended.err
    assert len(terminal.asked) <= 7
    plan = load_plan(tmp_path / "lines-plan.yaml")
    assert (plan.nominal.material, plan.nominal.curve, plan.nominal.unit) == ("left", 1, "mm")
