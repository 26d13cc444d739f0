"""Nominal surfaces from files: faces of STEP exact inside their loops, else with a bound that holds, meshes as they are."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from cmmlink.nominal_files.surface_file import load_surface
from drivers.cad import OcctProcess
from inspection import NominalError
from inspection.surface import CloudSurface, FootKind, PatchSurface, TriangleSurface, TrimmedSurface
from tests.cmmlink.nominal_files.conftest import ROOT
from tests.drivers.surface.meshes import binary_stl, write

TORUS_MM = (30.0, 8.0)  # these are what occt_writer.py makes
BOX_MM = (40.0, 30.0, 20.0)
BORE_PLACE, BORE_AXIS, BORE_RADIUS = np.array([20.0, 15.0, -5.0]), np.array([0.2, 0.0, 1.0]), 8.0


def test_a_torus_of_step_is_exact(cad_files: Path, occt_process: OcctProcess) -> None:
    found = load_surface(cad_files / "torus.step", read_faces=occt_process.read_faces)
    assert isinstance(found.nominal, PatchSurface)
    assert found.nominal.is_closed
    assert found.nominal.nominal_error_mm == 0.0
    assert (found.source_format, found.faces, found.notes) == ("step", 1, ())
    ring, tube = TORUS_MM
    rng = np.random.default_rng(1)
    angle, about, off = rng.uniform(0, 2 * np.pi, (2, 100)), rng.uniform(0, 2 * np.pi, 100), rng.uniform(-3, 3, 100)
    radius = ring + (tube + off) * np.cos(about)
    points = np.column_stack([radius * np.cos(angle[0]), radius * np.sin(angle[0]), (tube + off) * np.sin(about)])
    assert np.abs(found.nominal.project(points).distance_mm - off).max() < 1e-9


def test_trimmed_faces_are_exact_inside_their_loops_and_state_a_bound_elsewhere(
    cad_files: Path, occt_process: OcctProcess, tmp_path: Path
) -> None:
    """Against Open CASCADE's extrema on trimmed faces. Walls of the prism meet smoothly; faces of IGES know nothing of each other."""
    points = np.random.default_rng(2).uniform((-4, -4, -4), (44, 34, 24), (300, 3))
    np.save(tmp_path / "points.npy", points)
    names = ("part.step", "part.igs", "prism.step")
    asked = [
        sys.executable,
        "-m",
        "tests.cmmlink.nominal_files.occt_distances",
        str(tmp_path / "points.npy"),
        *(str(cad_files / name) for name in names),
    ]
    wanted = json.loads(subprocess.run(asked, cwd=ROOT, check=True, capture_output=True, text=True).stdout)
    for name, each in zip(names, wanted, strict=True):
        found = load_surface(cad_files / name, chord_mm=0.05, read_faces=occt_process.read_faces)
        surface = found.nominal
        assert isinstance(surface, TrimmedSurface)
        assert surface.is_closed
        assert found.faces == 7
        assert f"{surface.nominal_error_mm:.2g} mm" in found.notes[0]
        feet = surface.project(points)
        error, exact = np.abs(np.abs(feet.distance_mm) - each), feet.error_mm == 0.0
        assert exact.mean() > 0.7
        assert error[exact].max() < 1e-9
        assert 1e-4 < error.max() <= surface.nominal_error_mm < 0.3
        assert (feet.error_mm[~exact] == surface.nominal_error_mm).all()
        assert not (feet.kind == FootKind.BORDER).any()


