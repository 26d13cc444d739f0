"""One call from points in space to the result of a whole surface, from files and arrays, and the same opened from a record."""

from pathlib import Path

import numpy as np
import pytest

import cmmlink as front
from cmmlink import InspectedSurface, PlanError, open_run
from cmmlink.surface_csv import SURFACE_COLUMNS
from drivers import PointFileError
from inspection import Verdict
from inspection.surface import TriangleSurface
from tests.cmmlink.command import cmmlink
from tests.cmmlink.egg import egg_scan, egg_triangles, with_bump, write_egg, write_scan

ZONE = (-0.05, 0.05)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the nominal, and a recorded scan with a bump of 0.3 mm."""
    there = tmp_path_factory.mktemp("egg")
    write_egg(there / "egg.stl")
    scan, nominal = egg_scan()
    write_scan(there / "bump.csv", with_bump(scan, nominal, len(nominal) // 3, 3.0, 0.3))
    asked = ("--nominal", there / "egg.stl", "--tolerance", *ZONE, "--gap-max", 7, "--records", there / "kept", "--json")
    assert cmmlink("surface", there / "bump.csv", *asked).code == 1
    return there


def test_files_arrays_and_a_record_find_the_same_to_the_last_bit(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("cmmlink.report.surface_report.PLACES", 5000)  # by which the nominal is drawn
    kept = open_run("last", records=folder / "kept")
    assert isinstance(kept, InspectedSurface)
    of_file = front.inspect_surface(folder / "bump.csv", nominal=folder / "egg.stl", tolerance=ZONE, gap_max_mm=7.0)
    points = np.loadtxt(folder / "bump.csv", delimiter=",", skiprows=1)
    surface = TriangleSurface(egg_triangles(), kept.nominal.nominal_error_mm)
    of_array = front.inspect_surface(points, nominal=surface, tolerance=ZONE, part="bump", gap_max_mm=7.0)
    for found in (of_file, of_array, kept):
        assert (found.verdict, found.document["verdict"]) == (Verdict.NONCONFORM, "nonconform")
        assert [region["points"] for region in found.document["regions"]] == [found.document["out_of_tolerance"]]
        assert np.array_equal(found.points.deviation_mm, kept.points.deviation_mm)
        assert "points lie beyond the limits" in found.reasons[0]
        assert repr(found).startswith("<InspectedSurface bump")
    assert any("handed over" in note for note in of_array.notes)
    columns = kept.to_columns()
    assert tuple(columns) == tuple(SURFACE_COLUMNS)
    assert np.count_nonzero(columns["verdict"] == "nonconform") == kept.document["out_of_tolerance"]
    assert len(kept.plot().axes) > 4


def test_what_cannot_be_inspected_is_refused(folder: Path) -> None:
    nominal = folder / "egg.stl"
    with pytest.raises(PointFileError, match="points in space need x, y and z"):
        front.inspect_surface(np.zeros((9, 2)), nominal=nominal, tolerance=ZONE)
    with pytest.raises(PlanError, match="nominal is missing"):
        front.inspect_surface(np.zeros((9, 3)), tolerance=ZONE)
    with pytest.raises(PlanError, match="normals have shape"):
        front.inspect_surface(np.zeros((9, 3)), nominal=nominal, tolerance=ZONE, normals=np.zeros((8, 3)))
