"""STL files, good and bad: each bad kind gives one error with its place, or a stated warning; none gives an empty surface."""

import os
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from drivers.errors import MeshError
from drivers.surface.obj_file import read_obj
from drivers.surface.stl_file import SurfaceMesh, read_stl
from tests.drivers.surface.meshes import Triangles, ascii_stl, binary_stl, box, write

CUBE = box((0, 0, 0), (10, 10, 10))


def corners_of(mesh: SurfaceMesh) -> Triangles:
    return np.concatenate([piece.copy() for piece in mesh.pieces()])


def refusal(path: Path) -> str:
    with pytest.raises(MeshError) as caught:
        read_stl(path)
    message = str(caught.value)
    assert str(path) in message
    assert "\n" not in message
    return message


def test_a_binary_file_is_read_as_written(tmp_path: Path) -> None:
    mesh = read_stl(write(tmp_path / "cube.stl", binary_stl(CUBE)))
    assert np.array_equal(corners_of(mesh), CUBE)
    assert (mesh.triangles, mesh.kind, mesh.warnings) == (12, "binary STL", ())
    assert mesh.lower_mm.tolist() == [0, 0, 0]
    assert mesh.upper_mm.tolist() == [10, 10, 10]


def test_a_surface_of_many_pieces_is_read_whole_every_time(tmp_path: Path) -> None:
    triangles = np.random.default_rng(3).uniform(-50, 50, (250_001, 3, 3)).astype(np.float32).astype(np.float64)
    record = np.dtype([("skip", "V12"), ("corners", "<f4", (3, 3)), ("end", "V2")])
    records = np.zeros(len(triangles), record)
    records["corners"] = triangles
    content = b"x" * 80 + np.uint32(len(triangles)).tobytes() + records.tobytes()
    mesh = read_stl(write(tmp_path / "many.stl", content))
    for _ in range(2):
        assert np.array_equal(corners_of(mesh), triangles)
    assert np.array_equal(mesh.lower_mm, triangles.min(axis=(0, 1)))
    assert np.array_equal(mesh.upper_mm, triangles.max(axis=(0, 1)))


def test_an_ascii_file_keeps_all_its_digits(tmp_path: Path) -> None:
    triangles = CUBE / 3.0
    mesh = read_stl(write(tmp_path / "cube.stl", ascii_stl(triangles)))
    assert np.array_equal(corners_of(mesh), triangles)
    assert (mesh.kind, mesh.warnings) == ("ASCII STL", ())


def test_an_ascii_file_longer_than_one_piece_is_read_whole(tmp_path: Path) -> None:
    triangles = np.random.default_rng(4).uniform(-50, 50, (40_000, 3, 3))
    path = write(tmp_path / "long.stl", ascii_stl(triangles))
    assert path.stat().st_size > 2 * 4_194_304
    assert np.array_equal(corners_of(read_stl(path)), triangles)


def test_capitals_carriage_returns_and_several_solids_are_read(tmp_path: Path) -> None:
    text = ascii_stl(CUBE[:5]).upper() + ascii_stl(CUBE[5:])
    mesh = read_stl(write(tmp_path / "two.stl", text.replace("\n", "\r\n")))
    assert np.array_equal(corners_of(mesh), CUBE)


def test_the_scale_turns_the_files_unit_into_mm(tmp_path: Path) -> None:
    path = write(tmp_path / "inch.stl", binary_stl(CUBE))
    assert np.array_equal(corners_of(read_stl(path, scale=25.4)), CUBE * 25.4)
    for scale in (0.0, -1.0, float("nan")):
        with pytest.raises(MeshError, match="scale"):
            read_stl(path, scale)


@pytest.mark.parametrize(
    "before", ["# exported by a test\n", "\n\n; made by hand\n", "// one\n// two\n", "A title of any words\n", "\ufeff# marked\n"]
)
def test_lines_before_solid_are_left_out_and_told(tmp_path: Path, before: str) -> None:
    text = ascii_stl(CUBE).replace("\n  outer loop", "\n# a comment\n  outer loop", 1) + "# the end\n"
    mesh = read_stl(write(tmp_path / "cube.stl", before + text))
    assert np.array_equal(corners_of(mesh), CUBE)
    lines = len([line for line in before.split("\n") if line.strip()])
    assert mesh.warnings == (f"{lines} line(s) before `solid` are no triangles and were left out",)


