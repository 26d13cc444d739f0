"""Curves of QIF 3 as nominals: the wire comes back exact in its unit, and what is left out or assumed is said."""

from pathlib import Path

import pytest

from cmmlink.nominal_files import load_nominal
from inspection import NominalError
from tests.cmmlink.nominal_files.wire import POLES, WEIGHTS, require_wire

ASSUMED = "control points of rational splines are taken as they stand, not multiplied by their weights"
QIF = "http://qifstandards.org/xsd/qif3"


def document(curves: str, unit: str = "<UnitName>mm</UnitName><UnitConversion><Factor>0.001</Factor></UnitConversion>") -> str:
    units = f"<FileUnits><PrimaryUnits><LinearUnit><SIUnitName>meter</SIUnitName>{unit}</LinearUnit></PrimaryUnits></FileUnits>"
    return (
        f'<QIFDocument xmlns="{QIF}" versionQIF="3.0.0" idMax="99">{units}'
        f'<Product><GeometrySet><Curve13Set n="5">{curves}</Curve13Set></GeometrySet></Product></QIFDocument>'
    )


def segment(number: int, start: str, end: str) -> str:
    ends = f"<StartPoint>{start}</StartPoint><EndPoint>{end}</EndPoint>"
    return f'<Segment13 id="{number}"><Segment13Core domain="0 1">{ends}</Segment13Core></Segment13>'


def nurbs(number: int, order: int, knots: str, points: list[tuple[float, float]], weights: list[float], domain: str = "0 1") -> str:
    told = " ".join(f"{x!r} {y!r} 0" for x, y in points)
    arrays = f'<Knots count="{len(knots.split())}">{knots}</Knots><CPs count="{len(points)}">{told}</CPs>'
    arrays += f'<Weights count="{len(weights)}">{" ".join(map(repr, weights))}</Weights>'
    return f'<Nurbs13 id="{number}"><Nurbs13Core domain="{domain}"><Order>{order}</Order>{arrays}</Nurbs13Core></Nurbs13>'


R = 0.5**0.5
HALF = [(30.0, 0.0), (40.0, 0.0), (40.0, 10.0), (40.0, 20.0), (30.0, 20.0)]
QUARTER = [(10.0, 22.0), (0.0, 22.0), (0.0, 11.0)]
WIRE = [
    segment(1, "0 0 0", "30 0 0"),
    nurbs(2, 3, "0 0 0 0.5 0.5 1 1 1", HALF, [1.0, R, 1.0, R, 1.0]),
    nurbs(3, 4, "0 0 0 0 1 1 1 1", [(x, y) for x, y in POLES], list(WEIGHTS)),
    nurbs(4, 3, "0 0 0 1 1 1", QUARTER, [1.0, R, 1.0]),
    segment(5, "0 11 0", "0 0 0"),
]


def written(folder: Path, text: str) -> Path:
    path = folder / "part.qif"
    path.write_text(text, encoding="utf-8")
    return path


def test_a_wire_comes_back_exact_in_its_unit(tmp_path: Path) -> None:
    found = load_nominal(written(tmp_path, document("".join(WIRE))))
    require_wire(found.curve)
    assert (found.source_format, found.notes[:2]) == ("qif-3", ("unit of the file: mm", ASSUMED))
    inch = "<UnitName>inch</UnitName><UnitConversion><Factor>0.0254</Factor></UnitConversion>"
    require_wire(load_nominal(written(tmp_path, document("".join(WIRE), inch))).curve, 25.4)


def test_what_is_left_out_is_said_and_a_spline_is_cut_to_its_domain(tmp_path: Path) -> None:
    longer = nurbs(2, 2, "0 0 1 2 2", [(0.0, 0.0), (10.0, 0.0), (20.0, 30.0)], [1.0, 1.0, 1.0], "0 1")
    placed = segment(8, "0 0 0", "9 9 9").replace("</Segment13>", "<Transform><Id>1</Id></Transform></Segment13>")
    beside = f'<ArcCircular13 id="7"/>{placed}'
    found = load_nominal(written(tmp_path, document(longer + beside)))
    assert found.curve.length_mm == pytest.approx(10.0, abs=1e-12)
    assert any("left out: 1 ArcCircular13" in note and "Segment13 with a transform" in note for note in found.notes)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("<QIFDocument", "is no XML that can be read"),
        ("<a/>", "begins with 'a'; expected a QIFDocument"),
        (document(""), "holds no curve"),
        (document(WIRE[0], "<UnitName>parsec</UnitName>"), "states the unit 'parsec' without its conversion to metres"),
        (document(segment(1, "0 0 0", "30 0")), "curve 1: EndPoint: 2 numbers; expected three for each point"),
        (document(segment(1, "0 0 0", "30 0 x")), "curve 1: EndPoint: 'x'; expected a finite number"),
        (document(WIRE[2].replace("<Order>4</Order>", "")), "curve 3: has no Order"),
        (document(WIRE[2].replace("0 0 0 0 1 1 1 1", "0 0 0 1 1 1")), "curve 3: "),
        (document(WIRE[2].replace('domain="0 1"', 'domain="0"')), "curve 3: domain is '0'; expected two parameters"),
    ],
)
def test_a_bad_document_costs_one_sentence(tmp_path: Path, text: str, words: str) -> None:
    path = written(tmp_path, text)
    with pytest.raises(NominalError) as refused:
        load_nominal(path)
    assert str(refused.value).startswith(f"{path}: ")
    assert words in str(refused.value)
    assert "\n" not in str(refused.value)
