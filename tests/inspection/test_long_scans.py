"""Long scans: sixty bytes a point, the same result whatever pieces they are gone through by, and a live inspection in constant memory."""

import tracemalloc
from contextlib import ExitStack
from typing import Any
from unittest.mock import patch

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from inspection import InspectionResult, LiveInspection, NotMeasured, RegistrationError
from inspection.fine import _pose_fit
from inspection.kernels.layout import BLOCK
from inspection.station_order import in_station_order
from tests.inspection.live_scans import KINDS, ZONE, LiveScan, live_scan
from tests.inspection.profiles import Array, curve_of, even_in_arc_length, nominal_of

MOST_BYTES = 60
FULL = 1 << 30


def pieces_of(rows: int, sorted_together: int, projected: int) -> ExitStack:
    """Go through every scan by pieces of so many rows, sort so many together, and project so many together."""
    stack = ExitStack()
    stack.enter_context(patch("inspection.cloud.ROWS_AT_ONCE", rows))
    stack.enter_context(patch.object(in_station_order, "__defaults__", (np.empty, sorted_together)))
    stack.enter_context(patch.object(_pose_fit, "__defaults__", (projected,)))
    return stack


def finish(scan: LiveScan, points: Array, **options: Any) -> InspectionResult | str:
    live = LiveInspection(scan.nominal, ZONE, provisional=False, **options)
    live.add(points)
    try:
        return live.finish()
    except (NotMeasured, RegistrationError) as error:
        return str(error)


def everything(result: InspectionResult | str) -> list[object]:
    """What a result says, to the last bit."""
    if isinstance(result, str):
        return [result]
    arrays = (result.actual_mm, result.foot_mm, result.station_mm, result.deviation_mm, result.verdicts, result.rejection)
    told = [getattr(result, name) for name in ("verdict", "reasons", "coverage", "gap", "stretches", "worst", "rms_mm", "judged", "fit")]
    numbers = (result.max_deviation_mm, result.min_deviation_mm, result.best_fit_error_mm, result.minimum_zone_mm)
    return [*(array.tobytes() for array in arrays), *told, repr(numbers), repr(result.registration.nominal_from_section)]


@settings(deadline=None, max_examples=5)
@given(
    st.sampled_from(KINDS),
    st.integers(0, 20),
    st.sampled_from([{}, {"reject_outliers": True}, {"fit": "none"}, {"rule": "best-fit", "weights": "points"}]),
)
def test_the_pieces_of_a_scan_never_show_in_its_result(kind: Any, seed: int, options: dict[str, Any]) -> None:
    scan = live_scan(kind, seed, 700)
    points = np.column_stack([scan.points_mm, np.zeros(len(scan.points_mm))])
    points[5::97] = np.nan
    with pieces_of(FULL, FULL, FULL):
        expected = everything(finish(scan, points, **options))
    for pieces in ((64, 64, BLOCK), (1000, 100, 4 * BLOCK)):
        with pieces_of(*pieces):
            assert everything(finish(scan, points, **options)) == expected


def test_outliers_and_far_points_are_rejected_alike_whatever_the_pieces() -> None:
    scan = live_scan("good", 3, 700)
    points = scan.points_mm.copy()
    points[20::101] += 3.0  # beyond the zone, on the part
    points[[7, 65, 400]] = (5000.0, 4000.0)  # far from all others
    points[5::97] = np.nan
    with pieces_of(FULL, FULL, FULL):
        expected = finish(scan, points, reject_outliers=True)
    assert isinstance(expected, InspectionResult)
    assert expected.rejected_by_reason["outlier"] == len(points[20::101]) + 3
    with pieces_of(64, 64, BLOCK):
        assert everything(finish(scan, points, reject_outliers=True)) == everything(expected)


def traced_mb(count: int) -> tuple[float, float]:
    """The most that was allocated until a scan of so many points was finished, and what its result holds, in MB."""
    curve, rng = curve_of("P1"), np.random.default_rng(1)
    path = curve.point(even_in_arc_length(curve, 20_000))
    tracemalloc.start()
    live = LiveInspection(nominal_of("P1"), ZONE, provisional=False)
    for first in range(0, count, 10_000):
        points = path[(first + np.arange(10_000)) * 7 % 20_000] + rng.normal(0, 0.002, (10_000, 2))
        points[3] = np.nan
        live.add(np.column_stack([points, np.zeros(10_000)]))
    tracemalloc.reset_peak()
    result = live.finish()
    held, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert result.judged > 0.9 * count
    return peak / 1e6, held / 1e6


def test_finishing_takes_at_most_sixty_bytes_a_point() -> None:
    traced_mb(10_000)  # everything is compiled and loaded
    (peak, held), (larger_peak, larger_held) = traced_mb(270_000), traced_mb(400_000)
    assert (larger_peak - peak) / 0.13 <= MOST_BYTES
    assert (larger_held - held) / 0.13 <= MOST_BYTES * 0.75, "what the result holds: points and heights, and what was found of them"


def test_a_long_scan_keeps_no_more_places_than_are_new_and_its_result_is_the_same() -> None:
    scan = live_scan("late form", 3, 2000)
    short = LiveInspection(scan.nominal, ZONE)
    for points in np.array_split(scan.points_mm, 20):
        short.add(points)
    with patch("inspection.live.MANY", 300), patch("inspection.prefix.MANY", 300):
        long = LiveInspection(scan.nominal, ZONE)
        for points in np.array_split(scan.points_mm, 20):
            update = long.add(points)
            assert update.stop - update.first == len(points) or update.stop <= 300
            assert len(update.deviation_mm) == update.stop - update.first
            assert long.received == long.judged + sum(long.rejected_by_reason.values()) or update.state == "seeking"
            assert len(long._rows.actual) <= 300 + BLOCK
            prefix = long.prefix()
            assert prefix is None or len(prefix.points_mm) <= 300
    assert everything(long.finish()) == everything(short.finish())


def test_a_result_stays_as_it_is_while_the_scan_goes_on() -> None:
    scan = live_scan("good", 2, 900)
    whole = LiveInspection(scan.nominal, ZONE)
    live = LiveInspection(scan.nominal, ZONE)
    live.add(scan.points_mm[:800])
    early = live.finish()
    said = everything(early)
    live.add(scan.points_mm[800:])
    whole.add(scan.points_mm)
    assert everything(early) == said
    assert everything(live.finish()) == everything(live.finish()) == everything(whole.finish())
