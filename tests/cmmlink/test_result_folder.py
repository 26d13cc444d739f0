"""The folder of a run's results: its placeholders, safe names, and no way out of it."""

from pathlib import Path

import pytest

from cmmlink.result_folder import check_placeholders, fixed_part, folder_of, make_room, safe_name

PATTERN = Path("results/{part}/{serial}_{run}")


def test_every_run_has_a_folder_of_its_own() -> None:
    folders = {folder_of(PATTERN, part="blade", serial_number=serial, run=run) for serial in ("B-1", "B-2") for run in ("1", "2")}
    assert len(folders) == 4
    assert Path("results/blade/B-1_1") in folders
    assert folder_of(PATTERN, part="blade", serial_number="", run="1") == Path("results/blade/1")


@pytest.mark.parametrize("name", ["../../etc", "..", ".", "", "/", "C:\\x", "a/b", "CON", "a\0b", "{run}", "x" * 500, " .. "])
def test_no_name_leads_out_of_the_folder(name: str) -> None:
    folder = folder_of(PATTERN, part=name, serial_number=name, run="7")
    assert folder.parts[0] == "results"
    assert len(folder.parts) == 3
    assert ".." not in folder.parts
    assert not set(safe_name(name)) & set('/\\:*?"<>|\0{}')
    assert 0 < len(safe_name(name)) <= 81


def test_an_unknown_placeholder_is_refused() -> None:
    check_placeholders(PATTERN)
    with pytest.raises(ValueError, match="no other placeholders than"):
        check_placeholders(Path("results/{part.__class__}{nobody}"))


def test_what_is_there_before_a_run_is_above_the_first_placeholder(tmp_path: Path) -> None:
    assert fixed_part(tmp_path / PATTERN) == tmp_path / "results"
    assert fixed_part(Path("plain/folder")) == Path("plain/folder")


def test_results_that_say_nothing_of_themselves_are_kept_all_the_same(tmp_path: Path) -> None:
    for _ in range(3):
        stood = (tmp_path / "result.json").exists()
        assert (make_room(tmp_path) is not None) == stood
        (tmp_path / "result.json").write_text("not JSON", encoding="utf-8")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["earlier", "earlier-2", "result.json"]
