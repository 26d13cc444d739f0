"""A new plan from the page: what is understood of a nominal, where its files go, and what is said beside which field."""

from pathlib import Path

import numpy as np
import pytest

from cmmlink.commands.check import check
from cmmlink.console.form_answers import PlanSaved
from cmmlink.console.plan_form import PlanForm, save_form, understand_nominal
from cmmlink.plan import load_ct_plan, load_plan
from tests.cmmlink.oval_part import oval_points, write_points
from tests.cmmlink.test_new_plan import circles
from tests.drivers.surface.meshes import binary_stl, box, write

TOLD = {
    "nominal": "oval.csv",
    "part": "oval",
    "tolerance": "-0.05 0.06",
    "source": "COM3",
    "radius": "1",
    "name": "oval-plan",
}
HOSTILE = [
    "../a.csv",
    "/etc/passwd.csv",
    "a/../../b.csv",
    "..\\a.csv",
    "C:\\a.csv",
    "C:a.csv",
    "\\\\host\\share\\a.csv",
    "link.csv",
]


@pytest.fixture
def oval(tmp_path: Path) -> bytes:
    path = write_points(tmp_path / "made.csv", np.vstack([oval_points(0.0), oval_points(0.0)[:1]]))
    content = path.read_bytes()
    path.unlink()
    return content


def saved(folder: Path, content: bytes, replace: str = "", **told: str) -> PlanSaved:
    return save_form(PlanForm.of(TOLD | told), content, folder, overwrite=replace == "yes")


def fields(answer: PlanSaved) -> list[str]:
    return [mistake.field for mistake in answer.mistakes]


def files(folder: Path) -> set[str]:
    return {str(path.relative_to(folder)).replace("\\", "/") for path in folder.rglob("*") if path.is_file()}


def test_a_saved_plan_passes_the_check_of_the_command_and_says_what_was_answered(
    tmp_path: Path, oval: bytes, capsys: pytest.CaptureFixture[str]
) -> None:
    assert saved(tmp_path, oval) == PlanSaved(name="oval-plan.yaml")
    assert files(tmp_path) == {"oval-plan.yaml", "nominals/oval.csv"}
    plan = load_plan(tmp_path / "oval-plan.yaml")
    assert (plan.part.name, plan.zone.lower_mm, plan.zone.upper_mm, plan.probe.tip_radius_mm) == ("oval", -0.05, 0.06, 1.0)
    assert plan.nominal.file.read_bytes() == oval
    assert check(tmp_path / "oval-plan.yaml") == 0
    assert "can be run: oval" in capsys.readouterr().out


def test_a_surface_beside_the_plans_makes_a_plan_of_its_sections(tmp_path: Path, oval: bytes) -> None:
    write(tmp_path / "box.stl", binary_stl(box((0.0, 0.0, 0.0), (1.0, 1.0, 1.0))))
    assert saved(tmp_path, oval, source="box.stl", radius="") == PlanSaved(name="oval-plan.yaml", surface=True)
    assert load_ct_plan(tmp_path / "oval-plan.yaml").mesh.file == tmp_path / "box.stl"


def test_everything_that_is_wrong_is_said_at_once_beside_its_field_and_nothing_is_saved(tmp_path: Path, oval: bytes) -> None:
    wrong = {"part": "", "tolerance": "tight", "source": "", "radius": "-1", "results": "../out", "name": "../x", "unit": "parsec"}
    answer = saved(tmp_path, oval, **wrong)
    assert sorted(fields(answer)) == sorted(wrong)
    assert files(tmp_path) == set()
    absent = saved(tmp_path, oval, source="absent.csv", results="out/{parts}")
    assert absent.name == ""
    assert set(fields(absent)) <= {"source", "results"}
    assert files(tmp_path) == set(), "the check is that of the whole plan, and its draft and nominal are gone"
    no_device = saved(tmp_path, oval, source="COM3 no-such-format")
    assert fields(no_device) == ["source"]
    assert "line" not in no_device.mistakes[0].words
    assert fields(saved(tmp_path, b"x,y\n1,2\nnonsense", source="COM3")) == ["nominal"]


@pytest.mark.parametrize("name", HOSTILE)
def test_an_answer_names_no_file_outside_the_folder_of_the_plans(tmp_path: Path, oval: bytes, name: str) -> None:
    folder, outside = tmp_path / "plans", tmp_path / "a.csv"
    folder.mkdir()
    outside.write_bytes(oval)
    (folder / "link.csv").symlink_to(outside)
    assert fields(saved(folder, oval, source=name, results=name)) == ["source", "results"]
    assert fields(saved(folder, oval, source="modbus 127.0.0.1:502 ../a.yaml")) == ["source"]
    assert files(tmp_path) == {"plans/link.csv", "a.csv"}


@pytest.mark.parametrize("name", ["../x.yaml", "a/x", "..", "a\\x.yaml", "C:x.yaml", ".hidden", "con", "x.txt/..", "n" * 140, "x\ny"])
def test_a_plan_has_a_plain_name(tmp_path: Path, oval: bytes, name: str) -> None:
    assert fields(saved(tmp_path, oval, name=name)) == ["name"]
    assert files(tmp_path) == set()


