"""A session with an I++ DME server: what goes out, what is understood of the answers, and how it ends."""

import re
from collections.abc import Callable
from itertools import pairwise

import numpy as np
import pytest

from drivers.codecs.dme_commands import point_measurement, scan_on_line
from drivers.codecs.dme_points import PointCheck
from drivers.codecs.dme_session import DmeJob, DmeSession
from drivers.errors import DeviceRefused
from drivers.source import Arrival, Damaged, PointBatch, Rejected, ScanClosed, ScanOpened
from tests.drivers.codecs.dme_transcript import EMERGENCY, SCANNED_MM, TOUCHED_MM
from tests.drivers.codecs.streams import Account, account

CHECK = PointCheck(1.5, 0.001, 50.0)
LINE = scan_on_line((0, 0, 0), (20, 0, 0), (0, 0, 1), 0.5)
POINT = point_measurement((10, 0, 0), (0, 0, 1))
DONE = ("&", "%")
# What a machine says that knows nothing but places: written by hand, command by command.
PREPARED: tuple[tuple[str, tuple[str, ...]], ...] = (
    ("StartSession()", DONE),
    ("GetDMEVersion()", ("&", '# DMEVersion("1.4")', "%")),
    ("GetMachineClass()", ("&", "# GetMachineClass(CartCMM)", "%")),
    ("IsHomed()", ("&", "# IsHomed(1)", "%")),
    ("GetProp(Tool.Name())", ("&", '# Tool.Name("Probe1")', "%")),
    ("GetCoordSystem()", ("&", "# CoordSystem(MachineCsy)", "%")),
    ("GetProp(Tool.AvrRadius())", ("&", "# Tool.AvrRadius(1.5)", "%")),
    ("OnScanReport(X(), Y(), Z(), IJK(), Q(), ER())", ("&", '! Error(3, 0506, "OnScanReport", "Not supported")', "%")),
    ("ClearAllErrors()", DONE),
    ("OnScanReport(X(), Y(), Z(), Q())", ("&", '! Error(3, 0506, OnScanReport, "Not supported")', "%")),
    ("ClearAllErrors()", DONE),
    ("OnScanReport(X(), Y(), Z())", DONE),
)
SCAN = (LINE, ("&", "# 0.0,0.0,1.5,0.5001,0.0,1.5002", "# 1.0002,0.0,1.4999", "%"))
END = ("EndSession()", DONE)
Steps = tuple[tuple[str, tuple[str, ...]], ...]


def answers(steps: Steps) -> bytes:
    """Everything that the server says, each command under its own tag; a line with a tag of its own keeps it."""
    lines = []
    for number, (_, said) in enumerate(steps, start=1):
        lines += [line if line[0] in "0E9" else f"{number:05d} {line}" for line in said]
    return "".join(f"{line}\r\n" for line in lines).encode("ascii")


def commands(steps: Steps) -> bytes:
    return "".join(f"{number:05d} {command}\r\n" for number, (command, _) in enumerate(steps, start=1)).encode("ascii")


def job(*scans: str, single_points: bool = False, tool: str | None = None, home: bool = False) -> DmeJob:
    return DmeJob(CHECK, scans or (LINE,), tool=tool, home=home, single_points=single_points)


def heard(session: DmeSession, data: bytes, cuts: tuple[int, ...] = ()) -> tuple[Account, bytes]:
    """What arrives of data cut so, and everything that is sent."""
    arrivals, sent = list[Arrival](), session.request()
    edges = [0, *sorted(cuts), len(data)]
    for first, stop in pairwise(edges):
        arrivals += session.feed(data[first:stop])
        sent += session.request()
    return account(arrivals + session.break_off()), sent


def spoken(*steps: tuple[str, tuple[str, ...]], asked: DmeJob | None = None) -> Account:
    """Check that the session sends exactly these commands; return what arrived."""
    book, sent = heard(DmeSession(asked or job()), answers(steps))
    assert sent == commands(steps)
    return book


def test_a_whole_session_byte_for_byte() -> None:
    book = spoken(*PREPARED, SCAN, END)
    assert book.points_mm == list(SCANNED_MM)
    opened = [one for one in book.others if isinstance(one, ScanOpened | ScanClosed)]
    assert opened == [ScanOpened("I++ DME 1.4, CartCMM, tool Probe1, MachineCsy", "", None), ScanClosed(None)]
    assert not book.counts


def test_any_cut_of_the_stream_gives_the_same() -> None:
    data = answers((*PREPARED, SCAN, END))
    whole = heard(DmeSession(job()), data)
    assert heard(DmeSession(job()), data, tuple(range(1, len(data)))) == whole
    rng = np.random.default_rng(1)
    for _ in range(50):
        assert heard(DmeSession(job()), data, tuple(rng.integers(0, len(data) + 1, 8).tolist())) == whole


