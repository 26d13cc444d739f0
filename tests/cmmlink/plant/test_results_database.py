"""The results database on SQLite and PostgreSQL: what is pushed comes back as it was, once, and every question finds what it asks."""

import sqlite3
from dataclasses import replace
from datetime import timedelta
from pathlib import Path

import numpy as np
import pytest

from cmmlink.errors import PlantAwayError, PlantError
from cmmlink.plant import PartCharacteristic, ResultsDatabase, StoredEvent, address_of, month_of, strip_of, without_password
from tests.cmmlink.plant.postgres import PostgresServer
from tests.cmmlink.plant.results import BEGAN, a_run, plain


def test_a_run_comes_back_as_it_was_and_is_there_once(address: str) -> None:
    runs = [a_run(0), a_run(1, part="Rad 3 µm"), a_run(2, verdict=None, values=(), strip=None, received=None)]
    with ResultsDatabase(address) as database:
        assert database.add_runs(runs[:2]) == ["added", "added"]
        assert database.add_runs(runs) == ["there", "there", "added"]
    with ResultsDatabase(address) as database:
        assert [plain(run) for run in database.stored_runs("hall-1")] == [plain(run) for run in runs]
        assert sorted(database.parts()) == ["Rad 3 µm", "blade"]
        assert database.stations() == ["hall-1"]


def test_another_run_of_the_same_name_never_takes_the_place_of_the_first(address: str) -> None:
    first, other = a_run(0), a_run(0, chain_sha256="f" * 64, verdict="conform")
    with ResultsDatabase(address) as database:
        database.add_runs([first])
        assert database.add_runs([other, a_run(1)]) == ["another", "added"]
        assert [plain(run) for run in database.stored_runs("hall-1")] == [plain(first), plain(a_run(1))]
        assert database.add_runs([replace(other, station="hall-2")]) == ["added"], "another station counts its own runs"


def test_a_series_is_in_the_order_of_time_and_holds_complete_runs_only(address: str) -> None:
    runs = [a_run(k, station=f"hall-{k % 2}") for k in (3, 0, 2, 1)] + [a_run(4, state="aborted"), a_run(5, part="other")]
    with ResultsDatabase(address) as database:
        database.add_runs(runs)
        series = database.series("blade", "chord")
        assert series.serial_number == ("SN 0", "SN 1", "SN 2", "SN 3")
        np.testing.assert_array_equal(series.value, [60.0, 60.01, 60.02, 60.03])
        np.testing.assert_array_equal(series.upper, [60.1] * 4)
        np.testing.assert_array_equal(series.started_s, [BEGAN.timestamp() + 3600 * k for k in range(4)])
        assert (series.unit, series.type, series.verdict, series.station[0]) == ("mm", "chord", ("uncertain",) * 4, "hall-0")
        assert np.isnan(database.series("blade", "profile").lower).all(), "a form has no lower limit"
        assert database.series("blade", "chord", last=2).serial_number == ("SN 2", "SN 3")
        assert database.series("blade", "chord", station="hall-1").serial_number == ("SN 1", "SN 3")
        within = database.series("blade", "chord", since=BEGAN + timedelta(hours=1), until=BEGAN + timedelta(hours=3))
        assert within.serial_number == ("SN 1", "SN 2")
        assert len(database.series("blade", "nothing").run) == len(database.series("none", "chord").run) == 0
        assert database.characteristics("blade") == [
            PartCharacteristic("profile", "line-profile", "mm"),
            PartCharacteristic("chord", "chord", "mm"),
        ]


def test_values_of_another_unit_are_no_part_of_a_series(address: str) -> None:
    earlier = a_run(0)
    earlier = replace(earlier, values=(replace(earlier.values[1], unit="deg"),))
    with ResultsDatabase(address) as database:
        database.add_runs([earlier, a_run(1)])
        series = database.series("blade", "chord")
        assert (series.unit, series.serial_number, series.left_out) == ("mm", ("SN 1",), 1)


def test_strips_are_those_of_the_newest_runs(address: str) -> None:
    with ResultsDatabase(address) as database:
        database.add_runs([a_run(k) for k in range(4)] + [a_run(9, strip=None)])
        strips = database.strips("blade", 2)
        assert strips.serial_number == ("SN 2", "SN 3")
        assert strips.mean_mm.shape == (2, 120)
        np.testing.assert_allclose(strips.mean_mm[:, 0], [0.002, 0.003], rtol=1e-6)
        np.testing.assert_array_equal(np.isnan(strips.worst_mm).sum(axis=1), [1, 1])
        assert (strips.length_mm[0], strips.lower_mm[0], np.isnan(strips.upper_mm[0])) == (123.5, -0.05, True)
        assert database.strips("none").mean_mm.shape == (0, 120)


def test_a_search_finds_by_part_and_month_and_all_else(address: str) -> None:
    with ResultsDatabase(address) as database:
        database.add_runs([a_run(24 * k, operator="Ada" if k % 2 else "Bob") for k in range(40)])
        begin, end = month_of("2026-03")
        found = database.search(part="blade", month="2026-03")
        assert [run.started for run in found] == sorted((run.started for run in found), reverse=True)
        assert {run.run for run in found} == {run.run for run in database.stored_runs("hall-1") if begin <= run.started < end}
        assert 0 < len(found) < 40
        assert [run.serial_number for run in database.search(serial_number="SN 48")] == ["SN 48"]
        assert len(database.search(operator="Ada", verdict="uncertain", station="hall-1", most=7)) == 7
        assert database.search(verdict="conform") == database.search(part="Blade") == []
    with pytest.raises(PlantError, match="expected one like 2026-03"):
        month_of("2026-3x")


