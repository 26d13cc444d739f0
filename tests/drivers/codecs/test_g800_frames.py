"""The language of inspection on machine tools: what its lines mean, with every quirk that controls are known for."""

from functools import partial

import numpy as np
import pytest

from drivers.codecs.g800_frames import MOST_WAITING, NO_CONTACT, NO_NOMINAL, OTHER_PLANE, G800Decoder
from drivers.codecs.text_lines import LONGEST_LINE, NO_REQUEST
from drivers.codecs.touches import GAP, UNKNOWN_LOSS
from drivers.errors import ProtocolError
from drivers.source import ANOTHER_CONTENT, FRAME_REPEATED, ScanClosed, ScanOpened
from tests.drivers.codecs.g800_transcript import GOLDEN, INCHES, OPENING, PLANES, POINTS, PRINT_OUT, RADIUS_MM
from tests.drivers.codecs.streams import account, any_cut_is_the_same, decoded, flipped, only_sent_points


def mm(*, set_name: str = "", parity: str = "") -> G800Decoder:
    return G800Decoder("mm", set_name=set_name, parity=parity)


def set_of(*lines: str, opening: str = "START", end: str = "END") -> bytes:
    return "".join(f"{line}\r\n" for line in (opening, *lines, end) if line).encode("ascii")


def pair(number: int, x: float = 0.0, y: float = 0.0) -> tuple[str, str]:
    return f"G800 N{number} X{x:.4f} Y{y:.4f} Z0. I0. J1. K0. O0. U.05 L.05", f"G801 N{number} X{x:.4f} Y{y + 1.5:.4f} Z0. R1.5"


def with_parity(data: bytes, ones: int = 0) -> bytes:
    """The bytes with a parity bit as their eighth; `ones` is 0 for even parity and 1 for odd."""
    return bytes(byte | 0x80 if byte.bit_count() % 2 != ones else byte for byte in data)


def test_the_golden_set_is_read_however_it_is_cut() -> None:
    book = any_cut_is_the_same(lambda: G800Decoder("inch", RADIUS_MM), GOLDEN)
    np.testing.assert_array_equal(book.points_mm, np.array(INCHES) * 25.4)
    assert book.sequence == [0, 1]
    assert book.others == [ScanOpened("G800 SLEEVE-RESULTS", "", None), ScanClosed(None)]
    assert not book.counts


@pytest.mark.parametrize("end", [b"\r", b"\n", b"\r\n", b"\r\r\n", b"\n\r", b" \r\n"])
def test_any_end_of_a_line_will_do(end: bytes) -> None:
    plain = decoded(G800Decoder("inch"), GOLDEN)
    assert decoded(G800Decoder("inch"), GOLDEN.replace(b"\r\n", end)) == plain
    assert any_cut_is_the_same(lambda: G800Decoder("inch"), b"\x12" + GOLDEN.replace(b"\r\n", end + b"\x14\x12") + b"\x14") == plain


def test_parity_in_the_eighth_bit_is_checked_and_taken_off() -> None:
    plain = decoded(G800Decoder("inch"), GOLDEN)
    for ones, parity in enumerate(("even", "odd")):
        assert any_cut_is_the_same(partial(G800Decoder, "inch", parity=parity), with_parity(GOLDEN, ones)) == plain
        other = decoded(G800Decoder("inch", parity=parity), with_parity(GOLDEN, 1 - ones))
        assert not other.points_mm
        assert other.total("Damaged") > 0
    assert not decoded(G800Decoder("inch"), with_parity(GOLDEN)).points_mm


