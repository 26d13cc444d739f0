"""`inspect` of several files: one table, one exit status, and no file that keeps another from being inspected."""

from pathlib import Path

import numpy as np
import pytest

from cmmlink.result_keys import FilesInspected, Recorded
from tests.cmmlink.command import Ended, cmmlink
from tests.cmmlink.oval_part import oval_points, write_nominal, write_points


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("many")
    write_nominal(folder / "oval.yaml")
    bump = np.zeros(360)
    bump[100:110] = 0.2
    write_points(folder / "good.csv", oval_points(0.001 * np.sin(np.arange(360))))
    write_points(folder / "bad.csv", oval_points(bump))
    write_points(folder / "half.csv", oval_points(0.0)[:180])
    write_points(folder / "good.txt", oval_points(0.0))
    (folder / "broken.csv").write_text("x,y\n1,2\noops,3\n4,5\n", encoding="utf-8")
    return folder


def inspect(folder: Path, *names: str, with_options: tuple[object, ...] = ()) -> Ended:
    return cmmlink(
        "inspect", *(folder / name for name in names), "--nominal", folder / "oval.yaml", "--tolerance", -0.05, 0.05, *with_options
    )


@pytest.mark.parametrize(
    ("names", "code"),
    [
        (("good.csv", "good.txt"), 0),
        (("good.csv", "half.csv"), 3),
        (("half.csv", "broken.csv", "good.csv"), 2),
        (("broken.csv", "bad.csv", "half.csv"), 1),
    ],
)
def test_the_exit_status_is_that_of_the_worst_and_every_file_is_in_the_table(folder: Path, names: tuple[str, ...], code: int) -> None:
    ended = inspect(folder, *names)
    assert ended.code == code
    lines = ended.out.splitlines()
    assert [line.split()[0] for line in lines[1 : 1 + len(names)]] == list(names)


def test_each_file_has_the_result_that_it_has_alone(folder: Path) -> None:
    told = inspect(folder, "bad.csv", "half.csv", "broken.csv", with_options=("--json",))
    found = told.json()
    FilesInspected.model_validate(found)
    assert (told.code, found["exit_status"], [one["exit_status"] for one in found["files"]]) == (1, 1, [1, 3, 2])
    one = found["files"][0]["result"]
    Recorded.model_validate(one)
    alone = inspect(folder, "bad.csv", with_options=("--json",)).json()
    same = set(alone) - {"run", "chain_sha256", "signature", "measured_at"}
    assert {key: one[key] for key in same} == {key: alone[key] for key in same}


def test_notes_and_reasons_stand_beside_the_table(folder: Path) -> None:
    words = inspect(folder, "bad.csv", "good.txt", with_options=("--unit", "mm")).out
    assert "  bad.csv: 10 points lie beyond the limits" in words
    assert words.count("read in mm, as asked") == 2, "of both files, though in one table"
    assert "2 files: 1 NOT CONFORM, 1 CONFORM" in words


def test_a_file_that_cannot_be_used_is_told_and_the_others_are_inspected(folder: Path) -> None:
    ended = inspect(folder, "broken.csv", "nothing.csv", "good.csv", with_options=("--json",))
    files = ended.json()["files"]
    assert [one["error"] and one["error"]["kind"] for one in files] == ["unusable", "unusable", None]
    assert "line 3" in files[0]["error"]["message"]
    assert [line.rpartition(": ")[2] for line in ended.err.splitlines()][1] == "no such file"


def test_files_of_one_name_have_folders_of_their_own(folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "other").mkdir()
    write_points(tmp_path / "other" / "good.csv", oval_points(0.0))
    written: list[Path] = []
    monkeypatch.setattr("cmmlink.report.write_run", lambda its_folder, _run, _pictures: written.append(its_folder))
    told = ("--nominal", folder / "oval.yaml", "--tolerance", -0.05, 0.05, "--out", tmp_path / "out")
    ended = cmmlink("inspect", folder / "good.csv", tmp_path / "other" / "good.csv", *told)
    assert ended.code == 0
    assert written == [tmp_path / "out" / "good.csv", tmp_path / "out" / "good.csv_2"]
    assert f"results in {tmp_path / 'out'}, a folder for each file" in ended.out
