"""IGES: files by hand with the traps that real ones hold; what OCCT writes is in test_step.py."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cmmlink.nominal_files import NominalFile, load_nominal
from inspection import NominalError, NurbsCurve
from tests.cmmlink.nominal_files.iges_text import MM, Given, iges, numbers, spline_parameters, wire_entities
from tests.cmmlink.nominal_files.wire import require_wire


def read(folder: Path, text: str, **asked: Any) -> NominalFile:
    path = folder / "part.igs"
    path.write_bytes(text.encode("latin-1"))
    return load_nominal(path, **asked)


def refusal(folder: Path, text: str, **asked: Any) -> str:
    with pytest.raises(NominalError) as refused:
        read(folder, text, **asked)
    assert "\n" not in str(refused.value)
    return str(refused.value).removeprefix(f"{folder / 'part.igs'}: ")


def test_a_wire_comes_back_exact(tmp_path: Path) -> None:
    found = read(tmp_path, iges(wire_entities(level=7)))
    require_wire(found.curve)
    assert (found.source_format, found.layers) == ("iges", ("7",))
    assert found.notes[0] == "unit of the file: mm (unit flag 2)"


def test_numbers_as_fortran_spells_them_other_delimiters_and_empty_parameters(tmp_path: Path) -> None:
    entities = [Given(one.kind, one.parameters.replace(",", "/").replace("e-", "D-"), one.form, status="") for one in wire_entities()]
    settings = MM.replace("1H,,1H;,4Hpart", "1H/,1H$,9Ha,b;c/d$e").replace(",", "/").replace("1H//1H$/9Ha/b;c/d$e", "1H//1H$/9Ha,b;c/d$e")
    require_wire(read(tmp_path, iges(entities, settings.replace("15H20261127.120000;", "15H20261127.120000$"), end="$")).curve)
    found = read(tmp_path, iges([Given(110, ",,,30.,.0D0,-0.0"), Given(110, "30.,0,0,3.D1,2D+1,"), Given(110, "30,20,0,0,0,0")]))
    assert found.curve.length_mm == pytest.approx(50 + np.hypot(30, 20), abs=1e-12)


def test_a_composite_counts_its_children_once_and_a_matrix_places_them(tmp_path: Path) -> None:
    children = wire_entities(status="00010000")
    turned = numbers(0, -1, 0, 5, 1, 0, 0, 6, 0, 0, 1, 0)  # by a quarter, then by (5, 6)
    twice = numbers(2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 2, 0)
    pointers = ",".join(str(2 * i + 1) for i in (0, 2, 3, 4, 1))
    entities = [*children, Given(102, f"5,{pointers}", transform=13), Given(124, turned, transform=15), Given(124, twice)]
    found = read(tmp_path, iges(entities))
    points = (found.curve.control_points_mm - [10, 12]) @ np.array([[0, -1], [1, 0]])
    back = NurbsCurve(found.curve.degree, points, found.curve.knots, found.curve.weights, closed=True)
    require_wire(back, 2.0)
    group = [*wire_entities(status="00020000"), Given(402, f"5,{pointers}", form=7)]
    require_wire(read(tmp_path, iges(group)).curve)


def test_a_mirroring_matrix_mirrors_and_one_out_of_the_plane_brings_the_plane(tmp_path: Path) -> None:
    entities = [Given(one.kind, one.parameters, one.form, transform=11) for one in wire_entities()]
    mirrored = read(tmp_path, iges([*entities, Given(124, numbers(-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0), form=1)])).curve
    assert mirrored.weights is not None
    poles, knots, weights = mirrored.control_points_mm[::-1] * [-1, 1], -mirrored.knots[::-1], mirrored.weights[::-1]
    require_wire(NurbsCurve(mirrored.degree, poles, knots, weights, closed=True))
    upright = read(tmp_path, iges([*entities, Given(124, numbers(1, 0, 0, 0, 0, 0, -1, 40, 0, 1, 0, 0))]))
    assert upright.plane is not None
    np.testing.assert_allclose(upright.plane.normal, [0, -1, 0], atol=1e-12)
    np.testing.assert_allclose(upright.plane.origin_mm, [0, 40, 0], atol=1e-12)
    require_wire(upright.curve)


def test_a_spline_is_cut_to_the_part_that_is_used(tmp_path: Path) -> None:
    """A parabola y = x^2 / 10 as a Bezier curve over 0 .. 30, of which the ends 6 .. 24 are used."""
    points = [(0.0, 0.0), (15.0, 0.0), (30.0, 90.0)]
    text = iges([Given(126, spline_parameters(2, [0, 0, 0, 1, 1, 1], [2, 2, 2], points, (0.2, 0.8)))])
    curve = read(tmp_path, text).curve
    drawn = curve.point(np.linspace(*curve.domain, 50))
    np.testing.assert_allclose(drawn[:, 1], drawn[:, 0] ** 2 / 10, atol=1e-12)
    np.testing.assert_allclose(drawn[[0, -1], 0], [6, 24], atol=1e-12)


def test_conics_of_every_kind(tmp_path: Path) -> None:
    """A turned ellipse, a parabola and a hyperbola: every point fulfils its equation, and the ends are the ends."""
    turn = 0.7
    c, s = np.cos(turn), np.sin(turn)
    form = np.array([[c, -s], [s, c]]) @ np.diag([1 / 900, 1 / 100]) @ np.array([[c, s], [-s, c]])
    ends = (np.array([[c, -s], [s, c]]) @ np.array([[30, 30 * np.cos(2.0)], [0, 10 * np.sin(2.0)]])).T
    cases = [
        ((form[0, 0], 2 * form[0, 1], form[1, 1], 0, 0, -1), ends, 1),
        ((0.1, 0, 0, 0, -1, 0), np.array([[-4.0, 1.6], [20.0, 40.0]]), 3),
        ((1, 0, -1, 0, 0, -100), np.array([[np.hypot(10, 3), 3.0], [np.hypot(10, 30), 30.0]]), 2),
    ]
    for coefficients, (start, end), kind in cases:
        curve = read(tmp_path, iges([Given(104, numbers(*coefficients, 0, *start, *end), form=kind)])).curve
        x, y = curve.point(np.linspace(*curve.domain, 200)).T
        value = np.stack([x * x, x * y, y * y, x, y, np.ones(200)]).T @ np.array(coefficients)
        np.testing.assert_allclose(value, 0, atol=1e-10 * max(1, abs(coefficients[5])))
        np.testing.assert_allclose(curve.point(np.array(curve.domain)), [start, end], atol=1e-11)


def test_circles_polylines_and_what_is_no_profile(tmp_path: Path) -> None:
    circle = Given(100, numbers(0, 1, 2, 6, 2, 6, 2), level=1)
    path = Given(106, "2,4,0,0,0,9,0,0,9,9,0,0,0,0", form=12, level=2)
    closed = Given(106, "1,4,5.,20,0,29,0,29,9,20,9", form=63, level=3)
    ray, hidden = Given(110, numbers(0, 0, 0, 1, 0, 0), form=1), Given(110, numbers(0, 0, 0, 1, 1, 0), status="01000000")
    note = Given(212, "1,2,1.,1.,1,1.57,0.,0,0,0.,0.,0.,2Hhi", status="00000100")
    text = iges([circle, path, closed, ray, hidden, note])
    one = read(tmp_path, text, layer="1")
    assert one.curve.length_mm == pytest.approx(10 * np.pi, abs=1e-12)
    assert "left out: 1 annotation entity, 1 entity 110 of form 1 or without length, 1 hidden entity" in one.notes
    assert read(tmp_path, text, layer="2").curve.length_mm == pytest.approx(18 + np.hypot(9, 9), abs=1e-12)
    up = read(tmp_path, text, layer="3")
    assert up.plane is not None
    assert up.curve.length_mm == pytest.approx(36, abs=1e-12)
    assert up.plane.origin_mm.tolist() == [0, 0, 5]


@pytest.mark.parametrize(
    ("flag", "name", "mm"), [(1, "2HIN", 25.4), (6, "1HM", 1000.0), (3, "2HMM", 1.0), (3, "4HINCH", 25.4), (10, "2HCM", 10.0), (2, "", 1.0)]
)
def test_the_unit_is_that_of_the_flag_or_for_flag_3_of_the_name(tmp_path: Path, flag: int, name: str, mm: float) -> None:
    text = iges([Given(100, numbers(0, 0, 0, 1, 0, 1, 0))], MM.replace("2,2HMM", f"{flag},{name}"))
    assert read(tmp_path, text).curve.length_mm == pytest.approx(2 * np.pi * mm, rel=1e-12)


def test_a_unit_that_is_not_sure_is_said_or_asked_for(tmp_path: Path) -> None:
    circle = [Given(100, numbers(0, 0, 0, 1, 0, 1, 0))]
    contrary = read(tmp_path, iges(circle, MM.replace("2,2HMM", "1,2HMM")))
    assert contrary.notes[0] == "unit of the file: inch (unit flag 1, although its name is MM)"
    scaled = iges(circle, MM.replace(",1.,2,2HMM", ",0.5,2,2HMM"))
    assert refusal(tmp_path, scaled).startswith(
        "states a model scale of 0.5, which some programs apply and others do not; expected the unit"
    )
    assert read(tmp_path, scaled, unit="mm").curve.length_mm == pytest.approx(2 * np.pi)
    assert refusal(tmp_path, iges(circle, MM.replace("2,2HMM", ","))).startswith("states no unit; expected the unit of the drawing")
    assert refusal(tmp_path, iges(circle, MM.replace("2,2HMM", "12,2HAU"))).startswith(
        "states a unit that is not known (flag 12, name 'AU')"
    )
