"""What a machine was told stands in the records behind the end of its run: whatever is altered of it is found, and no other passes."""

import shutil
import sqlite3
from contextlib import closing
from datetime import UTC, datetime
from pathlib import Path

import pytest

from cmmlink.events import Answered
from cmmlink.record.backup import merge
from cmmlink.record.chain import Draft
from cmmlink.record.machine_answer import answer_of, keep_answer
from cmmlink.record.recorder import end_draft
from cmmlink.record.seal import seal_of
from cmmlink.record.store import FILE_NAME, Store
from inspection import Verdict
from tests.cmmlink.record.sealed import Clock, add_signed, forge, state_of, trust

RUN = "a-0001"
NOON = datetime(2026, 3, 14, 15, 9, 27, tzinfo=UTC)
TEXT = (
    "O9100 (CMMLINK ANSWER)\r\n(RUN a-0001)\r\n#150=%d. (1 CONFORM 2 NOT CONFORM 3 NOT PROVEN 9 NOT JUDGED)\r\n#152=7. (REQUEST)\r\nM99\r\n"
)
SIGNED = "intact and signed"


def told(folder: Path, given: Answered, *, verdict: str = "conform", state: str = "complete", times: int = 1) -> Path:
    """A signed run with a verdict, and what came of its answer."""
    add_signed(folder, RUN, ended=False)
    with Store(folder, writing=True, epoch_s=lambda: 99.0) as store:
        seal = seal_of(store, station="cmm-1", key=None)
        found = {"received": 1, "registration": {"rms_mm": 0.0}, "verdict": verdict, "coverage": 1.0}
        store.append([end_draft(RUN, state, "", NOON, found)], seal.sign)
        for _ in range(times):
            assert keep_answer(store, seal, RUN, given) == ""
    return folder


def given(verdict: Verdict | None, code: int, state: str = "sent") -> Answered:
    problem = "" if state == "sent" else "there is no folder"
    return Answered("sent" if state == "sent" else "not sent", 7, NOON, problem, verdict, TEXT % code)


@pytest.fixture(scope="module")
def passed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return told(tmp_path_factory.mktemp("passed") / "station", given(Verdict.CONFORM, 1))


def test_an_answer_is_on_record_as_it_was_written_and_signed(passed: Path) -> None:
    with Store(passed, writing=False, epoch_s=lambda: 0.0) as store:
        kept = answer_of(store, RUN)
        (record,) = store.records(RUN, "answer")
    assert kept == {
        "request": 7,
        "sent": True,
        "verdict": "conform",
        "at": "2026-03-14T15:09:27.000Z",
        "problem": None,
        "text": TEXT % 1,
        "chain_sha256": record.sha256.hex(),
    }
    assert trust(passed)["signatures"]["unsigned"] == []
    assert state_of(passed) == SIGNED


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("request", "8"),
        ("sent", "json('false')"),
        ("verdict", "'nonconform'"),
        ("at", "'2026-03-14T15:09:28.000Z'"),
        ("problem", "'away'"),
        ("text", "'M99'"),
        ("more", "1"),
    ],
)
def test_whatever_is_altered_of_it_is_found_though_every_hash_was_computed_anew(passed: Path, key: str, value: str, tmp_path: Path) -> None:
    station = Path(shutil.copytree(passed, tmp_path / "station"))
    forge(station, f"UPDATE record SET body = CAST(json_set(body, '$.{key}', {value}) AS BLOB) WHERE kind = 'answer'")
    assert state_of(station) == "altered"


def test_an_answer_that_was_taken_away_is_missed_by_its_signature(passed: Path, tmp_path: Path) -> None:
    station = Path(shutil.copytree(passed, tmp_path / "station"))
    forge(station, "DELETE FROM record WHERE kind = 'answer'", number_anew=True)
    assert state_of(station) == "altered"


