"""Files that take their places together: of one run or of another, never half and half; what is not whole is not there."""

import itertools
import os
import subprocess
import sys
import threading
from pathlib import Path

import pytest

from cmmlink.errors import PlanError
from cmmlink.result_files import new_files
from cmmlink.result_folder import make_room

NAMES = ("result.json", "deviations.csv", "section-001_5mm/contours.csv")


def write(folder: Path, words: str) -> None:
    with new_files(folder, make_room) as files:
        for name in NAMES:
            files(name).write_text(words, encoding="utf-8")


def read(folder: Path) -> set[str]:
    return {(folder / name).read_text(encoding="utf-8") for name in NAMES}


def hidden(folder: Path) -> list[Path]:
    return list(folder.glob(".*"))


def test_files_are_seen_once_all_are_whole(tmp_path: Path) -> None:
    folder = tmp_path / "new" / "one"
    with new_files(folder) as files:
        files("a").write_text("1", encoding="utf-8")
        files("b/c").write_text("2", encoding="utf-8")
        assert not (folder / "a").exists()
    assert files.names == ["a", "b/c"]
    assert (folder / "a").read_text(encoding="utf-8") + (folder / "b" / "c").read_text(encoding="utf-8") == "12"
    assert hidden(folder) == []


def test_of_files_that_broke_off_those_that_are_whole_are_there_and_what_stood_there_is_kept(tmp_path: Path) -> None:
    def break_off() -> None:
        with new_files(tmp_path, make_room) as files:
            files("result.json").write_text("now", encoding="utf-8")
            for path in files.together("deviations.csv", "profile.png"):
                path.write_text("half of it", encoding="utf-8")
            raise OSError(28, "full")

    write(tmp_path, "earlier")
    with pytest.raises(OSError, match="full"):
        break_off()
    assert not (tmp_path / "profile.png").exists()
    assert (tmp_path / "result.json").read_text(encoding="utf-8") == "now"
    assert not (tmp_path / "deviations.csv").exists(), "neither half of the new one, nor the old one beside the new result"
    assert read(tmp_path / "earlier") == {"earlier"}
    assert hidden(tmp_path) == []


def test_threads_that_write_to_one_folder_leave_the_files_of_one_and_keep_those_of_the_others(tmp_path: Path) -> None:
    barrier = threading.Barrier(4)

    def work(number: int) -> None:
        for each in range(5):
            barrier.wait(30)
            write(tmp_path, f"{number} {each}")

    threads = [threading.Thread(target=work, args=(number,)) for number in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(60)
    folders = [tmp_path, *(path for path in tmp_path.iterdir() if path.name.startswith("earlier"))]
    found = [read(folder) for folder in folders]
    assert all(len(words) == 1 for words in found)
    assert set().union(*found) == {f"{number} {each}" for number, each in itertools.product(range(4), range(5))}
    assert hidden(tmp_path) == []


def test_another_process_that_moves_its_files_is_waited_for_and_told_of(tmp_path: Path) -> None:
    code = (
        "import sys, pathlib; from cmmlink.result_files import new_files\n"
        "def wait(_): print('holds', flush=True); sys.stdin.read()\n"
        "with new_files(pathlib.Path(sys.argv[1]), wait) as files: files('result.json').write_text('theirs')"
    )
    command = [sys.executable, "-c", code, str(tmp_path)]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as other:
        assert other.stdout is not None
        assert other.stdin is not None
        assert other.stdout.readline() == "holds\n"
        with pytest.raises(PlanError, match="another process writes its results there"), new_files(tmp_path, patience_s=0.1) as files:
            files("result.json").write_text("ours", encoding="utf-8")
        assert not (tmp_path / "result.json").exists()
        other.kill()  # the lock ends with its process
    with new_files(tmp_path, make_room, patience_s=0.1) as files:
        files("result.json").write_text("ours", encoding="utf-8")
    assert (tmp_path / "result.json").read_text(encoding="utf-8") == "ours"


def test_what_a_killed_process_left_behind_is_removed_a_day_later(tmp_path: Path) -> None:
    for name, age_s in ((".cmmlink-young", 3600), (".cmmlink-old", 100_000), (".other-old", 100_000)):
        (tmp_path / name).mkdir()
        (tmp_path / name / "deviations.csv").write_text("half", encoding="utf-8")
        moment = (tmp_path / name).stat().st_mtime - age_s
        os.utime(tmp_path / name, (moment, moment))
    write(tmp_path, "new")
    assert sorted(path.name for path in hidden(tmp_path)) == [".cmmlink-young", ".other-old"]
