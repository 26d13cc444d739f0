"""Sections of a surface from file to verdict: the known truth of a phantom, and surfaces without noise."""

import threading
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.interpolate import BSpline

from cmmlink.errors import PlanError
from cmmlink.stack import SectionOutcome, StackOutcome, inspect_stack
from drivers.errors import MeshError
from drivers.surface.open3d_process import Open3DMissing, Open3DStatus
from inspection import RegistrationError, Verdict
from tests.cmmlink.blade import chord_mm, inspect, plan_of, tapered
from tests.drivers.surface.ct_phantom import (
    Defect,
    Phantom,
    make_phantom,
    noise_mm,
    write_nominal,
    write_spline,
    write_stl,
)
from tests.drivers.surface.meshes import Triangles, binary_stl, box, tube, write

VOXEL = 0.1
DEFECT = Defect(height_mm=0.1, station_mm=40.0, part_height_mm=2.0)


@dataclass(frozen=True)
class Scanned:
    phantom: Phantom
    part_heights_mm: list[float]
    stack: StackOutcome


@pytest.fixture(scope="module")
def scanned(tmp_path_factory: pytest.TempPathFactory) -> Scanned:
    folder = tmp_path_factory.mktemp("phantom")
    phantom = make_phantom(seed=1, voxel_mm=VOXEL, height_mm=4.0, specks=25, defect=DEFECT)
    part_heights = [0.4, 1.0, 2.0, 3.6]
    heights = [phantom.machine_height_mm(height) for height in part_heights]
    stl, nominal = write_stl(phantom, folder / "phantom.stl"), write_nominal(phantom, folder / "nominal.yaml")
    plan = plan_of(stl, nominal, {"normal": tuple(phantom.normal), "heights_mm": tuple(heights)})
    plan = plan.model_copy(update={"rule": "best-fit"})  # another placement takes a defect of this height into the zone
    return Scanned(phantom, part_heights, inspect(plan))


def found(section: SectionOutcome) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    result = section.run.result
    assert result is not None
    judged = np.isfinite(result.deviation_mm)
    return result.station_mm[judged], result.deviation_mm[judged]


def test_the_form_error_of_the_phantom_is_found_within_its_noise(scanned: Scanned) -> None:
    for section, height in zip(scanned.stack.sections, scanned.part_heights_mm, strict=True):
        station, deviation = found(section)
        noise = noise_mm(scanned.phantom, height, station, deviation)
        assert abs(noise.mean()) < 0.05 * VOXEL  # the threshold's bias
        assert 0.08 * VOXEL < noise.std() < 0.16 * VOXEL  # 0.13 voxel is what such a scan gives
        assert np.abs(noise).max() < 0.6 * VOXEL


def test_every_point_is_accounted_for(scanned: Scanned) -> None:
    for section in scanned.stack.sections:
        facts = section.result_json()
        assert facts["received"] == facts["judged"] + facts["rejected"] == sum(len(c.points_mm) for c in section.judged) > 2500
        assert facts["lost"] == 0
        assert facts["coverage"] > 0.99


def test_the_defect_is_found_where_it_is_and_only_there(scanned: Scanned) -> None:
    at_defect, beside = scanned.stack.sections[2], scanned.stack.sections[3]
    assert at_defect.verdict is Verdict.NONCONFORM
    result = at_defect.run.result
    assert result is not None
    assert result.worst is not None
    assert result.station_mm[result.worst] == pytest.approx(DEFECT.station_mm, abs=1.2)
    true = float(scanned.phantom.form_error_mm(result.station_mm[[result.worst]], 2.0)[0])
    assert result.deviation_mm[result.worst] == pytest.approx(true, abs=4 * 0.13 * VOXEL)
    assert all(abs(s.from_mm - DEFECT.station_mm) < 3 and abs(s.to_mm - DEFECT.station_mm) < 3 for s in result.stretches)
    assert beside.verdict is Verdict.CONFORM
    assert scanned.stack.verdict is Verdict.NONCONFORM


def test_the_dust_is_set_aside(scanned: Scanned) -> None:
    set_aside = 0
    for section, height in zip(scanned.stack.sections, scanned.part_heights_mm, strict=True):
        cut_through = sum(abs(speck.part_height_mm - height) < 0.6 * speck.radius_mm for speck in scanned.phantom.dust)
        assert section.slice.set_aside >= cut_through
        assert len(section.slice.contours) == 1
        set_aside += section.slice.set_aside
    assert set_aside >= 5


