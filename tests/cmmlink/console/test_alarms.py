from datetime import datetime

import pytest

from cmmlink.console.alarms import Alarms
from cmmlink.events import Answered, Arrived, Counts, RunFinished, RunStarted
from drivers.source import Arrival, Damaged, LinkDown, LinkUp, Lost, Rejected
from inspection import Verdict

STARTED = RunStarted("part", "", "", "device", True)


@pytest.fixture
def alarms() -> Alarms:
    alarms = Alarms(lambda: datetime(2026, 11, 22, 12, 0))
    alarms(STARTED)
    return alarms


def arrive(alarms: Alarms, *arrivals: Arrival) -> None:
    for arrival in arrivals:
        alarms(Arrived(0.0, arrival))


def test_thousands_of_damaged_frames_are_one_alarm_with_a_count(alarms: Alarms) -> None:
    arrive(alarms, *[Damaged(10, "checksum")] * 1000, Lost(3, "gap"), Lost(4, "gap"), Rejected(2, "repeated"))
    told = [(alarm.what, alarm.count, alarm.severity) for alarm in alarms.newest_first()]
    assert told == [("Points rejected", 2, "warning"), ("Data lost", 7, "warning"), ("Damaged bytes", 10_000, "warning")]
    assert not alarms.fault


def test_lost_link_is_a_fault_until_it_is_back_and_seen(alarms: Alarms) -> None:
    arrive(alarms, LinkDown("unplugged"))
    assert alarms.fault
    alarms.acknowledge()
    assert alarms.fault, "seen, but still so"
    arrive(alarms, LinkUp(1.0))
    assert not alarms.fault
    arrive(alarms, LinkDown("unplugged"))
    assert alarms.fault
    assert [(alarm.count, alarm.acknowledged) for alarm in alarms.newest_first()] == [(2, False)]


def test_acknowledged_warning_stays_acknowledged_while_it_counts_on(alarms: Alarms) -> None:
    arrive(alarms, Damaged(10, "checksum"))
    assert alarms.acknowledge(1) == 1
    arrive(alarms, Damaged(10, "checksum"))
    assert alarms.newest_first()[0].acknowledged
    alarms(STARTED)
    arrive(alarms, Damaged(10, "checksum"))
    assert [alarm.acknowledged for alarm in alarms.newest_first()] == [False, True]


def test_run_that_ends_badly_raises_an_alarm(alarms: Alarms) -> None:
    alarms(RunFinished("interrupted", None, Counts(), "COM3 is gone"))
    alarms(RunFinished("complete", None, Counts(), "the points do not fit"))
    assert [(alarm.what, alarm.detail) for alarm in alarms.newest_first()] == [
        ("Not measured", "the points do not fit"),
        ("Device failed", "COM3 is gone"),
    ]


def test_list_of_alarms_does_not_grow_without_end(alarms: Alarms) -> None:
    for k in range(1000):
        alarms.raise_alarm("warning", "Data lost", f"gap {k}")
    assert len(alarms.newest_first()) == 200
    assert alarms.newest_first()[0].detail == "gap 999"


def test_an_alarm_carries_its_run_and_is_no_fault_beside_the_next_part(alarms: Alarms) -> None:
    alarms(RunStarted("blade", "B-1", "", "", simulated=False))
    arrive(alarms, LinkDown("the port is gone"))
    assert alarms.fault
    alarms(RunStarted("blade", "B-2", "", "", simulated=False))
    (alarm,) = alarms.shown.alarms
    assert (alarm.run, alarm.current, alarm.active, alarm.acknowledged) == ("B-1", False, False, False)
    assert not alarms.fault


def test_an_answer_that_was_not_sent_is_a_fault_and_one_that_was_is_none(alarms: Alarms) -> None:
    moment = datetime(2026, 11, 22, 12, 0)
    alarms(Answered("sent", 7, moment, "", Verdict.CONFORM))
    assert not alarms.fault
    alarms(Answered("not withdrawn", None, moment, "no folder"))
    alarms(Answered("not sent", 7, moment, "no folder"))
    told = [(alarm.what, alarm.severity) for alarm in alarms.newest_first()]
    assert told == [("Not sent to the machine", "fault"), ("Earlier answer to the machine not withdrawn", "fault")]


def test_an_answer_that_is_not_on_record_is_a_fault_though_it_was_sent(alarms: Alarms) -> None:
    alarms(Answered("sent", 7, datetime(2026, 11, 22, 12, 0), "", Verdict.CONFORM, unrecorded="the disk is full"))
    (alarm,) = alarms.newest_first()
    assert (alarm.what, alarm.detail, alarms.fault) == ("What the machine was told is not on record", "the disk is full", True)


def test_an_anchor_that_was_not_told_is_a_warning_and_no_fault(alarms: Alarms) -> None:
    alarms.take_anchors([{"place": "heads.txt", "problem": ""}, {"place": "far.txt", "problem": "it did not answer within 5 s"}])
    (alarm,) = alarms.newest_first()
    assert (alarm.severity, alarm.what, alarms.fault) == ("warning", "An anchor was not told", False)
    assert "far.txt: it did not answer" in alarm.detail
