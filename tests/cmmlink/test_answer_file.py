"""The file in which a machine finds the verdict: whole or as it was, never a file of somebody else's, and told when it cannot be kept."""

import errno
import os
import sys
import time
from collections.abc import Callable
from pathlib import Path
from unittest.mock import patch

import pytest

from cmmlink.answer_file import replace_answer, withdraw_answer
from cmmlink.errors import AnswerError

NO_SPACE = OSError(errno.ENOSPC, "No space left on device")
FIRST, SECOND = (b"O9100 (CMMLINK ANSWER)\r\n#152=%d.\r\nM99\r\n" % number for number in (1, 2))


@pytest.fixture
def file(tmp_path: Path) -> Path:
    return tmp_path / "O9100.nc"


def test_an_answer_takes_the_place_of_an_earlier_one_and_leaves_nothing_beside_it(file: Path) -> None:
    for data in (FIRST, SECOND, SECOND):
        replace_answer(file, data)
        assert file.read_bytes() == data
    assert os.listdir(file.parent) == [file.name]


def test_an_empty_file_of_a_full_disk_makes_way(file: Path) -> None:
    file.touch()
    replace_answer(file, FIRST)
    assert file.read_bytes() == FIRST


def test_an_earlier_answer_is_taken_away_where_there_is_no_room_for_another(file: Path) -> None:
    replace_answer(file, FIRST)
    with patch.object(os, "fsync", side_effect=NO_SPACE):
        withdraw_answer(file, SECOND)
        withdraw_answer(file, SECOND)
    assert os.listdir(file.parent) == []


def test_an_earlier_answer_that_cannot_be_withdrawn_is_told(file: Path) -> None:
    replace_answer(file, FIRST)
    with (
        patch.object(os, "fsync", side_effect=NO_SPACE),
        patch.object(Path, "unlink", side_effect=PermissionError(errno.EACCES, "Permission denied")),
        pytest.raises(AnswerError, match="No space left"),
    ):
        withdraw_answer(file, SECOND)
    assert file.read_bytes() == FIRST


@pytest.mark.parametrize("put", [replace_answer, withdraw_answer])
@pytest.mark.parametrize("content", [b"O1234 (MAIN PROGRAM)\r\nM30\r\n", b"%\r\nO9100 (CMMLINK ANSWER)\r\n", b"\x00" * 300, b"x"])
def test_what_is_no_answer_is_never_replaced(content: bytes, put: Callable[[Path, bytes], None], file: Path) -> None:
    file.write_bytes(content)
    with pytest.raises(AnswerError, match="is no answer of cmmlink's"):
        put(file, FIRST)
    assert file.read_bytes() == content


@pytest.mark.parametrize("put", [replace_answer, withdraw_answer])
def test_a_folder_that_is_away_is_told_and_not_made_anew(put: Callable[[Path, bytes], None], file: Path) -> None:
    away = file.parent / "share" / file.name
    with pytest.raises(AnswerError, match=r"there is no folder .*share"):
        put(away, FIRST)
    assert not away.parent.exists()


def test_a_folder_in_the_place_of_the_file_is_told(file: Path) -> None:
    file.mkdir()
    with pytest.raises(AnswerError, match="cannot be kept there"):
        replace_answer(file, FIRST)


@pytest.mark.parametrize("call", ["fsync", "replace"])
def test_a_call_that_fails_leaves_the_earlier_answer_and_nothing_beside_it(call: str, file: Path) -> None:
    replace_answer(file, FIRST)
    with patch.object(os, call, side_effect=NO_SPACE), pytest.raises(AnswerError, match="No space left"):
        replace_answer(file, SECOND)
    assert (file.read_bytes(), os.listdir(file.parent)) == (FIRST, [file.name])


def test_a_file_that_is_held_open_is_tried_again_until_it_is_let_go(file: Path) -> None:
    """As Windows refuses to rename onto a file that somebody reads."""
    real, refused, waited = os.replace, iter((True, True, False)), list[float]()

    def replace(*paths: Path) -> None:
        if next(refused):
            raise PermissionError(errno.EACCES, "the file is in use")
        real(*paths)

    with patch.object(os, "replace", replace):
        replace_answer(file, FIRST, waited.append)
    assert (file.read_bytes(), len(waited)) == (FIRST, 2)


def test_a_file_that_nobody_lets_go_is_told_in_the_end(file: Path) -> None:
    replace_answer(file, FIRST)
    with (
        patch.object(os, "replace", side_effect=PermissionError(errno.EACCES, "the file is in use")),
        pytest.raises(AnswerError, match="the file is in use"),
    ):
        replace_answer(file, SECOND, lambda _: None)
    assert (file.read_bytes(), os.listdir(file.parent)) == (FIRST, [file.name])


def test_an_answer_that_another_station_replaced_at_once_was_not_sent(file: Path) -> None:
    real = os.replace

    def replace(new: Path, place: Path) -> None:
        real(new, place)
        place.write_bytes(FIRST)

    with patch.object(os, "replace", replace), pytest.raises(AnswerError, match="something else was written there"):
        replace_answer(file, SECOND)


def test_what_a_killed_process_left_goes_after_a_while(file: Path) -> None:
    young, old = file.with_name(".O9100.nc.11.new"), file.with_name(".O9100.nc.12.new")
    for left in (young, old):
        left.write_bytes(SECOND)
    long_ago = time.time() - 3600
    os.utime(old, (long_ago, long_ago))
    replace_answer(file, FIRST)
    assert sorted(os.listdir(file.parent)) == [young.name, file.name]


@pytest.mark.skipif(sys.platform == "win32" or (hasattr(os, "geteuid") and os.geteuid() == 0), reason="folders bar nobody here")
def test_a_folder_that_may_not_be_written_is_told(file: Path) -> None:
    file.parent.chmod(0o500)
    with pytest.raises(AnswerError, match="Permission denied"):
        replace_answer(file, FIRST)
    file.parent.chmod(0o700)
