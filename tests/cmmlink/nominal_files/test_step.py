"""What Open CASCADE writes comes back: curves of STEP and IGES in every unit, and sections of solids; and what becomes of its process."""

import os
import re
import sys
from pathlib import Path
from threading import Thread

import numpy as np
import pytest

from cmmlink.nominal_files import NominalFile, load_nominal
from drivers import CadError
from drivers.cad import OcctProcess
from inspection import NominalError, SectionPlane, Verdict, deviations, discretize
from tests.cmmlink.blade import inspect, plan_of
from tests.cmmlink.nominal_files.conftest import ROOT
from tests.cmmlink.nominal_files.iges_text import iges, wire_entities
from tests.cmmlink.nominal_files.test_dxf import draw_wire, new, saved
from tests.cmmlink.nominal_files.wire import TRUTH, require_wire
from tests.drivers.surface.meshes import binary_stl, tube, write

UNIT_WORDS = {"MM": "mm", "INCH": "inch", "M": "m"}
TORUS = (30.0, 8.0)


def plane(origin: tuple[float, ...], normal: tuple[float, ...], x_axis: tuple[float, ...] = (1.0, 0.0, 0.0)) -> SectionPlane:
    return SectionPlane(np.array(origin), np.array(x_axis), np.array(normal))


def refusal(path: Path, section: SectionPlane | None = None) -> str:
    with pytest.raises(NominalError) as refused:
        load_nominal(path, section=section)
    assert "\n" not in str(refused.value)
    return str(refused.value).removeprefix(f"{path}: ")


@pytest.mark.parametrize(("schema", "unit"), [("AP203", "MM"), ("AP214IS", "INCH"), ("AP242DIS", "MM"), ("AP242DIS", "M")])
@pytest.mark.usefixtures("occt")
def test_a_wire_in_step_comes_back_exact(cad_files: Path, schema: str, unit: str) -> None:
    found = load_nominal(cad_files / f"wire-{schema}-{unit}.step")
    require_wire(found.curve)
    assert found.source_format == f"step-{schema.lower().removesuffix('is').removesuffix('d')}"
    assert found.notes[0] == f"unit of the file: {UNIT_WORDS[unit]}"
    assert found.plane is None


@pytest.mark.parametrize(("unit", "scale"), [("MM", 1.0), ("IN", 25.4), ("M", 1.0)])
def test_a_wire_that_open_cascade_wrote_as_iges_is_read_without_it(cad_files: Path, unit: str, scale: float) -> None:
    require_wire(load_nominal(cad_files / f"wire-{unit}.igs").curve, scale)


@pytest.mark.usefixtures("occt")
def test_the_same_curve_by_all_three_readers_gives_the_same_deviations(cad_files: Path, tmp_path: Path) -> None:
    document = new()
    draw_wire(document.modelspace())
    (tmp_path / "wire.igs").write_text(iges(wire_entities()), encoding="ascii")
    curves = [load_nominal(path).curve for path in (saved(document, tmp_path), tmp_path / "wire.igs", cad_files / "wire-AP214IS-MM.step")]
    off = TRUTH.points + np.random.default_rng(5).normal(0, 0.05, TRUTH.points.shape)
    judged = [deviations(off, discretize(curve, 500)) for curve in curves]
    for other in judged[1:]:
        np.testing.assert_allclose(other.deviation_mm, judged[0].deviation_mm, atol=1e-9, rtol=0)
        np.testing.assert_allclose(other.station_mm, judged[0].station_mm, atol=1e-8, rtol=0)


@pytest.mark.usefixtures("occt")
def test_a_wire_in_space_brings_its_plane_and_the_unit_can_be_put_right(cad_files: Path) -> None:
    upright = load_nominal(cad_files / "upright.step")
    require_wire(upright.curve)
    assert upright.plane is not None
    np.testing.assert_allclose(upright.plane.normal, [0, -1, 0], atol=1e-12)
    np.testing.assert_allclose(upright.plane.origin_mm, [0, 40, 0], atol=1e-9)
    require_wire(load_nominal(cad_files / "wire-AP203-INCH.step", unit="mm").curve, 1 / 25.4)
    require_wire(load_nominal(cad_files / "wire-AP203-MM.step", scale=2.0).curve, 2.0)


