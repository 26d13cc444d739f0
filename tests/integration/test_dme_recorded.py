"""Recorded I++ DME sessions of a foreign client with a foreign server, against our server and our client.

The logs are those of the NIST I++ DME test suite of 2004 (aschet/nistippdmetestsuite, public domain), dialect 1.4.0. They are not part of
this project: `pytest tests/integration/test_dme_recorded.py --dme-sessions=FOLDER`.
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from drivers.codecs.dme_lines import LineReader, Response, error_in, numbers_in, values_in
from drivers.codecs.dme_points import PointCheck, PointReader
from simulators.dme_answers import KNOWN
from simulators.dme_controller import Controller
from tests.drivers.codecs.streams import account

Array = NDArray[np.float64]
DEFAULT_COLUMNS = ("Q", "X", "Y", "Z")  # as that server sends them; the specification says X, Y, Z, Q
RADIUS_MM = 3.0
PAGE = (Path(__file__).resolve().parents[2] / "docs" / "machines.md").read_text(encoding="utf-8")
EXPLAINED = {
    "GoTo(X(10000000))": "their server says 1008, target out of the volume; the golden transcript says 2500 for the same",
    "GoTo(X(123456789))": "the same",
    "OnMoveReportE(Dis(1), X(), Y(), Z())": "an AbortE stopped the daemon of their server; by the specification it does not",
    "StartSession()": "their server says 0507 where a session runs; the specification says 0008",
    "GetProp(Tool.PtMeasPar.Speed.Max,)": "a comma with nothing behind it: 0509 there, 0502 as any other wrong list here",
    "GetPropE(Tool.PtMeasPar.Speed.Max,)": "the same",
    "SetProp(FoundTool.PtMeasPar.Accel.Act())": "a property without its value: 0509 there, 0502 as with fewer dots here",
}


class LevelPart:
    """A surface that is met wherever the probe goes, as by their server."""

    radius_mm = RADIUS_MM

    def touch(self, point_mm: Array, direction: Array, approach_mm: float, search_mm: float) -> Array | None:
        return np.asarray(point_mm + self.radius_mm * direction)

    def follow(self, course_mm: Array, step_mm: float, *, closed: bool, lost_mm: float) -> tuple[Array, Array, bool]:
        way = course_mm[-1] - course_mm[0]
        share = np.linspace(0.0, 1.0, max(2, min(4000, int(np.linalg.norm(way) / step_mm))))[:, None]
        up = np.tile([0.0, 0.0, 1.0], (len(share), 1))
        return course_mm[0] + share * way + self.radius_mm * up, up, False


@dataclass(slots=True)
class Exchange:
    """One command, what their server said under its tag, and what ours does."""

    command: str
    theirs: list[str] = field(default_factory=list)
    ours: list[str] = field(default_factory=list)

    @property
    def differs(self) -> bool:
        return order_of(self.theirs) != order_of(self.ours)


def order_of(lines: list[str]) -> list[str]:
    """The signs of the answers with the codes of errors; data that follow each other count once."""
    found: list[str] = []
    for line in lines:
        error = re.search(r"! Error\([0-9], ([0-9]{4})", line)
        sign = line[6] + (error[1] if error else "")
        if sign != "#" or found[-1:] != ["#"]:
            found.append(sign)
    return found


def is_refused(lines: list[str]) -> bool:
    return any(sign.startswith("!") and sign != "!0504" for sign in order_of(lines))


@pytest.fixture
def logs(pytestconfig: pytest.Config) -> list[list[tuple[str, str]]]:
    folder = pytestconfig.getoption("--dme-sessions")
    if folder is None:
        pytest.skip("runs with --dme-sessions=FOLDER only")
    files = sorted(Path(folder).glob("*_Client.log"))
    assert len(files) == 63
    return [re.findall(r"(Sent|Received): ([^\r\n]*)", file.read_text(encoding="latin-1")) for file in files]


def exchanges(log: list[tuple[str, str]]) -> Iterator[Exchange]:
    """Say to our server what was said to theirs, when it was said: an AbortE comes while the machine moves."""
    server, latest, found = Controller(LevelPart()), dict[str, Exchange](), list[Exchange]()
    for number, (who, line) in enumerate(log):
        if who == "Received":
            if found:
                latest.get(line[:5], found[-1]).theirs.append(line)
            continue
        one = latest[line[:5]] = Exchange(line)
        found.append(one)
        said = [heard.text for heard in server.hear(line)]
        told = log[number + 1 :]
        upto = next((k for k, (other, text) in enumerate(told) if other == "Sent" and "AbortE" not in text), len(told))
        is_aborted = any(other == "Sent" for other, _ in told[:upto]) and not any(text == f"{line[:5]} %" for _, text in told[:1])
        pieces = 2 if is_aborted and server.is_busy else 10_000
        while server.is_busy and pieces:
            said += [heard.text for heard in server.work()[1]]
            pieces -= 1
        for text in said:
            latest.get(text[:5], one).ours.append(text)
        answered = [text for other, text in told[:upto] if other == "Received"]
        if is_refused(said) and not is_refused(answered):
            server.machine.in_error = False  # so that a difference shows once, and not in everything that follows
    yield from found


def test_our_server_answers_as_theirs_but_for_what_is_explained(logs: list[list[tuple[str, str]]]) -> None:
    everything = [one for log in logs for one in exchanges(log)]
    assert f"{len(everything):,} commands" in PAGE
    different = [one for one in everything if one.differs]
    beyond = [one for one in different if one.command[6:].partition("(")[0].strip() not in KNOWN]
    assert all("!0501" in order_of(one.ours) or "!0502" in order_of(one.ours) for one in different if one not in beyond)
    unexplained = [(one.command, order_of(one.theirs), order_of(one.ours)) for one in beyond if one.command[6:] not in EXPLAINED]
    assert not unexplained
    assert {one.command[6:] for one in beyond} == set(EXPLAINED)
    assert sum(count for _, count in rows_of_page()) == len(different)
    for names, count in rows_of_page():
        assert count == sum(one.command[6:].partition("(")[0].strip() in names for one in different), names
    assert f"{len(everything) - len(different):,} are answered by the same signs" in PAGE


def rows_of_page() -> list[tuple[list[str], int]]:
    """The commands of each row of the page's table of differences, and how many differ."""
    table = PAGE.split("| commands | how many |")[1].split("\n\n")[0]
    rows = [line.split("|") for line in table.splitlines()[2:]]
    return [(re.findall(r"`([A-Za-z]+)`", row[1].partition(" after ")[0]), int(row[2])) for row in rows]


