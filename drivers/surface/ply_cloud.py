"""Clouds of points in PLY files: vertices without faces, with their normals where the file has them. Open3D is not needed for them."""

from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from drivers.errors import MeshError
from drivers.surface.ply_header import faces_announced, header_of
from drivers.surface.stl_file import checked_scale

Array = NDArray[np.float64]

_NUMBERS: Final = {
    **{"char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4", "float": "f4", "double": "f8"},
    **{"int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2", "int32": "i4", "uint32": "u4", "float32": "f4", "float64": "f8"},
}
_ORDERS: Final = {"binary_little_endian": "<", "binary_big_endian": ">"}
_LARGEST_MM: Final = 1e6  # a kilometre: beyond it the scale is wrong
_PLACES, _NORMAL = ("x", "y", "z"), ("nx", "ny", "nz")


@dataclass(frozen=True, slots=True, eq=False)
class PlyCloud:
    """The points (n, 3) of a PLY file in mm, and their normals (n, 3) as the file has them; None where it has none."""

    points_mm: Array
    normals: Array | None

    def __post_init__(self) -> None:
        for array in (self.points_mm, self.normals):
            if array is not None:
                array.setflags(write=False)


def is_ply_cloud(path: Path) -> bool:
    """Whether a PLY file announces no faces. Raises `MeshError` for what is no such file."""
    return faces_announced(header_of(path)) == 0


def read_ply_cloud(path: Path, scale: float = 1.0) -> PlyCloud:
    """Read the vertices of a PLY file; `scale` is how many mm a unit of it is. Raises `MeshError` for what is no such file, or cut off."""
    checked_scale(scale)
    header = header_of(path)
    form, count, columns = _vertices_of(path, header.decode("latin-1").splitlines())
    try:
        with path.open("rb") as file:
            file.seek(len(header))
            body = file.read()
    except OSError as error:
        raise MeshError(f"{path}: cannot be read ({error.strerror or error}); check the path and its permissions") from error
    table = _ascii(path, body, count, columns) if form == "ascii" else _binary(path, body, count, columns, _ORDERS[form])
    points = np.column_stack([table[name] for name in _PLACES]).astype(np.float64) * scale
    if (np.abs(points) > _LARGEST_MM).any():
        raise MeshError(f"{path}: holds coordinates beyond a kilometre; check the scale, {scale:g} mm a unit")
    has_normals = all(name in columns for name in _NORMAL)
    normals = np.column_stack([table[name] for name in _NORMAL]).astype(np.float64) if has_normals else None
    return PlyCloud(points, normals)


def _vertices_of(path: Path, lines: list[str]) -> tuple[str, int, dict[str, str]]:
    """The form of a file, how many vertices it announces, and the columns of these with their kinds of numbers."""
    words = [line.split() for line in lines]
    form = next((line[1] for line in words if line[:1] == ["format"] and len(line) > 1), "")
    if form != "ascii" and form not in _ORDERS:
        raise MeshError(f"{path}: states no format of PLY that is known ('{form}'); export the points again")
    begin = next((i for i, line in enumerate(words) if line[:1] == ["element"]), len(words))
    if begin == len(words) or words[begin][1:2] != ["vertex"] or len(words[begin]) < 3 or not words[begin][2].isdigit():
        raise MeshError(f"{path}: its first element is not `vertex` with a count; export the points again")
    columns: dict[str, str] = {}
    for line in words[begin + 1 :]:
        if line[:1] == ["element"] or line == ["end_header"]:
            break
        if line[:1] == ["property"]:
            if len(line) != 3 or line[1] not in _NUMBERS:
                raise MeshError(f"{path}: a vertex has a property that is no number ({' '.join(line)}); export the points again")
            columns[line[2]] = _NUMBERS[line[1]]
    if not all(name in columns for name in _PLACES):
        raise MeshError(f"{path}: its vertices have no x, y and z ({', '.join(columns)}); export the points again")
    return form, int(words[begin][2][:18]), columns


def _binary(path: Path, body: bytes, count: int, columns: dict[str, str], order: str) -> NDArray[np.void]:
    kind = np.dtype([(name, order + number) for name, number in columns.items()])
    if len(body) < count * kind.itemsize:
        raise MeshError(f"{path}: truncated: it announces {count} vertices and holds {len(body) // kind.itemsize}; export the points again")
    return np.frombuffer(body, dtype=kind, count=count)


def _ascii(path: Path, body: bytes, count: int, columns: dict[str, str]) -> dict[str, Array]:
    lines = [line for line in body.splitlines() if line.strip()][:count]
    if len(lines) < count:
        raise MeshError(f"{path}: truncated: it announces {count} vertices and holds {len(lines)}; export the points again")
    result = np.empty((count, len(columns)))
    for number, line in enumerate(lines):
        words = line.split()
        try:
            result[number] = [float(word) for word in words[: len(columns)]]
        except ValueError:
            raise MeshError(f"{path}: vertex {number + 1} is no {len(columns)} numbers; export the points again") from None
    return {name: result[:, i] for i, name in enumerate(columns)}
