"""A folder to try things in: a nominal, points of a good and of a bad part, plans, a surface, a register map, a path for simulators.

The plans and the page that explains the folder are shipped as they stand, in the folder example_files; what is made of numbers is
computed here from the demonstration's section, so that it fits the plans to the last digit.
"""

import struct
from collections.abc import Callable, Mapping
from importlib import resources
from pathlib import Path
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from cmmlink.demo import part_path, path_csv
from cmmlink.demo.section import CHORD_MM, nominal_points
from cmmlink.errors import PlanError
from inspection import NurbsCurve

Array = NDArray[np.float64]

BUMP_MM, BUMP_STATION_MM = 0.12, 40.0  # too much material on the bad part

_TIP_RADIUS_MM, _COUNT, _SEED, _PATH_POINTS = 1.0, 1500, 7, 5000
_FORM_MM, _FORM_WAVES, _NOISE_MM = 0.015, 5, 0.001
_BUMP_WIDTH_MM = 3.0
_ROTATION_RAD, _MOVED_MM = np.radians(30.0), (210.0, 145.0)
_STL_CHORD_MM, _STL_HEIGHT_MM = 60.0, 10.0
_SPACING_MM = 0.6  # of points on the whole surface


def write_example(folder: Path) -> tuple[Path, ...]:
    """Write the example into a folder, which is made where it is not there. Returns the files, in their order.

    Raises PlanError where a file would be overwritten or cannot be written.
    """
    texts = {file.name: file.read_bytes() for file in resources.files("cmmlink.demo").joinpath("example_files").iterdir()}
    paths = tuple(folder / name for name in sorted({*texts, *_COMPUTED}))
    there = next((path for path in paths if path.exists()), None)
    if there is not None:
        raise PlanError(f"{there}: is there already, and nothing is overwritten; give a new folder")
    curve = NurbsCurve.interpolate(nominal_points(), closed=True)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for path in paths:
            path.write_bytes(texts[path.name] if path.name in texts else _COMPUTED[path.name](curve))
    except OSError as error:
        raise PlanError(f"{error.filename or folder}: cannot be written: {error.strerror or error}") from None
    return paths


def _airfoil(_: NurbsCurve) -> bytes:
    """The nominal as UIUC files have it: a title, then x and y in units of the chord."""
    rows = "".join(f"{x: .9f} {y: .9f}\n" for x, y in nominal_points() / CHORD_MM)
    return f"NACA 4512, its trailing edge rounded\n{rows}".encode()


def _points(bump_mm: float) -> Callable[[NurbsCurve], bytes]:
    """Measured points of a part with a bump, as csv."""

    def spell(curve: NurbsCurve) -> bytes:
        rows = "".join(f"{x:.5f},{y:.5f}\n" for x, y in measured_points(curve, bump_mm))
        return f"x_mm,y_mm\n{rows}".encode()

    return spell


def measured_points(curve: NurbsCurve, bump_mm: float) -> Array:
    """Ball centres (m, 2) along a closed, counterclockwise section with form error, noise and a bump, turned and moved on the machine."""
    u = np.linspace(*curve.domain, 8 * _COUNT + 1)
    along = curve.station_mm(u)
    along[-1] = curve.length_mm
    station = curve.length_mm * np.arange(_COUNT) / _COUNT
    point, tangent = curve.derivatives(np.interp(station, along, u), 1)
    outward = np.column_stack([tangent[:, 1], -tangent[:, 0]]) / np.hypot(*tangent.T)[:, None]
    away = np.abs(station - BUMP_STATION_MM)
    bump = np.where(away < _BUMP_WIDTH_MM / 2, bump_mm / 2 * (1 + np.cos(2 * np.pi * away / _BUMP_WIDTH_MM)), 0.0)
    height = _FORM_MM * np.sin(2 * np.pi * _FORM_WAVES * station / curve.length_mm) + bump + _TIP_RADIUS_MM
    noise = np.random.default_rng(_SEED).normal(0.0, _NOISE_MM, point.shape)
    c, s = np.cos(_ROTATION_RAD), np.sin(_ROTATION_RAD)
    return np.asarray((point + height[:, None] * outward + noise) @ np.array([[c, s], [-s, c]]) + _MOVED_MM)


