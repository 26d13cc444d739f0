"""Characteristics while the scan runs: red only where the end is red as well, never green, and of a whole scan what the end finds."""

from collections.abc import Mapping, Sequence
from typing import get_args

import numpy as np
import pytest
from numpy.typing import NDArray

from inspection import (
    Characteristic,
    CharacteristicFit,
    CharacteristicResult,
    Freedoms,
    LineProfile,
    LiveInspection,
    Outline,
    ProfileFilter,
    Region,
    RigidTransform,
    SectionCharacteristic,
    StatedUncertainty,
    ToleranceZone,
    UncertaintyBudget,
    VaryingZone,
    Verdict,
    WholeProfile,
    find_airfoil,
    synthetic,
    with_nominal,
)
from tests.inspection.reference_parts import nominal_of

NOMINAL = nominal_of("goe404")
LENGTH = NOMINAL.length_mm
ZONE = ToleranceZone(-0.05, 0.05)
POSE = RigidTransform(-0.4, np.array([210.0, 145.0]))
AT_DEFECT, ELSEWHERE = Region(20.0, 60.0), Region(120.0, 180.0)


def zone(half_mm: float = 0.05) -> VaryingZone:
    return VaryingZone.constant(-half_mm, half_mm, LENGTH, NOMINAL.curve.closed)


def asked(datum: RigidTransform | None) -> list[Characteristic]:
    """One of every kind whose verdict does not rest on a fit, with a defect in its region or without."""
    at, elsewhere = (
        LineProfile(name, zone(), region=region, fit="none", datum=datum) for name, region in (("at", AT_DEFECT), ("elsewhere", ELSEWHERE))
    )
    filtered = LineProfile("filtered", zone(), region=AT_DEFECT, fit="none", datum=datum, filter=ProfileFilter(0.8, 2))
    chord = with_nominal(SectionCharacteristic("chord", "chord", "tangent", -0.1, 0.1), lambda: Outline(find_airfoil(NOMINAL)))
    return [WholeProfile("profile"), at, elsewhere, filtered, chord]


FITTED = [LineProfile(fit, zone(), region=AT_DEFECT, fit=fit) for fit in get_args(CharacteristicFit)[2:]]


def points(defect_mm: float) -> NDArray[np.float64]:
    """Points (m, 2) from the first station to the last, with a dent or a hump at station 40 mm."""
    station = np.linspace(0, LENGTH, 800, endpoint=False)
    rng = np.random.default_rng(7)
    deviation = synthetic.form_error_mm(station, LENGTH, rng, 0.01) + defect_mm * np.exp(-(((station - 40) / 1.5) ** 2))
    return synthetic.scan(NOMINAL, station, deviation, POSE).points_mm


def by_name(found: Sequence[CharacteristicResult]) -> Mapping[str, CharacteristicResult]:
    return {one.name: one for one in found}


def so_far(live: LiveInspection) -> Mapping[str, CharacteristicResult]:
    """What is found now; nothing while the pose is sought."""
    scan = live.so_far()
    if scan is None:
        return {}
    found = live.evaluation_so_far().evaluate(scan)
    assert found is not None
    return by_name(found)


def test_red_so_far_is_red_at_the_end_and_nothing_is_green_before() -> None:
    live, scanned = LiveInspection(NOMINAL, ZONE, datum=POSE, characteristics=asked(POSE)), points(0.2)
    for stop in (250, 550, 800):
        live.add(scanned[live.received : stop])
        found = so_far(live)
        assert {name for name, one in found.items() if one.verdict is not Verdict.UNCERTAIN} == {"profile", "at"}
        assert found["at"].verdict is found["profile"].verdict is Verdict.NONCONFORM
    for name, at_end in by_name(live.finish().characteristics).items():
        assert at_end.verdict is Verdict.NONCONFORM or found[name].verdict is Verdict.UNCERTAIN
        assert found[name].value == pytest.approx(at_end.value, abs=1e-9), "of a whole scan it is what the end finds"