def test_an_answer_that_nobody_signed_is_told_as_such(passed: Path, tmp_path: Path) -> None:
    station = Path(shutil.copytree(passed, tmp_path / "station"))
    forge(station, "DELETE FROM record WHERE kind = 'countersignature'", number_anew=True)
    assert state_of(station) == "intact but unsigned"


def test_an_answer_goes_with_its_run_when_that_is_merged(passed: Path, tmp_path: Path) -> None:
    add_signed(tmp_path / "archive", "x-0001", station="cmm-2")
    merge(passed, tmp_path / "archive", Clock())
    with Store(tmp_path / "archive", writing=False, epoch_s=lambda: 0.0) as store:
        assert (answer_of(store, RUN) or {})["text"] == TEXT % 1
    assert trust(tmp_path / "archive")["signatures"]["unsigned"] == []


@pytest.mark.parametrize("sent", ["sent", "not sent"])
@pytest.mark.parametrize(
    ("verdict", "state"), [("nonconform", "complete"), ("uncertain", "complete"), ("conform", "aborted"), ("conform", "interrupted")]
)
def test_an_answer_that_passes_a_part_whose_run_did_not_is_found_though_it_is_signed(
    verdict: str, state: str, sent: str, tmp_path: Path
) -> None:
    """The one who signs may be wrong, or a thief: the verdict on record rules."""
    wrong = told(tmp_path, given(Verdict.CONFORM if sent == "sent" else None, 1, sent), verdict=verdict, state=state)
    found = trust(wrong)
    assert found["state"] == "altered"
    assert "passes the part to the machine, but the run did not" in found["first"]["message"]


def test_the_words_of_an_answer_count_as_much_as_what_is_said_of_them(tmp_path: Path) -> None:
    assert trust(told(tmp_path, given(Verdict.NONCONFORM, 1), verdict="nonconform"))["state"] == "altered"


@pytest.mark.parametrize(("verdict", "code"), [("nonconform", 2), ("uncertain", 3)])
def test_what_passes_nothing_may_stand_behind_any_run(verdict: str, code: int, tmp_path: Path) -> None:
    assert state_of(told(tmp_path, given(Verdict[verdict.upper()], code), verdict=verdict)) == SIGNED


def test_an_answer_for_which_the_records_have_no_room_is_told_and_ends_nothing(tmp_path: Path) -> None:
    """Nor is half of it on record, without its signature."""
    folder = told(tmp_path, given(Verdict.CONFORM, 1), times=0)
    full = "WHEN NEW.kind = 'countersignature' BEGIN SELECT RAISE(ABORT, 'the disk is full'); END"
    with closing(sqlite3.connect(folder / FILE_NAME)) as connection:
        connection.execute(f"CREATE TRIGGER full BEFORE INSERT ON record {full}")
    with Store(folder, writing=True, epoch_s=lambda: 99.0) as store:
        assert "the disk is full" in keep_answer(store, seal_of(store, station="cmm-1", key=None), RUN, given(Verdict.CONFORM, 1))
        assert answer_of(store, RUN) is None
    with closing(sqlite3.connect(folder / FILE_NAME)) as connection:
        connection.execute("DROP TRIGGER full")
    assert state_of(folder) == SIGNED


def test_no_run_answers_twice(tmp_path: Path) -> None:
    found = trust(told(tmp_path, given(Verdict.CONFORM, 1), times=2))
    assert (found["state"], "is a second answer" in found["first"]["message"]) == ("altered", True)


@pytest.mark.parametrize("body", [b"", b"[]", b'{"sent": true}', b"\xff"])
def test_what_is_no_answer_is_found(body: bytes, tmp_path: Path) -> None:
    folder = told(tmp_path, given(Verdict.CONFORM, 1), times=0)
    with Store(folder, writing=True, epoch_s=lambda: 99.0) as store:
        store.append([Draft(RUN, "answer", body)], seal_of(store, station="cmm-1", key=None).countersign)
    assert state_of(folder) == "altered"
