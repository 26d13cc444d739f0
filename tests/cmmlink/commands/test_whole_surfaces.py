"""A scan of a whole surface, from its files to a recorded verdict, and what is done with the record afterwards."""

import csv
import json
from pathlib import Path

import numpy as np
import pytest

from cmmlink.result_keys import Recorded
from cmmlink.surface_csv import SURFACE_COLUMNS
from cmmlink.surface_keys import SurfaceMeasured, SurfaceRecorded, SurfaceReplayed, SurfacesCompared
from tests.cmmlink.command import Ended, cmmlink
from tests.cmmlink.egg import MOVED_MM, ROTATION, Array, egg_scan, egg_triangles, on_machine, with_bump, write_egg, write_scan
from tests.drivers.surface.meshes import binary_stl, box
from tests.drivers.test_scan_file import ply as ply_of

GAP = ("--gap-max", 7)


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the nominal, a good scan and one with a bump of 0.3 mm."""
    folder = tmp_path_factory.mktemp("egg")
    write_egg(folder / "egg.stl")
    scan, nominal = egg_scan()
    write_scan(folder / "good.csv", scan)
    write_scan(folder / "bump.csv", with_bump(scan, nominal, len(nominal) // 3, 3.0, 0.3))
    (folder / "plan.yaml").write_text(
        "part: {name: egg}\nsurface: {file: egg.stl}\ntolerance: {lower_mm: -0.05, upper_mm: 0.05}\n"
        "device: {type: file, file: good.csv}\ngap_max_mm: 7\nrecords: kept\nout: results\n",
        encoding="utf-8",
    )
    return folder


def surface(folder: Path, scan: str, *options: object) -> Ended:
    nominal, tolerance = ("--nominal", folder / "egg.stl"), ("--tolerance", -0.05, 0.05)
    return cmmlink("surface", folder / scan, *nominal, *tolerance, *GAP, *options)


def test_a_good_part_conforms_and_its_pose_is_found(files: Path, tmp_path: Path) -> None:
    done = surface(files, "good.csv", "--json", "--out", tmp_path / "out", "--records", tmp_path / "records")
    found = done.json()
    SurfaceRecorded.model_validate(found)
    assert (done.code, found["verdict"], found["reasons"], found["lost"]) == (0, "conform", [], 0)
    assert found["received"] == found["judged"] + found["rejected"]
    pose = found["registration"]
    np.testing.assert_allclose(pose["rotation"], ROTATION.T, atol=1e-7)
    np.testing.assert_allclose(pose["translation_mm"], -ROTATION.T @ MOVED_MM, atol=1e-6)
    assert found["coverage"] == found["area_covered"] == 1.0
    assert found["nominal"]["triangles"] == 400
    written = json.loads((tmp_path / "out" / "result.json").read_text(encoding="utf-8"))
    assert written == found


def test_the_folder_holds_a_line_and_a_vertex_for_every_point(files: Path, tmp_path: Path) -> None:
    found = surface(files, "bump.csv", "--json", "--out", tmp_path, "--no-record").json()
    SurfaceMeasured.model_validate(found)
    with (tmp_path / "deviations.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    assert list(rows[0]) == list(SURFACE_COLUMNS)
    assert len(rows) == found["received"]
    worst = max(rows, key=lambda row: float(row["deviation_mm"]))
    assert float(worst["deviation_mm"]) == pytest.approx(found["worst"]["deviation_mm"], abs=1e-6)
    assert int(worst["face"]) == found["worst"]["face"]
    foot = np.array([float(worst[f"foot_{axis}_mm"]) for axis in "xyz"])
    place = np.array([float(worst[f"{axis}_mm"]) for axis in "xyz"])
    assert np.linalg.norm(place - foot) == pytest.approx(float(worst["deviation_mm"]), abs=2e-6)
    head, _, body = (tmp_path / "deviations.ply").read_bytes().partition(b"end_header\n")
    assert f"element vertex {len(rows)}".encode() in head
    points = np.frombuffer(body, dtype=[("place", "<f8", 3), ("deviation", "<f4"), ("colour", "u1", 3)])
    assert points["deviation"].max() == np.float32(found["worst"]["deviation_mm"])
    assert len({tuple(colour) for colour in points["colour"].tolist()}) > 2


def test_a_bump_is_one_region_with_its_height_and_place(files: Path) -> None:
    done = surface(files, "bump.csv", "--json", "--no-record")
    found, (_, nominal) = done.json(), egg_scan()
    assert (done.code, found["verdict"]) == (1, "nonconform")
    (region,) = found["regions"]
    assert 0.2 < region["worst_mm"] < 0.31
    assert np.linalg.norm(np.array(region["worst_at_mm"]) - nominal[len(nominal) // 3]) < 3.5
    told = surface(files, "bump.csv", "--no-record")
    assert told.out.startswith("NOT CONFORM")
    assert "out of tolerance: " in told.out


def test_the_chord_tolerance_of_a_mesh_counts_like_the_uncertainty(files: Path) -> None:
    done = surface(files, "good.csv", "--json", "--no-record", "--chord", 0.06)
    found = done.json()
    assert (done.code, found["verdict"]) == (3, "uncertain")
    assert found["nominal"]["error_mm"] == pytest.approx(0.06, abs=1e-5)
    assert any("STEP" in reason["words"] for reason in found["reasons"])


def test_the_pose_of_an_earlier_result_is_a_datum(files: Path, tmp_path: Path) -> None:
    surface(files, "good.csv", "--no-record", "--out", tmp_path)
    kept = surface(files, "good.csv", "--json", "--no-record", "--start", tmp_path / "result.json", "--fit", "none").json()
    assert (kept["rule"], kept["verdict"], kept["registration"]["steps"]) == ("datum", "conform", 0)
    held = surface(files, "bump.csv", "--json", "--no-record", "--start", tmp_path / "result.json", "--locked", "x,y,z,rx,ry,rz").json()
    assert held["rule"] == "datum"
    assert held["regions"][0]["worst_mm"] > 0.25  # no fit gives way to the bump


def test_centres_of_a_ball_are_judged_by_what_it_touched(tmp_path: Path) -> None:
    write_egg(tmp_path / "egg.stl")
    centres, _ = egg_scan(out_mm=0.5)
    write_scan(tmp_path / "centres.csv", centres)
    wrong = cmmlink(
        "surface", tmp_path / "centres.csv", "--nominal", tmp_path / "egg.stl", "--tolerance", -0.05, 0.05, *GAP, "--json", "--no-record"
    )
    right = surface(tmp_path, "centres.csv", "--json", "--no-record", "--tip-radius", 0.5)
    assert (wrong.code, right.code) == (1, 0)
    assert abs(right.json()["max_deviation_mm"]) < 1e-3  # a ball in a hollow between two facets would touch both


@pytest.mark.parametrize(
    ("options", "told"),
    [
        (("--nominal", "none.stl"), "none.stl"),
        (("--nominal", "good.csv"), "not a format of surfaces"),
        (("--locked", "z"), "--locked: expected no freedom without a start"),
        (("--locked", "w"), "--locked"),
        (("--fit", "none", "--reject-outliers"), "--reject-outliers"),
        (("--start", "plan.yaml"), "this is no JSON; expected JSON with rotation"),
        (("--start", "none.json"), "cannot be read"),
        (("--uncertainty", 0.05), "--uncertainty"),
        (("--nominal", "part.step", "--scale", 25.4), "a CAD file states its own unit"),
        (("--nominal", "part.step", "--chord", 0), "expected a chord above 0"),
    ],
)
def test_what_cannot_be_used_is_told_by_its_option(
    files: Path, monkeypatch: pytest.MonkeyPatch, options: tuple[object, ...], told: str
) -> None:
    monkeypatch.chdir(files)
    assert told in surface(files, "good.csv", "--no-record", *options).refused()


def test_a_pose_that_is_no_rotation_is_refused(files: Path, tmp_path: Path) -> None:
    pose = tmp_path / "pose.json"
    pose.write_text(json.dumps({"rotation": [[1, 0, 0], [0, 1, 0], [0, 0, -1]], "translation_mm": [0, 0, 0]}), encoding="utf-8")
    assert "three rows of length 1 at right angles" in surface(files, "good.csv", "--no-record", "--start", pose).refused()
    assert "no such file" in surface(files, "absent.csv", "--no-record").refused()


def test_a_recorded_run_is_replayed_judged_again_and_exported(files: Path, tmp_path: Path) -> None:
    records = ("--records", tmp_path / "records")
    run = surface(files, "bump.csv", "--json", *records).json()
    again = cmmlink("replay", "last", "--json", *records)
    SurfaceReplayed.model_validate(again.json())
    assert (again.code, again.json()["identical"]) == (1, True)
    wider = cmmlink("replay", "last", "--set", "tolerance.upper_mm=0.4", "--reason", "a test", "--operator", "me", "--json", *records)
    assert (wider.code, wider.json()["verdict"]) == (0, "conform")
    assert [change["key"] for change in wider.json()["changed"]] == ["tolerance.upper_mm"]
    assert "method is no key of a plan" in cmmlink("replay", "last", "--method", "pcp", *records).refused()
    assert cmmlink("verify", *records).code == 0
    assert "a test" in cmmlink("show", "last", *records).out
    (listed,) = cmmlink("runs", "--json", *records).json()["runs"]
    assert (listed["run"], listed["verdict"]) == (run["run"], "nonconform")
    assert cmmlink("export", "last", "--format", "json", "--format", "csv", "--out", tmp_path / "both", *records).code == 0
    exported = json.loads((tmp_path / "both" / f"{run['run']}.json").read_text(encoding="utf-8"))
    assert exported == run
    assert "expected json or csv" in cmmlink("export", "last", "--format", "qif", *records).refused()
    assert cmmlink("export", "last", "--out", tmp_path / "all", *records).code == 0
    assert cmmlink("replay", tmp_path / "all", "--json").json()["identical"] is True


def test_two_runs_of_a_surface_are_compared_place_by_place(files: Path, tmp_path: Path) -> None:
    records = ("--records", tmp_path)
    for scan in ("good.csv", "bump.csv"):
        surface(files, scan, "--json", "--fit", "none", "--start", pose_file(tmp_path), *records)
    done = cmmlink("compare", "last~1", "last", "--json", *records)
    found, (_, nominal) = done.json(), egg_scan()
    SurfacesCompared.model_validate(found)
    assert (done.code, found["compared"]) == (0, 1.0)
    largest = found["largest"]
    assert 0.2 < largest["difference_mm"] < 0.31
    assert largest["difference_mm"] == pytest.approx(largest["second_mm"] - largest["first_mm"])
    assert np.linalg.norm(np.array(largest["place_mm"]) - nominal[len(nominal) // 3]) < 3.5
    away = [place for place in found["places"] if np.linalg.norm(np.array(place["place_mm"]) - nominal[len(nominal) // 3]) > 12.0]
    assert away
    assert all(abs(place["difference_mm"]) < 1e-6 for place in away)
    told = cmmlink("compare", "last~1", "last", *records).out
    assert "second - first: mean" in told
    assert "no drawing" in cmmlink("compare", "last~1", "last", "--out", tmp_path / "a.png", *records).refused()


def plate_seen(folder: Path) -> tuple[Array, Array]:
    """Write a plate of 1 mm, and give points on its six sides with their outward directions: on top those of a hollow 0.7 mm deep."""
    (folder / "plate.stl").write_bytes(binary_stl(box((0.0, 0.0, 0.0), (12.0, 8.0, 1.0))))
    x, y = (axis.ravel() for axis in np.meshgrid(np.arange(0.25, 12.0, 0.5), np.arange(0.25, 8.0, 0.5)))
    top = np.where((np.abs(x - 6.0) < 1.0) & (np.abs(y - 4.0) < 1.0), 0.3, 1.0)
    faces = [np.column_stack([x, y, top]), np.column_stack([x, y, np.zeros_like(x)])]
    outward = [np.tile([0.0, 0.0, 1.0], (len(x), 1)), np.tile([0.0, 0.0, -1.0], (len(x), 1))]
    along, up = (axis.ravel() for axis in np.meshgrid(np.arange(0.25, 12.0, 0.5), [0.25, 0.75]))
    for axis, far, most in ((0, 12.0, 8.0), (1, 8.0, 12.0)):
        here = along < most
        for place, sign in ((0.0, -1.0), (far, 1.0)):
            faces.append(np.insert(np.column_stack([along, up])[here], axis, place, axis=1))
            outward.append(np.tile(sign * np.eye(3)[axis], (int(here.sum()), 1)))
    return np.concatenate(faces), np.concatenate(outward)


def test_normals_of_a_scan_are_judged_by_recorded_replayed_and_exported(tmp_path: Path) -> None:
    """The hollow is nearer to the underside: only who knows from where it was seen finds it 0.7 mm deep."""
    points, outward = plate_seen(tmp_path)
    np.savetxt(tmp_path / "scan.csv", np.hstack([points, outward]), delimiter=",", header="x,y,z,nx,ny,nz", comments="")
    (tmp_path / "scan.ply").write_bytes(ply_of(points, outward))
    write_scan(tmp_path / "blind.csv", points)
    options = ("--nominal", tmp_path / "plate.stl", "--tolerance", -0.5, 0.5, "--fit", "none", "--gap-max", 1, "--gross", 2)
    records = ("--records", tmp_path / "records")
    seen, of_ply = (cmmlink("surface", tmp_path / name, *options, "--json", *records).json() for name in ("scan.csv", "scan.ply"))
    blind = cmmlink("surface", tmp_path / "blind.csv", *options, "--json", "--no-record").json()
    assert seen["min_deviation_mm"] == of_ply["min_deviation_mm"] == pytest.approx(-0.7)
    assert (seen["verdict"], seen["regions"]) == ("nonconform", of_ply["regions"])
    assert blind["min_deviation_mm"] == pytest.approx(-0.3)
    assert "scan.csv: the normals are those of the file of the scan" in seen["notes"]
    assert any(note.startswith("blind.csv: the file has no normals") for note in blind["notes"])
    assert cmmlink("replay", "last~1", "--json", *records).json()["identical"] is True
    assert cmmlink("verify", *records).code == 0
    assert cmmlink("export", "last", "--out", tmp_path / "all", *records).code == 0
    np.testing.assert_array_equal(np.load(tmp_path / "all" / "points.npy")[:, 2:], np.hstack([points, outward]))
    assert (tmp_path / "all" / "points.csv").read_text(encoding="utf-8").startswith("sequence,time_s,x_mm,y_mm,z_mm,nx,ny,nz\n")
    assert cmmlink("replay", tmp_path / "all", "--json").json()["identical"] is True


def test_the_vertices_of_a_mesh_are_judged_and_one_inside_out_is_not_measured(tmp_path: Path) -> None:
    write_egg(tmp_path / "egg.stl")
    triangles = on_machine(egg_triangles(34, 58).reshape(-1, 3)).reshape(-1, 3, 3)
    (tmp_path / "scan.stl").write_bytes(binary_stl(triangles))
    (tmp_path / "inside-out.stl").write_bytes(binary_stl(triangles[:, ::-1]))
    done = surface(tmp_path, "scan.stl", "--json", "--no-record", "--chord", 0.5)
    found = done.json()
    assert (found["received"], found["judged"], found["lost"]) == (32 * 58 + 2, 32 * 58 + 2, 0), found["reasons"]
    assert any("1858 vertices are judged, each once" in note for note in found["notes"])
    assert "turn out of the material" in surface(tmp_path, "inside-out.stl", "--no-record", "--chord", 0.5).refused()


def pose_file(folder: Path) -> Path:
    """The pose at which the part lies on the machine, as a person writes it down."""
    pose = folder / "pose.json"
    turned = {"rotation": ROTATION.T.tolist(), "translation_mm": (-ROTATION.T @ MOVED_MM).tolist()}
    pose.write_text(json.dumps(turned), encoding="utf-8")
    return pose


def test_a_plan_is_checked_and_run(files: Path) -> None:
    plan = files / "plan.yaml"
    assert "can be run: egg" in cmmlink("check", plan).out
    done = cmmlink("run", plan, "--json", "--serial", "0007")
    found = done.json()
    assert (done.code, found["serial_number"], found["verdict"]) == (0, "0007", "conform")
    assert (files / "results" / "result.json").exists()
    assert cmmlink("replay", "0007", "--records", files / "kept", "--json").json()["identical"] is True


@pytest.mark.parametrize(
    ("line", "told"),
    [
        ("surface: {file: gone.stl}", "line 2: surface.file: "),
        ("surface: {file: egg.stl, chrod_mm: 1}", "did you mean chord_mm?"),
        ("registration: {locked: [z]}", "no freedom without a start"),
        ("device: {type: dme, address: 'h:1'}", "a scan of type circle, line or unknown"),
    ],
)
def test_a_mistake_in_a_plan_is_told_with_its_line(files: Path, line: str, told: str) -> None:
    key = line.partition(":")[0]
    lines = [each for each in (files / "plan.yaml").read_text(encoding="utf-8").splitlines() if not each.startswith(f"{key}:")]
    wrong = files / "wrong.yaml"
    wrong.write_text("\n".join([lines[0], line, *lines[1:]]) + "\n", encoding="utf-8")
    assert told in cmmlink("check", wrong).refused()
    assert told in cmmlink("run", wrong, "--headless").refused()


def test_a_section_of_a_scan_is_judged_and_recorded_like_any_section(files: Path, tmp_path: Path) -> None:
    cut = ("--section", 0, 0, 1, 0, 0, 1, "--slab", 1, "--json", "--records", tmp_path)
    good = surface(files, "good.csv", *cut)
    found = good.json()
    Recorded.model_validate(found)
    assert (good.code, found["verdict"], found["rule"]) == (0, "conform", "minimum-zone"), found["reasons"]
    assert abs(found["max_deviation_mm"]) < 1e-3
    assert any("moved along the surface" in note for note in found["notes"])
    centres, _ = egg_scan(out_mm=0.5)
    write_scan(tmp_path / "centres.csv", centres)
    write_egg(tmp_path / "egg.stl")
    of_ball = surface(tmp_path, "centres.csv", "--tip-radius", 0.5, *cut[:-2], "--no-record")
    assert of_ball.code == 0, of_ball.out
    missed = surface(files, "good.csv", "--section", 0, 0, 90, 0, 0, 1, "--no-record")
    assert "too few for one" in missed.refused()
    assert "expected --section beside it" in surface(files, "good.csv", "--slab", 1, "--no-record").refused()
