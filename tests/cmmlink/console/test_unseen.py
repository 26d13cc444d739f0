"""A machine that moves is stopped once no page is open any more."""

from pathlib import Path

import pytest

from cmmlink.console.job import Job
from cmmlink.console.station import Station
from cmmlink.console.unseen import GONE_S, Onlooker

from .played import Device, PlayedSource, setup_of, write_plan


class Clock:
    """A clock that is set by hand."""

    now_s = 0.0

    def __call__(self) -> float:
        return self.now_s


@pytest.fixture
def station(tmp_path: Path) -> Station:
    return Station(setup_of({"blade.yaml": write_plan(tmp_path)}, Device().connect))


def job_on(station: Station, monkeypatch: pytest.MonkeyPatch, *, moves: bool) -> Job:
    job = Job("run", lambda: None)
    job.attach(PlayedSource(), moves=moves)
    monkeypatch.setattr(station, "_job", job)
    return job


def test_a_machine_is_stopped_some_seconds_after_the_last_page_has_gone(station: Station, monkeypatch: pytest.MonkeyPatch) -> None:
    job, clock = job_on(station, monkeypatch, moves=True), Clock()
    onlooker = Onlooker(station, clock)
    onlooker.look(pages=0)
    clock.now_s = 0.9 * GONE_S
    onlooker.look(pages=1)  # it was only loaded anew
    clock.now_s = 1.8 * GONE_S
    onlooker.look(pages=0)
    assert not job.stop.is_set()
    clock.now_s = 2.9 * GONE_S
    onlooker.look(pages=0)
    assert job.stop.is_set()
    assert any("so it was stopped" in alarm.detail for alarm in station.alarms.newest_first())


def test_what_does_not_move_goes_on_unseen(station: Station, monkeypatch: pytest.MonkeyPatch) -> None:
    job, clock = job_on(station, monkeypatch, moves=False), Clock()
    onlooker = Onlooker(station, clock)
    for clock.now_s in (0.0, 2 * GONE_S):
        onlooker.look(pages=0)
    assert not job.stop.is_set()
