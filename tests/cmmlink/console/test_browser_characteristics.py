"""The characteristics on the page, in a real browser: while a part is measured, at the end, in the history, and on the drawings."""

import shutil
from collections.abc import Callable
from datetime import datetime
from pathlib import Path
from time import monotonic

import numpy as np
import pytest
from playwright.sync_api import Page, expect

from cmmlink.console.past_runs import PastRuns
from inspection import RigidTransform, synthetic
from tests.inspection.profiles import AIRFOILS
from tests.inspection.reference_parts import nominal_of

from .conftest import Bench, MakeBench
from .played import CLOSED, Array, batches, opened
from .seen import drawn, finished, focus, millimetres, overflowing

Keep = Callable[[Page, str], None]

LONG = "form of the leading edge as the drawing of the customer names it in note 14, sheet 3 of 7"
PLAN = f"""part: {{name: vane 3, serial_number: V-0007}}
operator: Ada
nominal: {{file: goe404.dat, scale: 100}}
device: {{type: serial, address: played}}
registration: {{datum: {{rotation_deg: -23, translation_mm: [210, 145]}}}}
uncertainty: {{mpe: {{a_mm: 0.0018, per_length: 300}}, repeatability_mm: 0.001}}
characteristics:
  - {{name: contour, type: line-profile, zone: {{lower_mm: -0.06, upper_mm: 0.06}}, fit: datum}}
  - {{name: "{LONG}", type: line-profile, region: LE, within_mm: 12, zone: 0.06 UZ +0.01, fit: datum, filter: {{cutoff_mm: 0.8}}}}
  - {{name: upper side, type: line-profile, region: UPPER, zone: {{width_mm: 0.08}}, fit: best-fit}}
  - {{name: lower side, type: line-profile, region: LOWER, zone: {{width_mm: 0.1}}, fit: datum}}
  - {{name: seat, type: line-profile, from: {{station_mm: 180}}, to: {{station_mm: 30}}, zone: {{width_mm: 0.09}}, fit: datum}}
  - {{name: chord, type: chord, nominal_mm: 100, lower_mm: -0.1, upper_mm: 0.1, uncertainty_mm: 0.002}}
  - {{name: chord angle, type: chord-angle, lower_deg: -0.1, upper_deg: 0.1, uncertainty_deg: 0.002}}
  - {{name: thickness, type: thickness, lower_mm: -0.1, upper_mm: 0.1, uncertainty_mm: 0.002}}
  - {{name: LE radius, type: edge-radius, lower_mm: -0.3, upper_mm: 0.3, uncertainty_mm: 0.002}}
  - {{name: LE thickness, type: edge-thickness, edge: leading, offset_mm: 3, lower_mm: -0.1, upper_mm: 0.1, uncertainty_mm: 0.002}}
  - {{name: camber, type: camber, lower_mm: -0.1, uncertainty_mm: 0.002}}
  - {{name: twist, type: twist, lower_deg: -0.05, upper_deg: 0.05}}
"""
OF_SECTION = ["chord", "chord angle", "thickness", "LE radius", "LE thickness", "camber", "twist"]
NAMES = ["contour", LONG, "upper side", "lower side", "seat", *OF_SECTION]
NOT_CONFORM, SO_FAR, LOOKS_OUT = "NOT CONFORM", "so far", "LOOKS OUT"


def vane(count: int, defect_mm: float, at_mm: float) -> Array:
    """Machine points (count, 3) of the vane from its first station to its last, with a defect 4 mm wide."""
    nominal = nominal_of("goe404")
    station = np.linspace(0, nominal.length_mm, count, endpoint=False)
    deviation = synthetic.form_error_mm(station, nominal.length_mm, np.random.default_rng(3), 0.008)
    deviation += defect_mm * np.exp(-(((station - at_mm) / 2) ** 2))
    pose = RigidTransform(np.radians(-23), np.array([210.0, 145.0]))
    return np.column_stack([synthetic.scan(nominal, station, deviation, pose).points_mm, np.zeros(count)])


