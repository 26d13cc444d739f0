"""What is shown of a whole surface: how much of it is measured so far, its worst point, and the messages that pages are sent of it."""

import struct

import numpy as np
import pytest
from numpy.typing import NDArray

from cmmlink.console.surface_drawing import SurfaceDrawing
from cmmlink.extremes import PointsVersion
from cmmlink.shown_surface import ShownSurface, whole_surface_in
from cmmlink.surface_rows import SurfaceRows
from inspection import ToleranceZone
from inspection.surface import TriangleSurface
from tests.drivers.surface.meshes import box

ZONE = ToleranceZone(-0.05, 0.05, 0.005)
UNSEEN = PointsVersion(-1, 0)


@pytest.fixture(scope="module")
def block() -> TriangleSurface:
    return TriangleSurface(box((0.0, 0.0, 0.0), (30.0, 18.0, 12.0)))


def rows_of(points: NDArray[np.float64], deviation: NDArray[np.float64]) -> SurfaceRows:
    m = len(points)
    codes = np.zeros(m, dtype=np.int8)
    up = np.tile([0.0, 0.0, 1.0], (m, 1)).astype(np.float32)
    return SurfaceRows(points.copy(), np.zeros(m, dtype=np.int32), points.copy(), up, deviation, codes, codes.copy())


def test_the_share_that_is_measured_grows_with_the_area_and_not_with_the_points(block: TriangleSurface) -> None:
    """A scan of the upper face, twice as dense on its left: it has 540 of 2232 mm2."""
    shown = ShownSurface(block, ZONE, 2.0)
    x, y = (axis.ravel() for axis in np.meshgrid(np.linspace(0, 30, 61), np.linspace(0, 18, 37)))
    upper = np.column_stack([x, y, np.full(len(x), 12.0)])
    for points in (upper, upper[x < 15], upper[x < 15] + (0.1, 0.0, 0.0)):
        shown.add_rows(rows_of(points, np.zeros(len(points))))
    assert shown.coverage() == pytest.approx((540 + 96) / 2232, abs=0.01)  # a millimetre round its edges counts as measured, too
    assert shown.emptied().coverage() == 0.0
    assert shown.emptied().newest.generation == shown.newest.generation + 1


def test_the_worst_point_has_a_place_in_space_and_its_verdict(block: TriangleSurface) -> None:
    shown = ShownSurface(block, ZONE, 2.0)
    assert shown.worst is None
    shown.add_rows(rows_of(np.array([[1.0, 2, 12], [5.0, 6, 12]]), np.array([0.01, -0.2])))
    worst = shown.worst
    assert worst is not None
    assert (worst.x_mm, worst.y_mm, worst.z_mm, worst.deviation_mm, worst.verdict) == (5.0, 6.0, 12.0, -0.2, "nonconform")


def test_a_page_is_sent_rows_of_24_bytes_with_the_normals_of_the_nominal(block: TriangleSurface) -> None:
    shown, drawing = ShownSurface(block, ZONE, 2.0), SurfaceDrawing(block)
    shown.add_rows(rows_of(np.array([[10.0, 9, 12.25], [30.5, 9, 6]]), np.array([0.25, 0.5])))
    message = drawing.points_message(shown.changed_since(UNSEEN), 7, None)
    kind, generation, rows, _ = struct.unpack_from("<4I", message)
    assert (kind, generation, rows, len(message)) == (3, 7, 2, 32 + 2 * 24)
    found = [struct.unpack_from("<I4f3b", message, 32 + 24 * k) for k in range(2)]
    assert sorted(found) == [(0, 10.0, 9.0, 12.25, 0.25, 0, 0, 127), (1, 30.5, 9.0, 6.0, 0.5, 127, 0, 0)]
    nominal = drawing.nominal_message()
    kind, _, rows, _ = struct.unpack_from("<4I", nominal)
    assert (kind, len(nominal)) == (4, 32 + 20 * rows)
    assert struct.unpack_from("<d", nominal, 24)[0] == pytest.approx(np.sqrt(2232 / rows))


def test_regions_are_numbered_as_in_the_report_and_few_are_sent() -> None:
    region = {"worst_mm": 0.3, "area_mm2": 2.0, "points": 7, "worst_at_mm": [1.0, 2.0, 3.0]}
    told = whole_surface_in({"regions": [region] * 130, "unmeasured": [{"area_mm2": 4.0}, {"area_mm2": 0.5}]}, 3.0)
    assert (len(told.regions), told.more, told.unmeasured, told.unmeasured_mm2) == (100, 30, 2, 4.5)
    assert (told.regions[1].number, told.regions[1].z_mm) == (2, 3.0)
