"""What an operator sees of a run, in a real browser: counts, verdict, worst point, faults."""

import json
import re
import subprocess
import sys
import threading
from collections.abc import Callable, Sequence
from datetime import datetime
from pathlib import Path
from time import monotonic
from typing import Any

import numpy as np
import pytest
from playwright.sync_api import Browser, Page, expect

from cmmlink.console.past_runs import PastRuns
from cmmlink.errors import StoreError
from cmmlink.record.chain import Draft, Record
from cmmlink.record.store import Store
from drivers.errors import LinkError
from drivers.source import Damaged, LinkDown, LinkUp, Lost
from inspection import Verdict

from .conftest import Bench, MakeBench
from .played import CLOSED, PLAN, batches, measured, opened
from .seen import finished, focus, millimetres, number, overflowing

Keep = Callable[[Page, str], None]

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
    profile, k = bench.profile, int(np.abs(bench.profile.station_mm - outcome.station_mm[outcome.worst]).argmin())
    place = profile.points_mm[k] + outcome.deviation_mm[outcome.worst] * profile.outward * profile.normal[k]
    told = re.fullmatch(r"x (\S+) mm, y (\S+) mm", (page.locator("#worst-place").text_content() or "").replace("\u2212", "-"))
    assert told is not None
    assert [float(told[1]), float(told[2])] == pytest.approx(place.tolist(), abs=0.05), "the spacing of the samples is 0.03 mm"
    assert outcome.station_mm[outcome.worst] == pytest.approx(60.0, abs=0.6)
    expect(page.locator("#worst-shape")).to_have_text("▲")
    assert page.locator("body").get_attribute("data-verdict") == "not-conform"
    keep(page, "defect")


def test_what_was_aborted_never_stands_as_a_settled_verdict(bench: Bench, keep: Keep) -> None:
    page = bench.started()
    part = measured(bench.profile, 2000, seed=1, defect_mm=0.4)
    bench.device.source.put(opened(2000), *batches(part, 50)[:20])
    expect(page.locator("#received")).to_have_text("1,000")
    page.keyboard.press("2")
    page.locator("#view-part").wait_for(state="visible")
    page.keyboard.press("Escape")
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
    append, left, judged = Store.append, [1000], threading.Event()

    def append_until_full(store: Store, drafts: Sequence[Draft], *behind: Any) -> list[Record]:
        left[0] -= sum(draft.count for draft in drafts if draft.kind == "points")
        if left[0] < 0:
            assert judged.wait(60.0)
            raise StoreError("station.sqlite: no space left on the device")
        return append(store, drafts, *behind)

    monkeypatch.setattr(Store, "append", append_until_full)
    bench = make_bench(records=PastRuns(tmp_path / "records", lambda _: None, monotonic, lambda: datetime.now().astimezone()))
    page = bench.started()
    points = batches(measured(bench.profile, 2000, seed=1), 50)
    bench.device.source.put(opened(2000), *points[:10])
    expect(page.locator("#received")).to_have_text("500")
    bench.device.source.put(*points[10:22])  # and now the device pauses: no further event tells the run of the disk
    expect(page.locator("#received")).to_have_text("1,100")
    judged.set()
    expect(page.locator("#alarm-text")).to_have_text(re.compile("Record not kept: .*no space left on the device"))
    expect(page.locator("#verdict-word")).to_have_text(re.compile(r"INTERRUPTED AT [45]\d %"))
    expect(page.locator("#verdict-why")).to_contain_text("Record not kept: the record of this run cannot be kept, so it has no result")
    expect(page.locator("#lamp-faults")).to_contain_text("FAULT")
    assert number(page, "received") == number(page, "judged") + number(page, "rejected") == 1100
    assert bench.station.wait(20.0)
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


def test_everything_is_on_the_screen_without_scrolling(bench: Bench, keep: Keep) -> None:
    page = bench.page()
    page.locator("#plans div").click()
    expect(page.locator("#serial")).to_be_focused()
    page.keyboard.press("Enter")
    bench.device.source.put(opened(2000), *batches(measured(bench.profile, 2000, seed=2, defect_mm=0.12, at_mm=60.0), 50), CLOSED)
    expect(page.locator("#verdict[data-final=true] .word")).to_have_text("NOT CONFORM")
    seen = "verdict-word verdict-why worst-value worst-where worst-use coverage lost age abort serial-number strip profile remarks"
    for width, height in ((1280, 800), (1920, 1080), (1024, 700)):
        page.set_viewport_size({"width": width, "height": height})
        for name in seen.split():
            box = page.locator(f"#{name}").bounding_box()
            assert box is not None
            assert box["x"] >= 0
            assert box["y"] >= 0
            assert box["x"] + box["width"] <= width
            assert box["y"] + box["height"] <= height
        assert overflowing(page) == []
    keep(page, "defect")
