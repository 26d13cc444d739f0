"""Every call to the operating system fails once: a command is run again and again, and in each run another call fails.

`python -m tests.integration.fail_once [COMMAND ...] [--after | --kill] [--every]` strikes every place at which a command calls the
system: a line of cmmlink, or of a library below it, and the lines that lead there. A place in a loop is struck at its first call;
`--every` strikes every call of it. A sample is in test_every_call_fails_once.py. After each run: the exit status is one that is
documented for such a failure, standard error names what failed and holds no traceback, what was committed to the record is in it and
its chain is whole, no temporary file, thread or descriptor is left, and the next run of the command works.
"""

import faulthandler
import gc
import json
import os
import re
import shutil
import sqlite3
import sys
import tempfile
import threading
import time
import traceback
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import ExitStack, suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any
from unittest.mock import patch

from cmmlink.commands import main
from tests.cmmlink.command import Ended, cmmlink
from tests.cmmlink.oval_part import oval_points, write_nominal, write_points
from tests.cmmlink.prepared import preparations_made_once
from tests.integration.counter_parties import CounterParty, LineScanner, PortScanner, RingScanner, lines_of
from tests.integration.failing_calls import NOT_OURS, Faults, failing, intercepted, take

LONGEST_RUN_S = 300.0
FALSE = ("the answer could not be written", "is damaged", "altered", "is none of")  # of no call that fails
FEWEST = 300  # points of a whole scan
OF_TIDYING = ("unlink", "rmdir", "scandir", "lstat")  # where one of these fails, a temporary file may stay


PLAN = """\
part: {{name: oval, serial_number: 7}}
nominal: {{file: oval.yaml}}
tolerance: {{lower_mm: -0.05, upper_mm: 0.05}}
device: {{type: {kind}, address: "{address}", reconnect_s: 2, silence_s: 1{more}}}
out: null
registration: {{datum: {{}}}}
discretisation: {{samples: 400}}
"""


