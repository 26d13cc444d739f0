"""CSV and XLSX: the same rows in both, with the numbers of result.json and every point of deviations.csv."""

import csv
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import pytest

from cmmlink.exports.measured_part import MeasuredPart, MeasuredSection
from cmmlink.exports.neutral_text import neutral
from cmmlink.exports.tables import CHARACTERISTIC_COLUMNS, POINT_COLUMNS, RUN_COLUMNS
from cmmlink.exports.workbook import write_xlsx
from cmmlink.result_files import new_files
from tests.cmmlink.command import cmmlink
from tests.cmmlink.exports.conftest import OPERATOR, PART, PLAN, SERIAL, Measured
from tests.cmmlink.exports.tables_of import sheets_of, table_of
from tests.cmmlink.exports.test_qif import judged, part_of

FORMATS = ("csv", "xlsx")


def tables_in(folder: Path, kind: str, stem: str = "result") -> dict[str, Sequence[Mapping[str, Any]]]:
    if kind == "xlsx":
        return dict(sheets_of(folder / f"{stem}.xlsx"))
    places = {"runs": "", "characteristics": "-characteristics", "points": "-points"}
    return {name: table_of(folder / f"{stem}{place}.csv") for name, place in places.items()}


@pytest.mark.parametrize("kind", FORMATS)
def test_the_row_of_a_run_has_the_numbers_of_its_result(measured: Measured, kind: str) -> None:
    result = measured.result
    (row,) = tables_in(measured.out, kind)["runs"]
    assert set(row) <= set(RUN_COLUMNS)
    worst, pose, zone = result["worst"], result["registration"], result["tolerance"]
    numbers = {key: result[key] for key in RUN_COLUMNS if isinstance(result.get(key), float | int)}
    numbers |= {f"worst_{key}": value for key, value in worst.items()} | {key: value for key, value in zone.items() if key in RUN_COLUMNS}
    numbers |= {"rotation_deg": pose["rotation_deg"], "translation_x_mm": pose["translation_mm"][0], "row": 1}
    del numbers["decision_rule"]
    assert len(numbers) == 23
    for key, value in numbers.items():
        assert float(row[key]) == pytest.approx(float(value), rel=1e-15), key
    for key in ("run", "measured_at", "ending", "verdict", "plan_sha256", "nominal_sha256", "chain_sha256", "rule", "fit"):
        assert row[key] == result[key]
    assert row["decision_rule"] == zone["decision_rule"]
    assert row["reasons"] == " ".join(reason["words"] for reason in result["reasons"])
    assert (row["part"], row["serial_number"], row["operator"]) == (neutral(PART), f"'{SERIAL}", "'+Ada;'=1+1")
    assert row["operator"] != OPERATOR


@pytest.mark.parametrize("kind", FORMATS)
def test_the_rows_of_characteristics_have_the_numbers_of_the_result(measured: Measured, kind: str) -> None:
    rows = tables_in(measured.out, kind)["characteristics"]
    for row, one in zip(rows, measured.result["characteristics"], strict=True):
        assert set(row) <= set(CHARACTERISTIC_COLUMNS)
        for key in ("value", "lower", "upper", "deviation", "uncertainty"):
            assert float(row[key]) == pytest.approx(one[key], rel=1e-15)
        assert "nominal" not in row
        assert [row[key] for key in ("name", "type", "method", "unit", "verdict", "zone", "fit", "filter", "rule")] == [
            one[key] for key in ("name", "type", "method", "unit", "verdict", "zone", "fit", "filter", "rule")
        ]
        assert row["region"] == one["region_words"]


@pytest.mark.parametrize("kind", FORMATS)
def test_every_point_is_there_as_in_deviations_csv(measured: Measured, kind: str) -> None:
    points = tables_in(measured.out, kind)["points"]
    with (measured.out / "deviations.csv").open(encoding="utf-8", newline="") as file:
        expected = list(csv.DictReader(file))
    assert len(points) == len(expected) == measured.result["received"]
    for point, row in zip(points, expected, strict=True):
        assert (float(point["row"]), int(point["index"]), point["verdict"]) == (1, int(row["index"]), row["verdict"])
        for key in ("x_mm", "y_mm", "station_mm", "foot_x_mm", "foot_y_mm", "deviation_mm"):
            assert f"{float(point[key]):.6f}" == row[key]
    assert [index for index, point in enumerate(points) if "chain_sha256" in point] == [0]


