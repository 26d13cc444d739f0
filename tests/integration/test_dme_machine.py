"""A part on the simulated coordinate measuring machine, from the nominal to the verdict."""

import socket
import time
from collections.abc import Callable
from dataclasses import replace
from multiprocessing import Pipe
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cmmlink.console.device_test import listen_to_device
from cmmlink.console.job import Job
from cmmlink.devices import connect
from cmmlink.plan.scan import load_plan
from cmmlink.record.reader import check_chain, list_runs, open_to_read, points_of
from drivers.codecs.dme_commands import curve_density, scans_on_curve
from drivers.codecs.dme_points import PointCheck
from drivers.codecs.dme_session import DmeJob
from drivers.errors import DeviceError, LinkError
from drivers.links.dme_machine import DmeMachine
from drivers.source import Arrival, PointBatch, ScanClosed
from tests.cmmlink.command import cmmlink
from tests.cmmlink.recorded import today
from tests.drivers.codecs.streams import Account, account
from tests.integration.killed import record_machine
from tests.integration.simulated import Simulated, simulated
from tests.integration.split_off import split_off

TURN = np.linspace(0.0, 2.0 * np.pi, 1001)
PART_MM = np.column_stack([40.0 * np.cos(TURN) + 4.0 * np.cos(2.0 * TURN), 15.0 * np.sin(TURN)])
LENGTH_MM = float(np.hypot(*np.diff(PART_MM, axis=0).T).sum())
STEP_MM, RATE_HZ, RADIUS_MM = 0.25, 2000.0, 1.5
COUNT = round(LENGTH_MM / STEP_MM)
_OUTWARD = np.gradient(PART_MM[:, 1]), -np.gradient(PART_MM[:, 0])
_COLUMNS = [*PART_MM.T, np.zeros(len(PART_MM)), *(_OUTWARD / np.hypot(*_OUTWARD)), np.zeros(len(PART_MM))]
[COURSE] = scans_on_curve(np.column_stack(_COLUMNS)[:-1:5], closed=True)
JOB = DmeJob(PointCheck(RADIUS_MM, 0.001, 50.0), (COURSE,), preparations=(curve_density(STEP_MM, 10.0),))
PLAN = """\
part: {{name: oval}}
nominal: {{file: nominal.csv, closed: true}}
tolerance: {{lower_mm: -0.05, upper_mm: 0.05}}
probe: {{tip_radius_mm: {radius}}}
device: {device}
out: null
discretisation: {{samples: 300}}
"""
PART = ["--tip-radius-mm", str(RADIUS_MM), "--form-error-mm", "0.02", "--unpaced"]


def measured(
    folder: Path,
    name: str,
    device: str,
    *options: str,
    radius_mm: float = RADIUS_MM,
    more: str = "",
    before: Callable[[str], None] = lambda _: None,
) -> tuple[int, dict[str, Any], str]:
    """Exit status, result and messages of a run against a simulated device; the same options are the same part."""
    np.savetxt(folder / "nominal.csv", PART_MM[::10], delimiter=",")
    with simulated(
        name,
        "127.0.0.1:0",
        folder,
        *PART,
        *options,
        path_mm=PART_MM,
        count=COUNT,
        rate_hz=RATE_HZ,
        speed_mm_s=STEP_MM * RATE_HZ,
        noise_mm=0.001,
    ) as machine:
        plan = PLAN.format(device=device.format(address=machine.address), radius=radius_mm) + more
        (folder / "plan.yaml").write_text(plan, encoding="utf-8")
        before(machine.address)
        done = cmmlink("run", folder / "plan.yaml", "--json", "--records", folder / "records")
    assert done.out, done.err
    return done.code, done.json(), done.err


DME = f"{{{{type: dme, address: '{{address}}', scan: {{{{type: curve, step_mm: {STEP_MM}}}}}}}}}"


def test_a_run_of_the_machine_is_replayed_from_its_record(tmp_path: Path) -> None:
    code, facts, errors = measured(tmp_path, "dme", DME)
    assert code == 0, errors
    again = cmmlink("replay", facts["run"], "--records", tmp_path / "records", "--json")
    assert again.code == 0, again.err
    assert again.json()["identical"] is True
    shown = cmmlink("show", facts["run"], "--records", tmp_path / "records")
    assert "I++ DME 1.4, CartCMM, tool Probe1, MachineCsy" in shown.out


def test_single_points_along_the_nominal_are_judged(tmp_path: Path) -> None:
    code, facts, errors = measured(tmp_path, "dme", "{{type: dme, address: '{address}', scan: {{type: points, step_mm: 1.5}}}}")
    assert (code, facts["verdict"]) == (0, "conform"), errors
    assert 120 < facts["received"] == facts["judged"] < 400


