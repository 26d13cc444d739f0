"""Regions of a profile: by station, by place and by the features of an airfoil; how much of one was measured."""

import numpy as np
import pytest

from inspection import NominalError, NurbsCurve, Region, discretize, features_of, region_between, station_near
from inspection.evaluation.region import is_inside, region_around
from inspection.gaps import measure, measure_region
from tests.inspection import profiles
from tests.inspection.evaluation.asked import nominal
from tests.inspection.profiles import Array

CIRCLE = discretize(profiles.circle(10.0), samples=500)
ROUND = CIRCLE.length_mm


def test_a_place_is_taken_to_the_nearest_nominal_point() -> None:
    assert station_near(CIRCLE, (0.0, 15.0)) == pytest.approx(ROUND / 4, abs=1e-9)


def test_the_features_of_an_airfoil_bound_its_sides() -> None:
    features = features_of(nominal())
    upper, lower = features.side("UPPER"), features.side("LOWER")
    assert upper.to_mm == lower.from_mm == features.nose
    half_way = np.interp((upper.from_mm + upper.to_mm) / 2, nominal().station_mm, nominal().parameter)
    assert nominal().curve.point(np.array([half_way]))[0, 1] > 5  # above: the upper side of a cambered section
    edge = features.edge("LE", 7.0)
    assert edge.to_mm - edge.from_mm == pytest.approx(14.0)
    assert features.edge("TE", 5.0).from_mm > features.edge("TE", 5.0).to_mm  # over the seam


def test_a_circle_has_no_edges_but_an_open_profile_two_ends() -> None:
    open_profile = discretize(profiles.p1(), samples=500, material="left")
    with pytest.raises(NominalError):
        features_of(open_profile)
    with pytest.raises(ValueError, match="runs with rising stations"):
        region_between(open_profile, 20.0, 10.0)
    with pytest.raises(ValueError, match="a station from 0 to"):
        region_between(open_profile, 20.0, 1e4)
    assert region_between(CIRCLE, ROUND - 5, ROUND + 5.0).to_mm == pytest.approx(5.0)
    with pytest.raises(ValueError, match="begins where it ends"):
        region_between(CIRCLE, 5.0, 5.0)


@pytest.mark.parametrize("size", [1e-3, 3e-3, 0.01, 0.1, 0.3, 1.0, 3.0, 7.0, 30.0, 1e3])
def test_a_round_trailing_edge_is_one_place_however_round_off_falls(size: float) -> None:
    """Its two ends have stations a hair apart, and the way from one to the other is not all around the section."""
    turn = np.linspace(0.0, 2 * np.pi, 61)[:-1]
    places = np.column_stack([50 * np.cos(turn), (6 - 2 * np.cos(turn)) * np.sin(turn)]) * size
    profile = discretize(NurbsCurve.interpolate(places, closed=True), samples=200)
    features, within = features_of(profile), 4 * size
    edge = features.edge("TE", within)
    assert features.first == features.last
    assert (edge.to_mm - edge.from_mm) % profile.length_mm == pytest.approx(2 * within)
    (around,) = region_around(features, "trailing", np.array([features.first + within, features.last - within]), size)
    assert (around.to_mm - around.from_mm) % profile.length_mm == pytest.approx(2 * within)


def test_what_lies_around_an_edge_is_less_than_the_whole_section() -> None:
    """Places on both sides may be as far from the edge as the other edge is."""
    features = features_of(nominal())
    half = features.length_mm / 2
    for edge in ("leading", "trailing"):
        tip = features.nose if edge == "leading" else features.first
        (around,) = region_around(features, edge, np.mod(tip + np.array([-half, half]), features.length_mm), half)
        assert 0.9 * features.length_mm < (around.to_mm - around.from_mm) % features.length_mm < features.length_mm


def test_stations_lie_in_a_region_that_crosses_the_seam() -> None:
    inside = is_inside(np.array([0.0, 4.9, 5.1, ROUND - 5.1, ROUND - 4.9, np.nan]), Region(ROUND - 5, 5.0), CIRCLE)
    assert inside.tolist() == [True, True, False, False, True, False]


@pytest.mark.parametrize("border", [0.0, 17.3, ROUND / 3, ROUND])
@pytest.mark.parametrize("off", [0.0, -4e-12, 4e-12])
def test_what_lies_on_the_border_of_two_regions_is_in_both_wherever_the_seam_is(border: float, off: float) -> None:
    """Round-off tells the station of a corner a little otherwise than that of the border, and 0 is the length on a closed profile."""
    at = np.array([border + off, border + off - ROUND, border + off + ROUND])
    for before, behind in ((border, border), (border % ROUND, border % ROUND)):
        assert is_inside(at, Region((border - 9) % ROUND, before), CIRCLE).all()
        assert is_inside(at, Region(behind, (border + 11) % ROUND), CIRCLE).all()
    beside = np.array([border - 1e-6, border + 1e-6])
    assert is_inside(beside, Region((border - 9) % ROUND, border), CIRCLE).tolist() == [True, False]
    assert is_inside(beside, Region(border, (border + 11) % ROUND), CIRCLE).tolist() == [False, True]


def scan_without(low: float, high: float) -> Array:
    s = np.arange(0.25, ROUND, 0.5)
    return s[(s < low) | (s > high)]


@pytest.mark.parametrize(
    ("region", "coverage", "gap"),
    [
        (Region(0.0, 20.0), 1 - 10.5 / 20, 10.5),  # all of the hole, from 4.75 to 15.25
        (Region(10.0, 30.0), 1 - 5.25 / 20, 5.25),  # its second half
        (Region(20.0, 40.0), 1.0, 0.5),
        (Region(6.0, 12.0), 0.0, 6.0),  # nothing but hole
        (Region(50.0, 7.0), 1 - 2.25 / (ROUND - 43), 2.25),  # over the seam, into its beginning
    ],
)
def test_the_gaps_of_a_region_are_those_of_the_profile_within_it(region: Region, coverage: float, gap: float) -> None:
    station = scan_without(5.0, 15.0)
    found = measure_region(station, CIRCLE, 0.6, region.from_mm, region.to_mm)
    assert found.coverage == pytest.approx(coverage)
    assert found.gap.length_mm == pytest.approx(gap)


def test_the_whole_profile_is_the_region_from_a_place_to_itself() -> None:
    station = scan_without(5.0, 15.0)
    whole, region = measure(station, CIRCLE, 0.6), measure_region(station, CIRCLE, 0.6, 7.0, 7.0)
    assert region.coverage == pytest.approx(whole.coverage)


def test_a_further_point_never_lowers_the_coverage_of_a_region() -> None:
    station = scan_without(5.0, 15.0)
    before = measure_region(station, CIRCLE, 0.6, 2.0, 22.0)
    for place in np.linspace(0, ROUND, 60, endpoint=False):
        after = measure_region(np.append(station, place), CIRCLE, 0.6, 2.0, 22.0)
        assert after.coverage >= before.coverage - 1e-12
        assert after.gap.length_mm <= before.gap.length_mm + 1e-12


def test_the_stretch_around_an_edge_holds_the_places_on_both_sides_of_it() -> None:
    features = features_of(nominal())
    (around,) = region_around(features, "leading", np.array([features.nose - 9.0, features.nose + 6.0]), 1.0)
    assert [around.from_mm, around.to_mm] == pytest.approx([features.nose - 9.0, features.nose + 6.0])
    length = features.length_mm
    (tail,) = region_around(features, "trailing", np.array([length - 4.0, 3.0]), 1.0)
    assert [tail.from_mm, tail.to_mm] == pytest.approx([length - 4.0, 3.0], abs=1e-6)
