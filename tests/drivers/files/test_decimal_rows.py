"""Numbers of plain decimal text, many at a time: bit for bit those that Python reads one by one, or none."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drivers.files.decimal_rows import decimal_rows

DIGITS = st.text("0123456789", max_size=17)
NUMBERS = st.builds("{}{}{}{}".format, st.sampled_from(["", "-", "+"]), DIGITS, st.sampled_from(["", "."]), DIGITS)
ODD = st.sampled_from(
    ["", "1e5", "nan", "1_0", "--1", "1-", "1.2.3", ".", "-", "1 2", "0x1", "\u0661", "1.", ".5", "-.5", "-0.0", "00012.50"]
)


def spelled(rows: list[list[str]], between: str) -> bytes:
    return "".join(between.join(row) + "\n" for row in rows).encode()


def one_by_one(rows: list[list[str]]) -> np.ndarray[tuple[int, int], np.dtype[np.float64]]:
    return np.array([[float(number) for number in row] for row in rows])


@settings(max_examples=150, deadline=None)
@given(st.integers(1, 4).flatmap(lambda wide: st.lists(st.lists(NUMBERS | ODD, min_size=wide, max_size=wide), min_size=1, max_size=6)))
def test_what_is_read_is_what_python_reads_to_the_last_bit(rows: list[list[str]]) -> None:
    found = decimal_rows(spelled(rows, ","), ",")
    if found is not None:
        np.testing.assert_array_equal(found.view(np.int64), one_by_one(rows).view(np.int64), strict=True)


@pytest.mark.parametrize("decimals", range(16))
@pytest.mark.parametrize("between", [",", ";", "\t", "|", None])
def test_all_numbers_of_fifteen_digits_are_read(decimals: int, between: str | None) -> None:
    rng = np.random.default_rng(decimals)
    sizes = 10.0 ** rng.uniform(-6, min(8, 15 - decimals), (200, 3))
    rows = [[f"{value:.{decimals}f}" for value in row] for row in np.where(rng.random((200, 3)) < 0.5, sizes, -sizes).tolist()]
    found = decimal_rows(spelled(rows, between or " \t "), between)
    assert found is not None
    np.testing.assert_array_equal(found.view(np.int64), one_by_one(rows).view(np.int64), strict=True)


@pytest.mark.parametrize("text", ["-0.000,0\n", "5.,.5\n", "+7,-.25\n", "99999999.9999999,12345678\n", "1,2.5\n3.25,4\n"])
def test_every_plain_spelling_is_read(text: str) -> None:
    found = decimal_rows(text.encode(), ",")
    assert found is not None
    expected = one_by_one([line.split(",") for line in text.splitlines()])
    np.testing.assert_array_equal(found.view(np.int64), expected.view(np.int64), strict=True)


@pytest.mark.parametrize(
    "text",
    [
        "", "\n", "1,2", "1,2\n3", "1,2\n3,4,5\n6\n", "1,2\n\n3,4\n", "1,,2\n", "1,2,\n", ",1,2\n", "1, 2\n", "1,2\r\n",
        "1.2.3,4\n", "1,.\n", "1..2,\n", "1,-\n", "1,2-\n", "1,--2\n", "1e3,2\n", "nan,2\n", "1_0,2\n", "1,123456789012345.6\n",
        "1,0.12345678901234567\n",
        "999999999,1\n", "1.2.3,4\n5,6\n", "1,2\n3.,4.5.\n",
    ],
)  # fmt: skip
def test_what_is_not_of_the_plainest_kind_is_left_to_others(text: str) -> None:
    assert decimal_rows(text.encode(), ",") is None


@pytest.mark.parametrize(
    ("text", "columns"),
    [("  1.5   -2\n 3 4.25  \n", 2), ("1\t2 3\n", 3), (" \n1 2\n", None), ("1 2\n3\n4 5 6\n", None), ("1 2\n \n3 4\n", None)],
)
def test_blanks_may_stand_anywhere_between_numbers(text: str, columns: int | None) -> None:
    found = decimal_rows(text.encode(), None)
    assert (None if found is None else found.shape[1]) == columns
    if found is not None:
        np.testing.assert_array_equal(found, one_by_one([line.split() for line in text.splitlines()]))
