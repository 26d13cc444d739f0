"""Zones that vary along the profile: transitions by closed forms, borders, seams, and what contradicts itself."""

from typing import NamedTuple

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from inspection import Transition, VaryingZone

STATIONS, LOWER, UPPER = np.array([20.0, 60.0]), np.array([-0.02, -0.06]), np.array([0.04, 0.10])


def zone(between: Transition = "linear", closed: bool = True, border_mm: float = 0.0) -> VaryingZone:
    """A profile of 100 mm whose zone is -0.02 .. 0.04 at station 20 and -0.06 .. 0.10 at 60."""
    return VaryingZone(STATIONS, LOWER, UPPER, 100.0, closed, between, border_mm)


def test_limits_run_on_over_the_seam_of_a_closed_profile_and_stay_at_the_ends_of_an_open_one() -> None:
    at = [20, 30, 60, 90, 0, 100, 10]
    closed = zone().limits(at)
    np.testing.assert_allclose(closed.lower_mm, [-0.02, -0.03, -0.06, -0.04, -0.1 / 3, -0.1 / 3, -0.08 / 3], atol=1e-15)
    np.testing.assert_allclose(closed.upper_mm, [0.04, 0.055, 0.10, 0.07, 0.06, 0.06, 0.05], atol=1e-15)
    np.testing.assert_allclose(closed.upper_slope[[1, 3, 4]], [0.0015, -0.001, -0.001], atol=1e-15)
    opened = zone(closed=False).limits(at)
    np.testing.assert_allclose(opened.lower_mm, [-0.02, -0.03, -0.06, -0.06, -0.02, -0.06, -0.02], atol=1e-15)
    assert opened.lower_slope[[3, 4, 6]].tolist() == [0, 0, 0]


def test_a_smooth_transition_leaves_and_arrives_without_a_slope() -> None:
    s = np.linspace(20, 60, 4001)
    limits = zone("smooth").limits(s)
    np.testing.assert_allclose(limits.upper_mm[[0, 1000, 2000, 4000]], [0.04, 0.04 + 0.06 * 0.15625, 0.07, 0.10], atol=1e-15)
    np.testing.assert_allclose(np.gradient(limits.lower_mm, s)[1:-1], limits.lower_slope[1:-1], atol=1e-9)
    assert (limits.upper_slope[0], limits.upper_slope[-1]) == (0.0, 0.0)


def test_where_two_zones_meet_the_stricter_limit_holds() -> None:
    """The lower limit is the stricter before the border, the upper one behind it: both hold on it."""
    meeting = VaryingZone(np.array([0.0, 40.0, 40.0, 100.0]), np.array([-1, -1, -3, -3]), np.array([5, 5, 2, 2]), 100.0, False)
    limits = meeting.limits([39.9, 40, 40.1])
    assert limits.lower_mm.tolist() == [-1, -1, -3]
    assert limits.upper_mm.tolist() == [5, 2, 2]
    assert zone("constant").limits([20, 40, 60, 80, 10]).upper_mm.tolist() == [0.04, 0.04, 0.04, 0.10, 0.10]
    wide = zone("constant", border_mm=0.5).limits([19.4, 19.6, 20.4, 59.4, 60.4, 60.6]).upper_mm
    assert wide.tolist() == [0.10, 0.04, 0.04, 0.04, 0.04, 0.10]
    assert [zone(how).has_steps for how in ("constant", "linear", "smooth")] == [True, False, False]
    assert meeting.has_steps
    assert not VaryingZone.constant(-1.0, 1.0, 100.0, True).has_steps
    seam = VaryingZone(np.array([0.0, 100.0]), np.array([-1.0, -2.0]), np.array([1.0, 2.0]), 100.0, True)
    assert seam.limits([0, 100, 50]).upper_mm.tolist() == [1, 1, 1.5]


class Steps(NamedTuple):
    """Where the limits of a zone hold: stretches (n, 2), each with a lower and an upper limit of its own."""

    ends: list[float]
    lower: list[float]
    upper: list[float]
    closed: bool
    border_mm: float

    @property
    def zone(self) -> VaryingZone:
        s, low, high = np.array(self.ends), np.array(self.lower), np.array(self.upper)
        return VaryingZone(s, low, high, 100.0, self.closed, "constant", self.border_mm)

    def hold_at(self, s: float) -> tuple[float, float]:
        """The limits that hold at a station, by asking each stretch whether it is there or within the border of its ends."""
        low, high, near = -np.inf, np.inf, self.border_mm + 1e-10
        for k, begin in enumerate(self.ends):
            end = self.ends[k + 1] if k + 1 < len(self.ends) else 100.0 + self.ends[0] * self.closed
            first = begin if self.closed or k else 0.0
            if any(first - near <= turn <= end + near for turn in ((s - 100, s, s + 100) if self.closed else (s,))):
                low, high = max(low, self.lower[k]), min(high, self.upper[k])
        return low, high


