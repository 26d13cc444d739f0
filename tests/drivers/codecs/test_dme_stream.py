"""Faults of a server in any order: no wrong point, and every point that was sent is accounted for."""

import re

import numpy as np
from hypothesis import example, given, settings
from hypothesis import strategies as st

from drivers.codecs.dme_points import PointCheck
from drivers.codecs.dme_session import DmeJob, DmeSession
from drivers.errors import DeviceRefused
from drivers.source import Arrival
from tests.drivers.codecs.streams import account
from tests.drivers.codecs.test_dme_session import DONE, LINE, PREPARED, answers

POINTS = 300
DIRECTION = (0.0, 0.6, 0.8)
FAULTS = ("lone line feed", "tag of nobody", "letter", "lost comma", "lost line", "short")
LAW = settings(max_examples=max(5, settings().max_examples // 10), deadline=None)


def lines_of(sent: np.ndarray[tuple[int, int], np.dtype[np.float64]], rng: np.random.Generator, share: float) -> tuple[str, set[str]]:
    """A scan with faults in a share of its lines, and which faults struck."""
    text, struck, at, carried = "", set[str](), 0, ""
    while at < len(sent):
        count = min(int(rng.integers(1, 6)), len(sent) - at)
        rows = ((*point, *DIRECTION, 0.0, 1.5) for point in sent[at : at + count].tolist())
        numbers = [f"{value:.4f}" for row in rows for value in row]
        data, ending, tag = carried + ",".join(numbers), "\r\n", "00009"
        was_carried, carried = carried, ""
        if rng.random() < share / 2 and at + count < len(sent):  # split the last point
            cut = int(rng.integers(1, 8))
            pieces = data.split(",")
            data, carried = ",".join(pieces[:-cut]), ",".join(pieces[-cut:]) + ","
        fault = str(rng.choice(FAULTS)) if rng.random() < share else ""
        if fault == "lost line" and was_carried and carried:
            fault = ""  # what is left of two points in a row may fit by its length alone; TCP loses no line between them
        if fault == "lone line feed":
            ending = "\n"
        elif fault == "tag of nobody":
            tag = "98765"
        elif fault == "letter":
            data = data[: len(data) // 2] + "O" + data[len(data) // 2 + 1 :]
        elif fault == "lost comma":
            data = data.replace(",", "", 1)
        elif fault == "short":
            data = data.rpartition(",")[0] or data[:1] + "x"
        struck |= {fault} - {""}
        text += "" if fault == "lost line" else f"{tag} # {data}{ending}"
        at += count
    return text, struck


@given(st.integers(0, 2**32), st.sampled_from([0.0, 0.05, 0.3]))
@example(75405, 0.3)  # behind a damaged line: two lines that fit by their length, the radius of one point standing where x should
@example(900839, 0.3)  # one whole line of the rest of a point and the beginning of another, x being the radius of the tip
@LAW
def test_faults_give_no_wrong_point(seed: int, share: float) -> None:
    rng = np.random.default_rng(seed)
    sent = np.column_stack([np.arange(POINTS) / 100 + 0.0001, rng.uniform(-99, 99, (POINTS, 2)).round(4)])
    scan, faults = lines_of(sent, rng, share)
    told_all = (*PREPARED[:7], ("OnScanReport(X(), Y(), Z(), IJK(), Q(), ER())", DONE))
    data = answers(told_all) + b"00009 &\r\n" + scan.encode("ascii") + b"00009 %\r\n"
    session, arrivals = DmeSession(DmeJob(PointCheck(1.5, 0.001, 50.0), (LINE,))), list[Arrival]()
    try:
        for piece in re.findall(rb"(?s).{1,97}", data):
            arrivals += session.feed(piece)
    except DeviceRefused:
        raise AssertionError("no fault of a line is a refusal") from None
    book = account(arrivals + session.break_off())
    got = np.array(book.points_mm).reshape(-1, 3)
    index = np.rint((got[:, 0] - 0.0001) * 100).astype(int) if len(got) else np.empty(0, dtype=int)
    np.testing.assert_allclose(got, sent[index], atol=1e-9)
    assert len(set(index.tolist())) == len(index)
    assert (np.diff(index) > 0).all()
    if share == 0:
        assert len(got) == POINTS
        assert not book.counts
    elif len(got) < POINTS:
        assert book.total("Damaged") + book.total("Rejected") > 0 or "lost line" in faults
