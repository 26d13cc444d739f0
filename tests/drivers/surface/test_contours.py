"""Chaining against polygons known beforehand, cut into segments, shuffled and turned."""

import numpy as np
import pytest
from numpy.typing import NDArray

from drivers.surface.contours import ChainedSection, chain_sections

Array = NDArray[np.float64]


def ring(radius: float, points: int = 40, centre: tuple[float, float] = (0.0, 0.0)) -> Array:
    angle = 2 * np.pi * np.arange(points) / points
    return np.array(centre) + radius * np.column_stack([np.cos(angle), np.sin(angle)])


def closed(points: Array) -> Array:
    return np.stack([points, np.roll(points, -1, axis=0)], axis=1)


def line(points: Array) -> Array:
    return np.stack([points[:-1], points[1:]], axis=1)


def shuffled(segments: Array, seed: int) -> Array:
    rng = np.random.default_rng(seed)
    segments = rng.permutation(segments)
    turned = rng.random(len(segments)) < 0.5
    return np.where(turned[:, None, None], segments[:, ::-1], segments)


def chain(segments: Array, weld_mm: float = 1e-6, shortest_mm: float | None = None) -> ChainedSection:
    return chain_sections(segments, np.zeros(len(segments), dtype=np.intp), 1, weld_mm, shortest_mm)[0]


@pytest.mark.parametrize("seed", range(5))
def test_a_shuffled_ring_comes_out_in_order(seed: int) -> None:
    points = ring(10.0)
    (found,) = chain(shuffled(closed(points), seed)).chains
    assert found.closed
    assert not found.hole
    assert np.array_equal(found.section_mm, points)  # counter-clockwise, from the largest x
    assert found.length_mm == pytest.approx(40 * 2 * 10 * np.sin(np.pi / 40), abs=1e-12)


def test_an_open_line_stays_open() -> None:
    points = ring(10.0)[:30]
    (found,) = chain(shuffled(line(points), 1)).chains
    assert not found.closed
    assert np.array_equal(found.section_mm, points)


def test_a_gap_a_little_wider_than_the_weld_is_not_closed_and_a_narrower_one_is() -> None:
    points = np.concatenate([ring(10.0), [[10.0, -3e-6]]])
    assert not chain(line(points)).chains[0].closed
    (mended,) = chain(line(points), weld_mm=1e-5).chains
    assert mended.closed
    assert len(mended.section_mm) == 40


@pytest.mark.parametrize("shift", [0.0, 0.3e-6, 0.49e-6, 0.5e-6, 0.9e-6])
def test_ends_within_the_weld_are_one_wherever_the_grid_of_cells_lies(shift: float) -> None:
    points = ring(10.0) + shift
    segments = closed(points)
    segments[:, 1] += 0.6e-6  # every end is that far from the next segment's start, in x and in y
    (found,) = chain(segments).chains
    assert found.closed


def test_holes_are_told_from_outer_contours_at_any_depth() -> None:
    rings = [ring(r) for r in (40.0, 30.0, 20.0, 10.0)] + [ring(5.0, centre=(100.0, 0.0))]
    chains = chain(shuffled(np.concatenate([closed(points) for points in rings]), 2)).chains
    assert [chain.hole for chain in chains] == [False, True, False, True, False]
    for found, points in zip(chains, rings, strict=True):
        x, y = found.section_mm.T
        area = 0.5 * np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y)
        assert (area < 0) == found.hole
        assert {tuple(p) for p in found.section_mm} == {tuple(p) for p in points}


def test_pieces_below_the_limit_are_set_aside_and_counted() -> None:
    dust = [ring(0.1, centre=(20.0 + k, 0.0)) for k in range(3)]
    speck = line(ring(0.05, centre=(-20.0, 0.0))[:10])
    segments = np.concatenate([closed(ring(10.0)), *map(closed, dust), speck])
    found = chain(shuffled(segments, 3))
    assert len(found.chains) == 1
    assert len(found.set_aside_mm) == 4
    assert found.set_aside_open == 1
    assert found.set_aside_mm[:3] == pytest.approx(40 * 2 * 0.1 * np.sin(np.pi / 40))
    assert len(chain(segments, shortest_mm=0.5).chains) == 4
    assert len(chain(segments, shortest_mm=0.0).chains) == 5


def test_a_branch_is_reported_with_its_place_and_cuts_the_chain() -> None:
    whisker = np.array([[0.0, 10.0], [0.0, 14.0], [0.0, 18.0]])
    points = ring(10.0)
    points[10] = [0.0, 10.0]
    found = chain(shuffled(np.concatenate([closed(points), line(whisker)]), 4))
    assert found.branches_mm.tolist() == [[0.0, 10.0]]
    lengths = [chain.length_mm for chain in found.chains]
    assert [chain.closed for chain in found.chains] == [True, False]
    assert lengths[0] == pytest.approx(62.767, abs=1e-3)
    assert lengths[1] == pytest.approx(8.0)


def test_two_rings_that_touch_are_two_rings_and_a_reported_place() -> None:
    left, right = ring(10.0, centre=(-10.0, 0.0)), ring(10.0, centre=(10.0, 0.0))
    left[0] = right[20] = [0.0, 0.0]
    found = chain(shuffled(np.concatenate([closed(left), closed(right)]), 5))
    assert found.branches_mm.tolist() == [[0.0, 0.0]]
    assert [chain.closed for chain in found.chains] == [True, True]


def test_repeated_segments_count_once_and_are_told() -> None:
    segments = closed(ring(10.0))
    found = chain(np.concatenate([segments, segments[5:8], segments[5:6, ::-1]]))
    assert found.repeated == 4
    assert found.chains[0].closed
    assert len(found.branches_mm) == 0


def test_a_lone_segment_given_twice_is_no_closed_contour() -> None:
    segment = np.array([[[0.0, 0.0], [5.0, 0.0]]])
    found = chain(np.concatenate([segment, segment[:, ::-1]]))
    assert found.repeated == 1
    assert [(c.closed, c.length_mm) for c in found.chains] == [(False, 5.0)]


def test_segments_shorter_than_the_weld_vanish() -> None:
    points = np.insert(ring(10.0), 7, ring(10.0)[7] + 1e-8, axis=0)
    found = chain(closed(points))
    assert found.zero_length == 1
    assert len(found.chains[0].section_mm) == 40


def test_sections_are_kept_apart_and_do_not_depend_on_each_other() -> None:
    rings = [ring(10.0 + k % 3, points=40 + k) for k in range(30)]  # many lie on one another
    segments = np.concatenate([closed(points) for points in rings])
    plane = np.repeat(np.arange(30), [len(points) for points in rings])
    order = np.random.default_rng(6).permutation(len(segments))
    together = chain_sections(segments[order], plane[order], 31, 1e-6, None)
    for found, points in zip(together[:30], rings, strict=True):
        assert np.array_equal(found.chains[0].section_mm, points)
    assert together[30].chains == ()


def test_no_segments_make_no_chains() -> None:
    found = chain(np.empty((0, 2, 2)))
    assert found.chains == ()
    assert len(found.set_aside_mm) == 0
