"""The bodies of records: the data of a run to bytes and back. Little-endian on every machine, without padding, all values exact.

- wire: n as uint32, n arrival times (float64), n sizes (uint32), the bytes of all reads
- points, 40 bytes each: all sequence numbers (int64), all device times (float64), all x y z (float64)
- normals, 24 bytes each: the outward direction x y z (float64) of every point in the record before, NaN where it is not known
- deviations, 50 bytes each: all actual points and feet (x y as float64), stations, deviations (float64), verdicts, rejections (int8)
- all others: JSON (UTF-8, sorted keys), or the file as it was (plan, nominal)
"""

import dataclasses
import json
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, get_args

import numpy as np
from numpy.typing import NDArray

from cmmlink.errors import StoreError
from cmmlink.record.shapes import Placed, checked, read_document
from drivers import Arrival, PointBatch, WireBytes
from inspection import NOT_JUDGED, JudgedRows, Rejection, Verdict

POINT_BYTES = 40
_NORMAL_BYTES = 24
_JUDGED_BYTES = 50
JUDGED_ROWS = 20_000  # of a record of deviations: about a megabyte
_ARRIVALS = {kind.__name__: kind for kind in get_args(Arrival) if kind not in (PointBatch, WireBytes)}


@dataclass(frozen=True, slots=True)
class PlacedArrival:
    """An arrival other than bytes and points, with its place in the run: the numbers of reads and of points before it."""

    time_s: float
    reads: int
    points: int
    arrival: Arrival


def pack_document(document: object) -> bytes:
    """Spell a document of plain values as JSON; the same document always gives the same bytes."""
    return json.dumps(document, sort_keys=True, ensure_ascii=False, separators=(",", ":")).encode()


def unpack_document(body: bytes) -> Any:
    """Read a document. Raises StoreError where it is none."""
    return read_document(body)


def pack_reads(reads: Sequence[WireBytes]) -> bytes:
    """Pack consecutive reads."""
    times = np.array([read.time_s for read in reads], dtype="<f8")
    sizes = np.array([len(read.data) for read in reads], dtype="<u4")
    return b"".join([len(reads).to_bytes(4, "little"), times.tobytes(), sizes.tobytes(), *(read.data for read in reads)])


def unpack_reads(body: bytes) -> list[WireBytes]:
    """Unpack reads."""
    count = int.from_bytes(body[:4], "little")
    start = 4 + 12 * count
    if start > len(body):
        raise StoreError(f"a record of wire bytes says it holds {count} reads but has only {len(body)} bytes")
    times = np.frombuffer(body, "<f8", count, 4).tolist()
    ends = start + np.cumsum(np.frombuffer(body, "<u4", count, 4 + 8 * count), dtype=np.int64)
    begins = [start, *ends[:-1].tolist()]
    return [WireBytes(time_s, body[begin:end]) for time_s, begin, end in zip(times, begins, ends.tolist(), strict=True)]


def pack_points(batches: Sequence[PointBatch], most: int) -> Iterator[tuple[int, bytes]]:
    """Pack consecutive points into bodies of at most `most` points. Yields each body with its number of points."""
    sequence = np.concatenate([batch.sequence for batch in batches])
    time_s = np.concatenate([batch.time_s for batch in batches])
    points = np.concatenate([batch.points_mm for batch in batches])
    for first in range(0, len(sequence), most):
        rows = slice(first, first + most)
        columns = (sequence[rows].astype("<i8"), time_s[rows].astype("<f8"), points[rows].astype("<f8"))
        yield len(columns[0]), b"".join(column.tobytes() for column in columns)


def pack_normals(batches: Sequence[PointBatch], most: int) -> Iterator[tuple[int, bytes]]:
    """Pack the normals of consecutive points, cut as `pack_points` cuts these; nothing where none of them has any."""
    if all(batch.normals is None for batch in batches):
        return
    normals = np.concatenate([np.full((len(batch), 3), np.nan) if batch.normals is None else batch.normals for batch in batches])
    for first in range(0, len(normals), most):
        rows = normals[first : first + most]
        yield len(rows), rows.astype("<f8").tobytes()


