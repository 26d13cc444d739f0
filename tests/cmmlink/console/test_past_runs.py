"""The runs on record as the console asks for them."""

import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest

from cmmlink.console.past_runs import PastRuns
from cmmlink.errors import RunError, StoreError
from cmmlink.events import RunFinished
from cmmlink.record import (
    Draft,
    Record,
    Store,
    find_run,
    keep_judgement,
    open_to_read,
    open_to_record,
    recorded_run,
    replay_run,
)
from cmmlink.words import local_words
from tests.cmmlink.command import cmmlink
from tests.cmmlink.oval_part import oval_points, write_nominal, write_points
from tests.cmmlink.recorded import Script, no_decoder, record, scan_arrivals, today


@pytest.fixture
def past(tmp_path: Path) -> PastRuns:
    return PastRuns(tmp_path / "records", no_decoder, time.monotonic, today)


def test_a_folder_without_runs_has_no_history(past: PastRuns) -> None:
    assert list(past.runs()) == []
    with pytest.raises(RunError):
        past.open_run("last")


def test_a_run_that_is_being_recorded_is_listed_as_running_and_later_as_what_it_became(past: PastRuns) -> None:
    during = []

    def look(event: object) -> None:
        if isinstance(event, RunFinished):
            during.append((past.runs()[0], past.open_run("last")))

    outcome, _ = record(past.folder, Script(*scan_arrivals()), before=[look])
    row, opened = during[0]
    assert (row.state, row.verdict, row.worst_mm) == ("running", None, None)
    assert (opened.ended.ending, opened.ended.blocks) == ("running", None)
    assert opened.ended.result["verdict"] == "uncertain"
    after = past.runs()[0]
    assert (after.run, after.state, after.received) == (row.run, "complete", outcome.counts.received)
    assert outcome.result is not None
    assert after.verdict == outcome.result.verdict.word
    assert past.open_run("last").ended.ending == "complete"


def test_a_run_whose_end_a_full_disk_does_not_take_is_interrupted_and_never_running(
    past: PastRuns, monkeypatch: pytest.MonkeyPatch
) -> None:
    append = Store.append

    def append_until_the_end(store: Store, drafts: Sequence[Draft], *behind: Any) -> list[Record]:
        if any(draft.kind in ("result", "end") for draft in drafts):
            raise StoreError("no space left on the device")
        return append(store, drafts, *behind)

    monkeypatch.setattr(Store, "append", append_until_the_end)
    with pytest.raises(StoreError, match="600 points are safe"):
        record(past.folder, Script(*scan_arrivals(600)))
    (row,) = past.runs()
    assert (row.state, row.word, row.counted, row.received) == ("interrupted", "INTERRUPTED", False, 612)
    assert past.open_run("last").ended.ending == "interrupted"
    monkeypatch.undo()
    assert past.runs()[0].state == "interrupted"  # and now its end is written


def test_runs_are_listed_newest_first_with_their_own_limits(past: PastRuns) -> None:
    for _ in range(2):
        record(past.folder, Script(*scan_arrivals(300)))
    newest, oldest = past.runs()
    assert newest.run > oldest.run
    assert newest.began == oldest.began == local_words(today())
    assert (newest.part, newest.serial_number) == (oldest.part, "T-1")
    assert newest.lower_mm is not None
    assert newest.upper_mm is not None
    assert newest.lower_mm < newest.upper_mm


def test_a_line_of_the_history_names_the_characteristic_that_failed(tmp_path: Path, past: PastRuns) -> None:
    write_nominal(tmp_path / "oval.yaml")
    write_points(tmp_path / "points.csv", oval_points(0.01))
    (tmp_path / "plan.yaml").write_text(
        "part: {name: oval}\nnominal: {file: oval.yaml}\ndevice: {type: file, file: points.csv}\nrecords: records\nout: null\n"
        "registration: {datum: {rotation_deg: 0.0}}\ntolerance: {lower_mm: -0.05, upper_mm: 0.05}\ncharacteristics:\n"
        "  - {name: loose, type: line-profile, zone: 0.1, fit: none}\n  - {name: tight, type: line-profile, zone: 0.01, fit: none}\n"
    )
    assert cmmlink("run", tmp_path / "plan.yaml", "--json").code == 1
    assert [(row.word, row.of) for row in past.runs()] == [("NOT CONFORM", "tight")]


def test_what_was_judged_later_stands_beside_its_run_and_no_other(past: PastRuns) -> None:
    for _ in range(2):
        record(past.folder, Script(*scan_arrivals()))
    assert [row.judged for row in past.runs()] == [(), ()]
    with open_to_read(past.folder, today) as store:
        recorded = recorded_run(store, find_run(store, "1"))
        again = replay_run(store, recorded, no_decoder, settings={"tolerance.upper_mm": "0.5"})
    for who, why in (("Eve", "concession 4711"), ("Ada", "drawing changed")):
        with open_to_record(past.folder, today) as store:
            keep_judgement(store, recorded, again, who=who, why=why, now=today())
    newest, first = past.runs()
    assert newest.judged == ()
    assert [told.partition(" by ")[2].partition(":")[0] for told in first.judged] == ["Eve", "Ada"]
    assert first.judged[1].endswith("tolerance.upper_mm 0.05 -> 0.5; drawing changed")