def cut(path: Path, height: float, curve: int | None = None) -> NominalFile:
    return load_nominal(path, curve=curve, section=plane((0, 0, height), (0, 0, 1)))


@pytest.mark.parametrize("name", ["part.step", "part.igs"])
@pytest.mark.usefixtures("occt")
def test_a_section_of_planes_and_a_slanted_bore_is_exact(cad_files: Path, name: str) -> None:
    """The box of 40 x 30 mm, and the ellipse that a bore of radius 8 along (0.2, 0, 1) leaves at a height."""
    box = cut(cad_files / name, 10.0, curve=1)
    assert (box.curve.closed, len(box.curve.corners)) == (True, 4)
    assert box.curve.length_mm == pytest.approx(140, abs=1e-9)
    assert any("faces by the plane {origin_mm: [0, 0, 10], normal: [0, 0, 1]" in note for note in box.notes)
    assert any("free-form" in note for note in box.notes) == (name == "part.igs")  # where OCCT writes all faces as splines
    bore = cut(cad_files / name, 10.0, curve=2).curve
    x, y = (bore.point(np.linspace(*bore.domain, 100)) - [20 + 0.2 * 15, 15]).T
    np.testing.assert_allclose((x / (8 * np.hypot(1, 0.2))) ** 2 + (y / 8) ** 2, 1, atol=1e-9)


@pytest.mark.usefixtures("occt")
def test_a_section_through_a_free_form_face_lies_on_it_as_nearly_as_it_says(cad_files: Path) -> None:
    section = plane((0, 33, 0), (0, 1, 0.1))
    found = load_nominal(cad_files / "torus.step", section=section)
    assert (found.curve.closed, len(found.curve.corners)) == (True, 0)
    x, y, z = section.to_machine(found.curve.point(np.linspace(*found.curve.domain, 3000))).T
    apart = np.abs(np.hypot(np.hypot(x, y) - TORUS[0], z) - TORUS[1]).max()
    (told,) = (note for note in found.notes if "free-form" in note)
    stated = float(told.split(" by ")[1].split(" mm")[0])
    assert apart < 2 * stated < 3e-8


@pytest.mark.usefixtures("occt")
def test_a_prism_and_an_assembly_give_the_wire_at_every_height(cad_files: Path) -> None:
    found = cut(cad_files / "prism.step", 21.0)
    assert abs(found.curve.length_mm - TRUTH.length) < 1e-7
    assert np.abs(deviations(TRUTH.points, discretize(found.curve, 500)).deviation_mm).max() < 2e-8
    turned = load_nominal(cad_files / "assembly.step", section=plane((0, 20, 0), (0, -1, 0)))
    assert np.abs(deviations(TRUTH.points, discretize(turned.curve, 500)).deviation_mm).max() < 2e-8


@pytest.mark.usefixtures("occt")
def test_a_section_that_is_none_is_refused_with_what_there_is(cad_files: Path) -> None:
    part = cad_files / "part.step"
    assert refusal(part) == "the plane of the section lies in a face of the part; move it by 0.01 mm"
    beside = refusal(part, plane((0, 0, 99), (0, 0, 1)))
    assert beside.startswith("the section at 99 mm along the normal (0, 0, 1) does not meet the part, which reaches from ")
    assert refusal(part, plane((0, 0, 10), (0, 0, 1))).startswith(
        "holds 2 closed curves; expected nominal.curve (--curve) to name the profile: "
    )


