"""Small surfaces for the tests, and STL files written by hand: byte by byte, by nothing under test."""

import struct
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

Triangles = NDArray[np.float64]
A, B = 12.0, 5.0  # half axes of an ellipse; below 16 mm a float32 is good to 0.5e-6 mm


def box(lower: tuple[float, float, float], upper: tuple[float, float, float]) -> Triangles:
    """The 12 triangles of a closed box, outward."""
    corners = np.array(
        [[x, y, z] for x in (lower[0], upper[0]) for y in (lower[1], upper[1]) for z in (lower[2], upper[2])], dtype=np.float64
    )
    faces = [
        (0, 1, 3), (0, 3, 2), (4, 6, 7), (4, 7, 5), (0, 4, 5), (0, 5, 1),
        (2, 3, 7), (2, 7, 6), (0, 2, 6), (0, 6, 4), (1, 5, 7), (1, 7, 3),
    ]  # fmt: skip
    triangles: Triangles = corners[np.array(faces)]
    return triangles


def ellipse(points: int) -> Triangles:
    """Points (m, 2) of the ellipse with the half axes A and B, even in its angle."""
    angle = 2 * np.pi * np.arange(points) / points
    return np.column_stack([A * np.cos(angle), B * np.sin(angle)])


def tube(profile: NDArray[np.float64], heights: NDArray[np.float64]) -> Triangles:
    """An open-ended extrusion of a closed (m, 2) profile through these heights."""
    rings = np.stack([np.column_stack([profile, np.full(len(profile), z)]) for z in heights])
    a, b = rings[:-1], np.roll(rings[:-1], -1, axis=1)
    d, c = rings[1:], np.roll(rings[1:], -1, axis=1)
    return np.concatenate([np.stack([a, b, c], axis=2).reshape(-1, 3, 3), np.stack([a, c, d], axis=2).reshape(-1, 3, 3)])


def rotation(axis: tuple[float, float, float], angle_rad: float) -> NDArray[np.float64]:
    unit = np.array(axis) / np.linalg.norm(axis)
    cross = np.array([[0, -unit[2], unit[1]], [unit[2], 0, -unit[0]], [-unit[1], unit[0], 0]])
    turned: NDArray[np.float64] = np.eye(3) + np.sin(angle_rad) * cross + (1 - np.cos(angle_rad)) * cross @ cross
    return turned


def binary_stl(triangles: Triangles, header: bytes = b"made for a test", count: int | None = None) -> bytes:
    records = [struct.pack("<12fH", 0, 0, 0, *corners, 0) for corners in triangles.reshape(-1, 9)]
    return header.ljust(80, b"\0") + struct.pack("<I", len(triangles) if count is None else count) + b"".join(records)


def ascii_stl(triangles: Triangles) -> str:
    facets = "".join(
        "facet normal 0 0 0\n  outer loop\n" + "".join(f"    vertex {x!r} {y!r} {z!r}\n" for x, y, z in corners) + "  endloop\nendfacet\n"
        for corners in triangles.tolist()
    )
    return f"solid made for a test\n{facets}endsolid made for a test\n"


def write(path: Path, content: bytes | str) -> Path:
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    return path
