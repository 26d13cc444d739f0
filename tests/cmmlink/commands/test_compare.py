"""The command `compare`: two runs, a run and a file, two files; what is told and drawn is the difference that the parts have."""

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pypdf import PdfReader

from cmmlink.comparison_keys import Compared
from cmmlink.record.store import FILE_NAME
from tests.cmmlink.command import cmmlink
from tests.cmmlink.commands.oval_files import TOLERANCE
from tests.cmmlink.oval_part import oval_points, write_nominal, write_points

BUMP = slice(100, 110)


def deviation() -> Any:
    return 0.01 * np.sin(np.arange(360) / 20)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The records of two parts at a known pose, of which the second has 0.06 mm more at ten points; the files lie beside them."""
    folder = tmp_path_factory.mktemp("compared")
    write_nominal(folder / "oval.yaml")
    changed = deviation()
    changed[BUMP] += 0.06
    for name, one in (("a", deviation()), ("b", changed)):
        write_points(folder / f"{name}.csv", oval_points(one))
        how = ("--nominal", folder / "oval.yaml", *TOLERANCE, "--fit", "none", "--records", folder)
        assert cmmlink("inspect", folder / f"{name}.csv", *how).code in (0, 1)
    return folder


def runs(folder: Path) -> list[str]:
    return [line["run"] for line in cmmlink("runs", "--records", folder, "--json").json()["runs"]]


def compared(folder: Path, *arguments: object) -> dict[str, Any]:
    found = cmmlink("compare", *arguments, "--records", folder, "--json").json()
    Compared.model_validate(found)
    return found


def test_two_runs_differ_by_what_their_parts_differ_by_where_they_do(folder: Path, tmp_path: Path) -> None:
    first, second = runs(folder)
    found = compared(folder, first, second, "--out", tmp_path / "a.pdf")
    assert (found["first"]["name"], found["second"]["name"]) == (first, second)
    assert (found["first"]["verdict"], found["second"]["verdict"]) == ("conform", "nonconform")
    assert found["compared"] == pytest.approx(1.0)
    worst = found["largest"]
    assert worst["difference_mm"] == pytest.approx(0.06, abs=1e-8)
    assert worst["second_mm"] - worst["first_mm"] == worst["difference_mm"]
    bump = oval_points(0.0)[BUMP]
    assert np.hypot(*(bump - [worst["x_mm"], worst["y_mm"]]).T).min() < 1e-3
    assert [row["largest"]["difference_mm"] > 0.01 for row in found["stretches"]].count(True) == 1
    told = re.sub(r"\s+", " ", PdfReader(tmp_path / "a.pdf").pages[0].extract_text())
    assert f"largest {worst['difference_mm']:+.4f} mm at station {worst['station_mm']:.2f} mm" in told.replace("\u2212", "-")
    assert f"mean {found['mean_mm']:+.4f} mm, rms {found['rms_mm']:.4f} mm" in told
    assert first in told
    assert "Both lie where they were measured" in told
    back = compared(folder, second, first)
    assert back["largest"]["difference_mm"] == -worst["difference_mm"]
    assert back["mean_mm"] == pytest.approx(-found["mean_mm"], abs=1e-15)


def test_a_run_and_the_file_that_it_was_measured_from_do_not_differ(folder: Path, tmp_path: Path) -> None:
    said = cmmlink("compare", folder / "b.csv", "last", "--fit", "none", "--records", folder, "-o", tmp_path / "a.svg")
    assert said.code == 0
    assert "largest difference +0.0000 mm at station" in said.out
    pose = "fit none, target 0 mm: turned 0.0000 deg, moved (0.0000, 0.0000) mm"
    run = runs(folder)[1]
    assert f"first   file b: 360 points judged\n        {pose}\nsecond  run {run}, b, measured 2" in said.out
    assert "<svg" in (tmp_path / "a.svg").read_text(encoding="utf-8")


def test_two_files_that_lie_anywhere_are_fitted_and_that_is_said(folder: Path, tmp_path: Path) -> None:
    """The same part turned by 9 degrees and moved by 50 mm; half a turn further it fits as well."""
    turn = np.radians(9.0)
    there = oval_points(deviation()) @ np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]]) + [50.0, -20.0]
    moved = write_points(tmp_path / "moved.csv", there)
    found = compared(folder, folder / "a.csv", moved, "--nominal", folder / "oval.yaml")
    assert found["first"]["fit"] == found["second"]["fit"] == "best-fit"
    half_turns = (found["second"]["rotation_deg"] - found["first"]["rotation_deg"] + 9.0) / 180
    assert half_turns == pytest.approx(round(half_turns), abs=1e-3)
    if round(half_turns) % 2 == 0:
        assert abs(found["largest"]["difference_mm"]) < 1e-6
    assert found["notes"][0].startswith("Each has a fit of its own")
    assert found["notes"][1].startswith("The part fits in other poses as well")
    assert found["first"]["verdict"] is None


def test_what_only_one_of_them_measured_is_not_compared(folder: Path, tmp_path: Path) -> None:
    part = write_points(tmp_path / "part.csv", oval_points(deviation())[40:160])
    found = compared(folder, "last", part, "--fit", "none", "--out", tmp_path / "a.png")
    assert 0.25 < found["compared"] < 0.4
    assert [row["largest"] is None for row in found["stretches"]].count(True) > 6
    assert (tmp_path / "a.png").read_bytes().startswith(b"\x89PNG")


def test_what_cannot_be_compared_is_refused_with_the_cause(folder: Path, tmp_path: Path) -> None:
    points = write_points(tmp_path / "points.csv", oval_points(0.0))
    options = ("--nominal", folder / "oval.yaml", "--scale", 1.05, "--tolerance", -1, 1, "--fit", "none", "--records", folder)
    cmmlink("inspect", points, *options)
    *_, first, other = runs(folder)
    refused = cmmlink("compare", first, other, "--records", folder).refused()
    assert "have different nominals, oval.yaml (56.7233 mm long) and oval.yaml (59.5595 mm long)" in refused
    a, b = folder / "a.csv", folder / "b.csv"
    assert "--nominal FILE says what both are compared with" in cmmlink("compare", a, b).refused()
    assert "a recorded run brings its own nominal" in cmmlink("compare", a, first, "--nominal", folder / "oval.yaml").refused()
    assert "no drawing is known by the suffix '.gif'" in cmmlink("compare", a, b, "-o", "c.gif").refused()
    assert "there is no run 'nobody'" in cmmlink("compare", a, "nobody", "--records", folder).refused()
    gone = tmp_path / "gone.csv"
    for asked in ((), ("--nominal", folder / "oval.yaml")):
        assert cmmlink("compare", a, gone, *asked, "--records", folder).refused().startswith(f"{gone}: no such file, and no such run")
    halves = [write_points(tmp_path / f"{k}.csv", oval_points(0.0)[part]) for k, part in enumerate((slice(10, 150), slice(200, 350)))]
    refused = cmmlink("compare", *halves, "--nominal", folder / "oval.yaml", "--fit", "none").refused()
    assert "have no place of the profile in common that both measured" in refused
    content = (folder / FILE_NAME).read_bytes()
    (tmp_path / "altered").mkdir()
    (tmp_path / "altered" / FILE_NAME).write_bytes(content.replace(b"nonconform", b"uncertainX", 1))
    assert "what was altered is not compared" in cmmlink("compare", a, first, "--records", tmp_path / "altered").failed(5)
