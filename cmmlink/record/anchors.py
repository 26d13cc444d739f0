"""Anchors: files outside this computer, where every run's end leaves a line that no change of the records reaches.

A line is `{time in UTC} {station} {run} {chain_sha256} {id of the key, or -}`. Lines are only ever added. A place that cannot be reached
keeps nobody waiting for more than some seconds and changes no verdict: its lines wait beside the records and are told at the next run.
"""

import json
import logging
import os
import re
import threading
import time
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

from cmmlink.errors import PlanError, StoreError
from cmmlink.record.bodies import pack_document, unpack_document
from cmmlink.record.chain import Draft
from cmmlink.record.recorder import RecordReference
from cmmlink.record.seal import Seal
from cmmlink.record.shapes import checked
from cmmlink.record.store import Store, name_record
from cmmlink.record.timestamps import ask_stamp

WAITING = "heads-waiting.json"
PATIENCE_S = 5.0  # for all places together: whoever writes to a share whose server is gone may be held for minutes
_HEAD = re.compile(r"(\S+) (\S+) (\S+) ([0-9a-f]{64}) ([0-9a-f]{16}|-)")
_AUTHORITIES = ("http://", "https://")
_log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class Head:
    """How the records of a station ended after a run: the hash of its end, and the id of the key that signed it, empty where none did."""

    time: str
    station: str
    run: str
    chain_sha256: str
    key_id: str

    @property
    def line(self) -> str:
        """The line that an anchor has of it."""
        return f"{self.time} {self.station} {self.run} {self.chain_sha256} {self.key_id or '-'}"


@dataclass(frozen=True, slots=True)
class Told:
    """A place that was to be told how a run ended. `problem` is what kept it from that, empty where nothing did."""

    place: str
    problem: str


def tell_heads(
    folder: Path, places: Sequence[str], heads: Sequence[Head], patience_s: float = PATIENCE_S
) -> tuple[tuple[Told, ...], dict[str, bytes]]:
    """Add the lines of some runs to every place, behind those that it could not be told before. Never raises.

    folder     : of the records, beside which lines wait
    places     : files, or addresses of authorities that stamp the newest of the heads, from which those before it follow
    patience_s : how long all places together may take

    Returns what came of it, and the time stamps by the run whose end was stamped.
    """
    waiting = _waiting_in(folder)
    if not places and not waiting:
        return (), {}
    for place in places:
        waiting.setdefault(place, []).extend(head.line for head in heads)
    lost = _keep_waiting(folder, waiting)  # before anything is tried: whatever ends the program now, the lines are not lost
    problems, stamps = _tell_all(waiting, patience_s)
    left = {place: lines for place, lines in waiting.items() if problems[place]}
    lost = _keep_waiting(folder, left) or lost
    for unreached in left:
        _log.warning("heads of runs were not told to %s: %s. %s", unreached, problems[unreached], lost or "They are told at the next run")
    told = (Told(place=place, problem=". ".join(filter(None, [problems[place], lost if problems[place] else ""]))) for place in places)
    return tuple(told), stamps


def anchor_ends(store: Store, seal: Seal, places: Sequence[str], ended: str, runs: Sequence[RecordReference]) -> tuple[Told, ...]:
    """Tell every place how some runs of these records ended, and note behind each of them what came of it. Never raises.

    ended : the moment, in UTC
    """
    heads = [Head(ended, seal.station, one.run, one.chain_sha256, (one.signature or {}).get("key_id", "")) for one in runs]
    told, stamps = tell_heads(store.path.parent, places, heads)
    drafts = [_draft(head.run, told) for head in heads if told]
    try:
        drafts += [Draft(run, "timestamp", stamp) for run, stamp in stamps.items() if "end" in store.totals(run)]
        for draft in drafts:
            store.append([draft], seal.countersign)
    except StoreError as error:  # the runs themselves are on record
        _log.warning("that the anchors were told cannot be noted: %s", error)
    return told


def _draft(run: str, told: Sequence[Told]) -> Draft:
    return Draft(run, "anchors", pack_document([asdict(one) for one in told]))


def anchors_of(store: Store, run: str) -> tuple[Told, ...]:
    """The places that were told the end of a run, as far as there were any. Raises StoreError where that cannot be read."""
    found: list[Told] = []
    for record in store.records(run, "anchors"):
        with name_record(store.path, record):
            found += checked(list[Told], unpack_document(record.body))
    return tuple(found)