def test_the_meaning_of_every_column_is_in_the_workbook(measured: Measured) -> None:
    meanings = sheets_of(measured.out / "result.xlsx")["columns"]
    for sheet, columns in (("runs", RUN_COLUMNS), ("characteristics", CHARACTERISTIC_COLUMNS), ("points", POINT_COLUMNS)):
        assert {row["column"]: row["meaning"] for row in meanings if row["sheet"] == sheet} == {
            name: neutral(said) for name, said in columns.items()
        }


def test_points_go_on_in_a_further_sheet_where_one_is_full(measured: Measured, tmp_path: Path) -> None:
    rows = judged(100)
    part = part_of(measured, MeasuredSection(measured.result, lambda: [rows]), MeasuredSection(measured.result, lambda: [rows], 5.0))
    with new_files(tmp_path) as files:
        write_xlsx([part], files, "a", most_rows=61)
    sheets = sheets_of(tmp_path / "a.xlsx")
    assert [(name, len(found)) for name, found in sheets.items() if name.startswith("points")] == [
        ("points", 60), ("points 2", 60), ("points 3", 60), ("points 4", 20),
    ]  # fmt: skip
    points = [point for name, found in sheets.items() if name.startswith("points") for point in found]
    assert [(point["row"], point["index"]) for point in points] == [(row, index) for row in (1, 2) for index in range(100)]
    once = rows.deviation_mm[rows.verdicts >= 0].tolist()
    assert [point["deviation_mm"] for point in points if "deviation_mm" in point] == pytest.approx([*once, *once], rel=1e-15)
    assert points[0]["verdict"].startswith("rejected: ")
    assert "x_mm" not in points[0]


def runs_in(records: Path) -> list[str]:
    return [entry["run"] for entry in cmmlink("runs", "--records", records, "--json").json()["runs"]]


@pytest.mark.parametrize("kind", FORMATS)
def test_many_runs_are_rows_of_one_table(measured: Measured, tmp_path: Path, kind: str) -> None:
    records = measured.folder / "records"
    if len(runs := runs_in(records)) < 2:
        (measured.folder / "again.yaml").write_text(PLAN.format(part="b", serial="1", operator="c", out="null"), encoding="utf-8")
        cmmlink("run", measured.folder / "again.yaml", "--headless", "--json")
        runs = runs_in(records)
    told = cmmlink("export", *runs[:2], "--format", kind, "--format", "json", "--out", tmp_path, "--records", records, "--json").json()
    assert told["runs"] == runs[:2]
    tables = tables_in(tmp_path, kind, "runs")
    assert [(float(row["row"]), row["run"]) for row in tables["runs"]] == [(1, runs[0]), (2, runs[1])]
    assert [float(row["row"]) for row in tables["characteristics"]] == [1, 1, 1, 2, 2, 2]
    assert [float(point["row"]) for point in tables["points"]] == [1] * 360 + [2] * 360
    assert {path.name for path in tmp_path.glob("*.json")} == {f"{run}.json" for run in runs[:2]}


def test_the_rows_of_a_stack_name_their_heights_and_its_own_characteristics(measured: Measured, tmp_path: Path) -> None:
    sections = [MeasuredSection(measured.result, lambda: (), height) for height in (10.0, 20.0)]
    twist = measured.result["characteristics"][0] | {"name": "twist", "height_mm": 20.0}
    part: MeasuredPart = part_of(measured, *sections, of_stack=[twist])
    with new_files(tmp_path) as files:
        write_xlsx([part], files, "a")
    sheets = sheets_of(tmp_path / "a.xlsx")
    assert [row["height_mm"] for row in sheets["runs"]] == [10.0, 20.0]
    assert [(row["name"][:7], row["height_mm"], row.get("row")) for row in sheets["characteristics"]][2:] == [
        ("a zone ", 10.0, 1), ("profile", 20.0, 2), ("a side ", 20.0, 2), ("a zone ", 20.0, 2), ("twist", 20.0, None),
    ]  # fmt: skip
