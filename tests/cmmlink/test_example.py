"""The folder of the example: what its page says of every file is so, and nothing is overwritten."""

import re
from collections import Counter
from pathlib import Path

import numpy as np
import pytest

from cmmlink.demo.example import BUMP_MM, BUMP_STATION_MM, write_example
from cmmlink.errors import PlanError
from cmmlink.nominal_files import load_nominal
from cmmlink.plan import Plan, load_ct_plan, load_plan, map_of
from drivers import read_points
from inspection import deviations, discretize, register
from simulators import read_path


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("example") / "new" / "folder"
    write_example(folder)
    return folder


def test_its_page_names_every_file_and_only_commands_that_there_are(folder: Path) -> None:
    page = (folder / "README.txt").read_text(encoding="utf-8")
    for file in set(folder.iterdir()) - {folder / "README.txt"}:
        assert file.name in page, file.name
    named = set(re.findall(r"\b[\w-]+\.(?:yaml|csv|dat|stl)\b", page))
    assert named == {file.name for file in folder.iterdir()} - {"README.txt"}


def test_the_points_are_a_good_and_a_bad_part_as_its_page_says(folder: Path) -> None:
    nominal = discretize(load_nominal(folder / "blade.dat", 100.0).curve)
    highest = {}
    for name in ("points.csv", "points-bad.csv"):
        centres = read_points(folder / name).points_mm[:, :2]
        pose = register(centres, nominal)
        found = deviations(pose.nominal_from_section.apply(centres), nominal)
        error = found.deviation_mm - 1.0
        worst = int(np.argmax(np.abs(error)))
        highest[name] = float(error[worst])
        if name == "points-bad.csv":
            assert found.station_mm[worst] == pytest.approx(BUMP_STATION_MM, abs=1.0)
    assert abs(highest["points.csv"]) < 0.03
    assert highest["points-bad.csv"] == pytest.approx(BUMP_MM, abs=0.03)


def test_its_plans_can_be_read_and_name_its_files(folder: Path) -> None:
    plans: list[Plan] = [load_plan(folder / f"{name}.yaml") for name in ("plan", "modbus-plan", "file-plan", "characteristics-plan")]
    assert all(plan.nominal.file.is_file() for plan in plans)
    assert len({plan.part.serial_number for plan in plans}) == len(plans)
    assert map_of(folder / "my-controller.yaml").pattern == "ring"
    assert load_ct_plan(folder / "ct-plan.yaml").mesh.file == folder / "part.stl"


def test_its_surface_is_closed_and_its_path_goes_round(folder: Path) -> None:
    stl = (folder / "part.stl").read_bytes()
    records = np.frombuffer(stl[84:], dtype=[("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
    assert len(records) == int.from_bytes(stl[80:84], "little")
    corners = records["corners"]  # (t, 3, 3)
    named = [[tuple(corner) for corner in triangle] for triangle in corners.tolist()]
    edges = Counter((triangle[i], triangle[(i + 1) % 3]) for triangle in named for i in range(3))
    assert set(edges.values()) == {1}
    assert all(edges[end, start] == 1 for start, end in edges), "every edge is met once from either side"
    np.testing.assert_allclose(np.ptp(corners.reshape(-1, 3), axis=0), [60.0, 7.5, 10.0], atol=0.5)
    path = read_path(folder / "path.csv")
    np.testing.assert_array_equal(path[0], path[-1])


def test_nothing_is_overwritten(folder: Path, tmp_path: Path) -> None:
    with pytest.raises(PlanError, match=r"README.txt: is there already, and nothing is overwritten; give a new folder"):
        write_example(folder)
    (tmp_path / "file").write_text("x", encoding="utf-8")
    with pytest.raises(PlanError, match=r"file.*: cannot be written"):
        write_example(tmp_path / "file" / "folder")
