"""The stations that feet may come to: points are moved at random, and the foot of every one lies where the reach says."""

from collections.abc import Callable

import numpy as np
import pytest

from inspection import NominalProfile, NurbsCurve, discretize
from inspection.kernels import project
from inspection.reach import StationReach
from tests.inspection import profiles
from tests.inspection.profiles import Array

CURVES: dict[str, Callable[[], NurbsCurve]] = {
    "corners": lambda: profiles.square(20.0),
    "thin and sharp": lambda: profiles.naca("0006"),
    "blunt": lambda: profiles.naca("2412", sharp=False),
    "open": profiles.p1,
    "smooth": profiles.p3,
    "arcs and lines": lambda: profiles.stadium(30.0, 2.0),
}


def walks(nominal: NominalProfile, count: int, near: bool) -> tuple[Array, Array, Array]:
    """Places (count, 2), how far each may move (count,), and where it has moved to."""
    rng = np.random.default_rng(11)
    u = rng.uniform(*nominal.curve.domain, count)
    off = rng.normal(0, 0.05 if near else 5.0, count)
    places = profiles.offset_points(nominal.curve, u, off)
    moves = 10.0 ** rng.uniform(-6, 0 if near else 1.5, count)
    way, far = rng.uniform(0, 2 * np.pi, count), np.sqrt(rng.uniform(0, 1, count))
    far[::2] = 1.0
    return places, moves, places + (moves * far * np.array([np.cos(way), np.sin(way)])).T


@pytest.mark.parametrize("name", CURVES)
@pytest.mark.parametrize("near", [True, False])
def test_no_foot_leaves_its_reach(name: str, near: bool) -> None:
    nominal = discretize(CURVES[name](), samples=500)
    places, moves, moved = walks(nominal, 5_000, near)
    found = StationReach(nominal.curve).stretches(places, project(places, nominal.grid), moves)
    foot = project(moved, nominal.grid).station_mm
    turns = (-1, 0, 1) if nominal.curve.closed else (0,)
    inside = [(foot + turn * nominal.length_mm >= found.from_mm) & (foot + turn * nominal.length_mm <= found.to_mm) for turn in turns]
    assert np.any(inside, axis=0).all()
    if near:  # most of them are told closely: the reach is no more than twice the move and the slack of stations
        width = found.to_mm - found.from_mm
        assert np.mean(width <= 4 * moves + 1e-6 * nominal.length_mm) > 0.3


def test_the_reach_of_a_point_beside_a_thin_end_holds_both_its_sides() -> None:
    """A few millimetres before a sharp tail, where the other side is nearer than a point may move."""
    nominal = discretize(profiles.naca("0006"), samples=500)
    reach, place = StationReach(nominal.curve), nominal.curve.point(np.array([0.02]))
    feet = project(place, nominal.grid)
    wide = reach.stretches(place, feet, np.array([2.0]))
    narrow = reach.stretches(place, feet, np.array([1e-4]))
    assert wide.from_mm[0] < -feet.station_mm[0] < 0 < wide.to_mm[0]
    assert narrow.to_mm[0] - narrow.from_mm[0] < 3e-4
