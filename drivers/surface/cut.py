"""Parallel planes cut a surface into sections, whose contours are one more source of points (contour_source.py).

Triangles that straddle a plane are selected first, in one pass over the file; only those are cut, by Open3D in a process of
its own (so that acquisition in this one never waits for it) or by plain numpy. Both work in the plane's own axes on the same
heights and agree to rounding. A vertex on a plane counts as above it; where whole facets lie in a plane, the plane is moved
by a tiny offset, and the slice says so.
"""

from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, replace
from itertools import pairwise
from math import dist
from typing import Final, Protocol

import numpy as np
from numpy.typing import NDArray

from drivers.errors import MeshError
from drivers.surface.contour_source import Contour, Gap, SurfaceSection
from drivers.surface.contours import ChainedSection, chain_sections
from drivers.surface.section_axes import SectionAxes, axes_of
from drivers.surface.stl_file import SurfaceMesh

WELD_MM: Final = 1e-6
_FEW_PLANES: Final = 8  # up to here one comparison per plane is faster than a search
_BATCH_TRIANGLES: Final = 30_000  # cut and chained at once: some 5 MB, and a step of the progress bar
_NAMED: Final = 5  # places named in one warning


class Cutter(Protocol):
    """What cuts selected triangles."""

    @property
    def name(self) -> str:
        """As the result states it: "numpy", "open3d 0.20.0"."""

    def cut(self, triangles: NDArray[np.float64]) -> NDArray[np.float64]:
        """Cut (t, 3, 3) triangles, in-plane x, y and height above the plane, all straddling it, to (s, 2, 2) segments."""


def cut_surface(
    mesh: SurfaceMesh,
    normal: Sequence[float],
    heights_mm: Sequence[float],
    *,
    cutter: Cutter,
    weld_mm: float = WELD_MM,
    shortest_mm: float | None = None,
    part_mm: float = np.inf,
    workers: int = 2,
) -> Iterator[SurfaceSection]:
    """Cut by the planes of these heights along the unit normal; sections come in the order of the heights.

    `cutter` is a `NumpyCutter` or an `Open3DProcess`. Loose ends within `weld_mm` are one point;
    pieces shorter than `shortest_mm` (None: 5 % of the section's longest, but see `chain_sections` for `part_mm`, the length of the
    part's outline) are set aside and counted.
    Raises `MeshError` for a plane that misses the surface.
    """
    axes = axes_of(normal)
    heights = _check_heights(heights_mm)
    if not weld_mm > 0:
        raise MeshError(f"weld {weld_mm} mm: the welding distance must be positive")
    moved, corners, plane = _select(mesh, axes, heights)
    starts = np.searchsorted(plane, np.arange(len(heights) + 1))

    def cut_batch(batch: tuple[int, int]) -> list[SurfaceSection]:
        first, last = batch
        where = slice(starts[first], starts[last])
        triangles = _to_plane(corners[where], axes, moved[plane[where]])
        segments, of_plane = _cut_each(cutter, triangles, plane[where] - first, last - first)
        chained = chain_sections(segments, of_plane, last - first, weld_mm, shortest_mm, part_mm)
        counts = np.diff(starts[first : last + 1]).tolist()
        levels = zip(heights[first:last].tolist(), moved[first:last].tolist(), counts, strict=True)
        return [_section(each, axes, *level, cutter.name) for each, level in zip(chained, levels, strict=True)]

    yield from _work_ahead(cut_batch, list(_batches(starts)), workers)


def _work_ahead(
    work: Callable[[tuple[int, int]], list[SurfaceSection]], batches: list[tuple[int, int]], workers: int
) -> Iterator[SurfaceSection]:
    """Yield the results in order. `workers` threads compute them, as numpy releases the interpreter; at most twice as many wait."""
    with ThreadPoolExecutor(workers, thread_name_prefix="cut") as pool:
        waiting = deque(_submitted(pool, work, batch) for batch in batches[: 2 * workers])
        for batch in [*batches[2 * workers :], None]:
            for _ in range(1 if batch else len(waiting)):
                yield from waiting.popleft().result()
            if batch:
                waiting.append(_submitted(pool, work, batch))


