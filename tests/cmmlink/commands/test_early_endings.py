"""A run that did not come to its end: every output says so, in the same word, and it counts nowhere."""

import csv
import io
import json
import re
import threading
import time
from collections.abc import Callable
from pathlib import Path

import pytest
from rich.console import Console

from cmmlink.console.past_runs import PastRuns
from cmmlink.deviations_csv import COLUMNS, EARLY_COLUMNS
from cmmlink.report import print_summary, write_results
from cmmlink.report.judged_scan import scan_of
from cmmlink.report.picture_content import headline_on_picture
from cmmlink.result_json import result_json
from cmmlink.run_view import RunView
from drivers import LinkError
from tests.cmmlink.command import cmmlink
from tests.cmmlink.recorded import Script, no_decoder, record, scan_arrivals, small_profile, today


def unplug() -> None:
    raise LinkError("the port is gone")


@pytest.mark.parametrize("ending", ["aborted", "interrupted"])
def test_every_output_says_how_the_run_ended(tmp_path: Path, ending: str) -> None:
    stop, records = threading.Event(), tmp_path / "records"
    happens: Callable[[], object] = stop.set if ending == "aborted" else unplug
    outcome, recorder = record(records, Script(*scan_arrivals()[:20], happens), stop=stop)
    result = outcome.result
    assert result is not None
    assert outcome.ending == ending
    word = f"{ending.upper()} AT {int(100 * result.coverage)} %"
    assert re.fullmatch(r"[A-Z]+ AT \d+ %", word)

    shown = cmmlink("show", recorder.run, "--records", records)
    assert shown.out.startswith(word + "   ")
    assert word in cmmlink("runs", "--records", records).out
    assert cmmlink("show", "last", "--records", records, "--json").json()["state"] == ending

    past = PastRuns(records, no_decoder, time.monotonic, today)
    (row,) = past.runs()
    assert (row.word, row.state, row.shape, row.counted) == (word, ending, "ended-early", False)
    opened = past.open_run("last")
    view = RunView(opened.context("recorded", "recorded"), time.monotonic, today)
    view.recall(opened.started, opened.ended)
    state = view.state()
    assert (state.verdict.word, state.verdict.final, state.ending) == (word, False, ending)
    assert any("no verdict" in words for words in (state.verdict.why, *state.verdict.reasons))

    printed = io.StringIO()
    print_summary(Console(file=printed, width=300), result, outcome.counts, "part", outcome.ending)
    assert printed.getvalue().startswith(word + "   part")
    assert headline_on_picture(scan_of(result), "part", outcome.ending) == f"part    {word}"

    cmmlink("export", "last", "--records", records, "--out", tmp_path / "exported")
    document = result_json(result, outcome.counts) | {"ending": outcome.ending}
    write_results(tmp_path / "written", document, result, small_profile(), "part")
    for folder in ("exported", "written"):
        assert json.loads((tmp_path / folder / "result.json").read_text(encoding="utf-8"))["ending"] == ending
        with (tmp_path / folder / "deviations.csv").open(newline="", encoding="utf-8") as file:
            rows = list(csv.DictReader(file))
        assert tuple(rows[0]) == tuple(EARLY_COLUMNS)
        assert {row["ending"] for row in rows} == {ending}
    assert tuple(COLUMNS) == tuple(EARLY_COLUMNS)[:-1]
    again = cmmlink("replay", "last", "--records", records, "--json")
    assert again.json()["ending"] == ending
