"""What an operator sees of a machine tool that waits for the verdict, in a real browser: that it waits, was told, or was not."""

import re
from datetime import datetime
from pathlib import Path
from time import monotonic

from playwright.sync_api import expect

from cmmlink.console.past_runs import PastRuns
from drivers.source import ScanOpened

from .conftest import MakeBench
from .played import CLOSED, PLAN, batches, measured, write_plan
from .seen import overflowing

ASKED = PLAN.replace("{type: serial, address: played}", "{type: lines, address: COM3, unit: mm}") + "answer: {file: dnc/O9100.nc}\n"


def test_a_page_says_whether_the_machine_was_told(make_bench: MakeBench, tmp_path: Path) -> None:
    bench = make_bench(PastRuns(tmp_path / "records", lambda _: None, monotonic, lambda: datetime.now().astimezone()))
    write_plan(tmp_path, text=ASKED)
    (tmp_path / "dnc").mkdir()
    page = bench.started()
    points, answer = batches(measured(bench.profile, 2000, seed=1), 500), page.locator("#answer")
    bench.device.source.put(ScanOpened("G800", "", None, 4711), *points[:2])
    expect(answer).to_have_text("The machine waits for the verdict")
    bench.device.source.put(*points[2:], CLOSED)
    expect(answer).to_have_text(re.compile(r"^✓ Sent to the machine at \d\d:\d\d:\d\d: CONFORM, request 4711$"))
    assert b"#150=1." in (tmp_path / "dnc" / "O9100.nc").read_bytes()
    assert bench.station.wait(20.0)
    (tmp_path / "dnc").rename(tmp_path / "away")
    bench.device.renew()
    bench.device.source.put(ScanOpened("G800", "", None, 4712), *points, CLOSED)
    page.locator("#next").click()
    page.locator("#serial").fill("B-0042")
    page.locator("#start").click()
    expect(answer).to_have_attribute("data-state", "not sent")
    expect(answer).to_have_text(re.compile(r"^✕ NOT SENT to the machine: .*O9100.nc: there is no folder .*dnc; connect the share"))
    expect(page.locator("#verdict-word")).to_have_text("CONFORM")
    expect(page.locator("#alarms")).to_contain_text("Not sent to the machine")
    page.set_viewport_size({"width": 800, "height": 600})
    assert not overflowing(page)
    assert bench.station.wait(20.0)
