"""Bad CAD files, forty kinds and more: one clear sentence each that names the file, and nothing printed by a library."""

import io
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from cmmlink.nominal_files import load_nominal
from drivers.cad import OcctProcess
from inspection import NominalError
from tests.cmmlink.command import cmmlink
from tests.cmmlink.nominal_files.iges_text import MM, Given, iges, numbers, spline_parameters, wire_entities
from tests.cmmlink.nominal_files.test_dxf import new


def dxf(draw: Callable[[Any], Any], release: str = "R2010", units: int = 4) -> str:
    document = new(release, units)
    draw(document.modelspace())
    stream = io.StringIO()
    document.write(stream)
    return stream.getvalue()


def binary(draw: Callable[[Any], Any]) -> bytes:
    document, stream = new(), io.BytesIO()
    draw(document.modelspace())
    document.write(stream, fmt="bin")
    return stream.getvalue()


def circle(space: Any) -> None:
    space.add_circle((0, 0), 10)


def blocks_in_themselves(space: Any) -> None:
    block = space.doc.blocks.new("again")
    block.add_circle((0, 0), 5)
    block.add_blockref("again", (1, 1))
    space.add_blockref("again", (0, 0))


def figure_of_eight(space: Any) -> None:
    space.add_lwpolyline([(0, 0), (20, 10), (20, 0), (0, 10)], close=True)


def skew(space: Any) -> None:
    space.add_polyline3d([(0, 0, 0), (40, 0, 0), (40, 30, 9), (0, 30, 0)], close=True)


def two_circles(space: Any) -> None:
    space.add_circle((0, 0), 10)
    space.add_circle((50, 0), 10)


def broken_line(space: Any) -> None:
    space.add_lwpolyline([(0, 0), (20, 0), (20, 20), (0, 20), (0, 0.1)])


def forked(space: Any) -> None:
    for end in ((20, 0), (0, 20), (-20, -20)):
        space.add_line((0, 0), end)


def no_knots(space: Any) -> None:
    spline = space.add_spline(degree=3)
    spline.control_points = [(0, 0), (10, 10), (20, 0), (30, 10), (40, 0)]
    spline.knots = [0, 0, 0, 1, 1, 1]


def no_weight(space: Any) -> None:
    space.add_rational_spline([(0, 0), (10, 10), (20, 0), (30, 0)], [1, 0, 1, 1], 3)


CIRCLE = dxf(circle)

BAD_DXF: dict[str, tuple[str | bytes, str]] = {
    "nothing": ("", "the file is empty"),
    "blanks": (" \n" * 40, "the file is empty"),
    "a DWG file": (b"AC1032" + bytes(200), "is a DWG file, not DXF"),
    "a picture": (b"\x89PNG\r\n\x1a\n" + bytes(range(256)), "is no DXF drawing"),
    "words": ("This is a letter.\nNot a drawing.\n", "is no DXF drawing"),
    "STEP by another name": ("ISO-10303-21;\nHEADER;\nENDSEC;\nEND-ISO-10303-21;\n", "is no DXF drawing"),
    "cut off in its header": (CIRCLE[:900], r"has no end \(EOF\)"),
    "cut off in its entities": (CIRCLE[: CIRCLE.index("\nCIRCLE\n") + 60], r"has no end \(EOF\)"),
    "a number that is none": (CIRCLE.replace("\n10.0\n", "\nten\n"), "is no DXF drawing that can be read: Invalid tag"),
    "an infinite number": (CIRCLE.replace("\n10.0\n", "\ninf\n"), "is damaged: invalid value|holds a number that is not finite"),
    "a binary drawing cut off": (binary(circle)[:-3000], r"has no end \(EOF\)"),
    "no curve": (dxf(lambda space: space.add_text("blade 7")), "holds no curve; .*left out: 1 TEXT"),
    "an endless line": (dxf(lambda space: space.add_xline((0, 0), (1, 1))), "holds no curve; .*1 XLINE"),
    "no unit": (dxf(circle, units=0), "states no unit"),
    "a unit of the stars": (dxf(circle, units=19), r"parts are not drawn in \(\$INSUNITS 19\)"),
    "release 12": (dxf(circle, "R12"), "a drawing of release 12 that states no unit"),
    "two profiles": (dxf(two_circles), "holds 2 closed curves; expected nominal.layer or nominal.curve"),
    "a gap": (dxf(broken_line), "a gap of 0.1 mm between"),
    "a fork": (dxf(forked), r"ends in a fork at \(0, 0\)"),
    "a curve that is not plane": (dxf(skew), "the curve is not plane: it leaves its plane by"),
    "a curve that crosses itself": (dxf(figure_of_eight), "the curve crosses or touches itself at"),
    "a spline with too few knots": (dxf(no_knots), "SPLINE .* on layer 0: 6 knots; expected 9 for 5 control points of degree 3"),
    "a spline with a weight of zero": (dxf(no_weight), "SPLINE .* on layer 0: a weight of 0; expected positive weights"),
    "blocks that hold themselves": (dxf(blocks_in_themselves), "has blocks in blocks, more than 12 deep"),
}

