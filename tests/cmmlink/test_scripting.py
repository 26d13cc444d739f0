"""One call from points to a result: the verdict and every number of the command line, from files and from arrays."""

import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import cmmlink as front
from cmmlink import Inspected, PlanError, RunError, load_plan, open_run
from cmmlink.deviations_csv import COLUMNS, POINT_WORDS
from drivers import PointFileError
from inspection import NominalError, NominalProfile, NotMeasured, Verdict, deviations
from tests.cmmlink.command import cmmlink
from tests.cmmlink.judged_oval import bumped, inspect_oval
from tests.cmmlink.oval_part import COUNT, LENGTH_MM, oval_curve, oval_feet, oval_points, station_mm, write_nominal, write_points

KNOWN: dict[str, Any] = {"registration": {"fit": "none"}}
OF_THE_SURROUNDINGS = (
    "measured_at",
    "part",
    "device",
    "run",
    "chain_sha256",
    "plan_sha256",
    "nominal_sha256",
    "software",
    "signature",
    "anchors",
)


@pytest.fixture(scope="module")
def found(profile: NominalProfile) -> Inspected:
    """The oval with its bump, handed over as an array, at its known pose."""
    return front.inspect(oval_points(bumped()), nominal=profile, tolerance=(-0.05, 0.07), part="oval <b>&", **KNOWN)


def test_deviations_of_an_array_are_those_that_its_points_have(found: Inspected) -> None:
    np.testing.assert_allclose(found.points.deviation_mm, bumped(), atol=1e-9)
    assert found.verdict is Verdict.NONCONFORM
    assert found.document["out_of_tolerance"] == np.count_nonzero((bumped() > 0.07) | (bumped() < -0.05))
    assert found.document["worst"]["station_mm"] == pytest.approx(station_mm(42), abs=1e-6)


def test_files_arrays_and_the_command_line_find_the_same_to_the_last_bit(tmp_path: Path, found: Inspected) -> None:
    points_mm = np.round(oval_points(bumped()), 9)
    points, nominal = write_points(tmp_path / "scan.csv", points_mm), write_nominal(tmp_path / "oval.yaml")
    shown = cmmlink("inspect", points, "--nominal", nominal, "--tolerance", -0.05, 0.07, "--fit", "none", "--json").json()
    of_files = front.inspect(points, nominal=nominal, tolerance=(-0.05, 0.07), **KNOWN)
    of_arrays = front.inspect(points_mm, nominal=oval_curve(), tolerance=(-0.05, 0.07), **KNOWN)
    for one in (of_files, of_arrays):
        told = {key: value for key, value in one.document.items() if key not in OF_THE_SURROUNDINGS}
        assert told == {key: value for key, value in shown.items() if key not in OF_THE_SURROUNDINGS}
    assert np.array_equal(of_files.points.deviation_mm, of_arrays.points.deviation_mm)


def test_a_nominal_is_also_an_array_of_points_that_it_goes_through() -> None:
    scan = oval_points(0.0)
    of_points = front.inspect(scan, nominal=np.vstack([oval_feet(), oval_feet()[:1]]), tolerance=(-0.05, 0.05), **KNOWN)
    assert of_points.verdict is Verdict.CONFORM
    assert np.abs(of_points.points.deviation_mm).max() < 1e-6
    with pytest.raises(NominalError, match="row 2: not a finite number"):
        front.inspect(scan, nominal=np.where(np.arange(24).reshape(12, 2) == 5, np.nan, 1.0), tolerance=(-1, 1))
    with pytest.raises(NominalError, match="row 1: repeats the point"):
        front.inspect(scan, nominal=[(0, 0), (0, 0), (1, 1), (2, 3), (0, 4)], tolerance=(-1, 1))


def test_rows_without_numbers_never_improve_the_verdict(profile: NominalProfile) -> None:
    good = oval_points(0.0)
    assert front.inspect(good, nominal=profile, tolerance=(-0.05, 0.05), **KNOWN).verdict is Verdict.CONFORM
    good[7] = np.nan
    missing = front.inspect(good, nominal=profile, tolerance=(-0.05, 0.05), **KNOWN)
    assert missing.verdict is Verdict.UNCERTAIN
    assert missing.reasons
    assert missing.notes[1:] == ("array of points: 1 row without numbers: rejected",)
    assert "handed over as a profile" in missing.notes[0]
    assert np.flatnonzero(np.isnan(missing.points.deviation_mm)).tolist() == [7]