@pytest.mark.parametrize("pose", ["", "registration: {fit: none}\n"])
def test_a_part_that_can_no_longer_pass_is_not_scanned_to_the_end(pose: str, tmp_path: Path) -> None:
    """The scan stands still behind the defect: nothing but the proof can end it."""
    defect = ("--defect-mm", "0.4", "--defect-station-mm", "20", "--fault=stall:60@300")
    code, facts, errors = measured(tmp_path, "dme", DME, *defect, more=f"stop_when_failed: true\n{pose}")
    assert (code, facts["verdict"], facts["ending"], facts["complete"]) == (1, "nonconform", "complete", False), errors
    assert 0 < facts["received"] < 350
    assert any("stop_when_failed" in note for note in facts["notes"])
    again = cmmlink("replay", facts["run"], "--records", tmp_path / "records", "--json")
    assert again.json()["identical"] is True, again.err


def test_a_scan_that_is_stopped_is_aborted_at_the_machine(tmp_path: Path) -> None:
    np.savetxt(tmp_path / "path.csv", PART_MM, delimiter=",")
    options = ["--fault=stall:60@100", *PART]
    with simulated("dme", "127.0.0.1:0", tmp_path, *options, path_mm=PART_MM, count=COUNT) as machine:
        source = DmeMachine(machine.address, JOB, silence_s=30.0)
        points = 0
        for arrival in source.arrivals():
            if isinstance(arrival, PointBatch):
                points += len(arrival)
                source.stop()
        tally = machine.tally()
    assert 0 < points < COUNT
    assert tally["aborts"] == 1


def test_a_client_that_is_killed_leaves_a_session_that_the_next_run_ends(tmp_path: Path) -> None:
    def leave_a_session(address: str) -> None:
        host, _, port = address.rpartition(":")
        with socket.create_connection((host, int(port))) as client:
            client.sendall(b"00001 StartSession()\r\n")
            assert client.recv(100).startswith(b"00001 &")

    code, facts, errors = measured(tmp_path, "dme", DME, before=leave_a_session)
    assert (code, facts["received"]) == (0, COUNT), errors


def test_a_server_that_is_killed_in_mid_scan_ends_the_run_with_what_had_come(tmp_path: Path) -> None:
    book = list[Arrival]()

    def hear(machine: Simulated) -> None:
        for arrival in DmeMachine(machine.address, JOB, silence_s=30.0).arrivals():
            book.append(arrival)
            if sum(len(one) for one in book if isinstance(one, PointBatch)) >= 100:
                machine.process.kill()

    stalled = simulated("dme", "127.0.0.1:0", tmp_path, "--fault=stall:60@100", *PART, path_mm=PART_MM, count=COUNT)
    with stalled as machine, pytest.raises(LinkError, match=r"the link was lost: .*; the scan is not complete"):
        hear(machine)
    assert 100 <= len(account(book).points_mm) < COUNT
    assert not any(isinstance(arrival, ScanClosed) for arrival in book)


def test_a_run_that_is_killed_in_mid_scan_leaves_its_points_and_a_machine_that_the_next_run_finds_free(tmp_path: Path) -> None:
    records, (said, say) = tmp_path / "records", Pipe(duplex=False)
    with simulated("dme", "127.0.0.1:0", tmp_path, "--fault=stall:60@100", *PART, path_mm=PART_MM, count=COUNT, noise_mm=0.0) as machine:
        process = split_off(record_machine, records, machine.address, JOB, say)
        say.close()
        with said:
            acknowledged = next(points for points in iter(said.recv, None) if points >= 100)
            process.kill()
            process.join()
        [entry] = list_runs(records, today)
        again = account(DmeMachine(machine.address, JOB, silence_s=30.0).arrivals())
    assert (entry["state"], entry["received"]) == ("interrupted", acknowledged)
    with open_to_read(records, today) as store:
        assert not check_chain(store, None)["altered"]
        kept = [tuple(point) for batch in points_of(store, entry["run"]) for point in batch.points_mm.tolist()]
    assert len(again.points_mm) == COUNT
    assert again.points_mm[:acknowledged] == kept


def test_nobody_wants_to_hear_more_and_the_machine_is_told(tmp_path: Path) -> None:
    with simulated("dme", "127.0.0.1:0", tmp_path, "--fault=stall:60@100", *PART, path_mm=PART_MM, count=COUNT) as machine:
        source = DmeMachine(machine.address, JOB, silence_s=30.0)
        arrivals = source.arrivals()
        next(arrival for arrival in arrivals if isinstance(arrival, PointBatch))
        del arrivals
        assert machine.tally()["aborts"] == 1


