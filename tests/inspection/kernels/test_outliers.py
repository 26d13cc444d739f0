"""The limit of outliers: a median of what is not yet ordered."""

import numpy as np
import pytest

from inspection.kernels.outliers import median_near


@pytest.mark.parametrize("guess", [0.5, 1.0, 1.04, 3.0, 1e-9])
@pytest.mark.parametrize("count", [1, 2, 7, 1000, 1001])
def test_a_median_does_not_depend_on_its_guess(count: int, guess: float) -> None:
    values = np.abs(np.random.default_rng(count).normal(0, 1, count))
    values[: count // 3] = np.nan  # points that take no part
    wanted = float(np.median(values[~np.isnan(values)]))
    assert median_near(values, guess * wanted) == wanted


def test_no_values_have_no_median() -> None:
    assert median_near(np.full(4, np.nan), 1.0) == np.inf
