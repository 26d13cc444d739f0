"""Lines by a pattern of the user's own, as DPRNT prints them."""

import pytest

from drivers.codecs import decoder
from drivers.codecs.pattern_frames import LONGEST_PATTERN, PatternDecoder
from drivers.codecs.text_lines import NO_REQUEST
from drivers.codecs.touches import GAP
from drivers.errors import ProtocolError
from drivers.source import ANOTHER_CONTENT, FRAME_REPEATED, ScanClosed, ScanOpened
from tests.drivers.codecs.g800_transcript import DPRNT, DPRNT_MM, DPRNT_PATTERN, PRINT_OUT
from tests.drivers.codecs.streams import any_cut_is_the_same, decoded

NUMBERED = "N *(?P<seq>[0-9]+) X(?P<x>[-+ .0-9]+) Z(?P<z>[-+ .0-9]+)"


def lines(*texts: str) -> bytes:
    return "".join(f"{text}\r" for text in texts).encode("ascii")


def test_lines_of_dprnt_are_read_however_they_are_cut() -> None:
    book = any_cut_is_the_same(lambda: PatternDecoder(DPRNT_PATTERN, "mm", end="M30"), DPRNT)
    assert book.points_mm == list(DPRNT_MM)
    assert isinstance(book.others[-1], ScanClosed)
    assert not book.counts


def test_the_scan_ends_with_its_last_point() -> None:
    book = any_cut_is_the_same(lambda: PatternDecoder(DPRNT_PATTERN, "inch", points=2), DPRNT)
    assert book.points_mm == [tuple(25.4 * value for value in point) for point in DPRNT_MM]
    assert isinstance(book.others[-1], ScanClosed)


def test_numbers_show_what_is_lost_and_lost_points_count_to_the_end() -> None:
    data = lines("N 1 X1. Z0.", "N 2 X2. Z0.", "N 2 X2. Z0.", "N 2 X9. Z0.", "N 5 X5. Z0.", "N 6 X6. Z0.", "N 7 X7. Z0.")
    book = any_cut_is_the_same(lambda: PatternDecoder(NUMBERED, "mm", points=6), data)
    assert book.points_mm == [(1.0, 0.0, 0.0), (2.0, 0.0, 0.0), (5.0, 0.0, 0.0), (6.0, 0.0, 0.0)]
    assert book.counts == {("Rejected", FRAME_REPEATED): 1, ("Rejected", ANOTHER_CONTENT): 1, ("Lost", GAP): 2}
    assert isinstance(book.others[-1], ScanClosed)


@pytest.mark.parametrize(("first", "lost"), [(0, 0), (1, 0), (4, 3)])
def test_numbers_run_from_0_or_1(first: int, lost: int) -> None:
    assert decoded(PatternDecoder(NUMBERED, "mm", end="M30"), lines(f"N {first} X1. Z0.")).lost == lost


def test_what_the_pattern_does_not_describe_is_damage_unless_it_is_passed_over() -> None:
    data = lines("O1234", "N 1 X1. Z0.", "N 2 X1.2.3 Z0.", "(PROBE)", "N 3 X. Z0.", "M30")
    book = any_cut_is_the_same(lambda: PatternDecoder(NUMBERED, "mm", end="M30", pass_over="O[0-9]+|[(].*[)]"), data)
    assert len(book.points_mm) == 1
    assert book.counts == {("Damaged", "line of the pattern whose groups are no numbers"): len("N 2 X1.2.3 Z0.N 3 X. Z0.") + 2}
    assert decoded(PatternDecoder(NUMBERED, "mm", end="M30"), data).total("Damaged") == len("O1234(PROBE)N 2 X1.2.3 Z0.N 3 X. Z0.") + 4


@pytest.mark.parametrize(
    ("text", "value"),
    [("1.5E+01", 15.0), ("-2.5e-001", -0.25), ("+0012.345", 12.345), ("3e2", 300.0), ("\t7.5", 7.5), ("1e10", None), ("1e", None)],
)
def test_numbers_of_computers_are_read_beside_those_of_controls(text: str, value: float | None) -> None:
    book = decoded(PatternDecoder("(?P<seq>[0-9]+);(?P<x>[^;]+);(?P<y>[^;]+)", "mm", end="M30"), lines(f"1;{text};0"))
    assert book.points_mm == ([] if value is None else [(value, 0.0, 0.0)])
    assert (book.total("Damaged") > 0) == (value is None)