CIRCLE_IGES = [Given(100, numbers(0, 0, 0, 9, 0, 9, 0))]
WIRE = iges(wire_entities())
CUBIC = ([0, 0, 0, 0, 1, 1, 1, 1], [1, 1, 1, 1], [(0.0, 0.0), (10.0, 9.0), (20.0, 9.0), (30.0, 0.0)])

BAD_IGES: dict[str, tuple[str | bytes, str]] = {
    "nothing": (" " * 80, "the file is empty"),
    "words": ("This is a letter.\n", "line 1: 'This is a letter.' is no line of IGES"),
    "the compressed form": ("".ljust(72) + "C      1\n" + WIRE, "compressed or binary form"),
    "no last line": (iges(CIRCLE_IGES, last_line=False), r"has no last line \(T\)"),
    "only its beginning": (WIRE[:81], "has no global section"),
    "cut off in its parameters": ("".join(WIRE.splitlines(keepends=True)[:-4]), r"has no last line \(T\)"),
    "a line of parameters lost": (
        "".join(line for i, line in enumerate(WIRE.splitlines(keepends=True)) if i != 19),
        "where the last line announces",
    ),
    "no end of a record": (iges(CIRCLE_IGES, end=""), "a record has no end ';'"),
    "strange delimiters": (iges(CIRCLE_IGES, MM.replace("1H,,1H;", "2H,,,1H;")), "the global section begins with"),
    "a number that is none": (
        WIRE.replace("30.0,0.0,0", "3O.0,0.0,0"),
        r"entity 110 \(D1\): '3O.0' stands for parameter 4; expected a number",
    ),
    "no unit": (iges(CIRCLE_IGES, MM.replace("2,2HMM", ",")), "states no unit"),
    "a model scale": (iges(CIRCLE_IGES, MM.replace(",1.,2,2HMM", ",10.,2,2HMM")), "states a model scale of 10."),
    "an arc with an end off its circle": (iges([Given(100, numbers(0, 0, 0, 9, 0, 0, 8))]), "its end lies -1 off its circle of radius 9"),
    "a conic without points": (iges([Given(104, numbers(1, 0, 1, 0, 0, 1, 0, 1, 0, 0, 1))]), "describe no ellipse"),
    "a spline cut off": (iges([Given(126, "3,3,0,0,1,0,0.,0.,0.,0.,1.,1.")]), "is the file cut off"),
    "knots that fall": (
        iges([Given(126, spline_parameters(3, [0, 0, 0, 0, 1, 1, 0.5, 1], *CUBIC[1:], (0, 1)))]),
        "the knots must not decrease",
    ),
    "a part beyond its range": (
        iges([Given(126, spline_parameters(3, *CUBIC, (0, 2)))]),
        "the used part 0 .. 2 lies outside of the knots 0 .. 1",
    ),
    "a matrix that is none": (iges([Given(110, numbers(0, 0, 0, 1, 1, 0), transform=99)]), "points to an entity D99, which is not there"),
    "a matrix that flattens": (
        iges([Given(110, numbers(0, 0, 0, 1, 1, 0), transform=3), Given(124, numbers(*[0] * 12))]),
        "flattens what it places",
    ),
    "matrices in a ring": (
        iges([Given(110, numbers(0, 0, 0, 1, 1, 0), transform=3), Given(124, numbers(1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0), transform=3)]),
        "do they place one another",
    ),
    "a composite of itself": (iges([Given(102, "1,1"), *CIRCLE_IGES, Given(102, "1,1")]), "do they hold one another"),
    "a composite of what is not there": (iges([Given(102, "1,77")]), "points to an entity D77"),
    "points alone": (iges([Given(116, numbers(1, 2, 3))]), "holds no curve; .*left out: 1 entity 116"),
}

