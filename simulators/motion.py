"""A probe that walks along a path on a part: the points a scanner would stream, and when."""

import math
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

DEFECT_WIDTH_MM = 3.0
FORM_WAVES = range(2, 9)  # waves of the form error around the whole path


@dataclass(frozen=True, slots=True)
class Motion:
    """How the probe moves and what the part looks like.

    count              points of the scan; None: once along the whole path
    closed             the path returns to its first point
    form_error_mm      largest deviation of the smooth, seeded form error, along the outward normal
    noise_mm           standard deviation of the noise of each coordinate in the plane of the path
    defect_mm          height of a smooth bump about 3 mm wide (+: excess material) at defect_station_mm of the path
    tip_radius_mm      0: surface points; otherwise ball centres, offset outward by it
    rotation_deg, translation_mm    where the part lies on the machine: about z first, then moved
    start_mm, backward where on the path the scan starts, and whether it runs against the path's order
    resolution_mm      step of the scales by which the machine tells its positions; 0: none
    """

    speed_mm_s: float
    rate_hz: float
    count: int | None = None
    closed: bool = True
    form_error_mm: float = 0.0
    noise_mm: float = 0.0
    defect_mm: float = 0.0
    defect_station_mm: float = 0.0
    tip_radius_mm: float = 0.0
    rotation_deg: float = 0.0
    translation_mm: tuple[float, float, float] = (0.0, 0.0, 0.0)
    start_mm: float = 0.0
    backward: bool = False
    resolution_mm: float = 0.0
    seed: int = 0

    def __post_init__(self) -> None:
        if not (self.speed_mm_s > 0 and self.rate_hz > 0):
            raise ValueError(f"speed {self.speed_mm_s} mm/s and rate {self.rate_hz} Hz must be positive")
        if self.count is not None and self.count < 1:
            raise ValueError(f"{self.count} points to scan; at least 1 is needed")
        if not self.resolution_mm >= 0:
            raise ValueError(f"a resolution of {self.resolution_mm} mm; it is 0 or more")


@dataclass(frozen=True, slots=True, eq=False)
class Walk:
    """The scan as it will be streamed.

    time_s    : (n,) from the start of the scan
    points_mm : (n, 3) in machine coordinates
    """

    time_s: NDArray[np.float64]
    points_mm: NDArray[np.float64]


def walk(path_mm: NDArray[np.float64], motion: Motion) -> Walk:
    """Walk along the polyline `path_mm`, (k, 2) or (k, 3), whose last point may or may not repeat the first if closed.

    Outward is away from the enclosed area for closed paths and to the right of the path's order for open ones.
    """
    rng = np.random.default_rng(motion.seed)
    corners = _corners(path_mm, motion.closed)
    station, along, length = _stations(corners, motion)
    surface, outward = _points_on_path(corners, along, station, motion.closed)
    height = motion.tip_radius_mm + _form_error(station / length, motion.form_error_mm, rng) + _defect(station, length, motion)
    points = surface + height[:, None] * outward
    points[:, :2] += rng.normal(0.0, motion.noise_mm, (len(points), 2))
    return Walk(np.arange(len(points)) / motion.rate_hz, on_scales(_pose(points, motion), motion))


def feed_under(path_mm: NDArray[np.float64], motion: Motion) -> Walk:
    """Feed the part under a one-dimensional sensor at constant speed along x: points (x, y(x), 0) of the path.

    The beam runs along y: of a path that turns back, like one around a section, it meets the lowest y first. Form error, defect and
    noise act along y.
    """
    rng = np.random.default_rng(motion.seed)
    x = np.array([path_mm[:, 0].min(), path_mm[:, 0].max()])
    step = motion.speed_mm_s / motion.rate_hz
    count = motion.count if motion.count is not None else max(1, math.floor((x[-1] - x[0] - motion.start_mm) / step))
    along = motion.start_mm + step * np.arange(count, dtype=np.float64)
    height = _lowest(path_mm[:, :2], x[0] + along) + _form_error(along / (x[-1] - x[0]), motion.form_error_mm, rng)
    height += _defect(along, float(x[-1] - x[0]), replace(motion, closed=False)) + rng.normal(0.0, motion.noise_mm, count)
    return Walk(np.arange(count) / motion.rate_hz, on_scales(np.column_stack([x[0] + along, height, np.zeros(count)]), motion))


def on_scales(points_mm: NDArray[np.float64], motion: Motion) -> NDArray[np.float64]:
    """Return positions (..., 3) as the scales of the machine tell them."""
    step_mm = motion.resolution_mm
    return np.round(points_mm / step_mm) * step_mm if step_mm else points_mm


def _lowest(path_mm: NDArray[np.float64], x: NDArray[np.float64]) -> NDArray[np.float64]:
    """The lowest y (n,) of a path (k, 2) at each x (n,): over its stretches on which x only rises or only falls."""
    forward = np.diff(path_mm[:, 0]) > 0
    turns = np.flatnonzero(forward[1:] != forward[:-1]) + 1
    lowest = np.full(len(x), np.inf)
    for first, last in zip([0, *turns], [*turns, len(path_mm) - 1], strict=True):
        stretch = path_mm[first : last + 1] if forward[first] else path_mm[first : last + 1][::-1]
        lowest = np.fmin(lowest, np.interp(x, stretch[:, 0], stretch[:, 1], left=np.nan, right=np.nan))
    beyond = ~np.isfinite(lowest)  # of a scan that is longer than the path
    order = np.argsort(path_mm[:, 0])
    lowest[beyond] = np.interp(x[beyond], path_mm[order, 0], path_mm[order, 1])
    return lowest


