"""Which libraries put points on the wrong side of a mesh: of a closed blade, and of its open shell away from the borders.

The truth is the winding number of the closed blade about each point, a sum over all of its triangles that knows neither closest points nor
normals. Half of the points lie beside faces, half beside the blade's two edges, up to a millimetre off, and none within 5 mm of the shell's
borders, so that both meshes have one truth. So coarse a mesh makes of the round edges sharp ones, at which signs go wrong.
"""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from inspection.surface import SplineFace, TriangleSurface
from tests.benchmarks.surface_rivals import LeftOut, Way, ways_on_mesh
from tests.inspection.surface.meshes import triangles_of_grid

Array = NDArray[np.float64]
ALONG, AROUND = 64, 24  # cells of the blade, two triangles each
REACH_MM, FROM_BORDER_MM = 1.0, 5.0
ROUNDED_MM = 1e-4  # single precision tells a part of 150 mm to 8e-6
_AT_ONCE = 2_000_000  # pairs of points and triangles


def closed_and_open(face: SplineFace) -> tuple[Array, Array, Array]:
    """Triangles (n, 3, 3) of a blade with caps over its two ends, and of its shell without them; its two edges (k, 2, 3)."""
    grid = face.on_grid(np.linspace(0, 1, AROUND + 1), np.linspace(0, 1, ALONG + 1), 0)[0, 0]
    grid[-1] = grid[0]
    shell = triangles_of_grid(grid)[:, ::-1]
    root, tip = _cap(grid[:, 0]), _cap(grid[:, -1])[:, ::-1]
    lines = grid[[0, AROUND // 2]]
    edges = np.stack([lines[:, :-1], lines[:, 1:]], axis=2).reshape(-1, 2, 3)
    return np.concatenate([shell, root, tip]), shell, edges


def _cap(ring: Array) -> Array:
    """Triangles between the two sides of a section (k, 3), which meet at its first place and at the middle one."""
    half = len(ring) // 2
    one, other = ring[: half + 1], ring[: half - 1 : -1]
    strip = triangles_of_grid(np.stack([one, other], axis=1))
    return strip[_areas(strip) > 0]  # one of the two at either end is none


def _areas(triangles: Array) -> Array:
    a, b, c = triangles.swapaxes(0, 1)
    return np.asarray(np.linalg.norm(np.cross(b - a, c - a), axis=1)) / 2


def points_beside(shell: Array, edges: Array, count: int) -> Array:
    """Points (about `count`, 3) beside the faces (n, 3, 3) and the edges (k, 2, 3) of a shell that stands along z, in turn."""
    rng = np.random.default_rng(21)
    faces = shell[rng.choice(len(shell), count, p=_areas(shell) / _areas(shell).sum())]
    beside_faces = np.einsum("mk,mkd->md", rng.dirichlet((1, 1, 1), count), faces)
    beside_edges = np.einsum("mk,mkd->md", rng.dirichlet((1, 1), count), edges[rng.integers(0, len(edges), count)])
    places = np.stack([beside_faces, beside_edges], axis=1).reshape(-1, 3)
    off = rng.normal(size=places.shape)
    off *= (rng.uniform(0, REACH_MM, len(places)) / np.linalg.norm(off, axis=1))[:, None]
    points = places + off
    low, high = shell[..., 2].min() + FROM_BORDER_MM, shell[..., 2].max() - FROM_BORDER_MM
    return np.asarray(points[(points[:, 2] > low) & (points[:, 2] < high)][:count])


def winding_numbers(points: Array, triangles: Array) -> Array:
    """How often a mesh goes round each point, (m,): 1 inside a closed one, 0 outside (Van Oosterom and Strackee, 1983)."""
    step = max(1, _AT_ONCE // len(triangles))
    return np.concatenate([_winding_numbers(points[i : i + step], triangles) for i in range(0, len(points), step)])


def _winding_numbers(points: Array, triangles: Array) -> Array:
    a, b, c = ([triangles[None, :, corner, axis] - points[:, None, axis] for axis in range(3)] for corner in range(3))
    size = [np.sqrt(v[0] ** 2 + v[1] ** 2 + v[2] ** 2) for v in (a, b, c)]
    volume = a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) + a[2] * (b[0] * c[1] - b[1] * c[0])
    flat = size[0] * size[1] * size[2]
    for one, other, third in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        p, q = (a, b, c)[one], (a, b, c)[other]
        flat += (p[0] * q[0] + p[1] * q[1] + p[2] * q[2]) * size[third]
    return np.asarray(np.arctan2(volume, flat).sum(axis=1)) / (2 * np.pi)


def wrong_signs(face: SplineFace, count: int) -> Iterator[str]:
    """A table of what each way gets wrong, as lines; then what was left out."""
    closed, shell, edges = closed_and_open(face)
    points = points_beside(shell, edges, count)
    winding = winding_numbers(points, closed)
    turns = np.rint(winding)
    if not (np.isin(turns, (0, 1)).all() and np.abs(winding - turns).max() < 1e-6):
        raise ArithmeticError("the mesh is not closed, or not turned outward throughout")
    inside = turns == 1
    yield (
        f"{len(points):,} points, {inside.sum():,} of them inside; the blade of {len(closed):,} triangles is closed, its shell of"
        f" {len(shell):,} open"
    )
    yield ""
    yield "| | wrong of the closed one | the farthest, mm | wrong of the open one | the farthest, mm | of points |"
    yield "|---|---|---|---|---|---|"
    left = list[LeftOut]()
    columns: dict[str, list[str]] = {}
    for triangles in (closed, shell):
        ours = TriangleSurface(triangles)
        rivals, left = ways_on_mesh(triangles, lambda way: way.is_signed)
        for way in (Way("cmmlink", lambda points: ours.project(points).distance_mm), *rivals):  # noqa: B023 (asked within the loop)
            columns.setdefault(way.name, []).extend(_wrong(way, points, inside))
    for name, cells in columns.items():
        yield f"| {name} | {' | '.join(cells[:2] + cells[3:5])} | {cells[2]} |"
    yield from (f"\n{one.words}" for one in left)


def _wrong(way: Way, points: Array, inside: NDArray[np.bool_]) -> tuple[str, str, str]:
    few = points[: way.most]
    found = way.distances(few)
    is_wrong = (found < 0) != inside[: len(few)]
    is_wrong &= ~(np.abs(found) < ROUNDED_MM)
    if not is_wrong.any():
        return "0", "", f"{len(few):,}"
    return f"{is_wrong.sum():,} ({is_wrong.mean():.2%})", f"{np.abs(found[is_wrong]).max():.2g}", f"{len(few):,}"
