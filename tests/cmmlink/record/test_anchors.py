"""Heads that stand outside the records: told once, told later, and held against what is there."""

import json
import shutil
import threading
from collections.abc import Sequence
from pathlib import Path

import pytest

from cmmlink.errors import PlanError
from cmmlink.record import anchors
from cmmlink.record.anchors import WAITING, Head, anchor_ends, anchors_of, heads_in, tell_heads
from cmmlink.record.backup import back_up, merge
from cmmlink.record.recorder import RecordReference
from cmmlink.record.seal import seal_of
from cmmlink.record.store import FILE_NAME, Store
from tests.cmmlink.record.sealed import Clock, add_signed, forge, state_of, trust

MOMENT = "2026-03-14T15:09:27.000Z"


def tell(folder: Path, place: Path, *runs: RecordReference, station: str = "cmm-1") -> list[str]:
    """Tell one place the ends of runs; the problems of that."""
    with Store(folder, writing=True, epoch_s=lambda: 7.0) as store:
        return [told.problem for told in anchor_ends(store, seal_of(store, station=station, key=None), [str(place)], MOMENT, runs)]


@pytest.fixture
def anchored(tmp_path: Path) -> tuple[Path, Path]:
    """A folder with three runs, and the anchor that was told each."""
    folder, anchor = tmp_path / "station", tmp_path / "heads.txt"
    for run in ("a-0001", "b-0002", "c-0003"):
        assert tell(folder, anchor, add_signed(folder, run)) == [""]
    return folder, anchor


def test_a_line_has_the_documented_words(tmp_path: Path) -> None:
    anchor = tmp_path / "heads.txt"
    signed, unsigned = add_signed(tmp_path, "a-0001"), add_signed(tmp_path, "b-0002", key=tmp_path / "absent.pem")
    assert tell(tmp_path, anchor, signed) == tell(tmp_path, anchor, unsigned) == [""]
    assert signed.signature is not None
    assert anchor.read_text(encoding="ascii").splitlines() == [
        f"{MOMENT} cmm-1 a-0001 {signed.chain_sha256} {signed.signature['key_id']}",
        f"{MOMENT} cmm-1 b-0002 {unsigned.chain_sha256} -",
    ]
    with Store(tmp_path, writing=False, epoch_s=lambda: 0.0) as store:
        assert [(told.place, told.problem) for told in anchors_of(store, "a-0001")] == [(str(anchor), "")]


def test_what_others_left_half_written_stays_and_the_line_is_whole(tmp_path: Path) -> None:
    anchor = tmp_path / "heads.txt"
    anchor.write_bytes(b"2026-03-14T15:09:26.000Z cmm-9 half")
    told = add_signed(tmp_path, "a-0001")
    assert tell(tmp_path, anchor, told) == [""]
    assert anchor.read_bytes().startswith(b"2026-03-14T15:09:26.000Z cmm-9 half\n2026")
    assert [head.chain_sha256 for head in heads_in(anchor)] == [told.chain_sha256]


def test_a_place_that_is_not_there_is_told_at_the_next_run_every_line_once(tmp_path: Path) -> None:
    share = tmp_path / "share"
    anchor = share / "heads.txt"
    first, second = (add_signed(tmp_path, run) for run in ("a-0001", "b-0002"))
    (problem,) = tell(tmp_path, anchor, first)
    assert problem
    assert json.loads((tmp_path / WAITING).read_text(encoding="utf-8"))[str(anchor)][0].split()[2] == "a-0001"
    share.mkdir()
    assert tell(tmp_path, anchor, second) == [""]
    assert [head.run for head in heads_in(anchor)] == ["a-0001", "b-0002"]
    assert not (tmp_path / WAITING).exists()
    assert state_of(tmp_path, anchor=anchor) == "intact and signed"


def test_what_waits_for_a_place_that_the_next_plan_does_not_name_is_told_all_the_same(tmp_path: Path) -> None:
    share = tmp_path / "share"
    assert tell(tmp_path, share / "heads.txt", add_signed(tmp_path, "a-0001")) != [""]
    share.mkdir()
    with Store(tmp_path, writing=True, epoch_s=lambda: 7.0) as store:
        assert anchor_ends(store, seal_of(store, station="cmm-1", key=None), [], MOMENT, [add_reference()]) == ()
    assert [head.run for head in heads_in(share / "heads.txt")] == ["a-0001"]


def add_reference() -> RecordReference:
    return RecordReference("b-0002", "0" * 64, "", "", {})


