"""The course along a nominal, as a measuring machine is told it."""

import numpy as np
import pytest

from cmmlink.demo import plan_file
from cmmlink.dme_job import course_along_nominal, job_of, questions_of
from cmmlink.from_plan import profile_of
from cmmlink.plan.datum import Datum
from cmmlink.plan.scan import Plan, Section, load_plan
from cmmlink.plan.scan_devices import DmeDevice
from inspection import deviations

CHORD_ERROR_MM = 0.002


@pytest.fixture(scope="module")
def plan() -> Plan:
    return load_plan(plan_file())


def test_a_course_keeps_to_the_nominal_and_points_out_of_the_material(plan: Plan) -> None:
    course, closed = course_along_nominal(plan, CHORD_ERROR_MM, 5.0)
    profile = profile_of(plan)
    point, outward = course[:, :2], course[:, 3:5]
    assert closed
    assert not course[:, [2, 5]].any()
    np.testing.assert_allclose(np.hypot(*outward.T), 1.0, atol=1e-12)
    np.testing.assert_allclose(deviations(point, profile).deviation_mm, 0.0, atol=1e-9)
    np.testing.assert_allclose(deviations(point + 0.01 * outward, profile).deviation_mm, 0.01, atol=1e-6)
    middle = 0.5 * (point + np.roll(point, -1, axis=0))
    assert np.abs(deviations(middle, profile).deviation_mm).max() < 1.2 * CHORD_ERROR_MM
    steps = np.hypot(*(point - np.roll(point, -1, axis=0)).T)
    assert steps.max() <= 5.0
    assert len(course) < 200  # far fewer points than the nominal has samples


def test_a_course_lies_where_section_and_datum_put_it(plan: Plan) -> None:
    """The datum brings the section onto the nominal, so that the course goes the other way, and then into the plane."""
    section = Section(origin_mm=(10.0, 20.0, 60.0), normal=(1.0, 0.0, 0.0), x_axis=(0.0, 1.0, 0.0))
    datum = Datum(rotation_deg=90.0, translation_mm=(5.0, 0.0))
    registration = plan.registration.model_copy(update={"datum": datum})
    moved, _ = course_along_nominal(plan.model_copy(update={"section": section, "registration": registration}), CHORD_ERROR_MM, 5.0)
    there, _ = course_along_nominal(plan, CHORD_ERROR_MM, 5.0)
    x, y = there[:, 0], there[:, 1]
    section_x, section_y = y, -(x - 5.0)  # turned back by 90 degrees
    np.testing.assert_allclose(moved[:, :3], np.column_stack([np.full(len(x), 10.0), 20.0 + section_x, 60.0 + section_y]), atol=1e-9)
    np.testing.assert_allclose(moved[:, 3:], np.column_stack([np.zeros(len(x)), there[:, 4], -there[:, 3]]), atol=1e-9)


def test_several_scans_follow_one_another_with_the_moves_before_them(plan: Plan) -> None:
    first = {"type": "line", "start_mm": (0, 0, 0), "end_mm": (8, 0, 0), "normal": (0, -1, 0), "step_mm": 0.5}
    second = {**first, "via_mm": [(8, -20, 0), (8.5, -20, 1e-3)], "start_mm": (8, 0, 1), "end_mm": (0, 0, 1)}
    device = DmeDevice.model_validate({"type": "dme", "address": "127.0.0.1:1294", "scans": [first, second]})
    assert job_of(plan, device).scans == (
        "ScanOnLine(0,0,0,8,0,0,0,-1,0,0.5)",
        "GoTo(X(8), Y(-20), Z(0))",
        "GoTo(X(8.5), Y(-20), Z(0.001))",
        "ScanOnLine(8,0,1,0,0,1,0,-1,0,0.5)",
    )
    with pytest.raises(ValueError, match="either scan or scans"):
        DmeDevice.model_validate({"type": "dme", "address": "127.0.0.1:1294", "scan": first, "scans": [second]})


def test_questions_move_nothing(plan: Plan) -> None:
    device = DmeDevice(type="dme", address="127.0.0.1:1294", tool="Probe1", home=True, speed_mm_s=10.0)
    asked, questions = job_of(plan, device), questions_of(plan, device)
    assert asked.scans[0].startswith("ScanOnCurve(Closed(1), ")
    assert asked.settings == ("Tool.ScanPar.Speed(10)",)
    assert (questions.scans, questions.preparations, questions.settings, questions.tool, questions.home) == ((), (), (), None, False)