def test_single_points_are_read_by_their_names_in_any_order() -> None:
    steps = [(command.replace("OnScanReport", "OnPtMeasReport"), said) for command, said in PREPARED[:7]]
    report = ("OnPtMeasReport(X(), Y(), Z(), IJK(), Q(), ER())", DONE)
    touched = (POINT, ("&", "# ER(1.5), X(10.0002), Y(0), IJK(0, 0, 1), Q(0), Z(1.4998)", "%"))
    assert spoken(*steps, report, touched, END, asked=job(POINT, single_points=True)).points_mm == [TOUCHED_MM]


@pytest.mark.parametrize("code", ["0008", "0507"])
def test_a_session_that_was_left_behind_is_ended_first(code: str) -> None:
    left = ("StartSession()", ("&", f'! Error(3, {code}, "StartSession", "a session runs")', "%"))
    assert spoken(left, ("EndSession()", DONE), *PREPARED, SCAN, END).points_mm == list(SCANNED_MM)


def test_home_and_tool_are_asked_and_given_as_the_plan_says() -> None:
    not_homed = ("IsHomed()", ("&", "# IsHomed(0)", "%"))
    other = ("GetProp(Tool.Name())", ("&", '# Tool.Name("RefTool")', "%"))
    changed = (('ChangeTool("Probe1")', DONE), PREPARED[4])
    steps = (*PREPARED[:3], not_homed, ("Home()", DONE), other, *changed, *PREPARED[5:], SCAN, END)
    assert spoken(*steps, asked=job(tool="Probe1", home=True)).points_mm == list(SCANNED_MM)
    with pytest.raises(DeviceRefused, match=re.escape("device.home: true")):
        heard(DmeSession(job()), answers(steps))


def refused(*said: str) -> tuple[str, Account]:
    """How a session is refused in which the scan is answered so, and what arrived before."""
    session = DmeSession(job())
    data = answers((*PREPARED, (LINE, said)))
    with pytest.raises(DeviceRefused) as failure:
        session.feed(data)
    return str(failure.value), account(session.break_off())


def test_errors_name_the_first_cause_and_keep_what_came_before() -> None:
    words, book = refused(
        "&", "# 0.0,0.0,1.5", '! Error(2, 1006, "ScanOnLine", "Surface not found")', '! Error(2, 0006, "x", "aborted")', "%"
    )
    assert "gave up ScanOnLine: error 1006 (repairable), 'Surface not found': no surface was found" in words
    assert book.points_mm == [SCANNED_MM[0]]
    words, book = refused("&", "# 0.0,0.0,1.5", EMERGENCY)
    assert "release the emergency stop" in words
    assert book.points_mm == [SCANNED_MM[0]]
    words, _ = refused("&", 'E0000 # ChangeTool("RefTool")')
    assert "changed to RefTool by hand" in words


def test_a_tip_of_another_radius_is_refused() -> None:
    radius = ("GetProp(Tool.AvrRadius())", ("&", "# Tool.AvrRadius(2.0)", "%"))
    with pytest.raises(DeviceRefused, match=re.escape("a radius of 2 mm, by the plan 1.5 mm")):
        heard(DmeSession(job()), answers((*PREPARED[:6], radius)))


def test_a_setting_that_the_machine_does_not_take_is_refused_though_it_only_warns() -> None:
    asked = DmeJob(CHECK, (LINE,), settings=("Tool.ScanPar.Speed(900)",))
    steps = (*PREPARED[:7], ("", ("&", '! Error(1, 0504, "SetProp", "Argument out of range")', "%")))
    with pytest.raises(DeviceRefused, match=re.escape("does not take Tool.ScanPar.Speed(900): error 0504 (warning)")):
        heard(DmeSession(asked), answers(steps))


def scanned(*said: str, columns: int = 12) -> Account:
    """What arrives of a scan that is answered so. columns : how many steps prepare it; 8 for a machine that tells everything."""
    steps = PREPARED if columns == 12 else (*PREPARED[:7], ("OnScanReport(X(), Y(), Z(), IJK(), Q(), ER())", DONE))
    return heard(DmeSession(job()), answers((*steps, (LINE, said), END)))[0]