@pytest.mark.parametrize(
    ("line", "point"),
    [
        ("G801 N1 X-.4187 Y.5040 Z-.0753 R.0345", (-0.4187, 0.504, -0.0753)),
        ("G801 N1 X   1.5436 Y  -0.054 Z   0. R  .0345", (1.5436, -0.054, 0.0)),
        ("G801 N   1 X-   1.5 Y+  2. Z 0", (-1.5, 2.0, 0.0)),
        ("G801N1X1.Y2.Z3.", None),
        ("G801 N1X1.Y2.Z3.", (1.0, 2.0, 3.0)),
        ("G801 N1 X1. 5 Y2. Z3.", None),
        ("G801 N1 X1.5.2 Y2. Z3.", None),
        ("G801 N1 X1,5 Y2. Z3.", None),
        ("G801 N1 X1. Y2.", None),
        ("G801 N1 X1. X1. Y2. Z3.", None),
        ("G801 N1.5 X1. Y2. Z3.", None),
        ("G801 X1. Y2. Z3.", None),
        ("G801 N1 X. Y2. Z3.", None),
        ("G801 N1 X- Y2. Z3.", None),
        ("G801 N1 X1e3 Y2. Z3.", None),
    ],
)
def test_numbers_are_read_as_controls_print_them_and_nothing_else_is(line: str, point: tuple[float, ...] | None) -> None:
    book = decoded(mm(), set_of(line))
    assert book.points_mm == ([point] if point else [])
    assert bool(book.total("Damaged")) is (point is None)


def test_a_nominal_point_that_was_not_touched_is_told() -> None:
    lines = [*pair(1), pair(2)[0], *pair(3)]
    book = any_cut_is_the_same(mm, set_of(*lines))
    assert book.sequence == [0, 2]
    assert book.counts == {("Rejected", NO_CONTACT): 1}


def test_nominal_points_may_all_come_first() -> None:
    both = [pair(number) for number in range(1, 6)]
    book = any_cut_is_the_same(mm, set_of(*(nominal for nominal, _ in both), *(measured for _, measured in both)))
    assert (book.sequence, dict(book.counts)) == ([0, 1, 2, 3, 4], {})


def test_more_nominal_points_than_are_kept_waiting_count_as_not_touched() -> None:
    book = decoded(mm(), set_of(*(pair(number)[0] for number in range(1, MOST_WAITING + 4))))
    assert book.counts == {("Rejected", NO_CONTACT): MOST_WAITING + 3}


def test_a_nominal_point_that_is_labelled_as_measured_is_no_point() -> None:
    nominal, measured = pair(1, 3.0)
    book = any_cut_is_the_same(mm, set_of(nominal.replace("G800", "G801"), measured, *pair(2)))
    assert book.points_mm == [(3.0, 1.5, 0.0), (0.0, 1.5, 0.0)]
    assert not book.counts


def test_a_measured_point_whose_nominal_point_is_gone_is_not_believed() -> None:
    book = decoded(mm(), set_of(*pair(1), pair(2)[1], *pair(3)))
    assert book.sequence == [0, 2]
    assert book.counts == {("Rejected", NO_NOMINAL): 1}


def test_what_is_missing_between_numbers_is_lost() -> None:
    book = any_cut_is_the_same(mm, set_of(*pair(1), *pair(4)))
    assert (book.sequence, book.lost) == ([0, 3], 2)
    late = decoded(mm(), set_of(*pair(1), *pair(4), *pair(2)))
    assert (late.sequence, late.lost) == ([0, 3, 1], 1)


def test_numbers_before_the_first_are_lost_where_the_beginning_of_the_set_was_not_seen() -> None:
    assert decoded(mm(), set_of(*pair(3), opening="")).counts == {("Lost", GAP): 2}
    assert not decoded(mm(), set_of(*pair(3))).counts


def test_a_repeated_point_is_counted_once_and_another_one_under_its_number_is_not_believed() -> None:
    nominal, measured = pair(1)
    assert decoded(mm(), set_of(nominal, measured, measured)).counts == {("Rejected", FRAME_REPEATED): 1}
    book = decoded(mm(), set_of(nominal, measured, measured.replace("X0", "X9")))
    assert (book.points_mm, dict(book.counts)) == ([(0.0, 1.5, 0.0)], {("Rejected", ANOTHER_CONTENT): 1})


