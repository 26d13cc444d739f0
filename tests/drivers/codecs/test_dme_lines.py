"""The lines of an I++ DME server: values, numbers and errors, as different servers spell them."""

from itertools import pairwise

import numpy as np
import pytest

from drivers.codecs.dme_lines import LineReader, MachineError, Response, error_in, number_in, numbers_in, values_in
from tests.drivers.codecs.dme_transcript import ABORT, EMERGENCY, GOLDEN


@pytest.mark.parametrize(
    ("data", "cause"),
    [
        ('Error(3, 2500, "GoTo", "Machine limit encountered [Move Out Of Limits]")', "GoTo"),
        ('Error(3,2500,GoTo,"Machine limit encountered [Move Out Of Limits]")', "GoTo"),
        ('Error( 3 , 2500 , "00007 GoTo(X(1), Y(2))" , "Machine limit encountered [Move Out Of Limits]" )', "00007 GoTo(X(1), Y(2))"),
    ],
)
def test_an_error_is_read_with_a_quoted_cause_and_a_bare_one(data: str, cause: str) -> None:
    assert error_in(data) == MachineError(3, 2500, cause, "Machine limit encountered [Move Out Of Limits]")


def test_an_error_says_what_to_do_and_whether_the_machine_gave_up() -> None:
    assert MachineError(2, 1006, "", "Surface not found").words == (
        "error 1006 (repairable), 'Surface not found': no surface was found; is the part where the plan says?"
    )
    assert MachineError(9, 4711, "", "odd").words == "error 4711 (fatal), 'odd'"
    assert [MachineError(severity, 0, "", "").is_breakdown for severity in (0, 1, 2, 3, 9)] == [False, False, True, True, True]


@pytest.mark.parametrize("data", ['Error(3, 2500, "GoTo")', 'Error(33, 2500, "GoTo", "x")', 'Error(3, 25, "GoTo", "x")', "", "Error"])
def test_what_is_no_error_is_none(data: str) -> None:
    assert error_in(data) is None


def test_values_are_read_by_their_names() -> None:
    assert values_in('Tool.Name("Probe1, (long)"), Tool.PtMeasPar.Speed(10)') == {
        "Tool.Name": '"Probe1, (long)"',
        "Tool.PtMeasPar.Speed": "10",
    }
    assert values_in("IJK(0, 0,1),X( 1.5 )") == {"IJK": "0, 0,1", "X": "1.5"}
    for wrong in ("X(1), X(2)", "X(1) Y(2)", "X(1),", "X", "", "X(1", '"X"', "1,2,3"):
        assert values_in(wrong) is None, wrong


@pytest.mark.parametrize(
    ("text", "value"), [(".5", 0.5), ("5.", 5.0), ("+1.2E2", 120.0), ("-0", 0.0), (" 7 ", 7.0), ("1234567890123456", 1234567890123456.0)]
)
def test_numbers_are_those_of_the_specification(text: str, value: float) -> None:
    assert number_in(text) == value
    assert numbers_in(f"{text},{text}") == [value, value]


@pytest.mark.parametrize(
    "text", ["", ".", "-.", "1.2 E2", "1.2E", "1.2E0010", "0.3.3", "12345678901234567", "1e5000", "nan", "inf", "0x1", "1_0"]
)
def test_nothing_else_is_a_number(text: str) -> None:
    assert number_in(text) is None
    assert numbers_in(f"1,{text}") is None


def test_the_lines_of_the_golden_transcript_are_read_at_any_cut() -> None:
    lines = [line for _, answers in (*GOLDEN, *ABORT) for line in answers] + [EMERGENCY]
    data = "".join(f"{line}\r\n" for line in lines).encode("ascii")
    rng = np.random.default_rng(1)
    for cuts in ([], range(1, len(data)), *(sorted(rng.integers(0, len(data), 9).tolist()) for _ in range(30))):
        edges, reader = [0, *cuts, len(data)], LineReader()
        found = [one for first, stop in pairwise(edges) for one in reader.feed(data[first:stop])]
        assert [one for one in found if not isinstance(one, Response)] == []
        read = [one for one in found if isinstance(one, Response)]
        assert [f"{one.tag} {one.sign} {one.data}".strip() for one in read] == lines
    errors = [error_in(one.data) for one in read if one.sign == "!"]
    assert [(error.severity, error.code, error.cause) for error in errors if error] == [
        (3, 2500, "GoTo"),
        (2, 514, "Get"),
        (2, 6, "ScanOnCircle"),
        (3, 500, "HealthCheck"),
    ]
    assert [numbers_in(one.data) for one in read if one.sign == "#" and one.tag == "00005"] == [
        [0.0, 0.0, 1.5, 0.5001, 0.0, 1.5002],
        [1.0002, 0.0, 1.4999],
    ]
    assert [values_in(one.data) for one in read if one.sign == "#" and one.tag == "00006"] == [{"X": "10.0002", "Y": "0", "Z": "1.4998"}]
