"""A measured datum against closed forms: known motions, total least squares by singular values, and arcs of a circle."""

from functools import cache

import numpy as np
import pytest

from inspection import InspectionError, NominalProfile, RigidTransform, discretize
from inspection.datum import DatumFeature, DatumFeatures, FoundDatum, find_datum
from inspection.signed_deviations import deviations
from tests.inspection import profiles
from tests.inspection.profiles import Array

HALF, RADIUS = 40.0, 8.0
BOTTOM = 2 * HALF  # stations of the lower side; the right end follows, then the upper side
END = np.pi * RADIUS
OFF = RigidTransform(0.02, np.array([0.3, -0.2]))  # where the run's fit has left the part
GAP = 2.0


@cache
def stadium() -> NominalProfile:
    return discretize(profiles.stadium(HALF, RADIUS), samples=4000)


def line(first: float = 10.0, last: float = 70.0) -> DatumFeature:
    return DatumFeature("line", first, last, f"line station {first:g} .. {last:g} mm")


def point(station: float, within: float = 2.0) -> DatumFeature:
    return DatumFeature("point", station - within, station + within, f"point at station {station:g} mm")


TIP = BOTTOM + END / 2
LINE_AND_POINT = DatumFeatures((line(), point(TIP)))
EDGE_AND_POINT = DatumFeatures((DatumFeature("edge", BOTTOM + 2, BOTTOM + END - 2, "edge"), point(20.0)))
THREE_POINTS = DatumFeatures((point(10.0), point(70.0), point(TIP)))


def places(station: Array, deviation: Array) -> Array:
    """Points (m, 2) that far off the nominal at these stations."""
    at = np.stack([np.interp(station, stadium().station_mm, stadium().points_mm[:, k]) for k in (0, 1)], axis=1)
    d = deviations(at, stadium())
    return d.foot_mm + deviation[:, None] * d.normal


def stations(count: int = 800) -> Array:
    return (np.arange(count) + 0.5) / count * stadium().length_mm


def found(points: Array, features: DatumFeatures, weights: str = "arc-length", start: RigidTransform | None = None) -> FoundDatum:
    return find_datum(points, stadium(), features, start or RigidTransform.identity(), GAP, weights=weights)  # type: ignore[arg-type]


@pytest.mark.parametrize("features", [LINE_AND_POINT, EDGE_AND_POINT, THREE_POINTS], ids=lambda of: of.words)
def test_a_part_that_is_right_where_its_datum_is_has_the_motion_of_the_datum_whatever_it_is_elsewhere(features: DatumFeatures) -> None:
    s = stations()
    elsewhere = np.where(s > BOTTOM + END, 0.5 * np.sin((s - BOTTOM - END) / 9.0), 0.0)
    datum = found(OFF.apply(places(s, elsewhere)), features)
    np.testing.assert_allclose(datum.pose.after(OFF).translation_mm, 0.0, atol=1e-7)
    assert datum.pose.after(OFF).rotation_rad == pytest.approx(0.0, abs=1e-9)
    assert all(one.rms_mm < 1e-7 for one in datum.seen)


def test_a_line_is_that_of_total_least_squares() -> None:
    s = stations()
    noise = 0.02 * np.random.default_rng(3).standard_normal(len(s))
    points = OFF.apply(places(s, noise))
    datum = found(points, LINE_AND_POINT, "points")
    at = datum.pose.apply(points)
    station = deviations(at, stadium()).station_mm
    of_line = points[(station >= 10) & (station <= 70)]
    _, _, axes = np.linalg.svd(of_line - of_line.mean(axis=0))
    across = datum.pose.apply(np.array([of_line.mean(axis=0), of_line.mean(axis=0) + axes[1]]))
    assert across[0, 1] == pytest.approx(-RADIUS, abs=1e-8)  # the middle of the points lies on the nominal line
    assert across[1, 0] - across[0, 0] == pytest.approx(0.0, abs=1e-8)  # and the line runs along it