def _submitted(
    pool: ThreadPoolExecutor, work: Callable[[tuple[int, int]], list[SurfaceSection]], batch: tuple[int, int]
) -> Future[list[SurfaceSection]]:
    try:
        return pool.submit(work, batch)
    except RuntimeError as error:
        raise MeshError(f"the surface cannot be cut: {error}; close other programs") from error


class NumpyCutter:
    """The cut by array operations alone: one segment per triangle, in the triangles' order."""

    name = "numpy"

    def cut(self, triangles: NDArray[np.float64]) -> NDArray[np.float64]:
        """Cut as `Cutter.cut` says.

        Both neighbours interpolate a shared edge from its lower to its upper corner, so they get bit-equal points.
        """
        above = triangles[:, :, 2] >= 0.0
        lone_above = above.sum(axis=1) == 1
        lone = np.argmax(above == lone_above[:, None], axis=1)
        corners, first = triangles.reshape(-1, 3), np.arange(0, 3 * len(triangles), 3)
        apex = np.take(corners, first + lone, axis=0)
        segments = np.empty((len(triangles), 2, 2))
        for end, step in enumerate((1, 2)):
            other = np.take(corners, first + (lone + step) % 3, axis=0)
            low = np.where(lone_above[:, None], other, apex)
            high = np.where(lone_above[:, None], apex, other)
            share = low[:, 2] / (low[:, 2] - high[:, 2])
            segments[:, end] = low[:, :2] + share[:, None] * (high[:, :2] - low[:, :2])
        return segments


def _check_heights(heights_mm: Sequence[float]) -> NDArray[np.float64]:
    heights = np.array(heights_mm, dtype=np.float64)
    if heights.ndim != 1 or not len(heights) or not np.isfinite(heights).all():
        raise MeshError(f"heights {list(heights_mm)}: at least one finite height in mm is needed")
    return heights


def _flatness_mm(mesh: SurfaceMesh) -> float:
    """Return how far rounding to float32 can lift a corner out of the plane of its facet: two spacings of the largest coordinate."""
    largest = np.float32(max(np.abs(mesh.lower_mm).max(), np.abs(mesh.upper_mm).max()))
    return 2.0 * float(np.spacing(largest))


def height_range_mm(mesh: SurfaceMesh, normal: Sequence[float]) -> tuple[float, float]:
    """Return the heights of the lowest and the highest point of the surface along the unit normal, found in one pass."""
    axes = axes_of(normal)
    low, high = np.inf, -np.inf
    for corners in mesh.pieces():
        heights = axes.height_mm(*np.moveaxis(corners, -1, 0))
        low, high = min(low, float(heights.min())), max(high, float(heights.max()))
    return low, high


@dataclass(slots=True)
class _Pass:
    """What one pass over the surface gathers: straddling triangles, and facets lying in a plane."""

    corners: list[NDArray[np.floating]]
    planes: list[NDArray[np.intp]]
    flat: NDArray[np.intp]
    low_mm: float = np.inf
    high_mm: float = -np.inf


def _gather(mesh: SurfaceMesh, axes: SectionAxes, heights: NDArray[np.float64]) -> _Pass:
    """Gather in one pass, for every plane, the triangles with a corner below it and one at or above it."""
    order = np.argsort(heights, kind="stable")
    sorted_heights = heights[order]
    tolerance = _flatness_mm(mesh)
    found = _Pass([], [], np.zeros(len(heights), dtype=np.intp))
    for corners in mesh.pieces():
        low, high = _span(corners, axes)
        found.low_mm, found.high_mm = min(found.low_mm, float(low.min())), max(found.high_mm, float(high.max()))
        triangle, rank = _find_straddling(low, high, sorted_heights)
        found.corners.append(np.take(corners, triangle, axis=0))
        found.planes.append(order[rank])
        level = np.flatnonzero(high - low <= 2.0 * tolerance)
        if len(level):
            _, rank = _find_straddling(np.nextafter(high[level] - tolerance, -np.inf), low[level] + tolerance, sorted_heights)
            found.flat += np.bincount(order[rank], minlength=len(heights))
    return found