def heads_in(file: Path) -> list[Head]:
    """The heads in an anchor. Raises PlanError where it cannot be read, or holds none. Lines that are none are passed over."""
    try:
        text = file.read_bytes().decode("utf-8", "replace")
    except OSError as error:
        raise PlanError(f"{file}: cannot be read ({error.strerror}); give a file that `records: {{anchor: FILE}}` wrote") from None
    found = [_HEAD.fullmatch(line.strip()) for line in text.splitlines()]
    heads = [Head(one[1], one[2], one[3], one[4], one[5].strip("-")) for one in found if one is not None]
    if not heads:
        raise PlanError(f"{file}: there is no head of a run in it; give a file that `records: {{anchor: FILE}}` wrote")
    return heads


def _tell_all(waiting: Mapping[str, Sequence[str]], patience_s: float) -> tuple[dict[str, str], dict[str, bytes]]:
    """Tell every place its lines, all at once. Returns what kept each from being told, empty where nothing did, and the time stamps."""
    stamps: dict[str, bytes] = {}
    problems = dict.fromkeys(waiting, f"it did not answer within {patience_s:g} s")
    threads = []
    for place, lines in waiting.items():
        thread = threading.Thread(target=_tell, args=(place, tuple(lines), patience_s, problems, stamps), name="anchor", daemon=True)
        try:
            thread.start()
            threads.append(thread)
        except RuntimeError as error:  # the system has no thread to give
            problems[place] = str(error)
    deadline = time.monotonic() + patience_s
    for thread in threads:
        thread.join(max(0.0, deadline - time.monotonic()))
    return dict(problems), dict(stamps)


def _tell(place: str, lines: Sequence[str], patience_s: float, problems: dict[str, str], stamps: dict[str, bytes]) -> None:
    if not place.startswith(_AUTHORITIES):
        problems[place] = _add_lines(Path(place), lines)
        return
    newest = _HEAD.fullmatch(lines[-1])
    assert newest is not None, "a line was made from a head"
    try:
        stamps[newest[3]] = ask_stamp(place, bytes.fromhex(newest[4]), patience_s)
        problems[place] = ""
    except StoreError as error:
        problems[place] = str(error).removeprefix(f"{place}: ")


def _add_lines(place: Path, lines: Sequence[str]) -> str:
    """Add lines to the end of a file, on the disk when this returns. Returns what kept it from that."""
    try:
        with place.open("a+b", buffering=0) as file:
            torn = file.seek(0, os.SEEK_END) > 0 and file.seek(-1, os.SEEK_END) >= 0 and file.read(1) != b"\n"
            file.write(("\n" * torn + "".join(f"{line}\n" for line in lines)).encode())  # in one piece: others may add theirs meanwhile
            os.fsync(file.fileno())
    except (OSError, ValueError) as error:  # a name with a zero byte is a ValueError
        return getattr(error, "strerror", None) or str(error)
    return ""


def _waiting_in(folder: Path) -> dict[str, list[str]]:
    """The lines that wait for their places. What cannot be read is told anew by nobody, and said in the log."""
    file = folder / WAITING
    try:
        found = checked(dict[str, list[str]], json.loads(file.read_bytes()))
    except FileNotFoundError:
        return {}
    except (OSError, ValueError, RecursionError, StoreError) as error:
        _log.warning("%s: the heads that wait to be told cannot be read: %s", file, error)
        return {}
    heads = {place: [line for line in lines if _HEAD.fullmatch(line)] for place, lines in found.items()}
    return {place: lines for place, lines in heads.items() if lines}


def _keep_waiting(folder: Path, waiting: Mapping[str, Sequence[str]]) -> str:
    """Keep the lines that wait, the file as a whole or as it was. Returns what kept it from that."""
    file, part = folder / WAITING, folder / f"{WAITING}.part"
    try:
        if not waiting:
            file.unlink(missing_ok=True)
            return ""
        with part.open("w", encoding="utf-8") as written:
            json.dump(waiting, written, indent=1)
            written.flush()
            os.fsync(written.fileno())
        part.replace(file)
    except OSError as error:
        return f"nor can they be kept for the next run ({file}: {error.strerror or error})"
    return ""