STEP = (
    "ISO-10303-21;\nHEADER;\nFILE_DESCRIPTION((''),'2;1');\nFILE_NAME('','',(''),(''),'','','');\n"
    "FILE_SCHEMA(('AUTOMOTIVE_DESIGN'));\nENDSEC;\nDATA;\n{}\nENDSEC;\nEND-ISO-10303-21;\n"
)
NO_SHAPE = "holds no shape; is it cut off, or does it only point to other files"
POINT = "#1=CARTESIAN_POINT('',(0.,0.,0.));"

BAD_STEP: dict[str, tuple[str | bytes, str]] = {
    "words": ("This is a letter.\n", "does not begin as STEP does"),
    "a compressed file": (b"PK\x03\x04" + bytes(400), "does not begin as STEP does"),
    "cut off": (STEP.format(POINT)[:-20], "has no end"),
    "no data": (STEP.format(""), NO_SHAPE),
    "a point alone": (STEP.format(POINT), NO_SHAPE),
    "garbage between": (STEP.format("#1=((((;#2=$%&;"), NO_SHAPE),
    "entities that point nowhere": (
        STEP.format("#5=MANIFOLD_SOLID_BREP('',#99);#6=ADVANCED_BREP_SHAPE_REPRESENTATION('',(#5),#98);"),
        NO_SHAPE,
    ),
    "an assembly without its parts": (
        STEP.format("#1=PRODUCT('a','a','',(#2));#2=PRODUCT_CONTEXT('',#3,'mechanical');#3=APPLICATION_CONTEXT('x');"),
        NO_SHAPE,
    ),
}


def require_sentence(path: Path, words: str, capfd: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(NominalError, match=f"(?s)^{path}: .*({words})") as refused:
        load_nominal(path)
    said = str(refused.value)
    assert "\n" not in said
    assert len(said) < 700
    assert "Traceback" not in said
    assert capfd.readouterr() == ("", "")


def written(folder: Path, content: str | bytes, name: str) -> Path:
    path = folder / name
    path.write_bytes(content if isinstance(content, bytes) else content.encode("latin-1"))
    return path


@pytest.mark.parametrize("kind", BAD_DXF)
def test_a_bad_dxf_costs_one_sentence(tmp_path: Path, capfd: pytest.CaptureFixture[str], kind: str) -> None:
    content, words = BAD_DXF[kind]
    require_sentence(written(tmp_path, content, "part.dxf"), words, capfd)


@pytest.mark.parametrize("kind", BAD_IGES)
def test_a_bad_iges_costs_one_sentence(tmp_path: Path, capfd: pytest.CaptureFixture[str], kind: str) -> None:
    content, words = BAD_IGES[kind]
    require_sentence(written(tmp_path, content, "part.igs"), words, capfd)


@pytest.mark.parametrize("kind", BAD_STEP)
def test_a_bad_step_costs_one_sentence(occt: OcctProcess, tmp_path: Path, capfd: pytest.CaptureFixture[str], kind: str) -> None:
    content, words = BAD_STEP[kind]
    require_sentence(written(tmp_path, content, "part.step"), words, capfd)


@pytest.mark.parametrize(
    ("name", "content"), [("part.dxf", BAD_DXF["words"][0]), ("part.igs", BAD_IGES["no unit"][0]), ("part.dxf", BAD_DXF["a fork"][0])]
)
def test_a_bad_file_does_not_spoil_the_json(tmp_path: Path, name: str, content: str | bytes) -> None:
    path = written(tmp_path, content, name)
    ended = cmmlink("nominal", path, "--json")
    assert ended.code == 2
    assert json.loads(ended.out)["error"]["message"].startswith(f"{path}: ")
