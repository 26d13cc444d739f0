"""Sections placed by one common motion: what lies together passes, what is sheared does not, though each section alone is right."""

from pathlib import Path

import numpy as np
import pytest
import yaml
from pydantic import ValidationError
from scipy.interpolate import BSpline

from cmmlink.stack import StackOutcome
from inspection import Verdict
from tests.cmmlink.blade import inspect, plan_of
from tests.cmmlink.command import cmmlink
from tests.drivers.surface.ct_phantom import write_spline
from tests.drivers.surface.meshes import binary_stl, tube, write

HEIGHTS: dict[str, object] = {"heights_mm": [5.0, 15.0]}


def leaning(folder: Path, spline: BSpline, lean: float, shift_mm: float) -> Path:
    """A blade from z = 0 to 20 mm that leans by so much a mm about z = 10, shifted along x."""
    triangles = tube(spline(np.linspace(0, 1, 600)), np.linspace(0.0, 20.0, 21))
    triangles[:, :, 0] += lean * (triangles[:, :, 2] - 10.0) + shift_mm
    return write(folder / "leaning.stl", binary_stl(triangles))


def nominal_of(folder: Path, spline: BSpline) -> Path:
    return write_spline(spline, folder / "blade.yaml")


def together(mesh: Path, nominal: Path, **further: object) -> StackOutcome:
    return inspect(plan_of(mesh, nominal, HEIGHTS, stack_fit="common", **further))


def test_a_blade_that_was_only_shifted_conforms_together(tmp_path: Path, spline: BSpline) -> None:
    stack = together(leaning(tmp_path, spline, 0.0, 0.7), nominal_of(tmp_path, spline))
    assert stack.verdict is Verdict.CONFORM
    poses = [section.run.result.registration.nominal_from_section for section in stack.sections if section.run.result is not None]
    assert poses[0].translation_mm.tolist() == poses[1].translation_mm.tolist()
    assert poses[0].translation_mm[0] == pytest.approx(-0.7, abs=1e-3)
    assert any(note.startswith("all sections are placed by one motion, the best fit of 2 of them together") for note in stack.notes)


def test_sections_that_are_right_alone_but_lie_apart_fail_together(tmp_path: Path, spline: BSpline) -> None:
    mesh = leaning(tmp_path, spline, 0.03, 0.0)  # 0.15 mm to either side
    assert inspect(plan_of(mesh, nominal_of(tmp_path, spline), HEIGHTS)).verdict is Verdict.CONFORM
    stack = together(mesh, nominal_of(tmp_path, spline))
    assert stack.verdict is Verdict.NONCONFORM
    for section in stack.sections:
        assert section.run.result is not None
        assert section.run.result.zone_error_mm == pytest.approx(0.3, abs=0.01)  # twice the shift, where the outline looks along x
        assert section.run.result.registration.nominal_from_section.translation_mm[0] == pytest.approx(
            0.0, abs=0.003
        )  # to the second order of the shift


def test_a_section_without_a_result_leaves_nothing_proven_of_the_others(tmp_path: Path, spline: BSpline) -> None:
    triangles = tube(spline(np.linspace(0, 1, 600)), np.linspace(0.0, 20.0, 21))
    triangles[:, :, :2] *= np.where(triangles[:, :, 2:] > 12, 0.2, 1.0)
    stack = together(write(tmp_path / "broken.stl", binary_stl(triangles)), nominal_of(tmp_path, spline))
    assert stack.verdict is Verdict.UNCERTAIN
    first = stack.sections[0].run.result
    assert first is not None
    assert first.reasons[0].words.startswith("The common fit of the sections is not sure, for the section at 15 mm has no result")


def test_each_section_of_a_common_fit_is_replayed_to_the_last_bit(tmp_path: Path, spline: BSpline) -> None:
    plan = plan_of(leaning(tmp_path, spline, 0.001, 0.3), nominal_of(tmp_path, spline), HEIGHTS, stack_fit="common", out=None)
    (tmp_path / "plan.yaml").write_text(yaml.safe_dump(plan.model_dump(mode="json")), encoding="utf-8")
    told = cmmlink("ct", tmp_path / "plan.yaml", "--records", tmp_path / "records", "--json").json()
    for section in told["slices"]:
        assert cmmlink("replay", section["run"], "--records", tmp_path / "records", "--json").json()["identical"]


def test_a_common_fit_takes_no_known_pose_and_no_minimum_zone() -> None:
    mesh, nominal = Path("blade.stl"), Path("blade.yaml")
    with pytest.raises(ValidationError, match="a datum places all sections already"):
        plan_of(mesh, nominal, HEIGHTS, stack_fit="common", registration={"datum": {}})
    with pytest.raises(ValidationError, match="a common fit is of least squares"):
        plan_of(mesh, nominal, HEIGHTS, stack_fit="common", registration={"fit": "minimum-zone"})
    zone = {"name": "contour", "type": "line-profile", "zone": {"lower_mm": -0.05, "upper_mm": 0.05}}
    for fit in ("minimum-zone", "tolerance"):
        with pytest.raises(ValidationError, match=f"a common fit is of least squares, and fit {fit} is of one section"):
            plan_of(mesh, nominal, HEIGHTS, stack_fit="common", tolerance=None, characteristics=[zone | {"fit": fit}])