def _span(corners: NDArray[np.floating], axes: SectionAxes) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the heights of the lowest and the highest corner of each triangle, (k,) and (k,)."""
    a, b, c = (axes.height_mm(corners[:, at, 0], corners[:, at, 1], corners[:, at, 2]) for at in range(3))
    return np.minimum(np.minimum(a, b), c), np.maximum(np.maximum(a, b), c)


def _find_straddling(
    low: NDArray[np.float64], high: NDArray[np.float64], sorted_heights: NDArray[np.float64]
) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return the triangles and the ranks of the planes, (p,) and (p,), of all pairs with low < height <= high."""
    if len(sorted_heights) <= _FEW_PLANES:
        hits = [np.flatnonzero((low < height) & (high >= height)) for height in sorted_heights]
        return np.concatenate(hits), np.repeat(np.arange(len(hits)), [len(hit) for hit in hits])
    first = np.searchsorted(sorted_heights, low, side="right")
    count = np.maximum(np.searchsorted(sorted_heights, high, side="right") - first, 0)
    triangle = np.flatnonzero(count)
    count = count[triangle]
    within = np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count)
    return np.repeat(triangle, count), np.repeat(first[triangle], count) + within


def _select(
    mesh: SurfaceMesh, axes: SectionAxes, heights: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.floating], NDArray[np.intp]]:
    """Return the heights that are really cut, the straddling triangles (t, 3, 3), and the plane of each (t,), ascending."""
    found = _gather(mesh, axes, heights)
    _refuse_misses(mesh, heights, found)
    moved = heights.copy()
    corners, plane = np.concatenate(found.corners), np.concatenate(found.planes)
    if found.flat.any():
        in_plane = np.flatnonzero(found.flat)
        moved[in_plane] = _move_off_facets(mesh, axes, heights[in_plane])
        again = _gather(mesh, axes, moved[in_plane])
        stay = found.flat[plane] == 0
        corners = np.concatenate([corners[stay], *again.corners])
        plane = np.concatenate([plane[stay], *(in_plane[part] for part in again.planes)])
    # Short integers are sorted by radix, an order of magnitude faster.
    order = np.argsort(plane.astype(np.uint16) if len(heights) < 65_536 else plane, kind="stable")
    return moved, np.take(corners, order, axis=0), plane[order]


def _refuse_misses(mesh: SurfaceMesh, heights: NDArray[np.float64], found: _Pass) -> None:
    tolerance = _flatness_mm(mesh)
    outside = (heights < found.low_mm - tolerance) | (heights > found.high_mm + tolerance)
    if outside.any():
        raise MeshError(
            f"{mesh.source}: the plane at height {heights[outside][0]:g} mm misses the surface, which spans {found.low_mm:.4f} to "
            f"{found.high_mm:.4f} mm along the normal; give a height within (and check the unit of the file)"
        )


def _move_off_facets(mesh: SurfaceMesh, axes: SectionAxes, heights: NDArray[np.float64]) -> NDArray[np.float64]:
    """Move each height by the smallest step that leaves no facet in the plane, up or down, whichever cuts more of the surface."""
    step = max(1e-4, 4.0 * _flatness_mm(mesh))
    tries = heights[:, None, None] + np.array([[1.0, -1.0], [2.0, -2.0], [3.0, -3.0]]) * step
    found = _gather(mesh, axes, tries.ravel())
    cuts = np.bincount(np.concatenate(found.planes), minlength=tries.size).reshape(tries.shape)
    cuts[found.flat.reshape(tries.shape) > 0] = 0
    usable = cuts.max(axis=2) > 0
    stuck = np.flatnonzero(~np.any(usable, axis=1))
    if len(stuck):
        raise MeshError(
            f"{mesh.source}: at height {heights[stuck][0]:g} mm facets lie in the plane, and so they do, or nothing is cut, up to "
            f"{3 * step:g} mm above and below; choose another height"
        )
    row, steps = np.arange(len(heights)), np.argmax(usable, axis=1)
    return np.asarray(tries[row, steps, np.argmax(cuts[row, steps], axis=1)], dtype=np.float64)


def _batches(starts: NDArray[np.intp]) -> Iterator[tuple[int, int]]:
    """Take planes together: as many as make `_BATCH_TRIANGLES`, at least one."""
    first, planes = 0, len(starts) - 1
    while first < planes:
        last = int(np.searchsorted(starts, starts[first] + _BATCH_TRIANGLES, side="right")) - 1
        last = min(max(last, first + 1), planes)
        yield first, last
        first = last


