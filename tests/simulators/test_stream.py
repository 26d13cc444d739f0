"""The engine that streams: a device of one byte a point shows what is sent, and when faults strike."""

import json
import queue
import socket
import threading
from collections.abc import Sequence

import numpy as np
import pytest

from simulators.faults import Fault
from simulators.motion import Motion
from simulators.settings import SimulatorSettings
from simulators.stream import Device, Sample, stream

PATH_MM = np.array([[0.0, 0.0], [100.0, 0.0], [100.0, 10.0], [0.0, 10.0]])


class OneByte(Device):
    """Sends the number of each point, between `<` and `>`, when it is told to by a `G`."""

    def __init__(self, together: int = 1) -> None:
        self.samples_per_frame = together
        self._heard = False

    def opening(self, count: int) -> bytes:
        return b"<"

    def frame(self, samples: Sequence[Sample]) -> bytes:
        return bytes([(sample.index | 0x80) if sample.invalid else sample.index for sample in samples])

    def closing(self, count: int) -> bytes:
        return b">"

    def answer(self, command: bytes) -> bytes:
        self._heard |= b"G" in command
        return b"!"

    def told_to_begin(self) -> bool:
        return self._heard


def heard(device: Device, *faults: str, count: int = 30, paced: bool = False) -> tuple[bytes, dict[str, int]]:
    """Return what a client hears, and the tally the device announces."""
    said: queue.Queue[str] = queue.Queue()
    settings = SimulatorSettings(
        "127.0.0.1:0", PATH_MM, Motion(1000.0, 2000.0, count=count), tuple(Fault.parse(text) for text in faults), paced
    )
    serving = threading.Thread(target=stream, args=(settings, device, said.put))
    serving.start()
    host, _, port = said.get(timeout=10.0).rpartition(":")
    data = b""
    with socket.create_connection((host, int(port)), timeout=10.0) as client:
        client.sendall(b"G")
        while not data.endswith(b">"):
            data += client.recv(1000)
    tally = {name: count for name, count in json.loads(said.get(timeout=10.0)).items() if count}
    serving.join(timeout=20.0)
    assert not serving.is_alive()
    return data, tally


@pytest.mark.parametrize("paced", [True, False])
@pytest.mark.parametrize("together", [1, 7])
def test_every_point_is_sent_once_between_opening_and_closing(together: int, paced: bool) -> None:
    data, tally = heard(OneByte(together), paced=paced)
    assert data == b"!<" + bytes(range(30)) + b">"
    assert tally == {"points": 30}


def test_faults_strike_at_their_point_and_are_counted() -> None:
    data, tally = heard(OneByte(), "gap:5@10", "invalid:1@20")
    assert data == b"!<" + bytes([*range(10), *range(15, 20), *(number | 0x80 for number in range(20, 30))]) + b">"
    assert tally == {"points": 30, "gap": 5, "invalid": 10}


def test_a_burst_damages_what_is_sent_from_its_point_on() -> None:
    data, tally = heard(OneByte(), "burst:4@12")
    assert data[:14] == b"!<" + bytes(range(12))
    assert data[18:] == bytes(range(16, 30)) + b">"
    assert tally["burst"] == 1


def test_a_fault_of_registers_is_refused() -> None:
    settings = SimulatorSettings("127.0.0.1:0", PATH_MM, Motion(1000.0, 2000.0), (Fault.parse("word-swap"),))
    with pytest.raises(ValueError, match="fault 'word-swap' strikes Modbus devices only"):
        stream(settings, OneByte(), print)
