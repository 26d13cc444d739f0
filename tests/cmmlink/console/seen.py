"""What is read off a page, and how one gets about on it."""

import re

from playwright.sync_api import Page

from inspection import InspectionResult

from .conftest import Bench


def number(page: Page, name: str) -> int:
    return int((page.locator(f"#{name}").text_content() or "").replace(",", ""))


def millimetres(words: str | None) -> float:
    found = re.search(r"[+−]\d+\.\d+", words or "")
    assert found, words
    return float(found[0].replace("−", "-"))


def finished(bench: Bench) -> InspectionResult:
    """The result of the run that just ended."""
    assert bench.station.wait(20.0)
    job = bench.station.job
    assert job is not None
    assert job.finished is not None
    assert job.finished.outcome.result is not None
    return job.finished.outcome.result


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


def overflowing(page: Page) -> list[str]:
    """Elements of the result whose text does not fit into their box; the list of reasons and notes scrolls."""
    found: list[str] = page.evaluate(
        """() => [...document.querySelectorAll('aside .card, aside .verdict, aside dd, .word, .why, .big, .where')]
           .filter(e => e.offsetParent && e.id !== 'remarks' && (e.scrollWidth > e.clientWidth + 1
               || (!e.matches('.word, .big') && e.scrollHeight > e.clientHeight + 3)))  // their lines are set closer than their letters
           .map(e => e.className + ' ' + e.id)"""
    )
    return found
