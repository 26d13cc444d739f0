"""The header of a PLY file: how many faces it announces, and the same file with a header that every reader takes.

Open3D finds nothing in a file whose header has a `comment` or an empty line without words, and says nothing.
"""

import re
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Final

from drivers.errors import MeshError
from drivers.surface.stl_file import refuse_endless

_MOST_BYTES: Final = 1 << 20
_END: Final = re.compile(rb"^end_header[ \t]*\r?\n", re.MULTILINE)
_WORDLESS: Final = re.compile(rb"^(?:[ \t]*|(?:comment|obj_info)[ \t]*)\r?\n", re.MULTILINE)
_FACES: Final = re.compile(rb"^element[ \t]+face[ \t]+(\d+)", re.MULTILINE)


def header_of(path: Path) -> bytes:
    """Return the header, to the end of its last line. Raises `MeshError` where there is none."""
    try:
        refuse_endless(path)
        with path.open("rb") as file:
            start = file.read(_MOST_BYTES)
    except OSError as error:
        raise MeshError(f"{path}: cannot be read ({error.strerror or error}); check the path and its permissions") from error
    end = _END.search(start)
    if not start.startswith(b"ply") or end is None:
        raise MeshError(f"{path}: no PLY file, or truncated: it has no header from `ply` to `end_header`; export the surface again")
    return start[: end.end()]


def faces_announced(header: bytes) -> int:
    """Return how many faces the header announces; 0 for a point cloud."""
    found = _FACES.search(header)
    return int(found.group(1)[:18]) if found else 0


@contextmanager
def readable(path: Path, header: bytes) -> Iterator[Path]:
    """Hand out the file itself, or a copy without the lines that Open3D stumbles on, which is gone afterwards."""
    plain = _WORDLESS.sub(b"", header)
    if plain == header:
        yield path
        return
    with TemporaryDirectory(prefix="cmmlink-") as folder:
        copy = Path(folder) / "surface.ply"
        try:
            with path.open("rb") as source, copy.open("wb") as target:
                source.seek(len(header))
                target.write(plain)
                shutil.copyfileobj(source, target)
        except OSError as error:
            raise MeshError(f"{path}: cannot be read, or copied to {folder} ({error.strerror or error})") from error
        yield copy
