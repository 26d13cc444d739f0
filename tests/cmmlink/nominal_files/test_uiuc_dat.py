"""UIUC dat files: every form gives the same loop, and the notes say what was understood."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from cmmlink.nominal_files import load_nominal, material_side
from inspection import NominalError, NurbsCurve
from tests.cmmlink.nominal_files.shapes import LOOP, LOWER, UPPER, read_or_refuse, reference, rows, same_curve, write_text
from tests.inspection import profiles

DAT = {
    "title": "NACA 0012\n" + rows(LOOP),
    "no title": rows(LOOP),
    "title of one number": "0012\n" + rows(LOOP),
    "title of two numbers": "63 215\n" + rows(LOOP),
    "title of three numbers": "16 0.12 3\n" + rows(LOOP),
    "title with a number first": "18% thick\n" + rows(LOOP),
    "flow grid": "NACA 0012\n-2.0 3.0 -2.5 3.0\n" + rows(LOOP),
    "blank line in the loop": "NACA 0012\n" + rows(UPPER[::-1]) + "\n" + rows(LOWER[1:]),
    "separator at the end": "NACA 0012\n" + rows(LOOP) + "999.0 999.0\n",
    "commas": "NACA 0012\n" + rows(LOOP, "{:.17g}, {:.17g}"),
    "carriage returns and end mark": ("NACA 0012\n" + rows(LOOP)).replace("\n", "\r\n") + "\x1a",
    "first point with exponents D": rows(LOOP[:1], "{:.16e} {:.16e}").replace("e", "D") + rows(LOOP[1:]),
    "all points with exponents D": rows(LOOP, "{:.16e} {:.16e}").replace("e", "d"),
    "first point with a remark": rows(LOOP[:1], "{:.17g} {:.17g} # trailing edge") + rows(LOOP[1:]),
    "every point with a remark": rows(LOOP, "{:.17g} {:.17g} ! x y"),
    "decimal commas": rows(LOOP).replace(".", ","),
    "decimal commas and semicolons": rows(LOOP, "{:.17g};{:.17g}").replace(".", ","),
    "tabs and empty columns": "NACA 0012\t\t\n" + rows(LOOP, "{:.17g}\t{:.17g}\t\t"),
    "tabs in some lines": "NACA 0012\n" + rows(LOOP[:30]) + rows(LOOP[30:], "{:.17g}\t{:.17g}"),
    "source behind": "NACA 0012\n" + rows(LOOP) + "source: made up\n",
    "address and date behind": "NACA 0012\n" + rows(LOOP) + "\nhttp://example.org/a/b.html\n26/10/2001\n\n",
    "percentages behind": "NACA 0012\n" + rows(LOOP) + "Dicke(d): 12,0 %\nDickenruecklage: 30,0 %\n7.83 % of something\n",
    "thickness and camber behind": "NACA 0012\n" + rows(LOOP) + "12.0 3.5\n",
    "three rows far behind": "NACA 0012\n" + rows(LOOP) + "12.0 30.0\n3.5 40\n-8 0.1\n",
    "Lednicer, thickness and camber behind": "NACA 0012\n41. 41.\n\n" + rows(UPPER) + "\n" + rows(LOWER) + "12.0 3.5\n",
    "Lednicer, exponents D": "NACA 0012\n4.1D1 4.1D1\n\n" + rows(UPPER) + "\n" + rows(LOWER),
    "Lednicer": "NACA 0012\n41. 41.\n\n" + rows(UPPER) + "\n" + rows(LOWER),
    "Lednicer, one blank line": "NACA 0012\n41 41\n" + rows(UPPER) + "\n" + rows(LOWER),
    "Lednicer, counts alone": "NACA 0012\n41.0 41.0\n" + rows(UPPER) + rows(LOWER),
    "Lednicer, no counts": "NACA 0012\n" + rows(UPPER) + "\n" + rows(LOWER),
    "Lednicer, nothing between": "NACA 0012\n" + rows(UPPER) + rows(LOWER),
    "Lednicer, separators": "NACA 0012\n" + rows(UPPER) + "999.0 999.0\n" + rows(LOWER) + "999. 999.\n",
    "Lednicer, upper side reversed": "NACA 0012\n41 41\n\n" + rows(UPPER[::-1]) + "\n" + rows(LOWER),
    "Lednicer, lower side reversed": "NACA 0012\n41 41\n\n" + rows(UPPER) + "\n" + rows(LOWER[::-1]),
    "Lednicer, title of two numbers": "63 215\n41 41\n\n" + rows(UPPER) + "\n" + rows(LOWER),
    "Lednicer, no title": "41 41\n\n" + rows(UPPER) + "\n" + rows(LOWER),
}


@pytest.mark.parametrize("form", DAT)
def test_every_form_of_dat_gives_the_same_loop(tmp_path: Path, form: str) -> None:
    nominal = load_nominal(write_text(tmp_path, DAT[form], "naca.dat"), scale=100.0)
    assert nominal.source_format == ("uiuc-lednicer" if form.startswith("Lednicer") else "uiuc-selig")
    same_curve(nominal.curve, reference(LOOP))
    assert material_side(nominal.curve) == "left"


def test_counts_in_millimetres_are_counts(tmp_path: Path) -> None:
    text = "NACA 0012\n41 41\n\n" + rows(UPPER * 100) + "\n" + rows(LOWER * 100)
    same_curve(load_nominal(write_text(tmp_path, text, "naca.dat")).curve, reference(LOOP))


def test_dat_notes_say_what_was_understood(tmp_path: Path) -> None:
    def notes(form: str, scale: float = 100.0) -> tuple[str, ...]:
        return load_nominal(write_text(tmp_path, DAT[form], "naca.dat"), scale).notes

    x, y = UPPER[-2]
    turn = 180 - 2 * np.degrees(np.arctan2(y, 1 - x))
    edge = f"closed: the last point repeats the first, a corner of {turn:.0f} deg kept there (sharp trailing edge)"
    assert notes("title") == ("title: NACA 0012", edge)
    assert notes("no title", scale=1.0) == ("no scale given: a chord of 1 is taken as 1 mm", edge)
    assert notes("title of two numbers") == ("line 1: '63 215' lies far from the points: taken as the title", edge)
    assert notes("flow grid")[1] == "line 2: 4 numbers, the limits of a flow grid, left out"
    assert notes("Lednicer, upper side reversed")[1] == "the first side is given from the trailing edge: turned round"


def test_what_stands_around_the_points_is_noted(tmp_path: Path) -> None:
    def notes(form: str) -> tuple[str, ...]:
        return load_nominal(write_text(tmp_path, DAT[form], "naca.dat"), 100.0).notes

    assert not any("title" in note for note in notes("first point with exponents D") + notes("first point with a remark"))
    assert "decimal commas" in notes("decimal commas")
    assert "line 83, behind the last point, left out: 'source: made up'" in notes("source behind")
    assert "lines 84 to 85, behind the last point, left out: 'http://example.org/a/b.html'" in notes("address and date behind")
    assert "line 83: '12 3.5' lies far from all points, behind the last: left out" in notes("thickness and camber behind")
    assert "line 83: '12 30', line 84: '3.5 40', line 85: '-8 0.1' lie far from all points, behind the last: left out" in notes(
        "three rows far behind"
    )


HALF = rows(LOOP[:40])
NOT_LEFT_OUT = {
    "a damaged last row": ("t\n" + rows(LOOP) + "0.99 0.OO1\n", "line 83: '0.OO1' is not a number"),
    "half a last row": ("t\n" + rows(LOOP) + "0.99\n", "line 83: 1 column, line 2 has 2"),
    "a last point with a name": ("t\n" + rows(LOOP[:-1]) + "1.0 0.0 TE\n", "line 82: 'TE' is not a number"),
    "a first point in brackets": ("(1.0, 0.0)\n" + rows(LOOP[1:]), "line 1: begins with 1 0, which may be the first point"),
    "a first point with units": ("1.0mm 0.0mm\n" + rows(LOOP[1:]), "line 1: begins with 1 0, which may be the first point"),
    "a first point with letters": ("1.0f 0.0f;\n" + rows(LOOP[1:]), "line 1: begins with 1 0, which may be the first point"),
    "a first point with a name": ("1.0 0.0 TE\n" + rows(LOOP[1:]), "line 1: begins with 1 0, which may be the first point"),
    "a damaged row": ("t\n" + HALF + "0.5 o.1\n" + rows(LOOP[40:]), "line 42: 'o.1' is not a number"),
    "a slip of the point": ("t\n" + HALF + "5.0 0.1\n" + rows(LOOP[40:]), "line 42: 5 0.1 lies far from all other points"),
    "a polar": (
        "t\n" + rows(LOOP) + "\nalpha cl\n" + "".join(f"{a} {0.1 * a:.2f}\n" for a in range(-4, 9)),
        "line 84: 'alpha cl' begins a second block of numbers (13 rows from line 85 on); expected one profile in a file: "
        "move the block to a file of its own, or begin its lines with #",
    ),
    "another profile": (
        "one\n" + rows(LOOP) + "two\n" + rows(LOOP),
        "line 83: 'two' begins a second block of numbers (81 rows from line 84 on)",
    ),
}


@pytest.mark.parametrize("case", NOT_LEFT_OUT)
def test_what_may_be_a_point_is_never_left_out(tmp_path: Path, case: str) -> None:
    content, message = NOT_LEFT_OUT[case]
    with pytest.raises(NominalError) as caught:
        load_nominal(write_text(tmp_path, content, "naca.dat"), 100.0)
    assert message in str(caught.value)


DAT_LINES = [
    "NACA 0012",
    "63 215",
    "41 41",
    "3 2",
    "2 2",
    "",
    "999 999",
    "1 0",
    "0.5 0.1",
    "0 0",
    "0.5 -.1",
    "1 1e-3",
    "0.9 nan",
    "1 2 3",
    "-2 3 -2 3",
    "x",
    "1e6 -1e6",
]


@settings(max_examples=100, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    content=st.one_of(
        st.binary(max_size=60), st.lists(st.sampled_from(DAT_LINES), max_size=14).map(lambda lines: "\n".join(lines).encode())
    ),
    suffix=st.sampled_from([".dat", ".csv"]),
    closed=st.sampled_from([None, True, False]),
)
def test_hostile_dat_and_points_are_read_or_refuse(tmp_path: Path, content: bytes, suffix: str, closed: bool | None) -> None:
    read_or_refuse(write_text(tmp_path, content, "a" + suffix), closed=closed)


def test_airfoil_files_become_the_profiles_of_the_tests() -> None:
    """All files beside the checkout, by the reader of the inspection tests, which shares no line with ours."""
    if not profiles.AIRFOILS.is_dir():
        pytest.skip(f"no airfoil coordinates at {profiles.AIRFOILS}: they may not be shipped")
    files = sorted(profiles.AIRFOILS.glob("*.dat"))
    assert len(files) >= 14
    for file in files:
        nominal = load_nominal(file, scale=100.0)
        points = np.loadtxt(file, skiprows=1) * 100
        sharp = bool(np.array_equal(points[0], points[-1]))
        assert nominal.curve.closed
        assert nominal.source_format == "uiuc-selig"
        if sharp:
            same_curve(nominal.curve, NurbsCurve.interpolate(points, closed=True, corner_at_seam=True))
        same_curve(load_nominal(file, scale=100.0, closed=False).curve, NurbsCurve.interpolate(points))
        assert len(nominal.curve.corners) == 1 if sharp else 2
        assert sum("blunt trailing edge" in note for note in nominal.notes) == int(not sharp)
        assert material_side(nominal.curve) == "left"
        assert not any("turn by" in note for note in nominal.notes)
