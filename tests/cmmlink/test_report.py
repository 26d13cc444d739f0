"""What is written of a result: the keys of the summary, the rows of deviations.csv, the picture."""

import csv
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.colors import to_rgb
from matplotlib.image import imread

from cmmlink.deviations_csv import COLUMNS, write_deviations
from cmmlink.errors import PlanError
from cmmlink.events import Counts, RunStarted
from cmmlink.report.folder import prepare, write_results
from cmmlink.report.picture import magnification, write_picture
from cmmlink.result_json import identity_json, result_json
from inspection import InspectionResult, LiveInspection, NominalProfile, RigidTransform, ToleranceZone
from tests.cmmlink.oval_part import LENGTH_MM, oval_feet, oval_points, oval_profile, station_mm

PROMISED = {
    "verdict": str,
    "received": int,
    "judged": int,
    "rejected": int,
    "lost": int,
    "out_of_tolerance": int,
    "max_deviation_mm": float,
    "min_deviation_mm": float,
    "rms_mm": float,
    "profile_error_mm": float,
    "worst": dict,
    "fit": str,
    "method": str,
    "registration": dict,
    "stretches": list,
}
FURTHER = {"coverage", "complete", "tolerance", "rejected_by_reason", "damaged_bytes"}


@pytest.fixture(scope="module")
def profile() -> NominalProfile:
    return oval_profile()


def inspected(profile: NominalProfile, deviation_mm: Any, **settings: Any) -> InspectionResult:
    live = LiveInspection(profile, ToleranceZone(-0.05, 0.07, 0.01), datum=RigidTransform.identity(), **settings)
    live.add(oval_points(deviation_mm))
    return live.finish()


def bumped() -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    """Five points in a row above the zone, one apart below it."""
    deviation = np.full(360, 0.01)
    deviation[40:45] = [0.1, 0.12, 0.2, 0.12, 0.1]
    deviation[200] = -0.09
    return deviation


def test_the_summary_has_the_promised_keys_and_says_what_was_put_in(profile: NominalProfile) -> None:
    result = inspected(profile, bumped())
    facts = result_json(result, Counts(received=360, judged=360, lost=2))
    assert set(facts) == set(PROMISED) | FURTHER
    assert {key: type(facts[key]) for key in PROMISED} == PROMISED
    assert facts["verdict"] == "nonconform"
    assert (facts["received"], facts["judged"], facts["rejected"], facts["lost"], facts["out_of_tolerance"]) == (360, 360, 0, 2, 6)
    assert facts["max_deviation_mm"] == pytest.approx(0.2, abs=1e-9)
    assert facts["min_deviation_mm"] == pytest.approx(-0.09, abs=1e-9)
    assert facts["rms_mm"] == pytest.approx(np.sqrt(np.mean(bumped() ** 2)), abs=1e-9)
    assert facts["profile_error_mm"] == pytest.approx(0.4, abs=1e-9)
    assert (facts["fit"], facts["method"]) == ("none", "exact")
    assert facts["tolerance"] == {"lower_mm": -0.05, "upper_mm": 0.07, "uncertainty_mm": 0.01}


def test_the_worst_point_and_the_stretches_are_where_they_were_made(profile: NominalProfile) -> None:
    facts = result_json(inspected(profile, bumped()), Counts())
    worst, (x, y) = facts["worst"], oval_points(bumped())[42]
    assert set(worst) == {"station_mm", "x_mm", "y_mm", "deviation_mm"}
    at = (station_mm(42), x, y, 0.2)
    assert (worst["station_mm"], worst["x_mm"], worst["y_mm"], worst["deviation_mm"]) == pytest.approx(at, abs=1e-6)
    first, second = facts["stretches"]
    assert set(first) == {"from_mm", "to_mm", "worst_mm"}
    assert (first["from_mm"], first["to_mm"], first["worst_mm"]) == pytest.approx((station_mm(40), station_mm(44), 0.2), abs=1e-6)
    assert (second["from_mm"], second["to_mm"], second["worst_mm"]) == pytest.approx((station_mm(200), station_mm(200), -0.09), abs=1e-6)


def test_the_registration_is_told_in_degrees_and_mm(profile: NominalProfile) -> None:
    pose = RigidTransform(np.radians(90.0), np.array([1.0, -2.0]))
    live = LiveInspection(profile, ToleranceZone(-0.05, 0.05), datum=pose)
    live.add(RigidTransform(np.radians(-90.0), np.zeros(2)).apply(oval_points(0.0) - [1.0, -2.0]))
    registration = result_json(live.finish(), Counts())["registration"]
    assert {"rotation_deg", "translation_mm", "iterations", "converged"} <= set(registration)
    assert registration["rotation_deg"] == pytest.approx(90.0)
    assert registration["translation_mm"] == [1.0, -2.0]
    assert registration["converged"] is True


