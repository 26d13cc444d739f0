"""The view of trends in a browser: chosen, drawn, read out by keys, in German, and without hindrances."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest
from playwright.sync_api import Page, expect

from cmmlink.console import paper_process
from cmmlink.console.server import ConsoleServer
from cmmlink.console.station import Station
from cmmlink.console.trend_look import TrendLook
from cmmlink.plant import ResultsDatabase
from tests.cmmlink.plant.trending import drifting_runs

from .conftest import Bench, MakeBench
from .played import made_here, setup_of, write_plan
from .seen import drawn, focus, hindrances

Keep = Callable[[Page, str], None]


@pytest.fixture
def trends(make_bench: MakeBench, tmp_path: Path) -> Bench:
    """A station whose plant has results of two parts."""
    file = tmp_path / "plant.sqlite"
    with ResultsDatabase(file) as results:
        results.add_runs(drifting_runs(60))
        results.add_runs([replace(run, run=f"v{run.run}") for run in drifting_runs(30, part="vane", drift_mm=0.0)])
    bench = make_bench()
    bench.server.stop()
    setup = setup_of({"blade.yaml": write_plan(tmp_path)}, bench.device.connect)
    bench.station = Station(replace(setup, trends=TrendLook(lambda: ResultsDatabase(file), tmp_path)))
    bench.server = ConsoleServer(bench.station, "test", token="token-of-this-test")
    bench.server.start()
    return bench


def test_a_drifting_part_is_looked_at_by_keys(trends: Bench, keep: Keep, axe: None) -> None:
    page = trends.page()
    expect(page.locator("#tab-trends")).to_be_visible()
    page.keyboard.press("5")
    expect(page.locator("#trend-words")).to_contain_text("60 runs")
    expect(page.locator("#trend-notes li").first).to_contain_text("The profile drifts from station")
    focus(page, "trend-location")
    before = drawn(page, "trend-location", layer=2)
    assert drawn(page, "trend-location", layer=2, after="ArrowLeft") != before
    expect(page.locator("#trend-place")).to_contain_text("SN-0059 · hall-2")
    expect(page.locator("#trend-place")).to_contain_text("one value beyond three standard deviations")
    focus(page, "trend-strip")
    for _ in range(36):
        page.keyboard.press("ArrowRight")
    expect(page.locator("#trend-strip-words")).to_contain_text("SN-0059 · station 57.03 mm · worst +0.0")
    expect(page.locator("#trend-strip-words")).to_contain_text("out of tolerance")
    keep(page, "trends")
    assert hindrances(page, "trends") == {}


def test_another_part_characteristic_and_subgroup_are_chosen_in_german(trends: Bench) -> None:
    page = trends.page(address=trends.server.new_address().replace("/#", "/?lang=de#"))
    page.locator("#tab-trends").click()
    page.locator("#trend-part").select_option("vane")
    expect(page.locator("#trend-notes li").first).to_contain_text("Keine Stelle des Profils driftet signifikant")
    page.locator("#trend-characteristic").select_option("chord")
    page.locator("#trend-subgroup").select_option("5")
    expect(page.locator("#trend-words")).to_contain_text("30 Läufe; 0 NICHT KONFORM")
    expect(page.locator("#trend-indices dd").first).to_contain_text(",")
    expect(page.locator("#trend-basis")).to_contain_text("Verteilung: normal")
    expect(page.locator("#trend-notes")).to_contain_text("Die Grenzen stammen aus 6 Stichproben")
    page.locator("#trend-spread").focus()
    page.keyboard.press("Home")
    expect(page.locator("#trend-place")).to_contain_text("SN-0004")


def test_a_trend_is_taken_away_as_a_workbook(trends: Bench, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(paper_process, "_make", made_here)
    page = trends.page()
    page.locator("#tab-trends").click()
    expect(page.locator("#trend-notes li").first).to_be_visible()
    with page.expect_download() as saved:
        page.locator("#trend-xlsx").click()
    assert saved.value.suggested_filename == "blade contour.xlsx"
    assert saved.value.path().read_bytes().startswith(b"PK")
    expect(page.locator("#said")).to_contain_text("blade contour.xlsx saved")


def test_without_a_results_database_there_is_no_view(bench: Bench) -> None:
    page = bench.page()
    expect(page.locator("#plans div").first).to_be_visible()
    expect(page.locator("#tab-trends")).to_be_hidden()
    page.keyboard.press("5")
    expect(page.locator("body")).to_have_attribute("data-view", "part")