def test_what_is_cut_away_is_no_part_and_sides_are_right(cad_files: Path, occt_process: OcctProcess) -> None:
    found = load_surface(cad_files / "part.step", chord_mm=0.01, read_faces=occt_process.read_faces)
    assert "3 of 7 faces are trimmed" in found.notes[0]
    rng = np.random.default_rng(2)
    axis = BORE_AXIS / np.linalg.norm(BORE_AXIS)
    across = np.linalg.svd(axis[None])[2][1:]
    height, angle, off = rng.uniform(9, 20, 300), rng.uniform(0, 2 * np.pi, 300), rng.uniform(-1, 1, 300)
    around = np.cos(angle)[:, None] * across[0] + np.sin(angle)[:, None] * across[1]
    inside = found.nominal.project(BORE_PLACE + height[:, None] * axis + (BORE_RADIUS - off)[:, None] * around)
    assert np.abs(inside.distance_mm - off).max() < 1e-9  # off a bore, the outside is towards its axis
    assert not inside.error_mm.any()
    assert np.unique(inside.face).size == 1
    corner = found.nominal.project([(-1.0, -1.0, -1.0), (1.0, 1.0, 1.0), (BOX_MM[0] + 2, 3, 4), (20, 15, 20.5)])
    assert corner.distance_mm[:3] == pytest.approx([3**0.5, -1, 2], abs=1e-9)
    assert corner.distance_mm[3] > 3  # over the mouth of the bore there is no face


def test_a_mesh_is_taken_as_it_is_and_what_it_stands_for_is_asked(tmp_path: Path) -> None:
    square = np.array([[(0, 0, 0), (100, 0, 0), (100, 50, 0)], [(0, 0, 0), (100, 50, 0), (0, 50, 0)]], dtype=np.float64)
    path = write(tmp_path / "sheet.stl", binary_stl(square))
    found = load_surface(path)
    assert isinstance(found.nominal, TriangleSurface)
    assert (found.source_format, found.faces) == ("binary STL", 2)
    assert "taken for the nominal itself" in found.notes[0]
    assert found.nominal.nominal_error_mm == pytest.approx(np.spacing(np.float32(100)) / 2 * 3**0.5)
    assert found.nominal.project([(3, 4, 0.25)]).distance_mm.tolist() == [0.25]
    stated = load_surface(path, scale=25.4, nominal_error_mm=0.05)
    assert stated.nominal.nominal_error_mm == pytest.approx(0.05, abs=2e-4)
    assert stated.nominal.size_mm == pytest.approx(2540)
    assert stated.notes == ()
    (tmp_path / "sheet.obj").write_text("v 0 0 0\nv 100 0 0\nv 100 50 0\nv 0 50 0\nf 1 2 3 4\n", encoding="ascii")
    assert load_surface(tmp_path / "sheet.obj").nominal.area_mm2 == pytest.approx(5000)


def test_a_cloud_states_its_error(tmp_path: Path) -> None:
    x, y = (axis.ravel() for axis in np.meshgrid(np.arange(30.0), np.arange(20.0)))
    np.savetxt(tmp_path / "sheet.xyz", np.column_stack([x, y, 100 + np.sin(x / 9)]), fmt="%.6f")
    found = load_surface(tmp_path / "sheet.xyz")
    assert isinstance(found.nominal, CloudSurface)
    assert 0 < found.nominal.nominal_error_mm < 0.01
    assert f"{found.nominal.nominal_error_mm:.2g} mm" in found.notes[-1]
    assert abs(found.nominal.project([(15, 10, 100 + np.sin(15 / 9))]).distance_mm[0]) < found.nominal.nominal_error_mm
    with pytest.raises(NominalError, match=r"few\.xyz: a cloud needs more than"):
        load_surface(Path(write(tmp_path / "few.xyz", "1 2 3\n4 5 6\n")))


