"""The error budget: nothing counts as inside its limit that was not looked at, is no number, or is larger than the limit."""

import math

import pytest

from cmmlink.qualification.budget import DEVIATION, QUANTITIES, WIRE_VERDICTS, FoundError, Quantity, budget_of, kinds_outside


def _all_inside() -> list[FoundError]:
    return [FoundError(quantity, quantity.limit / 2, "a case") for quantity in QUANTITIES]


def test_every_error_inside_its_limit_passes() -> None:
    budget = budget_of(_all_inside())
    assert kinds_outside(budget) == []
    assert [line.quantity for line in budget] == list(QUANTITIES)


@pytest.mark.parametrize("quantity", QUANTITIES, ids=lambda quantity: quantity.name)
@pytest.mark.parametrize("error", [math.nan, math.inf, "above"])
def test_one_error_outside_is_outside_and_names_its_kind(quantity: Quantity, error: float | str) -> None:
    found = error if isinstance(error, float) else max(quantity.limit * (1 + 1e-12), 1e-300)
    budget = budget_of([*_all_inside(), FoundError(quantity, found, "the case")])
    assert kinds_outside(budget) == [quantity.kind]
    [line] = [line for line in budget if not line.inside]
    assert (line.quantity, line.worst_case) == (quantity, "the case")


@pytest.mark.parametrize("quantity", QUANTITIES, ids=lambda quantity: quantity.name)
def test_what_was_not_looked_at_is_outside(quantity: Quantity) -> None:
    assert kinds_outside(budget_of([one for one in _all_inside() if one.quantity is not quantity])) == [quantity.kind]


def test_a_line_tells_the_largest_error_the_median_of_the_cases_and_how_many_numbers_there_were() -> None:
    found = [FoundError(DEVIATION, error, name, 10) for error, name in ((1e-12, "a"), (3e-12, "b"), (2e-12, "c"))]
    line = budget_of(found)[0].document()
    assert {key: line[key] for key in ("values", "cases", "largest", "median", "worst_case", "inside")} == {
        "values": 30, "cases": 3, "largest": 3e-12, "median": 2e-12, "worst_case": "b", "inside": True,
    }  # fmt: skip


def test_a_count_has_the_limit_zero_and_every_limit_a_reason() -> None:
    assert WIRE_VERDICTS.limit == 0
    assert all((quantity.limit == 0) == (quantity.unit == "count") and quantity.reason for quantity in QUANTITIES)
