"""The rows of a surface's result to bytes and back. Little-endian on every machine, without padding, all values exact.

A point takes 74 bytes, column by column: actual points and feet (x y z as float64), deviations (float64), normals (float32), faces
(int32), verdicts and rejections (int8).
"""

from collections.abc import Iterable, Iterator

import numpy as np
from numpy.typing import NDArray

from cmmlink.errors import StoreError
from cmmlink.surface_rows import SurfaceRows
from inspection import NOT_JUDGED, Rejection, Verdict

_ROW_BYTES = 74


def pack_surface(blocks: Iterable[SurfaceRows]) -> Iterator[tuple[int, bytes]]:
    """Pack the rows of a result into a body a block. Yields each body with its number of rows."""
    for rows in blocks:
        columns = [column.astype("<f8").tobytes() for column in (rows.actual_mm, rows.foot_mm, rows.deviation_mm)]
        columns += [rows.normal.astype("<f4").tobytes(), rows.face.astype("<i4").tobytes()]
        columns += [column.astype("i1").tobytes() for column in (rows.verdicts, rows.rejection)]
        yield rows.received, b"".join(columns)


def unpack_surface(body: bytes) -> SurfaceRows:
    """Unpack rows of a result. Raises StoreError where they are none."""
    count, rest = divmod(len(body), _ROW_BYTES)
    if rest:
        raise StoreError(f"a record of a surface's deviations has {len(body)} bytes, no multiple of {_ROW_BYTES}")

    def floats(place: int, width: int) -> NDArray[np.float64]:
        return np.frombuffer(body, "<f8", width * count, 8 * place * count).astype(np.float64)

    normals = np.frombuffer(body, "<f4", 3 * count, 56 * count).astype(np.float32).reshape(count, 3)
    face = np.frombuffer(body, "<i4", count, 68 * count).astype(np.int32)
    codes = np.frombuffer(body, np.int8, 2 * count, 72 * count)
    verdicts, rejection = codes[:count], codes[count:]
    if not (np.isin(verdicts, [NOT_JUDGED, *Verdict]).all() and np.isin(rejection, list(Rejection)).all()):
        raise StoreError("a record of deviations has verdicts or reasons that this version of cmmlink does not know")
    actual, foot = floats(0, 3).reshape(count, 3), floats(3, 3).reshape(count, 3)
    return SurfaceRows(actual, face, foot, normals, floats(6, 1), verdicts, rejection)