def test_a_blade_as_nominal_conforms_closely(blade: tuple[Path, Path], spline: BSpline) -> None:
    stack = inspect(plan_of(*blade, {"heights_mm": (5.0, 10.0)}))
    assert stack.verdict is Verdict.CONFORM
    for section in stack.sections:
        assert np.abs(found(section)[1]).max() < 1.1 * chord_mm(spline)
        assert section.warnings == ()


def test_sections_of_a_tapered_blade_have_nominals_of_their_own(tmp_path: Path, spline: BSpline) -> None:
    mesh = write(tmp_path / "tapered.stl", binary_stl(tapered(spline)))
    common = write_spline(spline, tmp_path / "0.yaml")
    own = [{"height_mm": z, "file": write_spline(spline, tmp_path / f"{z}.yaml", 1 - 0.005 * z)} for z in (4.0, 10.0)]
    stack = inspect(plan_of(mesh, common, {"heights_mm": (10.0, 4.0, 0.2), "nominal_at": own}))
    assert [section.verdict for section in stack.sections] == [Verdict.CONFORM] * 3
    assert [section.nominal_file.name for section in stack.sections] == ["10.0.yaml", "4.0.yaml", "0.yaml"]
    without = inspect(plan_of(mesh, common, {"heights_mm": (10.0, 4.0)}))
    assert [section.verdict for section in without.sections] == [Verdict.NONCONFORM] * 2


def test_a_nominal_for_no_section_is_refused(blade: tuple[Path, Path]) -> None:
    with pytest.raises(PlanError, match=r"height 7 mm, which is none of the sections; the nearest is 6 mm"):
        inspect(plan_of(*blade, {"heights_mm": (1.0, 6.0), "nominal_at": ({"height_mm": 7, "file": blade[1]},)}))


@pytest.mark.parametrize(
    ("where", "expected"),
    [
        ({"every_mm": 5.0}, [2.5, 7.5, 12.5, 17.5]),
        ({"every_mm": 5.0, "from_mm": 3.0}, [3.0, 8.0, 13.0, 18.0]),
        ({"every_mm": 0.1, "from_mm": 4.0, "to_mm": 4.3}, [4.0, 4.1, 4.2, 4.3]),
        ({"every_mm": 7.0, "from_mm": 4.0, "to_mm": 4.3}, [4.0]),
    ],
)
def test_a_section_every_step(blade: tuple[Path, Path], where: dict[str, object], expected: list[float]) -> None:
    stack = inspect(plan_of(*blade, where))
    assert [section.slice.asked_mm for section in stack.sections] == pytest.approx(expected, abs=1e-12)


def test_a_hole_beside_the_outline_is_told_and_not_judged(tmp_path: Path, spline: BSpline) -> None:
    outline = tube(spline(np.linspace(0, 1, 600)), np.array([0.0, 20.0]))
    hole = box((20, 0.5, -1), (23, 3.5, 21))[:, ::-1]
    mesh = write(tmp_path / "hollow.stl", binary_stl(np.concatenate([outline, hole])))
    (section,) = inspect(plan_of(mesh, write_spline(spline, tmp_path / "n.yaml"), {"heights_mm": (5.0,)})).sections
    assert section.verdict is Verdict.CONFORM
    assert [len(section.slice.contours), len(section.judged)] == [2, 1]
    assert any("1 of them holes, are not judged; the longest is 12.00 mm" in text for text in section.warnings)
    assert section.result_json()["holes"] == 1


def test_a_part_of_the_surface_that_is_missing_makes_the_section_uncertain(tmp_path: Path, spline: BSpline) -> None:
    triangles = tube(spline(np.linspace(0, 1, 600)), np.array([0.0, 20.0]))
    middle = triangles[:, :, 0].mean(axis=1)
    there = ~((middle > 20) & (middle < 30))  # a strip of both sides
    mesh = write(tmp_path / "torn.stl", binary_stl(triangles[there]))
    (section,) = inspect(plan_of(mesh, write_spline(spline, tmp_path / "n.yaml"), {"heights_mm": (5.0,)})).sections
    assert section.verdict is Verdict.UNCERTAIN
    assert len(section.judged) == 2  # the two open pieces, judged together
    result = section.run.result
    assert result is not None
    assert 0.8 < result.coverage < 0.87
    assert np.nanmax(np.abs(result.deviation_mm)) < 1.1 * chord_mm(spline)
    assert any("2 open contour(s), left open" in text for text in section.warnings)


