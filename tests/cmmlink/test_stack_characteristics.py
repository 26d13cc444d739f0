"""Characteristics of a stack from surface to exit status: a blade whose sections are turned and shifted by known amounts."""

import csv
import json
import math
from pathlib import Path

import numpy as np
import pytest
import yaml
from numpy.typing import NDArray
from scipy.interpolate import BSpline

from cmmlink.errors import PlanError
from cmmlink.plan import CtPlan, load_ct_plan
from cmmlink.stack import StackOutcome
from inspection import Verdict, find_airfoil, find_camber_line, maximum_thickness
from tests.cmmlink.blade import inspect, plan_of
from tests.cmmlink.command import cmmlink
from tests.drivers.surface.ct_phantom import write_spline
from tests.drivers.surface.meshes import Triangles, binary_stl, tube, write

Array = NDArray[np.float64]
HEIGHTS = (2.0, 8.0, 12.0, 18.0)
PLACE = (20.0, 2.0)
TWIST = {"name": "twist", "type": "relative-twist", "lower_deg": -0.1, "upper_deg": 0.1}
ALL: list[dict[str, object]] = [
    TWIST,
    {"name": "turned", "type": "twist", "lower_deg": -20, "upper_deg": 20},
    {"name": "moved", "type": "displacement", "place_mm": PLACE, "upper_mm": 10},
    {"name": "moved along y", "type": "displacement", "axis": "y", "place_mm": PLACE, "upper_mm": 10},
    {"name": "bow", "type": "bow", "place_mm": PLACE, "upper_mm": 10},
    {"name": "lean", "type": "lean", "axis": "x", "place_mm": PLACE, "upper_deg": 20},
    {"name": "axis", "type": "stacking-axis", "place_mm": PLACE, "upper_mm": 10},
    {"name": "where it is", "type": "stacking-axis", "method": "location", "place_mm": PLACE, "upper_mm": 10},
]


def made_of(spline: BSpline, twist_deg: Array, shift_mm: Array, size: Array, chords: int = 400) -> Triangles:
    """A blade whose outline is turned, shifted and sized by (4,), (4, 2) and (4,) at the four heights, and does not change near them."""
    rings = np.array([height + beside for height in HEIGHTS for beside in (-1.0, 1.0)])
    triangles = tube(spline(np.linspace(0, 1, chords)), rings)
    k = np.abs(triangles[:, :, 2, None] - np.array(HEIGHTS)).argmin(axis=2)
    angle, (x, y) = np.radians(twist_deg)[k], np.moveaxis(triangles[:, :, :2] * size[k][:, :, None], 2, 0)
    made = triangles.copy()
    made[:, :, 0] = np.cos(angle) * x - np.sin(angle) * y + shift_mm[k, 0]
    made[:, :, 1] = np.sin(angle) * x + np.cos(angle) * y + shift_mm[k, 1]
    return made


def straight(spline: BSpline) -> Triangles:
    return made_of(spline, np.zeros(4), np.zeros((4, 2)), np.ones(4))


def twisted(spline: BSpline) -> Triangles:
    """By 15 degrees between the second and the third section."""
    return made_of(spline, np.array([0.0, 0.0, 15.0, 15.0]), np.zeros((4, 2)), np.ones(4))


def judged(folder: Path, spline: BSpline, mesh: Triangles, asked: list[dict[str, object]], **further: object) -> StackOutcome:
    surface, nominal = write(folder / "blade.stl", binary_stl(mesh)), write_spline(spline, folder / "blade.yaml")
    sections = further.pop("sections", {"heights_mm": HEIGHTS})
    assert isinstance(sections, dict)
    return inspect(plan_of(surface, nominal, sections, stack_characteristics=asked, **further))