def test_what_a_mask_hides_is_no_point(profile: NominalProfile) -> None:
    points_mm = np.ma.masked_array(oval_points(0.0))
    points_mm[7] = np.ma.masked
    hidden = front.inspect(points_mm, nominal=profile, tolerance=np.array([-0.05, 0.05], dtype=np.float32), **KNOWN)
    assert (hidden.document["received"], hidden.document["rejected"], hidden.verdict) == (COUNT, 1, Verdict.UNCERTAIN)
    with pytest.raises(NominalError, match="row 7: not a finite number"):
        front.nominal_profile(points_mm)


def test_a_plan_stands_in_place_of_all_but_the_points(tmp_path: Path) -> None:
    points, nominal = write_points(tmp_path / "scan.csv", oval_points(bumped())), write_nominal(tmp_path / "oval.yaml")
    plan_file = tmp_path / "plan.yaml"
    plan_file.write_text(
        f"part: {{name: oval}}\nnominal: {{file: {nominal.name}}}\ntolerance: {{lower_mm: -0.05, upper_mm: 0.07}}\n"
        f"device: {{type: file, file: {points.name}}}\nregistration: {{fit: none}}\n",
        encoding="utf-8",
    )
    plan = load_plan(str(plan_file))
    np.testing.assert_allclose(front.inspect(points, plan=plan).points.deviation_mm, bumped(), atol=1e-8)
    asked: tuple[dict[str, Any], ...] = ({"tolerance": (0, 1)}, {"scale": 2.0}, {"part": "p"}, {"rule": "best-fit"})
    for beside in asked:
        with pytest.raises(PlanError, match=f"{next(iter(beside))} stands beside a plan"):
            front.inspect(points, plan=plan, **beside)


@pytest.mark.parametrize(
    ("asked", "kind", "words"),
    [
        ({"tolerance": 0.1}, PlanError, "tolerance is 0.1; expected the lower and the upper deviation"),
        ({"tolerance": (0.1, -0.1)}, PlanError, r"tolerance.upper_mm is -0.1: expected a number above the lower limit"),
        ({}, PlanError, "^tolerance is missing$"),
        ({"tolerance": (0, 1), "fit": "none"}, PlanError, "fit: this is no key of a plan"),
        ({"tolerance": (0, 1), "registration": {"fit": "x"}}, PlanError, "registration.fit: expected 'best-fit'"),
        ({"tolerance": (0, 1), "scale": 2.0}, PlanError, "scale is 2: it is for a file"),
        ({"tolerance": (0, 1), "closed": True}, PlanError, "closed and material are settled"),
        ({"tolerance": (0, 1), "probe": {"tip_radius_mm": -1.0}}, PlanError, "probe.tip_radius_mm is -1: expected"),
    ],
)
def test_what_cannot_be_used_is_named_by_its_argument(
    profile: NominalProfile, asked: dict[str, Any], kind: type[Exception], words: str
) -> None:
    with pytest.raises(kind, match=words):
        front.inspect(oval_points(0.0), nominal=profile, **asked)


def test_points_of_another_shape_are_refused(profile: NominalProfile) -> None:
    with pytest.raises(PointFileError, match=r"shape \(3, 5\)"):
        front.inspect(np.zeros((3, 5)), nominal=profile, tolerance=(-1, 1))
    with pytest.raises(PointFileError, match="different lengths"):
        front.inspect([[0, 1], [2]], nominal=profile, tolerance=(-1, 1))


def test_what_contradicts_the_points_raises_and_is_no_verdict(profile: NominalProfile) -> None:
    with pytest.raises(NotMeasured):
        front.inspect(oval_points(0.0) / 25.4, nominal=profile, tolerance=(-0.05, 0.05))
    with pytest.raises(NotMeasured, match="array of points: read in inch, as asked"):
        front.inspect(oval_points(0.0), nominal=profile, tolerance=(-0.05, 0.05), unit="inch")


