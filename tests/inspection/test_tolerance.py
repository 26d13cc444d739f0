"""ISO 14253-1: conformity is proven inside the zone less U, nonconformity outside the zone plus U, the rest is not proven."""

from functools import cache
from typing import get_args

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from inspection import NOT_JUDGED, DecisionRule, NominalProfile, RigidTransform, SectionPlane, ToleranceZone, Verdict, discretize
from inspection.scan_rows import ScanRows
from inspection.terms import Terms
from tests.inspection import profiles
from tests.inspection.profiles import Array

CONFORM, UNCERTAIN, NONCONFORM = Verdict.CONFORM, Verdict.UNCERTAIN, Verdict.NONCONFORM


def test_verdicts_at_just_inside_and_just_outside_every_border_of_an_asymmetric_zone() -> None:
    # powers of two, so that lower + U and the like are exact and a border means the border
    zone = ToleranceZone(-0.5, 0.25, 0.0625)
    cases = {
        -0.4375: (UNCERTAIN, CONFORM, CONFORM),
        -0.5625: (NONCONFORM, UNCERTAIN, UNCERTAIN),
        0.1875: (CONFORM, CONFORM, UNCERTAIN),
        0.3125: (UNCERTAIN, UNCERTAIN, NONCONFORM),
    }
    for border, expected in cases.items():
        below, above = np.nextafter(border, -1.0), np.nextafter(border, 1.0)
        assert tuple(zone.verdicts([below, border, above])) == expected, border
    assert zone.verdicts([-0.5, 0.25, 0.0]).tolist() == [UNCERTAIN, UNCERTAIN, CONFORM]


def test_without_uncertainty_a_limit_belongs_to_the_zone_and_nothing_is_uncertain() -> None:
    zone = ToleranceZone(-0.02, 0.05)
    eps = 1e-12
    found = zone.verdicts([-0.02 - eps, -0.02, -0.02 + eps, 0.05 - eps, 0.05, 0.05 + eps])
    assert found.tolist() == [NONCONFORM, CONFORM, CONFORM, CONFORM, CONFORM, NONCONFORM]


def test_a_zone_of_which_nothing_could_ever_be_proven_to_conform_is_refused() -> None:
    assert ToleranceZone(-0.5, 0.25, 0.37).verdict([-0.125]) is CONFORM
    for uncertainty in (0.375, 0.5, 10.0):
        with pytest.raises(ValueError, match="uncertainty"):
            ToleranceZone(-0.5, 0.25, uncertainty)


def test_a_decision_rule_counts_the_uncertainty_as_its_standard_says() -> None:
    at = [-0.56, -0.51, -0.45, 0.0, 0.2, 0.26, 0.32]
    by_iso = (NONCONFORM, UNCERTAIN, UNCERTAIN, CONFORM, UNCERTAIN, UNCERTAIN, NONCONFORM)
    by_simple = (NONCONFORM, NONCONFORM, CONFORM, CONFORM, CONFORM, NONCONFORM, NONCONFORM)
    zones = {rule: ToleranceZone(-0.5, 0.25, 0.0595, rule) for rule in get_args(DecisionRule)}
    assert {rule: tuple(zone.verdicts(at)) for rule, zone in zones.items()} == {
        "iso-14253-1": by_iso,
        "ilac-g8": by_iso,
        "simple": by_simple,
    }
    for rule, words in (
        ("iso-14253-1", "ISO 14253-1: "),
        ("ilac-g8", "ILAC-G8:09/2019, guard band w = U"),
        ("simple", "simple acceptance"),
    ):
        assert zones[rule].decision_rule.startswith(words)
        assert "U = 0.0595 mm" in zones[rule].decision_rule
    assert "6.3 : 1" in zones["simple"].decision_rule
    with pytest.raises(ValueError, match="iso-14253-1, ilac-g8, simple"):
        ToleranceZone(-0.5, 0.25, 0.0, "some other")  # type: ignore[arg-type]


def test_a_u_that_is_known_only_after_the_scan_may_leave_nothing_to_prove() -> None:
    zone = ToleranceZone(-0.5, 0.25, 0.4, provable=False)
    assert zone.verdicts([-0.95, -0.125, 0.66]).tolist() == [NONCONFORM, UNCERTAIN, NONCONFORM]


def test_a_zone_on_one_side_of_the_nominal() -> None:
    zone = ToleranceZone(0.1, 0.3)
    assert zone.middle_mm == pytest.approx(0.2)
    assert zone.verdicts([0.0, 0.1, 0.2, 0.31]).tolist() == [NONCONFORM, CONFORM, CONFORM, NONCONFORM]


