"""How `inspect` is told what a file of points holds, what it says it assumed, and that a wrong set-up is not measured."""

import json
import time
from datetime import datetime
from pathlib import Path

import numpy as np
import pytest

from cmmlink.console.past_runs import PastRuns
from cmmlink.endings import reasons_of
from tests.cmmlink.command import Ended, cmmlink
from tests.cmmlink.commands.oval_files import TOLERANCE
from tests.cmmlink.oval_part import oval_points

POINTS = oval_points(0.0)


def inspect_rows(nominal: Path, rows: np.ndarray, *options: object, head: str = "") -> Ended:
    """Inspect these rows as a file."""
    file = nominal.parent / "rows.csv"
    file.write_text(head + "".join(",".join(f"{value:.9f}" for value in row) + "\n" for row in rows), encoding="utf-8")
    return cmmlink("inspect", file, "--nominal", nominal, *TOLERANCE, "--json", *options)


def test_columns_are_taken_as_asked_and_said(nominal: Path) -> None:
    rows = np.column_stack([np.arange(len(POINTS)) * 0.3, POINTS, np.random.default_rng(1).uniform(size=len(POINTS))])
    told = inspect_rows(nominal, rows).json()["error"]
    assert "4 columns" in told["message"] or "counts the rows" in told["message"]
    facts = inspect_rows(nominal, rows, "--columns", "x=2,y=3", "--fit", "none").json()
    assert facts["verdict"] == "conform"
    assert facts["notes"][-1] == "rows.csv: columns x=2, y=3, as asked"


@pytest.mark.parametrize("text", ["x=2", "x=2,y=2", "x=0,y=1", "2,3", "x=2,q=3", "x=2,y=two"])
def test_wrong_columns_are_refused(nominal: Path, text: str) -> None:
    assert inspect_rows(nominal, POINTS, "--columns", text).refused().startswith(f"--columns {text}: expected different columns")


@pytest.mark.parametrize(("unit", "factor"), [("inch", 25.4), ("um", 0.001)])
def test_points_in_another_unit_are_not_measured_and_read_when_the_unit_is_given(nominal: Path, unit: str, factor: float) -> None:
    ended = inspect_rows(nominal, POINTS / factor, "--fit", "best-fit")
    assert ended.code == 2
    error = ended.json()["error"]
    assert (error["kind"], error["exit_status"]) == ("not-measured", 2)
    assert f"--unit {unit}" in error["message"]
    facts = inspect_rows(nominal, POINTS / factor, "--unit", unit, "--fit", "none").json()
    assert facts["verdict"] == "conform"
    assert f"rows.csv: read in {unit}, as asked" in facts["notes"]


def test_a_nominal_in_another_unit(tmp_path: Path) -> None:
    file = tmp_path / "nominal.csv"
    file.write_text("".join(f"{x / 25.4:.12f},{y / 25.4:.12f}\n" for x, y in [*POINTS, POINTS[0]]), encoding="utf-8")
    assert "--nominal-unit inch" in inspect_rows(file, POINTS).json()["error"]["message"]
    facts = inspect_rows(file, POINTS, "--nominal-unit", "inch", "--fit", "none").json()
    assert facts["verdict"] == "conform"
    assert "nominal.csv: read in inch, as asked" in facts["notes"]
    assert "either unit or scale" in inspect_rows(file, POINTS, "--nominal-unit", "inch", "--scale", 2).refused()


@pytest.mark.parametrize("plane", ["xz", "yz"])
def test_a_plane_is_named_and_taken(nominal: Path, plane: str) -> None:
    rows = np.insert(POINTS, 1 if plane == "xz" else 0, 12.0, axis=1)
    assert f"say --plane {plane}" in inspect_rows(nominal, rows).json()["error"]["message"]
    assert inspect_rows(nominal, rows, "--plane", plane, "--fit", "none").json()["verdict"] == "conform"


def test_no_files_are_written_where_nothing_was_measured(nominal: Path) -> None:
    out = nominal.parent / "out"
    assert inspect_rows(nominal, POINTS / 25.4, "--out", out).code == 2
    assert not out.exists() or not list(out.rglob("*.*"))


