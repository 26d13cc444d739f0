"""A new Modbus device on the page: its registers while they change, x and y by a click, the map saved and used."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from playwright.sync_api import Page, expect

from cmmlink.console.server import ConsoleServer
from cmmlink.console.station import Station
from cmmlink.plan.own_maps import map_of
from tests.integration.simulated import simulated

from .conftest import Bench, MakeBench
from .played import setup_of, write_plan
from .seen import overflowing

Keep = Callable[[Page, str], None]


def cell(register: int, kind: str) -> str:
    """The number of a type, high word first where it is longer than one, that begins at a register shown from 100 on."""
    places = {"uint16": 4, "int32": 8}  # behind register, hexadecimal and chosen: uint16, int16, uint32 twice, int32 twice
    return f"#register-table tbody tr:nth-child({register - 99}) td:nth-child({places[kind]})"


def test_a_map_is_made_by_clicks_and_not_written_over_unasked(make_bench: MakeBench, tmp_path: Path, keep: Keep) -> None:
    bench = with_folder(make_bench(), tmp_path)
    page = bench.page()
    with simulated("modbus-ring", "127.0.0.1:0", tmp_path, count=100_000) as device:
        page.locator("#new-device").click()
        page.locator("#look-address").fill(device.address)
        page.locator("#look-first").fill("100")
        page.locator("#look-count").fill("12")
        page.locator("#look-button").click()
        expect(page.locator("#look-words")).to_have_text("Stop")
        expect(page.locator("#register-table thead th:nth-child(8)")).to_have_text("int32 high first")
        expect(page.locator("#register-table .changed").first).to_be_visible()
        page.locator(cell(103, "int32")).click()
        page.locator(cell(105, "int32")).click()
        expect(page.locator("#place-y")).to_have_text("105 int32 high first")
        page.locator("#field-sequence").click()
        page.locator("#register-table tbody tr:nth-child(4) td:nth-child(7)").click()  # uint32 low first
        expect(page.locator("#map-message")).to_have_text("✕ A device has one word order, and x was chosen with the other one.")
        page.locator(cell(100, "uint16")).click()
        page.locator("#map-scale").fill("1e-5")
        page.locator("#map-name").fill("table")
        keep(page, "registers")
        assert overflowing(page) == []
        page.locator("#keep-map").click()
        saved = f"✓ maps/table.yaml is saved. In a new plan the points come from: modbus {device.address} maps/table.yaml"
        expect(page.locator("#map-message")).to_have_text(saved)
        expect(page.locator("#look-words")).to_have_text("Read")
    made = map_of(tmp_path / "maps" / "table.yaml").points
    assert {name: (made.at + field.at, field.type, field.scale) for name, field in made.fields.items()} == {
        "sequence": (100, "uint16", 1.0),
        "x": (103, "int32", 1e-5),
        "y": (105, "int32", 1e-5),
    }
    page.locator("#field-y").click()  # the next number is that of y
    page.locator("#register-table").press("ArrowDown")
    page.locator("#keep-map").click()
    expect(page.locator("#map-message")).to_contain_text("is there already")
    page.locator("#replace-map").click()
    expect(page.locator("#map-message")).to_have_text(saved)
    page.locator("#look-button").click()
    expect(page.locator("#look-message")).to_contain_text("no Modbus device opens there")


def with_folder(bench: Bench, folder: Path) -> Bench:
    """The same bench with a station that has a folder of plans."""
    bench.server.stop()
    station = Station(replace(setup_of({"blade.yaml": write_plan(folder)}, bench.device.connect), folder=folder))
    bench.station, bench.server = station, ConsoleServer(station, "test")
    bench.server.start()
    return bench
