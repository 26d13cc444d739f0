"""Small signed runs of a station, without a scan: as many records as it needs to see what is signed and what is altered."""

import hashlib
import json
import sqlite3
from collections.abc import Callable, Sequence
from contextlib import closing
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

from cmmlink.record.anchors import Head, heads_in
from cmmlink.record.chain import Draft
from cmmlink.record.reader import check_chain, open_to_read
from cmmlink.record.recorder import RecordReference, end_draft
from cmmlink.record.seal import seal_of
from cmmlink.record.signature import signature_in
from cmmlink.record.store import FILE_NAME, Store
from cmmlink.record.trust import trust_in
from tests.integration.damaged import chain_anew

HEADER = {
    "started": "2026-03-14T15:09:26.000Z",
    "clock_s": 0.0,
    "part": "blade",
    "serial_number": "",
    "operator": "",
    "device": "d",
    "simulated": True,
    "software": {},
    "nominal": "n",
}
BEGAN = datetime(2026, 3, 14, 15, 9, 26, tzinfo=UTC)


class Clock:
    """A moment that goes on by a second whenever it is asked."""

    def __init__(self) -> None:
        self.asked = 0

    def __call__(self) -> datetime:
        self.asked += 1
        return BEGAN + timedelta(seconds=self.asked)


def add_signed(folder: Path, run: str, *, key: Path | None = None, station: str = "cmm-1", ended: bool = True) -> RecordReference:
    """Add a run, signed by the station's key, which is made where there is none, or by another one."""
    clock = Clock()
    with Store(folder, writing=True, epoch_s=lambda: clock().timestamp()) as store:
        seal = seal_of(store, station=station, key=key)
        header = json.dumps({"run": run, "station": seal.station, **HEADER}).encode()
        store.append([Draft(run, "run", header), Draft(run, "plan", b"part: {}"), Draft(run, "points", b"p" * 40)])
        if not ended:
            return RecordReference(run, "", "", "", {})
        end, *signed = store.append([end_draft(run, "complete", "", clock(), {"received": 1})], seal.sign)
        signature = signature_in(store, signed[0]).beside_result() if signed else None
        return RecordReference(run, end.sha256.hex(), "", "", {}, signature)


def trust(folder: Path, run: str | None = None, given: Sequence[str] = (), anchor: Path | None = None) -> dict[str, Any]:
    """What verify finds of the records of a folder."""
    heads: list[Head] | None = None if anchor is None else heads_in(anchor)
    with open_to_read(folder, Clock(), close_interrupted=False) as store:
        return trust_in(store, check_chain(store, run), run, given, heads)


def state_of(folder: Path, run: str | None = None, given: Sequence[str] = (), anchor: Path | None = None) -> str:
    return str(trust(folder, run, given, anchor)["state"])


def forge(folder: Path, *statements: str, parameters: Sequence[object] = (), number_anew: bool = False, count_anew: bool = True) -> None:
    """Change the table as somebody does who may write the file, and hide it: numbers, hashes and SQLite's own count fit afterwards."""
    with closing(sqlite3.connect(folder / FILE_NAME)) as connection:
        connection.execute("PRAGMA synchronous = OFF")
        for statement in statements:
            connection.execute(statement, tuple(parameters) if "?" in statement else ())
        if number_anew:
            rows = connection.execute("SELECT number FROM record ORDER BY number").fetchall()
            for place, (number,) in enumerate(rows, start=1):
                connection.execute("UPDATE record SET number = ? WHERE number = ?", (place, number))
        if count_anew:
            connection.execute("UPDATE sqlite_sequence SET seq = (SELECT coalesce(max(number), 0) FROM record)")
        chain_anew(connection)


def key_id(public_key: str) -> str:
    """What a key is called, from the definition in the documentation."""
    return hashlib.sha256(bytes.fromhex(public_key)).hexdigest()[:16]


Forgery = Callable[[Path], None]
