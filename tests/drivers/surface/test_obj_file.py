"""OBJ files against areas known in closed form, whatever else stands among the faces."""

from pathlib import Path

import numpy as np
import pytest

from drivers.errors import MeshError
from drivers.surface.obj_file import read_obj
from drivers.surface.stl_file import SurfaceMesh
from tests.drivers.surface.meshes import Triangles, box, write

UNIT = "".join(f"v {x} {y} {z}\n" for x in (0, 1) for y in (0, 1) for z in (0, 1))
QUADS = ["1 2 4 3", "5 7 8 6", "1 5 6 2", "3 4 8 7", "1 3 7 5", "2 6 8 4"]
FACES = "".join(f"f {quad}\n" for quad in QUADS)


def corners_of(mesh: SurfaceMesh) -> Triangles:
    return np.concatenate([np.asarray(piece, dtype=np.float64) for piece in mesh.pieces()])


def area(triangles: Triangles) -> float:
    return float(0.5 * np.linalg.norm(np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]), axis=1).sum())


def volume(triangles: Triangles) -> float:
    return float(np.einsum("ij,ij->i", triangles[:, 0], np.cross(triangles[:, 1], triangles[:, 2])).sum() / 6)


def polygon(corners: list[tuple[float, float, float]]) -> str:
    return "".join(f"v {x} {y} {z}\n" for x, y, z in corners) + f"f {' '.join(str(i + 1) for i in range(len(corners)))}\n"


def test_a_file_keeps_all_its_digits(tmp_path: Path) -> None:
    cube = box((0, 0, 0), (1 / 3, 2 / 3, 1e5 + 1 / 3))
    rows = [f"v {x!r} {y!r} {z!r}" for x, y, z in cube.reshape(-1, 3).tolist()]
    rows += [f"f {3 * i + 1} {3 * i + 2} {3 * i + 3}" for i in range(len(cube))]
    mesh = read_obj(write(tmp_path / "cube.obj", "\n".join(rows)), scale=2.0)
    assert np.array_equal(corners_of(mesh), 2 * cube)
    assert (mesh.kind, mesh.warnings) == ("OBJ", ())


@pytest.mark.parametrize(
    "text",
    [
        UNIT + "l 1 7\nl 2 8\n" + FACES,
        UNIT + FACES + "l 1 7\nl 2 8\n",
        UNIT + FACES[:30] + "l 1 7\n" + FACES[30:] + "l 2 8\n",
        UNIT.replace("\n", "\r\n") + "l 1 7 8 \\\n 3\n" + FACES + "l 2 8\n",
    ],
)
def test_lines_among_the_faces_are_no_triangles(tmp_path: Path, text: str) -> None:
    mesh = read_obj(write(tmp_path / "cube.obj", text))
    assert mesh.triangles == 12
    assert area(corners_of(mesh)) == pytest.approx(6.0, abs=1e-12)
    assert mesh.warnings == ("only faces are a surface; left out: 2 lines (l)",)


@pytest.mark.parametrize("before", [True, False])
@pytest.mark.parametrize(("element", "what"), [("p 1", "1 points (p)"), ("l 1 2", "1 lines (l)"), ("curv 0 1 1 2", "1 curves (curv)")])
def test_a_point_or_a_line_beside_the_faces_costs_a_note(tmp_path: Path, element: str, what: str, before: bool) -> None:
    text = UNIT + element + "\n" + FACES if before else UNIT + FACES + element + "\n"
    mesh = read_obj(write(tmp_path / "cube.obj", text))
    assert area(corners_of(mesh)) == pytest.approx(6.0, abs=1e-12)
    assert volume(corners_of(mesh)) == pytest.approx(1.0, abs=1e-12) or volume(corners_of(mesh)) == pytest.approx(-1.0, abs=1e-12)
    assert mesh.warnings == (f"only faces are a surface; left out: {what}",)


def test_textures_normals_groups_and_comments_are_read_past(tmp_path: Path) -> None:
    text = "# made for a test\nmtllib x.mtl\no cube\n" + UNIT + "vt 0 0\nvn 0 0 1\ns off\ng all\nusemtl x\n"
    text += "".join(
        "f " + " ".join(f"{v}{mark}" for v in quad.split()) + " # a face\n"
        for quad, mark in zip(QUADS, ["/1/1", "//1", "/1"] * 2, strict=True)
    )
    mesh = read_obj(write(tmp_path / "cube.obj", text))
    assert area(corners_of(mesh)) == pytest.approx(6.0, abs=1e-12)
    assert mesh.warnings == ()


def test_negative_numbers_count_back_from_the_last_vertex_so_far(tmp_path: Path) -> None:
    text = "v 0 0 0\nv 2 0 0\nv 0 3 0\nf -3 -2 -1\nv 9 9 9\nv 9 9 8\n"
    assert area(corners_of(read_obj(write(tmp_path / "one.obj", text)))) == 3.0