TEXTS: dict[str, tuple[Callable[[str], str], tuple[str, ...]]] = {
    "without solid": (lambda text: text.split("\n", 1)[1], ()),
    "old line ends": (lambda text: text.replace("\n", "\r"), ()),
    "all on one line": (lambda text: " ".join(text.split("\n")) + "\n", ()),
    "a long remark before": (lambda text: "x" * 5000 + "\n" + text, ("1 line(s) before `solid` are no triangles and were left out",)),
    "words behind": (
        lambda text: text + "made by a test\n\non a day\n",
        ("2 line(s) behind the last `endsolid` are no triangles and were left out",),
    ),
    "two solids, the first without its line": (lambda text: text.split("\n", 1)[1] + text, ()),
}


@pytest.mark.parametrize("form", TEXTS)
def test_texts_that_other_programs_write_are_read_whole(tmp_path: Path, form: str) -> None:
    change, warnings = TEXTS[form]
    mesh = read_stl(write(tmp_path / "cube.stl", change(ascii_stl(CUBE))))
    twice = form.startswith("two")
    assert np.array_equal(corners_of(mesh), np.concatenate([CUBE, CUBE]) if twice else CUBE)
    assert mesh.warnings == warnings


def test_a_text_that_breaks_off_is_not_taken_for_words_behind(tmp_path: Path) -> None:
    text = ascii_stl(CUBE)
    assert "breaks off in triangle 13" in refusal(write(tmp_path / "m.stl", text + text.split("\n", 1)[1][:60]))
    assert "UTF-16" in refusal(write(tmp_path / "m.stl", text.encode("utf-16")))


@pytest.mark.parametrize(
    ("far", "scale", "step"), [(1e5, 1.0, 2.0**-7), (9e5, 1.0, 2.0**-4), (4000.0, 25.4, 25.4 * 2.0**-12), (16384.0, 1.0, 2.0**-9)]
)
def test_the_rounding_of_float32_far_from_the_origin_is_told(tmp_path: Path, far: float, scale: float, step: float) -> None:
    moved = CUBE + np.array([far - 10, 0, 0])  # float32 has 24 bits: the step at 2**16 to 2**17 is 2**-7
    (note,) = read_stl(write(tmp_path / "far.stl", binary_stl(moved)), scale).warnings
    assert f"knows only steps of {step:.2g} mm there" in note


def test_near_the_origin_nothing_is_said_of_rounding(tmp_path: Path) -> None:
    assert read_stl(write(tmp_path / "near.stl", binary_stl(CUBE + 8000.0))).warnings == ()


# The kinds of bad files -----------------------------------------------------------------------------------------------


def test_a_missing_file(tmp_path: Path) -> None:
    assert "cannot be read" in refusal(tmp_path / "nowhere.stl")


def test_a_folder(tmp_path: Path) -> None:
    assert "cannot be read" in refusal(tmp_path)


