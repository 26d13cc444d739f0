"""Places on curves by the compiled loop, against those by whole arrays, to the last bit."""

import numpy as np
import pytest

from inspection import NurbsCurve
from tests.inspection.profiles import Array


def curve_of(degree: int, rng: np.random.Generator, weights: Array | None) -> NurbsCurve:
    inner = np.sort(rng.uniform(size=11 - degree))
    inner[1] = inner[2] = inner[3]  # a repeated knot
    knots = np.concatenate([np.zeros(degree + 1), inner, np.ones(degree + 1)])
    return NurbsCurve(degree, rng.normal(size=(12, 2)), knots, weights)


@pytest.mark.parametrize("degree", [3, 4, 5])
@pytest.mark.parametrize("rational", [False, True])
def test_places_and_derivatives_are_those_of_the_curve_bit_by_bit(degree: int, rational: bool) -> None:
    rng = np.random.default_rng(degree)
    curve = curve_of(degree, rng, rng.uniform(0.5, 2.0, 12) if rational else None)
    u = np.concatenate([rng.uniform(size=40), np.unique(curve.knots), [np.nextafter(1.0, 0.0)]])
    for order in range(degree + 2):
        np.testing.assert_array_equal(curve.few_derivatives(u, order), curve.derivatives(u, order))


def test_parameters_beyond_an_open_curve_or_no_number_are_refused_and_of_a_closed_one_they_wrap() -> None:
    rng = np.random.default_rng(1)
    curve = curve_of(3, rng, None)
    for u in (-1e-6, 1 + 1e-6, np.nan):
        with pytest.raises(ValueError, match="outside"):
            curve.few_derivatives([u], 0)
    ring = NurbsCurve.interpolate(rng.normal(size=(9, 2)), closed=True)
    wrapped = np.array([-0.3, 0.7, 1.7, np.nan])
    found = ring.few_derivatives(wrapped, 2)
    np.testing.assert_allclose(found[:, [0, 2]], found[:, [1, 1]], rtol=1e-9, atol=1e-9)
    np.testing.assert_array_equal(found, ring.derivatives(wrapped, 2))