def test_fifteen_degrees_of_twist_are_shown_and_judged(tmp_path: Path, spline: BSpline) -> None:
    """Every section of both blades is right in itself; the stack of one of them is not."""
    stack = judged(tmp_path, spline, twisted(spline), [TWIST])
    assert {section.verdict for section in stack.sections} == {Verdict.CONFORM}
    (twist,) = stack.characteristics
    assert [share.value for share in twist.sections] == pytest.approx([0, 0, 15, 15], abs=1e-6)
    assert (twist.found.verdict, stack.verdict) == (Verdict.NONCONFORM, Verdict.NONCONFORM)
    right = judged(tmp_path, spline, straight(spline), [TWIST])
    assert (right.characteristics[0].found.verdict, right.verdict) == (Verdict.CONFORM, Verdict.CONFORM)
    assert [share.value for share in right.characteristics[0].sections] == pytest.approx([0] * 4, abs=1e-6)


def test_taper_is_that_of_the_sizes(tmp_path: Path, spline: BSpline) -> None:
    size = np.array([1.0, 0.99, 0.985, 0.98])
    limits = {"wide": 0.1, "narrow": 0.005}
    asked: list[dict[str, object]] = [
        {"name": name, "type": "taper", "of": "thickness", "lower": -limit, "upper": limit} for name, limit in limits.items()
    ]
    mesh = made_of(spline, np.zeros(4), np.zeros((4, 2)), size, 2000)
    stack = judged(tmp_path, spline, mesh, asked, tolerance={"lower_mm": -2, "upper_mm": 2})
    section = find_airfoil(stack.sections[0].profile)
    full = maximum_thickness(section, find_camber_line(section)).value
    found = [one.found for one in stack.characteristics]
    assert [one.value for one in found] == pytest.approx([full * np.polyfit(HEIGHTS, size, 1)[0]] * 2, rel=1e-4)
    assert [one.nominal for one in found] == pytest.approx([0, 0], abs=1e-12)
    assert [one.verdict for one in found] == [Verdict.CONFORM, Verdict.NONCONFORM]


def test_every_value_is_that_of_the_motions_that_made_the_blade(tmp_path: Path, spline: BSpline) -> None:
    turned = np.array([0.5, -0.3, 1.2, 2.0])
    shift = np.array([(0.2, -0.1), (0.1, 0.3), (0.4, 0.0), (-0.2, 0.2)])
    radians = np.radians(turned)
    actual = np.column_stack([np.cos(radians) * 20 - np.sin(radians) * 2, np.sin(radians) * 20 + np.cos(radians) * 2]) + shift
    off = actual - PLACE
    share = (np.array(HEIGHTS) - 2)[:, None] / 16
    lines = [np.polyfit(HEIGHTS, off[:, k], 1) for k in (0, 1)]
    rest = off - np.column_stack([np.polyval(line, HEIGHTS) for line in lines])
    expected = {
        "moved": np.hypot(*off.T).max(),
        "moved along y": off[:, 1].max(),
        "bow": np.hypot(*(off - (1 - share) * off[0] - share * off[3]).T).max(),
        "lean": math.degrees(math.atan(lines[0][0])),
        "axis": np.hypot(*rest.T).max(),
        "where it is": max(math.hypot(*(np.polyval(line, height) for line in lines)) for height in (2.0, 18.0)),
    }
    further = {"tolerance": {"lower_mm": -8, "upper_mm": 8}, "registration": {"datum": {}}}
    stack = judged(tmp_path, spline, made_of(spline, turned, shift, np.ones(4), 2000), ALL, **further)
    values = {one.found.name: one.found for one in stack.characteristics}
    for name, value in expected.items():
        assert values[name].value == pytest.approx(value, abs=2e-5), name  # 2,000 chords lie a little inside the outline
        assert values[name].fit == "datum"
    (each,) = (one for one in stack.characteristics if one.found.name == "turned")
    assert [share.value for share in each.sections] == pytest.approx(turned.tolist(), abs=2e-5)


