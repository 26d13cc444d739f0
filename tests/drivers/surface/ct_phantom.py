"""A blade as computed tomography would hand it over: a noisy voxel volume, its iso-surface, and what is true about it.

An extruded profile, whose surface is displaced along its normals by a known function of station and height, is written into
grey values with the blur, the beam hardening and the correlated noise of a scanner, dust is strewn around it, and marching
cubes makes the surface. The part stands tilted in the scanner. Nothing here uses the packages under test.
"""

from dataclasses import dataclass
from math import cos, radians, sin
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import BSpline, make_interp_spline
from scipy.ndimage import gaussian_filter
from scipy.spatial import KDTree
from scipy.special import erfc
from skimage.measure import marching_cubes

GOE404 = Path(__file__).parents[2] / "data" / "airfoils" / "goe404.dat"
IN_PLANE_DEG, TILT_DEG = 7.3, 2.5
OFFSET_MM = np.array([12.0, -7.0, 31.0])
HARDENING, HARDENING_DEPTH_MM = 0.15, 2.0
MARGIN_VOXELS = 8
ISO_LEVEL = 0.489  # half of the mean grey value inside: beam hardening lowers it a little


@dataclass(frozen=True)
class Defect:
    """A bump of this height, round a station and a part height, Gaussian with these widths."""

    height_mm: float
    station_mm: float
    part_height_mm: float
    station_sigma_mm: float = 1.2
    height_sigma_mm: float = 0.8


@dataclass(frozen=True)
class Speck:
    """A ball of dust: the part height of its centre, and its radius."""

    part_height_mm: float
    radius_mm: float


@dataclass(frozen=True)
class Phantom:
    """corners_mm (n, 3, 3) float32 in machine coordinates; `normal` the part's axis there."""

    corners_mm: NDArray[np.float32]
    profile: BSpline
    length_mm: float
    defect: Defect | None
    normal: NDArray[np.float64]
    voxel_mm: float
    dust: tuple[Speck, ...]

    def machine_height_mm(self, part_height_mm: float) -> float:
        """Height along the unit normal, from the machine's origin, of a section of the part."""
        return part_height_mm + float(OFFSET_MM @ self.normal)

    def form_error_mm(self, station_mm: NDArray[np.float64], part_height_mm: float) -> NDArray[np.float64]:
        return form_error_mm(station_mm, part_height_mm, self.length_mm, self.defect)


def form_error_mm(station_mm: NDArray[np.float64], part_height_mm: float, length_mm: float, defect: Defect | None) -> NDArray[np.float64]:
    """Waves of 20 and 10 um that change with the height, and the defect; positive out of material."""
    turn = 2.0 * np.pi * station_mm / length_mm
    error: NDArray[np.float64] = 0.020 * np.cos(3.0 * turn + 0.3 * part_height_mm) + 0.010 * np.cos(7.0 * turn - 0.5 * part_height_mm)
    if defect is not None:
        along = (station_mm - defect.station_mm) / defect.station_sigma_mm
        up = (part_height_mm - defect.part_height_mm) / defect.height_sigma_mm
        error = error + defect.height_mm * np.exp(-0.5 * (along**2 + up**2))
    return error


def airfoil(path: Path, chord_mm: float) -> BSpline:
    """Cubic spline through the file's points, centripetal parameter, from trailing edge to trailing edge."""
    points = np.loadtxt(path, skiprows=1) * chord_mm
    steps = np.sqrt(np.linalg.norm(np.diff(points, axis=0), axis=1))
    parameter = np.concatenate([[0.0], np.cumsum(steps)]) / steps.sum()
    return make_interp_spline(parameter, points, k=3)


