"""One section of a surface as a record, and its contours as a source of points like any scan."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from threading import Event

import numpy as np
from numpy.typing import NDArray

from drivers.source import Arrival, PointBatch, ScanClosed, ScanOpened
from drivers.surface.section_axes import SectionAxes


@dataclass(frozen=True, slots=True, eq=False)
class Contour:
    """One line of the section, as points in order.

    points_mm  : (m, 3) machine coordinates
    section_mm : (m, 2) the plane's own axes (see section_axes.py; for the normal z the machine's x and y)
    closed     : the last point is followed by the first, which is not repeated
    hole       : closed and inside another; outer contours run counter-clockwise, holes clockwise
    length_mm  : with the closing piece, where it is closed
    """

    points_mm: NDArray[np.float64]
    section_mm: NDArray[np.float64]
    closed: bool
    hole: bool
    length_mm: float

    def __post_init__(self) -> None:
        m = len(self.section_mm)
        if self.points_mm.shape != (m, 3) or self.section_mm.shape != (m, 2):
            raise ValueError(f"expected ({m}, 3) and ({m}, 2), got {self.points_mm.shape} and {self.section_mm.shape}")
        for array in (self.points_mm, self.section_mm):
            array.setflags(write=False)


@dataclass(frozen=True, slots=True)
class Gap:
    """Where an open contour ends: from its last point to its first, in machine coordinates."""

    from_mm: tuple[float, float, float]
    to_mm: tuple[float, float, float]
    width_mm: float


@dataclass(frozen=True, slots=True, eq=False)
class SurfaceSection:
    """One section of a surface.

    asked_mm, height_mm : the height asked for and the one cut, along the unit normal from the machine's origin
    axes       : the plane's own axes
    contours   : longest first, none shorter than the limit
    set_aside  : pieces below the limit (dust, noise shells), counted; set_aside_mm (k,) their lengths, longest first
    gaps       : one for each open contour
    branches_mm : (b, 3) where more than two segments meet
    overlaps_mm : (k, 3) one place for each pair of closed contours that cross or coincide
    triangles  : how many the plane cuts
    cutter     : what cut them: "open3d 0.20.0" or "numpy"
    warnings   : everything that is not as it should be, in sentences
    """

    asked_mm: float
    height_mm: float
    axes: SectionAxes
    contours: tuple[Contour, ...]
    set_aside: int
    set_aside_mm: NDArray[np.float64]
    gaps: tuple[Gap, ...]
    branches_mm: NDArray[np.float64]
    overlaps_mm: NDArray[np.float64]
    triangles: int
    cutter: str
    warnings: tuple[str, ...]

    def __post_init__(self) -> None:
        for array in (self.set_aside_mm, self.branches_mm, self.overlaps_mm):
            array.setflags(write=False)

    def outer(self) -> tuple[Contour, ...]:
        """Contours that are no holes, longest first."""
        return tuple(contour for contour in self.contours if not contour.hole)


class ContourSource:
    """Contours of one section as a source of points like any scan, one after the other. Time is not known and stays 0."""

    def __init__(self, contours: Sequence[Contour], surface: str, batch_points: int = 4096) -> None:
        self._contours, self._surface, self._batch_points = tuple(contours), surface, batch_points
        self._stopped = Event()

    def arrivals(self) -> Iterator[Arrival]:
        """Hand out the contours as one scan; see ScanSource."""
        total = sum(len(contour.points_mm) for contour in self._contours)
        points = np.concatenate([np.empty((0, 3)), *(contour.points_mm for contour in self._contours)])
        yield ScanOpened(device=f"surface {self._surface}", serial_number="", expected=total)
        for start in range(0, total, self._batch_points):
            if self._stopped.is_set():
                return
            part = points[start : start + self._batch_points].copy()
            yield PointBatch(np.arange(start, start + len(part), dtype=np.int64), np.zeros(len(part)), part)
        yield ScanClosed(sent=total)

    def stop(self) -> None:
        """End `arrivals` before its next batch."""
        self._stopped.set()


def add_points_between(contour: Contour, spacing_mm: float) -> Contour:
    """Set evenly spaced points on every piece longer than `spacing_mm`: they lie on the facets as much as the corners do."""
    arrays = [contour.points_mm, contour.section_mm]
    if contour.closed:
        arrays = [np.concatenate([array, array[:1]]) for array in arrays]
    lengths = np.linalg.norm(np.diff(arrays[1], axis=0), axis=1)
    if not len(lengths) or lengths.max() <= spacing_mm:
        return contour
    pieces = np.ceil(np.maximum(lengths / spacing_mm, 1.0) - 1e-9).astype(int)
    corner = np.concatenate([[0], np.cumsum(pieces)]).astype(np.float64)
    wanted = np.arange(corner[-1] + (0 if contour.closed else 1))
    points, section = (np.column_stack([np.interp(wanted, corner, column) for column in array.T]) for array in arrays)
    return replace(contour, points_mm=points, section_mm=section)
