"""The two laws over files of points, and over sections of CT surfaces: what a file lacks never improves a verdict."""

import io
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from unittest.mock import patch

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from cmmlink.stack import StackOutcome
from drivers.errors import MeshError, PointFileError
from drivers.files.point_file import PointFileSource
from inspection import InspectionError, Verdict
from tests.cmmlink.blade import inspect, plan_of
from tests.cmmlink.oval_part import write_nominal
from tests.drivers.surface.meshes import Triangles, binary_stl, tube
from tests.integration.encoded_scans import SOURCES
from tests.integration.judged_scans import COUNT, Said, judged, profile_of, scan_of
from tests.integration.listed import Listed

Array = NDArray[np.float64]
Rows = NDArray[np.int64]
Lines = list[str]

CHECKS = [HealthCheck.function_scoped_fixture, HealthCheck.too_slow]  # a busy machine is no fault of a case
LAW = settings(max_examples=max(2, settings().max_examples // 33), deadline=None, suppress_health_check=CHECKS)
GOOD = SOURCES["ascii"]


def written(points: Array, delimiter: str, header: str = "", decimal: str = ".") -> Lines:
    rows = [delimiter.join(f"{value:.6f}".replace(".", decimal) for value in point) for point in points]
    return [*([header] if header else []), *rows]


FORMATS: dict[str, Callable[[Array], Lines]] = {
    "csv": lambda points: written(points, ",", "x,y,z"),
    "semicolons.csv": lambda points: written(points, ";", "x;y;z", ","),
    "txt": lambda points: written(points, " "),
    "asc": lambda points: written(points, "\t"),
    "xyz": lambda points: written(points[:, :2], " "),
}
ROW_FAULTS: dict[str, Callable[[str, str], Lines]] = {
    "absent": lambda row, before: [],
    "not a number": lambda row, before: [" ".join(["nan"] * 3)],
    "without its numbers": lambda row, before: ["".join(sign for sign in row if sign in ",;\t")],
    "the row before once more": lambda row, before: [before],
    "a word": lambda row, before: ["overrange"],
    "a mark for no value": lambda row, before: [row[:3] + "****"],
    "cut in two": lambda row, before: [row[: len(row) // 2]],
}


def read(folder: Path, name: str, content: bytes, batch_points: int = 1024) -> Said | None:
    """What a run says of a file; None where it is refused."""
    path = folder / name
    path.write_bytes(content)
    try:
        source = PointFileSource(path, batch_points=batch_points)
    except PointFileError:
        return None
    return judged(Listed(source.arrivals()))


def hides(said: Said | None) -> bool:
    if said is None:
        return False
    assert said.counts_ok
    return said.conforms


@pytest.mark.parametrize("name", FORMATS)
def test_a_sound_file_is_told_from_one_with_a_step(name: str, tmp_path: Path) -> None:
    for first, verdict in ((80, Verdict.CONFORM), (70, Verdict.NONCONFORM)):
        said = read(tmp_path, name, "\n".join(FORMATS[name](scan_of(GOOD, first, 80))).encode())
        assert said is not None
        assert said.verdict == verdict


# ---- law I


@pytest.mark.parametrize("fault", ROW_FAULTS)
@pytest.mark.parametrize("name", FORMATS)
@given(first=st.integers(1, COUNT - 20), width=st.integers(3, 20))
@LAW
def test_no_row_that_a_file_lacks_hides_a_step(name: str, fault: str, first: int, width: int, tmp_path: Path) -> None:
    rows = FORMATS[name](scan_of(GOOD, first, first + width))
    at = first + len(rows) - COUNT
    struck = [line for i in range(at, at + width) for line in ROW_FAULTS[fault](rows[i], rows[at - 1])]
    assert not hides(read(tmp_path, name, "\n".join(rows[:at] + struck + rows[at + width :]).encode()))


@pytest.mark.parametrize("name", [*FORMATS, "npy"])
@given(cut=st.floats(0.3, 0.97), first=st.integers(0, COUNT - 1))
@LAW
def test_a_file_cut_short_hides_no_step_behind_the_cut(name: str, cut: float, first: int, tmp_path: Path) -> None:
    """The step begins behind the cut, wherever that is; of the last row a piece may be left."""
    kept = round(cut * COUNT)
    points = scan_of(GOOD, kept, COUNT)
    if name == "npy":
        buffer = io.BytesIO()
        np.save(buffer, points)
        content = buffer.getvalue()[: 128 + 24 * kept + first % 24]
    else:
        rows = FORMATS[name](points)
        whole = rows[: kept + len(rows) - COUNT]
        content = "\n".join([*whole, rows[len(whole)][: first % 20]]).encode()
    assert not hides(read(tmp_path, name, content))


@given(first=st.integers(0, COUNT - 20), width=st.integers(3, 20), value=st.sampled_from([np.nan, np.inf, -9999.0, 0.0, 1e300]))
@LAW
def test_no_value_of_an_array_hides_a_step(first: int, width: int, value: float, tmp_path: Path) -> None:
    points = scan_of(GOOD, first, first + width)
    points[first : first + width] = value
    buffer = io.BytesIO()
    np.save(buffer, points)
    assert not hides(read(tmp_path, "points.npy", buffer.getvalue()))


# ---- law II


@pytest.mark.parametrize("name", FORMATS)
@given(seed=st.integers(0, 2**30), width=st.sampled_from([0, 12]), batch=st.integers(1, 400))
@LAW
def test_order_density_and_batches_of_a_file_change_no_verdict(name: str, seed: int, width: int, batch: int, tmp_path: Path) -> None:
    rng, points = np.random.default_rng(seed), scan_of(GOOD, 70, 70 + width)
    mixed = rng.permutation(np.concatenate([points, points[rng.integers(0, COUNT, 90)], np.repeat(points[5:6], 60, axis=0)]))
    said = read(tmp_path, name, "\n".join(FORMATS[name](mixed)).encode(), batch)
    assert said is not None
    assert said.verdict == (Verdict.NONCONFORM if width else Verdict.CONFORM)


# ---- sections of a surface


def surface_of(first: int = 0, stop: int = 0) -> Triangles:
    """An extruded part whose facets first .. stop - 1 stand on a step; two triangles a facet and storey."""
    return tube(scan_of(GOOD, first, stop)[:, :2], np.array([0.0, 5.0, 10.0]))


def cut(folder: Path, triangles: Triangles) -> StackOutcome | None:
    """What the section half way up says; None where the surface is refused."""
    mesh = folder / "part.stl"
    mesh.write_bytes(binary_stl(triangles))
    told = {"tolerance": {"lower_mm": -0.05, "upper_mm": 0.05}, "registration": {"fit": "none"}}
    plan = plan_of(mesh, write_nominal(folder / "oval.yaml"), {"heights_mm": (2.5,)}, **told)
    with suppress(MeshError, InspectionError), patch("cmmlink.stack_inputs.discretize_file", lambda *_: profile_of(flat=False)):
        return inspect(plan)
    return None


def columns(first: int, stop: int) -> Rows:
    """Rows of the triangles that touch the points first .. stop - 1 of the contour."""
    facets = np.arange(first - 1, stop) % COUNT
    return np.concatenate([facets + COUNT * k for k in range(4)])


SURFACE_FAULTS: dict[str, Callable[[Triangles, Rows], Triangles]] = {
    "absent": lambda all_of_them, struck: np.delete(all_of_them, struck, axis=0),
    "one of two absent": lambda all_of_them, struck: np.delete(all_of_them, struck[::2], axis=0),
    "not finite": lambda all_of_them, struck: _with(all_of_them, struck, np.nan),
    "collapsed": lambda all_of_them, struck: _with(all_of_them, struck, all_of_them[struck][:, :1]),
}


def _with(triangles: Triangles, rows: Rows, values: float | Triangles) -> Triangles:
    changed = triangles.copy()
    changed[rows] = values
    return changed


@pytest.mark.parametrize("fault", SURFACE_FAULTS)
@given(first=st.integers(0, COUNT - 20), width=st.integers(2, 20))
@LAW
def test_no_triangle_that_a_surface_lacks_hides_a_step(fault: str, first: int, width: int, tmp_path: Path) -> None:
    said = cut(tmp_path, SURFACE_FAULTS[fault](surface_of(first, first + width), columns(first, first + width)))
    assert said is None or said.verdict != Verdict.CONFORM


@given(seed=st.integers(0, 2**30), width=st.sampled_from([0, 12]))
@LAW
def test_order_repetition_and_winding_of_triangles_change_no_verdict(seed: int, width: int, tmp_path: Path) -> None:
    rng, triangles = np.random.default_rng(seed), surface_of(70, 70 + width)
    mixed = rng.permutation(np.concatenate([triangles, triangles[rng.integers(0, len(triangles), 50)]]))
    mixed = np.stack([np.roll(corners, int(turn), axis=0) for corners, turn in zip(mixed, rng.integers(0, 3, len(mixed)), strict=True)])
    plain, said = cut(tmp_path, triangles), cut(tmp_path, mixed)
    assert plain is not None
    assert said is not None
    assert said.verdict == plain.verdict == (Verdict.NONCONFORM if width else Verdict.CONFORM)