def make_phantom(
    *,
    seed: int,
    voxel_mm: float,
    height_mm: float,
    chord_mm: float = 60.0,
    noise: float = 0.05,
    specks: int = 12,
    defect: Defect | None = None,
) -> Phantom:
    """Scan the blade from part height 0 to `height_mm`; it goes on beyond the scanned volume, so the surface is open at both ends."""
    rng = np.random.default_rng(seed)
    profile = airfoil(GOE404, chord_mm)
    samples, normals, station = _dense(profile)
    lower = samples.min(axis=0) - MARGIN_VOXELS * voxel_mm
    shape = np.ceil((samples.max(axis=0) - lower) / voxel_mm).astype(int) + MARGIN_VOXELS
    axes = [lower[axis] + voxel_mm * np.arange(shape[axis]) for axis in range(2)]
    pixels = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 2)
    distance, pixel_station = _signed_distance(pixels, samples, normals, station)
    heights = voxel_mm * np.arange(round(height_mm / voxel_mm) + 1)
    volume = np.empty((shape[0], shape[1], len(heights)), dtype=np.float32)
    hardening = 1.0 - HARDENING * (1.0 - np.exp(np.minimum(distance, 0.0) / HARDENING_DEPTH_MM))
    length = float(station.max())
    for layer, height in enumerate(heights):
        surface = distance - form_error_mm(pixel_station, height, length, defect)
        volume[:, :, layer] = (hardening * 0.5 * erfc(surface / (np.sqrt(2.0) * voxel_mm))).reshape(shape)
    dust = _strew(volume, distance.reshape(shape), voxel_mm, specks, rng)
    grain = gaussian_filter(rng.standard_normal(volume.shape, dtype=np.float32), 0.7)
    volume += grain * np.float32(noise / grain.std())
    vertices, faces, _, _ = marching_cubes(volume, ISO_LEVEL)  # type: ignore[no-untyped-call]
    part = vertices.astype(np.float64) * voxel_mm + np.array([lower[0], lower[1], 0.0])
    machine = part @ _tilt().T + OFFSET_MM
    return Phantom(machine.astype(np.float32)[faces], profile, length, defect, _tilt()[:, 2], voxel_mm, dust)


def _tilt() -> NDArray[np.float64]:
    """Machine from part: a rotation about an axis in the part's plane."""
    angle, axis = radians(TILT_DEG), np.array([cos(0.6), sin(0.6), 0.0])
    cross = np.array([[0.0, -axis[2], axis[1]], [axis[2], 0.0, -axis[0]], [-axis[1], axis[0], 0.0]])
    rotation: NDArray[np.float64] = np.eye(3) + sin(angle) * cross + (1.0 - cos(angle)) * cross @ cross
    return rotation


def _dense(profile: BSpline, count: int = 40_000) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Points of the closed outline turned in the plane, outward normals, and stations; the blunt trailing edge at the end."""
    u = np.linspace(0.0, 1.0, count)
    points, tangents = profile(u), profile(u, 1)
    station = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    base = points[-1] + np.linspace(0.0, 1.0, 102)[1:-1, None] * (points[0] - points[-1])
    points = np.concatenate([points, base])
    tangents = np.concatenate([tangents, np.broadcast_to(points[0] - points[count - 1], base.shape)])
    normals = np.column_stack([tangents[:, 1], -tangents[:, 0]]) / np.linalg.norm(tangents, axis=1)[:, None]
    turn = radians(IN_PLANE_DEG)
    rotation = np.array([[cos(turn), -sin(turn)], [sin(turn), cos(turn)]])
    return points @ rotation.T, normals @ rotation.T, np.concatenate([station, np.full(len(base), station[-1])])


def _signed_distance(
    pixels: NDArray[np.float64], samples: NDArray[np.float64], normals: NDArray[np.float64], station: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Distance to the outline, positive outside, and the station of its foot; round a corner the distance to the corner."""
    _, nearest = KDTree(samples).query(pixels)
    offset = pixels - samples[nearest]
    normal = normals[nearest]
    out = np.sum(offset * normal, axis=1)
    along = offset[:, 1] * normal[:, 0] - offset[:, 0] * normal[:, 1]
    round_corner = np.abs(along) > 0.005  # farther than the samples are apart: the foot is an end of the outline
    distance = np.where(round_corner, np.copysign(np.linalg.norm(offset, axis=1), out), out)
    return distance, station[nearest] + np.where(round_corner, 0.0, along)


