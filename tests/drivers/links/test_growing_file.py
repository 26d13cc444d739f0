"""A file that a control writes, read as it grows."""

from pathlib import Path
from threading import Event

import pytest

from drivers.links.growing_file import LARGEST_READ, GrowingFile, OpenFile


def opened(path: Path, *, existing: bool = False) -> OpenFile:
    return GrowingFile(path, existing=existing, sleep=lambda _: None).open(1.0, Event())


def test_what_is_written_after_the_opening_is_read_and_nothing_else(tmp_path: Path) -> None:
    path = tmp_path / "prints.txt"
    path.write_bytes(b"of another part\r\n")
    file = opened(path)
    assert file.read() == b""
    with path.open("ab") as out:
        out.write(b"START\r\nG8")
    assert (file.read(), file.read()) == (b"START\r\nG8", b"")
    with path.open("ab") as out:
        out.write(b"01\r\n")
    assert (file.read(), file.read()) == (b"01\r\n", b"")


def test_what_stands_in_it_already_is_read_where_that_is_asked_for(tmp_path: Path) -> None:
    (tmp_path / "prints.txt").write_bytes(b"x" * (LARGEST_READ + 9))
    file = opened(tmp_path / "prints.txt", existing=True)
    assert [len(file.read()) for _ in range(3)] == [LARGEST_READ, 9, 0]


def test_the_file_need_not_be_there_yet(tmp_path: Path) -> None:
    file = opened(tmp_path / "prints.txt")
    assert file.read() == b""
    (tmp_path / "prints.txt").write_bytes(b"START\r\n")
    assert file.read() == b"START\r\n"


@pytest.mark.parametrize("new", [b"N", b"START of a longer file than the old one was\r\n"])
def test_a_control_may_begin_its_file_anew_for_each_part(new: bytes, tmp_path: Path) -> None:
    path = tmp_path / "prints.txt"
    path.write_bytes(b"of another part\r\n")
    file = opened(path)
    path.write_bytes(new)
    assert file.read() + file.read() == new


@pytest.mark.parametrize("new", [b"", b"N", b"another beginning of the file\r\n", None])
def test_a_file_that_no_longer_holds_what_was_read_is_lost(new: bytes | None, tmp_path: Path) -> None:
    path = tmp_path / "prints.txt"
    file = opened(path)
    path.write_bytes(b"START\r\nG800\r\n")
    assert file.read() == b"START\r\nG800\r\n"
    path.unlink()
    if new is not None:
        path.write_bytes(new)
    with pytest.raises(OSError, match="written anew"):
        file.read()


def test_a_folder_that_is_not_there_is_told_at_once(tmp_path: Path) -> None:
    with pytest.raises(NotADirectoryError, match="no folder"):
        opened(tmp_path / "share" / "prints.txt")