def test_a_section_that_proves_nothing_leaves_the_stack_unproven(tmp_path: Path, spline: BSpline) -> None:
    """A round bar in place of one section, and a part of the surface that is missing in another: neither twist nor bow conforms then."""
    mesh = straight(spline)
    middle = mesh.mean(axis=1)
    holed = mesh[~((np.abs(middle[:, 2] - 12) < 1.5) & (middle[:, 0] < 12))]
    asked: list[dict[str, object]] = [
        TWIST,
        {"name": "bow", "type": "bow", "upper_mm": 0.05},
        {"name": "lean", "type": "lean", "upper_deg": 1},
    ]
    stack = judged(tmp_path, spline, holed, asked)
    assert [section.verdict.word for section in stack.sections] == ["conform", "conform", "uncertain", "conform"]
    for one in stack.characteristics:
        assert one.found.verdict is Verdict.UNCERTAIN
        assert "The section at 12 mm:" in one.found.reasons[0].words
    assert [share.verdict.word for share in stack.characteristics[0].sections] == ["conform", "conform", "uncertain", "conform"]
    angle = np.linspace(0, 2 * np.pi, 200, endpoint=False)
    bar = tube(np.column_stack([30 + 19 * np.cos(angle), 19 * np.sin(angle)]), np.array([7.0, 9.0]))
    barred = np.concatenate([mesh[np.abs(middle[:, 2] - 8) > 1.2], bar])
    refused = judged(tmp_path, spline, barred, asked)
    assert refused.sections[1].run.result is None
    for one in refused.characteristics:
        assert one.found.verdict is Verdict.UNCERTAIN
        assert one.found.reasons[0].words.startswith("The section at 8 mm:")


def test_neither_the_order_of_the_sections_nor_the_density_of_points_changes_a_value(tmp_path: Path, spline: BSpline) -> None:
    mesh = twisted(spline)
    asked: list[dict[str, object]] = [
        TWIST,
        {"name": "bow", "type": "bow", "upper_mm": 0.05},
        {"name": "taper", "type": "taper", "upper": 0.1},
    ]
    one = judged(tmp_path, spline, mesh, asked)
    other = judged(tmp_path, spline, mesh[::-1], asked, sections={"heights_mm": (12.0, 2.0, 18.0, 8.0)})
    for a, b in zip(one.characteristics, other.characteristics, strict=True):
        assert (a.found.verdict, a.height_mm) == (b.found.verdict, b.height_mm)
        assert a.found.value == pytest.approx(b.found.value, abs=1e-9)
        assert [share.verdict for share in a.sections] == [share.verdict for share in b.sections]


def test_the_verdict_of_the_stack_is_in_every_output(tmp_path: Path, spline: BSpline) -> None:
    write(tmp_path / "blade.stl", binary_stl(twisted(spline)))
    write_spline(spline, tmp_path / "blade.yaml")
    plan = {
        "part": {"name": "blade"},
        "mesh": {"file": "blade.stl"},
        "nominal": {"file": "blade.yaml"},
        "tolerance": {"lower_mm": -0.1, "upper_mm": 0.1},
        "sections": {"heights_mm": list(HEIGHTS)},
        "cut": {"cutter": "numpy"},
        "stack_characteristics": [TWIST],
    }
    file = write(tmp_path / "plan.yaml", yaml.safe_dump(plan))
    ran = cmmlink("ct", file, "--no-record", "--out", tmp_path / "out")
    assert ran.code == 1
    assert "NOT CONFORM  4 sections" in ran.out
    assert "NOT CONFORM twist: relative-twist 15.0000 deg, deviation +15.0000 (limits -0.1 .. +0.1 deg) best-fit" in ran.out
    result = json.loads((tmp_path / "out" / "result.json").read_text(encoding="utf-8"))
    assert result["verdict"] == "nonconform"
    assert {section["verdict"] for section in result["slices"]} == {"conform"}
    (twist,) = result["characteristics"]
    assert (twist["verdict"], twist["unit"], twist["lower"], twist["upper"]) == ("nonconform", "deg", -0.1, 0.1)
    assert twist["value"] == pytest.approx(15, abs=1e-6)
    assert [share["verdict"] for share in twist["sections"]] == ["conform", "conform", "nonconform", "nonconform"]
    with (tmp_path / "out" / "stack.csv").open(encoding="utf-8", newline="") as table:
        rows = list(csv.DictReader(table))
    assert [float(row["value"]) for row in rows] == pytest.approx([0, 0, 15, 15], abs=1e-6)
    assert (tmp_path / "out" / "stack.png").read_bytes()[:8] == b"\x89PNG\r\n\x1a\n"
    assert "out-of-tolerance" not in (tmp_path / "out" / "characteristics.csv").read_text(encoding="utf-8")
    again = CtPlan.model_validate(yaml.safe_load(load_ct_plan(file).effective_yaml()))
    assert again.stack_characteristics == load_ct_plan(file).stack_characteristics