def test_an_event_is_there_once_however_often_it_is_added(address: str) -> None:
    event = StoredEvent("of run 3", BEGAN, "alarm", "drifts", part="blade", characteristic="chord", run="3")
    with ResultsDatabase(address) as database:
        database.add_event(event)
        database.add_event(replace(event, words="other"))
        database.add_event(replace(event, key="later", at=BEGAN + timedelta(1), kind="study"))
        assert database.events(kind="alarm") == [event]
        assert [one.key for one in database.events(part="blade")] == ["later", "of run 3"]


def test_a_database_of_a_newer_program_is_refused_in_words(tmp_path: Path) -> None:
    file = tmp_path / "plant.sqlite"
    ResultsDatabase(file).close()
    with sqlite3.connect(file) as connection:
        connection.execute("UPDATE cmmlink_version SET version_num = '99'")
    connection.close()
    with pytest.raises(PlantError, match=r"written by a newer cmmlink .* step 99.*; update cmmlink here"):
        ResultsDatabase(file)


def test_a_database_of_somebody_else_is_left_alone(tmp_path: Path) -> None:
    file = tmp_path / "other.sqlite"
    with sqlite3.connect(file) as connection:
        connection.execute("CREATE TABLE run (id)")
    connection.close()
    with pytest.raises(PlantError, match="holds a table 'run' that is not of cmmlink"):
        ResultsDatabase(file)


def test_tables_made_step_by_step_are_those_of_the_models(address: str) -> None:
    from alembic.autogenerate import compare_metadata
    from alembic.runtime.migration import MigrationContext
    from alembic.script import ScriptDirectory

    from cmmlink.plant import results_database
    from cmmlink.plant.database_engine import DatabaseEngine
    from cmmlink.plant.results_tables import VERSION_TABLE, VERSIONS, Tables

    engine = DatabaseEngine(address)
    with engine.reading() as connection:
        context = MigrationContext.configure(connection, opts={"version_table": VERSION_TABLE, "compare_type": True})
        assert compare_metadata(context, Tables.metadata) == []
    engine.close()
    steps = ScriptDirectory(str(Path(results_database.__file__).parent / "migrations"))
    assert [step.revision for step in steps.walk_revisions()][::-1] == list(VERSIONS)


def test_a_server_that_does_not_answer_is_away_and_one_that_refuses_is_not(server: PostgresServer) -> None:
    with pytest.raises(PlantAwayError, match="Connection refused"):
        ResultsDatabase("postgresql://cmm@127.0.0.1:1/postgres")
    with pytest.raises(PlantError, match='database "none" does not exist') as told:
        ResultsDatabase(server.address.replace("/postgres", "/none"))
    assert not isinstance(told.value, PlantAwayError)


@pytest.mark.parametrize(
    ("given", "told"),
    [
        ("postgresql://cmm:geheim@db/plant", "postgresql://cmm:...@db/plant: a password in an address"),
        ("postgresql://cmm@db/plant?password=geheim", "a password in an address"),
        ("mysql://cmm:geheim@db/plant", "expected the path of a file, or postgresql"),
        ("postgresql://db", "names no database"),
        ("postgresql://cmm:geheim@db:x/plant", "is no address"),
    ],
)
def test_what_is_no_address_is_refused_without_its_password(given: str, told: str) -> None:
    with pytest.raises(PlantError, match=told.replace("?", ".")) as refused:
        address_of(given)
    assert "geheim" not in str(refused.value)


def test_a_password_never_stands_in_what_is_told() -> None:
    told = without_password("plant push --to postgresql://a:b%20c@h/d?password=x&y=1 done")
    assert told == "plant push --to postgresql://a:...@h/d?password=...&y=1 done"


def test_a_strip_holds_the_mean_and_the_worst_of_each_even_part_in_any_order() -> None:
    station = np.array([0.0, 0.4, 0.6, 59.99, 120.0, 119.5, np.nan, 60.0])
    deviation = np.array([0.1, -0.3, 0.2, 0.5, -0.25, 0.25, 9.0, np.nan])
    strip = strip_of([(station, deviation)], 120.0, -1.0, 1.0)
    np.testing.assert_allclose(strip.mean_mm[[0, 59, 119]], [0.0, 0.5, 0.0], atol=1e-7)
    np.testing.assert_allclose(strip.worst_mm[[0, 59, 119]], [-0.3, 0.5, 0.25], rtol=1e-6)
    assert np.isnan(strip.mean_mm).sum() == np.isnan(strip.worst_mm).sum() == 117
    one_sided = strip_of([(station, deviation)], 120.0, -0.1, 0.7)  # around 0.3: -0.3 lies out of it, and stays the worst
    np.testing.assert_allclose(one_sided.worst_mm[[0, 119]], [-0.3, -0.25], rtol=1e-6)
    cut = strip_of([(station[::-1][:3], deviation[::-1][:3]), (station[::-1][3:], deviation[::-1][3:])], 120.0, -1.0, 1.0)
    np.testing.assert_array_equal(cut.worst_mm, strip.worst_mm)
