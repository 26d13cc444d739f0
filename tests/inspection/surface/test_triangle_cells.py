"""The certificate of cells: what their lists leave out is never the closest. The oracle is the search of the whole tree, bit for bit."""

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from inspection.kernels.surfaces import TriangleTables, project_on_triangles
from inspection.kernels.surfaces.layout import FAR, GRID_LOW, GRID_PER_MM, LANES, LISTED, MOST_LISTED
from inspection.surface import TriangleSurface
from tests.inspection.surface import meshes

Array = NDArray[np.float64]


def bumpy(cuts: int, bump_mm: float, seed: int) -> Array:
    """A closed mesh of a sphere whose corners lie off it by lot: ridges, hollows and saddle corners everywhere."""
    loose = meshes.sphere(cuts)
    places, of = np.unique(np.round(loose.reshape(-1, 3), 9), axis=0, return_inverse=True)
    length = np.linalg.norm(places, axis=1, keepdims=True)
    moved = places * (1 + np.random.default_rng(seed).uniform(-bump_mm, bump_mm, (len(places), 1)) / length)
    return np.asarray(moved[of.ravel()].reshape(-1, 3, 3))


MESHES = {
    "smooth": meshes.sphere(40),
    "a little bumpy": bumpy(40, 0.05, 1),
    "very bumpy": bumpy(24, 3.0, 2),
    "open": meshes.wave(50),
    "edges and hollows": meshes.prism(meshes.NOTCHED, 2.0),
    "thin wall": meshes.prism(meshes.NOTCHED, 0.01),
    "slivers": meshes.wave(40) * np.array([1.0, 1e-4, 1.0]),
}


def beside(triangles: Array, count: int, off_mm: float, seed: int) -> Array:
    """Points within a distance of places inside, on edges and at corners of triangles."""
    rng = np.random.default_rng(seed)
    weights = rng.dirichlet((0.5, 0.5, 0.5), count)
    weights[: count // 4, 0], weights[: count // 8, 1] = 0.0, 0.0
    weights /= weights.sum(axis=1, keepdims=True)
    places = np.einsum("mi,mid->md", weights, triangles[rng.integers(len(triangles), size=count)])
    away = rng.normal(size=(count, 3))
    return np.asarray(places + away / np.linalg.norm(away, axis=1)[:, None] * rng.uniform(0, off_mm, (count, 1)))


def to_corners_of_cells(points: Array, tables: TriangleTables) -> Array:
    """The corners of the finest cells nearest to points, just within one of the cells: they lie farthest from its middle."""
    finest = 1 / (8 * tables.grid[GRID_PER_MM])
    steps = np.round((points - tables.grid[GRID_LOW : GRID_LOW + 3]) / finest)
    return np.asarray(
        tables.grid[GRID_LOW : GRID_LOW + 3] + (steps + np.random.default_rng(6).choice((-1e-9, 1e-9), points.shape)) * finest
    )


def list_length(tables: TriangleTables, point: Array) -> int:
    """How many clusters the cell of a place lists; 0 where it has no list."""
    share = (point - tables.grid[GRID_LOW : GRID_LOW + 3]) * tables.grid[GRID_PER_MM]
    if (share < 0).any() or (share >= tables.blocks).any():
        return 0
    at = share.astype(np.int64)
    content = int(tables.cells[(at[0] * tables.blocks[1] + at[1]) * tables.blocks[2] + at[2]])
    while content >= 0:
        share = 2 * (share - at)
        at = share.astype(np.int64)
        content = int(tables.cells[content + 4 * at[0] + 2 * at[1] + at[2]])
    return 0 if content == FAR else int(tables.lists[LISTED - content])


def rows(tables: TriangleTables, points: Array) -> tuple[NDArray[Any], ...]:
    return tuple(project_on_triangles(points, tables, 1))


@pytest.mark.parametrize("name", MESHES)
def test_a_list_holds_the_closest_triangle_of_every_place_in_its_cell(name: str) -> None:
    triangles = MESHES[name]
    surface = TriangleSurface(triangles)
    tables = surface._tables
    points = beside(triangles, 20_000, 0.01 * surface.size_mm, 3)
    points[::2] = to_corners_of_cells(points[::2], tables)
    searched = tables._replace(cells=np.full_like(tables.cells, FAR))
    for found, wanted in zip(rows(tables, points), rows(searched, points), strict=True):
        assert np.array_equal(found, wanted)
    lengths = np.array([list_length(tables, point) for point in points[::100]])
    assert lengths.max() <= MOST_LISTED
    assert (lengths > 0).mean() > 0.5  # else nothing is proven


def test_lists_are_short_where_a_surface_is_smooth_and_cells_end_where_its_band_does() -> None:
    surface = TriangleSurface(MESHES["smooth"])
    tables = surface._tables
    direction = np.random.default_rng(4).normal(size=(300, 3))
    direction /= np.linalg.norm(direction, axis=1)[:, None]
    direction = direction[np.abs(direction[:, 2]) < 0.95]  # the poles are fans
    near = np.array([list_length(tables, point) for point in direction * 30.2])
    assert (near > 0).all()
    assert near.mean() < 7
    assert not any(list_length(tables, point) for point in direction * 40.0)
    assert not any(list_length(tables, point) for point in direction * 10.0)


def test_where_lists_have_no_room_the_tree_is_searched(monkeypatch: pytest.MonkeyPatch) -> None:
    triangles = MESHES["a little bumpy"]
    points = beside(triangles, 3000, 0.3, 5)
    whole = rows(TriangleSurface(triangles)._tables, points)
    monkeypatch.setattr("inspection.surface.triangle_cells._ROOM", 0)
    monkeypatch.setattr("inspection.surface.triangle_cells._LEAST_ROOM", 500)
    cramped = TriangleSurface(triangles)._tables
    assert len(cramped.lists) <= 500
    for found, wanted in zip(rows(cramped, points), whole, strict=True):
        assert np.array_equal(found, wanted)


def test_what_is_held_of_a_triangle_is_bounded() -> None:
    surface = TriangleSurface(meshes.wave(180))
    held = sum(table.nbytes for table in surface._tables if isinstance(table, np.ndarray))
    assert held / len(surface) < 200  # few triangles have many cells
    assert len(surface._tables.planes) * 4 == -(-len(surface) // LANES) * LANES * 64
