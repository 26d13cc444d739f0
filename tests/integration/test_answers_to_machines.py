"""A machine tool that asks for the verdict and waits: what it does in the end, whatever went wrong on either side."""

import os
import socket
import sqlite3
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np
import pytest

from simulators.answers import await_answer, variables_set_by
from tests.cmmlink.command import cmmlink
from tests.cmmlink.oval_part import LENGTH_MM as OVAL_MM
from tests.cmmlink.oval_part import oval_points, write_nominal
from tests.integration.fail_once import runs_in
from tests.integration.simulated import Simulated, simulated
from tests.integration.split_off import split_off

POSIX_ONLY = pytest.mark.skipif(sys.platform == "win32", reason="pseudo-terminals exist on POSIX systems only")
COUNT = 120
REQUEST = 4711
KILLED = 99
PLAN = """\
part: {{name: oval}}
nominal: {{file: oval.yaml}}
tolerance: {{lower_mm: -0.05, upper_mm: 0.05}}
probe: {{tip_radius_mm: 1.5}}
device: {{type: lines, address: "{address}", unit: mm, silence_s: {silence_s}{more}}}
answer: {{file: {answer}, characteristics: {{profile: 160}}}}
registration: {{datum: {{}}}}
allow: {{unseen_mm: 1.5}}
out: null
discretisation: {{samples: 400}}
"""
OLD_PASS = b"O9100 (CMMLINK ANSWER)\r\n(RUN 20250101-000000-0001)\r\n#150=1.\r\n#151=0.\r\n#152=%d.\r\nM99\r\n"


def planned(folder: Path, address: str, *, silence_s: float = 60.0, more: str = "", answer: str = "O9100.nc") -> Path:
    write_nominal(folder / "oval.yaml")
    told = PLAN.format(address=address, silence_s=silence_s, more=more, answer=answer)
    (folder / "plan.yaml").write_text(told, encoding="utf-8")
    return folder / "plan.yaml"


@contextmanager
def asking(folder: Path, *options: object, within_s: float = 60.0, address: str = "127.0.0.1:0") -> Iterator[Simulated]:
    """A machine tool that touches the oval, asks for the verdict, and waits for its answer."""
    file = folder / "O9100.nc"
    words = ["--unpaced", "--tip-radius-mm", "1.5", "--answer", file, "--request", REQUEST, "--answer-within", within_s, *options]
    with simulated(
        "machine-tool",
        address,
        folder,
        *map(str, words),
        path_mm=np.vstack([oval_points(0.0), oval_points(0.0)[:1]]),
        count=COUNT,
        rate_hz=5.0,
        speed_mm_s=OVAL_MM / COUNT * 5.0,
        noise_mm=0.0,
    ) as machine:
        yield machine


def carried_out(plan: Path) -> tuple[int, dict[str, Any], str]:
    done = cmmlink("run", plan, "--json", "--records", plan.parent / "records")
    assert done.out, done.err
    return done.code, done.json(), done.err


def carry_out(plan: Path) -> None:
    cmmlink("run", plan, "--headless", "--records", plan.parent / "records")


def end_of(machine: Simulated) -> str:
    """What the machine did in the end; its account of the points comes before."""
    machine.tally()
    return str(machine.said.recv())


@pytest.mark.parametrize(
    ("options", "code", "does"),
    [
        ((), 0, "CONFORM, worst deviation {worst}: the part is released"),
        (("--defect-mm", "0.2", "--defect-station-mm", "20"), 1, "NOT CONFORM, worst deviation {worst}: the machine stops"),
        (("--fault=no-contact:1@40-50",), 3, "NOT PROVEN, worst deviation {worst}: the machine stops"),
        (("--fault=tool-change@60",), 3, "NOT PROVEN, worst deviation {worst}: the machine stops"),
    ],
)
def test_a_machine_does_what_the_verdict_says(options: tuple[str, ...], code: int, does: str, tmp_path: Path) -> None:
    (tmp_path / "O9100.nc").write_bytes(OLD_PASS % (REQUEST - 1))
    with asking(tmp_path, *options) as machine:
        found = carried_out(planned(tmp_path, machine.address))
        assert found[0] == code, found[2]
        assert (found[1]["answer"]["sent"], found[1]["answer"]["request"], found[1]["answer"]["problem"]) == (True, REQUEST, None)
        worst = f"{round(found[1]['worst']['deviation_mm'], 4):g}"
        assert end_of(machine) == f"request {REQUEST}: {does.format(worst=worst)}"
    run = found[1]["run"]
    written = (tmp_path / "O9100.nc").read_bytes()
    assert f"(RUN {run})\r\n".encode("ascii") in written
    kept = shown(tmp_path)["answer"]
    assert (kept.pop("text").encode("ascii"), len(kept.pop("chain_sha256"))) == (written, 64)
    assert kept | {"unrecorded": None} == found[1]["answer"]


