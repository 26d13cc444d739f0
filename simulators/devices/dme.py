"""A simulated coordinate measuring machine behind an I++ DME server, with all that goes wrong with one.

Every client measures the same part. When a client has gone, the server says as JSON how many points it was sent and which faults struck.
"""

import json
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from simulators.dme_controller import Controller, Line
from simulators.dme_part import PathPart
from simulators.faults import CATALOGUE, Injector
from simulators.line import Line as Wire
from simulators.line import open_line
from simulators.settings import Announce, SimulatorSettings, refuse_answer

_POLL_S = 0.005
_LINE_S = 0.02  # of a scan that one line holds
_MOST_A_LINE = 50
_BAD, _GOOD = 100.0, 0.0
_UNKNOWN_TAG = "98765"
_KNOWN_ELSEWHERE = ("flip", "lost-bytes", "inserted-bytes", "burst", "repeated-frames", "reordered-frames", "restart")


class Server:
    """Lets one client after the other use the machine."""

    def __init__(
        self, wire: Wire, controller: Controller, injector: Injector, paced: bool, clock: Callable[[], float] = time.monotonic
    ) -> None:
        self._wire, self._controller, self._injector = wire, controller, injector
        self._paced, self._clock = paced, clock
        self._pending = b""
        self._due_s = clock()
        self._rng = np.random.default_rng(0)
        self._held_back = ""  # of a point that goes on in the next line
        self._early: list[Line] = []  # an acknowledgement that data of its scan overtake
        self.points = self.aborts = 0
        controller.machine.next_quality = self._quality

    def serve_client(self) -> None:
        """Wait for a client, and serve it until it is gone."""
        while not self._wire.is_connected():
            self._wire.receive(0.02)
        self._pending, self._held_back, self._early = b"", "", []
        self._due_s = self._clock()
        while self._wire.is_connected():
            busy = self._controller.is_busy
            left_s = max(0.0, self._due_s - self._clock()) if busy else 0.02
            self._listen(min(left_s, 0.02))
            if self._controller.is_busy and self._clock() >= self._due_s:
                self._work()
        self._controller.leave()

    def _quality(self) -> float:
        return _BAD if self._injector.marks_invalid(self.points) else _GOOD

    def _listen(self, wait_s: float) -> None:
        """Take what the client says."""
        *lines, self._pending = (self._pending + self._wire.receive(wait_s)).split(b"\r\n")
        for line in lines:
            if not self._controller.is_busy:
                self._due_s = self._clock()
            self.aborts += b"AbortE(" in line
            self._send(self._controller.hear(line.decode("latin-1")))

    def _work(self) -> None:
        """Do the next piece of what the client asked for; what it takes passes before the next one."""
        seconds, lines = self._controller.work()
        if self._paced:
            self._due_s += seconds
        self._send(lines)

    def _send(self, lines: Sequence[Line]) -> None:
        for line in lines:
            self._pass_on(line)
            if line.points and line.of.startswith(("Scan", "PtMeas")):
                self.points += line.points
                self._trouble(line)

    def _pass_on(self, line: Line) -> None:
        """Send one line, as what is wrong with the server leaves it."""
        injector, at = self._injector, self.points
        is_scan = line.of.startswith("Scan") and not line.of.endswith(("Hint", "Density"))
        if is_scan and line.sign == "&" and injector.strike("early-data", at):
            self._early = [line]
            return
        if line.points and injector.pass_on(at, b"x") == b"":
            return  # lost on the way, with nothing that shows it
        if is_scan and line.points:
            line = self._with_split_points(line)
        if is_scan and line.sign == "%":
            if self._held_back:
                self._write(replace(line, sign="#", data=self._held_back).text)
                self._held_back = ""
            if injector.strike("no-complete", at):
                return
        if line.points and injector.strikes("wrong-tag", at):
            line = replace(line, tag=_UNKNOWN_TAG)
        self._write(line.text, "\n" if line.points and injector.strikes("lone-lf", at) else "\r\n")
        early, self._early = self._early, []
        for held in early:
            self._write(held.text)

    def _with_split_points(self, line: Line) -> Line:
        """Cut a line within its last point, or put before it what was cut off the last line."""
        if self._held_back:
            line, self._held_back = replace(line, data=f"{self._held_back},{line.data}"), ""
        elif line.points and self._injector.strikes("split-points", self.points):
            data, _, self._held_back = line.data.rpartition(",")
            line = replace(line, data=data)
        return line

    def _trouble(self, line: Line) -> None:
        """Let happen what happens once, at this point of the scan."""
        injector, at = self._injector, self.points
        status = injector.strike("die", at)
        if status is not None:
            sys.stdout.flush()
            raise SystemExit(int(status))
        for name in ("stall", "silence"):
            pause_s = injector.strike(name, at)
            if pause_s is not None:
                self._rest(pause_s, hears=name == "stall")
        away_s = injector.strike("unplug", at)
        if away_s is not None:
            self._wire.unplug()
            self._rest(away_s, hears=False)
            self._wire.plug()
        if injector.strike("cut-line", at):
            self._write(line.text[: len(line.text) // 2], "")
            self._wire.unplug()
            self._wire.plug()
        if injector.strike("jog-key", at):
            self._write('E0000 # KeyPress("F1")')
        if injector.strike("tool-change", at):
            self._controller.machine.tool = self._controller.machine.tools["RefTool"]
            self._write('E0000 # ChangeTool("RefTool")')
        if injector.strike("emergency-stop", at):
            self._send(self._controller.break_down(500, "HealthCheck"))
        if injector.strike("no-surface", at) and self._controller.is_busy:
            self._send(self._controller.fail(1006))

    def _rest(self, seconds: float, *, hears: bool) -> None:
        """Stand still, and hear the client meanwhile or not, until the scan is given up or the client goes."""
        end_s = self._clock() + seconds
        while self._clock() < end_s and self._wire.is_connected() and self._controller.is_busy:
            wait_s = min(0.02, max(0.0, end_s - self._clock()))
            if hears:
                self._listen(wait_s)
            else:
                self._pending += self._wire.receive(wait_s)
        self._due_s = self._clock()

    def _write(self, text: str, ending: str = "\r\n") -> None:
        """Send a line, in the pieces in which the network carries it."""
        data = (text + ending).encode("ascii")
        largest = int(self._injector.lasting_value("torn-line", self.points))
        while largest and len(data) > largest:
            size = int(self._rng.integers(1, largest + 1))
            self._wire.send(data[:size])
            data = data[size:]
        self._wire.send(data)


def serve(settings: SimulatorSettings, announce: Announce) -> None:
    """Serve the machine until it is ended."""
    refuse_answer(settings)
    for fault in settings.faults:
        if "dme" not in (CATALOGUE[fault.name].only or ("dme",)) or fault.name in _KNOWN_ELSEWHERE:
            raise ValueError(f"fault {fault.name!r} does not strike measuring machines")
    injector = Injector(settings.faults, settings.motion.seed)
    rate_hz = settings.motion.rate_hz
    a_line = int(np.clip(round(rate_hz * _LINE_S), 1, _MOST_A_LINE))
    is_homed = not injector.expects("not-homed")
    point_s = 1.0 / rate_hz if settings.paced else 0.0
    controller = Controller(
        PathPart(settings.path_mm, settings.motion), homed=is_homed, tool="Probe1", points_a_line=a_line, point_s=point_s
    )
    controller.bare_causes = injector.expects("bare-cause")
    wire = open_line(settings.address)
    server = Server(wire, controller, injector, settings.paced)
    try:
        announce(wire.address)
        while True:
            server.points = server.aborts = 0
            server.serve_client()
            announce(json.dumps({"points": server.points, "aborts": server.aborts, **injector.tally}))
    finally:
        wire.close()


DEVICES = {"dme": serve}
