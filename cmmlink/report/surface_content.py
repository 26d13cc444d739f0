"""What the picture of a judged surface shows, worked out from plain arrays before anything is laid out: another process can do that.

Its images are fixed by the zone, the nominal and the points alone. Every region out of tolerance has a number, in the images as in tables.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from cmmlink.colour_map import Kind, colours_of, kinds_of, severity_of
from cmmlink.report.raster import Camera, Dots, Image, View, draw_view
from cmmlink.report.surface_sides import close_up, four_sides
from inspection import ToleranceZone

Array = NDArray[np.float64]

SIDE_PX = 690, 470  # of a view from a side: width, height
CLOSE_PX = 430, 430  # of the view of the worst place
MOST_MARKED = 9
PLACES = 300_000  # of the nominal: about one a pixel of its views
_AROUND = 6.0  # times a region's size that the view of it is wide
_CLOSEST = 0.02  # of the part's size, that it is wide at least
_SIDE = 0.5  # of the reach: what a difference of 1 between unit normals counts for as a distance
_HIDDEN_PX = 6.0  # so far behind the front a marked place may lie that is still seen


@dataclass(frozen=True, slots=True)
class Region:
    """Points out of tolerance that lie together: their area, the worst deviation, and where on the nominal that is."""

    area_mm2: float
    worst_mm: float
    worst_at_mm: tuple[float, float, float]


@dataclass(frozen=True, slots=True, eq=False)
class JudgedSurface:
    """A judged scan of a surface, in nominal coordinates.

    places_mm, place_normals : (n, 3) places spread evenly over the nominal, and its outward normals there
    foot_mm, normals         : (m, 3) the foot of each point, and the direction in which its deviation grows
    deviation_mm, verdicts   : (m,) of each point; a verdict that is none of the three is not judged
    area_mm2  : of the nominal
    reach_mm  : how far from a point, of the same side of a wall, the nominal counts as measured
    regions   : what is out of tolerance, the worst first
    worst     : the row of the worst point; None where none was judged
    """

    places_mm: Array
    place_normals: Array
    foot_mm: Array
    normals: Array
    deviation_mm: Array
    verdicts: NDArray[np.int8]
    zone: ToleranceZone
    area_mm2: float
    reach_mm: float
    regions: tuple[Region, ...] = ()
    worst: int | None = None


@dataclass(frozen=True, slots=True)
class Mark:
    """Where a region lies in an image, in pixels from its upper left corner. A hidden one lies behind what the image shows."""

    number: int
    column: float
    row: float
    hidden: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class Panel:
    """An image (height, width, 3) with its marks; `axes` are the directions right and down (3, 2) of x, y and z in it."""

    image: Image
    mm_per_px: float
    axes: Array
    marks: tuple[Mark, ...]


@dataclass(frozen=True, slots=True, eq=False)
class SurfaceContent:
    """Everything that the picture of a surface shows.

    sides   : the part from four sides
    nearby  : the worst place from straight above; None where no point was judged
    regions : the marked regions, in the order of their numbers, from 1
    more    : how many regions there are besides
    heading, basis, foot : what stands above the picture, beside its legend, and small at the foot
    """

    sides: tuple[Panel, ...]
    nearby: Panel | None
    regions: tuple[Region, ...]
    more: int
    worst_mm: float | None
    zone: ToleranceZone
    heading: str
    basis: str
    foot: str


def surface_content(scan: JudgedSurface, heading: str, basis: str, foot: str = "") -> SurfaceContent:
    """Draw the images of a judged surface."""
    nominal, points = _dots_of(scan)
    marked = scan.regions[:MOST_MARKED]
    sides = [_panel(camera, nominal, points, marked) for camera in four_sides(scan.places_mm, *SIDE_PX)]
    nearby = None if scan.worst is None else _panel(_camera_above(scan, scan.worst), nominal, points, marked)
    worst = None if scan.worst is None else float(scan.deviation_mm[scan.worst])
    return SurfaceContent(_with_hidden(sides), nearby, marked, len(scan.regions) - len(marked), worst, scan.zone, heading, basis, foot)


def _dots_of(scan: JudgedSurface) -> tuple[Dots, Dots]:
    """The nominal, coloured where it was measured, and the judged points."""
    kinds = kinds_of(scan.verdicts, scan.deviation_mm, scan.zone.middle_mm)
    rows = np.flatnonzero(kinds != Kind.NOT_JUDGED)
    kinds, deviation, feet = kinds[rows], scan.deviation_mm[rows], scan.foot_mm[rows]
    colours, severity = colours_of(kinds, deviation, scan.zone), severity_of(kinds, deviation, scan.zone)
    spacing = min(np.sqrt(scan.area_mm2 / max(len(rows), 1)), scan.reach_mm)
    points = Dots(feet, scan.normals[rows], colours, severity, float(spacing))
    count = len(scan.places_mm)
    bare = colours_of(np.zeros(count, dtype=np.int8), np.zeros(count), scan.zone)
    if len(rows):
        apart, nearest = _nearest(scan, rows)
        measured = apart <= scan.reach_mm
        bare[measured] = colours[nearest[measured]]
    ground = Dots(scan.places_mm, scan.place_normals, bare, np.ones(count, dtype=np.float32), float(np.sqrt(scan.area_mm2 / count)))
    return ground, points


def _nearest(scan: JudgedSurface, rows: NDArray[np.int64]) -> tuple[Array, NDArray[np.int64]]:
    """How far each place (n,) is from the nearest of these feet, and which that is; normals count, so that walls have two sides."""
    side = _SIDE * scan.reach_mm
    tree = cKDTree(np.column_stack([scan.foot_mm[rows], side * scan.normals[rows]]), compact_nodes=False, balanced_tree=False)
    apart, nearest = tree.query(np.column_stack([scan.places_mm, side * scan.place_normals]), distance_upper_bound=1.01 * scan.reach_mm)
    return np.asarray(apart), np.asarray(nearest)


def _panel(camera: Camera, nominal: Dots, points: Dots, marked: Sequence[Region]) -> Panel:
    view = draw_view(camera, nominal, points)
    axes = np.column_stack([camera.right, -camera.up])
    return Panel(view.image, camera.mm_per_px, axes, _marks_in(camera, view, marked))


def _marks_in(camera: Camera, view: View, marked: Sequence[Region]) -> tuple[Mark, ...]:
    """The marks of regions inside an image."""
    if not marked:
        return ()
    places = np.array([region.worst_at_mm for region in marked])
    marks = []
    for number, ((column, row), nearness) in enumerate(zip(camera.pixels(places), camera.nearness_mm(places), strict=True), start=1):
        if 0 <= column < camera.width_px and 0 <= row < camera.height_px:
            hidden = nearness < view.front_mm[int(row), int(column)] - _HIDDEN_PX * camera.mm_per_px
            marks.append(Mark(number, float(column), float(row), bool(hidden)))
    return tuple(marks)


def _with_hidden(sides: Sequence[Panel]) -> tuple[Panel, ...]:
    """The sides without marks of what is hidden there, but for regions that no side shows."""
    seen = {mark.number for side in sides for mark in side.marks if not mark.hidden}
    kept = [tuple(mark for mark in side.marks if not mark.hidden or mark.number not in seen) for side in sides]
    return tuple(Panel(side.image, side.mm_per_px, side.axes, marks) for side, marks in zip(sides, kept, strict=True))


def _camera_above(scan: JudgedSurface, worst: int) -> Camera:
    """Look at the worst point from straight above; if it is out of tolerance, its region fills a good part of the image."""
    size = float(np.ptp(scan.places_mm, axis=0).max())
    area = scan.regions[0].area_mm2 if scan.regions else 0.0
    across = min(max(_AROUND * float(np.sqrt(area)), _CLOSEST * size, 4 * scan.reach_mm), size)
    return close_up(scan.foot_mm[worst].tolist(), scan.normals[worst], across, *CLOSE_PX)