def shown(folder: Path) -> dict[str, Any]:
    """The run as its record tells it, which is as it was written and signed."""
    assert cmmlink("verify", "--records", folder / "records", "--json").json()["state"] == "intact and signed"
    described = cmmlink("show", "last", "--records", folder / "records", "--json").json()
    assert isinstance(described, dict)
    return described


def test_what_cannot_be_sent_is_told_and_changes_no_verdict(tmp_path: Path) -> None:
    with asking(tmp_path, within_s=0.2) as machine:
        found = carried_out(planned(tmp_path, machine.address, answer="away/O9100.nc"))
        assert found[0] == 0
        assert found[1]["verdict"] == "conform"
        assert found[1]["answer"]["sent"] is False
        assert "NOT SENT to the machine: " in found[2]
        assert "there is no folder" in found[2]
        kept = shown(tmp_path)["answer"]
        assert (kept["sent"], kept["verdict"], kept["problem"]) == (False, None, found[1]["answer"]["problem"])
        assert kept["text"].startswith("O9100 (CMMLINK ANSWER)\r\n")
        assert f"answer         not sent: {kept['problem']}" in cmmlink("show", "last", "--records", tmp_path / "records").out
        assert end_of(machine) == f"request {REQUEST}: no answer within 0.2 s: the machine stops"


def test_a_machine_whose_link_was_cut_is_told_that_nothing_is_proven(tmp_path: Path) -> None:
    with asking(tmp_path, "--fault=unplug@60") as machine:
        found = carried_out(planned(tmp_path, machine.address))
    assert (found[0], found[1]["verdict"], found[1]["answer"]["sent"]) == (4, "uncertain", True), found[2]
    assert "NOT PROVEN" in what_follows(tmp_path)


def test_an_emergency_stop_ends_the_run_after_the_silence_that_the_plan_allows(tmp_path: Path) -> None:
    with asking(tmp_path, "--fault=emergency-stop@60") as machine:
        found = carried_out(planned(tmp_path, machine.address, silence_s=2.0))
        assert (found[0], found[1]["verdict"]) == (4, "uncertain"), found[2]
        assert "silent for" in found[2]
        assert end_of(machine) == f"request {REQUEST}: emergency stop: the machine stops"


@POSIX_ONLY
def test_a_killed_machine_leaves_a_run_that_proves_nothing(tmp_path: Path) -> None:
    """At a serial port, what the killed process said last may be gone with it, the number of its request too."""
    with asking(tmp_path, "--fault=die@60", "--fault=parity", address="pty") as machine:
        found = carried_out(planned(tmp_path, machine.address))
    assert (found[0], found[1]["verdict"]) == (4, "uncertain"), found[2]
    assert "the link was lost" in found[2]
    assert what_follows(tmp_path).endswith("the machine stops")


def printed(last: int) -> bytes:
    """Lines with so many points of the oval, each behind its nominal one."""
    rows = []
    for k, ((x, y), (p, q)) in enumerate(zip(oval_points(0.0)[:last].tolist(), oval_points(1.5)[:last].tolist(), strict=True), 1):
        rows.append(f"G800 N{k} X{x:.4f} Y{y:.4f} Z0. I0. J1. K0.\r\nG801 N{k} X{p:.4f} Y{q:.4f} Z0. R1.5\r\n")
    return "".join(rows).encode("ascii")


OPENING = b"REQUEST    4711\r\nSTART\r\n"


@pytest.mark.parametrize(
    ("sent", "code", "words", "told"),
    [
        (OPENING + printed(360) + b"END\r\n", 0, "", (4711, 1)),
        (OPENING + printed(60) + b"G801 N61 X1", 4, "the link was lost", (4711, 3)),
        (OPENING + printed(360), 4, "the link was lost", (4711, 3)),
        (b"REQUEST    4710\r\nSTART\r\n" + printed(60) + OPENING + printed(360) + b"END\r\n", 3, "began anew", (4711, 3)),
        (b"REQUEST    4Z11\r\nSTART\r\n" + printed(360) + b"END\r\n", 0, "told no number of a request", (0, 9)),
        (b"START\r\n" + printed(360) + b"END\r\n", 0, "told no number of a request", (0, 9)),
        (OPENING, 4, "the link was lost", (0, 9)),
    ],
    ids=["whole", "cut in mid-line", "without its end", "begun anew", "garbled request", "no request", "nothing touched"],
)
def test_whatever_comes_of_a_cable_the_machine_is_told_no_more_than_is_proven(
    sent: bytes, code: int, words: str, told: tuple[int, int], tmp_path: Path
) -> None:
    with socket.create_server(("127.0.0.1", 0)) as control:

        def talk() -> None:
            link, _ = control.accept()
            with link:
                link.sendall(sent)

        address = f"127.0.0.1:{control.getsockname()[1]}"
        thread = threading.Thread(target=talk, daemon=True)
        thread.start()
        ended = carried_out(planned(tmp_path, address))
        thread.join()
    assert (ended[0], words in ended[2] + str(ended[1])) == (code, True), ended
    found = variables_set_by((tmp_path / "O9100.nc").read_text(encoding="ascii"))
    assert found is not None
    assert (found[152], found[150]) == told
    assert ended[1]["answer"]["sent"] is (told[1] != 9)


