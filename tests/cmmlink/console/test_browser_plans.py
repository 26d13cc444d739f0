"""A new plan and an empty folder, in a real browser."""

from collections.abc import Callable
from pathlib import Path

import pytest
from playwright.sync_api import Page, expect

from cmmlink.plan import load_plan
from tests.cmmlink.test_new_plan import circles

from .conftest import Bench, MakeBench
from .played import CLOSED, SECTION, batches, measured, opened

Keep = Callable[[Page, str], None]


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "plans").mkdir()
    return tmp_path / "plans"


@pytest.fixture
def empty(make_bench: MakeBench, folder: Path) -> Bench:
    """A station whose folder holds no plan."""
    return make_bench(folder=folder)


def choose(page: Page, name: str, content: str) -> None:
    page.locator("#nominal-file").set_input_files({"name": name, "mimeType": "application/octet-stream", "buffer": content.encode()})


def test_empty_folder_offers_a_new_plan_and_the_demo(empty: Bench, keep: Keep) -> None:
    page = empty.page()
    expect(page.locator("#first-plan")).to_be_visible()
    for absent in ("#entry", "#check", "#open-new-plan"):
        expect(page.locator(absent)).to_be_hidden()
    keep(page, "empty-folder")
    page.locator("#run-demo").click()
    expect(page.locator("#part")).to_have_text("NACA 4512 section")
    empty.device.source.put(opened(0), CLOSED)
    expect(page.locator("#verdict-why")).to_contain_text("no point was received")
    page.locator("[data-go=part]").click()
    expect(page.locator("#plans div")).to_have_text("demonstration")
    expect(page.locator("#open-new-plan")).to_be_visible()


def test_a_plan_is_made_on_the_page_and_measured(empty: Bench, folder: Path, keep: Keep) -> None:
    """Every mistake is said beside its field; what is right is saved, chosen and measured at once."""
    page = empty.page()
    page.locator("#first-plan").click()
    page.keyboard.press("s")  # the keys of the page are not those of the dialog
    choose(page, "section.yaml", SECTION)
    expect(page.locator("#nominal-words")).to_contain_text("closed, ")
    expect(page.locator("#nominal-words")).to_contain_text("runs counter-clockwise")
    expect(page.locator("#nominal-picture .arrow")).to_have_count(3)
    expect(page.locator("#plan-part")).to_have_value("section")
    page.locator("#plan-tolerance").fill("tight")
    page.locator("#plan-results").fill("../../elsewhere")
    page.locator("#save-plan").click()
    for field, words in (
        ("tolerance", "'tight': expected the lower"),
        ("source", "expected a file"),
        ("results", "in the folder of the plans"),
    ):
        expect(page.locator(f"#mistake-{field}")).to_contain_text(words)
        expect(page.locator(f"#plan-{field}")).to_have_attribute("aria-invalid", "true")
    expect(page.locator("#plan-tolerance")).to_be_focused()
    keep(page, "new-plan-mistakes")
    page.locator("#plan-tolerance").fill("0.05")
    page.locator("#plan-results").fill("")
    page.locator("#plan-source").fill("played")
    page.keyboard.press("Enter")
    expect(page.locator("#check-word")).to_have_text("✓ section.yaml can be run.")
    expect(page.locator("#serial")).to_be_focused()
    assert load_plan(folder / "section.yaml").nominal.file == folder / "nominals" / "section.yaml"
    empty.device.source.put(opened(2000), *batches(measured(empty.profile, 2000, seed=1), 500), CLOSED)  # the run ends as soon as it begins
    page.keyboard.type("N-1")
    page.keyboard.press("Enter")
    expect(page.locator("#verdict[data-final=true] .word")).to_have_text("CONFORM")


def test_a_drawing_of_several_curves_is_dropped_and_asked_about(empty: Bench, folder: Path, keep: Keep) -> None:
    (folder / "two.yaml").write_text("part: {name: a}\nnominal: {file: b.dxf}\n", encoding="utf-8")
    page = empty.page()
    expect(page.locator("#open-new-plan")).to_be_visible()
    dropped = page.evaluate_handle(
        "text => { const data = new DataTransfer(); data.items.add(new File([text], 'two.dxf')); return data; }", circles(10, 4)
    )
    page.locator("#plans-card").dispatch_event("drop", {"dataTransfer": dropped})
    expect(page.locator("#nominal-words")).to_contain_text("units of the file")
    expect(page.locator("#plan-curve option")).to_have_count(3)
    page.locator("#plan-unit").fill("inch")
    page.locator("#plan-curve").select_option("2")
    length = 2 * 3.141592653589793 * 4 * 25.4
    expect(page.locator("#nominal-words")).to_contain_text(f"{length:.3f} mm long")
    keep(page, "new-plan-curves")
    page.locator("#plan-tolerance").fill("-0.1 0.2")
    page.locator("#plan-source").fill("COM3")
    page.locator("#save-plan").click()
    expect(page.locator("#mistake-name")).to_contain_text("two.yaml is there already")
    page.locator("#replace-plan").check()
    page.locator("#save-plan").click()
    expect(page.locator("#check-word")).to_contain_text("can be run")
    plan = load_plan(folder / "two.yaml")
    assert (plan.nominal.unit, plan.nominal.curve, plan.zone.upper_mm) == ("inch", 2, 0.2)
    page.locator("#open-new-plan").click()
    choose(page, "broken.dxf", "no drawing")
    expect(page.locator("#mistake-nominal")).to_be_visible()
    expect(page.locator("#nominal-read")).to_be_hidden()
    page.keyboard.press("Escape")
    expect(page.locator("#new-plan")).to_be_hidden()