def _surface(_: NurbsCurve) -> bytes:
    """A straight blade as binary STL, closed at both ends."""
    outline = nominal_points()[:-1] * (_STL_CHORD_MM / CHORD_MM)
    low, high = (np.column_stack([outline, np.full(len(outline), z)]) for z in (0.0, _STL_HEIGHT_MM))
    a, b, c, d = low, np.roll(low, -1, axis=0), np.roll(high, -1, axis=0), high
    walls = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    triangles = np.concatenate([walls, _end(high), _end(low)[:, ::-1]])  # (t, 3 corners, 3)
    records = np.zeros(len(triangles), dtype=[("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
    records["corners"] = triangles
    return b"made by cmmlink example".ljust(80, b" ") + struct.pack("<I", len(records)) + records.tobytes()


def _end(ring: Array) -> Array:
    """Triangles (k - 2, 3, 3) that fill a ring (k, 3) in a strip from tip to tip, counterclockwise as the ring is."""
    order = np.stack([np.arange(len(ring)), np.arange(len(ring))[::-1]], axis=1).ravel()[: len(ring)]  # 0, k - 1, 1, k - 2 ...
    strip = np.stack([order[:-2], order[1:-1], order[2:]], axis=1)
    strip[::2] = strip[::2, [0, 2, 1]]
    return np.asarray(ring[strip])


def _surface_points(_: NurbsCurve) -> bytes:
    """Measured points of that whole blade in space, as csv: its walls and both ends, turned and moved on the machine."""
    outline = nominal_points()[:-1] * (_STL_CHORD_MM / CHORD_MM)
    heights = np.arange(_SPACING_MM / 2, _STL_HEIGHT_MM, _SPACING_MM)
    around = _spread(np.vstack([outline, outline[:1]]))
    walls = np.column_stack([np.repeat(around, len(heights), axis=0), np.tile(heights, len(around))])
    inside = np.concatenate([_spread(np.stack([one, other])) for one, other in zip(outline, outline[::-1], strict=True)])
    kept = np.unique(np.floor(inside / (_SPACING_MM / 2)), axis=0, return_index=True)[1]  # ribs lie close together near the nose
    ends = [np.column_stack([inside[kept], np.full(len(kept), z)]) for z in (0.0, _STL_HEIGHT_MM)]
    points = np.concatenate([walls, *ends])
    points = points + np.random.default_rng(_SEED).normal(0.0, _NOISE_MM, points.shape)
    c, s = np.cos(_ROTATION_RAD), np.sin(_ROTATION_RAD)
    turned = points @ np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]]) @ np.array([[1.0, 0.0, 0.0], [0.0, c, s], [0.0, -s, c]])
    rows = "".join(f"{x:.5f},{y:.5f},{z:.5f}\n" for x, y, z in turned + np.array((*_MOVED_MM, 80.0)))
    return f"x_mm,y_mm,z_mm\n{rows}".encode()


def _spread(course: Array) -> Array:
    """Places (m, 2) along a course (k, 2), as far apart as its points in space are."""
    along = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(course, axis=0).T))])
    stations = np.linspace(0.0, along[-1], max(int(np.ceil(along[-1] / _SPACING_MM)), 1) + 1)
    return np.column_stack([np.interp(stations, along, column) for column in course.T])


def _path(curve: NurbsCurve) -> bytes:
    return path_csv(part_path(curve, _PATH_POINTS)).encode()


_COMPUTED: Mapping[str, Callable[[NurbsCurve], bytes]] = MappingProxyType(
    {
        "blade.dat": _airfoil,
        "points.csv": _points(0.0),
        "points-bad.csv": _points(BUMP_MM),
        "part.stl": _surface,
        "path.csv": _path,
        "surface-points.csv": _surface_points,
    }
)
