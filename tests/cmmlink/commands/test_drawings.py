"""Drawings as nominals, from the command line: chosen, shown, judged against, and replayed."""

import json
from pathlib import Path

import numpy as np
import pytest
from ezdxf.filemanagement import new
from numpy.typing import NDArray

from inspection import SectionPlane
from tests.cmmlink.command import cmmlink
from tests.cmmlink.oval_part import write_points

SEMI_MM = (20.0, 12.0)
PLANE = SectionPlane(np.array([5.0, 2.0, 60.0]), np.array([1.0, 0.0, 0.0]), np.array([0.0, -0.6, 0.8]))
OPTIONS = ("--tolerance", -0.05, 0.05, "--fit", "none")


def ellipse_points(off_mm: float) -> NDArray[np.float64]:
    t = np.linspace(0, 2 * np.pi, 400, endpoint=False)
    a, b = SEMI_MM
    normal = np.column_stack([b * np.cos(t), a * np.sin(t)])
    return np.asarray(np.column_stack([a * np.cos(t), b * np.sin(t)]) + off_mm * normal / np.hypot(*normal.T)[:, None])


@pytest.fixture
def drawing(tmp_path: Path) -> Path:
    """An ellipse in a plane of space, in inches, with a circle about it on another layer."""
    document = new("R2010")
    document.units = 1
    center, x, normal = (vector / 25.4 for vector in (PLANE.origin_mm, PLANE.x_axis * SEMI_MM[0], PLANE.normal))
    space = document.modelspace()
    space.add_ellipse(center, x, SEMI_MM[1] / SEMI_MM[0], dxfattribs={"extrusion": normal, "layer": "PROFILE"})
    space.add_circle((0, 0), 9, dxfattribs={"layer": "FRAME"})
    document.saveas(tmp_path / "part.dxf")
    return tmp_path / "part.dxf"


def test_a_curve_in_space_brings_its_section_to_the_verdict_and_to_the_replay(drawing: Path) -> None:
    records = ("--records", drawing.parent / "records", "--json")
    points = write_points(drawing.parent / "points.csv", PLANE.to_machine(ellipse_points(0.02)))
    judged = cmmlink("inspect", points, "--nominal", drawing, "--layer", "PROFILE", *OPTIONS, *records)
    assert judged.code == 0
    result = json.loads(judged.out)
    assert result["max_deviation_mm"] == pytest.approx(0.02, abs=1e-8)
    assert result["min_deviation_mm"] == pytest.approx(0.02, abs=1e-8)
    assert any("the curve lies in space: the section is {origin_mm: [" in note for note in result["notes"])
    drawing.unlink()
    replayed = cmmlink("replay", "last", *records)
    assert (replayed.code, json.loads(replayed.out)["identical"]) == (0, True)


def test_a_plan_with_the_section_of_the_curve_gives_the_curve_its_coordinates(drawing: Path) -> None:
    points = write_points(drawing.parent / "points.csv", PLANE.to_machine(ellipse_points(-0.03)))
    section = {name: getattr(PLANE, name).tolist() for name in ("origin_mm", "normal", "x_axis")}
    plan = {
        "part": {"name": "ellipse"},
        "nominal": {"file": drawing.name, "layer": "PROFILE"},
        "tolerance": {"lower_mm": -0.05, "upper_mm": 0.05},
        "device": {"type": "file", "file": points.name},
        "section": section,
        "registration": {"datum": {}},
        "out": None,
    }
    (drawing.parent / "plan.yaml").write_text(json.dumps(plan), encoding="utf-8")
    judged = cmmlink("run", drawing.parent / "plan.yaml", "--headless", "--json", "--records", drawing.parent)
    result = json.loads(judged.out)
    assert (judged.code, result["worst"]["deviation_mm"]) == (0, pytest.approx(-0.03, abs=1e-8))
    assert any("the curve lies in the section of the plan, and has its coordinates" in note for note in result["notes"])


def test_nominal_shows_what_was_understood_and_lists_what_can_be_chosen(drawing: Path) -> None:
    refused = cmmlink("nominal", drawing)
    assert (refused.code, refused.out) == (2, "")
    assert "holds 2 closed curves; expected nominal.layer or nominal.curve (--layer, --curve)" in refused.err
    shown = json.loads(cmmlink("nominal", drawing, "--curve", 2, "--json").out)
    assert (shown["layers"], shown["closed"], shown["source_format"]) == (["PROFILE"], True, "dxf-r2010")
    np.testing.assert_allclose(shown["plane"]["normal"], PLANE.normal, atol=1e-12)
    words = cmmlink("nominal", drawing, "--curve", 2).out
    assert "unit of the file: inch ($INSUNITS 1)" in words
    assert "the profile is curve 2 of 2 of layer PROFILE" in words
