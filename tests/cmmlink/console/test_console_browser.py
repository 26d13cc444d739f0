"""What an operator sees and does, in a real browser."""

import json
import re
import subprocess
import sys
import threading
from collections.abc import Callable, Sequence
from datetime import datetime
from pathlib import Path
from time import monotonic

import numpy as np
import pytest
from numpy.typing import NDArray
from playwright.sync_api import Browser, Page, expect

from cmmlink.commands.console import inspect_surface
from cmmlink.console.ct_import import Section
from cmmlink.console.listening import Access
from cmmlink.console.past_runs import PastRuns
from cmmlink.console.server import ConsoleServer
from cmmlink.errors import StoreError
from cmmlink.record.chain import Draft, Record
from cmmlink.record.store import Store
from drivers.errors import LinkError
from drivers.source import Damaged, LinkDown, LinkUp, Lost
from inspection import InspectionResult, NominalProfile, RigidTransform, Verdict, synthetic
from tests.drivers.surface.meshes import binary_stl, tube, write

from .conftest import TOKEN, Bench, MakeBench
from .played import CLOSED, PLAN, batches, measured, opened

Keep = Callable[[Page, str], None]
Summary = tuple[str, Sequence[str]]


def number(page: Page, name: str) -> int:
    return int((page.locator(f"#{name}").text_content() or "").replace(",", ""))


def millimetres(words: str | None) -> float:
    found = re.search(r"[+−]\d+\.\d+", words or "")
    assert found, words
    return float(found[0].replace("−", "-"))


def test_count_rises_and_a_good_part_conforms(bench: Bench, keep: Keep) -> None:
    page = bench.started()
    points = batches(measured(bench.profile, 2000, seed=1), 50)
    expect(page.locator("#lamp-link")).to_contain_text("connecting")
    bench.device.source.put(opened(2000), *points[:20])
    expect(page.locator("#received")).to_have_text("1,000")
    expect(page.locator("#lamp-link")).to_contain_text("up")
    expect(page.locator("#simulated")).to_be_visible()
    expect(page.locator("#verdict-word")).to_have_text("NOT PROVEN")
    expect(page.locator("#verdict-why")).to_contain_text("none out so far")
    expect(page.locator("#registration li[aria-current]")).to_have_text("provisional")
    expect(page.locator("#can-move")).to_have_text("the pose still moves")
    keep(page, "measuring")
    bench.device.source.put(*points[20:], CLOSED)
    expect(page.locator("#verdict-word")).to_have_text("CONFORM")
    expect(page.locator("#verdict-why")).to_have_text("all 2,000 points within tolerance")
    expect(page.locator("#registration li[aria-current]")).to_have_text("settled")
    expect(page.locator("#coverage")).to_have_text("100 %")
    assert [number(page, name) for name in ("received", "judged", "rejected", "lost")] == [2000, 2000, 0, 0]
    expect(page.locator("#part")).to_have_text("blade 7")
    expect(page.locator("#serial-number")).to_have_text("B-0041")
    expect(page.locator("#plan-operator")).to_contain_text("Ada")
    keep(page, "normal")


def test_defect_turns_the_verdict_and_the_worst_point_is_named(bench: Bench, keep: Keep) -> None:
    page = bench.started()
    points = batches(measured(bench.profile, 2000, seed=2, defect_mm=0.12, at_mm=60.0), 50)
    bench.device.source.put(opened(2000), *points[:30])
    expect(page.locator("#verdict-word")).to_have_text("NOT CONFORM")
    expect(page.locator("#provisional")).to_have_text("so far")
    bench.device.source.put(*points[30:], CLOSED)
    expect(page.locator("#verdict[data-final=true] .word")).to_have_text("NOT CONFORM")
    outcome = finished(bench)
    assert outcome.worst is not None
    assert millimetres(page.locator("#worst-value").text_content()) == pytest.approx(outcome.deviation_mm[outcome.worst], abs=5.1e-5)
    assert outcome.deviation_mm[outcome.worst] == pytest.approx(0.12, abs=0.02)
    expect(page.locator("#worst-where")).to_have_text(f"at station {outcome.station_mm[outcome.worst]:.2f} mm")
    assert outcome.station_mm[outcome.worst] == pytest.approx(60.0, abs=0.6)
    expect(page.locator("#worst-shape")).to_have_text("▲")
    assert page.locator("body").get_attribute("data-verdict") == "not-conform"
    keep(page, "defect")


