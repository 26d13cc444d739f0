"""Rows of a csv file against the plain formats, one field after the other."""

import io
import math

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from numpy.typing import NDArray

from cmmlink.csv_rows import Column, Texts, write_rows

COUNT = 5000
EDGES = [0.0, -0.0, 5e-324, 4.9999999e-7, 5e-7, 1.5e-6, 2.5e-6, 0.0078125, 0.9999995, 0.9999994999, 999.9999995, 999998.9999995, 999999.0,
         999999.9999995, 1e6, 123456789.125, 1e300, np.inf]  # fmt: skip


def written(*columns: Column) -> bytes:
    file = io.BytesIO()
    write_rows(file, columns)
    return file.getvalue()


def plain(values: NDArray[np.float64]) -> bytes:
    return "".join(",".join("" if math.isnan(value) else f"{value:.6f}" for value in row) + "\r\n" for row in values.tolist()).encode()


def doubles(rng: np.random.Generator) -> NDArray[np.float64]:
    """Numbers of every size below a kilometre, as many of each power of ten."""
    return np.asarray(rng.choice([-1.0, 1.0], COUNT) * 10 ** rng.uniform(-12, 6, COUNT))


def ties(rng: np.random.Generator) -> NDArray[np.float64]:
    """Numbers that end exactly between two sixth decimals: odd multiples of 2**-7 to 2**-30."""
    return np.asarray((2 * rng.integers(-(2**25), 2**25, COUNT) + 1) / 2.0 ** rng.integers(7, 31, COUNT))


def half_units(rng: np.random.Generator) -> NDArray[np.float64]:
    """The doubles nearest to numbers that end on a seventh decimal 5: above or below it, by less than the product with a million tells."""
    return np.asarray((rng.integers(-(10**11), 10**11, COUNT) + 0.5) / 1e6)


@pytest.mark.parametrize("kind", [doubles, ties, half_units])
@pytest.mark.parametrize("beside", [-np.inf, 0.0, np.inf])
def test_numbers_are_written_as_the_format_writes_them(kind: object, beside: float) -> None:
    assert callable(kind)
    values = kind(np.random.default_rng(1))
    values = values if beside == 0 else np.nextafter(values, beside)
    assert written(values[:, None]) == plain(values[:, None])


@settings(max_examples=60, deadline=None)
@given(arrays(np.float64, st.tuples(st.integers(1, 6), st.integers(1, 4)), elements=st.floats() | st.sampled_from(EDGES)))
@example(np.array([[edge, -edge] for edge in EDGES]))
@example(np.array([[edge, -edge] for edge in EDGES if edge < 999_999]))
@example(np.array([[np.nan, -np.nan, 1.0]]))
def test_any_number_is_written_as_the_format_writes_it_and_no_number_as_an_empty_field(values: NDArray[np.float64]) -> None:
    assert written(values) == plain(values)


@pytest.mark.parametrize("too_large", [False, True])
def test_columns_of_every_kind_stand_side_by_side_over_many_pieces(too_large: bool) -> None:
    rng = np.random.default_rng(2)
    whole, values, codes = rng.integers(0, 10 ** rng.integers(0, 13, COUNT)), rng.normal(0, 50, (COUNT, 3)), rng.integers(0, 3, COUNT)
    values[rng.integers(0, COUNT, 50), 1] = np.nan
    values[COUNT // 2, 0] = 2e6 if too_large else 2.0
    words = ["", "conform", "rejected: beyond the end, \u00fc"]
    rows = zip(whole.tolist(), plain(values).decode().split("\r\n"), codes.tolist(), strict=False)
    expected = "".join(f"{words[code]},{number},{fields},{words[code]}\r\n" for number, fields, code in rows)
    text = Texts(codes.astype(np.int8), words)
    assert written(text, whole, values, text).decode() == expected


def test_no_rows_are_no_bytes() -> None:
    assert written(np.empty(0, dtype=np.int64), np.empty((0, 2))) == b""


def test_what_is_handed_to_the_file_at_once_does_not_grow_with_the_rows() -> None:
    class Pieces(io.BytesIO):
        sizes: list[int]

        def write(self, data: bytes, /) -> int:  # type: ignore[override]  # BytesIO takes any buffer
            self.sizes.append(len(data))
            return len(data)

    largest, written_bytes = [], []
    for rows in (10_000, 100_000):
        file = Pieces()
        file.sizes = []
        write_rows(file, [np.full(rows, 7), np.full((rows, 2), 1.0)])
        largest.append(max(file.sizes))
        written_bytes.append(sum(file.sizes))
    assert largest[0] == largest[1]
    assert written_bytes == [10_000 * len("7,1.000000,1.000000\r\n"), 100_000 * len("7,1.000000,1.000000\r\n")]
