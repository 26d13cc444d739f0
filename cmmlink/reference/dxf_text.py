"""A nominal as DXF of AutoCAD 2000 (AC1015): one SPLINE in model space, with the tables and blocks that strict readers ask for."""

from collections.abc import Iterable

from cmmlink.reference.case import CaseUnit, ReferenceNominal
from cmmlink.reference.real_numbers import real, weights_of

Group = tuple[int, str | int | float]

_UNITS = {"inch": 1, "mm": 4}  # $INSUNITS
_CLOSED, _RATIONAL, _PLANAR = 1, 4, 8  # flags of a SPLINE
_TABLES = ("VPORT", "LTYPE", "LAYER", "STYLE", "VIEW", "UCS", "APPID", "DIMSTYLE", "BLOCK_RECORD")
_MODEL_SPACE, _PAPER_SPACE, _ROOT, _SPLINE = "20", "21", "30", "40"  # handles
_RECORDS: dict[str, list[tuple[str, list[Group]]]] = {
    "LTYPE": [
        (handle, [(100, "AcDbLinetypeTableRecord"), (2, name), (70, 0), (3, ""), (72, 65), (73, 0), (40, 0.0)])
        for handle, name in (("12", "ByBlock"), ("13", "ByLayer"), ("14", "Continuous"))
    ],
    "LAYER": [("15", [(100, "AcDbLayerTableRecord"), (2, "0"), (70, 0), (62, 7), (6, "Continuous")])],
    "STYLE": [
        (
            "16",
            [
                (100, "AcDbTextStyleTableRecord"),
                (2, "Standard"),
                (70, 0),
                (40, 0.0),
                (41, 1.0),
                (50, 0.0),
                (71, 0),
                (42, 2.5),
                (3, "txt"),
                (4, ""),
            ],
        )
    ],
    "APPID": [("17", [(100, "AcDbRegAppTableRecord"), (2, "ACAD"), (70, 0)])],
    "BLOCK_RECORD": [
        (handle, [(100, "AcDbBlockTableRecord"), (2, name)])
        for handle, name in ((_MODEL_SPACE, "*Model_Space"), (_PAPER_SPACE, "*Paper_Space"))
    ],
}


def dxf_text(nominal: ReferenceNominal, unit: CaseUnit) -> str:
    """The text of the file."""
    header: list[Group] = [(9, "$ACADVER"), (1, "AC1015"), (9, "$HANDSEED"), (5, "FFFF"), (9, "$INSUNITS"), (70, _UNITS[unit])]
    sections: list[tuple[str, list[Group]]] = [
        ("HEADER", header),
        ("CLASSES", []),
        ("TABLES", [group for number, name in enumerate(_TABLES) for group in _table(number, name)]),
        ("BLOCKS", [*_block("50", _MODEL_SPACE, "*Model_Space"), *_block("52", _PAPER_SPACE, "*Paper_Space")]),
        ("ENTITIES", list(_spline(nominal))),
        ("OBJECTS", [(0, "DICTIONARY"), (5, _ROOT), (330, 0), (100, "AcDbDictionary"), (281, 1)]),
    ]
    groups: list[Group] = []
    for name, content in sections:
        groups += [(0, "SECTION"), (2, name), *content, (0, "ENDSEC")]
    return "".join(f"{code:>3}\n{real(value) if isinstance(value, float) else value}\n" for code, value in [*groups, (0, "EOF")])


def _table(number: int, name: str) -> Iterable[Group]:
    records = _RECORDS.get(name, [])
    handle = f"{number + 1:X}"
    yield from ((0, "TABLE"), (2, name), (5, handle), (330, 0), (100, "AcDbSymbolTable"), (70, len(records)))
    if name == "DIMSTYLE":
        yield from ((100, "AcDbDimStyleTable"), (71, 0))
    for own, content in records:
        yield from ((0, name), (5, own), (330, handle), (100, "AcDbSymbolTableRecord"), *content)
    yield (0, "ENDTAB")


def _block(handle: str, record: str, name: str) -> Iterable[Group]:
    entity: tuple[Group, ...] = ((100, "AcDbEntity"), (8, "0"))
    yield from ((0, "BLOCK"), (5, handle), (330, record), *entity, (100, "AcDbBlockBegin"), (2, name), (70, 0))
    yield from ((10, 0.0), (20, 0.0), (30, 0.0), (3, name), (1, ""))
    yield from ((0, "ENDBLK"), (5, f"{int(handle, 16) + 1:X}"), (330, record), *entity, (100, "AcDbBlockEnd"))


def _spline(nominal: ReferenceNominal) -> Iterable[Group]:
    rational = nominal.weights is not None
    flags = _CLOSED * nominal.closed + _RATIONAL * rational + _PLANAR
    counts = ((70, flags), (71, nominal.degree), (72, len(nominal.knots)), (73, len(nominal.control_points)), (74, 0))
    yield from ((0, "SPLINE"), (5, _SPLINE), (330, _MODEL_SPACE), (100, "AcDbEntity"), (8, "0"), (100, "AcDbSpline"))
    yield from ((210, 0.0), (220, 0.0), (230, 1.0), *counts, (42, 1e-9), (43, 1e-9))
    yield from ((40, float(knot)) for knot in nominal.knots)
    for (x, y), weight in zip(nominal.control_points, weights_of(nominal), strict=True):
        yield from ((10, float(x)), (20, float(y)), (30, 0.0))
        if rational:
            yield (41, float(weight))