def finished(bench: Bench) -> InspectionResult:
    """The result of the run that just ended."""
    assert bench.station.wait(20.0)
    job = bench.station.job
    assert job is not None
    assert job.finished is not None
    assert job.finished.outcome.result is not None
    return job.finished.outcome.result


def test_what_was_aborted_never_stands_as_a_settled_verdict(bench: Bench, keep: Keep) -> None:
    page = bench.started()
    part = measured(bench.profile, 2000, seed=1, defect_mm=0.4)
    bench.device.source.put(opened(2000), *batches(part, 50)[:20])
    expect(page.locator("#received")).to_have_text("1,000")
    page.keyboard.press("2")
    page.locator("#view-part").wait_for(state="visible")
    page.keyboard.press("Escape")
    expect(page.locator("#verdict-word")).to_have_text("READY")
    expect(page.locator("#before")).to_have_text(re.compile(r"Before: B-0041.*ABORTED AT (49|50) %"))
    page.keyboard.press("1")
    expect(page.locator("#verdict-word")).to_have_text(re.compile(r"ABORTED AT (49|50) %"))
    expect(page.locator("#verdict-why")).to_have_text(re.compile(r"no verdict: the scan was aborted; \d+ points out until then"))
    expect(page.locator("body")).to_have_attribute("data-verdict", "ended-early")
    expect(page.locator("#verdict")).to_have_attribute("data-final", "false")
    expect(page.locator("#can-move")).not_to_contain_text("final")
    keep(page, "aborted")
    assert bench.station.wait(20.0)
    assert finished(bench).verdict is Verdict.UNCERTAIN
    assert bench.station.job is not None
    assert bench.station.job.finished is not None
    assert bench.station.job.finished.outcome.ending == "aborted"
    assert number(page, "received") == number(page, "judged") + number(page, "rejected") == 1000


def test_end_of_scan_is_no_abort_and_coverage_decides(bench: Bench) -> None:
    page = bench.started()
    bench.device.source.put(opened(2000), *batches(measured(bench.profile, 2000, seed=1), 50)[:20])
    expect(page.locator("#received")).to_have_text("1,000")
    page.keyboard.press("e")
    expect(page.locator("#verdict-why")).to_contain_text("The device announced 2000 points and 1000 arrived")
    assert finished(bench).complete


def test_unplugged_and_recovered(bench: Bench, keep: Keep) -> None:
    page = bench.started()
    points = batches(measured(bench.profile, 2000, seed=1), 50)
    bench.device.source.put(opened(2000), *points[:20])
    expect(page.locator("#received")).to_have_text("1,000")
    bench.device.source.put(LinkDown("the port is gone"))
    expect(page.locator("#lamp-link")).to_contain_text("LOST")
    expect(page.locator("#banners")).to_contain_text("LINK LOST")
    expect(page.locator("#lamp-faults")).to_contain_text("FAULT")
    expect(page.locator("#alarm-text")).to_have_text("Link lost: the port is gone")
    keep(page, "link-lost")
    bench.device.source.put(LinkUp(1.5), Lost(40, "gap in the counter"), Damaged(17, "checksum"), *points[21:], CLOSED)
    expect(page.locator("#lost")).to_have_text("40")
    expect(page.locator("#lamp-link")).to_contain_text("closed")
    page.keyboard.press("a")
    expect(page.locator("#alarm-text")).to_have_text("No alarm")
    expect(page.locator("#lamp-faults")).to_contain_text("none")
    page.keyboard.press("l")
    expect(page.locator("#alarm-list li")).to_have_text(
        [re.compile("Damaged bytes .17.: checksum"), re.compile("Data lost .40."), re.compile("Link lost")]
    )
    assert number(page, "received") == number(page, "judged") == 1950