def test_a_pipe_is_refused_at_once(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe.stl")
    assert "a pipe or a device, not a file" in refusal(tmp_path / "pipe.stl")
    os.mkfifo(tmp_path / "pipe.obj")
    with pytest.raises(MeshError, match="a pipe or a device, not a file"):
        read_obj(tmp_path / "pipe.obj")


def test_an_empty_file(tmp_path: Path) -> None:
    assert "empty" in refusal(write(tmp_path / "m.stl", b""))


def test_a_file_shorter_than_a_header(tmp_path: Path) -> None:
    assert "60 bytes" in refusal(write(tmp_path / "m.stl", b"\0" * 60))


def test_a_header_without_triangles(tmp_path: Path) -> None:
    assert "no triangle" in refusal(write(tmp_path / "m.stl", binary_stl(CUBE[:0])))


def test_truncated_within_a_record(tmp_path: Path) -> None:
    message = refusal(write(tmp_path / "m.stl", binary_stl(CUBE)[: 84 + 50 * 7 + 20]))
    assert "promises 12 triangles" in message
    assert "triangle 8" in message
    assert "byte 434" in message


def test_truncated_between_records(tmp_path: Path) -> None:
    message = refusal(write(tmp_path / "m.stl", binary_stl(CUBE)[: 84 + 50 * 7]))
    assert "promises 12 triangles" in message
    assert "triangle 8" in message


def test_a_count_too_small(tmp_path: Path) -> None:
    message = refusal(write(tmp_path / "m.stl", binary_stl(CUBE, count=5)))
    assert "promises 5 triangles, the file holds 12" in message


def test_a_count_too_large(tmp_path: Path) -> None:
    assert "promises 4294967295 triangles" in refusal(write(tmp_path / "m.stl", binary_stl(CUBE, count=2**32 - 1)))


def test_bytes_behind_the_last_triangle(tmp_path: Path) -> None:
    assert "7 bytes follow" in refusal(write(tmp_path / "m.stl", binary_stl(CUBE) + b"\0" * 7))


def test_random_bytes(tmp_path: Path) -> None:
    assert "promises" in refusal(write(tmp_path / "m.stl", np.random.default_rng(1).bytes(5000)))


def test_random_bytes_behind_a_fitting_header(tmp_path: Path) -> None:
    content = b"x" * 80 + (20).to_bytes(4, "little") + np.random.default_rng(2).bytes(1000)
    assert "not a coordinate of a part" in refusal(write(tmp_path / "m.stl", content))


def test_text_that_is_no_stl(tmp_path: Path) -> None:
    assert "too few" in refusal(write(tmp_path / "m.stl", "x,y\n1,2\n"))
    assert "no STL" in refusal(write(tmp_path / "n.stl", "x;y;z\n" * 100))


def test_a_coordinate_that_is_not_a_number(tmp_path: Path) -> None:
    triangles = CUBE.copy()
    triangles[4, 1, 2] = np.nan
    message = refusal(write(tmp_path / "m.stl", binary_stl(triangles)))
    assert "triangle 5 (byte 316): z of corner 2 is nan" in message
    assert write(tmp_path / "m.stl", binary_stl(triangles)).read_bytes()[316:320] == np.float32(np.nan).tobytes()


def test_an_infinite_coordinate(tmp_path: Path) -> None:
    triangles = CUBE.copy()
    triangles[11, 0, 0] = -np.inf
    assert "triangle 12 (byte 646): x of corner 1 is -inf" in refusal(write(tmp_path / "m.stl", binary_stl(triangles)))


def test_a_coordinate_beyond_a_kilometre(tmp_path: Path) -> None:
    triangles = CUBE.copy()
    triangles[0, 2, 1] = 3e7
    assert "triangle 1 (byte 124): y of corner 3 is 3e+07" in refusal(write(tmp_path / "m.stl", binary_stl(triangles)))


def test_an_ascii_file_cut_off_in_the_middle(tmp_path: Path) -> None:
    text = ascii_stl(CUBE)
    place = text.index("vertex", 700)
    message = refusal(write(tmp_path / "m.stl", text[: place + 6]))
    assert "breaks off in triangle 6" in message
    assert f"byte {place}" in message


def test_an_ascii_file_with_a_word_for_a_number(tmp_path: Path) -> None:
    text = ascii_stl(CUBE).replace("vertex 10.0 0.0 10.0", "vertex 10.0 oops 10.0", 1)
    message = refusal(write(tmp_path / "m.stl", text))
    assert "found 'oops', expected a number" in message
    assert f"byte {text.index('oops')}" in message
    assert "triangle 4" in message


def test_an_ascii_file_with_four_cornered_facets(tmp_path: Path) -> None:
    text = ascii_stl(CUBE).replace("  endloop", "    vertex 0 0 0\n  endloop", 1)
    assert "triangle 1" in refusal(write(tmp_path / "m.stl", text))
    assert "expected the word 'endloop'" in refusal(tmp_path / "m.stl")


def test_an_ascii_file_without_facets(tmp_path: Path) -> None:
    assert "no triangle" in refusal(write(tmp_path / "m.stl", "solid nothing\nendsolid nothing\n"))


def test_an_ascii_file_with_nan(tmp_path: Path) -> None:
    text = ascii_stl(CUBE).replace("vertex 10.0 0.0 10.0", "vertex 10.0 nan 10.0", 1)
    assert "triangle 4: y of corner 3 is nan" in refusal(write(tmp_path / "m.stl", text))


def test_a_file_that_shrinks_after_it_was_checked(tmp_path: Path) -> None:
    path = write(tmp_path / "m.stl", binary_stl(CUBE))
    mesh = read_stl(path)
    path.write_bytes(path.read_bytes()[:300])
    with pytest.raises(MeshError, match="became shorter"):
        list(mesh.pieces())


# Odd, and yet usable --------------------------------------------------------------------------------------------------


def test_a_binary_file_whose_header_says_solid(tmp_path: Path) -> None:
    mesh = read_stl(write(tmp_path / "m.stl", binary_stl(CUBE, header=b"solid from a scanner")))
    assert (mesh.triangles, mesh.kind) == (12, "binary STL")


def test_an_ascii_file_without_endsolid_is_used_with_a_warning(tmp_path: Path) -> None:
    text = ascii_stl(CUBE)
    mesh = read_stl(write(tmp_path / "m.stl", text[: text.index("endsolid")]))
    assert mesh.triangles == 12
    assert "without endsolid" in mesh.warnings[0]


def test_decimal_commas_are_read_with_a_warning(tmp_path: Path) -> None:
    mesh = read_stl(write(tmp_path / "m.stl", ascii_stl(CUBE / 4.0).replace("2.5", "2,5")))
    assert np.array_equal(corners_of(mesh), CUBE / 4.0)
    assert "decimal commas" in mesh.warnings[0]