@pytest.mark.parametrize(
    ("fault", "words"),
    [
        ("emergency-stop@400", "release the emergency stop"),
        ("cut-line@400", "the link was lost"),
        ("die@400", "the link was lost"),
        ("tool-change@400", "the tool was changed to RefTool by hand"),
        ("no-surface@400", "no surface was found"),
        ("not-homed", "device.home: true"),
    ],
)
def test_what_ends_a_scan_is_told_with_exit_status_4_and_proves_nothing(fault: str, words: str, tmp_path: Path) -> None:
    code, facts, errors = measured(tmp_path, "dme", DME, f"--fault={fault}")
    assert code == 4, errors
    assert words in errors
    assert facts["verdict"] == "uncertain"
    assert facts["received"] in ([0] if fault == "not-homed" else range(400, COUNT))


def scanned(folder: Path, *options: str, job: DmeJob = JOB, silence_s: float = 30.0) -> tuple[Account, str]:
    """What the driver makes of one scan, and the words of the error that ended it."""
    arrivals, words = list[Arrival](), ""
    with simulated("dme", "127.0.0.1:0", folder, *PART, *options, path_mm=PART_MM, count=COUNT, noise_mm=0.0) as machine:
        try:
            arrivals.extend(DmeMachine(machine.address, job, silence_s).arrivals())
        except DeviceError as error:
            words = str(error)
    return account(arrivals), words


@pytest.mark.parametrize(
    ("faults", "words"),
    [
        (["no-surface@400", "bare-cause"], "no surface was found"),
        (["silence:60@400"], "said nothing that leads on"),
        (["no-complete"], "said nothing that leads on"),
    ],
)
def test_what_ends_a_scan_is_told(faults: list[str], words: str, tmp_path: Path) -> None:
    book, told = scanned(tmp_path, *(f"--fault={fault}" for fault in faults), silence_s=30.0 if "bare-cause" in faults else 0.3)
    assert words in told
    assert not any(isinstance(arrival, ScanClosed) for arrival in book.others)


def test_a_tool_that_the_machine_does_not_know_is_told(tmp_path: Path) -> None:
    _, told = scanned(tmp_path, job=replace(JOB, tool="Probe9"))
    assert "the machine knows no such tool" in told


def test_a_tip_of_another_radius_is_refused(tmp_path: Path) -> None:
    code, _, errors = measured(tmp_path, "dme", DME, radius_mm=1.0)
    assert code == 4
    assert "a radius of 1.5 mm, by the plan 1 mm" in errors


@pytest.fixture(scope="module")
def undisturbed_mm(tmp_path_factory: pytest.TempPathFactory) -> list[tuple[float, ...]]:
    """The points of the scan where nothing goes wrong."""
    return scanned(tmp_path_factory.mktemp("undisturbed"))[0].points_mm


@pytest.mark.parametrize("fault", ["torn-line:5@100-200", "jog-key@300", "split-points:0.2"])
def test_what_harms_nothing_changes_nothing(fault: str, undisturbed_mm: list[tuple[float, ...]], tmp_path: Path) -> None:
    book, told = scanned(tmp_path, f"--fault={fault}")
    assert not told
    assert (book.points_mm, book.total("Damaged")) == (undisturbed_mm, 0)


@pytest.mark.parametrize("fault", ["wrong-tag:0.1", "lone-lf:0.1", "early-data", "invalid:0.02"])
def test_what_cannot_be_used_is_counted(fault: str, undisturbed_mm: list[tuple[float, ...]], tmp_path: Path) -> None:
    book, told = scanned(tmp_path, f"--fault={fault}")
    assert not told
    assert set(book.points_mm) < set(undisturbed_mm)
    assert book.total("Damaged") + book.total("Rejected") > 0


def test_a_point_of_bad_quality_is_rejected_and_nothing_is_proven(tmp_path: Path) -> None:
    code, facts, errors = measured(tmp_path, "dme", DME, "--fault=invalid:0.02")
    assert (code, facts["verdict"], facts["out_of_tolerance"]) == (3, "uncertain", 0), errors
    assert facts["rejected"] > 0
    assert facts["received"] == facts["judged"] + facts["rejected"] == COUNT


def test_a_machine_that_is_not_homed_is_sent_home_where_the_plan_allows_it(tmp_path: Path) -> None:
    code, facts, errors = measured(tmp_path, "dme", DME.replace("scan:", "home: true, scan:"), "--fault=not-homed")
    assert (code, facts["received"]) == (0, COUNT), errors


