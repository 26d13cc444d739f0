"""The work of making a nominal ready, counted instead of timed: it grows no faster than the samples and the pieces of the curve."""

from typing import Any

import numpy as np
import pytest

from inspection import NurbsCurve, discretize, foot_grid
from inspection.voronoi import site_poles
from tests.inspection import profiles

DECADES = (1_000, 10_000, 100_000)


class Work:
    """What was done since `begin`.

    places   : parameters at which the curve was evaluated
    pairs    : pieces held against cells of the grid
    sites    : samples of every Voronoi diagram
    """

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.places, self.pairs, self.sites = 0, 0, list[int]()
        evaluate, keep_near = NurbsCurve.derivatives, foot_grid._keep_near

        def counted_evaluate(curve: NurbsCurve, u: Any, order: int) -> Any:
            self.places += np.size(u)
            return evaluate(curve, u, order)

        def counted_keep_near(pairs: Any, *rest: Any) -> Any:
            self.pairs += len(pairs.cell)
            return keep_near(pairs, *rest)

        def counted_poles(sites_mm: Any, *rest: Any) -> Any:
            self.sites.append(len(sites_mm))
            return site_poles(sites_mm, *rest)

        monkeypatch.setattr(NurbsCurve, "derivatives", counted_evaluate)
        monkeypatch.setattr(foot_grid, "_keep_near", counted_keep_near)
        monkeypatch.setattr("inspection.nominal.site_poles", counted_poles)

    def begin(self) -> None:
        """Count from 0."""
        self.places, self.pairs, self.sites = 0, 0, []


@pytest.fixture
def work(monkeypatch: pytest.MonkeyPatch) -> Work:
    return Work(monkeypatch)


@pytest.mark.parametrize("name", ["P1", "P3", "GOE404"])
def test_the_exact_method_evaluates_the_curve_a_fixed_number_of_times_a_sample_and_has_no_diagram(name: str, work: Work) -> None:
    places, pairs = [], []
    for samples in DECADES:
        curve = profiles.EVERY[name]()
        work.begin()
        made = discretize(curve, samples, step_min=1 / samples)
        assert len(made) == pytest.approx(samples, abs=2)
        assert made.table_for("exact") is None
        assert not work.sites
        places.append(work.places)
        pairs.append(work.pairs)
    first, second = np.diff(places) / np.diff(DECADES)
    assert first == pytest.approx(second, rel=0.01)
    assert second < 12  # the sample, its tangent and its curvature at once, and eight speeds for its station
    assert pairs[0] == pairs[1] == pairs[2] > 0  # the grid hangs on the curve, not on its samples


def test_the_published_methods_have_one_diagram_of_the_samples_however_often_it_is_used(work: Work) -> None:
    made = discretize(profiles.p3(), 3_000, step_min=1 / 3_000)
    for method in ("pcp", "veaw", "circle", "chord", "pcp"):
        assert made.table_for(method) is made.sample_table
    assert made.unmet == 0
    assert work.sites == [3_000]


@pytest.mark.parametrize("name", ["P1", "MH42"])
def test_all_diagrams_of_a_refinement_together_have_a_few_sites_for_every_sample(name: str, work: Work) -> None:
    for step_min in (1e-2, 1e-3, 1e-4):
        work.begin()
        made = discretize(profiles.EVERY[name](), 16, step_min=step_min)
        assert made.poles.angle_deg.shape == (len(made),)  # the diagram of the last samples, if nobody asked for it yet
        assert work.sites[-1] == len(made)
        assert sum(work.sites) <= 5 * len(made)


def test_the_grid_holds_each_piece_against_a_bounded_number_of_cells(work: Work) -> None:
    done = []
    for points in (16, 160, 1_600):
        turn = 2 * np.pi * np.arange(points) / points
        curve = NurbsCurve.interpolate(np.column_stack([50 * np.cos(turn), 20 * np.sin(turn)]), 3, closed=True)
        work.begin()
        made = discretize(curve, 1_000, step_min=1e-3)
        done.append((made.grid.pieces, work.pairs, work.places))
    pieces, pairs, places = (np.array(column, dtype=float) for column in zip(*done, strict=True))
    assert pieces[-1] > 4 * pieces[0]
    assert (pairs / pieces < 1.5 * pairs[0] / pieces[0]).all()
    assert (places < 60 * (pieces + 1_000)).all()