@pytest.mark.parametrize(
    ("asked", "message"),
    [
        ({"name": "twist", "type": "relative-twist"}, "a lower limit, an upper one, or both"),
        ({**TWIST, "reference_mm": 5.0}, "a reference_mm that is one of heights_mm, not 5 (twist)"),
        ({"name": "t", "type": "taper", "of": "thickness", "method": "tangent", "upper": 1}, "a method of thickness: inscribed, two-point"),
        ({"name": "t", "type": "torsion"}, "torsion"),
        ({"name": "b", "type": "bow", "upper_mm": 0.1, "lower_mm": 0.2}, "an upper limit above the lower one, 0.2"),
    ],
)
def test_a_plan_that_cannot_be_meant_is_refused(tmp_path: Path, asked: dict[str, object], message: str) -> None:
    plan = {
        "part": {"name": "blade"},
        "mesh": {"file": "blade.stl"},
        "nominal": {"file": "blade.yaml"},
        "tolerance": {"lower_mm": -0.1, "upper_mm": 0.1},
        "sections": {"heights_mm": list(HEIGHTS)},
        "stack_characteristics": [asked],
    }
    file = write(tmp_path / "plan.yaml", yaml.safe_dump(plan))
    with pytest.raises(PlanError) as caught:
        load_ct_plan(file)
    assert message in str(caught.value)
    assert "plan.yaml:" in str(caught.value)


def test_a_stack_of_one_section_is_refused_and_so_are_heights_without_a_section(tmp_path: Path, spline: BSpline) -> None:
    with pytest.raises(ValueError, match="sections at two heights or more, each once"):
        judged(tmp_path, spline, straight(spline), [TWIST], sections={"heights_mm": (2.0,)})
    with pytest.raises(PlanError, match="no section is at reference_mm 3; the nearest is at 2 mm"):
        judged(tmp_path, spline, straight(spline), [{**TWIST, "reference_mm": 3}], sections={"every_mm": 2.0, "from_mm": 2.0, "to_mm": 8.0})


def test_a_budget_gives_every_characteristic_of_the_stack_its_u(tmp_path: Path, spline: BSpline) -> None:
    """Those of the sections, which follow from the budget, added up; a twist less certain than its tolerance is not proven."""
    taper = {"name": "taper", "type": "taper", "of": "thickness", "method": "inscribed", "lower": -0.1, "upper": 0.1}
    budget = {"repeatability_mm": 0.002, "mpe": "4 + L/100 um"}
    stack = judged(tmp_path, spline, straight(spline), [*ALL[:1], *ALL[4:7], taper], uncertainty=budget)
    found = {one.found.name: one.found for one in stack.characteristics}
    assert all(one.uncertainty > 0 and "added as if" in one.notes[-1] for one in found.values())
    assert {one.verdict for one in found.values()} == {Verdict.CONFORM}
    narrow = {**TWIST, "lower_deg": -0.5 * found["twist"].uncertainty, "upper_deg": 0.5 * found["twist"].uncertainty}
    (twist,) = judged(tmp_path, spline, straight(spline), [narrow], uncertainty=budget).characteristics
    assert twist.found.verdict is Verdict.UNCERTAIN
    (simple,) = judged(tmp_path, spline, straight(spline), [narrow], uncertainty=budget, decision_rule="simple").characteristics
    assert simple.found.verdict is Verdict.CONFORM
    assert {section.run.result.zone.rule for section in stack.sections if section.run.result} == {"iso-14253-1"}
    assert all(section.result_json()["uncertainty"]["used_mm"] > 0.004 for section in stack.sections)
