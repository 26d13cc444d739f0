"""Certified cells around spline faces against the search of the tree, which looks at every piece that may be closest."""

from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from inspection.kernels.surfaces import PatchTables, project_on_patches
from inspection.kernels.surfaces.layout import CERTAIN, FAR, GRID_LOW, GRID_PER_MM, GUESSED, LISTED, NAMED
from inspection.surface import PatchSurface, SplineFace
from tests.inspection.surface import faces

Array = NDArray[np.float64]

_SIZES = [1e-15, 1e-12, 1e-9, 1e-6, 0.01, 0.1, 0.3, 0.6, 1.0]


def thin_wall() -> list[SplineFace]:
    """Both sides of a bent wall of 0.3 mm, outsides outward."""
    x = np.linspace(0, 40, 7)
    u, v = np.meshgrid(x, x, indexing="ij")
    height = 3 * np.sin(u / 9) * np.cos(v / 11)
    return [faces.through(np.stack([u, v, height], axis=-1)), faces.through(np.stack([v, u, height.T - 0.3], axis=-1))]


SURFACES: dict[str, Callable[[], list[SplineFace]]] = {
    "blade": lambda: [faces.blade()],
    "mould": lambda: [faces.mould()],
    "rational cylinder": lambda: [faces.cylinder()],
    "box": faces.box,
    "thin wall": thin_wall,
}


@cache
def made(name: str) -> PatchSurface:
    """The surface of a name."""
    return PatchSurface(SURFACES[name]())


def beside(surface: PatchSurface, count: int, seed: int) -> Array:
    """Places along the normals, from on the surface to a little beyond the band of cells, and a tenth of them in corners of cells."""
    random = np.random.default_rng(seed)
    places, normals = surface.sample(count)
    off = random.choice(_SIZES, len(places)) * random.uniform(-1, 1, len(places)) * 0.01 * surface.size_mm
    places = places + off[:, None] * normals
    grid = surface._tables.grid
    low, finest = grid[GRID_LOW:GRID_PER_MM], 1 / grid[GRID_PER_MM] / 8
    some = slice(None, None, 10)
    places[some] = low + np.round((places[some] - low) / finest) * finest
    return places


def by_search(tables: PatchTables) -> PatchTables:
    """The same tables without a cell."""
    return tables._replace(blocks=np.zeros(3, dtype=np.int64))


def with_guesses_taken_for_certain(tables: PatchTables) -> PatchTables:
    """The same tables where what is only guessed counts as certified."""
    held = LISTED - tables.cells
    return tables._replace(cells=np.where(tables.cells < FAR, LISTED - (held - held % NAMED + CERTAIN), tables.cells))


def with_wrong_guesses(tables: PatchTables) -> PatchTables:
    """The same tables where each cell that holds a piece names any other one, of which nothing is certain."""
    anything = np.random.default_rng(3).integers(0, len(tables.members), len(tables.cells))
    return tables._replace(cells=np.where(tables.cells < FAR, LISTED - (NAMED * anything + GUESSED), tables.cells).astype(np.int32))


def above_corners(surface: PatchSurface, count: int) -> Array:
    """Places above corners of pieces, where up to four of them are equally near, up to the end of the band of cells."""
    random = np.random.default_rng(4)
    piece, (s, t) = random.integers(0, len(surface._pieces.face), count), random.choice([-0.5, 0.5], (2, count))
    place, along_s, along_t = surface._pieces.at(piece, s, t)
    normal = np.cross(along_s, along_t)
    off = random.choice(_SIZES, count) * random.choice([-1, 1], count) * 0.008 * surface.size_mm
    above: Array = place + (off / np.linalg.norm(normal, axis=1))[:, None] * normal
    return above


def agree(one: Any, other: Any) -> bool:
    """Whether distances are the same but for round-off, and signs and kinds are the same."""
    near = np.isclose(one.distance_mm, other.distance_mm, rtol=1e-12, atol=1e-10)
    sides = (np.sign(one.distance_mm) == np.sign(other.distance_mm)) | (np.abs(other.distance_mm) < 1e-10)
    return bool((near & sides & (one.kind == other.kind)).all())


@pytest.mark.parametrize("name", SURFACES)
def test_what_a_cell_is_certified_for_is_what_the_search_finds(name: str) -> None:
    surface = made(name)
    points = beside(surface, 4000, 5)
    found, searched = (project_on_patches(points, tables, 1) for tables in (surface._tables, by_search(surface._tables)))
    assert agree(found, searched)
    assert (found.foot_mm != searched.foot_mm).any() or name == "box"  # both ways are gone, and planes are met exactly by either


@pytest.mark.parametrize("name", ["blade", "thin wall"])
def test_a_certificate_for_what_is_only_guessed_is_noticed(name: str) -> None:
    surface = made(name)
    points = beside(surface, 4000, 5)
    false = project_on_patches(points, with_guesses_taken_for_certain(surface._tables), 1)
    assert not agree(false, project_on_patches(points, by_search(surface._tables), 1))


@pytest.mark.parametrize("name", SURFACES)
def test_the_search_passes_over_no_piece_with_the_closest_point_wherever_it_begins(name: str) -> None:
    surface = made(name)
    points = np.concatenate([above_corners(surface, 2000), beside(surface, 1000, 6)])
    found, searched = (project_on_patches(points, change(surface._tables), 1) for change in (with_wrong_guesses, by_search))
    near = np.isclose(found.distance_mm, searched.distance_mm, rtol=1e-12, atol=1e-10)
    assert near.all()


def test_places_above_each_other_far_from_zero_have_their_feet_though_these_are_rounded_differently() -> None:
    x = np.linspace(0, 10, 5)
    u, v = np.meshgrid(x, x, indexing="ij")
    surface = PatchSurface([faces.through(np.stack([u, v, u * v / 90], axis=-1) + 1e4)])
    places, normals = surface.sample(1000)
    off = np.resize([0.01, 1e-5], (len(places), 2))
    points = (places[:, None] + off[..., None] * normals[:, None]).reshape(-1, 3)
    found = project_on_patches(points, by_search(surface._tables), 1)
    assert (found.item >= 0).all()
    assert np.abs(found.distance_mm - off.ravel()).max() < 1e-10


def test_no_bit_depends_on_batch_order_or_threads_where_cells_and_search_take_turns() -> None:
    surface = made("blade")
    points = beside(surface, 4000, 8)
    whole = surface.project(points, 1)
    order = np.random.default_rng(9).permutation(len(points))
    mixed = surface.project(points[order], 2)
    np.testing.assert_array_equal(mixed.foot_mm, whole.foot_mm[order])
    np.testing.assert_array_equal(mixed.distance_mm, whole.distance_mm[order])
    parts = [surface.project(part).distance_mm for part in np.array_split(points, 7)]
    np.testing.assert_array_equal(np.concatenate(parts), whole.distance_mm)


def test_most_of_a_smooth_surface_is_certified_and_what_cells_hold_is_bounded() -> None:
    tables = made("mould")._tables
    held = LISTED - tables.cells[tables.cells < FAR]
    assert (held % NAMED == CERTAIN).sum() > 1000
    assert tables.cells.nbytes < 4e6