def test_what_was_not_measured_is_on_record_with_its_reason_and_without_a_verdict(nominal: Path, tmp_path: Path) -> None:
    records = ("--records", tmp_path / "records")
    message = inspect_rows(nominal, POINTS / 25.4, *records).json()["error"]["message"]
    (entry,) = cmmlink("runs", *records, "--json").json()["runs"]
    assert (entry["state"], entry["received"], entry["verdict"]) == ("complete", len(POINTS), None)
    assert "NOT MEASURED" in cmmlink("runs", *records).out
    shown = cmmlink("show", "last", *records, "--json").json()
    assert (shown["verdict"], shown["result"], shown["recorded"]["points"]) == (None, None, len(POINTS))
    assert message.endswith(shown["message"])
    assert "NOT MEASURED" in cmmlink("show", "last", *records).out
    past = PastRuns(tmp_path / "records", lambda _: None, time.monotonic, lambda: datetime.now().astimezone())
    (row,) = past.runs()
    assert (row.word, row.shape, row.counted, row.verdict) == ("NOT MEASURED", "none", False, None)
    opened = past.open_run("last")
    assert reasons_of(opened.ended, None) == [shown["message"]]
    cmmlink("export", "last", *records, "--out", tmp_path / "out")
    assert not {"result.json", "deviations.csv"} & {path.name for path in (tmp_path / "out").iterdir()}
    again = cmmlink("replay", "last", *records, "--json")
    assert (again.code, again.json()["identical"], again.json()["registration"]) == (2, True, None)


def test_notes_stand_in_the_summary_the_json_and_the_file(nominal: Path) -> None:
    file, out = nominal.parent / "rows.csv", nominal.parent / "out"
    file.write_text("Scan of part 12\n" + "".join(f"{x:.6f} {y:.6f}\n" for x, y in POINTS) + "nan nan\n", encoding="utf-8")
    notes = ["rows.csv: line 1 taken as a header: 'Scan of part 12'", "rows.csv: 1 row without numbers: rejected"]
    words = cmmlink("inspect", file, "--nominal", nominal, *TOLERANCE, "--fit", "none", "--out", out).out
    (result,) = out.rglob("result.json")
    assert json.loads(result.read_text(encoding="utf-8"))["notes"][-2:] == notes
    for note in notes:
        assert f"note: {note}" in words


def test_dense_places_are_reserved(nominal: Path) -> None:
    dwell = np.vstack([POINTS[:90], np.repeat(POINTS[90:91], 600, axis=0), POINTS[90:]])
    facts = inspect_rows(nominal, dwell, "--fit", "none").json()
    assert any("times as dense at station" in note for note in facts["notes"])
    assert not any("dense" in note for note in inspect_rows(nominal, POINTS, "--fit", "none").json()["notes"])


def test_samples_that_mean_no_point_are_rejected_where_their_value_is_given(nominal: Path) -> None:
    rows = POINTS.copy()
    rows[[5, 30]] = -9999.0
    assert "--invalid V" in inspect_rows(nominal, rows).json()["error"]["message"]
    facts = inspect_rows(nominal, rows, "--invalid", -9999, "--fit", "none").json()
    assert (facts["rejected"], facts["verdict"]) == (2, "uncertain")
    assert "rows.csv: 2 rows hold -9999, which means no point: rejected" in facts["notes"]
    assert {reason["kind"] for reason in facts["reasons"]} == {"rejected"}


def test_notes_stand_in_summary_result_record_and_replay(nominal: Path, tmp_path: Path) -> None:
    note, records = "rows.csv: read in um, as asked", ("--records", tmp_path / "records")
    options = ("--unit", "um", "--fit", "none", "--out", tmp_path / "out")
    facts = inspect_rows(nominal, POINTS * 1000, *options, *records).json()
    assert note in facts["notes"]
    assert note in json.loads((tmp_path / "out" / "result.json").read_text(encoding="utf-8"))["notes"]
    file = nominal.parent / "rows.csv"
    assert f"note: {note}" in cmmlink("inspect", file, "--nominal", nominal, *TOLERANCE, *options, *records).out
    for command in ("replay", "show"):
        assert f"note: {note}" in cmmlink(command, "last", *records).out
        assert note in cmmlink(command, "last", *records, "--json").json()["notes"]
    assert cmmlink("replay", "last", *records, "--out", tmp_path / "again").code == 0
    assert note in json.loads((tmp_path / "again" / "result.json").read_text(encoding="utf-8"))["notes"]