def _strew(
    volume: NDArray[np.float32], distance: NDArray[np.float64], voxel_mm: float, specks: int, rng: np.random.Generator
) -> tuple[Speck, ...]:
    """Add balls of 1.5 to 3 voxels radius to the air, well away from the part, each other and the edges of the volume."""
    reach = 6
    free = distance > 2.0 * reach * voxel_mm
    free[:reach] = free[-reach:] = False
    free[:, :reach] = free[:, -reach:] = False
    grid = np.arange(-reach, reach + 1)
    from_centre = np.sqrt(np.sum(np.stack(np.meshgrid(grid, grid, grid, indexing="ij")) ** 2, axis=0))
    dust = []
    for _ in range(specks):
        places = np.argwhere(free)
        if not len(places):
            raise ValueError(f"no room for {specks} specks of dust in {free.shape} voxels")
        x, y = places[rng.integers(len(places))]
        z = int(rng.integers(reach, volume.shape[2] - reach))
        radius = float(rng.uniform(1.5, 3.0))
        ball = 0.5 * erfc((from_centre - radius) / np.sqrt(2.0))
        volume[x - reach : x + reach + 1, y - reach : y + reach + 1, z - reach : z + reach + 1] += ball.astype(np.float32)
        free[max(x - 2 * reach, 0) : x + 2 * reach, max(y - 2 * reach, 0) : y + 2 * reach] = False
        dust.append(Speck(voxel_mm * z, voxel_mm * radius))
    return tuple(dust)


def write_stl(phantom: Phantom, path: Path) -> Path:
    """Write the surface as a binary STL file."""
    records = np.zeros(len(phantom.corners_mm), np.dtype([("normal", "V12"), ("corners", "<f4", (3, 3)), ("attribute", "V2")]))
    records["corners"] = phantom.corners_mm
    path.write_bytes(b"phantom of a CT scan".ljust(80) + np.uint32(len(records)).tobytes() + records.tobytes())
    return path


def write_nominal(phantom: Phantom, path: Path) -> Path:
    """Write the true profile as a NURBS file."""
    return write_spline(phantom.profile, path)


def write_spline(spline: BSpline, path: Path, size: float = 1.0) -> Path:
    """Write a spline, `size` times as large, as an open NURBS file."""
    control_points = (size * spline.c).tolist()
    path.write_text(f"degree: {spline.k}\nclosed: false\nknots: {spline.t.tolist()}\ncontrol_points_mm: {control_points}\n")
    return path


def noise_mm(
    phantom: Phantom, part_height_mm: float, station_mm: NDArray[np.float64], deviation_mm: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Deviations found minus the true form error, with what a rigid motion of the section explains taken out.

    Points within 1 mm of the ends are left out: the blur of the scan rounds the trailing edge.
    """
    inside = (station_mm > 1.0) & (station_mm < phantom.length_mm - 1.0)
    station, rest = station_mm[inside], deviation_mm[inside] - phantom.form_error_mm(station_mm[inside], part_height_mm)
    u = np.linspace(0.0, 1.0, 20_001)
    points, tangents = phantom.profile(u), phantom.profile(u, 1)
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    normals = np.column_stack([tangents[:, 1], -tangents[:, 0]]) / np.linalg.norm(tangents, axis=1)[:, None]
    arm = points - points.mean(axis=0)
    modes = np.column_stack([normals, arm[:, 0] * normals[:, 1] - arm[:, 1] * normals[:, 0]])
    here = np.column_stack([np.interp(station, along, mode) for mode in modes.T])
    remaining: NDArray[np.float64] = rest - here @ np.linalg.lstsq(here, rest - rest.mean(), rcond=None)[0]
    return remaining