@pytest.fixture
def vanes(make_bench: MakeBench, tmp_path: Path) -> Bench:
    """A station whose plan asks for twelve characteristics."""
    records = PastRuns(tmp_path / "records", lambda _: None, monotonic, lambda: datetime.now().astimezone())
    bench = make_bench(records)
    shutil.copy(AIRFOILS / "goe404.dat", tmp_path)
    (plan,) = bench.station._setup.plans().values()
    plan.write_text(PLAN, encoding="utf-8")
    return bench


def cells(page: Page, column: int) -> list[str]:
    return page.locator(f"#characteristics tbody td:nth-child({column})").all_text_contents()


def test_characteristics_are_told_so_far_and_at_the_end_and_in_the_history(vanes: Bench, keep: Keep) -> None:
    page, points = vanes.started(), batches(vane(2000, defect_mm=0.15, at_mm=160.0), 50)
    table = page.locator("#characteristics tbody tr")
    vanes.device.source.put(opened(2000), *points[:34])
    expect(table).to_have_count(12)
    expect(table.nth(3)).to_contain_text(NOT_CONFORM)
    assert cells(page, 2) == NAMES
    assert cells(page, 1) == [NOT_CONFORM, SO_FAR, SO_FAR, NOT_CONFORM, *[SO_FAR] * 8], "red only where the known pose proves it"
    assert cells(page, 3)[11] == "\N{EN DASH}", "a part of what the twist depends on was not measured yet"
    expect(page.locator("#verdict-word")).to_have_text(NOT_CONFORM)
    expect(page.locator("#verdict-of")).to_have_text("contour and 1 more")
    keep(page, "characteristics-so-far")
    vanes.device.source.put(*points[34:], CLOSED)
    expect(page.locator("#verdict[data-final=true] .word")).to_have_text(NOT_CONFORM)
    found = finished(vanes).characteristics
    at_end = {"conform": "CONFORM", "uncertain": "NOT PROVEN", "nonconform": NOT_CONFORM}
    expect(page.locator("#characteristics td:nth-child(1)")).to_have_text([at_end[one.verdict.word] for one in found])
    assert [millimetres(f"+{words}") for words in cells(page, 3)] == pytest.approx([one.value for one in found], abs=5.1e-5)
    assert [millimetres(f"+{words}") if "0.0000" in words else millimetres(words) for words in cells(page, 5)] == pytest.approx(
        [one.deviation for one in found], abs=5.1e-5
    )
    expect(page.locator("#characteristics-words")).to_have_text("12, 2 NOT CONFORM")
    assert overflowing(page) == []
    shown = [cells(page, column) for column in range(1, 8)]
    page.keyboard.press("3")
    expect(page.locator("#runs tbody tr")).to_contain_text(["complete"])
    page.keyboard.press("o")
    expect(page.locator("#banners")).to_contain_text("Recorded run")
    expect(page.locator("#verdict-of")).to_have_text("contour and 1 more")
    assert [cells(page, column) for column in range(1, 8)] == shown


def test_the_chosen_characteristic_is_shown_on_the_drawings(vanes: Bench, keep: Keep) -> None:
    page = vanes.started()
    vanes.device.source.put(opened(2000), *batches(vane(2000, defect_mm=0.0, at_mm=160.0), 200), CLOSED)
    expect(page.locator("#verdict[data-final=true] .word")).to_have_text("CONFORM")
    expect(page.locator("#verdict-of")).to_have_text("all 12 characteristics")
    pictures = [drawn(page, "profile") + drawn(page, "profile", layer=1)]
    focus(page, "characteristics")
    for steps, name in ((1, "contour"), (1, LONG), (4, "chord")):
        for _ in range(steps):
            page.keyboard.press("ArrowDown")
        expect(page.locator("#characteristics tr[aria-selected=true] td:nth-child(2)")).to_have_text(name)
        expect(page.locator("#characteristic-words")).to_contain_text(name)
        pictures.append(drawn(page, "profile") + drawn(page, "profile", layer=1))
        keep(page, f"characteristics-{steps}-{name[:5]}")
    assert len(set(pictures)) == 4, "each is drawn in a way of its own"
    page.locator("#characteristics tbody tr").nth(1).click()
    assert drawn(page, "profile") + drawn(page, "profile", layer=1) == pictures[2], "the mouse does what the keys do"
