"""U of numbers of a section: closed forms of what a length does under each error, and numbers that are measured anew with drawn errors."""

from functools import cache
from typing import Any

import numpy as np
import pytest

from inspection import (
    CharacteristicResult,
    LiveInspection,
    Outline,
    RigidTransform,
    SectionCharacteristic,
    SectionKind,
    StatedUncertainty,
    ToleranceZone,
    UncertaintyBudget,
    Verdict,
    deviations,
    find_airfoil,
    with_nominal,
)
from inspection.characteristics.error_fields import Sensitivities
from tests.benchmarks.uncertainty_audit import SECTIONS, ratios
from tests.inspection.profiles import Array
from tests.inspection.reference_parts import nominal_of, reference_form, scan
from tests.inspection.test_uncertainty import covariance_of_field

HERE = RigidTransform.identity()
BUDGET = UncertaintyBudget(0.002, 0.0018, 1 / 300e3, 0.0008, 0.5, 11.5e-6, 8.0, 1e-6)


@cache
def outline() -> Outline:
    return Outline(find_airfoil(nominal_of("goe404")))


@cache
def asked(kind: SectionKind, method: str, **told: Any) -> SectionCharacteristic:
    bare = SectionCharacteristic(f"{kind} {method} {told}", kind, method, -5.0, 5.0, datum=HERE, **told)
    return with_nominal(bare, outline)


def numbers() -> tuple[SectionCharacteristic, ...]:
    return (
        asked("thickness", "inscribed"),
        asked("chord", "maximum-distance"),
        asked("edge-radius", "circle", window_deg=30.0),
        asked("camber", "inscribed"),
        asked("twist", "best-fit"),
        asked("displacement", "best-fit", axis="y"),
    )


def sensitivities_of(one: SectionCharacteristic) -> Sensitivities:
    assert one.sensitivities is not None
    return one.sensitivities.value


def judge(points: Array, budget: UncertaintyBudget | None, k: float = 1.0, **settings: Any) -> tuple[CharacteristicResult, ...]:
    stated = None if budget is None else StatedUncertainty(budget, k)
    zone = ToleranceZone(-0.1, 0.1, rule=settings.pop("rule", "iso-14253-1"))
    chosen = settings.pop("characteristics", numbers())
    live = LiveInspection(nominal_of("goe404"), zone, fit="none", uncertainty=stated, characteristics=chosen, provisional=False, **settings)
    live.add(points)
    return live.finish().characteristics


def test_a_thickness_feels_both_its_sides_and_no_motion() -> None:
    found = sensitivities_of(asked("thickness", "inscribed"))
    for of in found.known, found.fitted:
        assert of.tip == pytest.approx(2, abs=1e-6)
        assert of.growth == pytest.approx(13.2358, rel=2e-3)  # its own size
        assert of.shift == pytest.approx((0, 0), abs=1e-4)
        assert 1.0 <= of.single <= np.sqrt(2) * 1.01  # two contacts, or a little less where they lie between knots


@pytest.mark.parametrize("device", [UncertaintyBudget(mpe_mm=0.002), UncertaintyBudget(mpe_share=1e-4)])
def test_a_device_measures_a_thickness_to_within_what_is_stated_over_that_length(device: UncertaintyBudget) -> None:
    """By ISO 10360-2 (A + L/K) / sqrt(3). A part of A may be stated too large, since contacts lie anywhere between knots."""
    points = scan("goe404", 600, reference_form("goe404", 600), 0, (0, 0))
    (found,) = judge(points, device, characteristics=(asked("thickness", "inscribed"),))
    by_hand = (device.mpe_mm + device.mpe_share * found.value) / np.sqrt(3)
    assert 0.98 * by_hand <= found.uncertainty <= 1.35 * by_hand


def test_numbers_measured_anew_with_drawn_errors_scatter_no_more_than_stated() -> None:
    """Errors of device, tip, temperature and noise together, all points drawn and judged as a run does. 24 draws tell a scatter to 15 %."""
    count, trials, rng = 400, 24, np.random.default_rng(31)
    points = scan("goe404", count, reference_form("goe404", count), 0, (0, 0))
    normal = deviations(points, nominal_of("goe404")).normal
    values, vectors = np.linalg.eigh(covariance_of_field(points, BUDGET))
    root, drawn = vectors * np.sqrt(np.maximum(values, 0)), np.empty((trials, len(numbers())))
    for i in range(trials):
        along = BUDGET.repeatability_mm * rng.normal(0, 1, count) + BUDGET.tip_radius_mm * rng.normal()
        moved = points + root @ rng.normal(0, 1, (count, 2)) + BUDGET.growth * rng.normal() * points + along[:, None] * normal
        drawn[i] = [one.value for one in judge(moved, None)]
    stated = np.array([one.uncertainty for one in judge(points, BUDGET)])
    ratio = stated / drawn.std(axis=0, ddof=1)
    assert (ratio > 0.75).all(), ratio
    assert (ratio < 1.9).all(), ratio


def test_what_is_stated_of_another_section_is_no_less_than_its_numbers_scatter() -> None:
    """Six draws tell a scatter to a third; `make uncertainty` makes 200 of them for ten numbers of four sections."""
    found = ratios(SECTIONS["naca 6409"](), 6, np.random.default_rng(5), ("edge-radius", "twist"))
    assert len(found) == 2
    assert min(found.values()) > 0.45, found
    assert max(found.values()) < 4, found


def test_growth_that_was_not_taken_out_is_added_in_full() -> None:
    points = scan("goe404", 400, reference_form("goe404", 400), 0, (0, 0))
    left = UncertaintyBudget(tip_radius_mm=0.0005, expansion_per_k=11.5e-6, off_reference_k=10.0, compensated=False)
    for k in (1.0, 3.0):
        found = judge(points, left, k)
        assert found[0].uncertainty == pytest.approx(k * 2 * 0.0005 + 11.5e-5 * found[0].value, rel=2e-3)
        assert found[4].uncertainty < found[0].uncertainty


def test_a_larger_budget_never_makes_a_number_more_certain_and_by_simple_acceptance_it_does_not_count() -> None:
    points = scan("goe404", 400, reference_form("goe404", 400), 0, (0, 0))
    limits = ((-0.08, 0.0), (-0.021, 0.021))
    near = tuple(with_nominal(SectionCharacteristic("a", "thickness", "inscribed", *pair), outline) for pair in limits)
    before = judge(points, None, characteristics=near)
    assert [one.uncertainty for one in before] == [0.0, 0.0]
    plain = [one.verdict for one in before]
    for factor in (0.1, 100.0):
        budget = UncertaintyBudget(factor * 0.0005, tip_radius_mm=factor * 0.0003)
        found = judge(points, budget, characteristics=near)
        for one, other in zip(before, found, strict=True):
            assert other.value == one.value
            assert other.uncertainty > one.uncertainty
            assert other.verdict in (one.verdict, Verdict.UNCERTAIN)
        before = found
    by_simple = judge(points, budget, characteristics=near, rule="simple")
    assert [one.verdict for one in by_simple] == plain
    assert "simple acceptance" in by_simple[0].rule
    assert {one.verdict for one in before} == {Verdict.UNCERTAIN}


def test_what_a_characteristic_states_itself_stands() -> None:
    points = scan("goe404", 400, reference_form("goe404", 400), 0, (0, 0))
    own = with_nominal(SectionCharacteristic("a", "thickness", "inscribed", -0.1, 0.1, uncertainty=0.0123), outline)
    (found,) = judge(points, BUDGET, characteristics=(own,))
    assert found.uncertainty == 0.0123
    assert not any("budget" in note for note in found.notes)