def test_a_place_that_does_not_answer_keeps_nobody_waiting(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A share whose server is gone holds whoever writes to it: here until the test lets go."""
    dead, well, let_go, add = tmp_path / "dead.txt", tmp_path / "well.txt", threading.Event(), anchors._add_lines

    def held(place: Path, lines: Sequence[str]) -> str:
        return add(place, lines) if place != dead or let_go.wait(100.0) else ""

    monkeypatch.setattr(anchors, "_add_lines", held)
    told, _ = tell_heads(tmp_path, [str(dead), str(well)], [Head(MOMENT, "cmm-1", "a-0001", "0" * 64, "")], patience_s=2.0)
    assert [one.problem for one in told] == ["it did not answer within 2 s", ""]
    assert list(json.loads((tmp_path / WAITING).read_text(encoding="utf-8"))) == [str(dead)]
    let_go.set()
    for thread in threading.enumerate():
        if thread.name == "anchor":
            thread.join(30.0)


def test_the_anchor_agrees_and_says_up_to_where(anchored: tuple[Path, Path]) -> None:
    folder, anchor = anchored
    add_signed(folder, "d-0004")
    found = trust(folder, anchor=anchor)
    assert found["state"] == "intact and signed"
    assert found["anchors"] == {"heads": 3, "missing": [], "last": "c-0003", "others": {}}


CUT = {
    "the last run": "DELETE FROM record WHERE run = 'c-0003'",
    "the last two": "DELETE FROM record WHERE run IN ('b-0002', 'c-0003')",
    "the end of the last": "DELETE FROM record WHERE run = 'c-0003' AND kind NOT IN ('run', 'plan')",
    "all": "DELETE FROM record",
}


@pytest.mark.parametrize("statement", CUT.values(), ids=CUT)
@pytest.mark.parametrize("hidden", [True, False])
def test_what_was_cut_off_is_told_as_that(anchored: tuple[Path, Path], statement: str, hidden: bool) -> None:
    """Hidden by SQLite's own count, or not."""
    folder, anchor = anchored
    forge(folder, statement)
    if not hidden:
        forge(folder, "UPDATE sqlite_sequence SET seq = 999", count_anew=False)
    elif statement != CUT["all"]:
        assert state_of(folder) in ("intact and signed", "intact but unsigned"), "this is what the file alone cannot show"
    found = trust(folder, anchor=anchor)
    assert (found["state"], found["altered"]) == ("cut off", True)
    assert "c-0003" in found["anchors"]["missing"]


def test_an_older_backup_in_place_of_the_records_is_told_as_cut_off(tmp_path: Path) -> None:
    folder, anchor = tmp_path / "station", tmp_path / "heads.txt"
    tell(folder, anchor, add_signed(folder, "a-0001"))
    back_up(folder, tmp_path / "older.sqlite", Clock())
    tell(folder, anchor, add_signed(folder, "b-0002"))
    for left in folder.glob(f"{FILE_NAME}-*"):
        left.unlink()
    shutil.copy(tmp_path / "older.sqlite", folder / FILE_NAME)
    assert state_of(folder) == "intact and signed"
    found = trust(folder, anchor=anchor)
    assert (found["state"], found["anchors"]["missing"]) == ("cut off", ["b-0002"])
    tell(folder, anchor, add_signed(folder, "c-0002"))
    assert state_of(folder, anchor=anchor) == "cut off", "also when the station went on from there"


def test_records_begun_anew_are_told_as_cut_off(anchored: tuple[Path, Path]) -> None:
    folder, anchor = anchored
    shutil.rmtree(folder)
    tell(folder, anchor, add_signed(folder, "d-0001"))
    found = trust(folder, anchor=anchor)
    assert (found["state"], found["anchors"]["missing"]) == ("cut off", ["a-0001", "b-0002", "c-0003"])


def test_a_run_written_anew_without_its_signature_does_not_agree(anchored: tuple[Path, Path]) -> None:
    folder, anchor = anchored
    forge(
        folder,
        "DELETE FROM record WHERE kind = 'signature'",
        "UPDATE record SET body = x'71' WHERE kind = 'points' AND run = 'c-0003'",
        number_anew=True,
    )
    assert state_of(folder) == "intact but unsigned"
    found = trust(folder, anchor=anchor)
    assert found["state"] == "altered"
    assert "when it was anchored" in found["first"]["message"]


def test_heads_of_other_stations_in_one_anchor_are_counted_and_miss_nothing(anchored: tuple[Path, Path], tmp_path: Path) -> None:
    folder, anchor = anchored
    tell(tmp_path / "two", anchor, add_signed(tmp_path / "two", "x-0001", station="cmm-2"), station="cmm-2")
    tell(tmp_path / "two", anchor, add_signed(tmp_path / "two", "x-0002", station="cmm-2"), station="cmm-2")
    assert trust(folder, anchor=anchor)["anchors"] == {"heads": 3, "missing": [], "last": "c-0003", "others": {"cmm-2": 2}}
    shutil.copytree(tmp_path / "two", tmp_path / "part")
    forge(tmp_path / "part", "DELETE FROM record WHERE run = 'x-0002'")
    merge(tmp_path / "part", folder, Clock())
    found = trust(folder, anchor=anchor)
    assert (found["state"], found["anchors"]["heads"]) == ("signed by another key", 4), "the merged run agrees; the other is elsewhere"


def test_a_single_run_is_held_against_its_own_head(anchored: tuple[Path, Path]) -> None:
    folder, anchor = anchored
    found = trust(folder, "b-0002", anchor=anchor)
    assert (found["state"], found["anchors"]["heads"], found["anchors"]["last"]) == ("intact and signed", 1, "b-0002")


@pytest.mark.parametrize("content", [b"", b"no head\n", b"\xff\xfe\n"])
def test_a_file_without_a_head_is_no_anchor(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "heads.txt").write_bytes(content)
    with pytest.raises(PlanError, match="there is no head of a run in it"):
        heads_in(tmp_path / "heads.txt")
    with pytest.raises(PlanError, match="cannot be read"):
        heads_in(tmp_path / "absent.txt")


@pytest.mark.parametrize("content", [b"", b"[]", b'{"a": 1}', b'{"a": ["x"]}', b"\xff"])
def test_what_waits_and_cannot_be_read_keeps_nothing_from_being_told(tmp_path: Path, content: bytes) -> None:
    (tmp_path / WAITING).write_bytes(content)
    assert tell(tmp_path, tmp_path / "heads.txt", add_signed(tmp_path, "a-0001")) == [""]
    assert [head.run for head in heads_in(tmp_path / "heads.txt")] == ["a-0001"]
