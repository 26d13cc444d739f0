"""What was measured before, in a real browser: history, records, replays and sections of a surface."""

import re
import threading
from collections.abc import Callable, Sequence
from datetime import datetime
from pathlib import Path
from time import monotonic
from unittest.mock import patch

import numpy as np
import pytest
from numpy.typing import NDArray
from playwright.sync_api import Page, expect
from pypdf import PdfReader

from cmmlink.commands.console import inspect_surface
from cmmlink.console import paper_process
from cmmlink.console.ct_import import Section
from cmmlink.console.past_runs import PastRuns
from drivers.source import Damaged
from inspection import NominalProfile, RigidTransform, synthetic
from tests.drivers.surface.meshes import binary_stl, tube, write

from .conftest import Bench, MakeBench
from .played import CLOSED, PLAN, batches, made_here, measured, opened
from .seen import focus, millimetres, overflowing

Keep = Callable[[Page, str], None]

Summary = tuple[str, Sequence[str]]

LONG_MS = 120_000  # a process with less priority than all others makes a report: on a busy machine it waits for them

CT_PLAN = """part: {name: blade 7}
mesh: {file: blade.stl}
nominal: {file: section.yaml}
tolerance: {lower_mm: -0.05, upper_mm: 0.05}
sections: {heights_mm: [4, 8, 12, 16]}
cut: {cutter: numpy}
"""

# Whether anything is drawn.
INKED = """(drawing) => [...document.querySelectorAll(`${drawing} canvas`)].some(canvas => {
    const blank = Object.assign(document.createElement('canvas'), { width: canvas.width, height: canvas.height });
    return canvas.toDataURL() !== blank.toDataURL();
})"""


@pytest.mark.timeout(400)
def test_history_is_listed_opened_replayed_and_exported(make_bench: MakeBench, tmp_path: Path, keep: Keep) -> None:
    past = PastRuns(tmp_path / "records", lambda _: None, monotonic, lambda: datetime.now().astimezone())
    bench = make_bench(records=past, plans=("blade.yaml", "other.yaml"))
    page = bench.started()
    defects = (0.0, 0.12, -0.15, 0.0)
    for k, defect_mm in enumerate(defects):
        points = batches(measured(bench.profile, 1500, seed=k, defect_mm=defect_mm, at_mm=60.0), 64)
        bench.device.source.put(opened(1500), *points, CLOSED)
        expect(page.locator("#runs tbody tr")).to_have_count(k + 1)
        expect(page.locator("#start")).to_be_enabled()
        if k == 1:
            page.keyboard.press("3")
            page.locator("#runs").focus()
            page.keyboard.press("ArrowDown")
        if k < len(defects) - 1:
            bench.device.renew()
            page.keyboard.press("s")
            expect(page.locator("#verdict-why")).to_contain_text("waiting for points")
    page.keyboard.press("3")
    verdicts = ["NOT CONFORM" if defect_mm else "CONFORM" for defect_mm in reversed(defects)]
    expect(page.locator("#runs tbody td:first-child")).to_have_text(verdicts)
    expect(page.locator("#runs tbody td:nth-child(3)")).to_have_text(["B-0044", "B-0043", "B-0042", "B-0041"])
    expect(page.locator("#chart-words")).to_have_text("4 parts, 2 NOT CONFORM; newest at the right")
    expect(page.locator("#chart-title")).to_have_text("Worst deviation of the last 20 parts of blade.yaml")
    keep(page, "history")
    expect(page.locator("#runs tr[aria-selected=true]")).to_contain_text("B-0041")  # chosen before the last two came
    page.locator("#runs").focus()
    page.keyboard.press("ArrowUp")
    page.keyboard.press("Enter")
    expect(page.locator("#banners")).to_contain_text("Recorded run")
    expect(page.locator("#verdict-word")).to_have_text("NOT CONFORM")
    expect(page.locator("#serial-number")).to_have_text("B-0042")
    keep(page, "recorded")
    page.keyboard.press("Escape")
    expect(page.locator("#banners")).to_be_hidden()
    expect(page.locator("#verdict-word")).to_have_text("CONFORM")
    page.keyboard.press("3")
    with page.expect_download() as download:
        page.keyboard.press("x")
    assert download.value.suggested_filename.endswith("-0002.zip")
    check_report_while_measuring(bench, page, tmp_path)
    page.evaluate("() => { window.fetch = () => Promise.reject(new TypeError('Failed to fetch')); }")  # as where the network is gone
    page.keyboard.press("x")
    expect(page.locator("#said")).to_have_text(re.compile("-0002.zip was not saved: the station cannot be reached"))
    page.keyboard.press("r")
    expect(page.locator("#banners")).to_contain_text("identical to the recorded result, to the last bit")
    expect(page.locator("#verdict-word")).to_have_text("NOT CONFORM")


