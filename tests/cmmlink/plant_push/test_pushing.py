"""What a station recorded comes to the database whole, once, whatever happens on the way; the records are only read."""

import hashlib
import json
import shutil
import threading
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cmmlink.console.alarms import Alarms
from cmmlink.console.protocol import ResultsState
from cmmlink.console.results_push import PushedResults, pushing
from cmmlink.errors import PlantError
from cmmlink.plant import ResultsDatabase, StoredRun
from cmmlink.plant_push import address_for, follow, keep_address, outbox_of, push
from cmmlink.plant_push.following import LOOK_S
from cmmlink.plant_push.outbox import STATE_FILE
from cmmlink.plant_push.pushing import Outbox
from cmmlink.record.reader import open_to_record
from tests.cmmlink.command import cmmlink
from tests.cmmlink.oval_part import COUNT, LENGTH_MM, station_mm
from tests.cmmlink.plant.postgres import PostgresServer
from tests.cmmlink.plant.results import plain
from tests.cmmlink.plant_push.conftest import add_runs
from tests.cmmlink.recorded import today


def stored(address: str, station: str) -> list[StoredRun]:
    with ResultsDatabase(address) as database:
        return list(database.stored_runs(station))


def file_of(folder: Path) -> str:
    """Where results go while nothing else was said."""
    return str(folder / "plant.sqlite")


def station_of(folder: Path) -> str:
    return str(cmmlink("show", "last", "--records", folder, "--json").json()["station"])


def test_a_pushed_run_is_what_its_result_says(measured: Path, records: Path, address: str) -> None:
    keep_address(records, address)
    outbox = push(records, today)
    assert (outbox.added, outbox.waiting, outbox.problem, outbox.unreadable, outbox.others) == (2, 0, "", {}, ())
    for run, name in zip(stored(address, station_of(records)), ("bad", "good"), strict=True):
        told = json.loads((measured / f"{name}.json").read_text(encoding="utf-8"))
        assert (run.run, run.verdict, run.chain_sha256, run.plan_sha256) == (
            told["run"], told["verdict"], told["chain_sha256"], told["plan_sha256"],
        )  # fmt: skip
        assert (run.received, run.judged, run.rejected, run.lost) == (COUNT, COUNT, 0, 0)
        assert run.started == datetime.fromisoformat(told["measured_at"])
        (value,) = run.values
        (found,) = told["characteristics"]
        assert (value.name, value.value, value.verdict, value.unit) == (found["name"], found["value"], found["verdict"], "mm")
        assert value.lower is None, "a form has no lower limit"
        assert value.upper == pytest.approx(0.1), "of a form the width of its zone"


def test_the_strip_of_a_pushed_run_shows_the_bump_where_it_was_made(records: Path) -> None:
    push(records, today)
    run = stored(file_of(records), station_of(records))[0]
    deviation = np.zeros(COUNT)
    deviation[100:110] = 0.06
    part = np.floor([120 * station_mm(index) / LENGTH_MM for index in range(COUNT)]).astype(int)
    strip = run.strip
    assert strip is not None
    assert strip.length_mm == pytest.approx(LENGTH_MM, abs=1e-6)
    assert (strip.lower_mm, strip.upper_mm) == (-0.05, 0.05)
    for place in range(120):
        inside = deviation[part == place]
        assert strip.worst_mm[place] == pytest.approx(inside[np.abs(inside).argmax()], abs=1e-5)
        assert strip.mean_mm[place] == pytest.approx(inside.mean(), abs=1e-5)


def test_a_judgement_that_was_made_later_comes_as_an_event(records: Path) -> None:
    push(records, today)
    push(records, today, again=True)
    with ResultsDatabase(file_of(records)) as database:
        (event,) = database.events(kind="judged again")
    assert (event.who, event.station) == ("Ada", station_of(records))
    assert event.words == "conform: tolerance.upper_mm 0.05 -> 0.08; concession 4711"


