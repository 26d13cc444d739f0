"""Machines as sources of points: a measuring machine over I++ DME, and what machine tools and cameras print.

As in `encoded_scans`, nothing opens a link: the simulated machine speaks to the driver's session over a line that is a list of bytes.
"""

from collections.abc import Callable, Sequence
from contextlib import suppress

import numpy as np
from numpy.typing import NDArray

from drivers.codecs import decoder
from drivers.codecs.dme_commands import scans_on_curve
from drivers.codecs.dme_points import PointCheck
from drivers.codecs.dme_session import DmeJob, DmeSession
from drivers.errors import DeviceError
from drivers.source import Decoder
from simulators.devices.dme import Server
from simulators.devices.machine_tool import InspectingControl, OwnLines, Quirks
from simulators.dme_controller import Controller
from simulators.faults import Fault, Injector
from simulators.stream import Device, StreamedScan
from tests.integration.encoded_scans import SOURCES, ScanEndedError, Source, Transcript, Wire, ticks, walk_of

Array = NDArray[np.float64]
IDLE = 400  # times that a client is listened to in vain, until it gives up
MOST_POINTS = 1000
COURSE = np.array([[0.0, 0.0, 0.0, 0.0, 1.0, 0.0], [9.0, 0.0, 0.0, 0.0, 1.0, 0.0]])
_OF_MACHINES = ("torn-line", "split-points", "wrong-tag", "lone-lf", "early-data", "no-complete", "jog-key", "bare-cause")
_GIVEN_UP = ("emergency-stop", "tool-change", "no-surface", "cut-line", "die")
IN_MACHINE = (*_OF_MACHINES, *_GIVEN_UP, "lost-frames", "gap", "invalid", "stall", "silence")
_COMMON = ("flip", "lost-bytes", "inserted-bytes", "burst", "lost-frames", "repeated-frames", "reordered-frames", "gap")
IN_LINES = (*_COMMON, "stall", "silence", "unplug", "restart", "die", "no-contact", "no-end", "emergency-stop")


class ListedPart:
    """A part of which a scan finds just these points (n, 3)."""

    radius_mm = 0.0

    def __init__(self, points_mm: Array) -> None:
        self._points_mm = points_mm

    def touch(self, point_mm: Array, direction: Array, approach_mm: float, search_mm: float) -> Array | None:
        return np.array(point_mm)

    def follow(self, course_mm: Array, step_mm: float, *, closed: bool, lost_mm: float) -> tuple[Array, Array, bool]:
        return np.array(self._points_mm), np.tile([0.0, 1.0, 0.0], (len(self._points_mm), 1)), False


class SessionWire(Wire):
    """A line to a session, which gives up where nothing comes any more, and does not come back when the line was lost."""

    def __init__(self, made: Decoder) -> None:
        super().__init__(made)
        self._idle = 0

    def is_connected(self) -> bool:
        return super().is_connected() and self._idle < IDLE

    def send(self, data: bytes) -> bool:
        self._idle = 0
        return super().send(data)

    def receive(self, wait_s: float) -> bytes:
        self._idle += 1
        return super().receive(wait_s)

    def plug(self) -> None:
        """Nobody comes back."""


def session(_: int = 0) -> DmeSession:
    return DmeSession(DmeJob(PointCheck(0.0, 0.001, 50.0), scans_on_curve(COURSE, closed=False)))


def measured(points_mm: Array, faults: Sequence[Fault], seed: int) -> Transcript:
    """What a measuring machine says of a scan."""
    wire, injector = SessionWire(session()), Injector(faults, seed)
    controller = Controller(ListedPart(points_mm), homed=True, tool="Probe1", points_a_line=3)
    controller.bare_causes = injector.expects("bare-cause")
    with suppress(SystemExit, DeviceError, ScanEndedError):
        Server(wire, controller, injector, paced=False, clock=ticks()).serve_client()
    return wire.transcript


FLAT, UP = np.zeros((MOST_POINTS, 3)), np.tile([0.0, 1.0, 0.0], (MOST_POINTS, 1))  # nominal points and directions, which no law is about


def _inspecting(injector: Injector) -> Device:
    return InspectingControl(FLAT, UP, 0.0, Quirks.asked_for(injector), injector)


def _camera(injector: Injector) -> Device:
    return OwnLines("{number};{x:.5f};{y:.5f}", FLAT, UP, Quirks.asked_for(injector), injector)


def _printed(device: Callable[[Injector], Device], made: Callable[[int], Decoder]) -> Source:
    def encode(points_mm: Array, faults: Sequence[Fault], seed: int) -> Transcript:
        wire, injector = Wire(made(len(points_mm))), Injector(faults, seed)
        with suppress(SystemExit, DeviceError, ScanEndedError):
            StreamedScan(wire, device(injector), walk_of(points_mm), injector, paced=False, clock=ticks()).run()
        return wire.transcript

    return Source(encode, made, faults=IN_LINES)


EVERY_SOURCE: dict[str, Source] = {
    **SOURCES,
    "i++ dme": Source(measured, session, sound=True, faults=IN_MACHINE, comes_back=False),
    "g800": _printed(_inspecting, lambda _: decoder("g800", unit="mm")),
    "camera": _printed(
        _camera,
        lambda _: decoder("pattern", unit="mm", pattern="(?P<seq>[0-9]+);(?P<x>[-.0-9]+);(?P<y>[-.0-9]+)", end="END"),
    ),
}
