"""OBJ files to a triangle surface in millimetres: faces are read, with all their corners, and nothing else becomes a triangle.

Lines, points and free-form elements beside the faces are left out and counted. A polygon is cut into triangles that keep every
corner, also where it is hollow or not in a plane.
"""

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from drivers.errors import MeshError
from drivers.surface.stl_file import SurfaceMesh, checked_scale, read_whole, surface_of

_LEFT_OUT: Final = {b"l": "lines", b"p": "points", b"curv": "curves", b"curv2": "trimming curves", b"surf": "free-form surfaces"}
_FLAT: Final = 1e-5  # of a polygon's size: coordinates written with six digits leave the plane by no more


@dataclass(frozen=True, slots=True, eq=False)
class _Text:
    """What the lines hold: corners (v, 3) in the file's unit, faces as vertex numbers from 0, notes on what was left out."""

    corners: NDArray[np.float64]
    faces: list[list[int]]
    notes: tuple[str, ...]


def read_obj(path: Path, scale: float = 1.0) -> SurfaceMesh:
    """Read the faces of an OBJ file; OBJ knows no unit, so `scale` says how many mm one unit of the file is.

    Raises `MeshError`, with the line, for what cannot be read, and for a file without faces.
    """
    checked_scale(scale)
    text = _parse(read_whole(path), path)
    by_size: dict[int, list[list[int]]] = {}
    for face in text.faces:
        by_size.setdefault(len(face), []).append(face)
    triangles, off = [np.empty((0, 3), dtype=np.intp)], []
    with np.errstate(over="ignore", invalid="ignore"):  # what is no coordinate of a part is refused with its triangle
        corners_mm = text.corners * scale
        for size, faces in sorted(by_size.items()):
            numbers = np.array(faces, dtype=np.intp)  # (f, size)
            off.append(_off_plane_mm(corners_mm[numbers]))
            triangles.append(_cut_up(numbers, corners_mm) if size > 3 else numbers)
    notes = text.notes + _note_on_planes(np.concatenate(off)) if off else text.notes
    if not text.faces:
        raise MeshError(f"{path}: no face is in it{_with(notes)}; export the surface again, or as STL")
    return surface_of(corners_mm[np.concatenate(triangles)], str(path), "OBJ", notes)


def _with(notes: tuple[str, ...]) -> str:
    return f" ({'; '.join(notes)})" if notes else ", only other things, or no OBJ at all"


def _parse(content: bytes, path: Path) -> _Text:
    corners: list[list[float]] = []
    faces: list[tuple[int, list[int]]] = []
    left_out: Counter[bytes] = Counter()
    flat = 0
    for number, words in _lines(content):
        if words[0] == b"v":
            corners.append(_coordinates(words, path, number))
        elif words[0] in (b"f", b"fo"):  # fo is the name that old files give to f
            face = _face(words, len(corners), path, number)
            if len(set(face)) < 3:
                flat += 1
            else:
                faces.append((number, face))
        elif words[0] in _LEFT_OUT:
            left_out[words[0]] += 1
    _refuse_missing(faces, len(corners), path)
    what = ", ".join(f"{count} {_LEFT_OUT[word]} ({word.decode()})" for word, count in left_out.items())
    notes: tuple[str, ...] = (f"only faces are a surface; left out: {what}",) if what else ()
    if flat:
        notes += (f"{flat} face(s) with fewer than three different corners were left out",)
    return _Text(np.array(corners, dtype=np.float64).reshape(-1, 3), [face for _, face in faces], notes)


def _lines(content: bytes) -> Iterator[tuple[int, list[bytes]]]:
    """Yield the words of each line that has any, with its number; a line that ends in a backslash goes on in the next."""
    begun: list[bytes] = []
    for number, line in enumerate(content.removeprefix(b"\xef\xbb\xbf").splitlines(), 1):
        text = line.partition(b"#")[0].rstrip()
        goes_on = text.endswith(b"\\")
        begun += text.removesuffix(b"\\").split()
        if begun and not goes_on:
            yield number, begun
            begun = []
    if begun:
        yield number, begun


def _coordinates(words: list[bytes], path: Path, line: int) -> list[float]:
    try:
        x, y, z = (float(word) for word in words[1:4])
    except ValueError:
        found = b" ".join(words)[:40].decode("ascii", "replace")
        raise MeshError(f"{path}: line {line}: {found!r} is no corner; expected v and three numbers. Export the surface again") from None
    return [x, y, z]