@pytest.mark.parametrize("start", range(6))
@pytest.mark.parametrize("turn", [1, -1])
@pytest.mark.parametrize("axis", range(3))
def test_a_hollow_polygon_is_filled_and_not_its_notch(tmp_path: Path, start: int, turn: int, axis: int) -> None:
    shape = [(0, 0), (6, 0), (6, 5), (4, 5), (3, 1), (2, 5)]  # a rectangle but for its corner, and a notch that no fan fills
    shape = [*shape[start:], *shape[:start]][::turn]
    x, y = np.array(shape, dtype=float).T
    true = 0.5 * abs(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y))
    corners = np.roll(np.column_stack([x, y, np.full(6, 2.0)]), axis, axis=1)
    triangles = corners_of(read_obj(write(tmp_path / "notch.obj", polygon([tuple(c) for c in corners.tolist()]))))
    assert len(triangles) == 4
    assert area(triangles) == pytest.approx(true, abs=1e-12)


def test_a_comb_has_its_closed_form_area(tmp_path: Path) -> None:
    teeth = [corner for k in range(5) for corner in ((2.0 * k, 1.0), (2.0 * k + 0.5, 5.0), (2.0 * k + 1.0, 1.0))]
    comb = [(0.0, 0.0), *teeth, (9.0, 0.0)][::-1]
    triangles = corners_of(read_obj(write(tmp_path / "comb.obj", polygon([(x, y, 0.0) for x, y in comb]))))
    assert len(triangles) == len(comb) - 2
    assert area(triangles) == pytest.approx(9.0 + 5 * 2.0, abs=1e-12)  # a bar of 9 x 1 and five teeth of 1 x 4 / 2


@pytest.mark.parametrize("start", range(10))
def test_a_polygon_with_a_bridge_to_its_hole_leaves_the_hole_open(tmp_path: Path, start: int) -> None:
    text = "v 0 0 0\nv 4 0 0\nv 4 4 0\nv 0 4 0\nv 1 1 0\nv 1 2 0\nv 2 2 0\nv 2 1 0\n"
    round_it = ["1", "2", "3", "4", "1", "5", "6", "7", "8", "5"]
    text += f"f {' '.join(round_it[start:] + round_it[:start])}\n"
    triangles = corners_of(read_obj(write(tmp_path / "holed.obj", text)))
    assert area(triangles) == pytest.approx(16.0 - 1.0, abs=1e-12)


@pytest.mark.parametrize("lifted", range(5))
@pytest.mark.parametrize("height", [0.3, -0.3, 3.0])
def test_a_polygon_that_is_not_in_a_plane_keeps_all_its_corners(tmp_path: Path, lifted: int, height: float) -> None:
    corners = [(0.0, 0.0, 0.0), (2.0, 0.0, 0.0), (2.0, 2.0, 0.0), (1.0, 3.0, 0.0), (0.0, 2.0, 0.0)]
    x, y, _ = corners[lifted]
    corners[lifted] = (x, y, height)
    mesh = read_obj(write(tmp_path / "bent.obj", polygon(corners)))
    triangles = corners_of(mesh)
    assert len(triangles) == 3
    assert {tuple(c) for c in triangles.reshape(-1, 3).tolist()} == set(corners)
    flat = triangles.copy()
    flat[:, :, 2] = 0.0
    assert area(flat) == pytest.approx(5.0, abs=1e-12)  # seen from above: a square of 2 x 2 and a gable of 2 x 1 / 2
    assert mesh.warnings[0].startswith("1 polygon(s) are not in a plane (by up to ")


def test_faces_without_area_are_left_out_and_told(tmp_path: Path) -> None:
    mesh = read_obj(write(tmp_path / "cube.obj", UNIT + "f 1 1 2\nf 3 3 3\nf 1 1 2 4 4 3\n" + "".join(FACES.splitlines(keepends=True)[1:])))
    assert area(corners_of(mesh)) == pytest.approx(6.0, abs=1e-12)
    assert mesh.warnings == ("2 face(s) with fewer than three different corners were left out",)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("this is no surface\n", "no face is in it, only other things, or no OBJ at all"),
        (UNIT, "no face is in it"),
        (UNIT + "l 1 2\np 3\n", r"no face is in it \(only faces are a surface; left out: 1 lines \(l\), 1 points \(p\)\)"),
        (UNIT + "f 1 2 9\n", r"line 9: the face names vertex 9, which is not there \(there are 8\)"),
        (UNIT + "f 0 1 2\n", "line 9: the face names vertex 0"),
        (UNIT + "f 1 2 -9\n", "line 9: the face names vertex -9"),
        (UNIT + "f 1 2 x\n", "line 9: 'x' names no vertex"),
        ("v 1 2\n" + UNIT + FACES, "line 1: 'v 1 2' is no corner"),
        ("v 1,0 2 3\n" + UNIT + FACES, "line 1: 'v 1,0 2 3' is no corner"),
        (UNIT.replace("v 1 1 1", "v nan 1 1") + FACES, "x of corner"),
        ("", "empty"),
    ],
)
def test_bad_files_give_one_clear_error(tmp_path: Path, text: str, message: str) -> None:
    with pytest.raises(MeshError, match=message) as caught:
        read_obj(write(tmp_path / "bad.obj", text))
    assert "\n" not in str(caught.value)
    assert "bad.obj" in str(caught.value)
