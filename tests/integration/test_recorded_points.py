"""The same recorded points in batches of any size: the same verdicts and the same deviations, bit for bit."""

import threading
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from cmmlink.demo import part_path, plan_file
from cmmlink.events import Event, Judged, RunStarted
from cmmlink.from_plan import inspection_of, profile_of
from cmmlink.pipeline import RunOutcome, run_inspection
from cmmlink.plan.datum import Datum
from cmmlink.plan.scan import Plan, Registration, load_plan
from drivers.source import Arrival, PointBatch, ScanClosed, ScanOpened
from inspection import InspectionResult, NominalProfile, register
from simulators.motion import Motion, walk

COUNT = 1500
MOTION = Motion(
    speed_mm_s=275.0,  # once around at this rate and count
    rate_hz=2000.0,
    count=COUNT,
    form_error_mm=0.02,
    noise_mm=0.002,
    defect_mm=0.12,
    defect_station_mm=40.0,
    tip_radius_mm=1.0,
    rotation_deg=48.0,
    translation_mm=(210.0, 145.0, 60.0),
    seed=1,
)


class Recorded:
    """Recorded points in batches of one size."""

    def __init__(self, points_mm: NDArray[np.float64], size: int) -> None:
        self._points, self._size = points_mm, size
        self._stopped = threading.Event()

    def arrivals(self) -> Iterator[Arrival]:
        yield ScanOpened("recorded", "1", len(self._points))
        for start in range(0, len(self._points), self._size):
            if self._stopped.is_set():
                return
            batch = self._points[start : start + self._size].copy()
            yield PointBatch(np.arange(start, start + len(batch)), np.zeros(len(batch)), batch)
        yield ScanClosed(len(self._points))

    def stop(self) -> None:
        self._stopped.set()


@pytest.fixture(scope="module")
def plan() -> Plan:
    return load_plan(plan_file())


@pytest.fixture(scope="module")
def profile(plan: Plan) -> NominalProfile:
    return profile_of(plan)


@pytest.fixture(scope="module")
def points_mm(profile: NominalProfile) -> NDArray[np.float64]:
    return walk(part_path(profile.curve), MOTION).points_mm


def carried_out(plan: Plan, profile: NominalProfile, points_mm: NDArray[np.float64], size: int) -> tuple[RunOutcome, list[Judged]]:
    """Run through a buffer that holds one batch, so that batches cannot merge into much larger ones."""
    judged: list[Judged] = []

    def sink(event: Event) -> None:
        if isinstance(event, Judged):
            judged.append(event)

    started = RunStarted("part", "", "", "recorded", False)
    source, live = Recorded(points_mm, size), inspection_of(plan, profile)
    outcome = run_inspection(source, live, [sink], started, buffer_points=size, clock=lambda: 0.0, stop=threading.Event())
    return outcome, judged


def same(one: InspectionResult, other: InspectionResult) -> None:
    for name in ("deviation_mm", "station_mm", "foot_mm", "actual_mm", "verdicts", "rejection"):
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name), err_msg=name)
    assert (one.verdict, one.stretches, one.coverage) == (other.verdict, other.stretches, other.coverage)
    poses = [result.registration.nominal_from_section for result in (one, other)]
    assert poses[0].rotation_rad == poses[1].rotation_rad
    np.testing.assert_array_equal(poses[0].translation_mm, poses[1].translation_mm)


@pytest.mark.parametrize("known_pose", [False, True], ids=["sought pose", "datum"])
def test_batches_of_any_size_give_the_same_deviations_bit_for_bit(
    plan: Plan, profile: NominalProfile, points_mm: NDArray[np.float64], known_pose: bool
) -> None:
    if known_pose:
        turned = -np.radians(MOTION.rotation_deg)
        x, y = np.array([[np.cos(turned), -np.sin(turned)], [np.sin(turned), np.cos(turned)]]) @ -np.array(MOTION.translation_mm[:2])
        datum = Datum(rotation_deg=-MOTION.rotation_deg, translation_mm=(float(x), float(y)))
        plan = plan.model_copy(update={"registration": Registration(datum=datum, fit="none")})
    runs = {size: carried_out(plan, profile, points_mm, size) for size in (1, 7, 64, COUNT)}
    assert len(runs[1][1]) > len(runs[64][1]) > len(runs[COUNT][1])  # they really were cut differently
    reference = runs[COUNT][0].result
    assert reference is not None
    assert (reference.received, reference.judged, reference.out_of_tolerance > 0) == (COUNT, COUNT, True)
    assert reference.stretches[0].worst_mm == pytest.approx(0.12, abs=0.02)
    for outcome, _ in runs.values():
        assert outcome.result is not None
        assert (outcome.counts.received, outcome.counts.judged, outcome.counts.rejected) == (COUNT, COUNT, 0)
        same(outcome.result, reference)


@pytest.mark.parametrize("seed", [2, 4])
def test_a_scan_cut_short_anywhere_is_registered_where_the_part_lies(profile: NominalProfile, seed: int) -> None:
    """A third of the section slides along itself and still fits at all but a few points at the edge: those must count."""
    scan = walk(part_path(profile.curve), replace(MOTION, defect_mm=0.0, seed=seed)).points_mm[:, :2]
    for count in range(COUNT // 10, COUNT, COUNT // 40):
        found = register(scan[:count], profile, tip_radius_mm=MOTION.tip_radius_mm)
        assert found.rms_mm < MOTION.form_error_mm, count
        assert np.degrees(found.nominal_from_section.rotation_rad) == pytest.approx(-MOTION.rotation_deg, abs=0.3), count
