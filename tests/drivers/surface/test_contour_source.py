"""A section's contours as a source of points, and points set between their corners."""

import numpy as np
import pytest

from drivers.source import PointBatch, ScanClosed, ScanOpened
from drivers.surface.contour_source import Contour, ContourSource, add_points_between
from drivers.surface.cut import NumpyCutter, cut_surface
from drivers.surface.stl_file import surface_of
from tests.drivers.surface.meshes import Triangles, box, ellipse, tube

CUBE = box((0, 0, 0), (10, 10, 10))


def contours(triangles: Triangles, height_mm: float, normal: tuple[float, float, float] = (0, 0, 1)) -> tuple[Contour, ...]:
    (found,) = cut_surface(surface_of(triangles, "test surface", "STL"), normal, [height_mm], cutter=NumpyCutter())
    return found.contours


def test_a_contour_is_a_source_of_points_like_any_scan() -> None:
    (contour,) = contours(tube(ellipse(1500), np.array([0.0, 10.0])), 5.0)
    opened, *batches, closed = ContourSource([contour], "blade.stl", batch_points=1000).arrivals()
    assert opened == ScanOpened("surface blade.stl", "", 3000)
    assert closed == ScanClosed(3000)
    points = [batch.points_mm for batch in batches if isinstance(batch, PointBatch)]
    assert np.array_equal(np.concatenate(points), contour.points_mm)
    assert [int(b.sequence[0]) for b in batches if isinstance(b, PointBatch)] == [0, 1000, 2000]

    stopped = ContourSource([contour], "blade.stl", batch_points=1000)
    arrivals = stopped.arrivals()
    next(arrivals), next(arrivals)
    stopped.stop()
    assert list(arrivals) == []


def test_points_between_corners_are_even_lie_on_the_pieces_and_keep_the_corners() -> None:
    (contour,) = contours(CUBE, 4.0)
    dense = add_points_between(contour, 0.3)
    closing = np.concatenate([dense.section_mm, dense.section_mm[:1]])
    steps = np.linalg.norm(np.diff(closing, axis=0), axis=1)
    assert steps.max() < 0.3 + 1e-12
    assert steps.min() > 0.15
    assert steps.sum() == pytest.approx(40.0)
    assert {tuple(p) for p in contour.points_mm} <= {tuple(p) for p in dense.points_mm}
    assert np.all(np.min(np.abs(np.concatenate([dense.section_mm, 10 - dense.section_mm], axis=1)), axis=1) == 0)
    assert np.array_equal(dense.points_mm[:, :2], dense.section_mm)
    assert add_points_between(contour, 10.0) is contour
    (line,) = contours(np.delete(CUBE, [10, 11], axis=0), 5.0, (1, 0, 0))
    ends = add_points_between(line, 0.3).section_mm[[0, -1]]
    assert np.array_equal(ends, line.section_mm[[0, -1]])
