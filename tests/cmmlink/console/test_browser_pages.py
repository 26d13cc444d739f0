"""Pages of a station in a real browser: who may see it, who controls it, the keyboard, and what comes back after a stall."""

import threading

import pytest
from playwright.sync_api import expect

from cmmlink.console.listening import Access
from cmmlink.console.server import ConsoleServer

from .conftest import TOKEN, Bench, MakeBench
from .played import CLOSED, batches, measured, opened
from .seen import drawn, finished, focus


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
    page.locator("#display summary").click()
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
    expect(page.locator("#question")).to_be_visible()
    page.keyboard.press("Shift")  # a key on the way to another one is no answer
    page.keyboard.press("x")
    expect(page.locator("#question")).to_be_hidden()
    assert bench.station.running, "any other key lets it go on"
    page.keyboard.press("Escape")
    page.keyboard.press("Escape")
    expect(page.locator("#verdict-why")).to_have_text("no point was received")


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
    expect(watcher.locator("#abort")).to_be_enabled()
    watcher.keyboard.press("Escape")
    expect(watcher.locator("#question")).to_be_visible()
    bench.device.source.put(*batches(measured(bench.profile, 2000, seed=1), 50)[20:24])
    for one in (page, watcher):
        expect(one.locator("#received")).to_have_text("1,200")  # it is measured on while the question stands
    watcher.keyboard.press("Enter")
    for one in (page, watcher):
        expect(one.locator("#verdict-why")).to_contain_text("the scan was aborted")
    expect(watcher.locator("#question")).to_be_hidden()


def test_page_that_takes_the_control_by_its_abort_is_asked_too(bench: Bench) -> None:
    page, watcher = bench.started(), bench.page()
    page.close()
    expect(watcher.locator("#banners")).to_contain_text("Watching: no page is in control")
    watcher.keyboard.press("Escape")
    expect(watcher.locator("#question")).to_be_visible()
    assert bench.station.running
    watcher.keyboard.press("Escape")
    expect(watcher.locator("#verdict-why")).to_have_text("no point was received")


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
    bench.complaints = [said for said in bench.complaints if "ERR_CONNECTION_RE" not in said]  # refused, or reset while it stopped


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


def test_station_open_to_the_network_says_so(make_bench: MakeBench) -> None:
    bench = make_bench(access=Access("0.0.0.0", unencrypted=True))
    page = bench.page()
    expect(page.locator("#banners")).to_contain_text("open to the network")
