"""Pictures of sections drawn by other processes: the same ones, and all of them whatever becomes of a process."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from cmmlink.report.picture import write_picture
from cmmlink.report.section_pictures import SectionPictures, _Process
from inspection import InspectionResult, NominalProfile
from tests.cmmlink.judged_oval import bumped, inspect_oval


def section(profile: NominalProfile, result: InspectionResult | None, height_mm: float) -> Any:
    return SimpleNamespace(
        profile=profile, slice=SimpleNamespace(height_mm=height_mm), run=SimpleNamespace(result=result, ending="complete")
    )


@pytest.fixture
def sections(profile: NominalProfile) -> list[Any]:
    results = [inspect_oval(profile, 0.02), None, inspect_oval(profile, bumped()), inspect_oval(profile, 0.065)]
    return [section(profile, result, float(height)) for height, result in enumerate(results)]


def drawn(pictures: SectionPictures, sections: list[Any], folder: Path) -> dict[str, bytes]:
    """What is written of the sections in which points were judged."""
    files = {}
    for number, each in enumerate(sections, start=1):
        if each.run.result is not None:
            pictures.write(number, each, folder / f"{number}.png")
            files[f"{number}.png"] = (folder / f"{number}.png").read_bytes()
    return files


def test_another_process_draws_the_same_pictures_and_this_one_none(sections: list[Any], tmp_path: Path) -> None:
    with SectionPictures("blade", processes=1) as pictures:
        pictures.expect(8)
        for each in sections:
            pictures.begin(each)
        beside = drawn(pictures, sections, tmp_path)
    assert (pictures.drawn_beside, pictures.drawn_here) == (3, 0)
    for name, content in beside.items():
        each = sections[int(name[0]) - 1]
        write_picture(each.run.result, each.profile, f"blade, height {each.slice.height_mm:g} mm", tmp_path / "own.png")
        assert content == (tmp_path / "own.png").read_bytes()


def test_what_a_process_that_was_ended_has_not_drawn_is_drawn_here(
    sections: list[Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    begun: list[_Process] = []
    start = _Process.__init__

    def note(process: _Process) -> None:
        start(process)
        begun.append(process)

    monkeypatch.setattr(_Process, "__init__", note)
    with SectionPictures("blade", processes=1) as pictures:
        pictures.expect(8)
        begun[0]._child.kill()
        for each in sections:
            pictures.begin(each)
        assert len(drawn(pictures, sections, tmp_path)) == 3
    assert (pictures.drawn_beside, pictures.drawn_here) == (0, 3)
    assert not begun[0]._child.is_alive()


def test_few_sections_are_not_worth_a_process(sections: list[Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(_Process, "__init__", lambda _: pytest.fail("a process was started"))
    with SectionPictures("blade", processes=4) as pictures:
        pictures.expect(7)
        pictures.begin(sections[0])
        pictures.write(1, sections[0], tmp_path / "1.png")
    assert pictures.drawn_here == 1


def test_the_processes_are_gone_when_the_pictures_are_no_longer_wanted(sections: list[Any], monkeypatch: pytest.MonkeyPatch) -> None:
    begun: list[_Process] = []
    start = _Process.__init__

    def note(process: _Process) -> None:
        start(process)
        begun.append(process)

    monkeypatch.setattr(_Process, "__init__", note)
    with SectionPictures("blade", processes=2) as pictures:
        pictures.expect(16)
        pictures.begin(sections[0])  # and nobody waits for it
    assert len(begun) == 2
    assert not any(process._child.exitcode is None for process in begun)
