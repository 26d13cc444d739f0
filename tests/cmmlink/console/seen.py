"""What is read off a page, and how one gets about on it."""

import re

from playwright.sync_api import Page, expect

from inspection import InspectionResult

from .conftest import AXE, Bench
from .played import SECTION

RULES = ["wcag2a", "wcag2aa", "wcag21a", "wcag21aa", "wcag22aa"]


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
    assert isinstance(job.finished.outcome.result, InspectionResult)
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


def hindrances(page: Page, view: str) -> dict[str, object]:
    """What axe-core finds on the page as it stands, in either theme, by the rules of WCAG 2.2 at level AA; axe-core must be installed."""
    if not page.evaluate("'axe' in window"):
        page.evaluate(AXE.read_text(encoding="utf-8"))
    found: dict[str, object] = {}
    for theme in ("light", "dark"):
        page.emulate_media(color_scheme="dark" if theme == "dark" else "light")
        result = page.evaluate("rules => axe.run(document, { runOnly: rules, resultTypes: ['violations'] })", RULES)
        found |= {
            f"{theme} {view} {one['id']}": [(node["html"][:150], [check["message"] for check in node["any"]]) for node in one["nodes"][:4]]
            for one in result["violations"]
        }
    return found


def overflowing(page: Page) -> list[str]:
    """Elements of the result whose text does not fit into their box; the list of reasons and notes scrolls."""
    found: list[str] = page.evaluate(
        """() => [...document.querySelectorAll('aside .card, aside .verdict, aside .answer, aside dd, .word, .why, .big, .where')]
           .filter(e => e.offsetParent && e.id !== 'remarks' && (e.scrollWidth > e.clientWidth + 1
               || (!e.matches('.word, .big') && e.scrollHeight > e.clientHeight + 3)))  // their lines are set closer than their letters
           .map(e => e.className + ' ' + e.id)"""
    )
    return found


def fill_new_plan(page: Page) -> None:
    """Hand a nominal and two wrong answers in to the dialog of a new plan, which stands open."""
    page.locator("#nominal-file").set_input_files(
        {"name": "section.yaml", "mimeType": "application/octet-stream", "buffer": SECTION.encode()}
    )
    expect(page.locator("#nominal-picture .arrow")).to_have_count(3)
    page.locator("#nominal-read summary").click()
    page.locator("#plan-tolerance").fill("tight")
    page.locator("#plan-results").fill("../../elsewhere")
    page.locator("#save-plan").click()
    expect(page.locator("#mistake-tolerance")).not_to_be_empty()


def look_at_registers(page: Page, address: str) -> None:
    """Read twelve registers of a device and choose two of their numbers as x and y."""
    for name, words in (("address", address), ("first", "100"), ("count", "12")):
        page.locator(f"#look-{name}").fill(words)
    page.locator("#look-button").click()
    expect(page.locator("#register-table .changed").first).to_be_visible()
    for register in (103, 105):
        page.locator(f"#register-table tbody tr:nth-child({register - 99}) td:nth-child(8)").click()