def test_history_is_searched_and_sorted_and_its_chart_is_that_of_the_chosen_plan(make_bench: MakeBench, tmp_path: Path, keep: Keep) -> None:
    past = PastRuns(tmp_path / "records", lambda _: None, monotonic, lambda: datetime.now().astimezone())
    bench = make_bench(records=past, plans=("blade.yaml", "other.yaml"))
    station = bench.station
    for k, (plan, operator, defect_mm) in enumerate((("blade.yaml", "Ada", 0.0), ("other.yaml", "Bob", 0.12), ("blade.yaml", "Bob", 0.0))):
        station.choose(plan)
        station.enter(f"S-{9 + k}", operator)
        points = batches(measured(bench.profile, 800, seed=k, defect_mm=defect_mm, at_mm=60.0), 400)
        bench.device.source.put(opened(800), *points, CLOSED)
        station.start()
        assert station.wait(20.0)
        bench.device.renew()
    page, serials = bench.page(), "#runs tbody td:nth-child(3)"
    page.keyboard.press("3")
    expect(page.locator(serials)).to_have_text(["S-11", "S-10", "S-9"])
    expect(page.locator("#chart-words")).to_contain_text("2 parts, 0 NOT CONFORM")
    page.locator("#runs th button", has_text="Serial number").click()
    expect(page.locator(serials)).to_have_text(["S-9", "S-10", "S-11"])
    expect(page.locator("#runs th[aria-sort=ascending]")).to_have_text("Serial number")
    page.locator("#runs th button", has_text="Worst").click()
    page.locator("#runs th button", has_text="Worst").click()
    expect(page.locator(serials).first).to_have_text("S-10")
    page.locator("#sought-operator").fill("bob")
    expect(page.locator("#found-words")).to_have_text("2 runs found")
    page.locator("#sought-verdict").select_option("conform")
    expect(page.locator(serials)).to_have_text(["S-11"])
    expect(page.locator("#worst-place")).to_contain_text(re.compile(r"^x \S+ mm, y \S+ mm$"))
    keep(page, "history-search")
    page.locator("#sought-verdict").select_option("nonconform")
    page.locator("#sought-plan").fill("other")
    page.locator("#sought-since").fill(f"{datetime.now():%Y-%m-%d}")
    expect(page.locator(serials)).to_have_text(["S-10"])
    page.locator("#sought-until").fill("2020-01-01")
    expect(page.locator("#found-words")).to_have_text("0 runs found")
    page.locator("#run-search button").click()
    expect(page.locator(serials)).to_have_count(3)
    station.choose("other.yaml")
    expect(page.locator("#chart-title")).to_contain_text("other.yaml")
    expect(page.locator("#chart-words")).to_contain_text("1 part, 1 NOT CONFORM")


def check_report_while_measuring(bench: Bench, page: Page, folder: Path) -> None:
    """The report of the chosen run is saved while the next part is measured, and so is its comparison with the run after it."""
    bench.device.renew()
    page.keyboard.press("s")
    expect(page.locator("#verdict-why")).to_contain_text("waiting for points")
    expect(page.locator("#report")).to_be_hidden()  # at the verdict of a run that is not over
    page.keyboard.press("3")
    with page.expect_download(timeout=LONG_MS) as download:
        page.locator("#report-run").click()
    assert download.value.suggested_filename.endswith("-0002.pdf")
    assert bench.station.running
    download.value.save_as(folder / "report.pdf")
    told = "".join(one.extract_text() for one in PdfReader(folder / "report.pdf").pages)
    assert "NOT CONFORM" in told
    assert "B-0042" in told
    page.keyboard.press("c")
    expect(page.locator("#said")).to_contain_text("is the first one")
    page.locator("#runs").focus()
    page.keyboard.press("ArrowUp")
    with patch.object(paper_process, "_make", made_here), page.expect_download() as download:
        page.keyboard.press("c")
    assert re.search(r"-0002-.*-0003\.pdf$", download.value.suggested_filename)
    download.value.save_as(folder / "both.pdf")
    assert "second - first" in PdfReader(folder / "both.pdf").pages[0].extract_text()
    page.keyboard.press("ArrowDown")
    page.keyboard.press("Escape")
    page.keyboard.press("Escape")
    expect(page.locator("#start")).to_be_enabled()
    expect(page.locator("#runs tr[aria-selected=true]")).to_contain_text("B-0042")
    expect(page.locator("#report-shown")).to_be_visible()  # at the verdict of the chosen run