def test_a_recorded_run_opens_by_its_name_with_the_same_result(tmp_path: Path) -> None:
    points, nominal = write_points(tmp_path / "scan.csv", oval_points(bumped())), write_nominal(tmp_path / "oval.yaml")
    asked = ("--nominal", nominal, "--tolerance", -0.05, 0.07, "--fit", "none", "--records", tmp_path / "records", "--json")
    shown = cmmlink("inspect", points, *asked).json()
    for name in ("last", shown["run"], "1"):
        opened = open_run(name, records=tmp_path / "records")
        assert {key: opened.document[key] for key in shown} == shown
    of_files = front.inspect(points, nominal=nominal, tolerance=(-0.05, 0.07), **KNOWN)
    assert np.array_equal(opened.points.deviation_mm, of_files.points.deviation_mm)
    assert shown["run"] in repr(opened)
    with pytest.raises(RunError, match="there is no run 'last~1'"):
        open_run("last~1", records=tmp_path / "records")


def test_a_result_says_itself_in_one_line_and_shows_itself_in_a_notebook(found: Inspected) -> None:
    assert repr(found) == "<Inspected oval <b>&: NOT CONFORM, 360 of 360 points judged, worst +0.2000 mm at station 6.62 mm>".replace(
        "6.62", f"{station_mm(42):.2f}"
    )
    shown = found._repr_html_()
    assert "<b>NOT CONFORM</b>" in shown
    assert "oval &lt;b&gt;&amp;" in shown
    assert "oval <b>" not in shown
    assert '<img alt="the deviations of oval' in shown
    assert found.reasons[0] in shown


def test_a_nominal_of_any_kind_becomes_the_same_profile(tmp_path: Path) -> None:
    of_file = front.nominal_profile(write_nominal(tmp_path / "oval.yaml"))
    of_curve = front.nominal_profile(oval_curve())
    assert np.array_equal(of_file.points_mm, of_curve.points_mm)
    assert of_file.material == "left"
    of_points = front.nominal_profile(oval_feet()[::-1], closed=True)
    assert of_points.material == "right"
    assert of_points.length_mm == pytest.approx(LENGTH_MM, rel=1e-7)
    feet = write_points(tmp_path / "feet.csv", oval_feet())
    assert front.nominal_profile({"file": feet}, closed=True).curve.closed is True
    assert front.nominal_profile({"file": feet}, closed=False, material="left").curve.closed is False
    with pytest.raises(PlanError, match="closed is given beside the nominal and in it"):
        front.nominal_profile({"file": feet, "closed": False}, closed=True)
    with pytest.raises(PlanError, match="layr: this is no key of a plan"):
        front.nominal_profile({"file": feet, "layr": "x"})
    with pytest.raises(NominalError, match="expected points of shape"):
        front.nominal_profile(np.zeros(4))


def test_results_say_themselves_without_their_arrays(profile: NominalProfile) -> None:
    found = deviations(oval_points(bumped()), profile)
    result = inspect_oval(profile, bumped())
    values = (profile, profile.curve, found, result, result.registration, result.rows_at(slice(None)))
    assert repr(found) == "<Deviations of 360 points, -0.0900 .. +0.2000 mm, 0 beyond an open end>"
    assert all(len(repr(value)) < 200 and "array" not in repr(value) for value in values)


def test_plots_are_figures_that_belong_to_nobody_else(found: Inspected) -> None:
    first, second = found.plot(), found.plot()
    assert first is not second
    assert [axes.get_xlabel() for axes in first.axes] == ["x (mm)", "station (mm)"]


def test_points_become_columns_with_the_names_of_deviations_csv(found: Inspected, monkeypatch: pytest.MonkeyPatch) -> None:
    columns = found.to_columns()
    assert list(columns) == list(COLUMNS)
    assert columns["index"].tolist() == list(range(COUNT))
    assert np.array_equal(columns["deviation_mm"], found.points.deviation_mm)
    assert np.array_equal(columns["foot_y_mm"], found.points.foot_mm[:, 1])
    assert [columns["verdict"][k] for k in (0, 42, 200)] == ["conform", "nonconform", "nonconform"]
    assert set(columns["verdict"]) <= set(POINT_WORDS)

    def frame_of(told: Any) -> Any:
        """A stand-in for a table of pandas, which need not be there."""
        return SimpleNamespace(set_index=lambda name: (name, told))

    monkeypatch.setitem(sys.modules, "pandas", SimpleNamespace(DataFrame=frame_of))
    index, told = found.to_dataframe()
    assert index == "index"
    assert list(told) == list(COLUMNS)
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(ImportError, match="pip install pandas"):
        found.to_dataframe()
