"""A part that was measured before, and a run that was judged again, on the page in a real browser."""

from collections.abc import Callable
from datetime import datetime
from pathlib import Path
from time import monotonic

from playwright.sync_api import Page, expect

from cmmlink.console.past_runs import PastRuns
from cmmlink.record import find_run, keep_judgement, open_to_read, open_to_record, recorded_run, replay_run
from tests.cmmlink.recorded import no_decoder, today

from .conftest import MakeBench
from .played import CLOSED, batches, measured, opened
from .seen import overflowing

Keep = Callable[[Page, str], None]


def judge_again(folder: Path) -> None:
    """Keep another judgement of the newest run, as `cmmlink replay --set --reason` does."""
    with open_to_read(folder, today) as store:
        recorded = recorded_run(store, find_run(store, "last"))
        again = replay_run(store, recorded, no_decoder, settings={"tolerance.upper_mm": "0.2"})
    with open_to_record(folder, today) as store:
        keep_judgement(store, recorded, again, who="Eve", why="concession 4711", now=today())


def test_a_part_is_measured_twice_only_when_that_is_confirmed_and_later_judgements_stand_beside_it(
    make_bench: MakeBench, tmp_path: Path, keep: Keep
) -> None:
    records = tmp_path / "records"
    bench = make_bench(records=PastRuns(records, lambda _: None, monotonic, lambda: datetime.now().astimezone()))
    page = bench.started()
    points = batches(measured(bench.profile, 1500, seed=1, defect_mm=0.12, at_mm=60.0), 64)
    bench.device.source.put(opened(1500), *points, CLOSED)
    expect(page.locator("#verdict[data-final=true] .word")).to_have_text("NOT CONFORM")
    expect(page.locator("#start")).to_be_enabled()
    judge_again(records)
    bench.device.renew()
    page.keyboard.press("n")
    page.locator("#serial").fill("B-0041")
    page.keyboard.press("Enter")
    expect(page.locator("#banners")).to_contain_text("Measure this part again? the serial number B-0041 of this part was measured before")
    assert not bench.station.running
    keep(page, "repeated")
    assert overflowing(page) == []
    page.get_by_role("button", name="Measure again").click()
    expect(page.locator("#verdict-why")).to_contain_text("waiting for points")
    expect(page.locator("#banners")).to_be_hidden()
    bench.device.source.put(opened(1500), *points, CLOSED)
    expect(page.locator("#notes")).to_contain_text("the serial number B-0041 of this part was measured before: run")
    page.keyboard.press("3")
    row = page.locator("#runs tbody tr:last-child")
    expect(row).to_contain_text("complete, judged again")
    row.click()
    told = "by Eve: CONFORM; tolerance.upper_mm 0.05 -> 0.2; concession 4711"
    expect(page.locator("#judgements")).to_contain_text(told)
    keep(page, "judged")
    page.keyboard.press("o")
    expect(page.locator("#verdict-word")).to_have_text("NOT CONFORM")  # what was found when it was measured stays
    expect(page.locator("#judgements")).to_contain_text(told)
    page.keyboard.press("Escape")
    expect(page.locator("#judgements")).to_be_hidden()