@pytest.mark.parametrize("order", ["ascii", "binary_little_endian", "binary_big_endian"])
def test_a_cloud_in_ply_brings_its_normals(tmp_path: Path, order: str) -> None:
    x, y = (axis.ravel() for axis in np.meshgrid(np.arange(30.0), np.arange(20.0)))
    table = np.column_stack([x, y, 0.01 * x**2, *np.tile((0.0, 0.0, -1.0), (600, 1)).T, np.arange(600.0)])
    names = ("x", "y", "z", "nx", "ny", "nz", "quality")
    kinds = ["double"] * 3 + ["float"] * 4
    properties = "".join(f"property {kind} {name}\n" for kind, name in zip(kinds, names, strict=True))
    header = f"ply\nformat {order} 1.0\ncomment a scan\nelement vertex 600\n{properties}end_header\n".encode()
    sign = ">" if "big" in order else "<"
    rows = np.rec.fromarrays(
        list(table.T), dtype=[(name, sign + ("f8" if kind == "double" else "f4")) for name, kind in zip(names, kinds, strict=True)]
    )
    body = rows.tobytes() if order != "ascii" else "".join(" ".join(f"{value:g}" for value in row) + "\n" for row in table).encode()
    (tmp_path / "sheet.ply").write_bytes(header + body)
    found = load_surface(tmp_path / "sheet.ply", scale=2.0)
    assert isinstance(found.nominal, CloudSurface)
    assert found.nominal.sides_known
    assert found.source_format == "PLY points"
    assert found.nominal.project([(30, 20, 4.5 + 0.1)]).distance_mm == pytest.approx([-0.1], abs=0.01)
    (tmp_path / "sheet.ply").write_bytes((header + body)[:-40])
    with pytest.raises(NominalError, match=r"sheet\.ply: truncated: it announces 600 vertices"):
        load_surface(tmp_path / "sheet.ply")


def test_a_table_of_points_brings_its_normals_by_name_or_as_six_columns(tmp_path: Path) -> None:
    x, y = (axis.ravel() for axis in np.meshgrid(np.arange(30.0), np.arange(20.0)))
    table = np.column_stack([x, y, np.sin(x / 9), *np.tile((0.0, 0.0, -1.0), (600, 1)).T])
    np.savetxt(tmp_path / "six.xyz", table, fmt="%.6f")
    np.savetxt(tmp_path / "named.asc", table[:, [3, 4, 5, 0, 1, 2]], fmt="%.6f", header="nx ny nz x y z", comments="")
    np.savetxt(tmp_path / "three.xyz", table[:, :3], fmt="%.6f")
    for name, known in (("six.xyz", True), ("named.asc", True), ("three.xyz", False)):
        found = load_surface(tmp_path / name)
        assert isinstance(found.nominal, CloudSurface)
        assert found.nominal.sides_known == known
        assert any("may be judged" in note for note in found.notes) != known
        if known:
            assert found.nominal.normals[:, 2].max() < 0


@pytest.mark.parametrize(
    ("header", "words"),
    [
        ("format text 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n", "no format of PLY"),
        ("format ascii 1.0\nelement edge 3\nproperty int a\n", "first element is not `vertex`"),
        ("format ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n", "no x, y and z"),
        ("format ascii 1.0\nelement vertex 3\nproperty list uchar int x\n", "is no number"),
        ("format ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n", "vertex 2 is no 3 numbers"),
    ],
)
def test_a_cloud_in_ply_that_cannot_be_read_is_refused_in_words(tmp_path: Path, header: str, words: str) -> None:
    (tmp_path / "bad.ply").write_text(f"ply\n{header}end_header\n1 2 3\n4 five 6\n7 8 9\n", encoding="ascii")
    with pytest.raises(NominalError, match=rf"bad\.ply: .*{words}"):
        load_surface(tmp_path / "bad.ply")


def test_what_is_no_surface_is_refused_with_the_file(cad_files: Path, occt_process: OcctProcess, tmp_path: Path) -> None:
    with pytest.raises(NominalError, match=r"wire-AP203-MM\.step: holds no face"):
        load_surface(cad_files / "wire-AP203-MM.step", read_faces=occt_process.read_faces)
    with pytest.raises(NominalError, match="not a format of surfaces"):
        load_surface(tmp_path / "scan.dat")
    with pytest.raises(NominalError, match=r"none\.stl"):
        load_surface(tmp_path / "none.stl")