ASKING = """\
part: {name: oval, serial_number: 7}
nominal: {file: oval.yaml}
tolerance: {lower_mm: -0.05, upper_mm: 0.05}
device: {type: lines, file: prints.txt, existing: true, unit: mm, silence_s: 1}
answer: {file: O9100.nc}
out: null
registration: {datum: {}}
allow: {unseen_mm: 1}
discretisation: {samples: 400}
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


def _run(scanner: Callable[[], CounterParty], kind: str = "serial", more: str = "") -> Callable[[Path, ExitStack], list[object]]:
    def make(folder: Path, stack: ExitStack) -> list[object]:
        _oval(folder)
        device = stack.enter_context(scanner())
        plan = folder / "plan.yaml"
        plan.write_text(PLAN.format(address=device.address, kind=kind, more=more), encoding="utf-8")
        return ["run", plan, "--headless", "--json", "--records", folder / "records"]

    return make


EARLIER = "O9100 (CMMLINK ANSWER)\r\n(RUN {run})\r\n#150=1.\r\n#152=41.\r\nM99\r\n"


def _asked(folder: Path, _: ExitStack) -> list[object]:
    """A machine tool printed the oval and asks for the verdict; the answer to its earlier request, which passed a part, stands there."""
    _oval(folder)
    points = enumerate(oval_points(0.01).tolist(), start=1)
    printed = ["REQUEST 42", "START", *(f"G801 N{i} X{x:.4f} Y{y:.4f} Z0." for i, (x, y) in points), "END", ""]
    (folder / "prints.txt").write_bytes("\r\n".join(printed).encode("ascii"))
    passed = next(run for run, verdict in runs_in(folder / "records").items() if verdict == "conform")
    (folder / "O9100.nc").write_bytes(EARLIER.format(run=passed).encode("ascii"))
    (folder / "plan.yaml").write_text(ASKING, encoding="utf-8")
    return ["run", folder / "plan.yaml", "--headless", "--json", "--records", folder / "records"]


def runs_in(folder: Path) -> dict[str, str]:
    """The runs of records, in the order in which they began, and the verdict of each that came to its end; empty where it has none."""
    store = sqlite3.connect(folder / "station.sqlite")
    try:
        rows = store.execute("SELECT run, kind, body FROM record WHERE kind IN ('run', 'end') ORDER BY number").fetchall()
    finally:
        store.close()
    found = {run: "" for run, kind, _ in rows if kind == "run"}
    ends = {run: json.loads(body) for run, kind, body in rows if kind == "end"}
    return found | {run: end["verdict"] for run, end in ends.items() if end["state"] == "complete" and end["verdict"]}


def _inspect(folder: Path, _: ExitStack) -> list[object]:
    return [*_inspected(folder, "records"), "--json", "--out", folder / "out"]


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
    where = ("--normal", 0, 0, 1, "--heights", 10, "--cutter", "numpy", "--tolerance", -0.05, 0.05, "--records", folder / "records")
    return ["ct", folder / "tube.stl", "--nominal", _oval(folder), *where, "--json", "--out", folder / "out"]


def _backup(folder: Path, _: ExitStack) -> list[object]:
    return ["backup", folder / "kept.sqlite", "--replace", "--records", folder / "records"]


def _restore(folder: Path, _: ExitStack) -> list[object]:
    """Of a backup that has one run more than the records."""
    if not (folder / "kept.sqlite").exists():
        shutil.copytree(folder / "records", folder / "ahead")
        _quietly(*_inspected(folder, "ahead"))
        _quietly("backup", folder / "kept.sqlite", "--records", folder / "ahead")
    return ["restore", folder / "kept.sqlite", "--records", folder / "records"]


def _merge(folder: Path, _: ExitStack) -> list[object]:
    if not (folder / "elsewhere").exists():
        _quietly(*_inspected(folder, "elsewhere"))
    return ["merge", folder / "elsewhere", "--records", folder / "records"]


def _inspected(folder: Path, records: str) -> list[object]:
    limits = ("--tolerance", -0.05, 0.05, "--fit", "none", "--coverage-min", 0)
    return ["inspect", folder / "points.csv", "--nominal", _oval(folder), *limits, "--records", folder / records]


def _quietly(*words: object) -> None:
    ended = cmmlink(*words)
    assert ended.code == 0, ended


UNUSABLE, DEVICE, RECORD = 2, 4, 5
OF_A_RUN = frozenset({UNUSABLE, 3, DEVICE, RECORD})
COMMANDS = {
    command.name: command
    for command in (
        Command("run", _run(lambda: LineScanner(lines_of(0.01))), OF_A_RUN),
        Command("run-port", _run(lambda: PortScanner(lines_of(0.01))), OF_A_RUN),
        Command("run-modbus", _run(RingScanner, "modbus", ", map: generic-ring"), OF_A_RUN),
        Command("run-asked", _asked, OF_A_RUN),
        Command("inspect", _inspect, frozenset({UNUSABLE, DEVICE, RECORD})),
        Command("export", _recorded("export", "last", "--out", "OUT"), frozenset({UNUSABLE, RECORD})),
        Command("replay", _recorded("replay", "last", "--json", "--out", "OUT"), frozenset({UNUSABLE, RECORD})),
        Command("verify", _recorded("verify"), frozenset({UNUSABLE, RECORD})),
        Command("show", _recorded("show", "last"), frozenset({UNUSABLE, RECORD})),
        Command("ct", _ct, frozenset({UNUSABLE, RECORD})),
        Command("backup", _backup, frozenset({UNUSABLE, RECORD})),
        Command("restore", _restore, frozenset({UNUSABLE, RECORD})),
        Command("merge", _merge, frozenset({UNUSABLE, RECORD})),
    )
}


def prepared(folder: Path) -> Path:
    """Record one run without failures; its records are where every later run begins."""
    folder.mkdir()
    with ExitStack() as stack:
        ended = cmmlink(*COMMANDS["run"].make(folder, stack))
        assert ended.code == 0, ended
    return folder / "records"


@dataclass(frozen=True)
class Trial:
    """What came of one run with one failing call; `wrong` says what must not be."""

    ended: Ended
    faults: Faults
    wrong: tuple[str, ...]


def attempt(command: Command, faults: Faults, records: Path, *, again: bool = True) -> Trial:
    """Run a command with one of its calls failing, and look at what it left."""
    with tempfile.TemporaryDirectory() as place, ExitStack() as stack:
        folder, scratch = Path(place) / "work", Path(place) / "scratch"
        folder.mkdir()
        scratch.mkdir()
        shutil.copytree(records, folder / "records")
        words = command.make(folder, stack)
        take(faults)
        threads, descriptors = _others(), _descriptors()
        faulthandler.dump_traceback_later(LONGEST_RUN_S, exit=True)
        with patch.object(tempfile, "tempdir", str(scratch)), intercepted(), patch("tests.cmmlink.command.main", failing(main)):
            try:
                ended = cmmlink(*words)
            except Exception:
                ended = Ended(1, "", traceback.format_exc())
        faulthandler.cancel_dump_traceback_later()
        wrong = [*_said_wrongly(command, ended, faults), *_kept_wrongly(folder / "records", records, faults)]
        wrong += _answered_wrongly(folder, records, faults)
        made_too_late = faults.after and "mkdir at tempfile.py" in faults.place  # nobody was told its name
        if faults.failed not in OF_TIDYING and "shutil.py" not in faults.place and not made_too_late:
            wrong += [f"left behind: {path.name}" for path in scratch.iterdir()]
        wrong += [f"thread left: {name}" for name in _others() - threads]
        wrong += [f"left open: {path}" for path in _descriptors() - descriptors]
        stack.close()
        following = cmmlink(*command.make(folder, stack)) if again else Ended(0, "", "")
        if following.code != 0:
            wrong.append(f"the next run ends with {following.code}: {following.err}")
    return Trial(ended, faults, tuple(wrong))


def killed(command: Command, faults: Faults, records: Path) -> Trial:
    """Kill a process that runs a command at one of its calls, and look at what it left. POSIX systems only."""
    with tempfile.TemporaryDirectory() as place, ExitStack() as stack:
        folder, said = Path(place) / "work", Path(place) / "said"
        folder.mkdir()
        shutil.copytree(records, folder / "records")
        words = command.make(folder, stack)
        write = os.write
        if (child := os.fork()) == 0:
            with said.open("ab", buffering=0) as told, intercepted():
                descriptor = told.fileno()
                take(replace(faults, kills=True, tell=lambda rows: write(descriptor, _lines(rows))))
                with patch("tests.cmmlink.command.main", failing(main)):
                    cmmlink(*words)
            os._exit(0)
        _, status = os.waitpid(child, 0)
        faults.failed = "killed" if os.WIFSIGNALED(status) else ""
        faults.committed = {int(line.split()[0]): bytes.fromhex(line.split()[1]) for line in said.read_text().splitlines()}
        wrong = [*_kept_wrongly(folder / "records", records, faults), *_answered_wrongly(folder, records, faults)]
        again = cmmlink(*command.make(folder, stack))
        if again.code != 0:
            wrong.append(f"the next run ends with {again.code}: {again.err}")
    return Trial(Ended(0, "", ""), faults, tuple(wrong))


def _lines(rows: dict[int, bytes]) -> bytes:
    return "".join(f"{number} {sha256.hex()}\n" for number, sha256 in rows.items()).encode()


def _others() -> set[str]:
    return {thread.name for thread in threading.enumerate() if thread.name != NOT_OURS}


def _descriptors() -> Counter[str]:
    """What the descriptors of this process lead to, but for those of sockets; nothing where the system does not tell."""
    gc.collect()
    found, leading = Path("/proc/self/fd"), list[str]()
    for entry in found.iterdir() if found.is_dir() else ():
        with suppress(FileNotFoundError):  # the one by which the folder was read
            leading.append(os.readlink(entry))
    return Counter(where for where in leading if not where.startswith("socket:"))


def _said_wrongly(command: Command, ended: Ended, faults: Faults) -> Iterator[str]:
    if "Traceback" in ended.err or "defect of cmmlink" in ended.err:
        yield f"a traceback: {ended.err[-1500:]}"
        return
    if not faults.failed:
        if ended.code != 0:
            yield f"nothing failed, yet it ends with {ended.code}: {ended.err}"
        return
    if ended.code not in command.statuses | {0}:
        yield f"exit status {ended.code}: {ended.err}"
    if ended.code not in (0, 3):
        if not ended.err.startswith("cmmlink: "):
            yield f"no message: {ended.err!r}"
        if not any(words in ended.err for words in _words_of(faults.error)) or any(words in ended.err for words in FALSE):
            yield f"a false cause: {ended.err!r}"
    if f"{os.sep}records" in str(getattr(faults.error, "filename", "")) and ended.code not in (0, RECORD):
        yield f"the folder of the records failed, yet it ends with {ended.code}: {ended.err}"
    if "sqlite INSERT" in faults.failed and ended.code != RECORD and not _is_answer_alone(ended):
        yield f"the record failed, yet it ends with {ended.code}"
    if ended.out.startswith("{") and ended.code in (0, 1, 3):
        for facts in _judged_in(json.loads(ended.out)):
            whole = facts.get("received") == facts.get("judged", 0) + facts.get("rejected", 0)
            if not whole or (facts["verdict"] == "conform") != (ended.code == 0) or (ended.code == 0 and facts["received"] < FEWEST):
                yield f"a verdict that is not the result's: {ended.code}, {facts}"


def _is_answer_alone(ended: Ended) -> bool:
    """Whether the run is on record, and only what its machine was told is not, which is said twice: that changes no exit status."""
    facts = json.loads(ended.out) if ended.out.startswith("{") else {}
    unrecorded = (facts.get("answer") or {}).get("unrecorded")
    return bool(facts.get("chain_sha256") and unrecorded) and f"what the machine was told is not on record: {unrecorded}" in ended.err


def _words_of(error: BaseException | None) -> tuple[str, ...]:
    """The words of which one must stand in the message, so that it names the true cause."""
    if isinstance(error, MemoryError):
        return ("memory",)
    return (getattr(error, "strerror", None) or str(error),)


def _judged_in(facts: dict[str, Any]) -> list[dict[str, Any]]:
    """The results of one section, or of each of several."""
    found: list[dict[str, Any]] = facts.get("slices", [facts])
    return found


def _kept_wrongly(folder: Path, before: Path, faults: Faults) -> Iterator[str]:
    """What was committed must be in the file, which is read by SQLite alone; a file that is the same as before is as sound."""
    if not faults.committed and _bytes_of(folder) == _bytes_of(before):
        return
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


def _answered_wrongly(folder: Path, before: Path, faults: Faults) -> Iterator[str]:
    """A part is passed by the answer to the run alone whose verdict CONFORM is on record, and by no earlier one once a run has begun."""
    kept = runs_in(folder / "records") if (folder / "O9100.nc").exists() else {}
    begun = kept.keys() - runs_in(before).keys()
    for path in (*folder.glob("O9100.nc"), *folder.glob(".O9100.nc.*")):
        text = path.read_text(encoding="ascii")
        if "#150=1." not in text:
            continue
        run, request = re.search(r"RUN ([-0-9]+)", text), re.search(r"#152=(\d+)", text)
        if run is None or kept.get(run[1]) != "conform" or request is None:
            yield f"{path.name} passes a part whose verdict is {kept.get(run[1]) if run else None}: {text}"
        elif begun and run[1] not in begun and "answer_file" not in faults.place:
            yield f"{path.name} still passes the part before: {text}"
        elif (run[1] in begun) != (request[1] == "42"):
            yield f"{path.name} answers a request of another run: {text}"
    if not faults.failed and begun and f"#150={1}." not in (folder / "O9100.nc").read_text(encoding="ascii"):
        yield "nothing failed, yet the machine was not told"


def _bytes_of(folder: Path) -> list[bytes]:
    """What the files of records hold; a log of SQLite that is empty is none."""
    names = ("station.sqlite", "station.sqlite-wal")
    return [path.read_bytes() if (path := folder / name).is_file() else b"" for name in names]


def places_of(command: Command, records: Path) -> Counter[str]:
    """Every place at which a command calls the system, and how often, as two runs without failures show."""
    attempt(command, Faults(0), records, again=False)  # what is loaded only when it is used is loaded now
    runs = [attempt(command, Faults(0), records, again=False) for _ in range(2)]
    for run in runs:
        assert not run.wrong, run.wrong
    return runs[0].faults.places | runs[1].faults.places


def sweep(names: list[str], mode: str, *, every: bool) -> int:
    """Let the calls of the named commands fail, one a run, or kill a run at each; returns how many runs went wrong."""
    wrong = 0
    with tempfile.TemporaryDirectory() as folder, preparations_made_once():
        records = prepared(Path(folder) / "prepared")
        for name in names:
            began_s, places = time.monotonic(), places_of(COMMANDS[name], records)
            strikes = [(place, number) for place, calls in places.items() for number in range(1, calls + 1 if every else 2)]
            told, unmet = Counter[tuple[str, int]](), 0
            for place, number in strikes:
                faults = Faults(number, place=place, after=mode == "after")
                trial = (killed if mode == "kill" else attempt)(COMMANDS[name], faults, records)
                for words in trial.wrong:
                    wrong += 1
                    print(f"{name}, {place}, number {number}: {words}", flush=True)
                unmet += not trial.faults.failed
                told[place.partition(" at ")[0], trial.ended.code] += 1
                print(f"    {place}: {trial.ended.code} {trial.ended.err.strip()}", flush=True)
            took_s = time.monotonic() - began_s
            print(
                f"{name}: {len(strikes)} of {places.total()} calls struck at {len(places)} places, {unmet} unmet, {took_s:.0f} s",
                flush=True,
            )
            for (what, code), calls in sorted(told.items()):
                print(f"    {what:18} {'killed' if mode == 'kill' else f'exit {code}'}: {calls}", flush=True)
    print(f"{wrong} runs went wrong")
    return wrong


if __name__ == "__main__":
    os.environ["XDG_STATE_HOME"] = os.environ["XDG_DATA_HOME"] = tempfile.mkdtemp()
    chosen = [word for word in sys.argv[1:] if word in COMMANDS] or list(COMMANDS)
    given = next((mode for mode in ("after", "kill") if f"--{mode}" in sys.argv), "before")
    sys.exit(1 if sweep(chosen, given, every="--every" in sys.argv) else 0)
