"""The two laws over every type of characteristic: what is missing never makes one conform, and order, batches and density change none."""

from collections.abc import Iterator
from functools import cache
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from inspection import InspectionResult, LineProfile, Missing, SectionCharacteristic, Verdict
from inspection.evaluation.region import is_inside
from tests.inspection.evaluation.asked import COUNT, DATUM, every_type, form, named, nominal, points_at, run, stations
from tests.inspection.profiles import Array

SAME = 1e-7
EXAMPLES = settings(max_examples=3, deadline=None, derandomize=True)  # each judges every type: a quarter of a second


@pytest.fixture(autouse=True, scope="module")
def _certificates_are_given_up_early() -> Iterator[None]:
    """No verdict here hangs on the proof of the number; what is out is asked of every placement as always."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("inspection.evaluation.placing._MOST_BOXES", 256)
        patch.setattr("inspection.evaluation.placing._MOST_BOXES_CONSUMPTION", 256)
        yield


def even_scan(bump_mm: float = 0.0, at_mm: float = 60.0) -> Array:
    station = stations()
    return points_at(station, form(station, bump_mm, at_mm))


@cache
def whole(bump_mm: float = 0.0) -> InspectionResult:
    return run(even_scan(bump_mm))


def said(result: InspectionResult) -> dict[str, tuple[Verdict, tuple[str, ...]]]:
    return {name: (one.verdict, tuple(reason.kind for reason in one.reasons)) for name, one in named(result).items()}


def test_every_type_conforms_on_a_good_part_and_the_part_with_them() -> None:
    result = whole()
    assert {one.verdict for one in result.characteristics} == {Verdict.CONFORM}
    assert result.verdict is Verdict.CONFORM
    assert result.reasons == ()
    assert [one.name for one in result.characteristics] == [one.name for one in every_type()]
    assert [one.name for one in result.characteristics if any("border_mm is 0" in note for note in one.notes)] == ["stepped"]


@EXAMPLES
@given(st.permutations(range(8)), st.lists(st.integers(1, 150), max_size=4), st.sampled_from([0.0, 0.25]))
def test_order_and_batches_change_no_characteristic(blocks: list[int], sizes: list[int], bump_mm: float) -> None:
    points = even_scan(bump_mm)
    shuffled = np.concatenate([points[np.arange(block, COUNT, 8)] for block in blocks])
    one, other = whole(bump_mm), run(shuffled, sizes=tuple(sizes))
    assert said(one) == said(other)
    for name, found in named(other).items():
        assert found.value == pytest.approx(named(one)[name].value, abs=SAME), name
        assert found.deviation == pytest.approx(named(one)[name].deviation, abs=SAME), name


@EXAMPLES
@given(st.integers(0, COUNT - 1), st.integers(20, 120), st.integers(2, 12))
def test_dwelling_and_a_denser_side_change_no_verdict(first: int, count: int, times: int) -> None:
    points = even_scan()
    place = np.mod(np.arange(first, first + count), COUNT)
    station = np.mod(stations()[place][:, None] + np.linspace(0, 0.3, times), nominal().length_mm).ravel()
    dense = np.concatenate([points, np.repeat(points[place[:1]], 50, axis=0), points_at(station, form(station))])
    assert {name: verdict for name, (verdict, _) in said(run(dense)).items()} == {
        name: verdict for name, (verdict, _) in said(whole()).items()
    }


@pytest.mark.parametrize(
    "told",
    [
        {"missing": Missing(lost=3)},
        {"missing": Missing(damaged_bytes=40)},
        {"missing": Missing(rejected={"unusable": 1})},
        {"missing": Missing(announced=COUNT + 5, arrived=COUNT)},
        {"missing": Missing(begun=2)},
        {"complete": False},
    ],
    ids=["lost", "damaged", "rejected", "announced", "begun anew", "incomplete"],
)
def test_what_is_known_to_be_missing_lets_nothing_conform(told: dict[str, Any]) -> None:
    result = run(even_scan(), **told)
    assert {one.verdict for one in result.characteristics} == {Verdict.UNCERTAIN}
    assert all(one.reasons for one in result.characteristics)


@EXAMPLES
@given(st.floats(0.0, 1.0), st.floats(2.2, 4.0))
def test_a_defect_in_a_stretch_that_was_not_measured_lets_nothing_conform_that_it_could_be_in(share: float, half_mm: float) -> None:
    """The stretch is twice as wide as the longest gap that counts as measured; what lies elsewhere keeps its verdict."""
    length, station = nominal().length_mm, stations()
    at_mm = share * length
    away = np.abs(np.mod(station - at_mm + length / 2, length) - length / 2)
    seen = station[away > half_mm]
    holed = run(points_at(seen, form(seen)))
    for asked, one in zip(every_type(), holed.characteristics, strict=True):
        assert one.verdict is Verdict.UNCERTAIN or (not could_hide(asked, at_mm, half_mm) and one.verdict is Verdict.CONFORM), one.name
    assert whole().verdict is Verdict.CONFORM
    assert holed.verdict is Verdict.UNCERTAIN


def could_hide(asked: object, at_mm: float, half_mm: float) -> bool:
    """Whether more of the stretch lies in a characteristic than may go unseen, as far as this test can tell without its code."""
    length = nominal().length_mm
    if isinstance(asked, LineProfile) and asked.region is not None:
        places = np.mod(at_mm + np.linspace(-half_mm, half_mm, 201), length)
        return bool(np.count_nonzero(is_inside(places, asked.region, nominal())) / 201 * 2 * half_mm > length / 100)
    return not (isinstance(asked, SectionCharacteristic) and asked.type in ("edge-radius", "edge-thickness"))


def test_a_value_that_is_out_is_not_proven_so_where_what_it_depends_on_was_not_measured() -> None:
    """Between two ends of a hole a spline draws what nobody saw."""
    station = stations()
    radius = next(one for one in every_type() if one.name == "radius")
    assert isinstance(radius, SectionCharacteristic)
    assert radius.section is not None
    nose = float(radius.section.curve.station_mm(np.array([radius.section.nose]))[0])
    seen = station[np.abs(station - nose) > 2.5]
    found = named(run(points_at(seen, form(seen, 3.0, nose, 1.5))))["radius"]
    assert found.verdict is Verdict.UNCERTAIN
    assert "unseen" in [reason.kind for reason in found.reasons] or "gap" in [reason.kind for reason in found.reasons]


def test_the_part_has_the_worst_verdict_and_the_reasons_of_the_worst_come_first() -> None:
    result = whole(0.25)
    verdicts = [one.verdict for one in result.characteristics]
    assert result.verdict is max(verdicts) is Verdict.NONCONFORM
    assert Verdict.CONFORM in verdicts
    assert result.reasons[0].kind == "out-of-tolerance"


@pytest.mark.parametrize("off_mm", [(0.25, 0.0), (0.0, 0.3)])
def test_where_a_part_lies_changes_no_number_of_its_shape(off_mm: tuple[float, float]) -> None:
    """Off its datum by more than its tolerance, a part has the chord, the edges and the camber that it has on it."""
    asked = tuple(one for one in every_type() if one.name in ("chord", "angle", "thickness", "edge thickness", "radius", "camber"))
    there = DATUM.inverse().apply(DATUM.apply(even_scan()) + off_mm)
    at_datum: dict[str, Any] = {"asked": asked, "fit": "none", "datum": DATUM}
    here, moved = named(run(even_scan(), **at_datum)), named(run(there, **at_datum))
    for name, found in here.items():
        assert moved[name].value == pytest.approx(found.value, abs=1e-5), name
