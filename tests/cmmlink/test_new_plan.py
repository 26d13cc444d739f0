"""A plan made of answers: what each answer may be, what the nominal leaves open, and where a plan may be saved."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from cmmlink.errors import PlanError
from cmmlink.new_plan import (
    NominalReading,
    PlanAnswers,
    open_questions,
    plan_text,
    radius_from,
    reading_from,
    save_plan,
    source_from,
    tolerance_from,
)
from cmmlink.plan import FileDevice, ModbusDevice, load_ct_plan, load_plan
from inspection import NominalError
from tests.cmmlink.oval_part import oval_points, write_points
from tests.drivers.surface.meshes import binary_stl, box, write


def circles(*radii: float) -> str:
    """A drawing of circles beside each other, in a DXF of release 12, which states no unit."""
    drawn = "".join(f"0\nCIRCLE\n8\n0\n10\n{100 * place}\n20\n0\n40\n{radius}\n" for place, radius in enumerate(radii))
    return f"0\nSECTION\n2\nENTITIES\n{drawn}0\nENDSEC\n0\nEOF\n"


@pytest.fixture
def oval(tmp_path: Path) -> Path:
    return write_points(tmp_path / "oval.csv", np.vstack([oval_points(0.0), oval_points(0.0)[:1]]))


def answers(nominal: Path) -> PlanAnswers:
    return PlanAnswers("oval", nominal, NominalReading(), -0.05, 0.05, {"device": {"type": "serial", "address": "COM3"}})


def test_a_nominal_leaves_open_only_what_it_does_not_say(tmp_path: Path, oval: Path) -> None:
    assert open_questions(oval, NominalReading()) == ()
    two, one = write(tmp_path / "two.dxf", circles(10, 4)), write(tmp_path / "one.dxf", circles(10))
    assert open_questions(two, NominalReading()) == ("unit", "curve")
    assert open_questions(two, NominalReading(unit="mm")) == ("curve",)
    assert open_questions(one, NominalReading()) == ("unit",)
    assert open_questions(one, NominalReading(scale=25.4)) == ()
    with pytest.raises(NominalError, match="no such file"):
        open_questions(tmp_path / "none.dxf", NominalReading())


def test_an_airfoil_in_units_of_its_chord_is_asked_about_and_one_in_mm_is_not(tmp_path: Path) -> None:
    for chord, expected in ((1.0, ("ends", "chord")), (100.0, ("ends",))):
        rows = "".join(f"{x * chord / 20:.8f} {y * chord / 20:.8f}\n" for x, y in np.add(np.roll(oval_points(0.0), 1, axis=0), [10.0, 0.0]))
        (tmp_path / "foil.dat").write_text(f"a foil\n{rows}", encoding="utf-8")
        assert open_questions(tmp_path / "foil.dat", NominalReading()) == expected
        assert open_questions(tmp_path / "foil.dat", NominalReading(closed=True)) == expected[1:]
    assert open_questions(tmp_path / "foil.dat", NominalReading(scale=60.0, closed=False)) == ()


@pytest.mark.parametrize(
    ("text", "expected"), [("inch", ("inch", 1.0)), (" MM ", ("mm", 1.0)), ("100", (None, 100.0)), ("25.4 mm", (None, 25.4))]
)
def test_a_unit_is_a_word_or_a_number_of_mm(text: str, expected: tuple[str | None, float]) -> None:
    reading = reading_from(text, NominalReading(curve=2))
    assert ((reading.unit, reading.scale), reading.curve) == (expected, 2)


@pytest.mark.parametrize(
    ("text", "expected"), [("0.05", (-0.05, 0.05)), ("-0.05 0.06", (-0.05, 0.06)), ("-0.1 .. 0", (-0.1, 0.0)), ("+/-0.02", (-0.02, 0.02))]
)
def test_a_tolerance_is_two_limits_or_one_for_both_sides(text: str, expected: tuple[float, float]) -> None:
    assert tolerance_from(text) == expected


@pytest.mark.parametrize("text", ["", "tight", "0", "-0.05", "0.05 -0.05", "0.1 0.1", "1 2 3", "nan", "-inf 1", "0,05", "0.05 mm"])
def test_what_is_no_tolerance_is_refused(text: str) -> None:
    with pytest.raises(PlanError, match=r"expected the lower and the upper limit in mm, like -0\.05 0\.05"):
        tolerance_from(text)


@pytest.mark.parametrize("text", ["", "parsec", "0", "-1", "nan", "inf"])
def test_what_is_no_unit_or_no_radius_is_refused(text: str) -> None:
    with pytest.raises(PlanError, match="expected mm, um, inch, or how many mm"):
        reading_from(text, NominalReading())
    if text != "0":
        with pytest.raises(PlanError, match="expected the radius in mm"):
            radius_from(text)


def test_points_come_from_files_surfaces_ports_and_registers(tmp_path: Path) -> None:
    assert source_from("COM3", tmp_path) == {"device": {"type": "serial", "address": "COM3"}}
    assert source_from("10.0.0.7:4001 optoncdt range_mm=50 name=a", tmp_path)["device"] == {
        "type": "serial",
        "address": "10.0.0.7:4001",
        "format": "optoncdt",
        "options": {"range_mm": 50, "name": "a"},
    }
    assert source_from("modbus 10.0.0.7:502 gocator", tmp_path)["device"]["map"] == "gocator"
    assert source_from(str(tmp_path / "scans" / "a part.csv"), tmp_path)["device"] == {"type": "file", "file": "scans/a part.csv"}
    own = source_from(f"modbus 10.0.0.7:502 {tmp_path / 'my map.yaml'}".replace("my map", "mine"), tmp_path / "plans")
    assert own["device"]["map"] == "../mine.yaml"
    write(tmp_path / "box.stl", binary_stl(box((0.0, 0.0, 5.0), (1.0, 1.0, 68.0))))
    found = source_from(str(tmp_path / "box.stl"), tmp_path)
    assert found == {"mesh": {"file": "box.stl"}, "sections": {"normal": [0, 0, 1], "every_mm": 5.0}}  # 63 mm high
    for text in ("", "modbus", "COM3 ascii binary", "modbus 10.0.0.7:502 gocator a=1"):
        with pytest.raises(PlanError, match="expected a"):
            source_from(text, tmp_path)


def test_the_text_is_a_plan_that_says_what_was_answered(tmp_path: Path, oval: Path) -> None:
    understood = NominalReading().load(oval)
    write_points(tmp_path / "points.csv", oval_points(0.0))
    told = replace(answers(oval), source=source_from(str(tmp_path / "points.csv"), tmp_path), tip_radius_mm=1.0)
    text = plan_text(told, understood, tmp_path)
    plan = load_plan(save_plan(tmp_path, "oval.yaml", text))
    assert (plan.part.name, plan.nominal.file, plan.zone.lower_mm, plan.zone.upper_mm) == ("oval", oval, -0.05, 0.05)
    assert isinstance(plan.device, FileDevice)
    assert plan.device.file == tmp_path / "points.csv"
    assert plan.probe.tip_radius_mm == 1.0
    assert f"closed, {understood.curve.length_mm:.3f} mm long" in text
    registers = replace(answers(oval), source=source_from("modbus 10.0.0.7:502", tmp_path))
    saved = load_plan(save_plan(tmp_path, "registers.yaml", plan_text(registers, understood, tmp_path)))
    assert isinstance(saved.device, ModbusDevice)
    (tmp_path / "box.stl").write_bytes(binary_stl(box((0.0, 0.0, 0.0), (1.0, 1.0, 1.0))))
    surface = replace(answers(oval), source=source_from(str(tmp_path / "box.stl"), tmp_path))
    assert load_ct_plan(save_plan(tmp_path, "box.yaml", plan_text(surface, understood, tmp_path))).sections.every_mm == 0.1


@pytest.mark.parametrize("name", ["x\nout: /etc", "x: {y", "\x1b[2J", "", "# no"])
def test_an_answer_is_a_value_and_never_another_key(tmp_path: Path, oval: Path, name: str) -> None:
    made = replace(answers(oval), part=name)
    if name.isprintable() and name:
        assert load_plan(save_plan(tmp_path, "a.yaml", plan_text(made, NominalReading().load(oval), tmp_path))).part.name == name
    else:
        with pytest.raises(PlanError, match=r"part\.name is"):
            plan_text(made, NominalReading().load(oval), tmp_path)


@pytest.mark.parametrize(
    "name",
    [
        "../a.yaml",
        "a/b.yaml",
        "a\\b.yaml",
        "/a.yaml",
        "a.txt",
        ".a.yaml",
        "",
        ".yaml",
        "CON.yaml",
        "a\n.yaml",
        "c:a.yaml",
        "x" * 130 + ".yaml",
    ],
)
def test_a_plan_is_saved_in_its_folder_and_nowhere_else(tmp_path: Path, name: str) -> None:
    with pytest.raises(PlanError, match="expected a plain name of a file that ends in"):
        save_plan(tmp_path, name, "part: x")
    assert list(tmp_path.iterdir()) == []


def test_a_plan_is_replaced_only_when_that_is_confirmed(tmp_path: Path) -> None:
    outside = tmp_path / "outside.txt"
    outside.write_text("mine", encoding="utf-8")
    folder = tmp_path / "plans"
    folder.mkdir()
    save_plan(folder, "a.yaml", "one")
    with pytest.raises(PlanError, match="is there already"):
        save_plan(folder, "a.yaml", "two")
    assert save_plan(folder, "a.yaml", "two", overwrite=True).read_text(encoding="utf-8") == "two"
    assert [path.name for path in folder.iterdir()] == ["a.yaml"]
    (folder / "link.yaml").symlink_to(outside)
    with pytest.raises(PlanError, match="is there already"):
        save_plan(folder, "link.yaml", "two")
    save_plan(folder, "link.yaml", "two", overwrite=True)
    assert outside.read_text(encoding="utf-8") == "mine", "the link is replaced, and not what it points to"
    (folder / "b.yaml").mkdir()
    with pytest.raises(PlanError, match="is there already"):
        save_plan(folder, "b.yaml", "two", overwrite=True)
