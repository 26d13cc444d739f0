"""The page in the reader's language: words, numbers and dates, in a real browser."""

import re

from playwright.sync_api import Page, expect

from .conftest import Bench
from .played import CLOSED, batches, measured, opened

# All words that stand on the screen, but for the text of a plan, the sentences of the program, and what is the same in every language.
ENGLISH = """() => { const said = []; const walk = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
    while (walk.nextNode()) { const { parentElement, nodeValue } = walk.currentNode;
        if (parentElement.checkVisibility() && !parentElement.closest('#plan-text, #remarks, [translate=no], kbd')) said.push(nodeValue); }
    return said.join(' | '); }"""


def german_page(bench: Bench) -> Page:
    context = bench.browser.new_context(viewport={"width": 1280, "height": 800}, locale="de-AT")
    page = context.new_page()
    page.on("pageerror", lambda error: bench.complaints.append(str(error)))
    page.goto(bench.server.new_address())
    return page


def test_the_page_speaks_the_language_of_the_browser(bench: Bench) -> None:
    page = german_page(bench)
    page.locator("#plans div").click()
    expect(page.locator("#check-word")).to_have_text("✓ blade.yaml kann gemessen werden.")
    expect(page.locator("#verdict-word")).to_have_text("BEREIT")
    expect(page.locator("html")).to_have_attribute("lang", "de")
    expect(page.locator("#serial")).to_be_focused()
    page.keyboard.press("Enter")
    bench.device.source.put(opened(2000), *batches(measured(bench.profile, 2000, seed=2, defect_mm=0.12, at_mm=60.0), 50), CLOSED)
    expect(page.locator("#verdict[data-final=true] .word")).to_have_text("NICHT KONFORM")
    expect(page.locator("#verdict-why")).to_have_text(re.compile(r"^\d+ Punkte liegen außerhalb der Grenzen -0,05 \.\. 0,05 mm\.$"))
    expect(page.locator("#received")).to_have_text(re.compile(r"^2.000$"))
    expect(page.locator("#worst-value")).to_have_text(re.compile(r"^\+0,1\d{3}$"))
    expect(page.locator("#worst-where")).to_have_text(re.compile(r"^an Station \d+,\d\d mm$"))
    words = page.evaluate(ENGLISH)
    assert re.findall(r"\b(?:the|of|is|not|and|station|points|verdict|lost|run)\b", words) == [], words


def test_the_address_chooses_a_language_and_the_browser_keeps_it(bench: Bench) -> None:
    page = bench.page(address=bench.server.new_address().replace("/#", "/?lang=de#"))
    expect(page.locator("#verdict-word")).to_have_text("KEIN MESSPLAN")
    page.reload()
    expect(page.locator("#verdict-word")).to_have_text("KEIN MESSPLAN")
