"""A machine tool that asks for the verdict and waits: what it does in the end, whatever went wrong on either side."""

import sqlite3
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from simulators.answers import await_answer
from tests.cmmlink.command import cmmlink
from tests.cmmlink.oval_part import LENGTH_MM as OVAL_MM
from tests.cmmlink.oval_part import oval_points, write_nominal
from tests.integration.fail_once import runs_in
from tests.integration.simulated import Simulated, simulated
from tests.integration.split_off import split_off

COUNT = 120
REQUEST = 4711
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


def planned(folder: Path, address: str, *, silence_s: float = 5.0, more: str = "", answer: str = "O9100.nc") -> Path:
    write_nominal(folder / "oval.yaml")
    told = PLAN.format(address=address, silence_s=silence_s, more=more, answer=answer)
    (folder / "plan.yaml").write_text(told, encoding="utf-8")
    return folder / "plan.yaml"


@contextmanager
def asking(folder: Path, *options: object, within_s: float = 20.0) -> Iterator[Simulated]:
    """A machine tool that touches the oval, asks for the verdict, and waits for its answer."""
    file = folder / "O9100.nc"
    words = ["--unpaced", "--tip-radius-mm", "1.5", "--answer", file, "--request", REQUEST, "--answer-within", within_s, *options]
    with simulated(
        "machine-tool",
        "127.0.0.1:0",
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
    assert f"(RUN {run})\r\n".encode("ascii") in (tmp_path / "O9100.nc").read_bytes()


def test_what_cannot_be_sent_is_told_and_changes_no_verdict(tmp_path: Path) -> None:
    with asking(tmp_path, within_s=0.2) as machine:
        found = carried_out(planned(tmp_path, machine.address, answer="away/O9100.nc"))
        assert found[0] == 0
        assert found[1]["verdict"] == "conform"
        assert found[1]["answer"]["sent"] is False
        assert "NOT SENT to the machine: " in found[2]
        assert "there is no folder" in found[2]
        assert end_of(machine) == f"request {REQUEST}: no answer within 0.2 s: the machine stops"


def test_a_machine_whose_link_was_cut_is_told_that_nothing_is_proven(tmp_path: Path) -> None:
    with asking(tmp_path, "--fault=unplug@60") as machine:
        found = carried_out(planned(tmp_path, machine.address))
    assert (found[0], found[1]["verdict"], found[1]["answer"]["sent"]) == (4, "uncertain", True), found[2]
    assert "NOT PROVEN" in what_follows(tmp_path)


def test_an_emergency_stop_ends_the_run_after_the_silence_that_the_plan_allows(tmp_path: Path) -> None:
    with asking(tmp_path, "--fault=emergency-stop@60") as machine:
        found = carried_out(planned(tmp_path, machine.address, silence_s=0.5))
        assert (found[0], found[1]["verdict"]) == (4, "uncertain"), found[2]
        assert "silent for" in found[2]
        assert end_of(machine) == f"request {REQUEST}: emergency stop: the machine stops"


def test_a_killed_machine_leaves_a_run_that_proves_nothing(tmp_path: Path) -> None:
    with asking(tmp_path, "--fault=die@60") as machine:
        found = carried_out(planned(tmp_path, machine.address))
        assert (found[0], found[1]["verdict"]) == (4, "uncertain"), found[2]
        assert "the link was lost" in found[2]
    assert "NOT PROVEN" in what_follows(tmp_path)


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