@st.composite
def steps(draw: st.DrawFn) -> Steps:
    ends = sorted(draw(st.sets(st.integers(0, 99), min_size=2, max_size=6)))
    each = st.lists(st.integers(1, 90), min_size=len(ends), max_size=len(ends))
    lower, upper = ([sign * value / 1000 for value in draw(each)] for sign in (-1, 1))
    border_mm = draw(st.sampled_from([0.0, 0.3, 0.9]))
    return Steps([float(end) for end in ends], lower, upper, draw(st.booleans()), border_mm)


@settings(max_examples=60, deadline=None, derandomize=True)
@given(steps(), st.data())
def test_at_a_step_and_within_its_border_both_sides_hold_and_nowhere_else(drawn: Steps, data: st.DataObject) -> None:
    """Points on a step, a hair beside it by round-off, just beside it, at the seam, and anywhere; however many there are, in any order."""
    within, beyond = max(drawn.border_mm - 1e-6, 0.0), drawn.border_mm + 1e-6
    beside = [0.0, -4e-12, 4e-12, -within, within, -beyond, beyond]
    places = [end + off for end in drawn.ends for off in beside] + data.draw(st.lists(st.floats(0.0, 100.0), max_size=5)) + [0.0, 100.0]
    places = [place % 100.0 if drawn.closed and place != 100.0 else min(max(place, 0.0), 100.0) for place in places]
    order = data.draw(st.permutations(range(len(places))))
    found = drawn.zone.limits(np.array(places)[order])
    for k, at in enumerate(order):
        assert (found.lower_mm[k], found.upper_mm[k]) == drawn.hold_at(places[at])


def test_consumption_is_one_at_either_limit_and_zero_in_the_middle() -> None:
    np.testing.assert_allclose(zone().consumption([0.04, -0.02, 0.01, 0.07, np.nan], [20, 20, 20, 20, 20]), [1, -1, 0, 2, np.nan])
    assert np.isnan(zone().consumption([0.0], [np.nan])).all()
    np.testing.assert_allclose(VaryingZone.constant(-0.1, 0.3, 50.0, False).consumption([0.2, 0.3], [0, 50]), [0.5, 1.0], rtol=1e-15)


def test_zones_that_contradict_themselves_are_refused() -> None:
    with pytest.raises(ValueError, match="station 40 mm have no deviation in common"):
        VaryingZone(np.array([0.0, 40.0, 40.0]), np.array([-1, -1, 2]), np.array([1, 1, 3]), 100.0, False)
    with pytest.raises(ValueError, match="every lower limit must be below"):
        VaryingZone(STATIONS, UPPER, LOWER, 100.0, True)
    with pytest.raises(ValueError, match=r"must rise from 0 to 50 mm at most, got 20 \.\. 60"):
        VaryingZone(STATIONS, LOWER, UPPER, 50.0, True)
    with pytest.raises(ValueError, match="40 mm stands more often"):
        VaryingZone(np.array([0.0, 40.0, 40.0, 40.0]), -np.ones(4), np.ones(4), 100.0, True)
    with pytest.raises(ValueError, match="one shape"):
        VaryingZone(STATIONS, LOWER[:1], UPPER, 100.0, True)


@pytest.mark.parametrize("between", ["linear", "smooth", "constant"])
@pytest.mark.parametrize("closed", [True, False])
@pytest.mark.parametrize("border_mm", [0.0, 1.5, 12.0])
def test_extremes_are_those_of_every_station_on_the_way(between: Transition, closed: bool, border_mm: float) -> None:
    """Against limits at stations 5 um apart; on a step they have either side within that, and never more than the extremes."""
    s = np.array([3.0, 20.0, 20.0, 42.0, 55.0, 55.0, 61.0, 90.0])
    lower, upper = np.array([-4, -2, -7, -3, -3, -5, -6, -2.0]), np.array([5, 3, 4, 9, 9, 2, 6, 7.0])
    wanted = VaryingZone(s, lower, upper, 100.0, closed, between, border_mm)
    rng = np.random.default_rng(3)
    low = rng.uniform(-60 if closed else 0, 100, 60)
    high = np.minimum(low + 10.0 ** rng.uniform(-2, 2.2, 60), np.inf if closed else 100.0)
    found = wanted.extremes(low, high)
    for k in range(len(low)):
        limits = wanted.limits(np.arange(low[k], min(high[k], low[k] + 100) + 1e-9, 0.005))
        every = (limits.lower_mm.min(), limits.lower_mm.max(), limits.upper_mm.min(), limits.upper_mm.max())
        for i, (one, way) in enumerate(zip(every, (-1, 1, -1, 1), strict=True)):
            beyond = way * (found[i][k] - one)
            at_step = np.abs(((np.array([20, 55.0])[:, None] - np.array([low[k], high[k]]) + 50) % 100) - 50).min() <= 0.005
            assert -1e-9 <= beyond <= (8.0 if at_step else 0.03)


def test_a_single_zone_is_its_own_extreme() -> None:
    found = VaryingZone.constant(-0.1, 0.2, 50.0, True).extremes(np.array([3.0, -80.0]), np.array([3.0, 90.0]))
    assert [side.tolist() for side in found] == [[-0.1, -0.1], [-0.1, -0.1], [0.2, 0.2], [0.2, 0.2]]
