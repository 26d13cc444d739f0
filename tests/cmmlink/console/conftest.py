"""A browser, a station with a played device, and a page of it."""

import shutil
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Page, expect, sync_playwright

from cmmlink.console.ct_import import InspectSurface
from cmmlink.console.listening import Access
from cmmlink.console.server import ConsoleServer
from cmmlink.console.station import Station
from cmmlink.console.station_setup import Records
from cmmlink.demo import plan_file
from cmmlink.from_plan import profile_of
from cmmlink.plan.scan import load_plan
from inspection import NominalProfile, rehearse

from .played import Device, setup_of, write_plan

TOKEN = "token-of-this-test"
AXE = Path(__file__).parents[2] / "page" / "node_modules" / "axe-core" / "axe.min.js"
FLAGS = [
    "--headless",
    "--no-sandbox",
    "--disable-gpu",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--no-first-run",
]
_DRIVER = "GL Driver Message"  # of a browser that draws WebGL without a graphics card: it says that it is slow
expect.set_options(timeout=20_000)


@pytest.fixture(scope="module")
def browser(request: pytest.FixtureRequest) -> Iterator[Browser]:
    """Debian's Chromium, with a profile of its own; while it is open, no test of the process can run an event loop of its own."""
    chromium = shutil.which("chromium")
    if chromium is None:
        reason = "no chromium on this machine (Debian: apt install chromium)"
        if request.config.getoption("--require-browser"):
            pytest.fail(reason)
        pytest.skip(reason)
    with sync_playwright() as playwright:
        launched = playwright.chromium.launch(executable_path=chromium, args=FLAGS)
        yield launched
        launched.close()


@pytest.fixture(scope="session", autouse=True)
def compiled(tmp_path_factory: pytest.TempPathFactory) -> None:
    """Compile the inspection before any page waits for it: it takes long once after installation."""
    rehearse(profile_of(load_plan(write_plan(tmp_path_factory.mktemp("compiled")))))


@dataclass
class Bench:
    """A station under test: its device, its server, and pages of it."""

    station: Station
    server: ConsoleServer
    device: Device
    profile: NominalProfile
    browser: Browser
    complaints: list[str] = field(default_factory=list)

    def page(self, width: int = 1280, height: int = 800, address: str | None = None) -> Page:
        """A new page in a browser context of its own."""
        page = self.browser.new_context(viewport={"width": width, "height": height}).new_page()
        page.on(
            "console",
            lambda said: self.complaints.append(said.text) if said.type in ("error", "warning") and _DRIVER not in said.text else None,
        )
        page.on("pageerror", lambda error: self.complaints.append(str(error)))
        page.goto(address or self.server.new_address())
        return page

    def started(self, plan: str = "blade.yaml") -> Page:
        """A page on which a run of the plan was started."""
        page = self.page()
        page.locator("#plans div", has_text=plan).click()
        expect(page.locator("#check-word")).to_contain_text("can be run")
        expect(page.locator("#serial")).to_be_focused()
        page.keyboard.press("Enter")
        expect(page.locator("#said")).to_contain_text("started")
        return page


MakeBench = Callable[..., Bench]


@pytest.fixture
def make_bench(browser: Browser, tmp_path: Path) -> Iterator[MakeBench]:
    """Makes stations; at the end no page may have complained (errors of script, policy or loading)."""
    made: list[Bench] = []

    def make(
        records: Records | None = None,
        plans: Sequence[str] = ("blade.yaml",),
        access: Access | None = None,
        surfaces: Mapping[str, Path] | None = None,
        inspect: InspectSurface | None = None,
        folder: Path | None = None,
    ) -> Bench:
        files = {name: write_plan(tmp_path, name) for name in plans}
        device = Device()
        known = surfaces or {}
        setup = replace(setup_of(files, device.connect, records), ct_plans=lambda: known, inspect_surface=inspect)
        if folder is not None:
            setup = replace(setup, plans=lambda: {path.name: path for path in folder.glob("*.yaml")}, folder=folder, demo=plan_file())
        station = Station(setup)
        server = ConsoleServer(station, "test", access, token=TOKEN)
        server.start()
        made.append(Bench(station, server, device, profile_of(load_plan(files[plans[0]])), browser))
        return made[-1]

    yield make
    for bench in made:
        if bench.station.running:
            bench.station.abort()
            bench.station.wait(10.0)
        for context in browser.contexts:
            context.close()
        bench.server.stop()
        assert bench.complaints == []


@pytest.fixture
def bench(make_bench: MakeBench) -> Bench:
    """A station with one plan and no records."""
    return make_bench()


@pytest.fixture
def axe(request: pytest.FixtureRequest) -> None:
    """The test needs axe-core."""
    if not AXE.exists():
        assert not request.config.getoption("--require-browser"), "tests/page/check installs axe-core"
        pytest.skip("axe-core is not installed; tests/page/check installs it")


@pytest.fixture
def keep(request: pytest.FixtureRequest) -> Callable[[Page, str], None]:
    """Keeps pictures of a page, one a size of screen, where the test run was told to."""
    folder = request.config.getoption("--screenshots")

    def keep_picture(page: Page, name: str) -> None:
        if not folder:
            return
        Path(folder).mkdir(parents=True, exist_ok=True)
        before = page.viewport_size
        assert before is not None
        for width, height in ((1280, 800), (1920, 1080), (1024, 768), (800, 600)):
            page.set_viewport_size({"width": width, "height": height})
            page.wait_for_timeout(400)  # until the drawings have taken their new size
            page.screenshot(path=Path(folder) / f"{name}-{width}x{height}.png")
        page.set_viewport_size(before)

    return keep_picture