def test_an_edge_that_is_too_large_all_round_moves_by_what_least_squares_over_both_shifts_gives() -> None:
    grown = 1e-4
    s = stations(4000)
    on_edge = (s >= BOTTOM + 2) & (s <= BOTTOM + END - 2)
    datum = found(places(s, np.where(on_edge, grown, 0.0)), EDGE_AND_POINT, "points")
    angle = (s[on_edge] - TIP) / RADIUS
    normals = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    shift = np.linalg.lstsq(normals, np.full(len(angle), -grown))[0]  # of a circle that keeps its radius
    np.testing.assert_allclose(datum.pose.apply(np.array([[HALF, 0.0]]))[0] - [HALF, 0.0], shift, atol=3e-9)
    assert shift[0] < -1.2 * grown


def test_three_points_lie_on_the_nominal_where_the_datum_has_brought_them() -> None:
    s = stations()
    points = OFF.apply(places(s, 0.03 + 0.0004 * s))
    datum = found(points, DatumFeatures((point(10.0), point(70.0), point(TIP, 0.5))))
    d = deviations(datum.pose.apply(points), stadium())
    order = np.argsort(d.station_mm)
    for target in (10.0, 70.0):
        assert np.interp(target, d.station_mm[order], d.deviation_mm[order]) == pytest.approx(0.0, abs=1e-6)
    assert np.interp(TIP, d.station_mm[order], d.deviation_mm[order]) == pytest.approx(0.0, abs=3e-5)  # by a straight line, on a round end


@pytest.mark.parametrize("features", [LINE_AND_POINT, EDGE_AND_POINT, THREE_POINTS], ids=lambda of: of.words)
def test_the_gain_is_how_far_an_error_of_a_point_moves_the_part(features: DatumFeatures) -> None:
    s, step = stations(200), 1e-5
    datum = found(places(s, np.zeros(len(s))), features, "points")
    for k in np.linspace(0, len(datum.station_mm) - 1, 6).astype(int):
        error = np.where(np.isclose(s, datum.station_mm[k], atol=1e-6), step, 0.0)
        moved = found(places(s, error), features, "points").pose
        shift = moved.apply(datum.pivot_mm[None])[0] - datum.pivot_mm
        np.testing.assert_allclose([*shift, moved.rotation_rad], datum.gain[:, k] * step, atol=3e-3 * step)


def test_a_stretch_of_the_datum_without_points_is_named_and_there_is_no_datum() -> None:
    s = stations()
    points = places(s, np.zeros(len(s)))
    with pytest.raises(InspectionError, match=r"of its line station 10 .. 70 mm from station 39.+ to 45.+ mm nothing was measured"):
        found(points[(s < 40) | (s > 45)], LINE_AND_POINT)
    with pytest.raises(InspectionError, match=r"of its point at station .* nothing was measured"):
        found(points[np.abs(s - TIP) > 1.5], LINE_AND_POINT)
    with pytest.raises(InspectionError, match="nothing was measured at its point"):
        found(points[np.abs(s - TIP) > 2.5], LINE_AND_POINT)


def test_features_that_leave_the_part_free_are_refused() -> None:
    points = places(stations(), np.zeros(800))
    with pytest.raises(InspectionError, match="does not fix the part"):
        found(points, DatumFeatures((line(), point(BOTTOM + END + 40))))  # the point on the opposite side stops no shift along the line
    with pytest.raises(InspectionError, match="turns too far for a line"):
        found(points, DatumFeatures((line(BOTTOM, BOTTOM + END), point(20.0))))
    with pytest.raises(ValueError, match="fixes three motions"):
        DatumFeatures((line(),))


def test_where_a_scan_is_denser_moves_no_datum() -> None:
    s = stations()
    dense = np.sort(np.concatenate([s, np.linspace(15.0, 30.0, 5000)]))
    one, other = (found(OFF.apply(places(x, 0.02 * np.sin(x / 7.0))), LINE_AND_POINT).pose for x in (s, dense))
    assert one.rotation_rad == pytest.approx(other.rotation_rad, abs=2e-6)
    np.testing.assert_allclose(one.translation_mm, other.translation_mm, atol=1e-4)


def test_order_moves_no_datum_beyond_rounding() -> None:
    points = OFF.apply(places(stations(), 0.02 * np.sin(stations() / 7.0)))
    one, other = found(points, LINE_AND_POINT), found(points[::-1], LINE_AND_POINT)
    np.testing.assert_allclose(one.pose.translation_mm, other.pose.translation_mm, atol=2e-9)