def test_nothing_that_a_fit_or_a_filter_can_still_change_is_proven_before_the_end() -> None:
    live = LiveInspection(NOMINAL, ZONE, characteristics=[*asked(None), *FITTED])
    live.add(points(0.2))
    found = so_far(live)
    assert {one.verdict for one in found.values()} == {Verdict.UNCERTAIN}
    assert {name for name, one in found.items() if abs(one.deviation) > 0.05} >= {"profile", "at", "best-fit", "minimum-zone", "tolerance"}
    assert found["minimum-zone"].value < found["best-fit"].value, "each is judged at a fit of its own"


def test_a_value_that_stands_on_what_was_not_measured_yet_is_none() -> None:
    live = LiveInspection(NOMINAL, ZONE, datum=POSE, characteristics=asked(POSE))
    live.add(points(0.0)[:250])
    found = so_far(live)
    assert np.isnan(found["chord"].value)
    assert np.isnan(found["elsewhere"].value)
    assert found["elsewhere"].lower == -0.05, "its limits are known beforehand"
    assert found["at"].value > 0


def test_evaluation_ends_after_the_characteristic_that_it_is_at() -> None:
    evaluation, answers = LiveInspection(NOMINAL, ZONE, characteristics=asked(None)).evaluation_so_far(), iter([False, True])
    assert evaluation.evaluate(evaluation.nothing, lambda: next(answers)) is None
    assert next(answers, None) is None, "it was asked after the second, and not again"


def test_few_points_tell_of_a_long_scan() -> None:
    """Of 20,000 points at most 4,096 are looked at, among them the one that is out."""
    live, station = LiveInspection(NOMINAL, ZONE, datum=POSE), np.linspace(0, LENGTH, 20_000, endpoint=False)
    deviation = np.where(np.arange(20_000) == 13_001, -0.3, 0.0)
    scanned = synthetic.scan(NOMINAL, station, deviation, POSE).points_mm
    for first in range(0, 20_000, 5000):
        live.add(scanned[first : first + 5000])
        scan = live.so_far()
        assert scan is not None
        assert len(scan.points_mm) <= 4096
    assert so_far(live)["profile"].deviation == pytest.approx(-0.3, abs=1e-6)


@pytest.mark.parametrize("stated", [None, UncertaintyBudget(0.002, 0.002, 1e-5, 0.001)])
@pytest.mark.parametrize("out_mm", [0.004, 0.03])
def test_u_and_locked_fits_are_no_less_doubtful_on_the_way_than_at_the_end(stated: UncertaintyBudget | None, out_mm: float) -> None:
    """A point out by less than U is no proof, and neither is one that is out at a fit with a locked motion: more points still move it."""
    locked = Freedoms.about((40.0, 0.0), ("y", "rotation"))
    lines: list[Characteristic] = [
        LineProfile("none", zone(), fit="none", datum=POSE),
        LineProfile("datum", zone(), region=AT_DEFECT, fit="datum", datum=POSE),
        LineProfile("locked", zone(), fit="best-fit", freedoms=locked, datum=POSE),
    ]
    own_mm = 0.0 if stated else 0.01
    live = LiveInspection(
        NOMINAL,
        ToleranceZone(-0.05, 0.05, own_mm),
        datum=POSE,
        fit="none",
        uncertainty=StatedUncertainty(stated) if stated else None,
        characteristics=lines,
    )
    scan, red = points(0.05 + out_mm), set[str]()
    for part in np.array_split(scan, 8):
        live.add(part)
        red |= {name for name, one in so_far(live).items() if one.verdict is Verdict.NONCONFORM}
    end = by_name(live.finish().characteristics)
    assert red <= {name for name, one in end.items() if one.verdict is Verdict.NONCONFORM}
    assert red == ({"none", "datum"} if out_mm > 0.02 else set())
    assert all(one.uncertainty > 0.004 for one in so_far(live).values())
