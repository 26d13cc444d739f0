"""The grid from place to piece: what its cells claim is held against the independent closest point."""

import numpy as np
import pytest

from inspection import NurbsCurve
from inspection.curve_pieces import cut_into_pieces
from inspection.foot_grid import FootGrid, build_foot_grid
from inspection.kernels import layout
from tests.inspection import profiles
from tests.inspection.oracle import closest_point
from tests.inspection.profiles import Array, curve_of


def cell_contents(grid: FootGrid, places: Array) -> Array:
    """What the cell of each place (m, 2) holds, looked up in the tables by plain numpy; FAR outside the grid."""
    reals, integers = grid.reals, grid.integers.astype(np.int64)
    across = integers[layout.BLOCKS_ACROSS]
    position = (places - reals[[layout.ORIGIN_X, layout.ORIGIN_Y]]) * reals[layout.BLOCKS_PER_MM]
    inside = ((position >= 0) & (position < across)).all(axis=1)
    x, y = np.where(inside[:, None], position, 0.0).T
    block = integers[integers[layout.BLOCKS_AT] :][y.astype(int) * across + x.astype(int)]
    depth = block & ((1 << layout.BLOCK_DEPTH) - 1)
    column, row = ((x % 1) * 2.0**depth).astype(int), ((y % 1) * 2.0**depth).astype(int)
    known = inside & (block >= 0)
    cell = np.where(known, (block >> layout.BLOCK_DEPTH) + (row << depth) + column, 0)
    return np.where(known, integers[integers[layout.CELLS_AT] :][cell], layout.FAR)


def places_around(name: str, count: int) -> Array:
    """Places near the curve, at its ends and corners, about its centres of curvature, and anywhere in and around its box."""
    curve, rng = curve_of(name), np.random.default_rng(51)
    dense = curve.point(np.linspace(*curve.domain, 2001))
    taboo = curve.point(np.concatenate([curve.domain, curve.corners]))
    near = dense[rng.integers(0, len(dense), 2 * count)] + rng.normal(0, 1, (2 * count, 2)) * rng.choice([0.05, 1.0, 4.0], (2 * count, 1))
    at_ends = taboo[rng.integers(0, len(taboo), count)] + rng.normal(0, 0.5, (count, 2))
    u = np.linspace(*curve.domain, 20_001)
    u = u[np.abs(curve.curvature(u)) > 1 / 30.0]  # where the centre is near enough to be met
    u = u[rng.integers(0, len(u), count if len(u) else 0)]
    centres = profiles.offset_points(curve, u, rng.uniform(0.9, 1.6, len(u)) / curve.curvature(u))
    return np.vstack([near, at_ends, centres, rng.uniform(dense.min(axis=0) - 12, dense.max(axis=0) + 12, (count, 2))])


class Neighbourhood:
    """Pieces with the ones before and after them, which are the only places where a foot is accepted without a search."""

    def __init__(self, curve: NurbsCurve) -> None:
        self.curve, self.pieces, self.samples = curve, cut_into_pieces(curve), dict[int, Array]()
        rows = self.pieces.rows
        self.first = rows[:, layout.PIECE_U] + rows[:, layout.PIECE_U_PER_T] * rows[:, layout.PIECE_FIRST]
        self.last = rows[:, layout.PIECE_U] + rows[:, layout.PIECE_U_PER_T] * rows[:, layout.PIECE_LAST]

    def of(self, piece: int) -> list[int]:
        return [p for p in (piece, int(self.pieces.before[piece]), int(self.pieces.after[piece])) if p >= 0]

    def holds(self, piece: int, u: float) -> bool:
        """Whether the parameter lies on the piece or beside it."""
        start, end = self.curve.domain
        grain, period = 1e-9 * (end - start), (end - start if self.curve.closed else 0.0)
        return any(self.first[p] - grain <= v <= self.last[p] + grain for p in self.of(piece) for v in (u, u - period, u + period))

    def has_foot(self, piece: int, place: Array) -> bool:
        """Whether the distance of the place has a local minimum on the piece or beside it, a vertex included."""
        for p in self.of(piece):
            if p not in self.samples:
                self.samples[p] = self.curve.derivatives(np.clip(np.linspace(self.first[p], self.last[p], 200), *self.curve.domain), 1)
            point, velocity = self.samples[p]
            along = ((point - place) * velocity).sum(axis=1)
            ends_first, ends_last = self.pieces.before[p] < 0 and along[0] >= 0, self.pieces.after[p] < 0 and along[-1] <= 0
            if ends_first or ends_last or ((along[:-1] < 0) & (along[1:] >= 0)).any():
                return True
        return False


@pytest.mark.parametrize("name", profiles.EVERY)
def test_a_cell_names_where_the_closest_point_lies_or_a_search_is_made(name: str) -> None:
    # A foot on a named piece or beside it is taken without a search; where a named piece has none the whole curve is searched.
    curve = curve_of(name)
    grid, near, places = build_foot_grid(curve), Neighbourhood(curve), places_around(name, 50)
    lists = grid.integers[grid.integers[layout.LISTS_AT] :]
    truth, directly, claimed = closest_point(curve, places), 0, 0
    for place, held, u, gap in zip(places, cell_contents(grid, places).tolist(), truth.parameter.tolist(), truth.gap_mm, strict=True):
        if held == layout.FAR or gap < 1e-9:  # nothing is claimed, or two places of the curve are equally close
            continue
        claimed += 1
        named = [held] if held >= 0 else lists[layout.LISTED - held + 1 :][: lists[layout.LISTED - held]].tolist()
        found = any(near.holds(piece, u) for piece in named)
        assert found or not all(near.has_foot(piece, place) for piece in named), (u, held)
        directly += found
    assert claimed > 0.5 * len(places)
    assert directly > 0.9 * claimed


def test_a_grid_is_the_same_every_time_and_cannot_be_changed() -> None:
    first, second = build_foot_grid(profiles.p3()), build_foot_grid(profiles.p3())
    assert np.array_equal(first.reals, second.reals)
    assert np.array_equal(first.integers, second.integers)
    assert (first.pieces, first.cells, first.band_mm) == (second.pieces, second.cells, second.band_mm)
    assert first.pieces == len(cut_into_pieces(profiles.p3()))
    for array in (first.reals, first.integers):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0


@pytest.mark.parametrize("name", ["P1", "P3", "NACA 2412 sharp"])
def test_the_band_around_the_curve_is_covered(name: str) -> None:
    curve, grid, rng = curve_of(name), build_foot_grid(curve_of(name)), np.random.default_rng(52)
    u = profiles.inner_parameters(curve, 2000, rng)
    near = profiles.offset_points(curve, u, rng.uniform(-0.01, 0.01, len(u)) * grid.band_mm)
    assert (cell_contents(grid, near) != layout.FAR).mean() > 0.995
    off = profiles.offset_points(curve, u, rng.choice([-1.0, 1.0], len(u)) * rng.uniform(0, 1, len(u)) * grid.band_mm)
    assert (cell_contents(grid, off) != layout.FAR).mean() > 0.9
