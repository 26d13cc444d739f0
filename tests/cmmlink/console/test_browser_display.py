"""How the page is shown: its colours, small screens and enlarged text, fingers, a wall, and what assistive software finds."""

import re
from datetime import datetime
from pathlib import Path
from time import monotonic
from typing import Any

import pytest
from playwright.sync_api import Page, expect

from cmmlink.console.past_runs import PastRuns
from tests.integration.simulated import simulated

from .conftest import Bench, MakeBench
from .played import CLOSED, batches, measured, opened
from .seen import drawn, fill_new_plan, hindrances, look_at_registers

VIEWS = ("part", "live", "history", "ct")

# Buttons, links and entries that stand on the page and that nobody can get at, also not by scrolling.
OUT_OF_REACH = """within => {
    const found = [];
    for (const one of document.querySelectorAll(`${within}:is(button, a, input, select, summary, [tabindex="0"])`)) {
        if (!one.checkVisibility()) continue;
        one.scrollIntoView({ block: 'center', inline: 'nearest' });
        const box = one.getBoundingClientRect(), x = box.left + box.width / 2, y = box.top + Math.min(box.height / 2, 8);
        const top = document.elementFromPoint(x, y);
        const isWhole = box.left >= -1 && box.right <= innerWidth + 1;
        if (!isWhole || !(top && (one.contains(top) || top.contains(one) || one.closest('label')?.contains(top))))
            found.push(`${one.id || one.outerHTML.slice(0, 60)} ${Math.round(box.left)} ${Math.round(box.right)} ${top?.id ?? ''}`);
    }
    return found;
}"""


def measured_page(bench: Bench, **context: Any) -> Page:
    """A page at whose station a part was measured that is out of tolerance; the plan is chosen again."""
    bench.station.choose("blade.yaml")
    points = batches(measured(bench.profile, 2000, seed=2, defect_mm=0.12, at_mm=60.0), 200)
    bench.device.source.put(opened(2000), *points, CLOSED)
    bench.station.start()
    assert bench.station.wait(20.0)
    bench.station.alarms.raise_alarm("fault", "Link lost", "unplugged")
    page = bench.browser.new_context(**context).new_page()
    page.on("pageerror", lambda error: bench.complaints.append(str(error)))
    page.goto(bench.server.new_address())
    expect(page.locator("#check-word")).to_contain_text("blade.yaml")
    return page


@pytest.mark.usefixtures("axe")
def test_no_view_hinders_anybody_in_either_theme(make_bench: MakeBench, tmp_path: Path) -> None:
    """What axe-core finds by the rules of WCAG 2.2 at level AA: nothing."""
    records = PastRuns(tmp_path / "records", lambda _: None, monotonic, lambda: datetime.now().astimezone())
    bench = make_bench(records, surfaces={"ct.yaml": tmp_path / "ct.yaml"}, inspect=lambda *_: ("", ()))
    page = measured_page(bench, locale="de-DE", viewport={"width": 1280, "height": 800})
    page.keyboard.press("l")
    for view in (*VIEWS, "display", "wall"):
        page.evaluate(
            "view => view === 'display' ? document.querySelector('#display').open = true : document.body.dataset.view = view", view
        )
        assert hindrances(page, view) == {}


@pytest.mark.usefixtures("axe")
def test_neither_a_new_plan_nor_a_new_device_hinders_anybody(make_bench: MakeBench, tmp_path: Path) -> None:
    """With mistakes and a nominal in the one and registers that change in the other, in the longer language."""
    bench = make_bench(folder=tmp_path)
    page = bench.browser.new_context(locale="de-DE", viewport={"width": 800, "height": 600}).new_page()
    page.goto(bench.server.new_address())
    page.locator("#open-new-plan").click()
    assert hindrances(page, "new plan") == {}
    fill_new_plan(page)
    assert hindrances(page, "new plan with mistakes") == {}
    assert page.evaluate(OUT_OF_REACH, "#new-plan ") == []
    page.keyboard.press("Escape")
    expect(page.locator("#open-new-plan")).to_be_focused()
    with simulated("modbus-ring", "127.0.0.1:0", tmp_path, count=100_000) as device:
        page.locator("#new-device").click()
        assert hindrances(page, "new device") == {}
        look_at_registers(page, device.address)
        assert hindrances(page, "registers") == {}
        assert page.evaluate(OUT_OF_REACH, "") == []
        assert page.evaluate("document.documentElement.scrollWidth") <= 800