def test_device_that_fails_ends_the_run_as_not_proven(bench: Bench, keep: Keep) -> None:
    page = bench.started()
    bench.device.source.put(
        opened(2000), *batches(measured(bench.profile, 2000, seed=1), 50)[:30], LinkError("COM3 does not answer any more")
    )
    expect(page.locator("#verdict-word")).to_have_text(re.compile(r"INTERRUPTED AT 7\d %"))
    expect(page.locator("#verdict-why")).to_have_text("COM3 does not answer any more")
    expect(page.locator("#reasons li").first).to_have_text("no verdict: the scan was interrupted; none out until then")
    expect(page.locator("#alarm-text")).to_have_text("Device failed: COM3 does not answer any more")
    expect(page.locator("#received")).to_have_text("1,500")
    keep(page, "device-failed")


def test_a_device_that_never_opened_is_not_measured(make_bench: MakeBench, tmp_path: Path, keep: Keep) -> None:
    records = PastRuns(tmp_path / "records", lambda _: None, monotonic, lambda: datetime.now().astimezone())
    bench = make_bench(records)
    page = bench.started()
    bench.device.source.put(LinkError("COM3 cannot be opened"))
    expect(page.locator("#verdict-word")).to_have_text("NOT MEASURED")
    expect(page.locator("#verdict-why")).to_have_text("COM3 cannot be opened")
    keep(page, "never-opened")
    page.keyboard.press("3")
    expect(page.locator("#no-runs")).to_be_visible()


def test_no_part_found_is_said(bench: Bench, keep: Keep) -> None:
    page = bench.started()
    rng = np.random.default_rng(5)
    noise = np.column_stack([rng.uniform(-300, 300, (600, 2)), np.zeros(600)])
    bench.device.source.put(opened(600), *batches(noise, 50), CLOSED)
    expect(page.locator("#verdict-why")).to_contain_text("the points do not fit the nominal")
    expect(page.locator("#verdict-word")).to_have_text("NOT MEASURED")
    expect(page.locator("#alarm-text")).to_contain_text("Not measured: the points do not fit the nominal")
    keep(page, "no-part-found")


def test_full_disk_stops_the_run_and_says_so(make_bench: MakeBench, tmp_path: Path, keep: Keep, monkeypatch: pytest.MonkeyPatch) -> None:
    append, left = Store.append, [1000]

    def append_until_full(store: Store, drafts: Sequence[Draft]) -> list[Record]:
        left[0] -= sum(draft.count for draft in drafts if draft.kind == "points")
        if left[0] < 0:
            raise StoreError("station.sqlite: no space left on the device")
        return append(store, drafts)

    monkeypatch.setattr(Store, "append", append_until_full)
    bench = make_bench(records=PastRuns(tmp_path / "records", lambda _: None, monotonic, lambda: datetime.now().astimezone()))
    page = bench.started()
    points = batches(measured(bench.profile, 2000, seed=1), 50)
    bench.device.source.put(opened(2000), *points[:10])
    expect(page.locator("#received")).to_have_text("500")
    bench.device.source.put(*points[10:22])  # and now the device pauses: no further event tells the run of the disk
    expect(page.locator("#alarm-text")).to_have_text(re.compile("Record not kept: .*no space left on the device"))
    expect(page.locator("#verdict-word")).to_have_text(re.compile(r"INTERRUPTED AT [45]\d %"))
    expect(page.locator("#verdict-why")).to_contain_text("Record not kept: the record of this run cannot be kept, so it has no result")
    expect(page.locator("#lamp-faults")).to_contain_text("FAULT")
    assert number(page, "received") == number(page, "judged") + number(page, "rejected") == 1100
    assert bench.station.wait(5.0)
    keep(page, "disk-full")
    page.keyboard.press("3")
    expect(page.locator("#runs tbody tr")).to_have_text([re.compile("^INTERRUPTED.*interrupted")])
    keep(page, "disk-full-history")


