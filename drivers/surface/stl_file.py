"""STL files, binary and ASCII, to a triangle surface in millimetres, or a `MeshError` that says where the file is bad.

A file is taken whole or not at all: truncated files, wrong counts, numbers that are not finite and text that is no STL
are refused with the file, the byte offset and the triangle number. A file is binary when its size is 84 + 50 n, n being
the count at byte 80, whatever its header says: many binary files begin with the word "solid".
"""

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from io import FileIO
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from drivers.errors import MeshError

HEADER_BYTES: Final = 84  # 80 bytes of free text, then the count as a little-endian uint32
RECORD: Final = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])  # 50 bytes
FARTHEST_MM: Final = 1e6  # a kilometre: no part, but what random bytes read as floats look like
_CHUNK_TRIANGLES: Final = 100_000  # 5 MB: fits the cache, keeps the peak memory at the surface itself
_TEXT_CHUNK_BYTES: Final = 4 << 20
_FACET_WORDS: Final = 21  # facet normal x y z outer loop 3 x (vertex x y z) endloop endfacet
_KEYWORDS: Final = {
    0: b"facet", 1: b"normal", 5: b"outer", 6: b"loop", 7: b"vertex",
    11: b"vertex", 15: b"vertex", 19: b"endloop", 20: b"endfacet",
}  # fmt: skip
_CORNER_WORDS: Final = (8, 9, 10, 12, 13, 14, 16, 17, 18)
_SOLID_LINES: Final = re.compile(rb"^[ \t]*(?:end[ \t]*)?solid\b(?:(?!\sfacet\s+normal\b)[^\n])*", re.MULTILINE)  # a name ends at a facet
_COMMENTS: Final = re.compile(rb"^[ \t]*(?:#|//|;|!|%)[^\n]*", re.MULTILINE)
_BEGINNING: Final = re.compile(rb"^[ \t]*(?:solid\b|facet\s+normal\b)", re.MULTILINE | re.IGNORECASE)
_START_BYTES: Final = 1 << 16  # words before `solid` are looked for so far
_STEP_TOLD_MM: Final = 1e-3  # steps of float32 are that long from 16,384 mm on


@dataclass(frozen=True, slots=True, eq=False)
class SurfaceMesh:
    """A surface of triangles, handed out in pieces: a file of any size is never held as a whole.

    pieces     : call it for one pass over the surface; yields (k, 3, 3) float32 or float64, triangle, corner, coordinate
                 in mm, as precise as the file. A piece is valid until the next one is asked for.
    triangles  : how many in all
    lower_mm, upper_mm : (3,) the axis-parallel box that holds it
    source     : the file it came from
    kind       : "binary STL", "ASCII STL", "PLY", "OBJ"
    warnings   : what was odd and yet usable
    """

    pieces: Callable[[], Iterator[NDArray[np.floating]]]
    triangles: int
    lower_mm: NDArray[np.float64]
    upper_mm: NDArray[np.float64]
    source: str
    kind: str
    warnings: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        for array in (self.lower_mm, self.upper_mm):
            array.setflags(write=False)


def read_stl(path: Path, scale: float = 1.0) -> SurfaceMesh:
    """Read and check an STL file; STL knows no unit, so `scale` says how many mm one unit of the file is.

    Raises `MeshError` for a file that is empty, truncated, no STL, or holds numbers that cannot be a part in mm.
    """
    checked_scale(scale)
    try:
        return _read(path, scale)
    except OSError as error:
        raise MeshError(_words_of_unreadable(path, error)) from error


def _read(path: Path, scale: float) -> SurfaceMesh:
    size, start = _size_and_start(path)
    head = start[:HEADER_BYTES]
    if size == 0:
        raise MeshError(f"{path}: the file is empty (0 bytes); export the surface again")
    promised = int.from_bytes(head[80:84], "little") if size >= HEADER_BYTES else None
    if promised is not None and size == HEADER_BYTES + RECORD.itemsize * promised:
        mesh = _check(lambda: _binary_pieces(path, promised, scale), str(path), "binary STL")
        return replace(mesh, warnings=rounding_note(mesh, scale))
    if start[:2] in (b"\xff\xfe", b"\xfe\xff"):
        raise MeshError(f"{path}: the text is written in UTF-16; save it as plain text (UTF-8), or export it as binary STL")
    if _looks_like_text(start):
        corners, warnings = _text_corners(path)
        return surface_of(corners * scale, str(path), "ASCII STL", warnings)
    raise MeshError(_why_no_stl(path, size, promised))


