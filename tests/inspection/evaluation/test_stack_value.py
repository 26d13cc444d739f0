"""Characteristics of a stack from made-up sections: closed forms, and that nothing missing or in doubt makes any of them better."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from inspection import (
    CharacteristicResult,
    MeasuredSection,
    Reason,
    RigidTransform,
    StackCharacteristic,
    StackCharacteristicResult,
    Verdict,
    judge_stack,
    numbers_of,
)
from inspection.characteristics.stack_characteristic import Axis
from tests.inspection.profiles import Array

HEIGHTS = np.array([2.0, 8.0, 12.0, 18.0, 30.0])
TWIST = np.array([0.3, -0.2, 1.5, 2.0, 1.1])  # deg
SHIFT = np.array([(0.1, -0.2), (0.05, 0.1), (0.3, 0.0), (0.2, 0.4), (-0.1, 0.3)])
CHORD = np.array([60.0, 57.1, 55.2, 52.0, 46.1])
NOMINAL_CHORD = 61.0 - 0.5 * HEIGHTS
PLACE = (10.0, 3.0)
DATUM = RigidTransform.identity()
DOUBT = Reason("coverage", "Only 60 % of the profile was measured.")

_KINDS_OF_REASONS = {Verdict.CONFORM: "", Verdict.UNCERTAIN: "within-uncertainty", Verdict.NONCONFORM: "out-of-tolerance"}
KINDS = {
    "twist": StackCharacteristic("twist", "twist", "best-fit", -1.0, 1.0, datum=DATUM),
    "relative twist": StackCharacteristic("relative twist", "relative-twist", "best-fit", -1.0, 1.0),
    "displacement": StackCharacteristic("displacement", "displacement", "best-fit", -math.inf, 1.0, place_mm=PLACE, datum=DATUM),
    "bow": StackCharacteristic("bow", "bow", "root-tip", -math.inf, 0.5, place_mm=PLACE),
    "lean": StackCharacteristic("lean", "lean", "least-squares", -math.inf, 1.0, place_mm=PLACE),
    "straightness": StackCharacteristic("straightness", "stacking-axis", "straightness", -math.inf, 1.0, place_mm=PLACE),
    "location": StackCharacteristic("location", "stacking-axis", "location", -math.inf, 1.0, place_mm=PLACE, datum=DATUM),
    "taper": StackCharacteristic("taper", "taper", "tangent", -0.1, 0.1),
}


def actual_mm() -> Array:
    """Where the stacking points came to lie: turned about the origin with their sections, then shifted."""
    return np.vstack([RigidTransform(math.radians(a), s).apply(np.array([PLACE])) for a, s in zip(TWIST, SHIFT, strict=True)])


def sections(asked: StackCharacteristic, seen: RigidTransform = DATUM) -> list[MeasuredSection]:
    """The sections as a scanner would see them that turned and moved the whole part by `seen`."""
    found = []
    for k, height in enumerate(HEIGHTS.tolist()):
        moved = seen.apply(actual_mm()[k : k + 1])[0] - PLACE
        values = {"twist": TWIST[k] + math.degrees(seen.rotation_rad), "chord": CHORD[k], "x": moved[0], "y": moved[1]}
        numbers = {}
        for number in numbers_of([asked]):
            key = number.axis if number.type == "displacement" else number.type
            nominal = float(NOMINAL_CHORD[k]) if number.type == "chord" else 0.0
            numbers[number.name] = result_of(float(values[key]), nominal)
        found.append(MeasuredSection(height, numbers))
    return found


def result_of(value: float, nominal: float) -> CharacteristicResult:
    limits = (-math.inf, math.inf, value - nominal, math.nan, 0.0, "", Verdict.CONFORM, ())
    return CharacteristicResult("number", "chord", "", value, nominal, "mm", *limits)


def doubted(section: MeasuredSection) -> MeasuredSection:
    numbers = {name: replace(one, verdict=Verdict.UNCERTAIN, reasons=(DOUBT,)) for name, one in section.numbers.items()}
    return replace(section, numbers=numbers)


def judged(asked: StackCharacteristic, of: list[MeasuredSection] | None = None) -> StackCharacteristicResult:
    return judge_stack([asked], sections(asked) if of is None else of)[0]


def slopes() -> Array:
    return np.asarray(np.polyfit(HEIGHTS, actual_mm(), 1)[0])


def test_twist_and_relative_twist_are_those_of_the_sections() -> None:
    found = judged(KINDS["twist"])
    assert [share.value for share in found.sections] == pytest.approx(TWIST.tolist(), abs=1e-12)
    assert (found.height_mm, found.found.verdict) == (18.0, Verdict.NONCONFORM)
    assert found.found.value == pytest.approx(2.0)
    assert "At height 18 mm it is 2 deg, +2 from the nominal 0; -1 .. +1 deg are allowed." in found.found.reasons[0].words
    lowest = judged(KINDS["relative twist"])
    assert [share.value for share in lowest.sections] == pytest.approx((TWIST - TWIST[0]).tolist(), abs=1e-12)
    other = judged(replace(KINDS["relative twist"], reference_mm=12.0))
    assert [share.value for share in other.sections] == pytest.approx((TWIST - TWIST[2]).tolist(), abs=1e-12)
    assert other.found.notes == ("counted from the section at 12 mm",)


def test_displacements_are_those_of_the_stacking_points() -> None:
    moved = actual_mm() - PLACE
    along: list[tuple[Axis, Array]] = [("x", moved[:, 0]), ("y", moved[:, 1]), ("total", np.hypot(*moved.T))]
    for axis, expected in along:
        found = judged(replace(KINDS["displacement"], axis=axis))
        assert [share.value for share in found.sections] == pytest.approx(expected.tolist(), abs=1e-12)


@pytest.mark.parametrize("seen", [DATUM, RigidTransform(2.5, np.array([40.0, -7.0]))])
def test_bow_lean_and_straightness_do_not_depend_on_how_the_part_was_clamped(seen: RigidTransform) -> None:
    """Turned about the height and moved as a whole. Root and tip are the second and the last section here."""
    actual = actual_mm()
    share = ((HEIGHTS - 8) / 22)[:, None]
    off = np.hypot(*(actual - (1 - share) * actual[1] - share * actual[4]).T)
    asked = replace(KINDS["bow"], root_mm=8.0, tip_mm=30.0)
    assert [one.value for one in judged(asked, sections(asked, seen)).sections] == pytest.approx(off.tolist(), abs=1e-11)
    lean = KINDS["lean"]
    in_all = math.degrees(math.atan(math.hypot(*slopes())))
    assert judged(lean, sections(lean, seen)).found.value == pytest.approx(in_all, abs=1e-11)
    turned = RigidTransform(-math.radians(TWIST.mean()), np.zeros(2)).apply(slopes()[None])[0]
    for axis, slope in zip(("x", "y"), turned, strict=True):
        one = replace(lean, axis="x" if axis == "x" else "y")
        assert judged(one, sections(one, seen)).found.value == pytest.approx(math.degrees(math.atan(slope)), abs=1e-11)
    rest = actual - np.column_stack([np.polyval(np.polyfit(HEIGHTS, actual[:, k], 1), HEIGHTS) for k in (0, 1)])
    straight = KINDS["straightness"]
    assert judged(straight, sections(straight, seen)).found.value == pytest.approx(np.hypot(*rest.T).max(), abs=1e-11)


def test_the_location_of_the_axis_is_its_largest_distance_between_the_ends() -> None:
    fits = [np.polyfit(HEIGHTS, actual_mm()[:, k] - PLACE[k], 1) for k in (0, 1)]
    ends = [math.hypot(*(np.polyval(fit, height) for fit in fits)) for height in HEIGHTS[[0, -1]]]
    assert judged(KINDS["location"]).found.value == pytest.approx(max(ends), abs=1e-11)


def test_taper_is_the_slope_of_a_length_beside_that_of_its_nominal() -> None:
    found = judged(KINDS["taper"]).found
    assert found.unit == "1"
    assert found.value == pytest.approx(np.polyfit(HEIGHTS, CHORD, 1)[0])
    assert found.nominal == pytest.approx(-0.5)
    assert found.verdict is Verdict.CONFORM
    drawn = judged(replace(KINDS["taper"], nominal_value=-0.3)).found
    assert drawn.deviation == pytest.approx(found.value + 0.3)
    assert drawn.verdict is Verdict.NONCONFORM


def test_a_taper_is_doubted_by_what_the_drawn_sections_may_mislead_by() -> None:
    asked = KINDS["taper"]
    drawn = [
        replace(section, numbers={name: replace(one, drawing=0.05) for name, one in section.numbers.items()}) for section in sections(asked)
    ]
    z = HEIGHTS - HEIGHTS.mean()
    by = 0.05 * np.abs(z).sum() / (z @ z)  # every section off by 0.05 mm, in the worst way
    value = judged(asked).found.deviation
    for limit, verdict in (
        (value + 1.01 * by, Verdict.CONFORM),
        (value + 0.99 * by, Verdict.UNCERTAIN),
        (value - 0.99 * by, Verdict.UNCERTAIN),
    ):
        found = judged(replace(asked, lower=-math.inf, upper=limit), drawn).found
        assert found.verdict is verdict
        assert [reason.kind for reason in found.reasons] == ["within-uncertainty"] * (verdict is not Verdict.CONFORM)
    assert judged(replace(asked, lower=-math.inf, upper=value - 1.01 * by), drawn).found.verdict is Verdict.NONCONFORM
    unknown = [replace(one, numbers={name: replace(n, drawing=math.inf) for name, n in one.numbers.items()}) for one in drawn]
    assert judged(replace(asked, lower=-math.inf, upper=100.0), unknown).found.verdict is Verdict.UNCERTAIN


@pytest.mark.parametrize("name", KINDS)
def test_a_value_near_a_limit_is_proven_neither_way(name: str) -> None:
    value = judged(replace(KINDS[name], lower=-math.inf, upper=-100.0)).found.deviation  # the one that goes farthest up
    for upper, verdict in ((value + 0.03, Verdict.CONFORM), (value + 0.01, Verdict.UNCERTAIN), (value - 0.03, Verdict.NONCONFORM)):
        asked = replace(KINDS[name], lower=-math.inf, upper=upper, uncertainty=0.02)
        found = judged(asked).found
        assert found.verdict is verdict
        assert [reason.kind for reason in found.reasons] == [_KINDS_OF_REASONS[verdict]] * (verdict is not Verdict.CONFORM)
    assert "U not stated" in judged(KINDS[name]).found.rule


@pytest.mark.parametrize("name", KINDS)
@settings(max_examples=30)
@given(st.data())
def test_what_is_missing_or_in_doubt_never_makes_a_verdict_better(name: str, data: st.DataObject) -> None:
    """Over limits of any width: what the whole stack does not prove, the stack with fewer sections or with doubts does not either."""
    base = KINDS[name]
    limit = data.draw(st.floats(0.01, 3.0))
    asked = replace(base, lower=-limit if math.isfinite(base.lower) else base.lower, upper=limit)
    whole = sections(asked)
    worse = list(whole)
    for k in sorted(data.draw(st.sets(st.integers(0, len(whole) - 1), min_size=1))):
        gone = data.draw(st.booleans())
        worse[k] = MeasuredSection(whole[k].height_mm, {}, (Reason("no-value", "It fits nothing."),)) if gone else doubted(whole[k])
    before, after = judged(asked, whole).found, judged(asked, worse).found
    assert after.verdict is not Verdict.CONFORM
    assert after.verdict is Verdict.UNCERTAIN or before.verdict is Verdict.NONCONFORM
    assert after.reasons
    lost = judge_stack([asked], whole, Reason("incomplete", "Only 5 of 6 sections were inspected."))[0].found
    assert lost.verdict is (Verdict.NONCONFORM if before.verdict is Verdict.NONCONFORM else Verdict.UNCERTAIN)


def test_a_sound_section_out_of_tolerance_is_proven_beside_one_in_doubt() -> None:
    whole = sections(KINDS["twist"])
    found = judged(KINDS["twist"], [doubted(whole[0]), *whole[1:]])
    assert [share.verdict.word for share in found.sections] == ["uncertain", "conform", "nonconform", "nonconform", "nonconform"]
    assert found.found.verdict is Verdict.NONCONFORM
    assert [reason.kind for reason in found.found.reasons] == ["out-of-tolerance", "coverage"]
    assert found.found.reasons[1].words == "The section at 2 mm: Only 60 % of the profile was measured."
    in_doubt = judged(KINDS["relative twist"], [doubted(sections(KINDS["relative twist"])[0]), *sections(KINDS["relative twist"])[1:]])
    assert {share.verdict for share in in_doubt.sections} == {Verdict.UNCERTAIN}  # every one is counted from that section


def test_doubts_that_sections_share_are_told_once() -> None:
    whole = [doubted(section) for section in sections(KINDS["bow"])]
    assert [reason.words for reason in judged(KINDS["bow"], whole).found.reasons] == [f"Every section: {DOUBT.words}"]
    some = [*whole[:2], *sections(KINDS["bow"])[2:]]
    assert judged(KINDS["bow"], some).found.reasons[-1].words == f"The sections at 2, 8 mm: {DOUBT.words}"


def test_a_stack_without_enough_sections_has_no_value() -> None:
    empty = [MeasuredSection(height, {}) for height in HEIGHTS[1:].tolist()]
    for asked in KINDS.values():
        found = judged(asked, [sections(asked)[0], *empty])
        single = asked.name in ("twist", "displacement")
        assert math.isnan(found.found.value) is not single
        assert found.found.verdict is not Verdict.CONFORM
    away = judged(replace(KINDS["relative twist"], reference_mm=99.0))
    assert math.isnan(away.found.value)
    with pytest.raises(ValueError, match="rising heights"):
        judge_stack([KINDS["bow"]], sections(KINDS["bow"])[::-1])


@pytest.mark.parametrize("kind", KINDS)
def test_two_sections_prove_nothing_that_two_always_have(kind: str) -> None:
    """They lie on a straight line, so a bent blade had no bow and a straight axis, and conformed; the other kinds keep their values."""
    found = judged(KINDS[kind], sections(KINDS[kind])[:2]).found
    if kind not in ("bow", "straightness"):
        assert math.isfinite(found.value)
        return
    assert math.isnan(found.value)
    assert found.verdict is Verdict.UNCERTAIN
    assert "cut a third one" in found.reasons[0].words


def with_u(section: MeasuredSection, u: float, moved: dict[str, float] | None = None) -> MeasuredSection:
    """The section with numbers of this U, and off by so much."""
    off = moved or {}
    numbers = {name: replace(one, uncertainty=u, value=one.value + off.get(name, 0.0)) for name, one in section.numbers.items()}
    return replace(section, numbers=numbers)


@pytest.mark.parametrize("kind", KINDS)
def test_no_errors_of_the_sections_within_their_u_change_a_value_by_more_than_its_u(kind: str) -> None:
    """Two hundred drawings of signs and sizes, of which the extreme ones come near to what is stated."""
    asked, rng, used = KINDS[kind], np.random.default_rng(7), 0.0
    u = np.array([0.004, 0.002, 0.006, 0.001, 0.003])
    found = sections(asked)
    (before,) = judge_stack([asked], [with_u(one, size) for one, size in zip(found, u.tolist(), strict=True)])
    heights = {share.height_mm: share.value for share in before.sections}
    for _ in range(200):
        moved = []
        for one, size in zip(found, u.tolist(), strict=True):
            signs = rng.choice([-1.0, 1.0], len(one.numbers)) * rng.choice([0.3, 1.0], len(one.numbers))
            moved.append(with_u(one, size, dict(zip(one.numbers, (size * signs).tolist(), strict=True))))
        (after,) = judge_stack([asked], moved)
        off = after.found.value - before.found.value if not heights else 0.0
        for share in after.sections:
            if share.height_mm == before.height_mm:
                off = share.value - heights[share.height_mm]
        used = max(used, abs(off) / before.found.uncertainty)
    assert 0.3 < used <= 1.0 + 1e-9
    assert "added as if all their errors went the same way" in before.found.notes[-1]


@pytest.mark.parametrize("kind", KINDS)
def test_a_larger_u_of_the_sections_never_makes_a_stack_more_certain_and_its_own_stands(kind: str) -> None:
    asked = KINDS[kind]
    value = judge_stack([asked], sections(asked))[0].found.deviation
    for limit in (1.01 * value, 0.99 * value):
        zone = replace(asked, lower=-math.inf, upper=limit)
        (before,) = judge_stack([zone], sections(zone))
        for u in (1e-5, 1e-3, 1.0):
            (found,) = judge_stack([zone], [with_u(one, u) for one in sections(zone)])
            assert found.found.verdict in (before.found.verdict, Verdict.UNCERTAIN)
            before = found
        assert before.found.verdict is Verdict.UNCERTAIN
        (simple,) = judge_stack([zone], [with_u(one, 1.0) for one in sections(zone)], decision="simple")
        assert simple.found.verdict is judge_stack([zone], sections(zone))[0].found.verdict
    (own,) = judge_stack([replace(asked, uncertainty=0.0123)], [with_u(one, 1.0) for one in sections(asked)])
    assert own.found.uncertainty == 0.0123
