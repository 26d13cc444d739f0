"""The folder of results."""

import json
from pathlib import Path

import pytest

from cmmlink.errors import PlanError
from cmmlink.events import Counts
from cmmlink.report.folder import prepare, write_results
from cmmlink.report.picture_processes import Pictures
from cmmlink.result_json import result_json
from inspection import NominalProfile
from tests.cmmlink.judged_oval import bumped, inspect_oval


def test_a_picture_that_another_process_draws_is_the_same(profile: NominalProfile, tmp_path: Path) -> None:
    result, facts = inspect_oval(profile, bumped()), {"run": "7", "measured_at": "2026-11-27"}
    with Pictures() as pictures:
        pictures.start(1)
        names = write_results(tmp_path / "beside", facts, result, profile, "oval", pictures)
    assert (pictures.drawn_beside, pictures.drawn_here) == (1, 0)
    assert write_results(tmp_path / "here", facts, result, profile, "oval") == names
    assert all((tmp_path / "beside" / name).read_bytes() == (tmp_path / "here" / name).read_bytes() for name in names)


def test_the_folder_holds_what_it_says(profile: NominalProfile, tmp_path: Path) -> None:
    folder = tmp_path / "a" / "b"
    facts = result_json(inspect_oval(profile, bumped()), Counts())
    written = write_results(folder, facts, inspect_oval(profile, bumped()), profile, "oval")
    assert (
        sorted(written) == sorted(path.name for path in folder.iterdir()) == ["deviations.csv", "profile.png", "profile.svg", "result.json"]
    )
    assert json.loads((folder / "result.json").read_text(encoding="utf-8")) == facts


def test_an_earlier_result_does_not_stay_beside_a_run_without_one(profile: NominalProfile, tmp_path: Path) -> None:
    write_results(tmp_path, {}, inspect_oval(profile, 0.0), profile, "oval")
    assert write_results(tmp_path, {"verdict": "uncertain"}, None, profile, "oval") == ["result.json"]
    assert [path.name for path in tmp_path.iterdir() if path.is_file()] == ["result.json"]


def test_the_results_of_another_run_are_moved_aside_and_never_overwritten(profile: NominalProfile, tmp_path: Path) -> None:
    first = {"serial_number": "../B 1", "run": "20260314-150926-0001"}
    write_results(tmp_path, first, inspect_oval(profile, 0.0), profile, "oval")
    write_results(tmp_path, {"serial_number": "B2", "run": "2"}, inspect_oval(profile, bumped()), profile, "oval")
    (aside,) = (path for path in tmp_path.iterdir() if path.is_dir())
    assert aside.name == "_B_1_20260314-150926-0001"
    assert sorted(path.name for path in aside.iterdir()) == ["deviations.csv", "profile.png", "profile.svg", "result.json"]
    assert json.loads((aside / "result.json").read_text(encoding="utf-8")) == first
    assert json.loads((tmp_path / "result.json").read_text(encoding="utf-8"))["run"] == "2"


def test_a_prepared_folder_exists_and_is_empty(tmp_path: Path) -> None:
    prepare(tmp_path / "a" / "b")
    prepare(None)
    assert list((tmp_path / "a" / "b").iterdir()) == []


@pytest.mark.parametrize("name", ["file", "file/below"])
def test_a_folder_that_takes_no_files_is_named(tmp_path: Path, name: str) -> None:
    (tmp_path / "file").write_text("", encoding="utf-8")
    with pytest.raises(PlanError, match=r"file.*: the results cannot be written .*; choose another folder with --out"):
        prepare(tmp_path / name)