def test_invalid_plan_is_shown_with_its_line(make_bench: MakeBench, keep: Keep) -> None:
    bench = make_bench(plans=("blade.yaml", "wrong.yaml"))
    wrong = bench.station._setup.plans()["wrong.yaml"]
    wrong.write_text(PLAN.replace("upper_mm: 0.05", "upper_mm: -0.08"), encoding="utf-8")
    page = bench.page()
    page.locator("#plans div", has_text="wrong.yaml").click()
    expect(page.locator("#check-word")).to_contain_text("Cannot be run: wrong.yaml: line 4: tolerance.upper_mm is '-0.08'")
    expect(page.locator("#plan-text .wrong")).to_have_text("tolerance: {lower_mm: -0.05, upper_mm: -0.08}")
    expect(page.locator("#start")).to_be_disabled()
    expect(page.locator("#verdict-word")).to_have_text("NO PLAN")
    keep(page, "plan-invalid")
    wrong.write_text(PLAN, encoding="utf-8")
    page.locator("#plans div", has_text="wrong.yaml").click()
    expect(page.locator("#check-word")).to_have_text("✓ wrong.yaml can be run.")


def test_address_opens_one_page_which_stays_open_when_it_is_loaded_anew(bench: Bench) -> None:
    address = bench.server.new_address()
    page = bench.page(address=address)
    expect(page.locator("#plans div")).to_have_count(1)
    assert page.url == address.partition("#")[0]
    page.reload()
    expect(page.locator("#plans div")).to_have_count(1)
    second = bench.page(address=address)
    expect(second.locator("#banners")).to_contain_text("press Enter where the console runs")
    expect(second.locator("#plans div")).to_have_count(0)
    page.goto(address)  # the tab that has the token already
    page.reload()
    expect(page.locator("#plans div")).to_have_count(1)


def test_open_page_gives_an_address_for_one_more(bench: Bench) -> None:
    page = bench.page()
    page.locator("#another-page").click()
    expect(page.locator("#said")).to_contain_text("within a minute: http://127.0.0.1:")
    address = "http" + (page.locator("#said").text_content() or "").partition("http")[2]
    expect(bench.page(address=address).locator("#plans div")).to_have_count(1)


def test_page_without_the_token_is_refused(bench: Bench) -> None:
    page = bench.page(address=bench.server.new_address().partition("#")[0] + "#guessed")
    expect(page.locator("#banners")).to_contain_text("no access")
    expect(page.locator("#plans div")).to_have_count(0)
    code = page.evaluate(
        """() => new Promise(done => { const s = new WebSocket(`ws://${location.host}/live`);
           s.onopen = () => s.send('{"token": 7}'); s.onclose = e => done(e.code); })"""
    )
    assert code == 4401
    assert bench.server.pages == 0


def test_foreign_origin_is_refused(bench: Bench, make_bench: MakeBench) -> None:
    other = make_bench()
    page = other.page()
    expect(page.locator("#plans div")).to_have_count(1)
    attempt = f"""() => new Promise(done => {{ const s = new WebSocket('ws://127.0.0.1:{bench.server.port}/live');
        s.onopen = () => done('open'); s.onerror = () => done('refused'); }})"""
    blank = other.browser.new_context().new_page()
    blank.goto("about:blank")
    assert blank.evaluate(attempt) == "refused"
    assert bench.server.pages == 0


def test_keyboard_alone_is_enough(bench: Bench) -> None:
    page = bench.page()
    expect(page.locator("#plans div")).to_have_count(1)
    focus(page, "plans")
    page.keyboard.press("Enter")
    expect(page.locator("#serial")).to_be_focused()
    page.keyboard.type("K-0099")
    page.keyboard.press("Tab")
    expect(page.locator("#operator")).to_be_focused()
    page.keyboard.press("Control+a")
    page.keyboard.type("Grace")
    page.keyboard.press("Enter")
    bench.device.source.put(opened(2000), *batches(measured(bench.profile, 2000, seed=1, defect_mm=-0.2, at_mm=100.0), 50), CLOSED)
    expect(page.locator("#verdict-word")).to_have_text("NOT CONFORM")
    expect(page.locator("#serial-number")).to_have_text("K-0099")
    expect(page.locator("#plan-operator")).to_contain_text("Grace")
    expect(page.locator("#verdict")).to_have_attribute("data-final", "true")
    for name in ("strip", "profile"):
        focus(page, name)
        whole = drawn(page, name)
        page.keyboard.press("w")
        assert drawn(page, name) == whole, "a read-out leaves the drawing as it is"
        assert drawn(page, name, layer=2) != drawn(page, name, layer=2, after="ArrowLeft"), "the read-out moves"
        zoomed = drawn(page, name, after="+")
        assert zoomed != whole
        assert drawn(page, name, after="Shift+ArrowLeft") != zoomed
        assert drawn(page, name, after="0") == whole
    bench.device.renew()
    page.keyboard.press("n")
    expect(page.locator("#serial")).to_be_focused()
    expect(page.locator("#serial")).to_have_value("K-0100")
    page.keyboard.press("Enter")
    expect(page.locator("#verdict-why")).to_contain_text("waiting for points")
    page.keyboard.press("Escape")
    expect(page.locator("#verdict-why")).to_have_text("no point was received")


