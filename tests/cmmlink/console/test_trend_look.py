"""What pages are told of trends: choices and one trend out of a database, and what is refused."""

from pathlib import Path

import pytest

from cmmlink.console.protocol import json_of
from cmmlink.console.refused import Refused
from cmmlink.console.trend_look import AskedTrend, TrendLook, trends_of
from cmmlink.plant import ResultsDatabase
from tests.cmmlink.plant.trending import drifting_runs

ASKED = {"part": "blade", "characteristic": "contour", "station": "", "last": "50", "subgroup": "1"}


@pytest.fixture(scope="module")
def look(tmp_path_factory: pytest.TempPathFactory) -> TrendLook:
    folder = tmp_path_factory.mktemp("plant")
    with ResultsDatabase(folder / "plant.sqlite") as results:
        results.add_runs(drifting_runs(45))
    return TrendLook(lambda: ResultsDatabase(folder / "plant.sqlite"), folder)


def test_parts_stations_and_characteristics_are_offered(look: TrendLook) -> None:
    choices = look.choices()
    assert (choices.parts, choices.stations) == (("blade",), ("hall-1", "hall-2"))
    first = look.trend(AskedTrend.of({**ASKED, "characteristic": ""}))
    assert (first.characteristic, first.characteristics) == ("contour", ("contour", "chord"))


def test_a_trend_is_told_with_its_heat_strip(look: TrendLook) -> None:
    shown = look.trend(AskedTrend.of(ASKED))
    assert len(shown.runs) == 45
    assert shown.rows == tuple(range(45))
    assert shown.location is not None
    assert shown.location.broken[-1].at == 44
    assert shown.strip is not None
    assert (len(shown.strip.levels), len(shown.strip.levels[0])) == (45, 120)
    assert shown.strip.worst_mm[5][-1] is shown.strip.levels[5][-1] is None  # was not measured
    [(begin, end)] = shown.strip.stretches
    assert begin < 0.3 * shown.strip.length_mm < end
    assert [index.name for index in shown.indices] == ["Cp", "Cpk", "Pp", "Ppk"]
    assert "NaN" not in json_of(shown)


def test_a_trend_of_one_station_in_subgroups_is_told(look: TrendLook) -> None:
    shown = look.trend(AskedTrend.of({**ASKED, "characteristic": "chord", "station": "hall-2", "subgroup": "4"}))
    assert {run.station for run in shown.runs} == {"hall-2"}
    assert shown.rows == (5, 9, 13, 17, 21)  # 22 runs, of which the first two belong to no whole subgroup


def test_a_part_without_results_has_an_empty_trend(look: TrendLook) -> None:
    shown = look.trend(AskedTrend.of({**ASKED, "part": "vane"}))
    assert shown.runs == ()
    assert shown.location is None
    assert shown.strip is None


@pytest.mark.parametrize("wrong", [{"last": "0"}, {"last": "many"}, {"subgroup": "101"}, {"last": "\u0661"}])
def test_numbers_out_of_range_are_refused(wrong: dict[str, str]) -> None:
    with pytest.raises(Refused, match="expected a whole number from 1 to"):
        AskedTrend.of(ASKED | wrong)


def test_a_database_that_cannot_be_used_is_refused_without_folders(tmp_path: Path) -> None:
    file = tmp_path / "plant.sqlite"
    file.write_text("no database", encoding="utf-8")
    with pytest.raises(Refused) as refused:
        TrendLook(lambda: ResultsDatabase(file), tmp_path).choices()
    assert str(tmp_path) not in str(refused.value)
    with pytest.raises(Refused, match="no results database"):
        trends_of(None)
