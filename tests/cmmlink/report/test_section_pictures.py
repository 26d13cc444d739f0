"""Pictures of sections drawn by other processes: the same ones, and all of them whatever becomes of a process."""

import os
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from cmmlink.other_processes import _Process
from cmmlink.report.judged_scan import scan_of
from cmmlink.report.picture import ProfilePictures
from cmmlink.report.picture_content import content_of
from cmmlink.report.picture_processes import Pictures
from cmmlink.report.section_pictures import SectionPictures
from inspection import InspectionResult, NominalProfile
from tests.cmmlink.judged_oval import bumped, inspect_oval

ROOT = Path(__file__).resolve().parents[3]
UNGUARDED = """
import sys
from pathlib import Path
from cmmlink.report import Pictures
from cmmlink.report.judged_scan import scan_of
from cmmlink.report.picture_content import content_of
from inspection import LiveInspection, RigidTransform, ToleranceZone, discretize
from tests.inspection import profiles

print("run", flush=True)
profile = discretize(profiles.p3(), samples=400)
live = LiveInspection(profile, ToleranceZone(-0.05, 0.05), datum=RigidTransform.identity())
live.add(profile.points_mm)
content = content_of(scan_of(live.finish()), profile, "part")
with Pictures() as pictures:
    pictures.start(1)
    pictures.write(pictures.begin(content, ".png"), lambda: content, Path(sys.argv[1]))
print((pictures.drawn_beside, pictures.drawn_here))
"""


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
    files: dict[str, bytes] = {}
    for number, each in enumerate(sections, start=1):
        if each.run.result is not None:
            names = [f"{number}.png", f"{number}.svg"]
            pictures.write(number, each, *(folder / name for name in names))
            files |= {name: (folder / name).read_bytes() for name in names}
    return files


@pytest.fixture
def begun(monkeypatch: pytest.MonkeyPatch) -> list[_Process]:
    """The processes that were started, on a computer with two cores."""
    processes: list[_Process] = []
    start = _Process.__init__

    def note(process: _Process, serving: str) -> None:
        start(process, serving)
        processes.append(process)

    monkeypatch.setattr(_Process, "__init__", note)
    monkeypatch.setattr(os, "cpu_count", lambda: 2)
    return processes


def test_another_process_draws_the_same_pictures_and_this_one_none(sections: list[Any], tmp_path: Path, begun: list[_Process]) -> None:
    with Pictures() as pictures:
        of_sections = SectionPictures("blade", pictures)
        of_sections.expect(8)
        for each in sections:
            of_sections.begin(each)
        beside = drawn(of_sections, sections, tmp_path)
    assert (len(begun), pictures.drawn_beside, pictures.drawn_here) == (1, 3, 0)
    for name, content in beside.items():
        each = sections[int(name[0]) - 1]
        own = content_of(scan_of(each.run.result), each.profile, f"blade, height {each.slice.height_mm:g} mm")
        path = tmp_path / f"own{Path(name).suffix}"
        ProfilePictures().write(own, path)
        assert content == path.read_bytes()


def test_what_a_process_that_was_ended_has_not_drawn_is_drawn_here(sections: list[Any], tmp_path: Path, begun: list[_Process]) -> None:
    with Pictures() as pictures:
        of_sections = SectionPictures("blade", pictures)
        of_sections.expect(8)
        begun[0]._child.kill()
        for each in sections:
            of_sections.begin(each)
        assert len(drawn(of_sections, sections, tmp_path)) == 6
    assert (pictures.drawn_beside, pictures.drawn_here) == (0, 3)
    assert begun[0]._child.returncode is not None


def test_few_sections_and_one_core_are_not_worth_a_process(
    sections: list[Any], tmp_path: Path, begun: list[_Process], monkeypatch: pytest.MonkeyPatch
) -> None:
    with Pictures() as pictures:
        of_sections = SectionPictures("blade", pictures)
        of_sections.expect(7)
        of_sections.begin(sections[0])
        of_sections.write(1, sections[0], tmp_path / "1.png", tmp_path / "1.svg")
        monkeypatch.setattr(os, "cpu_count", lambda: 1)
        of_sections.expect(100)
    assert (len(begun), pictures.drawn_here) == (0, 1)


def test_the_processes_are_gone_when_the_pictures_are_no_longer_wanted(sections: list[Any], begun: list[_Process]) -> None:
    with Pictures() as pictures:
        of_sections = SectionPictures("blade", pictures)
        of_sections.expect(16)
        of_sections.begin(sections[0])  # and nobody waits for it
    assert len(begun) == 2
    assert not any(process._child.returncode is None for process in begun)


def test_a_script_without_a_guard_is_not_run_again_by_the_process_that_draws(tmp_path: Path) -> None:
    script = tmp_path / "script.py"
    script.write_text(UNGUARDED, encoding="utf-8")
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    ended = subprocess.run(
        [sys.executable, script, tmp_path / "a.png"], cwd=ROOT, env=environment, capture_output=True, text=True, check=False
    )
    assert (ended.stdout, ended.stderr) == ("run\n(1, 0)\n", "")
    assert (tmp_path / "a.png").stat().st_size > 10_000
