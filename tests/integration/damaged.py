"""Damages a file of records in every way that a disk or a person could, to see that each command answers in words.

Three kinds: bytes of the file itself, values of the table, and records whose chain was computed anew over bodies that nobody wrote.
It knows the file by its documentation (docs/decisions/hash-chain.md) and SQLite's own, and shares no code with what is tested.
"""

import hashlib
import json
import random
import sqlite3
import struct
from collections.abc import Callable, Iterator, Sequence
from contextlib import closing
from pathlib import Path
from zlib import crc32

Damage = Callable[[Path], None]
_COLUMNS = ("number", "run", "kind", "time_s", "count", "body", "crc32", "sha256")
_VALUES = (
    "NULL",
    "''",
    "'x'",
    "x''",
    "x'ff00'",
    "0",
    "-1",
    "9223372036854775807",
    "1e308",
    "-1e308",
    "0.5",
    "'\u20ac'",
    "char(0)",
    "9e999",
)


def damages_of_bytes(file: Path, seed: int, every: int = 1) -> Iterator[tuple[str, Damage]]:
    """A byte flipped in every field of every page's header and at places in its body; cut off and made longer at every page."""
    rng = random.Random(seed)
    content = file.read_bytes()
    page = struct.unpack(">H", content[16:18])[0]
    page = 65536 if page == 1 else page
    places = [*range(0, 100)]  # the header of the file
    for first in range(0, len(content), page):
        begin = first + (100 if first == 0 else 0)
        places += range(begin, min(begin + 20, len(content)))  # of a b-tree's page, and the first of its cells
        places += [rng.randrange(first, min(first + page, len(content))) for _ in range(6)]
    for place in places[::every]:
        for flip in (0x01, 0x80, 0xFF):
            yield f"byte {place} ^ {flip:#x}", _flipped(place, flip)
    for first in range(0, len(content), page):
        for size in (first, first + 1, first + page // 2):
            if size < len(content):
                yield f"cut off at {size}", _cut(size)
    for text in (b"", b"\0", b"SQLite format 3\0", b"\xff" * 512, content[:100]):
        yield f"in its place {text[:16]!r}", _replaced(text)
    yield "twice", _replaced(content + content)
    for first in range(page, len(content), page):
        yield f"page at {first} empty", _overwritten(first, bytes(page))


def damages_of_values(file: Path) -> Iterator[tuple[str, Damage]]:
    """Every column of a record of every kind set to a value of every type, and the schema changed."""
    with closing(sqlite3.connect(file)) as connection:
        kinds = [kind for (kind,) in connection.execute("SELECT DISTINCT kind FROM record ORDER BY kind")]
    for kind in kinds:
        for column in _COLUMNS:
            for value in _VALUES:
                yield (
                    f"{kind}.{column} = {value}",
                    _executed(
                        f"UPDATE OR REPLACE record SET {column} = {value} "
                        f"WHERE number = (SELECT max(number) FROM record WHERE kind = '{kind}')"
                    ),
                )
        yield f"no {kind}", _executed(f"DELETE FROM record WHERE kind = '{kind}'")
        yield (
            f"{kind} twice",
            _executed(
                "INSERT INTO record SELECT number + 1000000, run, kind, time_s, count, body, crc32, sha256 "
                f"FROM record WHERE kind = '{kind}'"
            ),
        )
    yield from (
        (statement, _executed(statement))
        for statement in (
            "DROP TABLE record",
            "DELETE FROM record",
            "ALTER TABLE record RENAME TO other",
            "ALTER TABLE record RENAME COLUMN body TO text",
            "ALTER TABLE record RENAME COLUMN number TO n",
            "ALTER TABLE record ADD COLUMN more TEXT",
            "DROP INDEX record_of_run",
            "DROP INDEX begin_and_end",
            "DELETE FROM sqlite_sequence",
            "UPDATE sqlite_sequence SET seq = 'many'",
            "UPDATE sqlite_sequence SET seq = -1",
            "UPDATE sqlite_sequence SET seq = 9223372036854775807",
            "UPDATE sqlite_sequence SET name = 'other'",
            "PRAGMA user_version = -1",
            "PRAGMA user_version = 0",
            "PRAGMA user_version = 99",
            "PRAGMA application_id = 7",
            "PRAGMA journal_mode = DELETE",
            "CREATE TABLE other (x)",
            "CREATE VIEW v AS SELECT * FROM record",
            "CREATE TRIGGER t AFTER INSERT ON record BEGIN DELETE FROM record; END",
            "ALTER TABLE record RENAME TO r; CREATE VIEW record AS SELECT * FROM r",
        )
    )


def damages_of_documents(file: Path, names: Sequence[str] = ()) -> Iterator[tuple[str, Damage]]:
    """Bodies that nobody wrote, under a chain that fits: what only their content can show. First other names of the nominal."""
    with closing(sqlite3.connect(file)) as connection:
        header = json.loads(connection.execute("SELECT body FROM record WHERE kind = 'run' ORDER BY number DESC").fetchone()[0])
    for name in names:
        yield name, _chained_anew("run", json.dumps(header | {"nominal": name}).encode())
    bodies: list[tuple[str, bytes]] = [
        ("nothing", b""),
        ("no text", b"\xff\xfe\0"),
        ("half a document", b'{"run": '),
        ("null", b"null"),
        ("a list", b"[]"),
        ("a list of numbers", b"[1, 2]"),
        ("a list of objects", b"[{}]"),
        ("a number", b"7"),
        ("an object", b"{}"),
        ("a text", b'"x"'),
        ("deep", b"[" * 5000),
        ("endless digits", b"1" * 5000),
        ("odd bytes", bytes(range(251))),
        ("many reads", b"\xff\xff\xff\xff" + bytes(40)),
        ("not a number", b'{"received": NaN, "run": Infinity}'),
    ]
    with closing(sqlite3.connect(file)) as connection:
        rows = connection.execute("SELECT kind, body FROM record ORDER BY number DESC").fetchall()
    for kind, written in dict(rows).items():
        for name, body in bodies:
            yield f"{kind}: {name}", _chained_anew(kind, body)
        try:
            document = json.loads(written)
        except ValueError:
            continue
        for key, changed in _changed_documents(document):
            yield f"{kind}: {key}", _chained_anew(kind, json.dumps(changed).encode())


def _changed_documents(document: object) -> Iterator[tuple[str, object]]:
    """The document with each value in turn gone, or another kind of value."""
    rest_of = document[1:] if isinstance(document, list) else None
    members = document[0] if isinstance(document, list) and document else document
    if not isinstance(members, dict):
        return
    for key in members:
        values: list[object] = [None, 7, "x", [], {}, -1e308, "../../evil", "\u001b[31m\n"]
        changes: list[dict[str, object]] = [{**members, key: value} for value in values]
        changes.append({name: value for name, value in members.items() if name != key})
        for changed in changes:
            yield f"{key} = {changed.get(key, 'nothing')!r}", changed if rest_of is None else [changed, *rest_of]


def chain_anew(connection: sqlite3.Connection) -> None:
    """Compute the chain of all records anew, as whoever wants to hide a change would."""
    previous = bytes(32)
    rows = connection.execute("SELECT number, run, kind, time_s, count, body FROM record ORDER BY number").fetchall()
    for number, run, kind, time_s, count, body in rows:
        head = f"{number:d}\n{run}\n{kind}\n{time_s!r}\n{count:d}\n{len(body)}\n"
        digest = hashlib.sha256(previous + head.encode())
        digest.update(body)
        previous = digest.digest()
        connection.execute("UPDATE record SET crc32 = ?, sha256 = ? WHERE number = ?", (crc32(body), previous, number))
    connection.commit()


def _flipped(place: int, flip: int) -> Damage:
    def damage(file: Path) -> None:
        content = bytearray(file.read_bytes())
        content[place] ^= flip
        file.write_bytes(content)

    return damage


def _cut(size: int) -> Damage:
    def damage(file: Path) -> None:
        file.write_bytes(file.read_bytes()[:size])

    return damage


def _replaced(content: bytes) -> Damage:
    def damage(file: Path) -> None:
        file.write_bytes(content)

    return damage


def _overwritten(place: int, content: bytes) -> Damage:
    def damage(file: Path) -> None:
        whole = bytearray(file.read_bytes())
        whole[place : place + len(content)] = content
        file.write_bytes(whole)

    return damage


def _executed(statements: str) -> Damage:
    def damage(file: Path) -> None:
        with closing(sqlite3.connect(file)) as connection:
            try:
                connection.executescript(statements)
            except sqlite3.Error:
                connection.rollback()  # SQLite itself refuses it: then the record stays as it was

    return damage


def _chained_anew(kind: str, body: bytes) -> Damage:
    def damage(file: Path) -> None:
        with closing(sqlite3.connect(file)) as connection:
            first = "(SELECT max(number) FROM record WHERE kind = ?)"
            connection.execute(f"UPDATE record SET body = ? WHERE number = {first}", (body, kind))
            chain_anew(connection)

    return damage
