"""What the judged points say about the profile: stretches out of tolerance, and how much of it was measured."""

import numpy as np
import pytest

from inspection import Verdict, coverage
from tests.inspection import profiles
from tests.inspection.profiles import curve_of, nominal_of
from tests.inspection.scans import inspect_in_batches


def test_a_stretch_ends_where_nothing_was_measured() -> None:
    curve = curve_of("P3")
    u = profiles.even_in_arc_length(curve, 2000)
    s = curve.station_mm(u)
    form = np.where((s > 58) & (s < 72), 0.2, 0.0)
    points = profiles.offset_points(curve, u, -form)[(s < 60) | (s > 70)]
    _, result = inspect_in_batches(nominal_of("P3"), points, 250, fit="none")
    assert [(round(stretch.from_mm), round(stretch.to_mm)) for stretch in result.stretches] == [(58, 60), (70, 72)]


def test_a_local_defect_is_one_stretch_where_it_lies() -> None:
    curve = curve_of("P3")
    u = profiles.even_in_arc_length(curve, 2000)
    s = curve.station_mm(u)
    for centre, sign in ((40.0, 1.0), (0.0, -1.0), (curve.length_mm - 1.0, 1.0)):
        gap = (s - centre + curve.length_mm / 2) % curve.length_mm - curve.length_mm / 2
        deviation = sign * 0.12 * np.exp(-((gap / 3.0) ** 2))
        _, result = inspect_in_batches(nominal_of("P3"), profiles.offset_points(curve, u, -deviation), 250, fit="none")
        # |0.12 exp(-(x/3)^2)| passes the outer border 0.055 at x = 3 sqrt(ln(0.12 / 0.055))
        half = 3.0 * np.sqrt(np.log(0.12 / 0.055))
        assert len(result.stretches) == 1
        found = result.stretches[0]
        assert found.from_mm % curve.length_mm == pytest.approx((centre - half) % curve.length_mm, abs=0.3)
        assert found.to_mm % curve.length_mm == pytest.approx((centre + half) % curve.length_mm, abs=0.3)
        assert (found.from_mm > found.to_mm) == (centre != 40.0)
        assert found.worst_mm == pytest.approx(sign * 0.12, abs=1e-3)
        assert result.out_of_tolerance == (np.abs(deviation) > 0.055).sum()
        assert result.verdict is Verdict.NONCONFORM


@pytest.mark.parametrize("name", ["P1", "P3"])
def test_coverage_is_the_share_of_the_length_between_neighbours_that_are_near(name: str) -> None:
    nominal = nominal_of(name)
    length = nominal.length_mm
    station = (np.arange(200) + 0.5) / 200 * length
    assert coverage(np.random.default_rng(1).permutation(station), nominal) == pytest.approx(1.0, abs=1e-12)
    assert coverage(station[:0], nominal) == 0.0
    # without the middle half, up to the stations left and right of it; the gap itself does not count
    kept = station[(station < 0.25 * length) | (station > 0.75 * length)]
    assert coverage(kept, nominal) == pytest.approx(0.5 - 1 / 200, abs=1e-12)
    # a gap counts as measured up to a hundredth of the length, or up to what is stated
    assert coverage(np.delete(station, [100]), nominal, gap_max_mm=2.001 / 200 * length) == pytest.approx(1.0, abs=1e-12)
    assert coverage(np.delete(station, [100, 101]), nominal) == pytest.approx(1.0 - 3 / 200, abs=1e-12)
    assert coverage(np.delete(station, [100, 101]), nominal, gap_max_mm=3.001 / 200 * length) == pytest.approx(1.0, abs=1e-12)