def test_a_test_of_the_device_asks_the_machine_and_moves_nothing(tmp_path: Path) -> None:
    np.savetxt(tmp_path / "nominal.csv", PART_MM[::10], delimiter=",")
    with simulated("dme", "127.0.0.1:0", tmp_path, *PART, path_mm=PART_MM) as machine:
        device = DME.format(address=machine.address)
        (tmp_path / "plan.yaml").write_text(PLAN.format(device=device, radius=RADIUS_MM), encoding="utf-8")
        plan = load_plan(tmp_path / "plan.yaml")
        told = listen_to_device(Job("device test", lambda: None), lambda: connect(plan), time.monotonic)
        assert machine.tally()["points"] == 0
    assert (told.state, told.message) == ("passed", "I++ DME 1.4, CartCMM, tool Probe1, MachineCsy: it answers; nothing was moved")


def test_a_part_that_lies_askew_is_found_where_the_datum_puts_it(tmp_path: Path) -> None:
    """The datum brings the section onto the nominal; the course has to go the other way."""
    turned, moved_mm = np.radians(30.0), np.array([50.0, -20.0])
    back = np.array([[np.cos(turned), np.sin(turned)], [-np.sin(turned), np.cos(turned)]])
    x, y = (-back @ moved_mm).tolist()
    datum = f"registration: {{datum: {{rotation_deg: -30, translation_mm: [{x:.9f}, {y:.9f}]}}}}\n"
    pose = ("--rotation-deg", "30", "--translation-mm", "50", "-20", "0")
    code, facts, errors = measured(tmp_path, "dme", DME, *pose, more=datum)
    assert (code, facts["verdict"], facts["received"]) == (0, "conform", COUNT), errors
    assert measured(tmp_path, "dme", DME, *pose)[0] == 4  # without the datum the probe finds no surface, or loses it


def test_a_course_that_no_single_line_holds_is_scanned_piece_by_piece(tmp_path: Path) -> None:
    code, facts, errors = measured(tmp_path, "dme", DME.replace("curve,", "curve, chord_error_mm: 2.0e-6,"))
    assert (code, facts["verdict"]) == (0, "conform"), errors
    assert COUNT < facts["received"] < COUNT + 20  # neighbours share their ends


@pytest.mark.parametrize("order", [1, -1])
def test_an_open_profile_is_scanned_from_end_to_end(order: int, tmp_path: Path) -> None:
    half_mm = PART_MM[:501]  # from the right end over the top to the left one, the material on its left
    np.savetxt(tmp_path / "nominal.csv", half_mm[:: 10 * order], delimiter=",")
    with simulated("dme", "127.0.0.1:0", tmp_path, *PART, "--open", path_mm=half_mm, noise_mm=0.001) as machine:
        side = "left" if order == 1 else "right"
        plan = PLAN.format(device=DME.format(address=machine.address), radius=RADIUS_MM)
        (tmp_path / "plan.yaml").write_text(plan.replace("closed: true", f"closed: false, material: {side}"), encoding="utf-8")
        done = cmmlink("run", tmp_path / "plan.yaml", "--json", "--records", tmp_path / "records")
    assert (done.code, done.json()["verdict"]) == (0, "conform"), done.err
    assert done.json()["coverage"] > 0.99


AROUND = "start_mm: [20, 0, 0], start_direction: [1, 0, 0], towards_mm: [19.9, 2, 0], end_mm: [20, 0, 0], end_direction: [1, 0, 0]"


@pytest.mark.parametrize(
    ("scan", "points"),
    [
        ("type: circle, centre_mm: [0, 0, 0], start_mm: [20, 0, 0], axis: [0, 0, 1], step_deg: 2", 181),
        (f"type: unknown, dialect: 1.4.0, step_mm: 0.5, {AROUND}", None),
    ],
)
def test_a_round_part_is_scanned_by_its_axis_or_as_a_contour_that_nobody_knows(scan: str, points: int | None, tmp_path: Path) -> None:
    circle_mm = 20.0 * np.column_stack([np.cos(TURN), np.sin(TURN)])
    np.savetxt(tmp_path / "nominal.csv", circle_mm[::5], delimiter=",")
    with simulated("dme", "127.0.0.1:0", tmp_path, *PART, path_mm=circle_mm, noise_mm=0.001) as machine:
        device = f"{{type: dme, address: '{machine.address}', scan: {{{scan}}}}}"
        plan = PLAN.format(device=device, radius=RADIUS_MM) + "registration: {fit: none}\n"
        (tmp_path / "plan.yaml").write_text(plan, encoding="utf-8")
        done = cmmlink("run", tmp_path / "plan.yaml", "--json", "--records", tmp_path / "records")
    facts = done.json()
    assert (done.code, facts["verdict"]) == (0, "conform"), done.err
    assert facts["received"] == (points or facts["received"]) > 180
