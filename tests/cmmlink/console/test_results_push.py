"""The console pushes results by a process of its own, tells pages one line, and raises an alarm where something waits for a day."""

import json
import sys
import threading

from cmmlink.console.alarms import Alarms
from cmmlink.console.protocol import ResultsState
from cmmlink.console.results_push import PushedResults, _push_once, pushing
from cmmlink.report import Speech
from tests.cmmlink.recorded import today

QUIET = {
    "address": "/home/me/records/plant.sqlite", "added": 0, "waiting": 0, "since": None, "late": False, "problem": None, "away": False,
    "pushed": None, "unreadable": [], "others": [], "alarms": [],
}  # fmt: skip


def named(alarms: Alarms) -> list[tuple[str, str]]:
    return [(alarm.what, alarm.detail) for alarm in alarms.newest_first()]


def told_by(program: str) -> PushedResults:
    """What is known of a pusher that prints something and ends."""
    pushed, ended = PushedResults(Alarms(today)), threading.Event()
    _push_once([sys.executable, "-c", program], pushed, ended)
    ended.set()
    return pushed


def test_settings_that_cannot_be_used_are_an_alarm() -> None:
    error = {"error": {"kind": "unusable", "message": "/home/me/plant.yaml: line 1: a password in an address", "exit_status": 2}}
    pushed = told_by(f"print('{json.dumps(error)}')")
    assert pushed.state == ResultsState("", 0, "", "plant.yaml: line 1: a password in an address", 0)


def test_what_waits_is_one_quiet_line_and_after_a_day_an_alarm() -> None:
    pushed = PushedResults(alarms := Alarms(today))
    pushed.hear(QUIET)
    assert pushed.state == ResultsState("plant.sqlite", 0, "", "", 0)
    waits = {**QUIET, "waiting": 2, "since": "2026-03-14T12:00:00+00:00", "problem": "db: refused", "address": "postgresql://cmm@db/plant"}
    pushed.hear(waits)
    assert (pushed.state.address, pushed.state.waiting, pushed.state.problem) == ("postgresql://cmm@db/plant", 2, "db: refused")
    assert named(alarms) == []
    for _ in range(3):
        pushed.hear({**waits, "late": True})
    assert [what for what, _ in named(alarms)] == ["Results wait to be pushed"]
    pushed.hear(QUIET)
    pushed.hear({**waits, "late": True})
    assert alarms.newest_first()[0].count == 2, "it is late anew"


def test_a_run_that_is_not_pushed_is_told_once() -> None:
    pushed = PushedResults(alarms := Alarms(today))
    told = {**QUIET, "unreadable": [{"run": "20260314-0001", "problem": "damaged"}], "others": ["hall 20260314-0002"]}
    pushed.hear(told)
    pushed.hear(told)
    assert {what for what, _ in named(alarms)} == {"The results of a run are not pushed"}
    assert len(named(alarms)) == 2


def test_a_run_that_changes_the_process_is_an_alarm_and_pages_hear_that_runs_were_added() -> None:
    pushed = PushedResults(alarms := Alarms(today))
    rule = "one value beyond three standard deviations, upwards"
    one = {"run": "20260314-0003", "part": "blade", "serial_number": "B-3", "characteristic": "contour", "rule": rule}
    pushed.hear({**QUIET, "added": 1, "alarms": [one]})
    pushed.hear({**QUIET, "added": 2, "alarms": [{**one, "serial_number": ""}]})
    assert pushed.state.added == 3
    assert named(alarms) == [
        ("The process has changed", f"contour (20260314-0003): {rule}"),
        ("The process has changed", f"contour (B-3): {rule}"),
    ]
    assert Speech("de").sentence(named(alarms)[1][1]) == "contour (B-3): ein Wert jenseits von drei Standardabweichungen, nach oben"


def test_without_a_folder_nothing_is_pushed() -> None:
    with pushing(None, PushedResults(Alarms(today))):
        assert not [thread for thread in threading.enumerate() if thread.name == "results"]


def test_a_line_that_was_cut_off_is_left_out() -> None:
    lines = "{", "[]", '{"address": 3}', json.dumps(QUIET)
    assert told_by(f"print({chr(10).join(lines)!r})").state.address == "plant.sqlite"
