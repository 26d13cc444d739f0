"""What an operator sees of a whole surface, in a real browser: the part that turns, its worst points, its regions, its record."""

from collections.abc import Callable
from datetime import datetime
from pathlib import Path
from time import monotonic

import numpy as np
import pytest
from numpy.typing import NDArray
from playwright.sync_api import Page, expect

from cmmlink.colour_map import COLOURS, Kind, rgb_of
from cmmlink.console.past_runs import PastRuns
from inspection.surface import TriangleSurface
from tests.drivers.surface.meshes import binary_stl, box, write

from .conftest import Bench, MakeBench
from .played import CLOSED, batches, opened
from .seen import focus, hindrances

Array = NDArray[np.float64]
Keep = Callable[[Page, str], None]

PLAN = """part: {name: block 4, serial_number: S-0007}
operator: Ada
surface: {file: block.stl}
tolerance: {lower_mm: -0.05, upper_mm: 0.05, uncertainty_mm: 0.005}
device: {type: serial, address: played}
registration: {fit: none}
gap_max_mm: 3
out: null
"""
BLOCK = box((0.0, 0.0, 0.0), (30.0, 18.0, 12.0))
DEFECT_MM = (22.0, 7.0, 12.0)  # on the upper face

# Pixels of a colour of the canvas, at whatever light: [how many, mean column, mean row].
COLOURED = """(wanted) => {
    const canvas = document.querySelector('#surface canvas'), copy = document.createElement('canvas');
    [copy.width, copy.height] = [canvas.width, canvas.height];
    const pen = copy.getContext('2d');
    pen.drawImage(canvas, 0, 0);
    const pixels = pen.getImageData(0, 0, copy.width, copy.height).data;
    let count = 0, x = 0, y = 0;
    for (let k = 0; k < pixels.length; k += 4) {
        if (pixels[k + 3] < 200) continue;
        const light = Math.max(pixels[k], pixels[k + 1], pixels[k + 2]) / Math.max(...wanted);
        if (wanted.some((value, c) => Math.abs(pixels[k + c] - light * value) > 6)) continue;
        count++; x += (k / 4) % copy.width; y += Math.floor(k / 4 / copy.width);
    }
    return [count, x / count / copy.width, y / count / copy.height];
}"""


def scanned(count: int, defect_mm: float) -> Array:
    """Points (n, 3) of the block with a defect of 3 mm across, those on its lower face left out."""
    places, normals = TriangleSurface(BLOCK).sample(count)
    far = np.hypot(*(places - DEFECT_MM).T[:2]) + 1e3 * (places[:, 2] < 11.9)
    points = places + normals * np.where(far < 1.5, defect_mm * (1 - far / 4), 0.01 * np.sin(places[:, :1].T[0]))[:, None]
    order = np.argsort(places[:, 0], kind="stable")
    return np.asarray(points[order][places[order, 2] > 0.01])


@pytest.fixture
def station(make_bench: MakeBench, tmp_path: Path) -> Bench:
    """A station with the plan of a surface, and with records."""
    folder = tmp_path / "plans"
    folder.mkdir()
    (folder / "block.yaml").write_text(PLAN, encoding="utf-8")
    write(folder / "block.stl", binary_stl(BLOCK))
    records = PastRuns(tmp_path / "records", lambda _: None, monotonic, lambda: datetime.now().astimezone())
    return make_bench(records, folder=folder)


def started(bench: Bench, page: Page) -> Page:
    page.locator("#plans div", has_text="block.yaml").click()
    expect(page.locator("#check-word")).to_contain_text("can be run")
    expect(page.locator("#serial")).to_be_focused()
    page.keyboard.press("Enter")
    expect(page.locator("#said")).to_contain_text("started")
    return page


def coloured(page: Page, kind: Kind) -> list[float]:
    page.evaluate("() => new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))")
    found: list[float] = page.evaluate(COLOURED, list(rgb_of(COLOURS[kind])))
    return found