def _face(words: list[bytes], there: int, path: Path, line: int) -> list[int]:
    """Return vertex numbers from 0, a corner that follows itself taken once; negative numbers count back from the last vertex so far."""
    face: list[int] = []
    for word in words[1:]:
        try:
            number = int(word.partition(b"/")[0])
        except ValueError:
            found = word[:30].decode("ascii", "replace")
            raise MeshError(f"{path}: line {line}: {found!r} names no vertex of a face; export the surface again") from None
        at = number - 1 if number > 0 else there + number
        if number == 0 or at < 0:
            raise MeshError(f"{path}: line {line}: the face names vertex {number}, which is not there; export the surface again")
        if not face or face[-1] != at:
            face.append(at)
    return face[:-1] if len(face) > 1 and face[0] == face[-1] else face


def _refuse_missing(faces: list[tuple[int, list[int]]], there: int, path: Path) -> None:
    for line, face in faces:
        if max(face) >= there:
            missing = f"vertex {max(face) + 1}, which is not there (there are {there})"
            raise MeshError(f"{path}: line {line}: the face names {missing}; export the surface again")


def _note_on_planes(off_mm: NDArray[np.float64]) -> tuple[str, ...]:
    bent = off_mm > 0
    if not bent.any():
        return ()
    return (
        f"{np.count_nonzero(bent)} polygon(s) are not in a plane (by up to {off_mm.max():.3g} mm): all corners were kept, but the surface "
        "between them is not known better than that",
    )


def _normals(corners_mm: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the area vectors (f, 3) of polygons (f, n, 3), by Newell's method: twice their area, hollow or not."""
    local = corners_mm - corners_mm[:, :1]
    return np.asarray(np.cross(local, np.roll(local, -1, axis=1)).sum(axis=1))


def _off_plane_mm(corners_mm: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return how far the corners of polygons (f, n, 3) lie off their mean plane, (f,); 0 where that is what few digits do."""
    normal = _normals(corners_mm)
    unit = normal / np.maximum(np.linalg.norm(normal, axis=1), np.finfo(float).tiny)[:, None]
    local = corners_mm - corners_mm.mean(axis=1, keepdims=True)
    off = np.abs((local * unit[:, None, :]).sum(axis=2)).max(axis=1)
    return np.where(off > _FLAT * np.linalg.norm(np.ptp(corners_mm, axis=1), axis=1), off, 0.0)


def _cut_up(faces: NDArray[np.intp], corners_mm: NDArray[np.float64]) -> NDArray[np.intp]:
    """Cut polygons (f, n) into triangles (t, 3). Those that a fan from one corner fills are cut at once; the others by their ears."""
    normal = _normals(corners_mm[faces])
    done, left = [], np.arange(len(faces))
    for start in range(faces.shape[1]):
        turned = np.roll(faces[left], -start, axis=1)
        fan = np.stack([np.broadcast_to(turned[:, :1], turned[:, 2:].shape), turned[:, 1:-1], turned[:, 2:]], axis=2)
        areas = np.cross(corners_mm[fan[:, :, 1]] - corners_mm[fan[:, :, 0]], corners_mm[fan[:, :, 2]] - corners_mm[fan[:, :, 0]])
        fills = np.all((areas * normal[left, None, :]).sum(axis=2) >= 0, axis=1)
        done.append(fan[fills].reshape(-1, 3))
        left = left[~fills]
    done += [_ears(faces[at], corners_mm[faces[at]], normal[at]) for at in left]
    return np.concatenate(done)


def _ears(face: NDArray[np.intp], corners_mm: NDArray[np.float64], normal: NDArray[np.float64]) -> NDArray[np.intp]:
    """Cut ears off a hollow polygon (n,) until a triangle is left; n - 2 triangles, so that no corner is lost.

    G. H. Meisters, Polygons have ears, 1975: a simple polygon always has two; where none is found it crosses itself.
    """
    drop = int(np.argmax(np.abs(normal)))
    x, y = (corners_mm[:, axis] for axis in ((1, 2), (2, 0), (0, 1))[drop])
    x, y = (x, y) if normal[drop] > 0 else (y, x)
    place = list(zip(x.tolist(), y.tolist(), strict=True))  # a corner given twice (a bridge to a hole) lies in no ear

    def left_of(a: int, b: int, c: int) -> float:
        return float((x[b] - x[a]) * (y[c] - y[a]) - (x[c] - x[a]) * (y[b] - y[a]))

    def is_ear(a: int, b: int, c: int) -> bool:
        return left_of(a, b, c) > 0 and not any(
            left_of(a, b, p) >= 0 and left_of(b, c, p) >= 0 and left_of(c, a, p) >= 0
            for p in rest
            if place[p] not in (place[a], place[b], place[c])
        )

    rest, cut = list(range(len(face))), []
    while len(rest) > 3:
        at = next((i for i in range(len(rest)) if is_ear(rest[i - 1], rest[i], rest[(i + 1) % len(rest)])), 0)
        cut.append((rest[at - 1], rest[at], rest[(at + 1) % len(rest)]))
        del rest[at]
    return np.asarray(face[np.array([*cut, tuple(rest)])], dtype=np.intp)
