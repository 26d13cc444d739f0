"""A part without any symmetry as a mesh, and scans of it whose truth is known."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tests.drivers.surface.meshes import binary_stl

Array = NDArray[np.float64]

TURN = np.radians(35.0)
ROTATION = np.array([[np.cos(TURN), -np.sin(TURN), 0.0], [np.sin(TURN), np.cos(TURN), 0.0], [0.0, 0.0, 1.0]])
MOVED_MM = np.array([5.0, -3.0, 40.0])


def egg_triangles(rows: int = 12, columns: int = 20) -> Array:
    """Triangles (n, 3, 3) of a closed, lopsided body about 60 mm long, outward."""
    polar, azimuth = np.meshgrid(np.linspace(0.0, np.pi, rows), np.linspace(0.0, 2 * np.pi, columns, endpoint=False), indexing="ij")
    reach = 1.0 + 0.15 * np.sin(3 * polar) * np.cos(2 * azimuth + 0.4) + 0.12 * np.cos(azimuth) * np.sin(polar) + 0.1 * np.cos(polar)
    x, y, z = np.sin(polar) * np.cos(azimuth), np.sin(polar) * np.sin(azimuth), np.cos(polar)
    places = reach[:, :, None] * np.stack([30.0 * x, 20.0 * y, 12.0 * z], axis=-1)
    places[0], places[-1] = places[0, 0], places[-1, 0]  # the poles are one corner each, to the last bit
    right = np.roll(places, -1, axis=1)
    a, b, c, d = places[:-1], places[1:], right[1:], right[:-1]
    triangles = np.concatenate([np.stack([a, b, c], axis=2)[:-1].reshape(-1, 3, 3), np.stack([a, c, d], axis=2)[1:].reshape(-1, 3, 3)])
    return np.asarray(triangles.astype(np.float32), dtype=np.float64)


def write_egg(path: Path) -> None:
    """Write it as a binary STL."""
    path.write_bytes(binary_stl(egg_triangles()))


def egg_scan(spacing_mm: float = 2.0, out_mm: float = 0.0, noise_mm: float = 0.0) -> tuple[Array, Array]:
    """Points (m, 3) spread over it, so far out of material, where the part lies on the machine; and the nominal places (m, 3) of them."""
    triangles = egg_triangles()
    edges = triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]
    normals = np.cross(*edges)
    areas = np.linalg.norm(normals, axis=1) / 2
    normals /= 2 * areas[:, None]
    places, outward = [], []
    for corners, area, normal in zip(triangles, areas, normals, strict=True):
        parts = max(2, int(np.ceil(np.sqrt(2 * area) / spacing_mm)))
        first, second = ((np.indices((parts, parts)) + 1 / 3) / parts).reshape(2, -1)
        inside = first + second < 1
        places.append(corners[0] + first[inside, None] * (corners[1] - corners[0]) + second[inside, None] * (corners[2] - corners[0]))
        outward.append(np.broadcast_to(normal, (int(inside.sum()), 3)))
    nominal, out = np.concatenate(places), np.concatenate(outward)
    noise = np.random.default_rng(3).normal(0.0, noise_mm, len(nominal)) if noise_mm else 0.0
    measured = nominal + np.broadcast_to(np.asarray(out_mm + noise)[..., None], nominal.shape) * out
    return on_machine(measured), nominal


def on_machine(points_mm: Array) -> Array:
    """Nominal places (m, 3) where the part lies on the machine."""
    return np.asarray(points_mm @ ROTATION.T + MOVED_MM)


def with_bump(scan_mm: Array, nominal_mm: Array, centre: int, radius_mm: float, height_mm: float) -> Array:
    """The same scan with a bump of a height (along the direction from the body's middle) around one of its points."""
    near = np.linalg.norm(nominal_mm - nominal_mm[centre], axis=1) < radius_mm
    away = nominal_mm / np.linalg.norm(nominal_mm, axis=1)[:, None]
    return np.where(near[:, None], scan_mm + height_mm * away @ ROTATION.T, scan_mm)


def write_scan(path: Path, points_mm: Array) -> None:
    """Write points as a table of x, y and z."""
    np.savetxt(path, points_mm, delimiter=",", header="x,y,z", comments="", fmt="%.9f")
