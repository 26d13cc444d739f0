"""Coarse poses: every direction without a flip, and what cannot be registered at all."""

import tracemalloc
from collections.abc import Callable
from contextlib import suppress

import numpy as np
import pytest
from hypothesis import settings

from inspection import (
    NominalProfile,
    NurbsCurve,
    Registration,
    RegistrationError,
    RigidTransform,
    discretize,
    register,
    register_coarse,
    register_fine,
)
from tests.inspection import profiles
from tests.inspection.best_pose import farthest_mm, optimum
from tests.inspection.profiles import Array, curve_of, measured, nominal_of

FIVE = ("P1", "P2", "P3", "GOE404", "MH42")
MANY_EXAMPLES = 3000  # of `make laws`


@pytest.mark.parametrize("name", FIVE)
def test_rotations_by_every_degree_register_without_a_flip(name: str) -> None:
    """The five profiles take turns at the degrees; `make laws` turns each by all 360."""
    turns = range(360) if settings().max_examples >= MANY_EXAMPLES else range(FIVE.index(name), 360, len(FIVE))
    nominal, truth, rng = nominal_of(name), measured(name, 250, 3), np.random.default_rng(4)
    best, _ = optimum(curve_of(name), truth)
    for degree in turns:
        points = profiles.rotated(truth, float(degree), rng.uniform(-200, 200, 2))
        coarse = register_coarse(points, nominal)
        # a flip puts points tens of millimetres off; a good coarse pose is within one
        assert farthest_mm(coarse.nominal_from_section, points, truth) < 1.0, degree
        if degree % 3 == 0:
            fine = register_fine(points, nominal, coarse)
            assert fine.converged, degree
            assert fine.iterations <= 6, degree
            assert farthest_mm(fine.nominal_from_section, points, best) < 1e-9, degree
        if degree % 12 == 0:
            assert farthest_mm(register(points, nominal).nominal_from_section, points, best) < 1e-9, degree


@pytest.mark.parametrize("ratio", [1e3, 1e5, 1e7])
def test_a_scan_far_larger_than_the_nominal_costs_no_memory(ratio: float) -> None:
    """The nominal is a ten-thousandth of P1, so that no point lies where no part can be."""
    curve = profiles.p1()
    nominal = discretize(NurbsCurve(curve.degree, 1e-4 * curve.control_points_mm, curve.knots, curve.weights, closed=curve.closed))
    points = 1e-4 * ratio * measured("P1", 250, 3)
    points[1::2] *= -1.0  # to and fro
    tracemalloc.start()
    with suppress(RegistrationError):
        register_coarse(points, nominal)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 30e6


@pytest.mark.parametrize("registration", [register, register_coarse])
def test_points_where_no_part_can_be_are_refused_at_once(registration: Callable[[Array, NominalProfile], Registration]) -> None:
    points = measured("P1", 250, 3)
    points[6, 1] = -1.5e6
    with pytest.raises(ValueError, match=r"point 7 lies beyond 1e\+06 mm, where no part is"):
        registration(points, nominal_of("P1"))


CANNOT_BE: dict[str, tuple[Array, str]] = {
    "none": (np.empty((0, 2)), "0 points: a registration needs at least 8"),
    "one": (np.ones((1, 2)), "1 points: a registration needs at least 8"),
    "seven": (np.random.default_rng(16).normal(0, 9, (7, 2)), "7 points: a registration needs at least 8"),
    "one place": (np.full((50, 2), 3.0), r"all 50 points coincide at \(3, 3\)"),
}


@pytest.mark.parametrize("registration", [register, register_coarse])
@pytest.mark.parametrize("case", CANNOT_BE)
def test_points_that_cannot_be_registered_are_refused(registration: Callable[[Array, NominalProfile], Registration], case: str) -> None:
    points, message = CANNOT_BE[case]
    with pytest.raises(RegistrationError, match=message):
        registration(points, nominal_of("P1"))


def test_points_that_are_not_numbers_are_refused() -> None:
    points = measured("P1", 50, 17)
    points[7, 1] = np.nan
    for registration in (register, register_coarse):
        with pytest.raises(ValueError, match="point 8 is not finite"):
            registration(points, nominal_of("P1"))
    with pytest.raises(ValueError, match="point 8 is not finite"):
        register_fine(points, nominal_of("P1"), RigidTransform.identity())


@pytest.mark.parametrize("name", ["ellipse", "stadium", "P3"])
def test_a_coarse_pose_does_not_depend_on_how_many_heads_take_turns(name: str) -> None:
    """Of three heads that take turns, every third point is of one: a score of every so many points would look at a part of the profile."""
    nominal, heads = nominal_of(name), np.arange(1599).reshape(3, -1).T.ravel()
    rng = np.random.default_rng(0)
    u = np.sort(rng.uniform(*nominal.curve.domain, 1599))
    form = 0.1 * np.sin(6 * np.pi * (u - u[0]) / (u[-1] - u[0]))
    points = profiles.rotated(profiles.offset_points(nominal.curve, u, form + rng.normal(0, 0.05, 1599)), 33.0, (5.0, 7.0))
    orders = (np.arange(1599), heads, np.roll(heads, 1), np.roll(heads, 2))
    poses = [register_coarse(points[order], nominal).nominal_from_section for order in orders]
    assert len({(pose.rotation_rad, *pose.translation_mm.tolist()) for pose in poses}) == 1
