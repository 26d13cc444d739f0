"""Against the examples of the Modbus Application Protocol V1.1b3, sections 6.3, 6.4, 6.18 and 7."""

import pytest

from drivers.codecs.register_pdus import Exchange, fifo_request, first_exchange, read_request

HOLDING = bytes.fromhex("03 006B 000303 06 022B 0000 0064")
FIFO = bytes.fromhex("18 04DE18 0006 0002 01B8 1284")


def test_requests_are_as_in_the_protocol() -> None:
    assert read_request(3, 0x6B, 3) == HOLDING[:5]
    assert read_request(4, 0x08, 1) == bytes.fromhex("04 0008 0001")
    assert fifo_request(0x04DE) == FIFO[:3]


@pytest.mark.parametrize(
    ("data", "expected"),
    [
        (HOLDING, Exchange(3, 0x6B, 3, 0, bytes.fromhex("022B 0000 0064"), 13)),
        (FIFO, Exchange(24, 0x04DE, 0, 0, bytes.fromhex("01B8 1284"), 12)),
        (bytes.fromhex("04 0008 000184 02"), Exchange(4, 8, 1, 2, b"", 7)),
        (bytes.fromhex("18 04DE98 01"), Exchange(24, 0x04DE, 0, 1, b"", 5)),
        (bytes.fromhex("18 04DE18 0002 0000"), Exchange(24, 0x04DE, 0, 0, b"", 8)),
    ],
)
def test_an_exchange_is_read_once_it_is_whole(data: bytes, expected: Exchange) -> None:
    assert [first_exchange(data[:size]) for size in range(len(data))] == [None] * len(data)
    assert first_exchange(data) == expected
    assert first_exchange(data + HOLDING) == expected
