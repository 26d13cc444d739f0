"""Pictures of every view of the page, to be looked at one by one: `make screenshots`.

Or `python -m tests.cmmlink.console.screenshots FOLDER [WORD]` for those whose name holds a word, like `de-light` or `wall`.
Every view in every language and theme, on the screens of a control desk, an office, an old panel and a telephone.
"""

import re
import shutil
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from datetime import datetime
from pathlib import Path

import numpy as np
from playwright.sync_api import Browser, Page, sync_playwright

from cmmlink.commands.console import inspect_surface
from cmmlink.console.past_runs import PastRuns
from cmmlink.console.server import ConsoleServer
from cmmlink.console.station import Station
from cmmlink.console.trend_look import TrendLook
from cmmlink.from_plan import profile_of
from cmmlink.plan.scan import load_plan
from cmmlink.plant import ResultsDatabase
from drivers.source import Damaged
from inspection import RigidTransform, synthetic
from tests.cmmlink.plant.trending import drifting_runs
from tests.drivers.surface.meshes import binary_stl, tube, write
from tests.inspection.profiles import AIRFOILS
from tests.integration.simulated import simulated

from . import test_browser_characteristics as characteristics
from . import test_browser_surface as whole
from .conftest import FLAGS, TOKEN
from .played import CLOSED, Device, batches, measured, opened, setup_of, write_plan
from .seen import fill_new_plan, look_at_registers
from .test_browser_records import CT_PLAN

SIZES = ((1920, 1080), (1366, 768), (800, 600), (360, 740))
LANGUAGES = ("en-GB", "de-DE")
THEMES = ("light", "dark")
VIEWS = ("part", "live", "history", "ct", "trends", "new-plan", "registers", "surface", "wall")

# What the pusher tells while the server of the plant is away.
WAITING = {
    "address": "postgresql://cmm@db.example/plant", "added": 0, "waiting": 2, "since": "2026-03-14T12:00:00+00:00", "late": False,
    "problem": "postgresql://cmm@db.example/plant: connection refused", "away": True, "pushed": None, "unreadable": [], "others": [],
}  # fmt: skip


@contextmanager
def measured_station(folder: Path) -> Iterator[tuple[Station, ConsoleServer, Device]]:
    """A station at which eight parts were measured, one as a whole surface, the last with twelve characteristics, and a CT import."""
    files = {"blade.yaml": write_plan(folder), "vane.yaml": write_plan(folder, "vane.yaml", characteristics.PLAN)}
    files["block.yaml"] = write(folder / "block.yaml", whole.PLAN)
    write(folder / "block.stl", binary_stl(whole.BLOCK))
    shutil.copy(AIRFOILS / "goe404.dat", folder)
    surface = folder / "ct.yaml"
    surface.write_text(CT_PLAN, encoding="utf-8")
    profile = profile_of(load_plan(files["blade.yaml"]))
    station_mm = np.linspace(0, profile.length_mm, 800, endpoint=False)
    ring = synthetic.scan(profile, station_mm, np.zeros(800), RigidTransform.identity()).points_mm
    write(folder / "blade.stl", binary_stl(tube(ring, np.array((0, 20)))))
    device = Device()
    records = PastRuns(folder / "records", lambda _: None, time.monotonic, lambda: datetime.now().astimezone())
    setup = replace(
        setup_of(files, device.connect, records),
        folder=folder,
        trends=TrendLook(lambda: ResultsDatabase(folder / "plant.sqlite"), folder),
        ct_plans=lambda: {"ct.yaml": surface},
        inspect_surface=lambda file, stop, on_start, on_section: inspect_surface(folder / "records", file, stop, on_start, on_section),
    )
    with ResultsDatabase(folder / "plant.sqlite") as results:
        results.add_runs(drifting_runs(60))
    station = Station(setup)
    server = ConsoleServer(station, "screenshots", token=TOKEN)
    server.start()
    station.pushed.hear(WAITING)
    station.list_plans()
    station.choose("block.yaml")
    device.source.put(opened(30_000), *batches(whole.scanned(40_000, 0.2), 2000), CLOSED)
    station.start()
    assert station.wait(120.0)
    station.choose("blade.yaml")
    for seed, defect_mm in enumerate((0.0, 0.02, 0.12, 0.0, -0.15, 0.01)):
        device.renew()
        points = batches(measured(profile, 2000, seed=seed, defect_mm=defect_mm, at_mm=60.0), 100)
        device.source.put(opened(2000), *points, *([Damaged(17, "checksum")] if defect_mm > 0.1 else []), CLOSED)
        station.start()
        assert station.wait(120.0)  # the first one compiles the inspection where that was not done yet
    station.import_ct("ct.yaml")
    assert station.wait(30.0)
    station.choose("vane.yaml")
    device.renew()
    device.source.put(opened(4000), *batches(characteristics.vane(4000, 0.08, 30.0), 200), CLOSED)
    station.start()
    assert station.wait(60.0)
    yield station, server, device
    server.stop()