def test_a_surface_of_another_part_is_refused(tmp_path: Path, blade: tuple[Path, Path]) -> None:
    mesh = write(tmp_path / "box.stl", binary_stl(box((0, 0, 0), (60, 60, 20))))
    with pytest.raises(RegistrationError, match=r"240\.00 mm long, the nominal 124\.\d+ mm: this is no section of the part"):
        inspect(plan_of(mesh, blade[1], {"heights_mm": (5.0, 10.0)}))


def blade_with(tmp_path: Path, spline: BSpline, *others: Triangles) -> SectionOutcome:
    mesh = write(tmp_path / "mesh.stl", binary_stl(np.concatenate([*others, tube(outline_points(spline), np.array([0.0, 20.0]))])))
    (section,) = inspect(plan_of(mesh, write_spline(spline, tmp_path / "n.yaml"), {"heights_mm": (5.0,)})).sections
    return section


def outline_points(spline: BSpline, points: int = 600) -> NDArray[np.float64]:
    return np.asarray(spline(np.linspace(0, 1, points)))


def length_mm(points_mm: NDArray[np.float64]) -> float:
    return float(np.linalg.norm(points_mm - np.roll(points_mm, 1, axis=0), axis=1).sum())


def circle(radius: float, centre: NDArray[np.float64], points: int = 120) -> NDArray[np.float64]:
    angle = 2 * np.pi * np.arange(points) / points
    return np.asarray(centre + radius * np.column_stack([np.cos(angle), np.sin(angle)]))


def test_a_part_in_a_tube_is_judged_and_the_tube_is_not(tmp_path: Path, spline: BSpline) -> None:
    middle = outline_points(spline).mean(axis=0)
    heights = np.array([0.0, 20.0])
    walls = [tube(circle(50.0, middle), heights), tube(circle(48.0, middle), heights)]
    section = blade_with(tmp_path, spline, *walls)
    assert section.verdict is Verdict.CONFORM
    (outline,) = section.judged
    assert outline.length_mm == pytest.approx(length_mm(outline_points(spline)), abs=1e-3)
    assert [contour.hole for contour in section.slice.contours] == [False, True, False]


@pytest.mark.parametrize("corner", [0, 1, 300, 599])
def test_a_pin_that_touches_the_blade_at_a_corner_does_not_hide_it(tmp_path: Path, spline: BSpline, corner: int) -> None:
    blade = outline_points(spline)
    out = blade[corner] - blade.mean(axis=0)
    away = out / np.linalg.norm(out)
    side = np.array([-away[1], away[0]])
    pin = blade[corner] + np.array([[0, 0], [6, -6], [12, 0], [6, 6]]) @ np.array([away, side])
    section = blade_with(tmp_path, spline, tube(pin, np.array([0.0, 20.0])))
    assert section.verdict is Verdict.CONFORM
    assert section.judged[0].length_mm == pytest.approx(length_mm(blade), abs=1e-3)
    assert not any(contour.hole for contour in section.slice.contours)


def test_a_shell_that_overlaps_the_blade_is_told_and_the_blade_is_judged(tmp_path: Path, spline: BSpline) -> None:
    top = outline_points(spline)[150]
    section = blade_with(tmp_path, spline, box((top[0] - 1, top[1] - 1, -1), (top[0] + 1, top[1] + 9, 21)))
    assert section.verdict is Verdict.CONFORM
    assert section.judged[0].length_mm == pytest.approx(length_mm(outline_points(spline)), abs=1e-3)
    assert any("1 pair(s) of contours overlap, and none of them is taken for a hole" in text for text in section.warnings)


def test_a_round_bar_as_long_around_as_the_blade_is_not_taken_for_it(tmp_path: Path, spline: BSpline) -> None:
    around = length_mm(outline_points(spline))
    bar = tube(circle(1.02 * around / (2 * np.pi), np.array([200.0, 0.0])), np.array([0.0, 20.0]))
    section = blade_with(tmp_path, spline, bar)
    assert section.verdict is Verdict.CONFORM
    assert section.judged[0].length_mm == pytest.approx(around, abs=1e-3)