def drawn(page: Page, name: str, layer: int = 0, after: str = "") -> str:
    """What one layer of a drawing looks like once the page has painted, after a key was pressed."""
    if after:
        page.keyboard.press(after)
    script = """([name, layer]) => new Promise(done => requestAnimationFrame(() => requestAnimationFrame(() =>
        done(document.querySelectorAll(`#${name} canvas`)[layer].toDataURL()))))"""
    return str(page.evaluate(script, [name, layer]))


def focus(page: Page, name: str) -> None:
    """Go to an element by the tab key."""
    for _ in range(60):
        if page.evaluate("document.activeElement.id") == name:
            return
        page.keyboard.press("Tab")
    raise AssertionError(f"{name} cannot be reached by the tab key")


def test_two_pages_see_the_same_run_and_one_controls_it(bench: Bench) -> None:
    page = bench.started()
    watcher = bench.page()
    expect(watcher.locator("#banners")).to_contain_text("Watching: another page is in control")
    bench.device.source.put(opened(2000), *batches(measured(bench.profile, 2000, seed=1), 50)[:20])
    for one in (page, watcher):
        expect(one.locator("#received")).to_have_text("1,000")
    expect(watcher.locator("#abort")).to_be_disabled()
    watcher.keyboard.press("Escape")
    expect(watcher.locator("#said")).to_contain_text("another page is in control")
    assert bench.station.running
    watcher.locator("#banners button").click()
    expect(page.locator("#banners")).to_contain_text("Watching")
    expect(page.locator("#abort")).to_be_disabled()
    watcher.keyboard.press("Escape")
    for one in (page, watcher):
        expect(one.locator("#verdict-why")).to_contain_text("the scan was aborted")


def test_page_says_that_it_is_stale_and_comes_back_after_a_restart(bench: Bench) -> None:
    page = bench.page()
    expect(page.locator("#plans div")).to_have_count(1)
    bench.server.stop()
    expect(page.locator("#banners")).to_contain_text("STALE")
    assert page.locator("body").get_attribute("data-stale") == "true"
    bench.server = ConsoleServer(bench.station, "test", Access(port=bench.server.port), token=TOKEN)
    bench.server.start()
    expect(page.locator("#banners")).to_be_hidden()
    page.locator("#plans div").click()
    expect(page.locator("#check-word")).to_contain_text("can be run")
    bench.complaints = [said for said in bench.complaints if "ERR_CONNECTION_REFUSED" not in said]


def test_every_button_works_again_after_a_stall(bench: Bench, monkeypatch: pytest.MonkeyPatch) -> None:
    """A station that did not answer for more than 2 s, and then does: no reload is needed."""
    page = bench.page()
    page.locator("#plans div").click()
    expect(page.locator("#start")).to_be_enabled()
    stalled, released, now_ms = threading.Event(), threading.Event(), bench.station.now_ms

    def stall() -> float:
        stalled.set()
        assert released.wait(60)
        return now_ms()

    monkeypatch.setattr(bench.station, "now_ms", stall)
    assert stalled.wait(20)
    expect(page.locator("#banners")).to_contain_text("STALE")
    for button in ("start", "end", "abort", "next", "acknowledge"):
        expect(page.locator(f"#{button}")).to_be_disabled()
    released.set()
    expect(page.locator("#banners")).to_be_hidden()
    for button in ("start", "next"):
        expect(page.locator(f"#{button}")).to_be_enabled()
    bench.station.alarms.raise_alarm("fault", "Link lost", "unplugged")
    page.locator("#acknowledge").click()
    expect(page.locator("#alarm-text")).to_have_text("No alarm")
    page.locator("#start").click()
    expect(page.locator("#said")).to_contain_text("started")
    bench.device.source.put(opened(2000), *batches(measured(bench.profile, 2000, seed=1), 50)[:20])
    expect(page.locator("#received")).to_have_text("1,000")
    page.locator("#end").click()
    expect(page.locator("#verdict[data-final=true]")).to_be_visible()
    assert finished(bench).complete
    page.locator("#next").click()
    expect(page.locator("#serial")).to_be_focused()


