"""Registers read for their own sake, against a device of the test's that lacks some of them and bears short blocks only."""

import struct
from collections.abc import Callable

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.codecs.register_survey import RegisterSurvey, Table, registers_of, stored_number
from drivers.errors import DeviceRefused, ProtocolError
from drivers.source import ScanClosed

HELD = {at: (7919 * at) % 65536 for at in range(65536)}


def device(lacks: set[int], most: int = 125, exception: int = 2) -> Callable[[bytes], bytes]:
    """What answers requests as the Modbus specification has it (6.3, 6.4, 7)."""

    def answer(request: bytes) -> bytes:
        function, at, count = struct.unpack(">BHH", request)
        if count > most or lacks & set(range(at, at + count)):
            return bytes([function | 0x80, exception])
        return bytes([function, 2 * count]) + b"".join(HELD[n].to_bytes(2, "big") for n in range(at, at + count))

    return answer


def read(survey: RegisterSurvey, answer: Callable[[bytes], bytes], most: int = 1000) -> int:
    """Ask until the survey has closed; returns how often."""
    for asked in range(1, most + 1):
        request = survey.request()
        if isinstance(survey.feed(request + answer(request))[-1], ScanClosed):
            return asked
    raise AssertionError("the survey comes to no end")


@given(st.sets(st.integers(90, 160), max_size=40), st.integers(1, 125), st.integers(0, 120), st.integers(1, 60), st.sampled_from([2, 3, 4]))
def test_what_is_there_is_read_and_what_is_not_is_known(lacks: set[int], most: int, first: int, count: int, exception: int) -> None:
    asked_for = set(range(first, first + count))
    survey = RegisterSurvey("holding", first, count, passes=2)
    if asked_for <= lacks:
        with pytest.raises(DeviceRefused, match=rf"none of the holding registers {first} to {first + count - 1}: it answers exception"):
            read(survey, device(lacks, most, exception))
        return
    asked = read(survey, device(lacks, most, exception))
    assert survey.words == {at: HELD[at] for at in asked_for - lacks}
    assert survey.missing == asked_for & lacks
    assert asked <= 3 * count + 1  # halves, wholes, and the second time without those that are refused
    assert survey.done == 2


def test_one_request_suffices_where_all_is_there() -> None:
    assert read(RegisterSurvey("input", 0, 125, passes=1), device(set())) == 1
    assert RegisterSurvey("input", 5, 2).request() == bytes.fromhex("04 0005 0002")
    assert RegisterSurvey("holding", 5, 2).request() == bytes.fromhex("03 0005 0002")


@pytest.mark.parametrize(("table", "other"), [("holding", "input"), ("input", "holding")])
def test_a_table_that_the_device_does_not_have_is_the_cause_named_first(table: Table, other: str) -> None:
    with pytest.raises(DeviceRefused, match=rf"^plc: has no {table} registers: .* try the table {other}$"):
        read(RegisterSurvey(table, 0, 4, device="plc"), device({0}, exception=1))
    with pytest.raises(DeviceRefused, match="memory of the device is damaged"):
        read(RegisterSurvey(table, 0, 4), device({0}, exception=8))


def test_an_answer_to_something_else_is_no_value() -> None:
    with pytest.raises(ProtocolError, match="answers 1 registers where 2 were asked for"):
        read(RegisterSurvey("holding", 0, 2), lambda _: bytes.fromhex("03 02 0001"))
    with pytest.raises(ProtocolError, match="another function"):
        read(RegisterSurvey("holding", 0, 2), lambda _: bytes.fromhex("04 04 0001 0002"))


@pytest.mark.parametrize(("first", "count"), [(0, 0), (0, 126), (65536, 1), (65535, 2), (-1, 2)])
def test_a_range_that_is_none_is_refused(first: int, count: int) -> None:
    with pytest.raises(ValueError, match="register"):
        RegisterSurvey("holding", first, count)


def test_reading_begins_anew_with_another_link_and_in_any_pieces() -> None:
    survey, answer = RegisterSurvey("holding", 0, 4, passes=1), device(set(), most=2)
    for _ in range(2):  # the whole is refused, the first half read
        request = survey.request()
        for byte in request + answer(request):
            survey.feed(bytes([byte]))
    survey.feed(survey.request())  # its answer is lost with the link
    survey.break_off()
    assert survey.request() == bytes.fromhex("03 0000 0002")
    assert survey.idle
    read(survey, answer)
    assert survey.words == {at: HELD[at] for at in range(4)}


@pytest.mark.parametrize(("kind", "spelled"), [
    ("uint16", ">H"), ("int16", ">h"), ("uint32", ">I"), ("int32", ">i"), ("uint64", ">Q"), ("int64", ">q"), ("float32", ">f"),
    ("float64", ">d"),
])  # fmt: skip
def test_a_number_is_found_in_either_order_of_its_words(kind: str, spelled: str) -> None:
    number = 0.5 if kind.startswith("float") else struct.unpack(spelled, bytes(range(0x81, 0x81 + struct.calcsize(spelled))))[0]
    parts = struct.pack(spelled, number)
    words = [int.from_bytes(parts[k : k + 2], "big") for k in range(0, len(parts), 2)]
    assert registers_of(kind) == len(words)
    assert stored_number(dict(enumerate(words, 40)), 40, kind, "high-first") == number
    assert stored_number(dict(enumerate(words[::-1], 40)), 40, kind, "low-first") == number
    assert stored_number(dict(enumerate(words[:-1], 40)), 40, kind, "high-first") is None