def test_numbers_may_begin_anew_with_each_toolpath() -> None:
    book = any_cut_is_the_same(mm, set_of(*pair(1), *pair(2), "TOOLPATHID 13", "TOOLPATH SLOT", pair(1)[0], *pair(2)))
    assert book.sequence == [0, 1, 3]
    assert book.counts == {("Rejected", NO_CONTACT): 1}


def two_sets(end: str = "END") -> bytes:
    return set_of("RESULTSFILE A", *pair(1, 1.0), end=end) + set_of("DOCUMENTID X", "RESULTSFILE B", *pair(1, 2.0))


@pytest.mark.parametrize("end", ["END", ""])
@pytest.mark.parametrize(("name", "x"), [("A", 1.0), ("B", 2.0), ("X", 2.0), ("C", None)])
def test_the_set_that_is_asked_for_is_taken_and_no_other(name: str, x: float | None, end: str) -> None:
    before = b"RESULTSFILE A\r\n" + set_of(*pair(1, 1.0), end=end) + b"RESULTSFILE B\r\nDOCUMENTID X\r\n" + set_of(*pair(1, 2.0))
    for data in (two_sets(end), before):
        found = decoded(mm(set_name=name), data)
        assert [point[0] for point in found.points_mm][:1] == ([] if x is None else [x])
        if x == 2.0:
            assert (len(found.points_mm), dict(found.counts)) == (1, {})
            any_cut_is_the_same(partial(mm, set_name=name), data)


def test_without_a_name_the_first_set_is_the_scan() -> None:
    book = any_cut_is_the_same(mm, two_sets())
    assert [point[0] for point in book.points_mm] == [1.0]


def test_a_set_that_begins_anew_opens_the_scan_again() -> None:
    book = decoded(mm(), two_sets(end=""))
    assert [type(other) for other in book.others] == [ScanOpened, ScanOpened, ScanClosed]


def test_the_end_of_a_set_that_was_over_before_does_not_end_the_scan() -> None:
    book = any_cut_is_the_same(mm, b"END\r\n" + set_of(*pair(1)))
    assert len(book.points_mm) == 1
    assert isinstance(book.others[-1], ScanClosed)


def test_a_ball_of_another_radius_is_told_by_name() -> None:
    book = decoded(G800Decoder("mm", 2.0), set_of(*pair(1)))
    assert book.counts == {("Rejected", "radius R of the ball is not the plan's 2 mm (probe.tip_radius_mm)"): 1}
    assert not decoded(G800Decoder("inch", RADIUS_MM + 0.0019), GOLDEN).counts
    assert decoded(G800Decoder("inch", RADIUS_MM + 0.0021), GOLDEN).total("Rejected") == 2


def test_points_behind_a_change_of_planes_are_not_believed() -> None:
    book = any_cut_is_the_same(
        mm,
        (OPENING + PLANES + "\r\n".join(pair(1)) + "\r\n").encode() + set_of("G330 N2 A0. B0. C0. X5. Y0 Z0 I0 R0", *pair(2), opening=""),
    )
    assert book.counts == {("Rejected", OTHER_PLANE): 1}


def test_a_print_out_of_features_is_refused_by_name() -> None:
    for line in PRINT_OUT.splitlines(keepends=True)[1:]:
        with pytest.raises(ProtocolError, match="prints features"):
            mm().feed(line)
    assert decoded(mm(), POINTS.encode() + PRINT_OUT).total("Damaged") == len(PRINT_OUT) - len(PRINT_OUT.splitlines())


def test_damage_costs_its_line_alone() -> None:
    lines = set_of(*pair(1), "G8?1 N1 X", *pair(2), "x" * (2 * LONGEST_LINE), *pair(3))
    book = any_cut_is_the_same(mm, lines)
    assert book.sequence == [0, 1, 2]
    assert book.total("Damaged") == len("G8?1 N1 X") + 2 * LONGEST_LINE + 2
    cut = decoded(mm(), set_of(*pair(1))[:-12])
    assert cut.total("Damaged") > 0