@pytest.mark.parametrize("text", ["1,5", "1.234,5", "nan", "inf", "0x1F", "1_000", "--1", "1.5.2", "ERR", "*****"])
def test_what_is_no_number_of_anybody_gives_no_point(text: str) -> None:
    book = decoded(PatternDecoder("(?P<seq>[0-9]+);(?P<x>[^;]+);(?P<y>[^;]+)", "mm", end="M30"), lines(f"1;{text};0"))
    assert (book.points_mm, book.total("Damaged")) == ([], len(f"1;{text};0") + 1)


def test_a_print_out_of_features_is_refused_by_name() -> None:
    with pytest.raises(ProtocolError, match="prints features"):
        PatternDecoder(NUMBERED, "mm", end="M30", pass_over="-+").feed(PRINT_OUT)


@pytest.mark.parametrize(
    ("pattern", "options", "complaint"),
    [
        ("X(?P<x>.*", {}, "is no regular expression"),
        ("X(?P<x>.*)", {}, "fewer than two of the groups x, y and z"),
        ("X(?P<x>.*) Y(?P<y>.*) A(?P<a>.*)", {}, "the group a"),
        ("X" * (LONGEST_PATTERN + 1), {}, "at most 500"),
        ("a{99999999999999999999}", {}, "is no regular expression"),
        (NUMBERED, {"end": "("}, "is no regular expression"),
        (NUMBERED, {"end": None}, "says how the scan ends"),
        (NUMBERED, {"points": 0}, "at least 1"),
        (NUMBERED, {"unit": "furlong"}, "none of mm, inch"),
        (NUMBERED, {"parity": "none"}, "neither even nor odd"),
    ],
)
def test_wrong_options_are_named(pattern: str, options: dict[str, object], complaint: str) -> None:
    with pytest.raises(ValueError, match=complaint):
        decoder("pattern", **({"pattern": pattern, "unit": "mm", "end": "M30"} | options))


ASKING = "REQUEST(?P<number>[ 0-9]+)"


def requests_in(data: bytes) -> list[int | None]:
    book = any_cut_is_the_same(lambda: PatternDecoder(NUMBERED, "mm", end="M30", request=ASKING), data)
    return [arrival.request for arrival in book.others if isinstance(arrival, ScanOpened)]


def test_the_number_of_a_request_opens_the_scan_with_it() -> None:
    assert requests_in(lines("REQUEST     42", "N 1 X1. Z0.", "N 2 X2. Z0.", "M30")) == [42]
    assert requests_in(lines("REQUEST     42", "REQUEST     43", "N 1 X1. Z0.", "M30")) == [43]
    assert requests_in(lines("N 1 X1. Z0.", "M30")) == [None]


def test_a_request_behind_points_begins_the_scan_anew() -> None:
    assert requests_in(lines("REQUEST 41", "N 1 X1. Z0.", "REQUEST 42", "N 1 X1. Z0.", "N 2 X2. Z0.", "M30")) == [41, 42]
    assert requests_in(lines("REQUEST 41", "N 1 X1. Z0.", "REQUEST 41", "N 1 X1. Z0.", "M30")) == [41, 41]


@pytest.mark.parametrize("told", ["0", "000", "10000000", "4 2"])
def test_a_number_that_no_variable_holds_is_damage_and_no_request(told: str) -> None:
    data = lines(f"REQUEST {told}", "N 1 X1. Z0.", "M30")
    assert requests_in(data) == [None]
    assert decoded(PatternDecoder(NUMBERED, "mm", end="M30", request=ASKING), data).counts == {("Damaged", NO_REQUEST): len(told) + 9}


@pytest.mark.parametrize("pattern", ["REQUEST [0-9]+", "REQUEST (?P<seq>[0-9]+)", "REQUEST (?P<number>[0-9]+"])
def test_the_pattern_of_a_request_names_the_number(pattern: str) -> None:
    with pytest.raises(ValueError, match=r"number|no regular expression"):
        PatternDecoder(NUMBERED, "mm", end="M30", request=pattern)
