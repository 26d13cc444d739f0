"""The least mean square of many points: from a few of them, by passes on all threads, and the same as by whole steps from the start."""

import os
from functools import cache
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from inspection import RigidTransform, discretize, fine, register_fine
from inspection.cloud import Cloud
from inspection.kernels import OutlierLimit, PoseFit, project
from inspection.kernels.outliers import MANY
from tests.inspection import profiles
from tests.inspection.profiles import Array, nominal_of

COUNT = 70_000  # more than one thread is woken for
START = RigidTransform(0.002, np.array([0.06, -0.04]))
NUMBERS = (0.002, 0.06, -0.04)


@cache
def scan(name: str) -> Array:
    """Points with form error, noise, and one in fifty gross."""
    rng, nominal = np.random.default_rng(3), nominal_of(name)
    u = rng.uniform(*nominal.curve.domain, COUNT)
    off = 0.01 * np.sin(10 * np.pi * u) + rng.normal(0, 0.005, COUNT) + (rng.random(COUNT) < 0.02) * rng.normal(0, 0.5, COUNT)
    return profiles.offset_points(nominal.curve, u, off)


def fit_to(name: str, left_out: NDArray[np.bool_] | None = None) -> PoseFit:
    nominal = nominal_of(name)
    marks = np.zeros(0, dtype=np.uint8) if left_out is None else left_out.astype(np.uint8)
    return PoseFit(scan(name), nominal.grid, None, "exact", nominal.outward, 0.0, marks)


@pytest.mark.parametrize("some_left_out", [False, True])
@pytest.mark.parametrize("name", ["P3", "NACA 2412 sharp"])
def test_passes_from_near_by_end_where_whole_steps_end(name: str, some_left_out: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    left_out = np.arange(COUNT) % 7 == 3 if some_left_out else None
    whole = fit_to(name, left_out).settle(NUMBERS, 60)
    near = (whole.pose[0] + 1e-6, whole.pose[1] + 1e-4, whole.pose[2] - 1e-4)
    found = []
    for cores in (1, 2, 5):
        monkeypatch.setattr(os, "cpu_count", lambda cores=cores: cores)
        found.append(fit_to(name, left_out).settle_nearby(near))
    assert found[0] is not None
    assert whole.settled
    assert found[0].settled
    points = scan(name)
    apart = RigidTransform(found[0].pose[0], np.array(found[0].pose[1:])).apply(points)
    apart -= RigidTransform(whole.pose[0], np.array(whole.pose[1:])).apply(points)
    assert np.abs(apart).max() < 1e-12
    assert found[0].mean_square == pytest.approx(whole.mean_square, rel=1e-12)
    assert found[0].covariance == pytest.approx(whole.covariance, rel=1e-8, abs=1e-20)
    for other in found[1:]:  # bit for bit, however many threads there are
        assert other is not None
        assert other.pose == found[0].pose
        assert other.mean_square == found[0].mean_square
        assert np.array_equal(other.covariance, found[0].covariance)


@pytest.mark.parametrize("name", ["P3", "NACA 2412 sharp"])
def test_many_points_are_gone_through_a_few_times_and_give_the_outliers_and_the_pose_of_whole_steps(
    name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    points, nominal = scan(name), nominal_of(name)
    passes: list[int] = []
    once = PoseFit._pass

    def counted(fit: PoseFit, *given: Any) -> Array:
        passes.append(len(fit.weights))
        return once(fit, *given)

    monkeypatch.setattr(PoseFit, "_pass", counted)
    found = register_fine(points, nominal, START, robust=True)
    assert sum(passes) <= 8 * COUNT
    whole = fit_to(name).find_outliers(NUMBERS, OutlierLimit(6.0, 0.0, 1e-6), 40)
    assert np.array_equal(found.outliers, whole.found)
    assert 0.01 < whole.found.mean() < 0.02
    best = fit_to(name, whole.found).settle(NUMBERS, 60)
    there = RigidTransform(best.pose[0], np.array(best.pose[1:])).apply(points)
    assert np.abs(found.nominal_from_section.apply(points) - there).max() < 1e-12


def test_few_points_that_do_not_say_where_all_belong_are_not_followed(monkeypatch: pytest.MonkeyPatch) -> None:
    circle, rng = discretize(profiles.circle(20.0), samples=1000), np.random.default_rng(5)
    angle = np.sort(rng.uniform(0, 2 * np.pi, COUNT))
    points = (20.0 + rng.normal(0, 0.01, COUNT))[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
    asked: list[int] = []
    monkeypatch.setattr(PoseFit, "settle_nearby", lambda *_: asked.append(1))
    start = RigidTransform(0.3, np.array([0.05, 0.02]))
    few = fine._fit_to_few(Cloud(points), circle, "exact", 0.0)
    assert few is not None
    register_fine(points, circle, start)
    assert not asked  # a rotation that noise alone determines: it stays where the start put it


@pytest.mark.parametrize("more", [1, 2])
def test_the_median_of_very_many_points_is_exact(more: int) -> None:
    """A choice of the points in their order would give another limit in another order."""
    nominal, count = nominal_of("P3"), MANY + more
    points = np.repeat(scan("P3"), -(-count // COUNT), axis=0)[:count] + np.random.default_rng(8).normal(0, 0.01, (count, 2))
    fit = PoseFit(points, nominal.grid, None, "exact", nominal.outward, 0.0)
    found = fit.find_outliers(NUMBERS, OutlierLimit(6.0, 0.0, 1e-6), 1)
    moved = RigidTransform(NUMBERS[0], np.array(NUMBERS[1:])).apply(points)
    assert found.limit_mm == pytest.approx(6.0 * np.median(np.abs(project(moved, nominal.grid).distance_mm)), rel=1e-12)