def pages(browser: Browser, server: ConsoleServer, languages: Sequence[str], themes: Sequence[str]) -> Iterator[tuple[str, Page]]:
    """A page in each language and theme, and its name."""
    for locale in languages:
        for theme in themes:
            context = browser.new_context(locale=locale, color_scheme="dark" if theme == "dark" else "light")
            page = context.new_page()
            page.goto(server.new_address())
            page.locator("#plans div").first.wait_for(state="attached")
            yield f"{locale[:2]}-{theme}", page
            context.close()


def show(page: Page, station: Station, view: str, modbus: str) -> None:
    """Bring a view of the page in front; the registers are those of the device at this address."""
    if station.running:  # the registers of the page before are read still
        station.abort()
        assert station.wait(10.0)
    page.keyboard.press("Escape")  # closes a dialog
    if view == "wall":
        page.keyboard.press("1")
        page.goto(re.sub(r"[?#].*$", "", page.url) + "?wall")
    elif view == "new-plan":
        page.keyboard.press("2")
        page.locator("#open-new-plan").click()
        fill_new_plan(page)
    elif view == "surface":
        page.keyboard.press("3")
        page.locator("#runs tbody tr", has_text="block 4").click()
        page.keyboard.press("o")
        page.locator("#surface-regions tbody tr").first.wait_for()
    elif view == "registers":
        page.keyboard.press("2")
        page.locator("#new-device").click()
        look_at_registers(page, modbus)
    else:
        if view == "trends":
            page.keyboard.press("5")
            page.locator("#trend-notes li").first.wait_for()
        page.keyboard.press(str(("live", "part", "history", "ct", "trends").index(view) + 1))


def main(folder: Path, only: str = "") -> None:
    """Take every picture whose name holds a word."""
    folder.mkdir(parents=True, exist_ok=True)
    with (
        tempfile.TemporaryDirectory() as place,
        measured_station(Path(place)) as (station, server, _),
        simulated("modbus-ring", "127.0.0.1:0", Path(place), count=10_000_000) as modbus,
        sync_playwright() as playwright,
    ):
        browser = playwright.chromium.launch(executable_path=shutil.which("chromium"), args=FLAGS)
        for who, page in pages(browser, server, LANGUAGES, THEMES):
            for view in VIEWS:
                wanted = [(width, height) for width, height in SIZES if only in f"{view}-{who}-{width}x{height}"]
                if not wanted:
                    continue
                show(page, station, view, modbus.address)
                for width, height in wanted:
                    page.set_viewport_size({"width": width, "height": height})
                    page.wait_for_timeout(300)  # until the drawings have taken their new size
                    page.screenshot(path=folder / f"{view}-{who}-{width}x{height}.png")
        browser.close()
    print(f"{len(list(folder.glob('*.png')))} pictures in {folder}")


if __name__ == "__main__":
    main(Path(sys.argv[1]), *sys.argv[2:])