def test_no_screen_shows_two_opposite_verdicts(make_bench: MakeBench, tmp_path: Path, keep: Keep) -> None:
    past = PastRuns(tmp_path / "records", lambda _: None, monotonic, lambda: datetime.now().astimezone())
    bench = make_bench(past)
    page = bench.started()
    bad = measured(bench.profile, 2000, seed=1, defect_mm=0.4)
    bench.device.source.put(opened(2000), *batches(bad, 50), Damaged(17, "checksum"), CLOSED)
    expect(page.locator("#verdict-word")).to_have_text("NOT CONFORM")
    expect(page.locator("#next")).to_be_enabled()
    page.keyboard.press("n")
    expect(page.locator("#serial-number")).to_have_text("B-0042")
    expect(page.locator("#verdict-word")).to_have_text("READY")
    expect(page.locator("#before")).to_have_text(re.compile("Before: B-0041.*NOT CONFORM"))
    keep(page, "next-part")
    bench.device.renew()
    bench.station.alarms.raise_alarm("fault", "Device failed", "left over from the part before")
    page.keyboard.press("Enter")
    expect(page.locator("#said")).to_contain_text("started")
    bench.device.source.put(opened(2000), *batches(measured(bench.profile, 2000, seed=1), 50), CLOSED)
    expect(page.locator("#verdict-word")).to_have_text("CONFORM")
    expect(page.locator("#alarms")).to_have_attribute("data-severity", "earlier")
    expect(page.locator("#alarm-text")).to_contain_text("earlier run B-0041 20")
    expect(page.locator("#lamp-faults")).to_contain_text("none")
    keep(page, "alarm-of-an-earlier-run")
    assert bench.station.wait(20.0)
    page.keyboard.press("3")
    page.locator("#runs tbody tr").nth(1).click()
    expect(page.locator("#verdict-word")).to_have_text("NOT CONFORM")
    expect(page.locator("#serial-number")).to_have_text("B-0041")
    expect(page.locator("#kind")).to_contain_text("RECORDED 20")
    keep(page, "history-card")
    began = past.runs()[1].began
    page.keyboard.press("r")
    expect(page.locator("#banners")).to_contain_text("identical to the recorded result")
    second = bench.page()
    second.keyboard.press("1")
    for one in (page, second):
        expect(one.locator("#kind")).to_have_text(f"REPLAY of {began}")
        expect(one.locator("#verdict-word")).to_have_text("NOT CONFORM")
        expect(one.locator("#age")).to_have_text(began[:19])
    expect(second.locator("#banners div")).to_have_count(2)  # a replay, and that another page is in control
    keep(second, "replay-on-a-second-page")


def test_names_that_look_like_markup_are_shown_as_they_are(make_bench: MakeBench, tmp_path: Path, keep: Keep) -> None:
    part, serial = "a$_$ [/] <b>x</b> " + "x" * 300, "<i>\u05d7\u05dc\u05e7</i> 7"
    bench = make_bench(PastRuns(tmp_path / "records", lambda _: None, monotonic, lambda: datetime.now().astimezone()))
    (plan,) = bench.station._setup.plans().values()
    text = PLAN.replace("name: blade 7, serial_number: B-0041", f"name: '{part}', serial_number: '{serial}'")
    plan.write_text(text, encoding="utf-8")
    page = bench.started()
    bench.device.source.put(opened(2000), *batches(measured(bench.profile, 2000, seed=1), 200), CLOSED)
    expect(page.locator("#verdict[data-final=true] .word")).to_have_text("CONFORM")
    expect(page.locator("#part")).to_have_text(part)
    expect(page.locator("#serial-number")).to_have_text(serial)
    assert overflowing(page) == []
    keep(page, "names")
    page.keyboard.press("2")
    expect(page.locator("#before")).to_contain_text(f"Before: \u2068{serial}\u2069")
    page.keyboard.press("3")
    expect(page.locator("#runs tbody td").nth(1)).to_have_text(part)
    expect(page.locator("#runs tbody td").nth(2)).to_have_text(serial)
    keep(page, "names-history")


