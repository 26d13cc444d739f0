"""Which trends a run ends: up to it, of what it changes or of what is asked for; and the page that its report has of them."""

from pathlib import Path

import pytest
from pypdf import PdfReader

from cmmlink.errors import PlanError
from cmmlink.plant_push import push
from cmmlink.run_trends import RunTrend, trends_of_run
from tests.cmmlink.command import cmmlink
from tests.cmmlink.commands.oval_files import inspect_oval, one_off
from tests.cmmlink.oval_part import write_nominal
from tests.cmmlink.plant.trending import Remembered, drifting_runs
from tests.cmmlink.recorded import today

RUNS = drifting_runs(40)
NAMES = ("contour", "chord")


def trends_at(at: int, *asked: str, last: int = 25) -> tuple[RunTrend, ...]:
    run = RUNS[at]
    return trends_of_run(Remembered(RUNS), run.run, run.part, run.started, NAMES, last=last, asked=asked)


def test_a_trend_ends_with_its_run_and_what_came_later_has_no_part_in_it() -> None:
    (one,) = trends_at(30, "chord")
    assert one.found.series.run == tuple(run.run for run in RUNS[6:31])
    assert one.found.strip is not None
    assert one.found.strip.strips.run == one.found.series.run


def test_without_a_choice_what_breaks_a_rule_is_shown_and_else_the_first() -> None:
    (drifted,) = trends_at(39)
    assert drifted.found.series.name == "contour"
    assert "one value beyond three standard deviations, upwards" in (drifted.broken or ()), "as it was with the run before, too"
    (still,) = trends_at(12)
    assert (still.found.series.name, still.broken) == ("contour", None), "twelve runs before it are too few for a rule"


def test_what_has_no_trend_is_refused() -> None:
    with pytest.raises(PlanError, match="has no characteristic 'weight'; it has: contour, chord"):
        trends_at(30, "weight")
    with pytest.raises(PlanError, match="is not among the results of blade"):
        trends_of_run(Remembered(RUNS), "another", "blade", RUNS[30].started, NAMES, last=25)


def test_the_report_of_a_run_has_a_page_for_its_trend(tmp_path: Path) -> None:
    records = tmp_path / "records"
    inspect_oval(write_nominal(tmp_path / "oval.yaml"), one_off(0.08), "--records", records)
    asked = ("report", "last", "--records", records, "--trend", 50, "--language", "de", "-o", tmp_path / "a.pdf")
    assert "nothing was pushed there yet" in cmmlink(*asked).refused()
    push(records, today)
    assert cmmlink(*asked, "--json").json()["trends"] == ["profile"]
    told = PdfReader(tmp_path / "a.pdf").pages[-1].extract_text()
    assert "Trend: profile, die 1 L\u00e4ufe bis zu diesem" in told
    assert "oder weniger als 20 vor sich" in told
    assert "--characteristic chooses a trend" in cmmlink("report", "last", "--records", records, "--characteristic", "chord").refused()
