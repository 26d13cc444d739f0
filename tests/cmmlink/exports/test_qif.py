"""QIF: valid against the official schema, with the numbers of result.json and the points of deviations.csv."""

import copy
import csv
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from lxml import etree

from cmmlink.demo import plan_file
from cmmlink.exports import qif
from cmmlink.exports.measured_part import MeasuredPart, MeasuredSection
from cmmlink.plan import load_plan
from cmmlink.result_files import new_files
from inspection import JudgedRows
from tests.cmmlink.exports.conftest import OPERATOR, SERIAL, Measured
from tests.cmmlink.exports.schemas import NAMES, check_qif, need_qif_schema

STATUS = {"conform": "PASS", "nonconform": "FAIL", "uncertain": "INDETERMINATE"}


def all_of(document: Any, path: str) -> list[Any]:
    return list(document.xpath(path, namespaces=NAMES))


def texts(document: Any, path: str) -> list[str]:
    return [element.text for element in all_of(document, path)]


def attributes(element: Any) -> dict[str, str]:
    return {one.get("name"): one.get("value") for one in element.xpath("q:Attributes/q:AttributeStr", namespaces=NAMES)}


@pytest.fixture(scope="module")
def document(measured: Measured) -> Any:
    return etree.parse(measured.out / "result.qif")


def test_the_document_is_valid_and_one_with_a_part_missing_is_not(measured: Measured) -> None:
    schema, document = need_qif_schema(), etree.parse(measured.out / "result.qif")
    assert schema.validate(document), schema.error_log
    for path in ("//q:ToleranceValue", "//q:CharacteristicItemId", "//q:OtherCurveFeatureNominal"):
        spoiled = copy.deepcopy(document)
        element = all_of(spoiled, path)[0]
        element.getparent().remove(element)
        assert not schema.validate(spoiled), path


def test_every_characteristic_has_its_value_limits_and_status(measured: Measured, document: Any) -> None:
    asked = measured.result["characteristics"]
    assert len(asked) == 3
    found = all_of(document, "//q:LineProfileCharacteristicMeasurement")
    assert texts(document, "//q:CharacteristicItems/*/q:Name") == [" ".join(one["name"].split()) for one in asked]
    for one, element, definition in zip(asked, found, all_of(document, "//q:CharacteristicDefinitions/*"), strict=True):
        (value,) = all_of(element, "q:Value")
        assert float(value.text) == one["value"]
        assert float(value.get("combinedUncertainty")) == one["uncertainty"] / 2
        assert texts(element, "q:Status/q:CharacteristicStatusEnum") == [STATUS[one["verdict"]]]
        assert float(texts(definition, "q:ToleranceValue")[0]) == pytest.approx(one["upper"] - one["lower"], abs=1e-15)
        assert float(texts(definition, "q:OuterDisposition")[0]) == one["upper"]
        assert attributes(element)["region_words"] == one["region_words"]
    assert [float(text) for text in texts(found[0], "q:WorstPositiveDeviation | q:WorstNegativeDeviation")] == [
        measured.result["max_deviation_mm"],
        measured.result["min_deviation_mm"],
    ]
    assert texts(document, "//q:InspectionStatus/q:InspectionStatusEnum") == ["FAIL"]


def test_the_points_are_those_of_the_result(measured: Measured, document: Any) -> None:
    with (measured.out / "deviations.csv").open(encoding="utf-8", newline="") as file:
        rows = [row for row in csv.DictReader(file) if row["deviation_mm"]]
    points = np.array(texts(document, "//q:Points")[0].split(), dtype=float).reshape(-1, 3)
    deviations = np.array(texts(document, "//q:Deviations")[0].split(), dtype=float)
    assert all_of(document, "//q:MeasuredPointSet")[0].get("count") == str(len(rows)) == str(measured.result["judged"])
    np.testing.assert_allclose(points, [(float(row["x_mm"]), float(row["y_mm"]), 0.0) for row in rows], atol=5.1e-7)
    np.testing.assert_allclose(deviations, [float(row["deviation_mm"]) for row in rows], atol=5.1e-7)
    assert deviations.max() == measured.result["max_deviation_mm"]


def test_identity_counts_and_hashes_are_told(measured: Measured, document: Any) -> None:
    told = attributes(all_of(document, "//q:MeasurementResults")[0])
    for key in ("part", "run", "chain_sha256", "plan_sha256", "nominal_sha256", "received", "judged", "rejected", "lost", "rule"):
        assert told[key] == str(measured.result[key]), key
    assert texts(document, "//q:SerialNumber") == [SERIAL]
    assert texts(document, "//q:InspectionOperator/q:Name") == [OPERATOR]
    assert texts(document, "//q:InspectionStart") == [measured.result["measured_at"]]


def judged(count: int) -> JudgedRows:
    """Rows of which every seventh was rejected."""
    rng = np.random.default_rng(1)
    verdicts = np.zeros(count, dtype=np.int8)
    verdicts[::7] = -1
    numbers = rng.normal(size=(count, 6))
    numbers[::7] = np.nan
    rejection = np.where(verdicts < 0, 1, 0).astype(np.int8)
    return JudgedRows(numbers[:, :2], numbers[:, 2:4], numbers[:, 4], numbers[:, 5], verdicts, rejection)


