"""What is fuzzed: every reader of files, plans, maps, records and messages, and every codec, each with sound inputs to begin from.

A target takes bytes and ends, with a result or with one of the errors that it documents. Anything else is a crash.
"""

import io
import shutil
import sqlite3
import struct
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager, suppress
from dataclasses import dataclass
from functools import cache
from itertools import pairwise
from pathlib import Path
from random import Random
from tempfile import TemporaryDirectory

import numpy as np

from cmmlink.console.commands import receive
from cmmlink.console.refused import Refused
from cmmlink.demo import plan_file
from cmmlink.devices import decoder_of
from cmmlink.errors import PlanError, RunError, StoreError
from cmmlink.nominal_files import load_nominal
from cmmlink.plan import load_ct_plan, load_plan, map_of
from cmmlink.record import check_chain, describe, export_run, find_run, list_runs, open_to_read, recorded_run, replay_run
from cmmlink.record.chain import GENESIS, Draft, Record, chain_record
from drivers import DeviceError, MeshError, PointFileError, decoder, device_address, read_points
from drivers.codecs.register_decoder import RegisterDecoder
from drivers.surface import read_obj, read_stl
from drivers.surface.ply_header import faces_announced, header_of, readable
from inspection import InspectionError, discretize
from tests.cmmlink.nominal_files.iges_text import iges, wire_entities
from tests.cmmlink.nominal_files.test_dxf import draw_wire
from tests.cmmlink.nominal_files.test_dxf import new as new_drawing
from tests.cmmlink.oval_part import oval_points, write_nominal
from tests.cmmlink.recorded import Script, record, scan_arrivals, today
from tests.drivers.codecs.test_every_codec import MAPS, OPTIONS, talk
from tests.drivers.codecs.wire_bytes import PIECES, TURNS, Registers
from tests.fuzz.console_socket import change_command, workshop
from tests.fuzz.mutations import ANY, TEXT, TREE, Mutation, change_npy, change_stl

POINTS_AT_MOST = 200_000  # of a profile or a file that is worked on further: what takes long by its size is no hang


@dataclass(frozen=True)
class Target:
    """One thing that reads.

    seeds      sound inputs to begin from
    mutations  what is done to them
    read       takes an input and a folder to work in
    allowed    the errors that it documents
    """

    seeds: Callable[[], list[bytes]]
    mutations: tuple[Mutation, ...]
    read: Callable[[bytes, Path], object]
    allowed: tuple[type[Exception], ...]


def _file(read: Callable[[Path], object], *suffixes: str) -> Callable[[bytes, Path], object]:
    """Read a file of one of these suffixes, which the input itself chooses."""

    def read_bytes(data: bytes, folder: Path) -> object:
        path = folder / f"input{suffixes[len(data) % len(suffixes)]}"
        path.write_bytes(data)
        return read(path)

    return read_bytes


def _oval_text(delimiter: str = ",", header: str = "x_mm,y_mm") -> bytes:
    text = io.StringIO()
    np.savetxt(text, oval_points(0.01)[::6], fmt="%.6f", delimiter=delimiter, header=header, comments="")
    return text.getvalue().encode()


def _npy() -> list[bytes]:
    file = io.BytesIO()
    np.save(file, oval_points(0.01))
    return [file.getvalue()]


def _dat() -> list[bytes]:
    x = (1 + np.cos(np.linspace(0, 2 * np.pi, 41))) / 2
    y = 0.1 * np.sin(np.linspace(0, 2 * np.pi, 41)) * np.sqrt(x)
    rows = [f"{a:9.6f} {b:9.6f}" for a, b in zip(x, y, strict=True)]
    upper, lower = rows[20::-1], rows[20:]
    return ["\n".join(["foil", *rows]).encode(), "\n".join(["foil", " 21. 21.", "", *upper, "", *lower]).encode()]


def _nominal(path: Path) -> None:
    curve = load_nominal(path).curve
    if len(curve.control_points_mm) < 2000:
        discretize(curve, samples=400)


