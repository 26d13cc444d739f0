"""Which folder compiled code is kept in, and which older ones go."""

import os
from pathlib import Path

import pytest

from inspection.kernels.cache_folder import places_for, stamp_of, stamped_folder


@pytest.fixture
def package(tmp_path: Path) -> Path:
    package = tmp_path / "package"
    package.mkdir()
    (package / "a.py").write_text("A = 1\n")
    (package / "b.py").write_text("B = 2\n")
    return package


def test_the_stamp_changes_with_the_content_and_the_name_of_any_file(package: Path) -> None:
    stamps = [stamp_of(package)]
    (package / "b.py").write_text("B = 3\n")
    stamps.append(stamp_of(package))
    (package / "b.py").rename(package / "c.py")
    stamps.append(stamp_of(package))
    (package / "d.py").touch()
    stamps.append(stamp_of(package))
    assert len(set(stamps)) == 4
    assert all(len(stamp) == 16 for stamp in stamps)


def test_the_stamp_depends_on_nothing_else(package: Path, tmp_path: Path) -> None:
    before = stamp_of(package)
    os.utime(package / "a.py", (1, 1))
    (package / "__pycache__").mkdir()
    assert stamp_of(package) == before
    assert stamp_of(package.rename(tmp_path / "elsewhere")) == before


def test_text_that_moves_from_one_file_to_the_next_changes_the_stamp(package: Path) -> None:
    before = stamp_of(package)
    (package / "a.py").write_text("A = 1\nB = 2\n")
    (package / "b.py").write_text("")
    assert stamp_of(package) != before


def test_a_package_without_files_has_no_stamp(tmp_path: Path) -> None:
    assert stamp_of(tmp_path / "archive.zip") == ""


def test_the_first_place_that_can_be_written_is_taken(tmp_path: Path) -> None:
    blocked = tmp_path / "file"
    blocked.write_text("not a folder")
    places = (blocked / "x", tmp_path / "one", tmp_path / "two")
    assert stamped_folder("s", places) == tmp_path / "one" / "compiled-s"
    assert (tmp_path / "one" / "compiled-s").is_dir()
    assert not (tmp_path / "two").exists()
    assert stamped_folder("s", (blocked / "x",)) is None


def test_a_new_folder_takes_the_place_of_older_ones_that_lie_idle(tmp_path: Path) -> None:
    idle, lately, foreign = (tmp_path / name for name in ("compiled-idle", "compiled-lately", "another"))
    for folder in (idle, lately, foreign):
        (folder / "kernels").mkdir(parents=True)
        (folder / "kernels" / "code.nbc").touch()
    for path in (idle, *idle.rglob("*"), foreign, *foreign.rglob("*"), lately, lately / "kernels"):
        os.utime(path, (1000, 1000))
    stamped_folder("new", (tmp_path,))
    assert sorted(path.name for path in tmp_path.iterdir()) == ["another", "compiled-lately", "compiled-new"]


def test_a_folder_that_is_there_removes_nothing(tmp_path: Path) -> None:
    stamped_folder("one", (tmp_path,))
    idle = tmp_path / "compiled-idle"
    idle.mkdir()
    os.utime(idle, (1000, 1000))
    stamped_folder("one", (tmp_path,))
    assert idle.is_dir()


def test_places_are_that_of_the_package_then_that_of_the_user(package: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    first, second = places_for(package, "")
    assert first == package / "__pycache__"
    assert second.is_relative_to(Path.home())
    assert second.parent.name == "cmmlink"
    assert next(iter(places_for(package, "/chosen"))).parent == Path("/chosen")

    def homeless() -> Path:
        raise RuntimeError("no home")

    monkeypatch.setattr(Path, "home", homeless)
    assert list(places_for(package, "")) == [first]


def test_two_installations_share_no_folder_of_the_user(package: Path, tmp_path: Path) -> None:
    other = tmp_path / "other" / "package"
    other.mkdir(parents=True)
    assert list(places_for(package, ""))[1] != list(places_for(other, ""))[1]