def test_surface_is_imported_with_progress_and_its_sections_opened(make_bench: MakeBench, tmp_path: Path, keep: Keep) -> None:
    """A tube of the nominal section, 0.1 mm too thick over 20 mm of its outline above height 10 mm."""
    plan = tmp_path / "ct.yaml"
    released = threading.Event()

    def inspect(file: Path, stop: threading.Event, on_start: Callable[[int], None], on_section: Callable[[Section], None]) -> Summary:
        def one_by_one(section: Section) -> None:
            on_section(section)
            if section.height_mm == 8:
                assert released.wait(60)

        return inspect_surface(tmp_path / "records", file, stop, on_start, one_by_one)

    records = PastRuns(tmp_path / "records", lambda _: None, monotonic, lambda: datetime.now().astimezone())
    bench = make_bench(records, surfaces={"ct.yaml": plan}, inspect=inspect)
    page = bench.page()
    expect(page.locator("#tab-ct")).to_be_visible()
    page.keyboard.press("4")
    page.locator("#ct-plans div").click()
    expect(page.locator("#ct-message")).to_contain_text("✕ ct.yaml")
    plan.write_text(CT_PLAN + "rule: best-fit\n", encoding="utf-8")  # another placement takes so long a stretch into the zone
    station = np.linspace(0, bench.profile.length_mm, 3000, endpoint=False)
    rings = [surface_ring(bench.profile, station, 0.1 if height_mm > 10 else 0.0) for height_mm in (0, 6, 10.5, 20)]
    mesh = np.concatenate([tube(ring, np.array(ends)) for ring, ends in zip(rings, ((0, 6), (6, 10), (10, 14), (14, 20)), strict=True)])
    write(tmp_path / "blade.stl", binary_stl(mesh))
    focus(page, "ct-plans")
    page.keyboard.press("Enter")
    expect(page.locator("#ct-words")).to_have_text(re.compile("2 of 4, about [0-9]+ s left"))
    expect(page.locator("#ct-bar")).to_be_visible()
    expect(page.locator("#abort")).to_be_enabled()
    released.set()
    expect(page.locator("#ct-message")).to_have_text("2 of 4 sections of blade.stl NOT CONFORM")
    expect(page.locator("#verdict-word")).to_have_text("NOT CONFORM")
    expect(page.locator("#notes li").first).to_contain_text("section.yaml: ")
    expect(page.locator("#worst-value")).to_contain_text("+0.08")
    expect(page.locator("#sections tbody td:first-child")).to_have_text(["CONFORM", "CONFORM", "NOT CONFORM", "NOT CONFORM"])
    keep(page, "ct")
    focus(page, "sections")
    page.keyboard.press("End")
    page.keyboard.press("Enter")
    expect(page.locator("#banners")).to_contain_text("Section at height 16.000 mm of blade.stl")
    expect(page.locator("#verdict-word")).to_have_text("NOT CONFORM")
    section = bench.station.ct.section(3)
    assert section is not None
    worst = section.ended.result["worst"]["deviation_mm"]
    assert worst == pytest.approx(0.09, abs=0.015), "0.1 mm, less what the best fit takes of a stretch so long"
    assert millimetres(page.locator("#worst-value").text_content()) == pytest.approx(worst, abs=5.1e-5)
    page.wait_for_function(f"({INKED})('#profile') && ({INKED})('#strip')")
    page.keyboard.press("Escape")
    expect(page.locator("#banners")).to_be_hidden()
    page.wait_for_function(f"!({INKED})('#profile') && !({INKED})('#strip')")  # nothing is left of what is no longer shown
    check_sections_on_record(page)


def check_sections_on_record(page: Page) -> None:
    """Each section stands in the history, and is replayed from there; the chart of parts does not count it."""
    page.keyboard.press("3")
    heights = ("16.000", "12.000", "8.000", "4.000")
    told = [re.compile(f"blade 7, section {4 - k} of 4 at {height} mm") for k, height in enumerate(heights)]
    expect(page.locator("#runs tbody tr")).to_have_text(told)
    expect(page.locator("#chart-words")).to_be_empty()
    page.keyboard.press("r")
    expect(page.locator("#banners")).to_contain_text("identical to the recorded result, to the last bit")
    expect(page.locator("#verdict-word")).to_have_text("NOT CONFORM")


def surface_ring(profile: NominalProfile, station_mm: NDArray[np.float64], excess_mm: float) -> NDArray[np.float64]:
    """The outline (m, 2) with an excess around station 60 mm."""
    deviation = excess_mm * np.exp(-(((station_mm - 60) / 8) ** 4))
    return synthetic.scan(profile, station_mm, deviation, RigidTransform.identity()).points_mm