def _dxf() -> list[bytes]:
    document, stream = new_drawing("R2000"), io.StringIO()
    draw_wire(document.modelspace())
    document.write(stream)
    return [stream.getvalue().encode()]


def _yaml_nominal() -> list[bytes]:
    with TemporaryDirectory() as folder:
        return [write_nominal(Path(folder) / "oval.yaml").read_bytes()]


def _ring() -> list[list[float]]:
    return [[float(x), float(y)] for x, y in oval_points(0.0)[::12]]


def _stl() -> list[bytes]:
    ring = _ring()
    corners = [((*a, 0.0), (*b, 0.0), (*b, 9.0)) for a, b in pairwise([*ring, ring[0]])]
    binary = bytes(80) + struct.pack("<I", len(corners)) + b"".join(struct.pack("<12fH", 0, 0, 0, *sum(three, ()), 0) for three in corners)
    lines = ["solid tube"]
    for three in corners[:8]:
        lines += ["facet normal 0 0 1", "outer loop", *("vertex {} {} {}".format(*one) for one in three), "endloop", "endfacet"]
    return [binary, "\n".join([*lines, "endsolid tube", ""]).encode()]


def _obj() -> list[bytes]:
    lines = [f"v {x} {y} {z}" for z in (0, 9) for x, y in _ring()]
    count = len(lines) // 2
    lines += [f"f {i + 1} {(i + 1) % count + 1} {(i + 1) % count + 1 + count} {i + 1 + count}" for i in range(count)]
    return ["\n".join(["# tube", "g a", *lines, f"f {' '.join(str(i + 1) for i in range(count))}", ""]).encode()]


def _ply() -> list[bytes]:
    head = "ply\nformat ascii 1.0\ncomment tube\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
    return [(head + "element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n").encode()]


def _read_ply(path: Path) -> None:
    header = header_of(path)
    faces_announced(header)
    with readable(path, header):
        pass


def _plans() -> list[bytes]:
    scan = plan_file().read_bytes()
    modbus = b"""part: {name: p}
nominal: {file: nominal.csv, scale: 1, closed: false}
tolerance: {lower_mm: -0.05, upper_mm: 0.05, uncertainty_mm: 0.002}
device: {type: modbus, address: "10.0.0.1:502", map: generic-ring, device_id: 1, timeout_s: 1}
section: {off_plane_max_mm: 0.5}
registration: {datum: {rotation_deg: 0, translation_mm: [0, 0]}, fit: none, coverage_min: 0.9}
gap_max_mm: 2
allow: {unseen_mm: 1}
"""
    serial = b"""part: {name: p, serial_number: 0012}
nominal: {file: nominal.csv}
tolerance: {lower_mm: -0.05, upper_mm: 0.05}
device: {type: serial, address: COM3, format: optoncdt, options: {range_mm: 50, rate_hz: 1000}, baud_rate: 115200}
out: "results/{part}/{serial}_{run}"
"""
    return [scan, modbus, serial]


def _read_plan(data: bytes, folder: Path) -> None:
    shutil.copy(plan_file().with_name("nominal.csv"), folder / "nominal.csv")
    (folder / "plan.yaml").write_bytes(data)
    plan = load_plan(folder / "plan.yaml")
    plan.effective_yaml()


def _ct_plan() -> list[bytes]:
    return [
        b"""part: {name: tube}
mesh: {file: tube.stl, scale: 1}
nominal: {file: nominal.csv}
tolerance: {lower_mm: -0.05, upper_mm: 0.05}
sections: {normal: [0, 0, 1], heights_mm: [1, 2, 3], nominal_at: [{height_mm: 2, file: nominal.csv}]}
cut: {cutter: numpy, weld_mm: 0.001, shortest_mm: 1}
"""
    ]


def _maps() -> list[bytes]:
    folder = plan_file().parents[2] / "drivers" / "maps"
    return [path.read_bytes() for path in sorted(folder.glob("*.yaml"))]