def test_a_summary_without_a_result_has_the_same_keys_and_proves_nothing(profile: NominalProfile) -> None:
    nothing = result_json(None, Counts(received=3, rejected=3, rejected_by_reason={"not registered": 3}))
    assert set(nothing) == set(result_json(inspected(profile, 0.0), Counts()))
    assert (nothing["verdict"], nothing["received"], nothing["judged"], nothing["rejected"]) == ("uncertain", 3, 0, 3)
    assert nothing["worst"] is None


def test_a_summary_is_strict_json_also_when_nothing_was_judged(profile: NominalProfile) -> None:
    live = LiveInspection(profile, ToleranceZone(-0.05, 0.05), datum=RigidTransform.identity())
    live.add(np.full((9, 2), np.nan))
    for facts in (result_json(live.finish(), Counts()), result_json(inspected(profile, bumped()), Counts()), result_json(None, Counts())):
        assert json.loads(json.dumps(facts, allow_nan=False)) == facts


def test_the_identity_of_a_run_stands_beside_its_numbers() -> None:
    facts = identity_json(RunStarted("blade", "0012", "", "serial COM3", True))
    assert facts == {"part": "blade", "serial_number": "0012", "operator": None, "device": "serial COM3", "simulated": True}
    assert not set(facts) & (set(PROMISED) | FURTHER)


def rows_of(path: Path) -> list[dict[str, str]]:
    with path.open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def test_deviations_csv_has_a_row_for_every_point(profile: NominalProfile, tmp_path: Path) -> None:
    result = inspected(profile, bumped())
    write_deviations(result, tmp_path / "deviations.csv")
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
    write_deviations(live.finish(), tmp_path / "deviations.csv")
    rows = rows_of(tmp_path / "deviations.csv")
    assert [row["verdict"] for row in rows] == ["conform", "rejected: not finite", "nonconform"]
    assert [rows[1][name] for name in list(COLUMNS)[1:7]] == [""] * 6
    assert float(rows[2]["deviation_mm"]) == pytest.approx(0.3)


def pixels_of(path: Path, colour: str) -> int:
    """Number of pixels of this colour, or nearly so where lines are smoothed."""
    return int((np.abs(imread(path)[:, :, :3] - to_rgb(colour)) < 0.1).all(axis=2).sum())


ABOVE, BELOW, GOOD, BAND = "#c2410c", "#6d28d9", "#2a7fa5", "#dfe7ee"


def test_the_picture_shows_band_whiskers_and_what_is_out(profile: NominalProfile, tmp_path: Path) -> None:
    good, bad = tmp_path / "good.png", tmp_path / "bad.png"
    write_picture(inspected(profile, 0.02), profile, "oval", good)
    write_picture(inspected(profile, bumped()), profile, "oval", bad)
    assert imread(good).shape[:2] == (880, 1320)
    assert min(pixels_of(good, BAND), pixels_of(bad, BAND)) > 10_000
    assert pixels_of(good, GOOD) > 100
    assert min(pixels_of(bad, ABOVE), pixels_of(bad, BELOW)) > 10
    assert pixels_of(good, BELOW) == 0
    assert pixels_of(bad, ABOVE) > pixels_of(good, ABOVE)  # which has it only in the ring around its worst point


def test_the_magnification_is_a_round_number_that_shows_the_band(profile: NominalProfile) -> None:
    factor = magnification(inspected(profile, 0.0), profile)
    assert factor in {step * power for step in (1, 2, 5) for power in (1, 10, 100)}
    assert 0.024 <= factor * 0.12 / np.hypot(20, 16) <= 0.06


def test_the_folder_holds_what_it_says(profile: NominalProfile, tmp_path: Path) -> None:
    folder = tmp_path / "a" / "b"
    facts = result_json(inspected(profile, bumped()), Counts())
    written = write_results(folder, facts, inspected(profile, bumped()), profile, "oval")
    assert sorted(written) == sorted(path.name for path in folder.iterdir()) == ["deviations.csv", "profile.png", "result.json"]
    assert json.loads((folder / "result.json").read_text(encoding="utf-8")) == facts


def test_an_earlier_result_does_not_stay_beside_a_run_without_one(profile: NominalProfile, tmp_path: Path) -> None:
    write_results(tmp_path, {}, inspected(profile, 0.0), profile, "oval")
    assert write_results(tmp_path, {"verdict": "uncertain"}, None, profile, "oval") == ["result.json"]
    assert [path.name for path in tmp_path.iterdir()] == ["result.json"]


def test_a_prepared_folder_exists_and_is_empty(tmp_path: Path) -> None:
    prepare(tmp_path / "a" / "b")
    prepare(None)
    assert list((tmp_path / "a" / "b").iterdir()) == []


@pytest.mark.parametrize("name", ["file", "file/below"])
def test_a_folder_that_takes_no_files_is_named(tmp_path: Path, name: str) -> None:
    (tmp_path / "file").write_text("", encoding="utf-8")
    with pytest.raises(PlanError, match=r"file.*: the results cannot be written .*; choose another folder with --out"):
        prepare(tmp_path / name)


def test_the_oval_is_as_long_as_its_circumference(profile: NominalProfile) -> None:
    assert profile.length_mm == pytest.approx(LENGTH_MM, rel=1e-12)
