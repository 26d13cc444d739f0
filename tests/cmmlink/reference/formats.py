"""The drawings of a written reference case hold the numbers of its YAML file: read from their text, by nothing of ours."""

import re
from decimal import Decimal
from pathlib import Path

import yaml

Numbers = list[Decimal]


def check_formats(folder: Path, unit: str) -> None:
    """DXF, IGES and STEP hold degree, knots, control points and weights of the YAML file, in the unit of the case."""
    nominal = yaml.load((folder / "nominal.yaml").read_text(encoding="ascii"), yaml.BaseLoader)
    mm = Decimal("25.4") if unit == "inch" else Decimal(1)
    knots = [Decimal(knot) for knot in nominal["knots"]]
    points = [Decimal(value) / mm for point in nominal["control_points_mm"] for value in point]
    weights = [Decimal(weight) for weight in nominal.get("weights", ["1"] * (len(points) // 2))]
    for name, read in (("nominal.dxf", _dxf), ("nominal.igs", _iges), ("nominal.step", _step)):
        degree, *found = read((folder / name).read_text(encoding="ascii"), unit)
        assert degree == int(nominal["degree"]), name
        for there, expected in zip(found, (knots, points, weights), strict=True):
            assert there == expected, name


def _dxf(text: str, unit: str) -> tuple[int, Numbers, Numbers, Numbers]:
    lines = text.splitlines()
    groups = [(int(code), value) for code, value in zip(lines[::2], lines[1::2], strict=True)]
    assert groups[groups.index((9, "$INSUNITS")) + 1] == (70, "1" if unit == "inch" else "4")
    spline = groups[groups.index((0, "SPLINE")) :]
    spline = spline[: next(i for i, group in enumerate(spline) if i and group[0] == 0)]

    def of(*codes: int) -> Numbers:
        return [Decimal(value) for code, value in spline if code in codes]

    points = of(10, 20)
    assert of(30) == [0] * (len(points) // 2)
    assert of(72, 73) == [len(of(40)), len(points) // 2]
    return int(of(71)[0]), of(40), points, of(41) or [Decimal(1)] * (len(points) // 2)


def _iges(text: str, unit: str) -> tuple[int, Numbers, Numbers, Numbers]:
    lines = text.splitlines()
    assert {len(line) for line in lines} == {80}
    settings = "".join(line[:72] for line in lines if line[72] == "G")
    assert (",1,4HINCH," if unit == "inch" else ",2,2HMM,") in settings
    fields = "".join(line[:64].rstrip() for line in lines if line[72] == "P").rstrip(";").split(",")
    assert fields[0] == "126"
    last, degree = int(fields[1]), int(fields[2])
    values = [Decimal(field) for field in fields[7:]]
    cuts = [0, last + degree + 2]
    cuts += [cuts[1] + last + 1, cuts[1] + 4 * (last + 1)]
    knots, weights, points = (values[a:b] for a, b in ((cuts[0], cuts[1]), (cuts[1], cuts[2]), (cuts[2], cuts[3])))
    assert values[cuts[3] :] == [knots[degree], knots[-degree - 1], 0, 0, 1]
    return degree, knots, [value for i, value in enumerate(points) if i % 3 != 2], weights


def _step(text: str, unit: str) -> tuple[int, Numbers, Numbers, Numbers]:
    entities = dict(re.findall(r"^(#\d+)=(.*);$", text, re.MULTILINE))
    assert ("CONVERSION_BASED_UNIT('INCH'" in text) == (unit == "inch")
    curve = re.search(r"(\d+),\(((?:#\d+,?)+)\),[.]UNSPECIFIED[.],[.][TF][.],[.]F[.]", entities["#40"])
    spans = re.search(r"\(([\d,]+)\),\(([\d.,-]+)\),[.]UNSPECIFIED[.]", entities["#40"])
    assert curve is not None
    assert spans is not None
    knots = [Decimal(k) for times, k in zip(spans[1].split(","), spans[2].split(","), strict=True) for _ in range(int(times))]
    places = [re.fullmatch(r"CARTESIAN_POINT\('',\(([^,]+),([^,]+),0[.]\)\)", entities[each]) for each in curve[2].split(",")]
    points = [Decimal(place[k]) for place in places if place is not None for k in (1, 2)]
    heavy = re.search(r"RATIONAL_B_SPLINE_CURVE\(\(([^)]*)\)\)", entities["#40"])
    weights = [Decimal(value) for value in heavy[1].split(",")] if heavy else [Decimal(1)] * (len(points) // 2)
    return int(curve[1]), knots, points, weights