def test_a_defect_shows_while_it_is_scanned_and_stands_in_the_table_at_the_end(station: Bench, keep: Keep, axe: None) -> None:
    page = started(station, station.page())
    points = batches(scanned(20_000, 0.3), 500)
    station.device.source.put(opened(20_000), *points[:5])
    expect(page.locator("#received")).to_have_text("2,500")
    expect(page.locator("#surface-card")).to_be_visible()
    expect(page.locator("#profile-card")).to_be_hidden()
    expect(page.locator("#surface-regions-words")).to_contain_text("told at the end")
    assert coloured(page, Kind.NOT_JUDGED)[0] > 1000, "what was not scanned yet is grey"
    assert coloured(page, Kind.ABOVE)[0] == 0
    station.device.source.put(*points[5:], CLOSED)
    expect(page.locator("#verdict[data-final=true] .word")).to_have_text("NOT CONFORM")
    assert coloured(page, Kind.ABOVE)[0] > 20
    rows = page.locator("#surface-regions tbody tr")
    expect(rows).to_have_count(1)
    expect(rows.first).to_contain_text("+0.2")
    expect(page.locator("#surface-regions-words")).to_contain_text("1 region out of tolerance; 1 place of")
    expect(page.locator("#worst-value")).to_contain_text("+0.2")
    expect(page.locator("#worst-where")).to_contain_text("z 12.")
    expect(page.locator("#surface-legend")).to_contain_text("▲ above +0.055 mm")
    expect(page.locator("#surface-legend")).to_contain_text("within −0.045 .. +0.045 mm")
    keep(page, "surface")
    assert hindrances(page, "surface") == {}


def test_the_part_turns_by_keys_and_mouse_and_a_region_is_gone_to(station: Bench) -> None:
    page = started(station, station.page())
    station.device.source.put(opened(20_000), *batches(scanned(20_000, -0.2), 2000), CLOSED)
    expect(page.locator("#verdict[data-final=true] .word")).to_have_text("NOT CONFORM")
    before = coloured(page, Kind.BELOW)
    focus(page, "surface")
    for key in ("ArrowLeft", "ArrowUp", "Shift+ArrowRight", "+"):
        page.keyboard.press(key)
        after = coloured(page, Kind.BELOW)
        assert after != before, key
        before = after
    box_of = page.locator("#surface").bounding_box()
    assert box_of is not None
    x, y = box_of["x"] + box_of["width"] / 2, box_of["y"] + box_of["height"] / 2
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x + 60, y + 20)
    page.mouse.up()
    assert coloured(page, Kind.BELOW) != before
    page.keyboard.press("0")
    whole = coloured(page, Kind.BELOW)[0]
    focus(page, "surface-regions")
    page.keyboard.press("Enter")
    share = coloured(page, Kind.BELOW)
    assert share[0] > 10 * whole, "it is seen from near"
    assert share[1:] == pytest.approx([0.5, 0.5], abs=0.08)
    expect(page.locator("#surface-words")).to_contain_text("\u25bc −0.1")
    page.mouse.move(x, y)
    expect(page.locator("#surface-words")).to_contain_text("\u25bc −0.1")


def test_a_browser_without_webgl_shows_a_still_picture(station: Bench) -> None:
    page = station.page(address="about:blank")
    page.add_init_script(
        "const get = HTMLCanvasElement.prototype.getContext;"
        "HTMLCanvasElement.prototype.getContext = function (kind, ...more) {"
        "    return kind === 'webgl' ? null : get.call(this, kind, ...more); };"
    )
    page.goto(station.server.new_address())
    started(station, page)
    station.device.source.put(opened(20_000), *batches(scanned(20_000, 0.3), 2000), CLOSED)
    expect(page.locator("#verdict[data-final=true] .word")).to_have_text("NOT CONFORM")
    expect(page.locator("#surface-still")).to_be_visible()
    assert coloured(page, Kind.ABOVE)[0] > 20
    assert coloured(page, Kind.NOT_JUDGED)[0] < 2000, "the lower face, which was not scanned, is not seen from here"


def test_a_recorded_surface_is_opened_and_measured_again(station: Bench) -> None:
    page = started(station, station.page())
    station.device.source.put(opened(20_000), *batches(scanned(20_000, 0.3), 2000), CLOSED)
    expect(page.locator("#verdict[data-final=true] .word")).to_have_text("NOT CONFORM")
    page.keyboard.press("3")
    expect(page.locator("#worst-where")).to_contain_text("z 12.")
    expect(page.locator("#runs tbody tr")).to_contain_text(["complete"])
    page.keyboard.press("o")
    expect(page.locator("#banners")).to_contain_text("Recorded run")
    expect(page.locator("#surface-regions tbody tr")).to_have_count(1)
    assert coloured(page, Kind.ABOVE)[0] > 20
    page.keyboard.press("3")
    expect(page.locator("#start")).to_be_enabled()
    page.keyboard.press("r")
    expect(page.locator("#banners")).to_contain_text("identical to the recorded result")
    assert coloured(page, Kind.ABOVE)[0] > 20