def checked_scale(scale: float) -> None:
    """Raise `MeshError` for a scale that is no positive number."""
    if not (np.isfinite(scale) and scale > 0):
        raise MeshError(f"scale {scale}: how many mm one unit of the file is must be a positive number")


def refuse_endless(path: Path) -> None:
    """Raise `MeshError` for what is there and is no file on disk: opening a pipe waits for ever, a device never ends."""
    if path.exists() and not path.is_file() and not path.is_dir():
        raise MeshError(f"{path}: a pipe or a device, not a file; copy the surface into a file first")
    if path.is_file() and not path.stat().st_size:  # what the system makes while it is read has no size, and may have no end
        raise MeshError(f"{path}: the file is empty (0 bytes); export the surface again")


def read_whole(path: Path) -> bytes:
    """Return the bytes of a file. Raises `MeshError` for what cannot be read, and for an empty file."""
    try:
        refuse_endless(path)
        content = path.read_bytes()
    except OSError as error:
        raise MeshError(_words_of_unreadable(path, error)) from error
    if not content:
        raise MeshError(f"{path}: the file is empty (0 bytes); export the surface again")
    return content


def _words_of_unreadable(path: Path, error: OSError) -> str:
    return f"{path}: cannot be read ({error.strerror or error}); check the path and its permissions"


def _size_and_start(path: Path) -> tuple[int, bytes]:
    refuse_endless(path)
    with path.open("rb") as file:
        size = file.seek(0, 2)
        file.seek(0)
        return size, file.read(_START_BYTES)


def rounding_note(mesh: SurfaceMesh, scale: float) -> tuple[str, ...]:
    """Say by how much float32 rounds coordinates so far from the origin, where that is no longer small beside a tolerance."""
    largest_mm = float(max(np.abs(mesh.lower_mm).max(), np.abs(mesh.upper_mm).max()))
    step_mm = float(np.spacing(np.float32(largest_mm / scale))) * scale
    if step_mm < _STEP_TOLD_MM:
        return ()
    return (
        f"coordinates reach {largest_mm:.6g} mm, and float32, in which they were stored, knows only steps of {step_mm:.2g} mm there: "
        "every corner may be rounded by so much. Export the surface near the origin",
    )


def surface_of(corners_mm: NDArray[np.floating], source: str, kind: str, warnings: tuple[str, ...] = ()) -> SurfaceMesh:
    """Make a surface of corners in memory, (n, 3, 3); raises `MeshError` when there are none or one is not a coordinate."""
    if corners_mm.ndim != 3 or corners_mm.shape[1:] != (3, 3):
        raise ValueError(f"expected (n, 3, 3) corners, got {corners_mm.shape}")

    def pieces() -> Iterator[NDArray[np.floating]]:
        for start in range(0, len(corners_mm), _CHUNK_TRIANGLES):
            yield corners_mm[start : start + _CHUNK_TRIANGLES]

    return _check(pieces, source, kind, warnings)


def _check(pieces: Callable[[], Iterator[NDArray[np.floating]]], source: str, kind: str, warnings: tuple[str, ...] = ()) -> SurfaceMesh:
    """Go over the surface once for its box and its number of triangles. Raises MeshError for the first triangle that cannot be used."""
    count = 0
    lower, upper = np.full(3, np.inf), np.full(3, -np.inf)
    for piece in pieces():
        low, high = _box(piece)
        if not (low.min() >= -FARTHEST_MM and high.max() <= FARTHEST_MM):  # false for NaN as well
            raise MeshError(_complaint(piece, count, source, kind == "binary STL"))
        lower, upper = np.minimum(lower, low), np.maximum(upper, high)
        count += len(piece)
    if count == 0:
        raise MeshError(f"{source}: the surface holds no triangle; export it again")
    return SurfaceMesh(pieces, count, lower, upper, source, kind, warnings)


