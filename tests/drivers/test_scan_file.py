"""Scans from meshes and clouds: every vertex once, in order, with the normals of closed forms; what cannot be a scan is refused."""

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from drivers import PointFileError, read_points
from drivers.scan_file import read_scan
from tests.drivers.surface.meshes import Triangles, ascii_stl, binary_stl, box

CORNERS = np.array([[x, y, z] for x in (0.0, 4.0) for y in (0.0, 3.0) for z in (0.0, 2.0)])
DIRECTIONS = np.sign(CORNERS - CORNERS.mean(axis=0)) / np.sqrt(3.0)
BOX: Triangles = box((0.0, 0.0, 0.0), (4.0, 3.0, 2.0))
ZERO, A, B, C = (0.0, 0.0, 0.0), (4.0, 0.0, 0.0), (0.0, 3.0, 0.0), (0.0, 0.0, 2.0)
TETRAHEDRON: Triangles = np.array([[ZERO, B, A], [ZERO, A, C], [ZERO, C, B], [A, B, C]])
ENDLESS = b"ply\nformat ascii 1.0\nelement vertex 900000000000\nproperty float x\nproperty float y\nproperty float z\nend_header\n1 2 3\n"


def faces_of(triangles: Triangles) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Corners, each as often as triangles have it, and triangles as their numbers."""
    return triangles.reshape(-1, 3), np.arange(3 * len(triangles)).reshape(-1, 3)


def ply(points: NDArray[np.float64], normals: NDArray[np.float64] | None = None, faces: NDArray[np.int64] | None = None) -> bytes:
    columns = ["x", "y", "z", *(["nx", "ny", "nz"] if normals is not None else [])]
    head = [f"element vertex {len(points)}", *(f"property double {name}" for name in columns)]
    head += [f"element face {len(faces)}", "property list uchar int vertex_indices"] if faces is not None else []
    rows = points if normals is None else np.hstack([points, normals])
    body = rows.astype("<f8").tobytes() + b"".join(b"\x03" + row.astype("<i4").tobytes() for row in (faces if faces is not None else ()))
    return "\n".join(["ply", "format binary_little_endian 1.0", *head, "end_header\n"]).encode() + body


def obj(triangles: Triangles) -> bytes:
    corners, faces = faces_of(triangles)
    lines = [*(f"v {x} {y} {z}" for x, y, z in corners), *(f"f {a} {b} {c}" for a, b, c in faces + 1)]
    return "\n".join(lines).encode()


def test_every_vertex_of_a_mesh_is_one_point_with_the_normal_of_the_triangles_around_it(tmp_path: Path) -> None:
    """The area vectors of a closed mesh sum to zero: at a corner of a tetrahedron that of the opposite side is what the others sum to."""
    meshes = {"scan.stl": binary_stl(TETRAHEDRON), "scan.STL": ascii_stl(TETRAHEDRON).upper().encode(), "scan.obj": obj(TETRAHEDRON)}
    for name, content in meshes.items():
        (tmp_path / name).write_bytes(content)
        found = read_scan(tmp_path / name)
        np.testing.assert_array_equal(found.points_mm, [[0, 0, 0], [0, 3, 0], [4, 0, 0], [0, 0, 2]])  # in their order
        np.testing.assert_array_equal(found.normals, [[-6, -8, -12], [0, 8, 0], [6, 0, 0], [0, 0, 12]])
        assert "4 vertices are judged, each once; its 4 triangles, whose edges are 3.8 mm long in the middle" in found.notes[-2]
        assert found.notes[0] == "it states no unit, taken as mm: the scan is 4 x 3 x 2 mm large"


@pytest.mark.usefixtures("open3d")
def test_a_ply_mesh_gives_all_its_vertices_those_in_no_face_as_well(tmp_path: Path) -> None:
    corners, faces = faces_of(BOX)
    path = tmp_path / "scan.ply"
    path.write_bytes(ply(np.vstack([corners, [[9.0, 9.0, 9.0], [np.nan, 0.0, 0.0]]]), faces=faces))
    found = read_scan(path, unit="inch")
    assert len(found.points_mm) == 10
    np.testing.assert_allclose(found.points_mm[8], [228.6, 228.6, 228.6])
    assert np.isnan(found.points_mm[9]).any()  # rejected, and counted so
    assert found.normals is not None
    assert (found.normals[8:] == 0.0).all()  # what is not known of it is not said
    assert (np.sign(found.normals[:8]) == np.sign(found.points_mm[:8] - 25.4 * np.array([2.0, 1.5, 1.0]))).all()
    assert found.notes[0].startswith("read in inch, as asked: the scan is 228.6 x")


def test_a_ply_cloud_keeps_its_rows_and_brings_its_normals(tmp_path: Path) -> None:
    path = tmp_path / "scan.ply"
    path.write_bytes(ply(np.vstack([CORNERS, CORNERS]), np.vstack([DIRECTIONS, DIRECTIONS])))
    found = read_scan(path, scale=1000.0)
    np.testing.assert_array_equal(found.points_mm, np.vstack([1000.0 * CORNERS] * 2))
    np.testing.assert_array_equal(found.normals, np.vstack([DIRECTIONS] * 2))
    assert found.notes[-1] == "the normals are those of the file of the scan"
    path.write_bytes(ply(CORNERS))
    assert read_scan(path).normals is None
    assert read_scan(path).notes[-1].endswith("is decided by distance alone")


def test_a_ply_mesh_with_normals_of_its_own_keeps_them(tmp_path: Path) -> None:
    """A corner that stands there for each side gets the sum of its normals: that of a box points along its diagonal."""
    corners, _ = faces_of(BOX)
    sides = np.repeat(np.cross(BOX[:, 1] - BOX[:, 0], BOX[:, 2] - BOX[:, 0]), 3, axis=0)
    each = np.unique(np.hstack([corners, np.sign(sides)]), axis=0)
    path = tmp_path / "scan.ply"
    path.write_bytes(ply(each[:, :3], each[:, 3:], faces=np.arange(len(each)).reshape(-1, 3)))
    found = read_scan(path)
    assert len(found.points_mm) == len(each) / 3 == 8
    np.testing.assert_array_equal(found.normals, np.sign(found.points_mm - [2.0, 1.5, 1.0]))
    assert found.notes[1:] == (
        "a mesh as the scan: its 8 vertices are judged, each once; its faces are not",
        "the normals are those of the file of the scan",
    )


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("scan.csv", "x,y,z,nx,ny,nz\n{rows}"),
        ("scan.csv", "n_x,n_y,x,y,z,NX,NY,NZ\n{shifted}"),
        ("scan.xyz", "{rows}"),
    ],
)
def test_a_table_brings_its_normals_by_name_or_as_the_last_three_of_six(name: str, content: str, tmp_path: Path) -> None:
    rows = [",".join(map(repr, row)) for row in np.hstack([CORNERS, DIRECTIONS]).tolist()]
    text = content.format(rows="\n".join(rows), shifted="\n".join(f"7,7,{row}" for row in rows))
    (tmp_path / name).write_text(text, encoding="utf-8")
    found = read_scan(tmp_path / name)
    np.testing.assert_array_equal(found.points_mm, CORNERS)
    np.testing.assert_array_equal(found.normals, DIRECTIONS)
    assert found.notes[-1] == "the normals are those of the file of the scan"
    assert not any("nx" in note.lower() for note in found.notes)  # they are not left out


def test_an_array_of_six_columns_has_normals_where_all_have_length_1(tmp_path: Path) -> None:
    np.save(tmp_path / "scan.npy", np.hstack([CORNERS, DIRECTIONS]))
    found = read_scan(tmp_path / "scan.npy")
    np.testing.assert_array_equal(found.points_mm, CORNERS)
    np.testing.assert_array_equal(found.normals, DIRECTIONS)
    of_directions = read_scan(tmp_path / "scan.npy", columns={"x": 4, "y": 5, "z": 6})  # what is asked for goes above what is found
    np.testing.assert_array_equal(of_directions.points_mm, DIRECTIONS)
    assert of_directions.normals is None
    np.save(tmp_path / "scan.npy", np.hstack([CORNERS, 2 * DIRECTIONS]))
    with pytest.raises(PointFileError, match=r"shape \(8, 6\); expected"):
        read_scan(tmp_path / "scan.npy")


@pytest.mark.parametrize(
    ("name", "content", "told"),
    [
        ("a.stl", binary_stl(BOX[:0]), "holds no triangle"),
        ("a.stl", binary_stl(BOX, count=2**32 - 1), "promises 4294967295 triangles"),
        ("a.stl", binary_stl(np.where(BOX == 4.0, np.nan, BOX)), "is nan"),
        ("a.obj", b"v 0 0 0\nv 1 0 0\n", "no face is in it"),
        ("a.ply", ENDLESS, "truncated"),
        ("a.ply", ply(CORNERS[:1]), "a scan of 1 points"),
        ("a.ply", b"no ply", "no PLY file"),
        ("b.ply", None, "b.ply"),
    ],
)
def test_what_is_no_scan_is_refused_with_its_name(name: str, content: bytes | None, told: str, tmp_path: Path) -> None:
    if content is not None:
        (tmp_path / name).write_bytes(content)
    with pytest.raises(PointFileError, match=told) as raised:
        read_scan(tmp_path / name)
    assert name in str(raised.value)


def test_a_mesh_is_no_table_of_points_of_a_section(tmp_path: Path) -> None:
    (tmp_path / "a.stl").write_bytes(binary_stl(BOX))
    with pytest.raises(PointFileError, match="STL is the format of a scan of a whole surface, and no table of points"):
        read_points(tmp_path / "a.stl")


def test_columns_and_marks_are_for_tables(tmp_path: Path) -> None:
    (tmp_path / "a.stl").write_bytes(binary_stl(BOX))
    with pytest.raises(PointFileError, match="columns are given for a table"):
        read_scan(tmp_path / "a.stl", columns={"x": 1, "y": 2})
    with pytest.raises(PointFileError, match="values that mean no point are given for a table"):
        read_scan(tmp_path / "a.stl", invalid=[-9999.0])