@pytest.mark.parametrize(
    ("said", "points", "damaged"),
    [
        (("&", "# 0,0,1.5,0.5001,0", "# 1.5002,1.0002,0,1.4999", "%"), (), True),  # split, and nothing shows that the parts belong together
        (("&", "# 0,0,1.5,0.5001,0", "# 1.5002,1.0002,0", "%"), (), True),  # fits by its length, and is of two points
        (("&", "# 0,0,1.5,0.5001,0", "%"), (), True),
        (("&", "# 0,0,1.5", "# 0.5001,O,1.5002", "# 1.0002,0,1.4999", "%"), (SCANNED_MM[0], SCANNED_MM[2]), True),
        (("# 0,0,1.5", "&", "# 0.5001,0,1.5002", "%"), (SCANNED_MM[1],), True),  # before it was acknowledged
        (("&", "98765 # 0,0,1.5", "# 0.5001,0,1.5002", "%"), (SCANNED_MM[1],), True),  # the tag of nobody
        (("&", "# 12345678901234567,0,1.5", "# 0.5001,0,1.5002", "%"), (SCANNED_MM[1],), True),  # 17 digits
        (("&", 'E0000 # KeyPress("F1")', "# 0,0,1.5", "%"), (SCANNED_MM[0],), False),
        (("&", "# .0,+0.,15E-1", "%"), (SCANNED_MM[0],), False),
        (("&", "", "# 0,0,1.5", "%"), (SCANNED_MM[0],), True),
    ],
)
def test_points_are_whole_or_they_are_none(said: tuple[str, ...], points: tuple[tuple[float, ...], ...], damaged: bool) -> None:
    lines = tuple(line or "9" for line in said)
    book = scanned(*lines)
    assert book.points_mm == list(points)
    assert (book.total("Damaged") > 0) == damaged


def test_a_point_that_is_split_over_two_lines_is_whole_where_its_direction_shows_it() -> None:
    first, second = "0,0,1.5,0,0,1,0,1.5", "0.5001,0,1.5002,0,0,1,0,1.5"
    book = scanned("&", f"# {first},0.5001,0", "# 1.5002,0,0,1,0,1.5", f"# {first}", "%", columns=8)
    assert book.points_mm == [SCANNED_MM[0], SCANNED_MM[1], SCANNED_MM[0]]
    assert not book.counts
    for lines in ((f"# {first},0.5001,0", f"# {first}"), (f"# {first},0.5001", "# 1.5002,0,0,1,0,1.5,9"), (f"# {second},7",)):
        book = scanned("&", *lines, "%", columns=8)
        assert set(book.points_mm) <= {SCANNED_MM[0], SCANNED_MM[1]}
        assert book.total("Damaged") + book.total("Rejected") > 0


def test_quality_radius_and_direction_are_held_against_what_can_be() -> None:
    good = "0,0,1.5,0,0,1,0,1.5"
    book = scanned("&", f"# {good},0,0,1.5,0,0,1,100,1.5", f"# {good},0,0,1.5,0,0,1,0,1.6", f"# 0,0,1.5,0,0,0,0,1.5,{good}", "%", columns=8)
    assert len(book.points_mm) == 3
    assert book.counts["Rejected", "the machine calls the quality of the point bad"] == 1
    assert book.counts["Rejected", "effective radius of the tip is not the plan's 1.5 mm"] == 1
    assert book.total("Damaged") > 0


@pytest.mark.parametrize(
    "spoil",
    [
        lambda line: line.replace(b"\r\n", b"\n"),
        lambda line: line.replace(b",", b"\x07", 1),
        lambda line: line.replace(b" ", b"  ", 1),
        lambda line: line[:-2] + b"," + 70_000 * b"0" + b"\r\n",
    ],
)
def test_a_line_that_is_none_gives_no_point_and_is_counted(spoil: Callable[[bytes], bytes]) -> None:
    data = answers((*PREPARED, SCAN, END))
    second = b"00013 # 1.0002,0.0,1.4999\r\n"
    assert second in data
    spoilt = spoil(second)
    book, _ = heard(DmeSession(job()), data.replace(second, spoilt))
    assert book.points_mm == list(SCANNED_MM[:2])
    assert book.total("Damaged") >= len(spoilt) - 2


def test_a_session_that_is_called_off_aborts_and_ends() -> None:
    session = DmeSession(job())
    data = answers((*PREPARED, (LINE, ("&", "# 0.0,0.0,1.5"))))
    assert len([one for one in session.feed(data) if isinstance(one, PointBatch)]) == 1
    session.request()
    session.call_off()
    session.call_off()
    assert session.request() == b"E0001 AbortE()\r\n"
    aborted = b'E0001 &\r\n00013 ! Error(2, 0006, "ScanOnLine", "Transaction aborted")\r\n00013 %\r\nE0001 %\r\n'
    assert not [one for one in session.feed(aborted) if isinstance(one, PointBatch | Damaged | Rejected)]
    assert session.request() == b"00014 ClearAllErrors()\r\n"
    session.feed(b"00014 &\r\n00014 %\r\n")
    assert session.request() == b"00015 EndSession()\r\n"
    session.feed(b"00015 &\r\n00015 %\r\n")
    assert session.is_over
    assert session.request() == b""