def _box(corners: NDArray[np.floating]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the lowest and the highest coordinates, (3,) each; NaN stays NaN. Rows are long: numpy reduces those ten times faster."""
    rows = len(corners) // 100
    tall = corners[: 100 * rows].reshape(rows, -1) if rows else corners.reshape(len(corners), -1)
    rest = corners[100 * rows :].reshape(-1, 3) if rows else corners[:0].reshape(-1, 3)
    low = np.concatenate([tall.min(axis=0).reshape(-1, 3), rest]).min(axis=0)
    high = np.concatenate([tall.max(axis=0).reshape(-1, 3), rest]).max(axis=0)
    return low.astype(np.float64), high.astype(np.float64)


def _complaint(corners: NDArray[np.floating], first: int, source: str, binary: bool) -> str:
    """Name the first coordinate that is not finite or beyond `FARTHEST_MM`; `first` triangles came before corners[0]."""
    triangle, corner, axis = (int(i) for i in np.argwhere(~(np.abs(corners) <= FARTHEST_MM))[0])
    number = first + triangle + 1
    place = f" (byte {HEADER_BYTES + RECORD.itemsize * (number - 1) + 12 + 12 * corner + 4 * axis})" if binary else ""
    return (
        f"{source}: triangle {number}{place}: {'xyz'[axis]} of corner {corner + 1} is {corners[triangle, corner, axis]:g}, "
        f"not a coordinate of a part in mm (limit {FARTHEST_MM:g}); export the surface again"
    )


def _looks_like_text(start: bytes) -> bool:
    """Tell an ASCII file by a line that begins with `solid` or with a facet; comments, a title or empty lines may stand before it."""
    return b"\0" not in start and _BEGINNING.search(_without_mark(start).replace(b"\r", b"\n")) is not None


def _without_mark(text: bytes) -> bytes:
    """Overwrite the byte order mark of UTF-8 with blanks."""
    return text.replace(b"\xef\xbb\xbf", b"   ")


def _why_no_stl(path: Path, size: int, promised: int | None) -> str:
    """Say what is wrong with a file that is neither a whole binary STL nor text that begins with "solid"."""
    if promised is None:
        return f"{path}: {size} bytes are too few for an STL file (a binary header alone has {HEADER_BYTES}); export the surface again"
    whole, rest = divmod(size - HEADER_BYTES, RECORD.itemsize)
    place = f"byte {HEADER_BYTES + RECORD.itemsize * whole}"
    if promised > whole:
        reason = f"truncated, or no STL: byte 80 promises {promised} triangles, the file ends in triangle {whole + 1} ({place})"
    elif rest:
        left = size - HEADER_BYTES - RECORD.itemsize * promised
        reason = f"byte 80 promises {promised} triangles, but {left} bytes follow them, no whole number of triangles"
    else:
        reason = f"wrong count: byte 80 promises {promised} triangles, the file holds {whole} (to {place})"
    return f"{path}: {reason}; {size} bytes in all. Export or copy the file again"


def _binary_pieces(path: Path, count: int, scale: float) -> Iterator[NDArray[np.floating]]:
    """Yield a binary file once, in pieces that share one buffer."""
    records = np.empty(min(_CHUNK_TRIANGLES, count), RECORD)
    corners = np.empty((len(records), 3, 3), np.float32)
    with path.open("rb", buffering=0) as file:
        file.seek(HEADER_BYTES)
        for start in range(0, count, _CHUNK_TRIANGLES):
            wanted = min(_CHUNK_TRIANGLES, count - start)
            _read_all(file, records[:wanted].view(np.uint8).data, path)
            corners[:wanted] = records["corners"][:wanted]
            yield corners[:wanted] if scale == 1.0 else corners[:wanted] * np.float64(scale)


def _read_all(file: FileIO, buffer: memoryview, path: Path) -> None:
    got = 0
    while got < len(buffer):
        more = file.readinto(buffer[got:])
        if not more:
            raise MeshError(f"{path}: the file became shorter while it was read (it now ends at byte {file.tell()}); try when it is whole")
        got += more


def _text_corners(path: Path) -> tuple[NDArray[np.float64], tuple[str, ...]]:
    """Read an ASCII file in pieces that end at an `endfacet`; return corners (n, 3, 3), and warnings of what was odd."""
    pieces: list[NDArray[np.float64]] = [np.empty((0, 3, 3))]
    count, offset, rest, commas, before = 0, 0, b"", False, 0
    with path.open("rb") as file:
        while chunk := file.read(_TEXT_CHUNK_BYTES):
            text = rest + chunk.lower().replace(b"\r", b"\n")
            if not pieces[1:] and not rest:
                text, before = _blank_start(text)
            cut = text.rfind(b"endfacet")
            cut = 0 if cut < 0 else cut + len(b"endfacet")
            if cut:
                pieces.append(_facets(text[:cut], count, offset, str(path)))
                count += len(pieces[-1])
                commas = commas or b"," in text[:cut]
            rest, offset = text[cut:], offset + cut
    left, behind = _without_words_behind(_blank_solid_lines(rest), rest.rfind(b"endsolid"))
    if left.strip():
        place = offset + len(left.rstrip()) - len(left.split()[-1])
        raise MeshError(f"{path}: the text breaks off in triangle {count + 1} (byte {place}); export or copy the file again")
    warnings: tuple[str, ...] = ("decimal commas were read as decimal points",) if commas else ()
    if before:
        warnings += (f"{before} line(s) before `solid` are no triangles and were left out",)
    if behind:
        warnings += (f"{behind} line(s) behind the last `endsolid` are no triangles and were left out",)
    if b"endsolid" not in rest.replace(b" ", b""):
        warnings += ("the text ends without endsolid; every triangle in it is whole",)
    return np.concatenate(pieces), warnings


def _blank_start(text: bytes) -> tuple[bytes, int]:
    """Overwrite what stands before the first `solid` or facet with blanks; return how many lines of words that were as well."""
    text = _without_mark(text)
    beginning = _BEGINNING.search(text)
    start = beginning.start() if beginning else 0
    return b" " * start + text[start:], sum(bool(line.strip()) for line in text[:start].splitlines())


def _without_words_behind(left: bytes, end: int) -> tuple[bytes, int]:
    """Take words behind the last `endsolid`, which stands at `end`, from what is left of a text; and count their lines."""
    words = left[end:] if end >= 0 else b""
    if not words.strip() or any(keyword in words for keyword in (b"facet", b"vertex", b"loop")):
        return left, 0
    return left[:end], sum(bool(line.strip()) for line in words.splitlines())


def _blank_solid_lines(text: bytes) -> bytes:
    """Overwrite `solid NAME`, `endsolid NAME` and comments with blanks, so that every other byte keeps its place."""
    text = _without_mark(text)
    if b"solid" in text:
        text = _SOLID_LINES.sub(lambda line: b" " * len(line.group()), text)
    if any(mark in text for mark in (b"#", b"//", b";", b"!", b"%")):
        text = _COMMENTS.sub(lambda line: b" " * len(line.group()), text)
    return text


def _facets(text: bytes, first: int, offset: int, source: str) -> NDArray[np.float64]:
    """Return the corners (n, 3, 3) of a text that holds whole facets only. Raises MeshError, naming the first word at fault."""
    body = _blank_solid_lines(text).replace(b",", b".")
    words = body.split()
    count = len(words) // _FACET_WORDS
    whole = len(words) == count * _FACET_WORDS and all(words[at::_FACET_WORDS].count(keyword) == count for at, keyword in _KEYWORDS.items())
    if whole:
        try:
            return np.column_stack([np.array(words[at::_FACET_WORDS]).astype(np.float64) for at in _CORNER_WORDS]).reshape(-1, 3, 3)
        except ValueError:
            pass  # the word at fault is sought below
    raise MeshError(_complaint_of_text(body, first, offset, source))


def _complaint_of_text(body: bytes, first: int, offset: int, source: str) -> str:
    for index, match in enumerate(re.finditer(rb"\S+", body)):
        place = index % _FACET_WORDS
        expected = _KEYWORDS.get(place)
        if (match.group() != expected) if expected else not _is_number(match.group()):
            found = match.group().decode("ascii", "replace")[:30]
            wanted = f"the word {expected.decode()!r}" if expected else "a number"
            return (
                f"{source}: triangle {first + index // _FACET_WORDS + 1} (byte {offset + match.start()}): found {found!r}, "
                f"expected {wanted}; only triangles are read. Export the surface again"
            )
    return f"{source}: triangle {first + 1} (byte {offset}): the text is no list of triangles; export the surface again"


def _is_number(word: bytes) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return True