def _to_plane(corners: NDArray[np.floating], axes: SectionAxes, heights: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return corners as in-plane x, y and height above their plane, (t, 3, 3), by the same arithmetic as in the selection."""
    x, y, z = corners[:, :, 0], corners[:, :, 1], corners[:, :, 2]
    local = np.empty(corners.shape)
    local[:, :, :2] = axes.section_mm(corners)
    np.subtract(axes.height_mm(x, y, z), heights[:, None], out=local[:, :, 2])
    return local


def _cut_each(
    cutter: Cutter, triangles: NDArray[np.float64], plane: NDArray[np.intp], planes: int
) -> tuple[NDArray[np.float64], NDArray[np.intp]]:
    """Return segments (s, 2, 2) and the plane of each. numpy keeps one segment a triangle, so it cuts all planes in one go."""
    if isinstance(cutter, NumpyCutter):
        return cutter.cut(triangles), plane
    starts = np.searchsorted(plane, np.arange(planes + 1))
    parts = [cutter.cut(triangles[first:last]) for first, last in pairwise(starts)]
    return np.concatenate(parts), np.repeat(np.arange(planes), [len(part) for part in parts])


def _section(chained: ChainedSection, axes: SectionAxes, asked: float, height: float, triangles: int, cutter: str) -> SurfaceSection:
    contours = tuple(
        Contour(axes.machine_mm(chain.section_mm, height), chain.section_mm, chain.closed, chain.hole, chain.length_mm)
        for chain in chained.chains
    )
    gaps = tuple(_gap(contour.points_mm) for contour in contours if not contour.closed)
    branches = axes.machine_mm(chained.branches_mm, height)
    made = SurfaceSection(
        asked_mm=asked,
        height_mm=height,
        axes=axes,
        contours=contours,
        set_aside=len(chained.set_aside_mm),
        set_aside_mm=chained.set_aside_mm,
        gaps=gaps,
        branches_mm=branches,
        overlaps_mm=axes.machine_mm(chained.overlaps_mm, height),
        triangles=triangles,
        cutter=cutter,
        warnings=(),
    )
    return replace(made, warnings=tuple(_warnings(chained, made)))


def _gap(points_mm: NDArray[np.float64]) -> Gap:
    last, first = points_mm[-1].tolist(), points_mm[0].tolist()
    return Gap((last[0], last[1], last[2]), (first[0], first[1], first[2]), dist(last, first))


def _warnings(chained: ChainedSection, section: SurfaceSection) -> Iterator[str]:
    gaps, branches, overlaps = section.gaps, section.branches_mm, section.overlaps_mm
    if section.height_mm != section.asked_mm:
        yield f"facets lie in the plane at {section.asked_mm:g} mm: it was moved by {section.height_mm - section.asked_mm:+.2g} mm"
    if not section.contours:
        yield f"nothing is left of the section at {section.asked_mm:g} mm: no surface is cut there, or every piece is below the limit"
    if gaps:
        places = "; ".join(f"{_place(gap.from_mm)} to {_place(gap.to_mm)}, {gap.width_mm:.4f} mm" for gap in gaps[:_NAMED])
        yield f"{len(gaps)} open contour(s), left open: {places}{_rest_of(len(gaps))}"
    if len(branches):
        places = "; ".join(_place(branch) for branch in branches[:_NAMED])
        yield f"more than two segments meet at {len(branches)} place(s): {places}{_rest_of(len(branches))}"
    if len(overlaps):
        places = "; ".join(_place(overlap) for overlap in overlaps[:_NAMED])
        yield f"{len(overlaps)} pair(s) of contours overlap, and none of them is taken for a hole: at {places}{_rest_of(len(overlaps))}"
    if chained.repeated:
        yield f"{chained.repeated} segment(s) were there twice (facets given twice, or folded): one of each was kept"
    if chained.set_aside_open:
        yield f"{chained.set_aside_open} of the {section.set_aside} pieces set aside are open"


def _place(point: Sequence[float] | NDArray[np.float64]) -> str:
    return f"({point[0]:.4f}, {point[1]:.4f}, {point[2]:.4f})"


def _rest_of(count: int) -> str:
    return f" and {count - _NAMED} more" if count > _NAMED else ""