@pytest.mark.parametrize(("width", "height"), [(800, 600), (360, 740), (911, 512), (533, 400)], ids=["panel", "phone", "150", "panel 150"])
def test_no_control_is_out_of_reach(make_bench: MakeBench, tmp_path: Path, width: int, height: int) -> None:
    """The last two sizes are 1366x768 and 800x600 at 150 %: as many pixels of the page are left then."""
    bench = make_bench(surfaces={"ct.yaml": tmp_path / "ct.yaml"}, inspect=lambda *_: ("", ()))
    page = measured_page(bench, locale="de-DE", viewport={"width": width, "height": height})
    for view in VIEWS:
        page.evaluate("view => document.querySelector(`[data-go=${view}]`).click()", view)
        assert page.evaluate(OUT_OF_REACH, "") == [], view
        assert page.evaluate("document.documentElement.scrollWidth") <= width, view


def test_fingers_zoom_the_drawings_and_find_every_button(bench: Bench) -> None:
    page = measured_page(bench, viewport={"width": 800, "height": 600}, has_touch=True, is_mobile=True)
    small = """() => [...document.querySelectorAll('button, summary, select, a, input')].filter(one => one.checkVisibility())
        .map(one => [one.id || one.textContent, one.getBoundingClientRect()]).filter(([, box]) => box.width < 44 || box.height < 44)
        .map(([name, box]) => `${name} ${box.width} x ${box.height}`)"""
    assert page.evaluate(small) == []
    page.locator("[data-go=live]").tap()
    assert page.evaluate(small) == []
    page.locator("#strip").scroll_into_view_if_needed()
    whole = drawn(page, "strip")
    page.locator("[data-of=strip] button").first.tap()
    assert drawn(page, "strip") != whole
    page.locator("[data-of=strip] button").last.tap()
    assert drawn(page, "strip") == whole
    box = page.locator("#strip").bounding_box()
    assert box is not None
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    touches = page.context.new_cdp_session(page)
    for kind, apart in (("touchStart", 20), ("touchMove", 60), ("touchMove", 90)):
        points = [{"x": x - apart, "y": y, "id": 0}, {"x": x + apart, "y": y, "id": 1}]
        touches.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})
    touches.send("Input.dispatchTouchEvent", {"type": "touchEnd", "touchPoints": []})
    assert drawn(page, "strip") != whole, "two fingers that part zoom in"


def test_the_wall_is_read_from_six_metres(bench: Bench) -> None:
    """ISO 9241-303: capitals of 20 minutes of arc are 35 mm at 6 m, 11.7 % of the height of a 24 inch screen of 16 to 9."""
    page = measured_page(bench, locale="de-DE", viewport={"width": 1920, "height": 1080})
    page.locator("#display summary").click()
    with page.context.expect_page() as opened_page:
        page.locator("#wall").click()
    wall = opened_page.value
    expect(wall.locator("#verdict-word")).to_have_text("NICHT KONFORM")
    expect(wall.locator("#serial-number")).to_have_text("B-0041")
    expect(wall.locator("header")).to_be_hidden()
    for name in ("verdict-word", "serial-number", "worst-value"):
        capital, box, screen = wall.evaluate(
            """name => { const one = document.getElementById(name), style = getComputedStyle(one);
               const pen = document.createElement('canvas').getContext('2d');
               pen.font = `${style.fontWeight} ${style.fontSize} ${style.fontFamily}`;
               return [pen.measureText('H').actualBoundingBoxAscent, one.getBoundingClientRect().toJSON(), [innerWidth, innerHeight]]; }""",
            name,
        )
        assert capital / screen[1] >= 0.117, name
        assert box["left"] >= 0, name
        assert box["right"] <= screen[0], name
        assert 0 <= box["top"] < box["bottom"] <= screen[1], name


def test_the_reader_chooses_light_or_dark_and_a_language(bench: Bench) -> None:
    page = measured_page(bench, color_scheme="dark", viewport={"width": 1280, "height": 800})
    ground = "getComputedStyle(document.body).backgroundColor"
    assert page.evaluate(ground) == "rgb(16, 22, 28)"
    page.keyboard.press("1")
    dark = drawn(page, "strip")
    page.locator("#display summary").click()
    page.locator("#theme").select_option("light")
    assert page.evaluate(ground) == "rgb(236, 239, 242)"
    assert drawn(page, "strip") != dark, "the drawings have other colours, too"
    page.locator("#language").select_option("de")
    expect(page.locator("#check-word")).to_have_text(re.compile("kann gemessen werden"))
    assert page.evaluate(ground) == "rgb(236, 239, 242)"
