"""The engine of simulated devices that stream: it paces one scan, sends it over a line and lets the faults happen.

A device says only what its bytes are (`Device`). Its address is announced first; then the engine waits for a client and
streams one scan; at the end it announces, as JSON, how many points the device took and which faults struck how often.
"""

import copy
import json
import math
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from simulators.faults import Injector, Only, refuse_others
from simulators.line import Line, open_line
from simulators.motion import Walk, walk
from simulators.settings import Announce, SimulatorSettings, refuse_answer

HEARTBEAT_S = 0.5
IMPATIENCE_S = 2.0
FAREWELL_S = 10.0  # how long the device waits for the client with the end of the scan
TICK_S = 0.001
BURST_POINTS = 64  # largest number of points sent at once when the scan is not paced


@dataclass(frozen=True, slots=True)
class Sample:
    """One point as the device took it; `invalid`: the device itself distrusts it."""

    index: int
    time_s: float
    point_mm: tuple[float, float, float]
    invalid: bool = False


class Device:
    """A device as its line sees it; this one only streams, knows no signs of life and no beginning or end."""

    samples_per_frame = 1
    kind: Only = ""  # of the faults that can strike no other device
    impatience_s = IMPATIENCE_S  # a client that says nothing for so long gets the scan all the same

    def opening(self, count: int) -> bytes:
        """Return what precedes the first point."""
        return b""

    def frame(self, samples: Sequence[Sample]) -> bytes:
        """Return the frame of up to `samples_per_frame` consecutive points."""
        raise NotImplementedError

    def heartbeat(self, index: int, time_s: float) -> bytes:
        """Return the sign of life before point number `index`."""
        return b""

    def closing(self, count: int) -> bytes:
        """Return what follows the last point."""
        return b""

    def answer(self, command: bytes) -> bytes:
        """Return the reply to bytes from the host."""
        return b""

    def told_to_begin(self) -> bool:
        """Tell whether the host has started the scan."""
        return True

    def frames_asked_for(self) -> int | None:
        """Return how many frames the host waits for; None: the device sends them unasked."""
        return None


def stream(
    settings: SimulatorSettings,
    device: Device,
    announce: Announce,
    move: Callable[..., Walk] = walk,
    open_line: Callable[[str], Line] = open_line,
) -> None:
    """Serve one scan of any streaming device; `move` moves the probe along the path, `open_line` opens its address."""
    refuse_others(settings.faults, device.kind)
    if device.kind != "lines":
        refuse_answer(settings)
    scan = move(settings.path_mm, settings.motion)
    injector = Injector(settings.faults, settings.motion.seed)
    line = open_line(settings.address)
    try:
        announce(line.address)
        streamed = StreamedScan(line, device, scan, injector, settings.paced)
        streamed.run()
        announce(json.dumps({"points": len(scan.time_s), **injector.tally}))
        streamed.take_leave()
    finally:
        line.close()


class StreamedScan:
    """One scan being streamed."""

    def __init__(
        self, line: Line, device: Device, scan: Walk, injector: Injector, paced: bool, clock: Callable[[], float] = time.monotonic
    ) -> None:
        self._clock = clock
        self._line, self._device, self._scan, self._injector, self._paced = line, device, scan, injector, paced
        self._unplugged = False
        self._fresh = copy.deepcopy(device)

    def run(self) -> None:
        """Stream the scan from its opening to its closing."""
        count = len(self._scan.time_s)
        start_s, index = self._begin(), 0
        while index < count:
            restart_s = self._injector.strike("restart", index)
            if restart_s is not None:
                start_s, index = self._begin_anew(restart_s), 0
            start_s += self._trouble(index)
            due = self._due(self._clock() - start_s, index)
            step = self._device.samples_per_frame
            self._send(b"".join(self._frame(first, min(first + step, due)) for first in range(index, due, step)))
            index = due
            if self._unplugged:
                self._line.plug()
                self._unplugged = False
            self._listen(TICK_S if self._paced else 0.0)
        self._send(self._injector.release())
        self._wait_until(self._line.is_connected)
        self._send(self._device.closing(count))

    def _begin(self) -> float:
        """Open the scan when the client is there; return the time of its beginning."""
        self._wait_for_client()
        self._send(self._device.opening(len(self._scan.time_s)))
        return self._clock()

    def _begin_anew(self, away_s: float) -> float:
        """Go, forget everything, and come back."""
        self._line.unplug()
        self._device = copy.deepcopy(self._fresh)
        self._pause(away_s, 0, alive=False)
        self._line.plug()
        return self._begin()

    def take_leave(self) -> None:
        """Keep the line up until the client has gone, so that the last bytes are not lost with it."""
        if self._line.is_read_live:
            self._wait_until(lambda: not self._line.is_connected())

    def _wait_until(self, met: Callable[[], bool]) -> None:
        end_s = self._clock() + FAREWELL_S
        while not met() and self._clock() < end_s:
            self._listen(0.02)

    def _due(self, elapsed_s: float, index: int) -> int:
        """Return the number of points to be sent by now: whole frames, up to the next point at which a fault is to strike."""
        count, step = len(self._scan.time_s), self._device.samples_per_frame
        taken = int(np.searchsorted(self._scan.time_s, elapsed_s, side="right")) if self._paced else index + BURST_POINTS
        end = self._injector.next_stop(index, count)
        asked = self._device.frames_asked_for()
        if asked is not None:
            return min(taken, end, index + step * asked)
        return end if taken >= end else index + max(0, taken - index) // step * step

    def _frame(self, first: int, stop: int) -> bytes:
        times, points = self._scan.time_s, self._scan.points_mm
        samples = [Sample(i, float(times[i]), tuple(points[i].tolist()), self._injector.marks_invalid(i)) for i in range(first, stop)]
        return self._injector.pass_on(first, self._device.frame(samples))

    def _send(self, data: bytes) -> None:
        if data:
            self._line.is_connected()
            self._line.send(self._injector.damage(data))

    def _trouble(self, index: int) -> float:
        """Let the faults of this point happen; return for how long the scan stood still."""
        began_s = self._clock()
        status = self._injector.strike("die", index)
        if status is not None:
            sys.stdout.flush()
            raise SystemExit(int(status))
        stall_s = self._injector.strike("stall", index)
        if stall_s is not None:
            self._pause(stall_s, index, alive=True)
        silence_s = self._injector.strike("silence", index)
        if silence_s is not None:
            self._pause(silence_s, index, alive=False)
        away_s = self._injector.strike("unplug", index)
        if away_s is not None:
            self._line.unplug()
            self._unplugged = True
            self._pause(away_s, index, alive=False)
            return 0.0  # the device goes on measuring; nobody hears it
        return self._clock() - began_s

    def _pause(self, seconds: float, index: int, *, alive: bool) -> None:
        end_s = self._clock() + seconds
        next_beat_s = self._clock()
        while (now_s := self._clock()) < end_s:
            if alive and now_s >= next_beat_s:
                self._send(self._device.heartbeat(index, float(self._scan.time_s[index])))
                next_beat_s += HEARTBEAT_S
            self._listen(min(0.02, max(0.0, end_s - now_s)))

    def _listen(self, wait_s: float) -> None:
        command = self._line.receive(wait_s)
        if command:
            self._line.send(self._device.answer(command))

    def _wait_for_client(self) -> None:
        begin_s = math.inf
        while not self._device.told_to_begin() and self._clock() < begin_s:
            if not self._line.is_connected():
                begin_s = math.inf
            elif begin_s == math.inf:
                begin_s = self._clock() + self._device.impatience_s
            self._listen(0.02)
