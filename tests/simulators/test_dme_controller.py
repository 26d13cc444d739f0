"""The simulated I++ DME server: its golden transcript, its queue, its error state and its daemons."""

from collections.abc import Sequence

import numpy as np
import pytest
from numpy.typing import NDArray

from simulators.devices.dme import Server
from simulators.dme_controller import Controller
from simulators.faults import Injector
from tests.drivers.codecs.dme_transcript import ABORT, EMERGENCY, GOLDEN, SCANNED_MM, TOUCHED_MM

Array = NDArray[np.float64]


class ToldPart:
    """A part whose points are told beforehand, in the order in which they are touched; then there is no surface any more."""

    def __init__(self, *points_mm: tuple[float, float, float], radius_mm: float = 1.5) -> None:
        self.radius_mm = radius_mm
        self._points = [np.array(point) for point in points_mm]

    def touch(self, point_mm: Array, direction: Array, approach_mm: float, search_mm: float) -> Array | None:
        return self._points.pop(0) if self._points else None

    def follow(self, course_mm: Array, step_mm: float, *, closed: bool, lost_mm: float) -> tuple[Array, Array, bool]:
        raise NotImplementedError


def controller(*points_mm: tuple[float, float, float], ready: bool = True) -> Controller:
    made = Controller(ToldPart(*points_mm), homed=ready, tool="Probe1" if ready else "NoTool", points_a_line=2)
    if ready:
        said(made, "90000 StartSession()")
    return made


def said(server: Controller, line: str, pieces: int | None = None) -> list[str]:
    """What the server says to a line until it rests, or for so many pieces of work."""
    lines = [one.text for one in server.hear(line)]
    while server.is_busy and pieces != 0:
        lines += [one.text for one in server.work()[1]]
        pieces = None if pieces is None else pieces - 1
    return lines


def test_the_golden_transcript_byte_for_byte() -> None:
    first = (SCANNED_MM[0],)  # the touch with which a scan begins
    server = controller(*first, *SCANNED_MM, ready=False)
    for command, answers in GOLDEN[:4]:
        assert said(server, command) == list(answers)
    command, answers = GOLDEN[4]
    heard = said(server, command)
    assert tuple(heard[:3]) == answers[:3]
    assert "! Error(2, 1006," in heard[3]  # the part that was told has no more points; the transcript ends its line there
    assert said(server, "00099 ClearAllErrors()") == ["00099 &", "00099 %"]
    server.machine.part = ToldPart(TOUCHED_MM)
    for command, answers in GOLDEN[5:]:
        assert said(server, command) == list(answers)


def test_an_abort_gives_up_everything_in_order() -> None:
    server = controller((11.5, 0.0, 0.0), *400 * [(11.5, 0.0, 0.0)])
    (scan, _), (abort, answers) = ABORT
    assert said(server, scan, pieces=1)[0] == "00010 &"
    assert said(server, "00012 Get(X())", pieces=0) == ["00012 &"]
    heard = said(server, abort)
    waiting = ['00012 ! Error(2, 0006, "Get", "Transaction aborted (Use ClearAllErrors to Continue)")', "00012 %"]
    assert heard == [*answers[:3], *waiting, answers[3]]
    assert "0514" in said(server, "00013 Get(X())")[1]
    said(server, "00014 ClearAllErrors()")
    assert said(server, "00015 Get(X())")[-1] == "00015 %"


def test_an_emergency_stop_comes_without_being_asked() -> None:
    server = controller((11.5, 0.0, 0.0), *400 * [(11.5, 0.0, 0.0)])
    said(server, ABORT[0][0], pieces=1)
    lines = [line.text for line in server.break_down(500, "HealthCheck")]
    assert lines[0] == EMERGENCY
    assert lines[-1] == "00010 %"


def test_a_machine_that_is_not_homed_does_not_move() -> None:
    server = controller(ready=False)
    said(server, "00001 StartSession()")
    for command in ("GoTo(X(1))", "PtMeas(X(1), IJK(0,0,1))", "ScanOnLine(0,0,0,20,0,0,0,0,1,0.5)"):
        assert "! Error(3, 0507," in said(server, f"00002 {command}")[1]
        said(server, "00003 ClearAllErrors()")


def test_a_daemon_reports_until_it_is_stopped() -> None:
    server = controller()
    assert said(server, "E0553 OnMoveReportE(Dis(10), X(), Y())") == ["E0553 &", "E0553 %"]
    moved = said(server, "00002 GoTo(X(100), Y(50))")
    assert sum(line.startswith("E0553 # X(") for line in moved) >= 5
    assert "0515" in said(server, "E0554 OnMoveReportE(Dis(10), X())")[1]
    said(server, "00003 ClearAllErrors()")
    assert said(server, "00004 StopDaemon(E0553)")[-1] == "00004 %"
    assert not any(line.startswith("E0553") for line in said(server, "00005 GoTo(X(0))"))


def test_part_coordinates_are_the_work_of_the_server() -> None:
    server = controller()
    said(server, "00001 SetCsyTransformation(PartCsy, 100, 20, 0, 0, 0, 0)")
    said(server, "00002 SetCoordSystem(PartCsy)")
    said(server, "00003 GoTo(X(1), Y(2), Z(3))")
    np.testing.assert_allclose(server.machine.place_mm, [101.0, 22.0, 3.0])
    assert said(server, "00004 Get(X(), Y(), Z())")[1] == "00004 # X(1), Y(2), Z(3)"


def test_lines_that_are_none_are_told_under_the_tag_of_the_server() -> None:
    server = controller()
    for line in ("A2345 GoTo(X(1))", "00000 GoTo(X(1))", "E0000 AbortE()", "0123456 GoTo()", "\x07"):
        [answer] = said(server, line)
        assert answer.startswith("E0000 ! Error("), line


class CutWire:
    """The line of a client that says its commands in pieces of so many bytes, each when the one before is complete, and then goes."""

    address, is_read_live = "", True

    def __init__(self, commands: Sequence[str], size: int) -> None:
        self.sent = b""
        lines = [f"{command}\r\n".encode("ascii") for command in commands]
        self._commands = [[line[at : at + size] for at in range(0, len(line), size)] for line in lines]
        self._pieces: list[bytes] = []
        self._said = 0

    def is_connected(self) -> bool:
        return self.sent.count(b" %\r\n") < len(self._commands)

    def send(self, data: bytes) -> bool:
        self.sent += data
        return True

    def receive(self, wait_s: float) -> bytes:
        if not self._pieces and self._said == self.sent.count(b" %\r\n"):
            self._pieces, self._said = [*self._commands[self._said]], self._said + 1
        return self._pieces.pop(0) if self._pieces else b""

    def unplug(self) -> None:
        raise NotImplementedError

    plug = close = unplug


@pytest.mark.parametrize("size", [1, 2, 7, 1000])
def test_lines_of_the_client_may_be_cut_anywhere(size: int) -> None:
    steps = (*GOLDEN[:4], *GOLDEN[6:])
    wire = CutWire([command for command, _ in steps], size)
    Server(wire, Controller(ToldPart()), Injector((), 0), paced=False).serve_client()
    assert wire.sent.decode("ascii") == "".join(f"{line}\r\n" for _, answers in steps for line in answers)
