"""Every call to the operating system fails once: a command is run again and again, and in each run one call more goes well.

`python -m tests.integration.fail_once` runs every command until nothing fails any more; a thinned sample is in
test_every_call_fails_once.py. After each run: the exit status is one that is documented for such a failure, standard error holds no
traceback, what was committed to the record is in it and its chain is whole, no temporary file, thread or descriptor is left, and the
next run of the command works.
"""

import faulthandler
import gc
import json
import os
import shutil
import socket
import sqlite3
import sys
import tempfile
import threading
import time
import traceback
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from unittest.mock import patch

from cmmlink.commands import main
from tests.cmmlink.command import Ended, cmmlink
from tests.cmmlink.oval_part import oval_points, write_nominal, write_points
from tests.drivers.codecs.wire_bytes import ascii_line
from tests.integration.failing_calls import NOT_OURS, Faults, failing, intercepted, take

LONGEST_RUN_S = 300.0


class Device:
    """A scanner on a socket of this computer, of the ASCII line format; over a new link it goes on behind what it has sent.

    It shares no line with the simulators of the project.
    """

    def __init__(self, lines: list[bytes], pieces: int = 6) -> None:
        self._opening, self._points, self._closing = lines[0], lines[1:-1], lines[-1]
        self._step = -(-len(self._points) // pieces)
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.address = f"127.0.0.1:{self._listener.getsockname()[1]}"
        self._thread = threading.Thread(target=self._serve, name=NOT_OURS, daemon=True)
        self._thread.start()

    def __enter__(self) -> "Device":
        return self

    def __exit__(self, *_: object) -> None:
        self._listener.close()

    def _serve(self) -> None:
        sent = 0
        while True:
            try:
                link, _ = self._listener.accept()
            except OSError:
                return
            with link:
                try:
                    if not link.recv(16):
                        continue
                    link.sendall(self._opening)
                    while sent < len(self._points):
                        link.sendall(b"".join(self._points[sent : sent + self._step]))
                        sent += self._step
                        time.sleep(0.003)
                    link.sendall(self._closing)
                    link.settimeout(2.0)
                    link.recv(16)  # until the host has closed
                except OSError:
                    continue


def lines_of(deviation_mm: float) -> list[bytes]:
    """The oval's points as lines of the ASCII format."""
    points = oval_points(deviation_mm)
    told = [ascii_line(f"P,{i},{1000 * i},{x:.9f},{y:.9f},0,0") for i, (x, y) in enumerate(points.tolist())]
    return [ascii_line(f"S,oval scanner,1,mm,{len(points)}"), *told, ascii_line(f"E,{len(points)}")]


PLAN = """\
part: {{name: oval, serial_number: 7}}
nominal: {{file: oval.yaml}}
tolerance: {{lower_mm: -0.05, upper_mm: 0.05}}
device: {{type: serial, address: "{address}", reconnect_s: 2, silence_s: 1}}
out: null
registration: {{datum: {{}}}}
discretisation: {{samples: 400}}
"""


@dataclass(frozen=True)
class Command:
    """A command to be run with failing calls, in a folder made ready for it.

    statuses   the exit statuses that are right where a call failed; 0 is right, too, where the result is that of a run without failures
    """

    name: str
    make: Callable[[Path, ExitStack], list[object]]
    statuses: frozenset[int]


def _oval(folder: Path) -> Path:
    write_points(folder / "points.csv", oval_points(0.01))
    return write_nominal(folder / "oval.yaml")


def _run(folder: Path, stack: ExitStack) -> list[object]:
    _oval(folder)
    device = stack.enter_context(Device(lines_of(0.01)))
    plan = folder / "plan.yaml"
    plan.write_text(PLAN.format(address=device.address), encoding="utf-8")
    return ["run", plan, "--headless", "--json", "--records", folder / "records"]


def _inspect(folder: Path, _: ExitStack) -> list[object]:
    limits = ("--tolerance", -0.05, 0.05, "--fit", "none", "--coverage-min", 0)
    nominal = _oval(folder)
    return [
        "inspect",
        folder / "points.csv",
        "--nominal",
        nominal,
        *limits,
        "--json",
        "--records",
        folder / "records",
        "--out",
        folder / "out",
    ]


def _recorded(*words: object) -> Callable[[Path, ExitStack], list[object]]:
    def make(folder: Path, _: ExitStack) -> list[object]:
        return [folder / "out" if word == "OUT" else word for word in words] + ["--records", folder / "records"]

    return make


def _ct(folder: Path, _: ExitStack) -> list[object]:
    """A tube of the oval: two rings of corners, 20 mm apart, as an ASCII STL."""
    ring = oval_points(0.0)
    lines = ["solid oval"]
    for (x, y), (p, q) in zip(ring.tolist(), [*ring.tolist()[1:], ring.tolist()[0]], strict=True):
        for corners in (((x, y, 0), (p, q, 0), (p, q, 20)), ((x, y, 0), (p, q, 20), (x, y, 20))):
            lines += ["facet normal 0 0 0", "outer loop", *(f"vertex {a!r} {b!r} {c!r}" for a, b, c in corners), "endloop", "endfacet"]
    (folder / "tube.stl").write_text("\n".join([*lines, "endsolid oval"]) + "\n", encoding="utf-8")
    where = ("--normal", 0, 0, 1, "--heights", 10, "--cutter", "numpy")
    return ["ct", folder / "tube.stl", "--nominal", _oval(folder), "--tolerance", -0.05, 0.05, *where, "--json", "--out", folder / "out"]


UNUSABLE, DEVICE, RECORD = 2, 4, 5
COMMANDS = {
    command.name: command
    for command in (
        Command("run", _run, frozenset({UNUSABLE, 3, DEVICE, RECORD})),
        Command("inspect", _inspect, frozenset({UNUSABLE, DEVICE, RECORD})),
        Command("export", _recorded("export", "last", "--out", "OUT"), frozenset({UNUSABLE, RECORD})),
        Command("replay", _recorded("replay", "last", "--json", "--out", "OUT"), frozenset({UNUSABLE, RECORD})),
        Command("verify", _recorded("verify"), frozenset({UNUSABLE, RECORD})),
        Command("show", _recorded("show", "last"), frozenset({UNUSABLE, RECORD})),
        Command("ct", _ct, frozenset({UNUSABLE})),
    )
}


def prepared(folder: Path) -> Path:
    """Record one run without failures; its records are where every later run begins."""
    folder.mkdir()
    with ExitStack() as stack:
        ended = cmmlink(*_run(folder, stack))
        assert ended.code == 0, ended
    return folder / "records"


@dataclass(frozen=True)
class Trial:
    """What came of one run with one failing call; `wrong` says what must not be."""

    ended: Ended
    faults: Faults
    wrong: tuple[str, ...]


def attempt(command: Command, fails: int, records: Path, *, only: str = "", after: bool = False, again: bool = True) -> Trial:
    """Run a command with its call number `fails` failing, and look at what it left."""
    with tempfile.TemporaryDirectory() as place, ExitStack() as stack:
        folder, scratch = Path(place) / "work", Path(place) / "scratch"
        folder.mkdir()
        scratch.mkdir()
        shutil.copytree(records, folder / "records")
        words = command.make(folder, stack)
        faults = take(Faults(fails, only, after))
        threads, descriptors = _others(), _descriptors()
        faulthandler.dump_traceback_later(LONGEST_RUN_S, exit=True)
        with patch.object(tempfile, "tempdir", str(scratch)), intercepted(), patch("tests.cmmlink.command.main", failing(main)):
            try:
                ended = cmmlink(*words)
            except Exception:
                ended = Ended(1, "", traceback.format_exc())
        faulthandler.cancel_dump_traceback_later()
        wrong = [*_said_wrongly(command, ended, faults), *_kept_wrongly(folder / "records", faults)]
        wrong += (
            [f"left behind: {path.name}" for path in scratch.iterdir()]
            if "unlink" not in faults.failed and "rmdir" not in faults.failed
            else []
        )
        wrong += [f"thread left: {name}" for name in _others() - threads]
        if (left := _descriptors() - descriptors) > 0:
            wrong.append(f"{left} descriptors left open")
        stack.close()
        following = cmmlink(*command.make(folder, stack)) if again else Ended(0, "", "")
        if following.code != 0:
            wrong.append(f"the next run ends with {following.code}: {following.err}")
    return Trial(ended, faults, tuple(wrong))


def killed(command: Command, fails: int, records: Path, *, only: str = "") -> Trial:
    """Kill a process that runs a command at its call number `fails`, and look at what it left. POSIX systems only."""
    with tempfile.TemporaryDirectory() as place, ExitStack() as stack:
        folder, said = Path(place) / "work", Path(place) / "said"
        folder.mkdir()
        shutil.copytree(records, folder / "records")
        words = command.make(folder, stack)
        if (child := os.fork()) == 0:
            with said.open("ab", buffering=0) as told, intercepted():
                descriptor = told.fileno()
                take(Faults(fails, only, kills=True, tell=lambda rows: os.write(descriptor, _lines(rows))))
                with patch("tests.cmmlink.command.main", failing(main)):
                    cmmlink(*words)
            os._exit(0)
        _, status = os.waitpid(child, 0)
        faults = Faults(fails, failed=f"killed at {only or 'call'} {fails}" if os.WIFSIGNALED(status) else "")
        faults.committed = {int(line.split()[0]): bytes.fromhex(line.split()[1]) for line in said.read_text().splitlines()}
        wrong = list(_kept_wrongly(folder / "records", faults))
        again = cmmlink(*command.make(folder, stack))
        if again.code != 0:
            wrong.append(f"the next run ends with {again.code}: {again.err}")
    return Trial(Ended(0, "", ""), faults, tuple(wrong))


def _lines(rows: dict[int, bytes]) -> bytes:
    return "".join(f"{number} {sha256.hex()}\n" for number, sha256 in rows.items()).encode()


def _others() -> set[str]:
    return {thread.name for thread in threading.enumerate() if thread.name != NOT_OURS}


def _descriptors() -> int:
    """How many descriptors this process holds, but for those of the device; 0 where the system does not tell."""
    gc.collect()
    found = Path("/proc/self/fd")
    return (
        sum(not os.path.realpath(entry).startswith(("socket:", "/proc/self/fd/socket:")) for entry in found.iterdir())
        if found.is_dir()
        else 0
    )


def _said_wrongly(command: Command, ended: Ended, faults: Faults) -> Iterator[str]:
    if "Traceback" in ended.err or "defect of cmmlink" in ended.err:
        yield f"a traceback: {ended.err[-1500:]}"
    if not faults.failed:
        if ended.code != 0:
            yield f"nothing failed, yet it ends with {ended.code}: {ended.err}"
        return
    if ended.code not in command.statuses | {0}:
        yield f"exit status {ended.code}: {ended.err}"
    if ended.code not in (0, 3) and not ended.err.startswith("cmmlink: "):
        yield f"no message: {ended.err!r}"
    if "sqlite INSERT" in faults.failed and ended.code != RECORD:
        yield f"the record failed, yet it ends with {ended.code}"
    if ended.out.startswith("{") and ended.code in (0, 1, 3):
        facts = json.loads(ended.out)
        whole = facts.get("received") == facts.get("judged", 0) + facts.get("rejected", 0)
        if not whole or (facts["verdict"] == "conform") != (ended.code == 0) or (ended.code == 0 and facts["received"] < 300):
            yield f"a verdict that is not the result's: {ended.code}, {facts}"


def _kept_wrongly(folder: Path, faults: Faults) -> Iterator[str]:
    """What was committed must be in the file, which is read by SQLite alone."""
    store = sqlite3.connect(folder / "station.sqlite")
    try:
        kept = dict(store.execute("SELECT number, sha256 FROM record"))
        (sound,) = store.execute("PRAGMA integrity_check").fetchone()
    finally:
        store.close()
    if sound != "ok":
        yield f"the file of records: {sound}"
    lost = [number for number, sha256 in faults.committed.items() if kept.get(number) != sha256]
    if lost:
        yield f"committed and lost: records {lost[:5]}"
    ended = cmmlink("verify", "--records", folder)
    if ended.code != 0:
        yield f"verify: {ended.err}"


def sweep(names: list[str], *, after: bool) -> int:
    """Let every call of the named commands fail once; returns how many runs went wrong."""
    wrong = 0
    with tempfile.TemporaryDirectory() as place:
        records = prepared(Path(place) / "prepared")
        for name in names:
            attempt(COMMANDS[name], 0, records)  # what is loaded only when it is used is loaded now
            fails, told = 1, dict[tuple[str, int], list[int]]()
            while True:
                trial = attempt(COMMANDS[name], fails, records, after=after, again=fails % 5 == 0)
                if not trial.faults.failed:
                    break
                for words in trial.wrong:
                    wrong += 1
                    print(f"{name}, call {fails} ({trial.faults.failed}): {words}", flush=True)
                told.setdefault((trial.faults.failed, trial.ended.code), []).append(fails)
                fails += 1
            print(f"{name}: {fails - 1} calls failed, one a run", flush=True)
            for (what, code), calls in sorted(told.items()):
                print(f"    {what:18} exit {code}: {len(calls)}", flush=True)
    print(f"{wrong} runs went wrong")
    return wrong


def sweep_of_kills() -> int:
    """Kill a run at every one of its calls; returns how many left something wrong."""
    wrong = fails = 0
    with tempfile.TemporaryDirectory() as place:
        records = prepared(Path(place) / "prepared")
        while True:
            fails += 1
            trial = killed(COMMANDS["run"], fails, records)
            for words in trial.wrong:
                wrong += 1
                print(f"killed at call {fails}: {words}", flush=True)
            if not trial.faults.failed:
                break
    print(f"killed at each of {fails - 1} calls; {wrong} went wrong")
    return wrong


if __name__ == "__main__":
    os.environ["XDG_STATE_HOME"] = os.environ["XDG_DATA_HOME"] = tempfile.mkdtemp()
    chosen = [word for word in sys.argv[1:] if word in COMMANDS] or list(COMMANDS)
    if "--kill" in sys.argv:
        sys.exit(1 if sweep_of_kills() else 0)
    sys.exit(1 if sweep(chosen, after="--after" in sys.argv) else 0)
