"""Drawings as nominals, from the command line: chosen, shown, judged against, and replayed."""

import json
from pathlib import Path

import numpy as np
import pytest
from ezdxf.filemanagement import new
from matplotlib.image import imread
from numpy.typing import NDArray
from scipy.special import ellipe

from cmmlink.nominal_files import curves_in
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
    assert any("the curve lies in the section that was asked for, and has its coordinates" in note for note in result["notes"])


def test_nominal_shows_what_was_understood_and_lists_what_can_be_chosen(drawing: Path) -> None:
    refused = cmmlink("nominal", drawing)
    assert (refused.code, refused.out) == (2, "")
    assert "holds 2 closed curves; expected nominal.layer or nominal.curve (--layer, --curve)" in refused.err
    picture = drawing.parent / "curves.png"
    numbered = cmmlink("nominal", drawing, "--out", picture)
    assert (numbered.code, numbered.out) == (2, "")
    assert numbered.err.endswith(f"; {picture} shows 2 curves with their numbers\n")
    assert imread(picture).shape[:2] == (880, 1320)
    inches, unknown = (curves_in(drawing), curves_in(drawing, scale=2.0))
    assert [curve.words.split(",")[1] for curve in inches] == [f" {18 * np.pi * 25.4:.6g} mm", f" {80 * ellipe(0.64):.6g} mm"]
    assert np.ptp(unknown[0].points, axis=0)[0] == pytest.approx(36, abs=0.01)
    shown = json.loads(cmmlink("nominal", drawing, "--curve", 2, "--json").out)
    assert (shown["layers"], shown["closed"], shown["source_format"]) == (["PROFILE"], True, "dxf-r2010")
    np.testing.assert_allclose(shown["plane"]["normal"], PLANE.normal, atol=1e-12)
    words = cmmlink("nominal", drawing, "--curve", 2).out
    assert "unit of the file: inch ($INSUNITS 1)" in words
    assert "the profile is curve 2 of 2 of layer PROFILE" in words


def test_nominal_draws_what_was_understood(drawing: Path) -> None:
    """The picture shows the curve in its own colour where it runs, and the marks of the start and of the direction."""
    out = drawing.parent / "nominal.png"
    assert cmmlink("nominal", drawing, "--curve", 2, "--out", out).code == 0
    pixels = np.round(imread(out)[:, :, :3] * 255).astype(int)
    line, start = (np.abs(pixels - np.array(colour)).sum(axis=2) < 8 for colour in ((0x3A, 0x3F, 0x45), (0x2A, 0x7F, 0xA5)))
    rows, columns = np.nonzero(line)
    assert np.ptp(columns) / np.ptp(rows) == pytest.approx(SEMI_MM[0] / SEMI_MM[1], rel=0.03)
    assert start.sum() > 300
    refused = cmmlink("nominal", drawing, "--curve", 2, "--out", drawing.parent / "nominal.jpg")
    assert (refused.code, "expected the name of a picture that ends in .png" in refused.err) == (2, True)
    missing = cmmlink("nominal", drawing, "--curve", 2, "--out", drawing.parent / "none" / "nominal.png")
    assert (missing.code, "cannot be written: No such file" in missing.err) == (2, True)


def test_a_section_is_one_of_a_point_and_a_normal(drawing: Path) -> None:
    section = ("--section", *PLANE.origin_mm, *PLANE.normal)
    shown = json.loads(cmmlink("nominal", drawing, "--curve", 2, *section, "--json").out)
    np.testing.assert_allclose(shown["plane"]["origin_mm"], PLANE.origin_mm, atol=1e-12)
    points = np.array(shown["control_points_mm"])
    np.testing.assert_allclose((points.min(axis=0) + points.max(axis=0)) / 2, [0, 0], atol=1e-9)
    both = cmmlink("inspect", drawing, "--nominal", drawing, *OPTIONS, *section, "--plane", "xz")
    assert (both.code, "--section and --plane xz are both given; expected one of them" in both.err) == (2, True)
    none = cmmlink("nominal", drawing, "--section", 0, 0, 0, 0, 0, 0)
    assert (none.code, "--section: the normal" in none.err) == (2, True)