def test_no_spike_is_hidden_among_many_points(bench: Bench) -> None:
    """One point of 20,000 is out by 0.2 mm: the strip has its colour in the very column, and the read-out its value."""
    page = bench.started()
    points = measured(bench.profile, 20_000, seed=3)
    spike = 8_456
    out = points[spike, :2] - points[spike - 2000 : spike + 2000, :2].mean(axis=0)
    points[spike, :2] += 0.2 * out / np.hypot(*out)
    bench.device.source.put(opened(20_000), *batches(points, 1000), CLOSED)
    expect(page.locator("#verdict-why")).to_have_text("1 point lies beyond the limits -0.05 .. 0.05 mm.")
    result = finished(bench)
    share = result.station_mm[result.worst] / bench.profile.length_mm
    column, count = page.evaluate(COLOURED, "#c2410c")
    assert count > 10
    assert column == pytest.approx(share, abs=0.01)
    focus(page, "strip")
    page.keyboard.press("w")
    assert millimetres(page.locator("#worst-value").text_content()) == pytest.approx(result.deviation_mm[result.worst], abs=5.1e-5)


# Mean place (share of the axis) and number of pixels of one colour on the strip.
COLOURED = """(colour) => {
    const canvas = document.querySelectorAll('#strip canvas')[1], ratio = devicePixelRatio;
    const pixels = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height).data;
    const wanted = [1, 3, 5].map(k => parseInt(colour.slice(k, k + 2), 16));
    const text = Math.max(11, Math.round(parseFloat(getComputedStyle(document.documentElement).fontSize) * 0.86));
    const left = text * 5.2 * ratio, right = canvas.width - text * 1.2 * ratio;
    let sum = 0, count = 0;
    for (let k = 0; k < pixels.length; k += 4)
        if (pixels[k + 3] > 200 && wanted.every((value, c) => Math.abs(pixels[k + c] - value) < 12)) {
            sum += (k / 4) % canvas.width; count += 1;
        }
    return [(sum / count - left) / (right - left), count];
}"""


def test_history_is_listed_opened_replayed_and_exported(make_bench: MakeBench, tmp_path: Path, keep: Keep) -> None:
    past = PastRuns(tmp_path / "records", lambda _: None, monotonic, lambda: datetime.now().astimezone())
    bench = make_bench(records=past)
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
    page.evaluate("() => { window.fetch = () => Promise.reject(new TypeError('Failed to fetch')); }")  # as where the network is gone
    page.keyboard.press("x")
    expect(page.locator("#said")).to_have_text(re.compile("-0002.zip was not saved: the station cannot be reached"))
    page.keyboard.press("r")
    expect(page.locator("#banners")).to_contain_text("identical to the recorded result, to the last bit")
    expect(page.locator("#verdict-word")).to_have_text("NOT CONFORM")