def _messages() -> list[bytes]:
    return [
        b'{"do": "choose", "number": 1, "plan": "blade.yaml"}',
        b'{"do": "enter", "number": 2, "serial_number": "7", "operator": null, "address": "COM3"}',
        b'{"do": "acknowledge", "number": 3, "alarm": 4}',
        b'{"do": "open", "number": 4, "run": "20260314-150926-0001"}',
        b'{"do": "section", "number": 5, "section": 1}',
        b'{"do": "start", "number": 6}',
    ]


def _talks() -> list[bytes]:
    """Sound messages of a page, some in a row, most of which a station refuses while it measures."""
    workshop().hear(b"")  # its first run prepares the nominal, which is no input's fault
    plain = [b'{"do": "%s", "number": 9}' % do for do in (b"test", b"devices", b"live", b"another page", b"take control", b"end", b"abort")]
    messages = [*_messages(), *plain, b'{"do": "replay", "number": 7, "run": "last"}', b'{"do": "import", "number": 8, "plan": "x"}']
    return [
        *messages,
        b"\n".join(messages[:5]),
        b"\n".join(message for message in messages if b"end" not in message and b"abort" not in message),
    ]


def _read_message(data: bytes, _: Path) -> None:
    receive(data.decode("utf-8", "surrogateescape" if len(data) % 2 else "replace")).command()


def _addresses() -> list[bytes]:
    return [b"COM3", b"/dev/ttyUSB0", b"127.0.0.1:502", b"[::1]:502", b"spy://COM3?file=/tmp/x", b"scanner.local:4001"]


def _codec(name: str) -> Target:
    """A codec, fed pieces of an input that the input itself chooses."""

    def seeds() -> list[bytes]:
        if name in PIECES:
            return [b"".join(PIECES[name](Random(seed))) for seed in range(6)]
        return [b"".join(talk(MAPS[name], Registers(TURNS[name], strange=seed > 3), Random(seed))) for seed in range(6)]

    def read(data: bytes, _: Path) -> None:
        made = RegisterDecoder(MAPS[name]) if name in TURNS else decoder(name, **OPTIONS[name][len(data) % len(OPTIONS[name])])
        size = (1, 7, 64, 1 << 16)[len(data) % 4]
        try:
            for at in range(0, len(data), size):
                made.feed(data[at : at + size])
                made.request()
        finally:
            made.break_off()

    return Target(seeds, ANY, read, (DeviceError,))


@cache
def _recorded() -> bytes:
    with TemporaryDirectory() as folder:
        record(Path(folder), Script(*scan_arrivals(count=120)))
        return (Path(folder) / "station.sqlite").read_bytes()


@contextmanager
def _read_errors() -> Iterator[None]:
    with suppress(StoreError, RunError, PlanError, InspectionError):
        yield


def _read_records(data: bytes, folder: Path) -> None:
    """Everything that reads a station's file: each part is tried, whatever the others say."""
    (folder / "station.sqlite").write_bytes(data)
    with _read_errors():
        list_runs(folder, today)
    with _read_errors(), open_to_read(folder, today, close_interrupted=False) as store:
        check_chain(store, None)
        run = find_run(store, "last")
        for look in (
            lambda: describe(store, run),
            lambda: export_run(store, run, folder / "out"),
            lambda: replay_run(store, recorded_run(store, run), decoder_of),
        ):
            with _read_errors():
                look()
    assert {path.name for path in folder.parent.iterdir()} == {folder.name}, "a file was written outside"


def _bodies() -> list[bytes]:
    """The bodies of a run's records, one a line: the record's number, then its body in hexadecimal digits."""
    with TemporaryDirectory() as folder:
        (Path(folder) / "station.sqlite").write_bytes(_recorded())
        with closing(sqlite3.connect(Path(folder) / "station.sqlite")) as connection:
            return [b"%d %s" % (number, body.hex().encode()) for number, body in connection.execute("SELECT number, body FROM record")]