def test_our_client_reads_every_line_of_their_server_and_no_wrong_point(logs: list[list[tuple[str, str]]]) -> None:
    points = 0
    assert f"{sum(who == 'Received' for log in logs for who, _ in log):,} lines" in PAGE
    for log in logs:
        command, reader, columns = dict[str, str](), LineReader(), DEFAULT_COLUMNS
        for who, text in log:
            if who == "Sent":
                command[text[:5]] = text[6:]
                continue
            [line] = reader.feed(f"{text}\r\n".encode("latin-1"))
            assert isinstance(line, Response), text
            assert (line.tag, line.sign) == (text[:5], text[6])
            if line.sign == "!":
                assert error_in(line.data) is not None, text
            elif line.sign == "#":
                points += check_data(command.get(line.tag, ""), line.data, columns)
            elif line.sign == "%" and command.get(line.tag, "").startswith("OnScanReport("):
                columns = tuple(re.findall(r"([A-Za-z.]+)\(\)", command[line.tag]))
    assert points > 300


def check_data(command: str, data: str, columns: tuple[str, ...]) -> int:
    """Check what our client makes of one line of data; return the number of points in it."""
    if command.startswith("Scan") and not command.startswith(("ScanOnCircleHint", "ScanOnLineHint")):
        reader = PointReader(PointCheck(RADIUS_MM, 0.001, 50.0), columns)
        reader.take_scan_line(data)
        found = account(reader.out.hand_over())
        expected = np.array([float(text) for text in data.split(",")]).reshape(-1, len(columns))  # none of three numbers is asked for
        np.testing.assert_array_equal(np.array(found.points_mm).reshape(-1, 3), expected[:, [columns.index(axis) for axis in "XYZ"]])
        assert not found.counts
        return len(expected)
    if command.startswith("PtMeas") and all(f"{axis}(" in data for axis in "XYZ"):
        reader = PointReader(PointCheck(RADIUS_MM, 0.001, 50.0), DEFAULT_COLUMNS)
        reader.take_measured_point(data)
        expected = np.array([[float(text) for axis in "XYZ" for text in re.findall(rf"\b{axis}\(([^)]*)\)", data)]])
        np.testing.assert_array_equal(np.array(account(reader.out.hand_over()).points_mm), expected)
        return 1
    is_listed = re.fullmatch(r'"[^"]*"(, "[^"]*")?|(\([^()]*\)(, )?)+', data) is not None  # names, and the vectors of an alignment
    assert is_listed or values_in(data) is not None or numbers_in(data) is not None, data
    return 0
