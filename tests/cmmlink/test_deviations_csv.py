"""deviations.csv: a row for every point."""

import csv
from pathlib import Path

import numpy as np
import pytest

from cmmlink.deviations_csv import COLUMNS, write_deviations
from inspection import NOT_JUDGED, LiveInspection, NominalProfile, Rejection, RigidTransform, ToleranceZone, Verdict
from tests.cmmlink.judged_oval import bumped, inspect_oval
from tests.cmmlink.oval_part import oval_feet, oval_points, station_mm


def rows_of(path: Path) -> list[dict[str, str]]:
    with path.open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def test_deviations_csv_has_a_row_for_every_point(profile: NominalProfile, tmp_path: Path) -> None:
    result = inspect_oval(profile, bumped())
    write_deviations(result.blocks(), tmp_path / "deviations.csv")
    rows = rows_of(tmp_path / "deviations.csv")
    assert tuple(rows[0]) == tuple(COLUMNS)
    assert tuple(COLUMNS) == ("index", "x_mm", "y_mm", "station_mm", "foot_x_mm", "foot_y_mm", "deviation_mm", "verdict")
    assert [int(row["index"]) for row in rows] == list(range(360))
    truth = np.column_stack([oval_points(bumped()), [station_mm(i) for i in range(360)], oval_feet(), bumped()])
    np.testing.assert_allclose([[float(row[name]) for name in list(COLUMNS)[1:7]] for row in rows], truth, atol=0.51e-6)
    words = np.where(np.abs(bumped() - 0.01) > 0.07, "nonconform", "conform")
    assert [row["verdict"] for row in rows] == words.tolist()


def test_a_rejected_point_keeps_its_row_and_says_why(profile: NominalProfile, tmp_path: Path) -> None:
    live = LiveInspection(profile, ToleranceZone(-0.05, 0.05), datum=RigidTransform.identity())
    live.add([[10.0, 0.0], [np.nan, 1.0], [0.0, 8.3]])
    write_deviations(live.finish().blocks(), tmp_path / "deviations.csv")
    rows = rows_of(tmp_path / "deviations.csv")
    assert [row["verdict"] for row in rows] == ["conform", "rejected: not finite", "nonconform"]
    assert [rows[1][name] for name in list(COLUMNS)[1:7]] == [""] * 6
    assert float(rows[2]["deviation_mm"]) == pytest.approx(0.3)


def test_the_file_is_byte_for_byte_what_plain_formats_write(profile: NominalProfile, tmp_path: Path) -> None:
    live = LiveInspection(profile, ToleranceZone(-0.05, 0.07, 0.01), datum=RigidTransform.identity(), off_section_max_mm=1.0)
    points = np.column_stack([oval_points(bumped()), np.zeros(360)])
    points[::7] += 0.02 * np.random.default_rng(1).normal(size=(52, 3))
    points[50, 2], points[60, 0] = 2.0, np.inf
    live.add(points)
    result = live.finish()
    for ending in ("complete", "aborted"):
        write_deviations(result.blocks(at_once=100), tmp_path / "deviations.csv", ending)
        columns, last = (list(COLUMNS), []) if ending == "complete" else ([*COLUMNS, "ending"], [ending])
        with (tmp_path / "plain.csv").open("w", newline="", encoding="utf-8") as file:
            writer = csv.writer(file)
            writer.writerow(columns)
            rows = result.rows_at(slice(None))
            for i, code in enumerate(rows.verdicts.tolist()):
                numbers = (*rows.actual_mm[i], rows.station_mm[i], *rows.foot_mm[i], rows.deviation_mm[i])
                if code == NOT_JUDGED:
                    writer.writerow([i, *[""] * 6, f"rejected: {Rejection(rows.rejection[i]).words}", *last])
                else:
                    writer.writerow([i, *(f"{number:.6f}" for number in numbers), Verdict(code).word, *last])
        assert (tmp_path / "deviations.csv").read_bytes() == (tmp_path / "plain.csv").read_bytes()
    assert {*result.verdicts.tolist()} == {NOT_JUDGED, *Verdict}