@pytest.mark.parametrize("name", ["../../x.csv", "..\\con.csv", "", "\x1b" * 500 + ".csv"])
def test_a_nominal_is_kept_under_a_plain_name_whatever_it_is_called(tmp_path: Path, oval: bytes, name: str) -> None:
    answer = saved(tmp_path, oval, nominal=name)
    kept = {path for path in files(tmp_path) if path != "oval-plan.yaml"}
    assert all(path.startswith("nominals/") and path.isprintable() and ".." not in path for path in kept)
    assert (answer.name == "oval-plan.yaml") == (len(kept) == 1) == name.endswith(".csv")


def test_nothing_is_replaced_but_a_plan_and_that_only_when_it_is_confirmed(tmp_path: Path, oval: bytes) -> None:
    assert saved(tmp_path, oval).name
    first = (tmp_path / "oval-plan.yaml").read_bytes()
    again = saved(tmp_path, oval, part="other")
    assert (again.name, again.taken, fields(again)) == ("", True, ["name"])
    assert (tmp_path / "oval-plan.yaml").read_bytes() == first
    assert saved(tmp_path, oval, part="other", replace="yes") == PlanSaved(name="oval-plan.yaml", taken=True)
    assert load_plan(tmp_path / "oval-plan.yaml").part.name == "other"
    (tmp_path / "map.yaml").write_text("pattern: ring\n", encoding="utf-8")
    assert fields(saved(tmp_path, oval, name="map.yaml", replace="yes")) == ["name"]
    broken = (tmp_path / "oval-plan.yaml").read_bytes()
    assert fields(saved(tmp_path, oval, source="absent.csv", replace="yes")) == ["source"]
    assert (tmp_path / "oval-plan.yaml").read_bytes() == broken, "a plan that cannot be used replaces none"


def test_a_nominal_that_another_plan_uses_is_never_replaced(tmp_path: Path, oval: bytes) -> None:
    assert saved(tmp_path, oval).name
    other = oval.replace(b"x", b"X", 1)
    assert saved(tmp_path, other, name="second").name
    assert saved(tmp_path, oval, name="third").name
    assert files(tmp_path) == {"oval-plan.yaml", "second.yaml", "third.yaml", "nominals/oval.csv", "nominals/oval-2.csv"}
    assert load_plan(tmp_path / "oval-plan.yaml").nominal.file.read_bytes() == oval
    assert load_plan(tmp_path / "second.yaml").nominal.file.read_bytes() == other
    assert load_plan(tmp_path / "third.yaml").nominal.file.name == "oval.csv"


def test_a_folder_of_nominals_that_leads_elsewhere_is_not_written_into(tmp_path: Path, oval: bytes) -> None:
    plans, elsewhere = tmp_path / "plans", tmp_path / "elsewhere"
    plans.mkdir()
    elsewhere.mkdir()
    (plans / "nominals").symlink_to(elsewhere)
    assert fields(saved(plans, oval)) == ["nominal"]
    assert files(elsewhere) == set()


def test_what_is_understood_is_the_curve_with_its_start_direction_length_and_what_is_left_open(tmp_path: Path, oval: bytes) -> None:
    told = understand_nominal(PlanForm.of({"nominal": "oval.csv"}), oval, tmp_path)
    assert (told.problem, told.asks, told.closed, told.turns_left, told.unit_known) == ("", (), True, True, True)
    points = np.array(told.points_mm)
    assert np.allclose(points[0], oval_points(0.0)[0], atol=1e-9)
    assert np.hypot(*np.diff(points, axis=0).T).sum() == pytest.approx(told.length_mm, rel=1e-4)
    two = circles(10, 4).encode()
    asked = understand_nominal(PlanForm.of({"nominal": "two.dxf"}), two, tmp_path)
    assert (asked.asks, asked.unit_known, [number for number, _ in asked.curves]) == (("unit", "curve"), False, [1, 2])
    answered = understand_nominal(PlanForm.of({"nominal": "two.dxf", "unit": "inch", "curve": "2"}), two, tmp_path)
    assert answered.asks == ()
    assert answered.length_mm == pytest.approx(2 * np.pi * 4 * 25.4)
    line = understand_nominal(PlanForm.of({"nominal": "line.csv"}), b"x,y\n0,0\n5,1\n10,0\n15,2\n20,0\n", tmp_path)
    assert (line.asks, line.closed) == (("side",), False)
    assert fields(saved(tmp_path, b"x,y\n0,0\n5,1\n10,0\n15,2\n20,0\n", nominal="line.csv")) == ["side"]
    for name, content in (("none.exe", b"MZ"), ("empty.csv", b""), ("deep.yaml", b"[" * 100_000), ("bad.dxf", b"\0" * 1000)):
        refused = understand_nominal(PlanForm.of({"nominal": name}), content, tmp_path)
        assert refused.problem
        assert "/" not in refused.problem.replace("x/y", "")
