"""Protocol data units of Modbus: what a request is made of, and requests with their answers in a stream of bytes."""

from dataclasses import dataclass

READ_FIFO = 24
EXCEPTIONS = {
    1: "function not supported",
    2: "no such registers",
    3: "value not allowed",
    4: "device failure",
    5: "accepted, but not ready yet",
    6: "device busy",
    8: "memory of the device is damaged",
    10: "gateway has no path to the device",
    11: "device behind the gateway does not respond",
}
PASSING = frozenset({5, 6, 10, 11})  # exceptions that may pass when the same is asked again


@dataclass(frozen=True, slots=True)
class Exchange:
    """A request and its answer.

    count       registers asked for; 0 for function 24, which hands over as many as there are
    exception   the code of a refusal; 0: there is none
    registers   what the answer carries, two bytes a register
    size        bytes of both together
    """

    function: int
    address: int
    count: int
    exception: int
    registers: bytes
    size: int


def read_request(function: int, address: int, count: int) -> bytes:
    """Return the request for `count` registers by function 3 or 4."""
    return bytes([function]) + address.to_bytes(2, "big") + count.to_bytes(2, "big")


def fifo_request(address: int) -> bytes:
    """Return the request for what waits in the queue at `address`, by function 24."""
    return bytes([READ_FIFO]) + address.to_bytes(2, "big")


def size_of_strange_head(data: bytes) -> int:
    """Return the size of the first request in `data` with its answer's first byte where it answers another function, else 0."""
    asked = 3 if data[:1] == bytes([READ_FIFO]) else 5
    return 0 if len(data) <= asked or data[asked] & 0x7F == data[0] else asked + 1


def first_exchange(data: bytes) -> Exchange | None:
    """Return the first request in `data` with its answer, or None while they are not there as a whole."""
    if not data:
        return None
    function = data[0]
    asked = 3 if function == READ_FIFO else 5  # bytes of the request
    if len(data) < asked + 2:
        return None
    address, count = int.from_bytes(data[1:3], "big"), int.from_bytes(data[3:asked], "big")
    if data[asked] == function | 0x80:
        return Exchange(function, address, count, data[asked + 1], b"", asked + 2)
    if function == READ_FIFO:
        start, length = asked + 5, int.from_bytes(data[asked + 1 : asked + 3], "big") - 2
    else:
        start, length = asked + 2, data[asked + 1]
    if len(data) < start + length:
        return None
    return Exchange(function, address, count, 0, data[start : start + length], start + length)
