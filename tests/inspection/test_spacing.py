"""Samples spaced by an accuracy: every error stays below it, and none of the samples is wasted."""

import numpy as np
import pytest

from inspection import Method, NominalError, deviations, discretize
from inspection.spacing import curvature_and_change
from tests.inspection import profiles
from tests.inspection.profiles import curve_of, nominal_of


@pytest.mark.parametrize("method", ["circle", "chord", "pcp", "veaw", "hermite"])
@pytest.mark.parametrize("name", ["P1", "P2", "P3", "ellipse"])
def test_spacing_by_accuracy_keeps_every_error_below_it_and_wastes_no_samples(name: str, method: Method) -> None:
    curve, rng = curve_of(name), np.random.default_rng(31)
    fine = nominal_of(name, 4000)
    u = profiles.inner_parameters(curve, 1500, rng, 5e-3)
    site = np.searchsorted(fine.parameter, u).clip(1, len(fine.parameter) - 2)
    left, right = 0.45 / fine.poles.left_curvature[site], 0.45 / fine.poles.right_curvature[site]
    tenth = 0.1 * float(np.hypot(*np.ptp(fine.points_mm, axis=0)))
    reach = np.where(np.arange(len(u)) % 2, np.minimum(left, tenth), -np.minimum(right, tenth))
    offset = np.concatenate([reach[:500] * rng.uniform(0, 1, 500), np.sign(reach[500:]) * 0.02])
    points = profiles.offset_points(curve, u, offset)
    for accuracy in (1e-2, 1e-4) if method in ("pcp", "veaw") else (1e-3, 1e-5):  # two decades, and no more samples than that needs
        nominal = discretize(curve, accuracy_mm=accuracy, method=method)
        error = np.abs(-deviations(points, nominal, method).deviation_mm - offset)
        assert error.max() <= accuracy, accuracy
        # not far below it either: the worst of so many points shows the spacing that was chosen
        assert error.max() > accuracy / 12, accuracy


@pytest.mark.parametrize(("method", "order"), [("chord", 2), ("circle", 3)])
def test_samples_by_accuracy_are_about_as_many_as_the_bound_needs(method: Method, order: int) -> None:
    # with h^2 = 8 a / |k| for chord and h^3 = 48 a / |k'| for circle the least number is the integral of 1 / h along the curve
    for name in ("P2", "P3", "ellipse"):
        curve = curve_of(name)
        u = np.linspace(*curve.domain, 40_001)
        k, s = curve.curvature(u), curve.station_mm(u)
        for accuracy in (1e-3, 1e-5):
            density = np.sqrt(np.abs(k) / (8 * accuracy)) if order == 2 else np.cbrt(np.abs(np.gradient(k, s)) / (48 * accuracy))
            least = float(np.trapezoid(density, s))
            found = len(discretize(curve, accuracy_mm=accuracy, method=method).parameter)
            assert 0.95 * least < found < 2.0 * least + 40, (name, accuracy)


@pytest.mark.parametrize("accuracy", [0.0, -1e-3, float("nan"), float("inf")])
def test_an_accuracy_that_cannot_be_is_refused(accuracy: float) -> None:
    with pytest.raises(NominalError, match="accuracy"):
        discretize(profiles.p1(), accuracy_mm=accuracy, method="chord")


def test_the_change_of_curvature_of_an_ellipse_has_its_closed_form() -> None:
    a, b = 50.0, 20.0
    curve = profiles.ellipse(a, b)
    u = np.linspace(0.01, 0.99, 101)
    point = curve.point(u)
    t = np.arctan2(point[:, 1] / b, point[:, 0] / a)
    root = np.sqrt((a * np.sin(t)) ** 2 + (b * np.cos(t)) ** 2)
    k, change = curvature_and_change(curve, u)
    assert np.abs(k - a * b / root**3).max() < 1e-12
    assert np.abs(change + 3 * a * b * (a * a - b * b) * np.sin(t) * np.cos(t) / root**6).max() < 1e-11