@given(
    lower=st.integers(-1000, 1000),
    width=st.integers(1, 1000),
    share=st.integers(0, 499),
    deviation=st.lists(st.integers(-3000, 3000), min_size=1, max_size=30),
)
def test_verdicts_follow_the_inequalities_point_by_point(lower: int, width: int, share: int, deviation: list[int]) -> None:
    # whole multiples of 2^-12 mm, whose sums are exact, so that the test needs no margin at a border
    upper, uncertainty = lower + width, share * width // 1000
    zone = ToleranceZone(lower / 4096, upper / 4096, uncertainty / 4096)
    expected = []
    for d in deviation:
        if lower + uncertainty <= d <= upper - uncertainty:
            expected.append(CONFORM)
        elif lower - uncertainty <= d <= upper + uncertainty:
            expected.append(UNCERTAIN)
        else:
            expected.append(NONCONFORM)
    assert zone.verdicts(np.array(deviation) / 4096).tolist() == expected
    assert zone.verdict(np.array(deviation) / 4096) is max(expected)


def test_profile_verdict_is_that_of_its_worst_point() -> None:
    zone = ToleranceZone(-0.1, 0.1, 0.01)
    assert zone.verdict([0.0, 0.05]) is CONFORM
    assert zone.verdict([0.0, 0.095]) is UNCERTAIN
    assert zone.verdict([0.0, 0.095, -0.2]) is NONCONFORM
    assert zone.verdict([]) is UNCERTAIN
    assert [v.word for v in (CONFORM, UNCERTAIN, NONCONFORM)] == ["conform", "uncertain", "nonconform"]


def test_a_deviation_that_is_not_a_number_is_uncertain() -> None:
    for zone in (ToleranceZone(-0.1, 0.1), ToleranceZone(-0.1, 0.1, 0.02)):
        assert zone.verdicts([0.0, float("nan"), 0.2]).tolist() == [CONFORM, UNCERTAIN, NONCONFORM]
        assert zone.verdict([0.0, float("nan")]) is UNCERTAIN
        assert zone.verdict([float("nan"), 0.2]) is NONCONFORM


LIMITS, UNCERTAINTY = "the lower limit must be below the upper one, got ", "the uncertainty must be zero or more, got "


@pytest.mark.parametrize(
    ("lower", "upper", "uncertainty", "message"),
    [
        (0.1, -0.1, 0.0, LIMITS + "0.1 .. -0.1 mm"),
        (0.1, 0.1, 0.0, LIMITS + "0.1 .. 0.1 mm"),
        (float("nan"), 0.1, 0.0, LIMITS + "nan .. 0.1 mm"),
        (-0.1, float("nan"), 0.0, LIMITS + "-0.1 .. nan mm"),
        (-0.1, float("inf"), 0.0, LIMITS + "-0.1 .. inf mm"),
        (-0.1, 0.1, -0.01, UNCERTAINTY + "-0.01 mm"),
        (-0.1, 0.1, float("nan"), UNCERTAINTY + "nan mm"),
        (-0.1, 0.1, float("inf"), UNCERTAINTY + "inf mm"),
    ],
)
def test_a_zone_that_cannot_be_is_refused(lower: float, upper: float, uncertainty: float, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        ToleranceZone(lower, upper, uncertainty)


# ---- the compiled rule


@cache
def line() -> NominalProfile:
    """The x axis from 0 to 100 mm, with the material below it: the deviation of a point is its y, to the last bit."""
    return discretize(profiles.clamped(1, [(0.0, 0.0), (100.0, 0.0)]), samples=8, material="right")


def judged_rows(deviation: Array, zone: ToleranceZone) -> tuple[Array, list[int]]:
    """Deviations and verdicts that a scan's rows get from points so far off the line."""
    rows, count = ScanRows(), len(deviation)
    plane = SectionPlane(np.zeros(3), np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0]))
    rows.take_in(np.column_stack([np.linspace(1.0, 99.0, count), deviation]), plane, np.inf)
    rows.count = count
    rows.judge(0, count, RigidTransform.identity(), Terms(line(), zone, None, "none", "exact", 0.0, np.inf, 0.0, False))
    return rows.deviation[:count], rows.verdicts[:count].tolist()


def borders(zone: ToleranceZone) -> Array:
    """Every border of a zone, and the numbers next to it."""
    border = np.array([limit + side * zone.uncertainty_mm for limit in (zone.lower_mm, zone.upper_mm) for side in (-1.0, 0.0, 1.0)])
    return np.concatenate([border, np.nextafter(border, -np.inf), np.nextafter(border, np.inf)])


@settings(deadline=None)
@given(
    lower=st.floats(-1, 1),
    width=st.floats(1e-6, 1),
    share=st.floats(0, 0.499),
    deviation=st.lists(st.floats(-3, 3), max_size=30),
)
def test_the_compiled_rule_is_that_of_the_zone(lower: float, width: float, share: float, deviation: list[float]) -> None:
    zone = ToleranceZone(lower, lower + width, share * width)
    wanted = np.concatenate([borders(zone), deviation, [np.nan]])
    found, verdicts = judged_rows(wanted, zone)
    assert np.array_equal(found, wanted, equal_nan=True)
    assert verdicts[:-1] == zone.verdicts(wanted[:-1]).tolist()
    assert verdicts[-1] == NOT_JUDGED