def cut(rows: JudgedRows, sizes: list[int]) -> Iterator[JudgedRows]:
    first = 0
    for size in sizes:
        part = slice(first, first + size)
        places, numbers = (rows.actual_mm[part], rows.foot_mm[part]), (rows.station_mm[part], rows.deviation_mm[part])
        yield JudgedRows(*places, *numbers, rows.verdicts[part], rows.rejection[part])
        first += size


def part_of(measured: Measured, *sections: MeasuredSection, of_stack: list[dict[str, Any]] | None = None) -> MeasuredPart:
    return MeasuredPart(measured.result, measured.result, load_plan(plan_file()), sections, of_stack or [])


def written(folder: Path, part: MeasuredPart) -> Path:
    with new_files(folder) as files:
        qif.write_qif([part], files, "a")
    return folder / "a.qif"


@pytest.mark.parametrize("sizes", [[1000], [1, 299, 300, 400], [100] * 10])
def test_many_points_are_sets_that_do_not_depend_on_how_they_come(
    measured: Measured, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, sizes: list[int]
) -> None:
    monkeypatch.setattr(qif, "POINTS_OF_A_SET", 250)
    rows = judged(1000)
    file = written(tmp_path, part_of(measured, MeasuredSection(measured.result, lambda: cut(rows, sizes), 12.5)))
    check_qif(file)
    document = etree.parse(file)
    assert [int(one.get("count")) for one in all_of(document, "//q:MeasuredPointSet")] == [250, 250, 250, 107]
    points = np.array(" ".join(texts(document, "//q:Points")).split(), dtype=float).reshape(-1, 3)
    kept = rows.verdicts >= 0
    np.testing.assert_array_equal(points, np.column_stack([rows.actual_mm[kept], np.full(kept.sum(), 12.5)]))
    np.testing.assert_array_equal(np.array(" ".join(texts(document, "//q:Deviations")).split(), dtype=float), rows.deviation_mm[kept])


NOTHING: dict[str, Any] = {
    "value": None,
    "nominal": None,
    "deviation": None,
    "worst": None,
    "coverage": None,
    "region": None,
    "reasons": [],
    "zone": "",
}
KINDS = [
    ("twist", "deg", -0.5, 0.5, 12.25, 12.5),
    ("bow", "mm", None, 0.1, 0.0000123, 0.0),
    ("chord", "mm", -0.1, None, 60.25, 60.0),
    ("taper", "1", -0.001, 0.001, -1e-7, 0.0),
    ("taper", "1", None, 0.001, None, None),
    ("lean", "deg", -0.5, 0.5, None, 0.0),
    ("camber", "mm", -0.1, 0.1, None, None),
]


def test_every_kind_of_characteristic_is_valid_with_its_unit_and_limits(measured: Measured, tmp_path: Path) -> None:
    asked = [
        measured.result["characteristics"][0]
        | NOTHING
        | {"name": f"{kind} {place}", "type": kind, "unit": unit, "lower": low, "upper": high, "value": value, "nominal": nominal}
        | {"verdict": "uncertain" if value is None else "conform"}
        for place, (kind, unit, low, high, value, nominal) in enumerate(KINDS)
    ]
    sections = [MeasuredSection(measured.result | {"characteristics": []}, lambda: (), height) for height in (10.0, 20.0)]
    file = written(tmp_path, part_of(measured, *sections, of_stack=asked))
    assert check_qif(file)[: len(KINDS)] == ["PASS"] * 4 + ["INDETERMINATE"] * 3
    document = etree.parse(file)
    values = texts(document, "//q:CharacteristicMeasurements/*/q:Value")
    assert values == ["12.25", "0.0000123", "60.25", "-0.0000001"]  # a decimal has no exponent
    assert texts(document, "//q:UserDefinedAngularCharacteristicNominal/q:TargetValue") == ["12.5", "0.0"]
    assert [len(one) for one in all_of(document, "//q:FeatureMeasurementIds")] == [2] * len(KINDS)
    limits = [texts(one, ".//q:MinValue | .//q:MaxValue") for one in all_of(document, "//q:CharacteristicDefinitions/*")]
    assert limits == [["0.5", "-0.5"], ["0.1"], ["-0.1"], [], ["0.001"], ["0.5", "-0.5"], ["0.1", "-0.1"]]


def test_signs_that_xml_does_not_know_are_spelled_out(measured: Measured, tmp_path: Path) -> None:
    strange = measured.result | {"part": "a\x00\x1b[2J\ud800\uffff&<b>\r\n", "operator": "]]>", "notes": ["\x0b"]}
    part = replace(part_of(measured), document=strange, identity=strange, sections=[MeasuredSection(measured.result, lambda: ())])
    file = written(tmp_path, part)
    check_qif(file)
    assert attributes(all_of(etree.parse(file), "//q:MeasurementResults")[0])["part"] == "a\\x00\\x1b[2J\\ud800\\uffff&<b>\\r"
