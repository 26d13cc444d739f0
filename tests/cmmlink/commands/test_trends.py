"""The command `plant trends` on a database that was filled beforehand."""

from pathlib import Path

import pytest

from cmmlink.plant import ResultsDatabase
from cmmlink.trend_keys import PlantTrend
from tests.cmmlink.command import cmmlink
from tests.cmmlink.plant.trending import drifting_runs


@pytest.fixture(scope="module")
def records(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of records of a station whose results go to a file beside them."""
    folder = tmp_path_factory.mktemp("records")
    with ResultsDatabase(folder / "plant.sqlite") as results:
        results.add_runs(drifting_runs(40))
    return folder


def test_a_trend_is_told_in_words(records: Path) -> None:
    told = cmmlink("plant", "trends", "blade", "--records", records).out
    assert told.startswith("blade: contour (line-profile, mm), 40 runs from ")
    assert "earlier ones: " in told
    assert "SN-0039: one value beyond three standard deviations, upwards" in told
    assert "The profile drifts from station " in told
    assert "capability    Cp -   Cpk -   Pp -   Ppk -" in told


def test_a_trend_of_subgroups_is_told_as_json_with_all_its_keys(records: Path) -> None:
    asked = ("--characteristic", "chord", "--station", "hall-1", "--last", "18", "--subgroup", "4", "--since", "2026-03-01")
    document = cmmlink("plant", "trends", "blade", *asked, "--records", records, "--json").json()
    told = PlantTrend(**document)
    assert (told.station, told.subgroup, len(told.runs), told.file) == ("hall-1", 4, 18, None)
    assert told.location is not None
    assert len(told.location.plotted) == 4


@pytest.mark.parametrize("name", ["trend.xlsx", "trend.svg"])
def test_a_trend_is_written_to_the_file_that_is_asked_for(records: Path, tmp_path: Path, name: str) -> None:
    ended = cmmlink("plant", "trends", "blade", "--records", records, "--out", tmp_path / name, "--language", "de")
    assert ended.code == 0
    assert (tmp_path / name).stat().st_size > 5000


@pytest.mark.parametrize(
    ("asked", "told"),
    [
        (("vane",), "has no results of a part 'vane'; there are results of: blade"),
        (("blade", "--characteristic", "weight"), "blade has no characteristic 'weight'; it has: contour, chord"),
        (("blade", "--station", "hall-9"), "no run that is asked for has the characteristic 'contour'; leave out --station or --since"),
        (("blade", "--out", "trend.doc"), "nothing is written by the suffix '.doc'; expected one of .pdf, .png, .svg, .xlsx"),
    ],
)
def test_what_cannot_be_shown_is_refused_in_words(records: Path, asked: tuple[str, ...], told: str) -> None:
    assert told in cmmlink("plant", "trends", *asked, "--records", records).refused()


def test_a_drawing_that_cannot_be_written_is_refused_in_words(records: Path) -> None:
    out = records / "plant.sqlite" / "trend.svg"  # its folder is a file
    assert "the trend cannot be written there" in cmmlink("plant", "trends", "blade", "--records", records, "--out", out).refused()