@pytest.mark.parametrize("torn", [False, True])
def test_a_corner_far_off_costs_no_points_out_of_proportion(tmp_path: Path, spline: BSpline, torn: bool) -> None:
    triangles = tube(circle(20.0, np.zeros(2)), np.array([0.0, 20.0]))
    if torn:
        triangles = triangles[4:]
    triangles[10 if torn else 0, 0, 0] = 9e5
    mesh = write(tmp_path / "far.stl", binary_stl(triangles))
    plan = plan_of(mesh, write_spline(spline, tmp_path / "n.yaml"), {"heights_mm": (5.0,)})
    with pytest.raises(RegistrationError, match="this is no section of the part"):
        inspect(plan)


def test_a_blade_as_obj_is_judged_as_the_same_blade_as_stl_and_needs_no_open3d(
    tmp_path: Path, spline: BSpline, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("cmmlink.stack_inputs.Open3DProcess", None)
    triangles = tube(outline_points(spline), np.array([0.0, 20.0]))
    rows = [f"v {x!r} {y!r} {z!r}" for x, y, z in triangles.reshape(-1, 3).tolist()]
    rows += ["l 1 900", "p 1", *(f"f {3 * i + 1} {3 * i + 2} {3 * i + 3}" for i in range(len(triangles)))]
    mesh = write(tmp_path / "blade.obj", "\n".join(rows))
    stack = inspect(plan_of(mesh, write_spline(spline, tmp_path / "n.yaml"), {"heights_mm": (5.0,)}))
    assert stack.verdict is Verdict.CONFORM
    assert stack.sections[0].judged[0].length_mm == pytest.approx(length_mm(outline_points(spline)), abs=1e-9)
    assert "only faces are a surface; left out: 1 lines (l), 1 points (p)" in stack.result_json()["notes"]


def test_two_parts_on_one_surface_are_told(tmp_path: Path, spline: BSpline) -> None:
    second = tube(outline_points(spline) + np.array([0.0, 100.0]), np.array([0.0, 20.0]))
    section = blade_with(tmp_path, spline, second)
    assert len(section.judged) == 1
    assert any("2 contours at height 5 mm can be the section of the part" in text for text in section.warnings)
    assert section.verdict is Verdict.CONFORM  # both do


def test_two_parts_of_which_one_is_bad_are_no_proof(tmp_path: Path, spline: BSpline) -> None:
    bad = outline_points(spline) + np.array([0.0, 100.0])
    middle = bad.mean(axis=0)
    out = (bad - middle) / np.linalg.norm(bad - middle, axis=1)[:, None]
    bad[100:140] += 0.5 * np.sin(np.linspace(0, np.pi, 40))[:, None] * out[100:140]
    section = blade_with(tmp_path, spline, tube(bad, np.array([0.0, 20.0])))
    assert section.verdict is Verdict.UNCERTAIN
    reason = section.result_json()["reasons"][0]
    assert reason["kind"] == "outline"
    assert "is CONFORM" in reason["words"]
    assert "NOT CONFORM" in reason["words"]


def test_a_contour_as_long_that_does_not_fit_is_no_rival(tmp_path: Path, spline: BSpline) -> None:
    mirrored = outline_points(spline)[::-1] * np.array([1.0, -1.0]) + np.array([0.0, 100.0])
    section = blade_with(tmp_path, spline, tube(mirrored, np.array([0.0, 20.0])))
    assert section.verdict is Verdict.CONFORM
    assert section.judged[0].points_mm[:, 1].mean() < 50.0


@pytest.mark.parametrize("radius", [50.0, 450.0])
def test_a_part_in_a_shell_without_an_inner_wall_is_judged_and_said(tmp_path: Path, spline: BSpline, radius: float) -> None:
    shell = tube(circle(radius, outline_points(spline).mean(axis=0)), np.array([0.0, 20.0]))
    section = blade_with(tmp_path, spline, shell)
    assert section.verdict is Verdict.CONFORM
    assert section.judged[0].length_mm == pytest.approx(length_mm(outline_points(spline)), abs=1e-3)
    assert any("a part in a shell without an inner wall" in text for text in section.warnings)


def test_a_part_on_a_large_table_is_no_dust(tmp_path: Path, spline: BSpline) -> None:
    section = blade_with(tmp_path, spline, box((-900.0, -40.0, -1.0), (900.0, -30.0, 21.0)))
    assert section.verdict is Verdict.CONFORM


def test_one_section_that_fits_nothing_does_not_spoil_the_others(tmp_path: Path, spline: BSpline) -> None:
    foot = box((0, -30, -10), (60, 30, -0.5))
    mesh = write(tmp_path / "footed.stl", binary_stl(np.concatenate([foot, tube(spline(np.linspace(0, 1, 600)), np.array([0.0, 20.0]))])))
    stack = inspect(plan_of(mesh, write_spline(spline, tmp_path / "n.yaml"), {"heights_mm": (-5.0, 5.0)}))
    assert [section.verdict for section in stack.sections] == [Verdict.UNCERTAIN, Verdict.CONFORM]
    assert stack.verdict is Verdict.UNCERTAIN
    assert stack.sections[0].result_json()["judged"] == 0
    assert stack.sections[0].warnings


def test_the_cutter_is_the_one_asked_for_and_gives_the_same_verdicts(blade: tuple[Path, Path]) -> None:
    where: dict[str, object] = {"normal": (0.01, 0.02, 1), "heights_mm": (5.0,)}
    by_numpy = inspect(plan_of(*blade, where)).result_json()
    by_default = inspect(plan_of(*blade, where, cut={})).result_json()
    assert by_numpy["slices"][0]["cutter"] == "numpy"
    by_numpy["slices"][0].pop("cutter"), by_default["slices"][0].pop("cutter")
    assert by_default["slices"] == by_numpy["slices"]


def test_an_open3d_that_cannot_be_loaded_costs_a_note(blade: tuple[Path, Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "open3d").mkdir()
    write(tmp_path / "open3d" / "__init__.py", "raise ImportError('libnowhere.so.7: cannot open shared object file')\n")
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    stack = inspect(plan_of(*blade, {"heights_mm": (5.0,)}, cut={}))
    assert [section.slice.cutter for section in stack.sections] == ["numpy"]
    assert any("cut by numpy. Open3D cannot be loaded" in note and "libnowhere.so.7" in note for note in stack.notes)


def test_a_cutter_that_breaks_down_in_the_middle_is_replaced_and_it_is_said(
    blade: tuple[Path, Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    class Breaking:
        name = "open3d of a test"

        def __enter__(self) -> "Breaking":
            return self

        def __exit__(self, *_: object) -> None:
            return None

        def status(self) -> Open3DStatus:
            return Open3DStatus("0.20.0")

        def cut(self, triangles: NDArray[np.float64]) -> NDArray[np.float64]:
            raise Open3DMissing("the process with Open3D ended (exit status -11)")

    monkeypatch.setattr("cmmlink.stack_inputs.Open3DProcess", Breaking)
    stack = inspect(plan_of(*blade, {"heights_mm": (5.0, 6.0)}, cut={"cutter": "open3d"}))
    assert [section.slice.cutter for section in stack.sections] == ["numpy", "numpy"]
    assert any("cut by numpy: the process with Open3D ended" in note for note in stack.notes)


def test_a_stack_cut_short_proves_nothing(blade: tuple[Path, Path]) -> None:
    stop = threading.Event()
    plan = plan_of(*blade, {"heights_mm": (5.0, 10.0, 15.0)})
    stack = inspect_stack(plan, clock=time.monotonic, stop=stop, on_section=lambda _: stop.set())
    assert [section.verdict for section in stack.sections] == [Verdict.CONFORM]
    assert stack.verdict is Verdict.UNCERTAIN
    assert (stack.result_json()["verdict"], stack.result_json()["complete"]) == ("uncertain", False)
    assert stack.notes[-1] == "aborted by the operator after 1 of 3 sections"
    assert inspect(plan).result_json()["complete"] is True


def test_a_bad_surface_names_the_place(tmp_path: Path, blade: tuple[Path, Path]) -> None:
    mesh = write(tmp_path / "cut.stl", blade[0].read_bytes()[:-10])
    with pytest.raises(MeshError, match=r"the file ends in triangle 1200 \(byte 60034\)"):
        inspect(plan_of(mesh, blade[1], {"heights_mm": (5.0,)}))