def test_whatever_is_lost_of_what_was_pushed_nothing_is_there_twice(records: Path) -> None:
    push(records, today)
    (records / STATE_FILE).write_text("{", encoding="utf-8")
    assert push(records, today).added == 0, "all of it was there"
    state = json.loads((records / STATE_FILE).read_text(encoding="utf-8"))
    (records / STATE_FILE).write_text(json.dumps({**state, "sha256": "0" * 64}), encoding="utf-8")
    assert push(records, today).waiting == 0, "records that are others than before are pushed from the beginning"
    assert len(stored(file_of(records), station_of(records))) == 2


def test_a_server_that_is_killed_in_the_middle_loses_nothing(records: Path, server: PostgresServer) -> None:
    server.query("DROP SCHEMA public CASCADE; CREATE SCHEMA public")
    keep_address(records, server.address)
    names = add_runs(records, 45)
    first = push(records, today, tell=lambda share: server.kill() if share < 0.7 else None)
    assert first.away
    assert 0 < first.added < 47
    assert first.waiting == 47 - first.added
    while_away = push(records, today)
    assert (while_away.away, while_away.added, while_away.waiting) == (True, 0, first.waiting)
    assert outbox_of(records, today).problem == while_away.problem != ""
    server.start()
    last = push(records, today)
    assert (last.added, last.waiting, last.problem) == (47 - first.added, 0, "")
    assert {*names} < {run.run for run in stored(server.address, station_of(records))}
    assert server.query("SELECT count(*), count(DISTINCT run) FROM run") == "47|47", "told by PostgreSQL's own program"
    assert cmmlink("plant", "verify", "--records", records, "--json").json()["agree"] == 47


def test_to_push_neither_waits_for_who_records_nor_writes_to_the_records(records: Path) -> None:
    with open_to_record(records, today) as store:
        before = hashlib.sha256((records / "station.sqlite").read_bytes()).hexdigest()
        assert push(records, today).added == 2, "the station is locked by who records"
        assert hashlib.sha256((records / "station.sqlite").read_bytes()).hexdigest() == before
        assert store.first_alteration()[0] is None


def test_a_run_that_cannot_be_read_is_named_and_keeps_no_other_back(records: Path) -> None:
    with open_to_record(records, today) as store:
        names = [begin.run for begin, _ in store.begins_and_ends()]
        store._connection.execute("UPDATE record SET body = x'00' WHERE run = ? AND kind = 'result'", (names[0],))
    outbox = push(records, today)
    assert (outbox.added, outbox.waiting, list(outbox.unreadable)) == (1, 0, [names[0]])
    assert "is damaged" in outbox.unreadable[names[0]]


def test_two_stations_of_one_name_are_told_and_neither_overwrites_the_other(records: Path, tmp_path: Path) -> None:
    push(records, today)
    other = Path(shutil.copytree(records, tmp_path / "other"))
    (other / STATE_FILE).unlink()
    with open_to_record(other, today) as store:
        store._connection.execute("UPDATE record SET sha256 = x'%s' WHERE kind = 'end'" % ("ab" * 32))
    outbox = push(other, today)
    assert (outbox.added, len(outbox.others)) == (0, 2)
    assert "has each station its own name" in cmmlink("plant", "status", "--records", other).out


def test_a_run_that_was_merged_is_pushed_as_its_station_pushed_it(records: Path, tmp_path: Path) -> None:
    push(records, today)
    mine = stored(file_of(records), station_of(records))
    assert cmmlink("merge", records, "--records", tmp_path / "hall").code == 0
    keep_address(tmp_path / "hall", file_of(records))
    outbox = push(tmp_path / "hall", today)
    assert (outbox.added, outbox.others) == (0, ())
    assert [plain(run) for run in stored(file_of(records), station_of(records))] == [plain(run) for run in mine]


class Clock:
    """Time that passes by being waited for; ends after so many waits."""

    def __init__(self, waits: int) -> None:
        self.s, self._left = 0.0, waits

    def __call__(self) -> float:
        return self.s

    def wait(self, seconds: float) -> bool:
        self.s, self._left = self.s + seconds, self._left - 1
        return self._left < 0


def test_who_follows_the_records_pushes_when_they_grow_and_else_not(records: Path) -> None:
    told, clock = list[Outbox](), Clock(6)

    def wait(seconds: float) -> bool:
        if clock.s == 2 * LOOK_S:
            add_runs(records, 1)
        return clock.wait(seconds)

    follow(records, told.append, now=today, clock=clock, wait=wait)
    assert [outbox.added for outbox in told] == [2, 1]


