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


def rectangle(x: tuple[float, float], y: tuple[float, float]) -> Array:
    return np.array([[x[0], y[0]], [x[1], y[0]], [x[1], y[1]], [x[0], y[1]]])


def kinds(found: ChainedSection) -> list[tuple[bool, bool, float]]:
    return [(chain.closed, chain.hole, round(chain.length_mm, 6)) for chain in found.chains]


@pytest.mark.parametrize("turn_deg", [0, 90, 180, 270, 33])
@pytest.mark.parametrize("seed", range(3))
def test_squares_that_touch_at_a_corner_are_two_outer_contours(turn_deg: int, seed: int) -> None:
    turn = np.radians(turn_deg)
    rotation = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    segments = np.concatenate([closed(rectangle((0, 4), (0, 4))), closed(rectangle((4, 5), (-1, 0)))]) @ rotation.T
    found = chain(shuffled(segments, seed))
    assert kinds(found) == [(True, False, 16.0), (True, False, 4.0)]
    assert len(found.branches_mm) == 1
    assert len(found.overlaps_mm) == 0


def test_a_square_that_touches_a_side_of_another_is_outer_outside_and_a_hole_inside() -> None:
    large, beside, within = rectangle((0, 4), (0, 4)), rectangle((4, 5), (1, 2)), rectangle((3, 4), (1, 2))
    assert kinds(chain(np.concatenate([closed(large), closed(beside)]))) == [(True, False, 16.0), (True, False, 4.0)]
    assert kinds(chain(np.concatenate([closed(large), closed(within)]))) == [(True, False, 16.0), (True, True, 4.0)]


@pytest.mark.parametrize(
    ("one", "other"),
    [
        (((0, 4), (0, 4)), ((3, 5), (1, 2))),  # a corner within
        (((0, 4), (0, 4)), ((0.5, 4.5), (1, 2))),  # most of it within
        (((0, 4), (1, 2)), ((1, 2), (0, 3))),  # a cross: no corner lies in the other
        (((0, 4), (0, 4)), ((0, 4), (2, 6))),  # sides on one another
    ],
)
def test_contours_that_overlap_are_told_and_are_no_holes(
    one: tuple[tuple[float, float], tuple[float, float]], other: tuple[tuple[float, float], tuple[float, float]]
) -> None:
    first, second = rectangle(*one), rectangle(*other)
    found = chain(np.concatenate([closed(first), closed(second)]))
    assert [(chain.closed, chain.hole) for chain in found.chains] == [(True, False)] * 2
    assert len(found.overlaps_mm) == 1
    assert np.all(found.overlaps_mm[0] >= np.maximum(first.min(axis=0), second.min(axis=0)))
    assert np.all(found.overlaps_mm[0] <= np.minimum(first.max(axis=0), second.max(axis=0)))


def test_a_small_overlap_of_fine_rings_is_found_and_a_touch_within_rounding_is_none() -> None:
    left = ring(10.0, points=2000)
    for depth, overlaps in ((1e-3, 1), (1e-6, 0), (-1e-3, 0)):
        right = ring(5.0, points=2000, centre=(15.0 - depth, 0.0))
        found = chain(np.concatenate([closed(left), closed(right)]))
        assert [chain.hole for chain in found.chains] == [False, False]
        assert len(found.overlaps_mm) == overlaps


@pytest.mark.parametrize("corner", range(0, 40, 7))
def test_a_ring_touched_by_pins_at_any_of_its_corners_stays_one_ring(corner: int) -> None:
    part = ring(10.0)
    pins = []
    for at in (corner, (corner + 13) % 40):  # two touches cut the ring in two
        pin = ring(2.0, points=12, centre=tuple(1.2 * part[at]))
        pin[int(np.argmin(np.linalg.norm(pin, axis=1)))] = part[at]
        pins.append(pin)
    found = chain(shuffled(np.concatenate([closed(part), *map(closed, pins)]), corner))
    assert [chain.closed for chain in found.chains] == [True] * 3
    assert not any(chain.hole for chain in found.chains)
    assert found.chains[0].length_mm == pytest.approx(40 * 2 * 10 * np.sin(np.pi / 40), abs=1e-9)
    assert len(found.chains[0].section_mm) == 40


def test_a_part_that_touches_the_tube_around_it_at_two_places_keeps_its_outline() -> None:
    tube_in, tube_out = ring(20.0, points=80), ring(22.0, points=80)
    angle = 2 * np.pi * np.arange(60) / 60
    part = np.column_stack([20.0 * np.cos(angle), 6.0 * np.sin(angle)])  # corners 0 and 30 are corners 0 and 40 of the tube
    part[0], part[30] = tube_in[0], tube_in[40]
    found = chain(shuffled(np.concatenate([closed(part), closed(tube_in), closed(tube_out)]), 7))
    lengths = [np.linalg.norm(each - np.roll(each, 1, axis=0), axis=1).sum() for each in (tube_out, tube_in, part)]
    assert [(chain.closed, chain.hole) for chain in found.chains] == [(True, False), (True, True), (True, False)]
    assert [chain.length_mm for chain in found.chains] == pytest.approx(lengths, abs=1e-9)
    assert len(found.branches_mm) == 2


def test_a_ring_with_all_its_corners_on_another_is_told_by_the_middles_of_its_sides() -> None:
    outer = ring(10.0, points=16)
    found = chain(np.concatenate([closed(outer), closed(0.999999 * outer[::4])]))
    assert [chain.hole for chain in found.chains] == [False, True]


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