def test_a_killed_run_passes_no_part_and_the_machine_stops(tmp_path: Path) -> None:
    """Not even where an earlier answer was to a request of the same number, as where a control lost its variables: it was withdrawn."""
    (tmp_path / "O9100.nc").write_bytes(OLD_PASS % REQUEST)
    assert what_follows(tmp_path).endswith("the part is released")
    with asking(tmp_path, "--fault=silence@60") as machine:
        run = split_off(carry_out, planned(tmp_path, machine.address))
        wait_for(lambda: any(verdict == "" for verdict in begun_in(tmp_path / "records")))
        run.kill()
        run.join()
    assert what_follows(tmp_path) == f"request {REQUEST}: no answer within 0 s: the machine stops"


def test_of_an_answer_that_a_kill_kept_from_the_records_nothing_is_claimed(tmp_path: Path) -> None:
    """Killed behind the writing of the answer and before it is on record: the run is whole, and says that nobody knows what was told."""
    with asking(tmp_path) as machine:
        run = split_off(carry_out_until_answered, planned(tmp_path, machine.address))
        run.join(60)
        assert run.exitcode == KILLED
        assert "the part is released" in end_of(machine)
    assert (shown(tmp_path)["answer"], shown(tmp_path)["verdict"]) == (None, "conform")
    told = cmmlink("show", "last", "--records", tmp_path / "records").out
    assert "answer         none is on record, though the plan asks for one: whether the machine was told is not known" in told


def test_an_answer_that_the_records_do_not_hold_is_told_and_changes_no_verdict(tmp_path: Path) -> None:
    with asking(tmp_path) as machine, patch("cmmlink.conduct.keep_answer", lambda *_: "the disk is full"):
        found = carried_out(planned(tmp_path, machine.address))
        assert "the part is released" in end_of(machine)
    assert (found[0], found[1]["answer"]["sent"], found[1]["answer"]["unrecorded"]) == (0, True, "the disk is full")
    assert "cmmlink: what the machine was told is not on record: the disk is full" in found[2]
    assert shown(tmp_path)["answer"] is None


def carry_out_until_answered(plan: Path) -> None:
    with patch("cmmlink.conduct.keep_answer", lambda *_: os._exit(KILLED)):
        carry_out(plan)


def what_follows(folder: Path) -> str:
    """What a machine does that finds the answer as it stands now."""
    return await_answer(folder / "O9100.nc", REQUEST, 0.0)


def begun_in(records: Path) -> list[str]:
    with suppress(sqlite3.OperationalError):  # it is just being made
        return list(runs_in(records).values()) if (records / "station.sqlite").exists() else []
    return []


def wait_for(met: Callable[[], bool], within_s: float = 30.0) -> None:
    end_s = time.monotonic() + within_s
    while not met():
        assert time.monotonic() < end_s
        time.sleep(0.01)


def test_check_says_where_the_machine_is_answered_and_refuses_a_file_that_is_something_else(tmp_path: Path) -> None:
    plan = planned(tmp_path, "127.0.0.1:9", answer="dnc/O9100.nc")
    told = cmmlink("check", plan)
    assert told.code == 0
    assert f"the machine is told the verdict in {tmp_path / 'dnc' / 'O9100.nc'}, which is out of reach now" in told.out
    (tmp_path / "dnc").mkdir()
    (tmp_path / "dnc" / "O9100.nc").write_text("O9100 (THE MAIN PROGRAM)", encoding="ascii")
    for command in ("check", "run"):
        problem = cmmlink(command, plan).refused()
        assert "line 6: answer.file: " in problem
        assert "is no answer of cmmlink's" in problem
    assert (tmp_path / "dnc" / "O9100.nc").read_text(encoding="ascii") == "O9100 (THE MAIN PROGRAM)"