def test_pauses_grow_while_the_server_is_away_and_what_waits_is_pushed_once_it_is_back(records: Path) -> None:
    keep_address(records, "postgresql://cmm@127.0.0.1:1/plant")
    told, at, clock = list[Outbox](), list[float](), Clock(500)

    def chance() -> float:
        """Asked after each attempt."""
        at.append(clock.s)
        return 0.5

    def wait(seconds: float) -> bool:
        if clock.s == 700.0:
            keep_address(records, str(records / "back.sqlite"))
        return clock.wait(seconds)

    follow(records, told.append, now=today, clock=clock, wait=wait, chance=chance)
    assert at[:7] == [0.0, 6.0, 16.0, 36.0, 76.0, 156.0, 316.0], "5, 10, 20, ... s, by looks two seconds apart"
    assert at[7:9] == [616.0, 916.0], "never more than five minutes"
    assert [(outbox.waiting, outbox.added) for outbox in told][:2] == [(2, 0), (0, 2)], "what is no news is not told"


def test_nothing_waits_longer_than_since_the_first_attempt(records: Path) -> None:
    keep_address(records, "postgresql://cmm@127.0.0.1:1/plant")
    noon = datetime(2030, 1, 1, 12, tzinfo=UTC)
    push(records, lambda: noon)
    assert outbox_of(records, lambda: noon.replace(day=3)).since_s == noon.timestamp(), "the runs are older"


def test_settings_that_cannot_be_used_are_refused_with_their_place(records: Path) -> None:
    assert address_for(records) == f"sqlite:///{records / 'plant.sqlite'}"
    (records / "plant.yaml").write_text("adress: x\n", encoding="utf-8")
    with pytest.raises(PlantError, match=r"plant\.yaml: line 1: adress"):
        address_for(records)
    (records / "plant.yaml").write_text("address: postgresql://a:geheim@b/c\n", encoding="utf-8")
    with pytest.raises(PlantError, match="a password in an address") as told:
        push(records, today)
    assert "geheim" not in str(told.value)


class Heard(PushedResults):
    """What was heard, and the moment at which something was."""

    def __init__(self) -> None:
        self.told, self.come = list[Any](), threading.Event()
        super().__init__(Alarms(today))

    def hear(self, told: Any) -> None:
        super().hear(told)
        self.told.append(told)
        self.come.set()


def test_a_run_that_leaves_its_trend_is_an_alarm_once_and_an_event(records: Path) -> None:
    push(records, today)
    bad, good = stored(file_of(records), station_of(records))
    (value,) = good.values
    assert value.value is not None
    before = [
        replace(
            good,
            run=f"before-{k}",
            part=bad.part,
            started=bad.started - timedelta(hours=k + 1),
            values=(replace(value, value=value.value + k % 3 * 1e-4),),
        )
        for k in range(24)
    ]
    other = records / "other.sqlite"
    with ResultsDatabase(other) as database:
        database.add_runs(before)
    keep_address(records, str(other))
    told = cmmlink("plant", "push", "--records", records)
    assert told.code == 0
    rule = "one value beyond three standard deviations, upwards"
    whose = bad.serial_number or bad.run
    assert told.out.splitlines()[1:] == [f"the process has changed: {bad.part} {whose}, {value.name}: {rule}"]
    assert push(records, today, again=True).alarms[0].rule == rule
    with ResultsDatabase(other) as database:
        (event,) = database.events(kind="trend alarm")
    assert (event.run, event.words) == (bad.run, f"{value.name}: {rule}")


def test_the_console_pushes_by_another_process_that_ends_with_it(records: Path) -> None:
    heard = Heard()
    with pushing(records, heard):
        assert heard.come.wait(60)
    assert not [thread for thread in threading.enumerate() if thread.name == "results"], "it has ended, and its process with it"
    assert heard.state == ResultsState("plant.sqlite", 0, "", "", 2)
    assert len(stored(file_of(records), station_of(records))) == heard.told[0]["added"] == 2