def test_a_process_that_cannot_start_or_lacks_the_kernel_says_so(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with (
        OcctProcess((sys.executable, "-c", "raise SystemExit(3)")) as process,
        pytest.raises(CadError, match=r"breaks down on it \(exit status 3\)"),
    ):
        process.read(tmp_path / "part.step", "step", (0, 0, 0), (0, 0, 1))
    (tmp_path / "OCP").mkdir()
    (tmp_path / "OCP" / "__init__.py").write_text("raise ImportError('libnowhere.so.7:\\n not found')\n", encoding="ascii")
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(tmp_path), str(ROOT)]))
    with OcctProcess() as process, pytest.raises(CadError, match=r"cannot be loaded: libnowhere\.so\.7: not found"):
        process.read(tmp_path / "part.step", "step", (0, 0, 0), (0, 0, 1))


def test_without_the_extra_one_line_brings_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    child = "import sys; sys.modules['OCP'] = None; sys.path.append(sys.argv[1]); from {module} import serve; serve()"
    monkeypatch.setattr("drivers.helper_process._CHILD", child)
    with OcctProcess() as process, pytest.raises(CadError, match=re.escape('-m pip install "cmmlink[cad]"')):
        process.read(tmp_path / "part.step", "step", (0, 0, 0), (0, 0, 1))


@pytest.mark.skipif(os.name != "posix", reason="needs a pipe with a name")
def test_a_process_that_is_killed_at_work_costs_a_message_and_is_started_again(occt: OcctProcess, cad_files: Path, tmp_path: Path) -> None:
    pipe = tmp_path / "part.step"
    os.mkfifo(pipe)

    def kill_at_work() -> None:
        with pipe.open("wb"):  # opens when the child reads
            occt._child._child.kill()

    killer = Thread(target=kill_at_work)
    killer.start()
    with pytest.raises(CadError, match=r"breaks down on it \(exit status -9\); export the file again"):
        occt.read(pipe, "step", (0, 0, 0), (0, 0, 1))
    killer.join()
    require_wire(load_nominal(cad_files / "wire-AP203-MM.step").curve)


@pytest.mark.usefixtures("occt")
def test_the_coordinates_of_a_section_are_those_of_its_plane_and_its_unit_is_that_of_the_file(cad_files: Path) -> None:
    """The torus is cut where z is 0, in axes whose x is the y of the part: its outer circle lies about (0, 3) there."""
    circle = load_nominal(cad_files / "torus.step", curve=1, section=plane((3, 0, 0), (0, 0, 1), (0, 1, 0))).curve
    x, y = (circle.point(np.linspace(*circle.domain, 200)) - [0, 3]).T
    np.testing.assert_allclose(np.hypot(x, y), sum(TORUS), atol=2e-8)
    with pytest.raises(NominalError, match=r"the unit of a solid that is cut is that of its file \(inch\)"):
        load_nominal(cad_files / "part.step", unit="mm", curve=1, section=plane((0, 0, 10), (0, 0, 1)))


@pytest.mark.usefixtures("occt")
def test_every_section_of_a_surface_is_held_against_the_section_of_the_solid_at_its_height(cad_files: Path, tmp_path: Path) -> None:
    """A cone from radius 20 to 15 over 20 mm, whose surface stands off by 0.02 mm everywhere: one circle would not do for three heights."""
    turn = np.linspace(0, 2 * np.pi, 721)[:-1]
    triangles = tube(np.column_stack([np.cos(turn), np.sin(turn)]), np.linspace(0.0, 20.0, 5))
    triangles[:, :, :2] *= 20.02 - 0.25 * triangles[:, :, 2:]
    surface = write(tmp_path / "cone.stl", binary_stl(triangles))
    stack = inspect(plan_of(surface, cad_files / "cone.step", {"heights_mm": [2.0, 10.0, 18.0]}, registration={"fit": "none"}))
    assert stack.verdict == Verdict.CONFORM
    for section in stack.sections:
        assert section.run.result is not None
        assert section.profile.length_mm == pytest.approx(2 * np.pi * (20 - 0.25 * section.slice.height_mm), abs=1e-9)
        assert section.run.result.deviation_mm == pytest.approx(0.02, abs=1e-3)
    assert any("a solid, which is cut at every section" in note for note in stack.notes)