def read_path(path: Path) -> NDArray[np.float64]:
    """Read x, y[, z] rows in mm separated by commas, semicolons or blanks; a header and comments (#) are skipped."""
    rows: list[list[float]] = []
    for number, line in enumerate(path.read_text(encoding="utf-8-sig").splitlines(), start=1):
        fields = line.partition("#")[0].replace(",", " ").replace(";", " ").split()
        try:
            rows.append([float(field) for field in fields[:3]])
        except ValueError:
            if rows:
                raise ValueError(f"{path}, line {number}: {line.strip()!r} is no point; expected x,y or x,y,z in mm") from None
            continue
        if not rows[-1]:
            rows.pop()
    if len(rows) < 2 or len({len(row) for row in rows}) != 1 or len(rows[0]) < 2 or not np.isfinite(rows).all():
        raise ValueError(f"{path}: expected at least two rows of x,y or x,y,z in mm, all alike")
    return np.array(rows, dtype=np.float64)


def _corners(path_mm: NDArray[np.float64], closed: bool) -> NDArray[np.float64]:
    corners = np.zeros((len(path_mm), 3))
    corners[:, : path_mm.shape[1]] = path_mm
    if closed and not np.array_equal(corners[0], corners[-1]):
        corners = np.vstack([corners, corners[:1]])
    moved = np.concatenate([[True], np.any(np.diff(corners, axis=0) != 0, axis=1)])
    corners = np.asarray(corners[moved], dtype=np.float64)
    flat = ~np.any(np.diff(corners[:, :2], axis=0) != 0, axis=1)
    if len(corners) < 2 or flat.any():
        raise ValueError("the path must move in x or y between any two of its points")
    return corners


def _stations(corners: NDArray[np.float64], motion: Motion) -> tuple[NDArray[np.float64], NDArray[np.float64], float]:
    """Return the station of every point, the station of every corner, and the length of the path."""
    along: NDArray[np.float64] = np.zeros(len(corners))
    along[1:] = np.cumsum(np.sqrt(np.sum(np.diff(corners, axis=0) ** 2, axis=1)))
    length = float(along[-1])
    step = motion.speed_mm_s / motion.rate_hz
    available = length if motion.closed else (motion.start_mm if motion.backward else length - motion.start_mm)
    count = motion.count if motion.count is not None else max(1, math.floor(available / step))
    station = motion.start_mm + (-step if motion.backward else step) * np.arange(count, dtype=np.float64)
    if motion.closed:
        return station % length, along, length
    if station.min() < 0 or station.max() > length:
        raise ValueError(f"the scan runs from {station[0]:g} to {station[-1]:g} mm, off the open path of {length:g} mm")
    return station, along, length


def _points_on_path(
    corners: NDArray[np.float64], along: NDArray[np.float64], station: NDArray[np.float64], closed: bool
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the points at the stations and the outward normals of the segments they lie on."""
    index = np.clip(np.searchsorted(along, station, side="right") - 1, 0, len(along) - 2)
    step = np.diff(corners, axis=0)
    fraction = (station - along[index]) / np.diff(along)[index]
    right = np.column_stack([step[:, 1], -step[:, 0], np.zeros(len(step))]) / np.hypot(step[:, 0], step[:, 1])[:, None]
    x, y = corners[:-1, 0], corners[:-1, 1]
    clockwise = closed and np.sum(x * step[:, 1] - y * step[:, 0]) < 0
    return corners[index] + fraction[:, None] * step[index], (-right if clockwise else right)[index]


def _form_error(turn: NDArray[np.float64], largest_mm: float, rng: np.random.Generator) -> NDArray[np.float64]:
    """Sum a few waves of random size and phase over the path, scaled to `largest_mm`; `turn` runs from 0 to 1."""
    size = rng.normal(size=len(FORM_WAVES))
    phase = rng.uniform(0.0, 2.0 * np.pi, len(FORM_WAVES))

    def waves(at: NDArray[np.float64]) -> NDArray[np.float64]:
        angle = 2.0 * np.pi * np.outer(at, FORM_WAVES) + phase
        return np.asarray(np.cos(angle) @ (size / np.array(FORM_WAVES)))

    largest = np.abs(waves(np.linspace(0.0, 1.0, 4001))).max()
    return np.asarray(waves(turn) * (largest_mm / largest))


def _defect(station: NDArray[np.float64], length: float, motion: Motion) -> NDArray[np.float64]:
    """Return a raised cosine at the defect's station."""
    away = np.abs(station - motion.defect_station_mm)
    if motion.closed:
        away = np.minimum(away % length, -away % length)
    bump = 0.5 * motion.defect_mm * (1.0 + np.cos(2.0 * np.pi * away / DEFECT_WIDTH_MM))
    return np.asarray(np.where(away < DEFECT_WIDTH_MM / 2, bump, 0.0))


def _pose(points: NDArray[np.float64], motion: Motion) -> NDArray[np.float64]:
    c, s = math.cos(math.radians(motion.rotation_deg)), math.sin(math.radians(motion.rotation_deg))
    rotation = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    return np.asarray(points @ rotation.T + np.array(motion.translation_mm))
