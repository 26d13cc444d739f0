"""U of the line profiles of a run with a budget: at known poses, at any placement, at fits that decide; and as laws over all of them."""

from typing import Any

import numpy as np
import pytest

from inspection import (
    CharacteristicResult,
    DecisionRule,
    Freedoms,
    LineProfile,
    LiveInspection,
    ProfileFilter,
    Region,
    RigidTransform,
    StatedUncertainty,
    ToleranceZone,
    UncertaintyBudget,
    VaryingZone,
    Verdict,
    deviation_uncertainty,
    uncertainty_along,
)
from tests.inspection.reference_parts import nominal_of, reference_form, scan

HERE = RigidTransform.identity()
BUDGET = UncertaintyBudget(0.0009, 0.0018, 1 / 300e3, 0.0003, 0.5, 11.5e-6, 3.0, 1e-6)
SIDE = Region(10.0, 90.0)
LOCKED = Freedoms.about((40.0, 3.0), ("y", "rotation"))


def profile(half_mm: float = 0.1, **settings: Any) -> LineProfile:
    whole = nominal_of("goe404").length_mm, True
    return LineProfile(str(sorted(settings)), VaryingZone.constant(-half_mm, half_mm, *whole), **settings)


KINDS: dict[str, dict[str, Any]] = {
    "of the run": {"fit": "none"},
    "datum": {"fit": "datum", "datum": HERE},
    "any placement": {"fit": "best-fit"},
    "minimum zone": {"fit": "minimum-zone", "region": SIDE},
    "least consumption": {"fit": "tolerance"},
    "its best fit": {"fit": "best-fit", "rule": "best-fit", "region": SIDE},
    "locked": {"fit": "best-fit", "freedoms": LOCKED, "datum": HERE},
    "filtered": {"fit": "best-fit", "filter": ProfileFilter(8.0, 2), "region": SIDE},
}


def judge(kind: str, budget: UncertaintyBudget | None, half_mm: float = 0.1, rule: DecisionRule = "iso-14253-1") -> CharacteristicResult:
    stated = None if budget is None else StatedUncertainty(budget)
    zone, one = ToleranceZone(-0.1, 0.1, rule=rule), profile(half_mm, **KINDS[kind])
    live = LiveInspection(nominal_of("goe404"), zone, fit="none", uncertainty=stated, characteristics=(one,), provisional=False)
    live.add(scan("goe404", 150, reference_form("goe404", 150), 0, (0, 0)))
    (found,) = live.finish().characteristics
    return found


def test_each_is_judged_by_the_uncertainty_of_what_its_deviations_are_counted_from() -> None:
    nominal, stated = nominal_of("goe404"), StatedUncertainty(BUDGET)
    known, free = uncertainty_along(nominal, stated, HERE), uncertainty_along(nominal, stated, None)
    found = {kind: judge(kind, BUDGET).uncertainty for kind in KINDS}
    assert found["of the run"] == found["datum"] == known.largest_mm
    assert found["any placement"] == found["least consumption"] == free.largest_mm
    inside = (free.station_mm >= SIDE.from_mm) & (free.station_mm <= SIDE.to_mm)
    assert found["minimum zone"] == pytest.approx(free.expanded_mm[inside].max(), rel=1e-3)
    assert found["minimum zone"] < free.largest_mm
    points = scan("goe404", 150, reference_form("goe404", 150), 0, (0, 0))
    locked = deviation_uncertainty(points, nominal, BUDGET, LOCKED, fixed_mm=(0, 0), weights="arc-length").expanded_mm()
    assert found["locked"] == pytest.approx(locked.max(), rel=0.01)  # at its fit the points lie a little elsewhere
    assert found["its best fit"] == found["filtered"] > 0


@pytest.mark.parametrize("kind", KINDS)
def test_a_larger_budget_never_makes_a_characteristic_more_certain(kind: str) -> None:
    width = judge(kind, None).value
    for half_mm in (0.51 * width, 0.47 * width):
        before = plain = judge(kind, None, half_mm)
        for factor in (0.05, 10.0):
            budget = UncertaintyBudget(factor * 0.0009, factor * 0.0018, tip_radius_mm=factor * 0.0003)
            found = judge(kind, budget, half_mm)
            assert found.uncertainty > before.uncertainty
            assert found.verdict in (before.verdict, Verdict.UNCERTAIN)
            before = found
        assert judge(kind, BUDGET, half_mm, "simple").verdict is plain.verdict


def test_what_a_characteristic_states_itself_stands() -> None:
    live = LiveInspection(
        nominal_of("goe404"),
        ToleranceZone(-0.1, 0.1),
        uncertainty=StatedUncertainty(BUDGET),
        characteristics=(profile(uncertainty_mm=0.0077),),
        provisional=False,
    )
    live.add(scan("goe404", 300, np.zeros(300), 0, (0, 0)))
    assert live.finish().characteristics[0].uncertainty == 0.0077
