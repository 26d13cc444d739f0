"""The contour that stands for a scan: whatever the order and the density of its points."""

import numpy as np
import pytest

from inspection import contour_order
from inspection.contour_order import Contour, trace_contour
from tests.inspection import profiles
from tests.inspection.profiles import Array, curve_of


def trace(points: Array, step_mm: float) -> Contour:
    return trace_contour(lambda: [points], step_mm)


@pytest.mark.parametrize("name", ["P1", "P3", "GOE404"])
def test_the_contour_does_not_depend_on_order_and_repetition(name: str) -> None:
    curve, rng = curve_of(name), np.random.default_rng(1)
    points = curve.point(profiles.even_in_arc_length(curve, 800))
    step = curve.length_mm / 400
    first = trace(points, step)
    for other in (points[::-1], rng.permutation(points), rng.permutation(np.concatenate([points, points]))):
        again = trace(other, step)
        assert np.abs(again.points_mm - first.points_mm).max() < 1e-8 * step
        assert (again.walk == first.walk).all()


def test_the_walk_follows_the_contour() -> None:
    """An open curve: its walk visits the stations in rising or falling order, from end to end."""
    curve = curve_of("P1")
    points = np.random.default_rng(2).permutation(curve.point(profiles.even_in_arc_length(curve, 900)))
    walk = trace(points, curve.length_mm / 300).walk_mm
    dense = curve.point(np.linspace(*curve.domain, 20_001))
    nearest = np.array([((dense - place) ** 2).sum(axis=1).argmin() for place in walk])
    assert (np.diff(nearest) > 0).all() or (np.diff(nearest) < 0).all()
    assert abs(nearest[-1] - nearest[0]) > 19_900


def test_weights_are_the_length_that_each_place_stands_for() -> None:
    curve = curve_of("P3")
    contour = trace(curve.point(profiles.even_in_arc_length(curve, 2000)), curve.length_mm / 500)
    assert contour.weights_mm.sum() == pytest.approx(curve.length_mm, rel=0.01)


@pytest.mark.parametrize("count", [1, 2, 3, 50])
def test_points_on_a_line_have_a_walk(count: int) -> None:
    points = np.column_stack([np.linspace(0, 10, count), np.linspace(0, 5, count)])
    contour = trace(np.random.default_rng(3).permutation(points), 0.01)
    assert len(contour.walk) == count
    assert (np.diff(contour.walk_mm[:, 0]) > 0).all() or (np.diff(contour.walk_mm[:, 0]) < 0).all()


@pytest.mark.parametrize("name", ["P1", "P3", "GOE404"])
@pytest.mark.parametrize("noise_mm", [1e-6, 0.05])
def test_a_tree_that_grew_is_that_of_the_triangulation(name: str, noise_mm: float, monkeypatch: pytest.MonkeyPatch) -> None:
    """To the last bit: weights, the walk and its direction."""
    curve, rng = curve_of(name), np.random.default_rng(7)
    points = curve.point(profiles.even_in_arc_length(curve, 1500))
    points += rng.normal(0, noise_mm, points.shape)
    triangulated: list[int] = []
    of_neighbours = contour_order._tree_of_neighbours

    def note(means: Array, lie_on_line: bool) -> contour_order._Tree:
        triangulated.append(len(means))
        return of_neighbours(means, lie_on_line)

    monkeypatch.setattr(contour_order, "_tree_of_neighbours", note)
    grown = trace(points, curve.length_mm / 700)
    assert not triangulated
    monkeypatch.setattr(contour_order, "_FEW", 0)
    other = trace(points, curve.length_mm / 700)
    assert triangulated
    assert (grown.weights_mm == other.weights_mm).all()
    assert (grown.walk == other.walk).all()