def unpack_points(body: bytes, normals: bytes | None = None) -> PointBatch:
    """Unpack points, with their normals where there is a record of them."""
    count, rest = divmod(len(body), POINT_BYTES)
    if rest:
        raise StoreError(f"a record of points has {len(body)} bytes, no multiple of {POINT_BYTES}")
    sequence = np.frombuffer(body, "<i8", count).astype(np.int64)
    time_s = np.frombuffer(body, "<f8", count, 8 * count).astype(np.float64)
    points = np.frombuffer(body, "<f8", 3 * count, 16 * count).astype(np.float64)
    return PointBatch(sequence, time_s, points.reshape(count, 3), None if normals is None else _unpack_normals(normals, count))


def _unpack_normals(body: bytes, count: int) -> NDArray[np.float64]:
    if len(body) != count * _NORMAL_BYTES:
        raise StoreError(f"a record of the normals of {count} points has {len(body)} bytes, not {_NORMAL_BYTES} for each")
    return np.frombuffer(body, "<f8").astype(np.float64).reshape(count, 3)


def pack_arrivals(moments: Iterable[PlacedArrival]) -> bytes:
    """Pack arrivals with their place."""
    return pack_document(
        [
            {
                "event": type(moment.arrival).__name__,
                "time_s": moment.time_s,
                "reads": moment.reads,
                "points": moment.points,
                "values": dataclasses.asdict(moment.arrival),
            }
            for moment in moments
        ]
    )


def unpack_arrivals(body: bytes) -> list[PlacedArrival]:
    """Unpack arrivals. Raises StoreError for an arrival that this version does not know, or that is none."""
    return [_placed_arrival(entry) for entry in checked(list[Placed], unpack_document(body))]


def _placed_arrival(entry: Placed) -> PlacedArrival:
    if entry.event not in _ARRIVALS:
        raise StoreError(f"the record holds an event {entry.event!r} that this version of cmmlink does not know")
    return PlacedArrival(entry.time_s, entry.reads, entry.points, checked(_ARRIVALS[entry.event], entry.values))


def pack_judged(blocks: Iterable[JudgedRows]) -> Iterator[tuple[int, bytes]]:
    """Pack the rows of a result, which come JUDGED_ROWS at a time, into a body each. Yields each body with its number of rows."""
    for rows in blocks:
        floats = (rows.actual_mm, rows.foot_mm, rows.station_mm, rows.deviation_mm)
        columns = [column.astype("<f8").tobytes() for column in floats]
        columns += [column.astype("i1").tobytes() for column in (rows.verdicts, rows.rejection)]
        yield rows.received, b"".join(columns)


def unpack_judged(body: bytes) -> JudgedRows:
    """Unpack rows of a result."""
    count, rest = divmod(len(body), _JUDGED_BYTES)
    if rest:
        raise StoreError(f"a record of deviations has {len(body)} bytes, no multiple of {_JUDGED_BYTES}")

    def floats(place: int, width: int) -> NDArray[np.float64]:
        values = np.frombuffer(body, "<f8", width * count, 8 * place * count).astype(np.float64)
        return values.reshape(count, width) if width > 1 else values

    codes = np.frombuffer(body, np.int8, 2 * count, 48 * count)
    verdicts, rejection = codes[:count], codes[count:]
    if not (np.isin(verdicts, [NOT_JUDGED, *Verdict]).all() and np.isin(rejection, list(Rejection)).all()):
        raise StoreError("a record of deviations has verdicts or reasons that this version of cmmlink does not know")
    return JudgedRows(floats(0, 2), floats(2, 2), floats(4, 1), floats(5, 1), verdicts, rejection)