def test_no_bit_that_turns_over_makes_a_wrong_point_where_parity_is_sent() -> None:
    """One bit a line at most: two in one byte no parity shows."""
    count = 3000
    rng = np.random.default_rng(20)
    sent = np.column_stack([np.round(rng.uniform(-50, 50, count), 4), np.round(rng.uniform(-50, 50, count), 4) + 1.5, np.zeros(count)])
    lines = [line for number, (x, y, _) in enumerate(sent, start=1) for line in pair(number, x, y - 1.5)]
    whole = with_parity(set_of(*lines))
    first = len(set_of(end=""))
    book = decoded(mm(parity="even"), flipped(whole[:-5], 0.002, rng, first) + whole[-5:])
    only_sent_points(book, sent, 1e-4)
    assert 1000 < len(book.points_mm) < count
    assert len(book.points_mm) + book.total("Rejected") + book.lost == pytest.approx(count, abs=3)


@pytest.mark.parametrize(
    ("behind", "counts"),
    [
        ([*pair(2)], {}),
        ([*pair(4)], {("Lost", GAP): 2}),
        ([], {("Damaged", UNKNOWN_LOSS): 4}),
        (["TOOLPATHID 2", *pair(1)], {("Damaged", UNKNOWN_LOSS): 4}),
    ],
)
def test_what_is_lost_with_the_link_is_counted_or_said_to_be_unknown(behind: list[str], counts: dict[tuple[str, str], int]) -> None:
    made = mm()
    arrivals = [*made.feed(set_of(*pair(1), end="")), *made.break_off(), *made.feed(set_of(*behind, opening=""))]
    book = account(arrivals)
    assert isinstance(book.others[-1], ScanClosed)
    assert book.counts == counts


def requests_in(data: bytes, set_name: str = "") -> list[tuple[str, int | None]]:
    book = any_cut_is_the_same(lambda: mm(set_name=set_name), data)
    return [(arrival.device, arrival.request) for arrival in book.others if isinstance(arrival, ScanOpened)]


def asked(number: object) -> bytes:
    return f"REQUEST{number!s:>7}\r\n".encode("ascii")


def test_a_set_is_opened_with_the_request_that_stands_before_it() -> None:
    assert requests_in(asked(42) + set_of(*pair(1))) == [("G800", 42)]
    assert requests_in(set_of("REQUEST 42", "RESULTSFILE A", *pair(1))) == [("G800 A", 42)]
    assert requests_in(asked(41) + asked(42) + set_of(*pair(1))) == [("G800", 42)]
    assert requests_in(set_of(*pair(1))) == [("G800", None)]


def test_the_request_of_one_set_is_never_that_of_another() -> None:
    old = asked(41) + set_of("RESULTSFILE OLD", *pair(1))
    assert requests_in(old + asked(42) + set_of("RESULTSFILE NEW", *pair(1)), "NEW") == [("G800 NEW", 42)]
    assert requests_in(old + set_of("RESULTSFILE NEW", *pair(1)), "NEW") == [("G800 NEW", None)]
    cut_off = asked(41) + set_of(*pair(1), end="")
    assert requests_in(cut_off + set_of(*pair(1))) == [("G800", 41), ("G800", None)]
    assert requests_in(cut_off + asked(42) + set_of(*pair(1))) == [("G800", 41), ("G800", 42)]
    assert requests_in(cut_off + asked("4Z") + set_of(*pair(1))) == [("G800", 41), ("G800", None)]


def test_a_request_without_a_number_takes_back_the_one_before() -> None:
    for told in ("0", "", "-1", "1.5", "10000000"):
        data = asked(41) + asked(told) + set_of(*pair(1))
        assert requests_in(data) == [("G800", None)], told
        assert decoded(mm(), data).counts == {("Damaged", NO_REQUEST): len(asked(told)) - 1}, told