def change_body(data: bytes, rng: Random) -> bytes:
    """Change the body of one record, as a text or as bytes."""
    number, body = _body_of(data)
    changed = rng.choice(TREE if body[:1] in b"{[p" else ANY)(body, rng)
    return b"%d %s" % (number, changed.hex().encode())


def _body_of(data: bytes) -> tuple[int, bytes]:
    """The number of a record and its body; 0 and all bytes where the input is no such line."""
    number, _, digits = data.partition(b" ")
    try:
        return int(number), bytes.fromhex(digits.decode("ascii"))
    except ValueError:
        return 0, data


def _read_bodies(data: bytes, folder: Path) -> None:
    """Put the body into the file and compute the chain anew, as whoever alters a record on purpose would."""
    altered, changed = _body_of(data)
    path = folder / "station.sqlite"
    path.write_bytes(_recorded())
    with closing(sqlite3.connect(path)) as connection, connection:
        previous = GENESIS
        for row in connection.execute(
            "SELECT number, run, kind, time_s, count, body, crc32, sha256 FROM record ORDER BY number"
        ).fetchall():
            old = Record(*row)
            body = changed if old.number == altered else old.body
            new = chain_record(Draft(old.run, old.kind, body, old.count), old.number, old.time_s, previous)  # type: ignore[arg-type]
            connection.execute(
                "UPDATE record SET body = ?, crc32 = ?, sha256 = ? WHERE number = ?", (new.body, new.crc32, new.sha256, new.number)
            )
            previous = new.sha256
    _read_records(path.read_bytes(), folder)


TARGETS: dict[str, Target] = {
    "points": Target(
        lambda: [_oval_text(), _oval_text(";", "x;y"), _oval_text("\t", "# points\nX\tY"), b"1,5;2,5;3\n2;3;4\n" * 9],
        TEXT,
        _file(read_points, ".csv", ".txt", ".asc", ".xyz"),
        (PointFileError,),
    ),
    "npy": Target(_npy, (*ANY, change_npy, change_npy, change_npy), _file(read_points, ".npy"), (PointFileError,)),
    "dat": Target(_dat, TEXT, _file(_nominal, ".dat"), (InspectionError,)),
    "csv-nominal": Target(lambda: [_oval_text()], TEXT, _file(_nominal, ".csv"), (InspectionError,)),
    "dxf": Target(_dxf, TEXT, _file(_nominal, ".dxf"), (InspectionError,)),
    "iges": Target(lambda: [iges(wire_entities()).encode()], TEXT, _file(_nominal, ".igs"), (InspectionError,)),
    "yaml-nominal": Target(_yaml_nominal, TREE, _file(_nominal, ".yaml"), (InspectionError,)),
    "stl": Target(_stl, (*TEXT, change_stl, change_stl, change_stl), _file(read_stl, ".stl"), (MeshError,)),
    "obj": Target(_obj, TEXT, _file(read_obj, ".obj"), (MeshError,)),
    "ply": Target(_ply, TEXT, _file(_read_ply, ".ply"), (MeshError,)),
    "plan": Target(_plans, TREE, _read_plan, (PlanError,)),
    "ct-plan": Target(_ct_plan, TREE, _file(load_ct_plan, ".yaml"), (PlanError,)),
    "map": Target(_maps, TREE, _file(map_of, ".yaml"), (PlanError,)),
    "address": Target(_addresses, TEXT, lambda data, _: device_address(data.decode("utf-8", "surrogateescape")), (ValueError,)),
    "message": Target(_messages, TREE, _read_message, (Refused,)),
    "socket": Target(_talks, (*ANY, change_command, change_command, change_command), lambda data, _: workshop().hear(data), ()),
    "record": Target(lambda: [_recorded()], ANY, _read_records, ()),
    "bodies": Target(_bodies, (change_body,), _read_bodies, ()),
    **{f"codec-{name}": _codec(name) for name in (*PIECES, *TURNS)},
}
