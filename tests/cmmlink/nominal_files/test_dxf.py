"""DXF: what is drawn comes back exact; what is not one profile is refused with the reason."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from ezdxf.document import Drawing
from ezdxf.filemanagement import new as new_document
from ezdxf.math import OCS

from cmmlink.nominal_files import NominalFile, load_nominal
from inspection import NominalError, NurbsCurve
from tests.cmmlink.nominal_files.wire import (
    CENTER,
    ELLIPSE_CENTER,
    LINES,
    POLES,
    RADIUS,
    SEMI_X,
    SEMI_Y,
    WEIGHTS,
    require_wire,
)

MM = 4


def draw_wire(space: Any, scale: float = 1.0, attributes: dict[str, Any] | None = None) -> None:
    """Draw the wire, out of order and in any direction, as people do."""
    attributes = attributes or {}
    space.add_rational_spline([(scale * x, scale * y) for x, y in POLES], WEIGHTS, 3, dxfattribs=attributes)
    for a, b in LINES:
        space.add_line(np.multiply(b, scale), np.multiply(a, scale), dxfattribs=attributes)
    center, major = np.multiply(ELLIPSE_CENTER, scale), (0, SEMI_Y * scale)
    space.add_ellipse(center, major, SEMI_X / SEMI_Y, 0, np.pi / 2, dxfattribs=attributes)
    space.add_arc(np.multiply(CENTER, scale), RADIUS * scale, 270, 90, dxfattribs=attributes)


def new(release: str = "R2010", units: int = MM) -> Drawing:
    document = new_document(release)
    document.units = units
    return document


def saved(document: Drawing, folder: Path, **how: Any) -> Path:
    path = folder / "part.dxf"
    document.saveas(path, **how)
    return path


def drawn(folder: Path, draw: Callable[[Any], Any], units: int = MM, **asked: Any) -> NominalFile:
    document = new(units=units)
    draw(document.modelspace())
    return load_nominal(saved(document, folder), **asked)


def refusal(folder: Path, draw: Callable[[Any], Any], units: int = MM, **asked: Any) -> str:
    with pytest.raises(NominalError) as refused:
        drawn(folder, draw, units, **asked)
    assert "\n" not in str(refused.value)
    return str(refused.value).removeprefix(f"{folder / 'part.dxf'}: ")


@pytest.mark.parametrize("release", ["R2000", "R2004", "R2007", "R2010", "R2013", "R2018"])
def test_a_wire_of_every_release_comes_back_exact(tmp_path: Path, release: str) -> None:
    document = new(release)
    draw_wire(document.modelspace(), attributes={"layer": "PROFILE"})
    document.modelspace().add_text("blade 7")
    found = load_nominal(saved(document, tmp_path, fmt="bin" if release == "R2007" else "asc"))
    require_wire(found.curve)
    assert found.source_format == f"dxf-{release.lower()}"
    assert (found.layers, found.plane) == (("PROFILE",), None)
    assert found.notes[:4] == (
        "unit of the file: mm ($INSUNITS 4)",
        "left out: 1 TEXT",
        "the profile is the only curve of layer PROFILE, made of 5 pieces",
        "runs counter-clockwise from (30, 20)",
    )


@pytest.mark.parametrize(
    ("units", "mm"), [(1, 25.4), (2, 304.8), (5, 10.0), (6, 1000.0), (8, 25.4e-6), (9, 0.0254), (13, 1e-3), (14, 100.0)]
)
def test_every_unit_is_what_it_says(tmp_path: Path, units: int, mm: float) -> None:
    found = drawn(tmp_path, lambda space: draw_wire(space, 1 / mm), units)
    require_wire(found.curve)
    assert f"($INSUNITS {units})" in found.notes[0]


def test_a_drawing_without_a_unit_needs_one(tmp_path: Path) -> None:
    assert refusal(tmp_path, draw_wire, 0).startswith("states no unit ($INSUNITS 0); expected the unit of the drawing: give nominal.unit")
    assert refusal(tmp_path, draw_wire, 3).startswith("states a unit that parts are not drawn in ($INSUNITS 3)")
    require_wire(drawn(tmp_path, draw_wire, 0, unit="mm").curve)
    require_wire(drawn(tmp_path, draw_wire, 0, scale=2.0).curve, 2.0)
    above = drawn(tmp_path, draw_wire, 1, unit="mm")
    require_wire(above.curve)
    assert above.notes[0] == "read with 1 mm a unit, as asked, above what the file states (inch ($INSUNITS 1))"


SLOT = [(0.0, 0.0, 0.0), (30.0, 0.0, 1.0), (30.0, 20.0, 0.0), (0.0, 20.0, 1.0)]  # x, y and the bulge behind each
SLOT_MM = 60 + 20 * np.pi


@pytest.mark.parametrize("release", ["R12", "R2000", "R2018"])
@pytest.mark.parametrize("flagged", [True, False])
def test_bulges_of_polylines_are_arcs(tmp_path: Path, release: str, flagged: bool) -> None:
    document = new(release)
    rows = SLOT if flagged else [*SLOT, (0.0, 0.0, 0.0)]
    if release == "R12":
        document.modelspace().add_polyline2d(rows, format="xyb", close=flagged)
    else:
        document.modelspace().add_lwpolyline(rows, format="xyb", close=flagged)
    path = saved(document, tmp_path)
    if release == "R12":
        with pytest.raises(NominalError, match="a drawing of release 12 that states no unit; expected"):
            load_nominal(path)
    curve = load_nominal(path, unit="mm").curve
    assert abs(curve.length_mm - SLOT_MM) < 1e-12
    assert (curve.closed, len(curve.corners)) == (True, 0)
    right = curve.point(np.linspace(*curve.domain, 1001))
    right = right[right[:, 0] > 30]
    assert np.abs(np.hypot(right[:, 0] - 30, right[:, 1] - 10) - 10).max() < 1e-13


def test_a_mirrored_extrusion_mirrors_and_a_tilted_one_brings_its_plane(tmp_path: Path) -> None:
    mirrored = drawn(tmp_path, lambda space: space.add_lwpolyline(SLOT, format="xyb", close=True, dxfattribs={"extrusion": (0, 0, -1)}))
    assert mirrored.plane is None
    assert mirrored.curve.point(np.linspace(*mirrored.curve.domain, 999))[:, 0].min() == pytest.approx(-40, abs=1e-4)
    assert abs(mirrored.curve.length_mm - SLOT_MM) < 1e-12
    extrusion = (0.02, 0.32, 0.95)
    tilted = drawn(tmp_path, lambda space: space.add_circle((1, 2, 7), 50, dxfattribs={"extrusion": extrusion}))
    assert tilted.plane is not None
    normal = np.array(extrusion) / np.linalg.norm(extrusion)
    np.testing.assert_allclose(tilted.plane.normal, normal, atol=1e-12)
    on_it = tilted.plane.to_machine(tilted.curve.point(np.linspace(*tilted.curve.domain, 100)))
    center = np.array(tuple(OCS(extrusion).to_wcs((1, 2, 7))))
    np.testing.assert_allclose(np.linalg.norm(on_it - center, axis=1), 50, atol=1e-11)
    np.testing.assert_allclose((on_it - center) @ normal, 0, atol=1e-11)
    assert any(note.startswith("the curve lies in space: the section is {origin_mm: [") for note in tilted.notes)


def test_blocks_are_placed_as_often_and_as_distorted_as_they_are_inserted(tmp_path: Path) -> None:
    document = new()
    inner, outer = document.blocks.new("inner"), document.blocks.new("outer")
    draw_wire(inner)
    outer.add_blockref("inner", (0, 0), dxfattribs={"layer": "0"})
    document.modelspace().add_blockref("outer", (5, 6), dxfattribs={"layer": "PART", "rotation": 30, "xscale": 2, "yscale": 2, "zscale": 2})
    found = load_nominal(saved(document, tmp_path))
    assert found.layers == ("PART",)
    turned = found.curve.control_points_mm - [5, 6]
    c, s = np.cos(np.pi / 6), np.sin(np.pi / 6)
    points = turned @ np.array([[c, -s], [s, c]])
    back = NurbsCurve(found.curve.degree, points, found.curve.knots, found.curve.weights, closed=True)
    require_wire(back, 2.0)
    circle = document.blocks.new("circle")
    circle.add_circle((0, 0), 10)
    document.modelspace().delete_all_entities()
    document.modelspace().add_blockref("circle", (1, 1), dxfattribs={"xscale": 3, "yscale": 2})
    points = load_nominal(saved(document, tmp_path)).curve.point(np.linspace(0, 6, 50)) - 1
    np.testing.assert_allclose((points[:, 0] / 30) ** 2 + (points[:, 1] / 20) ** 2, 1, atol=1e-12)


@pytest.mark.parametrize("weights", [None, (3.0, 1.0, 1.0, 1.0)])
def test_a_periodic_spline_with_one_knot_more_than_points_is_smooth_all_round(tmp_path: Path, weights: tuple[float, ...] | None) -> None:
    def add(space: Any) -> None:
        spline = space.add_spline(degree=3)
        spline.control_points = [(0, 0), (40, 0), (40, 30), (0, 30)]
        spline.knots = [0, 1, 2, 3, 4]
        spline.weights = weights or []
        spline.dxf.flags = 11

    curve = drawn(tmp_path, add).curve
    assert (curve.closed, len(curve.corners)) == (True, 0)
    start, end = curve.domain
    for order in (0, 1, 2):
        ends = curve.derivatives(np.array([start, np.nextafter(end, start)]), order)[order]
        np.testing.assert_allclose(ends[0], ends[1], atol=1e-10)
    if weights is None:  # the uniform periodic cubic at a knot: (1, 4, 1) / 6 of three points in a row
        poles = np.array([(0, 0), (40, 0), (40, 30), (0, 30)])
        expected = (np.roll(poles, 1, axis=0) + 4 * poles + np.roll(poles, -1, axis=0)) / 6
        found = curve.point(np.linspace(start, end, 5)[:4])
        assert max(np.abs(expected - point).sum(axis=1).min() for point in found) < 1e-12


def test_a_spline_through_fit_points_passes_them_and_an_unclamped_one_is_cut_to_its_range(tmp_path: Path) -> None:
    fit = [(0, 0), (10, 4), (22, 3), (30, 8)]
    through = drawn(tmp_path, lambda space: space.add_spline(fit)).curve
    gaps = [np.hypot(*(through.point(np.linspace(*through.domain, 4001)) - point).T).min() for point in fit]
    assert max(gaps) < 5e-3
    points = np.array([(0.0, 0.0), (10.0, 8.0), (20.0, -4.0), (30.0, 6.0), (44.0, 0.0)])
    unclamped = drawn(tmp_path, lambda space: space.add_open_spline(points, 3).set_uniform(points, 3)).curve
    np.testing.assert_allclose(unclamped.point(np.array([unclamped.domain[0]]))[0], (points[0] + 4 * points[1] + points[2]) / 6, atol=1e-12)
    np.testing.assert_allclose(unclamped.point(np.array([unclamped.domain[1]]))[0], (points[2] + 4 * points[3] + points[4]) / 6, atol=1e-12)


def test_frame_points_of_a_fitted_polyline_are_not_on_it(tmp_path: Path) -> None:
    document = new()
    line = document.modelspace().add_polyline2d([(0, 0), (10, 0), (5, 90), (10, 10), (0, 10)], close=True)
    line.vertices[2].dxf.flags = 16
    assert load_nominal(saved(document, tmp_path)).curve.length_mm == pytest.approx(40, abs=1e-12)


def test_the_order_and_direction_of_what_is_drawn_change_nothing(tmp_path: Path) -> None:
    document = new()
    draw_wire(document.modelspace())
    one = load_nominal(saved(document, tmp_path)).curve
    again, space = new(), document.modelspace()
    for entity in reversed(list(space)):
        again.modelspace().add_entity(entity.copy())
    other = load_nominal(saved(again, tmp_path)).curve
    np.testing.assert_allclose(one.control_points_mm, other.control_points_mm, atol=1e-12)
    np.testing.assert_allclose(one.knots, other.knots, atol=1e-9)


def two_slots(space: Any) -> None:
    space.add_lwpolyline(SLOT, format="xyb", close=True, dxfattribs={"layer": "SLOT"})
    draw_wire(space, 2.0, {"layer": "PROFILE"})
    space.add_line((0, 60), (50, 60), dxfattribs={"layer": "CENTRE"})


def test_the_curve_is_chosen_by_layer_or_number_and_the_refusal_lists_them(tmp_path: Path) -> None:
    said = refusal(tmp_path, two_slots)
    assert said.startswith(
        "holds 2 closed curves; expected nominal.layer or nominal.curve (--layer, --curve) to name the profile: curve 1: closed, "
    )
    assert "5 pieces, layer PROFILE; curve 2: closed, 122.832 mm, 1 piece, layer SLOT; curve 3: open, 50 mm, 1 piece, layer CENTRE" in said
    require_wire(drawn(tmp_path, two_slots, layer="profile").curve, 2.0)
    assert drawn(tmp_path, two_slots, curve=2).layers == ("SLOT",)
    assert "expected one of CENTRE, PROFILE, SLOT" in refusal(tmp_path, two_slots, layer="OUTLINE")
    assert refusal(tmp_path, two_slots, curve=4).startswith("curve 4 is not there; expected 1 to 3: curve 1: closed")
    open_line = drawn(tmp_path, two_slots, layer="CENTRE")
    assert not open_line.curve.closed
    assert open_line.curve.length_mm == pytest.approx(50, abs=1e-12)


def test_a_gap_is_named_with_its_width_and_never_closed(tmp_path: Path) -> None:
    def gap(space: Any) -> None:
        space.add_lwpolyline([(0, 0), (40, 0), (40, 30), (0, 30), (0, 0.1)])

    assert refusal(tmp_path, gap).startswith(
        "the curve does not close: a gap of 0.1 mm between (0, 0.1) and (0, 0). A gap is never closed here"
    )
    assert "a gap of 0.1 mm" in refusal(tmp_path, gap, closed=True)
    assert drawn(tmp_path, gap, closed=False).curve.length_mm == pytest.approx(139.9)

    def two(space: Any) -> None:
        space.add_lwpolyline([(0, 0), (40, 0), (40, 30)])
        space.add_lwpolyline([(40.77, 30), (0, 30), (0, 0)])
        space.add_line((90, 0), (90, 20))

    said = refusal(tmp_path, two)
    assert said.startswith("holds 2 curves, none of which is closed; expected nominal.layer")
    assert "open, 140.77 mm, 2 pieces, layer 0, with a gap of 0.77 mm at (40" in said


def test_a_fork_is_refused_with_its_place_and_what_is_drawn_twice_is_dropped_and_said(tmp_path: Path) -> None:
    def fork(space: Any) -> None:
        space.add_lwpolyline(SLOT, format="xyb")
        space.add_line((0, 20), (0, 0))
        space.add_line((0, 20), (-30, 20))

    assert "the curve forks at (0, 20), where more than two ends meet" in refusal(tmp_path, fork, curve=1)

    def twice(space: Any) -> None:
        draw_wire(space)
        draw_wire(space)
        space.add_arc(CENTER, RADIUS, 270, 90, dxfattribs={"extrusion": (0, 0, 1), "layer": "1"})

    found = drawn(tmp_path, twice)
    require_wire(found.curve)
    assert any(note.startswith("6 curves drawn twice left out: ") for note in found.notes)
    circles = drawn(tmp_path, lambda space: (space.add_circle((0, 0), 9), space.add_ellipse((0, 0), (0, 9), 1.0)))
    assert any(note.startswith("1 curve drawn twice left out: ELLIPSE") for note in circles.notes)


def test_a_curve_of_another_layer_that_ends_on_the_profile_is_no_fork(tmp_path: Path) -> None:
    def centre_line(space: Any) -> None:
        draw_wire(space, attributes={"layer": "PROFILE"})
        space.add_line((30, 0), (30, 20), dxfattribs={"layer": "CENTRE"})

    found = drawn(tmp_path, centre_line)
    require_wire(found.curve)
    assert found.layers == ("PROFILE",)


def test_a_profile_of_two_layers_goes_on_where_nothing_else_ends(tmp_path: Path) -> None:
    def sides(space: Any) -> None:
        space.add_lwpolyline([(0, 0), (40, 0), (40, 30)], dxfattribs={"layer": "A"})
        space.add_lwpolyline([(40, 30), (0, 30), (0, 0)], dxfattribs={"layer": "B"})

    found = drawn(tmp_path, sides)
    assert (found.curve.closed, found.layers) == (True, ("A", "B"))


def test_what_is_hidden_is_left_out_and_said(tmp_path: Path) -> None:
    document = new()
    document.layers.add("OLD").off()
    draw_wire(document.modelspace())
    document.modelspace().add_circle((0, 0), 90, dxfattribs={"layer": "OLD"})
    found = load_nominal(saved(document, tmp_path))
    require_wire(found.curve)
    assert "left out: 1 hidden CIRCLE" in found.notes


def test_a_curve_that_is_not_plane_is_refused_with_its_height(tmp_path: Path) -> None:
    points = [(0, 0, 0), (40, 0, 0), (40, 30, 0), (0, 30, 0.5)]
    said = refusal(tmp_path, lambda space: space.add_polyline3d(points, close=True))
    assert said.startswith("the curve is not plane: it leaves its plane by 0.1")
    flat = drawn(tmp_path, lambda space: space.add_polyline3d([(x, y, 12.5) for x, y, _ in points], close=True))
    assert flat.plane is not None
    assert flat.plane.origin_mm.tolist() == [0, 0, 12.5]
    assert flat.curve.length_mm == pytest.approx(140, abs=1e-12)


def test_a_drawing_as_large_as_a_county_or_as_small_as_dust_has_another_unit(tmp_path: Path) -> None:
    assert "look at the unit of the drawing" in refusal(tmp_path, lambda space: draw_wire(space, 10.0), 6, scale=1e5)
    assert "look at the unit of the drawing" in refusal(tmp_path, draw_wire, 8)


def test_the_choice_of_a_curve_belongs_to_drawings(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("0 0\n1 0\n1 1\n0 1\n", encoding="ascii")
    with pytest.raises(NominalError, match="holds one curve; expected no layer"):
        load_nominal(tmp_path / "a.csv", layer="X")