def test_demonstration_goes_from_its_address_to_a_verdict(browser: Browser, tmp_path: Path, keep: Keep) -> None:
    """The command as a user starts it: a process of its own, a simulated device, a serial line."""
    command = [sys.executable, "-m", "cmmlink", "demo", "--no-browser", "--defect", "0.12@40"]
    folders = ["--records", str(tmp_path / "records"), "--out", str(tmp_path / "out")]
    with subprocess.Popen([*command, *folders], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        try:
            assert process.stderr is not None
            address = process.stderr.readline().split()[1]
            context = browser.new_context(viewport={"width": 1280, "height": 800})
            page = context.new_page()
            page.goto(address)
            expect(page.locator("#simulated")).to_be_visible(timeout=60_000)
            expect(page.locator("#received")).to_have_text("4,000", timeout=60_000)
            expect(page.locator("#verdict[data-final=true] .word")).to_have_text("NOT CONFORM")
            expect(page.locator("#runs tbody tr")).to_have_count(1)
            shown, where = page.locator("#worst-value").text_content(), page.locator("#worst-where").text_content()
            keep(page, "demo")
            context.close()
            words, said = process.communicate(timeout=60)
        finally:
            process.kill()
    assert process.returncode == 1, said
    assert words.startswith("NOT CONFORM")
    worst = json.loads((tmp_path / "out" / "result.json").read_text(encoding="utf-8"))["worst"]
    assert millimetres(shown) == pytest.approx(worst["deviation_mm"], abs=5.1e-5)
    assert where == f"at station {worst['station_mm']:.2f} mm"
    assert worst["station_mm"] == pytest.approx(40.0, abs=1.0)


CT_PLAN = """part: {name: blade 7}
mesh: {file: blade.stl}
nominal: {file: section.yaml}
tolerance: {lower_mm: -0.05, upper_mm: 0.05}
sections: {heights_mm: [4, 8, 12, 16]}
cut: {cutter: numpy}
"""


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


# Whether anything is drawn.
INKED = """(drawing) => [...document.querySelectorAll(`${drawing} canvas`)].some(canvas => {
    const blank = Object.assign(document.createElement('canvas'), { width: canvas.width, height: canvas.height });
    return canvas.toDataURL() !== blank.toDataURL();
})"""


def surface_ring(profile: NominalProfile, station_mm: NDArray[np.float64], excess_mm: float) -> NDArray[np.float64]:
    """The outline (m, 2) with an excess around station 60 mm."""
    deviation = excess_mm * np.exp(-(((station_mm - 60) / 8) ** 4))
    return synthetic.scan(profile, station_mm, deviation, RigidTransform.identity()).points_mm


def test_station_open_to_the_network_says_so(make_bench: MakeBench) -> None:
    bench = make_bench(access=Access("0.0.0.0", unencrypted=True))
    page = bench.page()
    expect(page.locator("#banners")).to_contain_text("open to the network")


@pytest.mark.parametrize(("width", "height"), [(1280, 800), (1920, 1080), (1024, 700)])
def test_everything_is_on_the_screen_without_scrolling(bench: Bench, keep: Keep, width: int, height: int) -> None:
    page = bench.page(width, height)
    page.locator("#plans div").click()
    expect(page.locator("#serial")).to_be_focused()
    page.keyboard.press("Enter")
    bench.device.source.put(opened(2000), *batches(measured(bench.profile, 2000, seed=2, defect_mm=0.12, at_mm=60.0), 50), CLOSED)
    expect(page.locator("#verdict[data-final=true] .word")).to_have_text("NOT CONFORM")
    seen = "verdict-word verdict-why worst-value worst-where worst-use coverage lost age abort serial-number strip profile remarks"
    for name in seen.split():
        box = page.locator(f"#{name}").bounding_box()
        assert box is not None
        assert box["x"] >= 0
        assert box["y"] >= 0
        assert box["x"] + box["width"] <= width
        assert box["y"] + box["height"] <= height
    assert overflowing(page) == []
    keep(page, "defect")


def overflowing(page: Page) -> list[str]:
    """Elements of the result whose text does not fit into their box; the list of reasons and notes scrolls."""
    found: list[str] = page.evaluate(
        """() => [...document.querySelectorAll('aside .card, aside .verdict, aside dd, .word, .why, .big, .where')]
           .filter(e => e.offsetParent && e.id !== 'remarks' && (e.scrollWidth > e.clientWidth + 1
               || (!e.matches('.word, .big') && e.scrollHeight > e.clientHeight + 3)))  // their lines are set closer than their letters
           .map(e => e.className + ' ' + e.id)"""
    )
    return found
