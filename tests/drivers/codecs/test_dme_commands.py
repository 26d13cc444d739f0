"""The commands of an I++ DME client, byte for byte, and the lines that a long curve takes."""

import re
from itertools import pairwise

import numpy as np
import pytest

from drivers.codecs.dme_commands import (
    Dialect,
    command_line,
    curve_density,
    number,
    point_measurement,
    scan_on_circle,
    scan_on_line,
    scan_unknown,
    scans_on_curve,
)
from drivers.codecs.dme_lines import LONGEST_LINE
from tests.drivers.codecs.dme_transcript import ABORT, GOLDEN


def test_commands_are_those_of_the_golden_transcript() -> None:
    golden = [command for command, _ in (*GOLDEN, *ABORT)]
    assert f"00005 {scan_on_line((0, 0, 0), (20, 0, 0), (0, 0, 1), 0.5)}" in golden
    assert f"00006 {point_measurement((10, 0, 0), (0, 0, 1))}" in golden
    assert f"00010 {scan_on_circle((0, 0, 0), (10, 0, 0), (0, 0, 1), 360, 0, 1)}" in golden
    assert command_line("E0011", "AbortE()") == f"{ABORT[1][0]}\r\n".encode()


def test_an_unknown_contour_is_told_in_the_dialect_of_the_server() -> None:
    def told(dialect: Dialect) -> str:
        return scan_unknown((0, 0, 0), (0, 0, 1), (0, 1, 0), (2, 0, 0), 0.5, (9, 0, 0), 1.4, 1, (0, 0, 1), dialect)

    assert told("1.4.0") == "ScanInPlaneEndIsSphere(0,0,0,0,0,1,2,0,0,0.5,9,0,0,1.4,0,0,1)"  # as a server of 2004 took it
    assert told("1.4.3") == "ScanInPlaneEndIsSphere(0,0,0,0,0,1,0,1,0,2,0,0,0.5,9,0,0,1.4,1,0,0,1)"


@pytest.mark.parametrize(
    ("value", "text"), [(20.0, "20"), (0.5, "0.5"), (-0.0, "0"), (-1e-9, "0"), (1e-6, "0.000001"), (123456.1234567, "123456.123457")]
)
def test_numbers_are_spelled_as_short_as_they_are(value: float, text: str) -> None:
    assert number(value) == text


def points_of(command: str) -> np.ndarray[tuple[int, int], np.dtype[np.float64]]:
    found = re.fullmatch(r"ScanOnCurve\(Closed\([01]\), Format\(X\(\),Y\(\),Z\(\),IJK\(\),tag\), Data\((.*)\)\)", command)
    assert found is not None
    return np.array(found[1].split(","), dtype=np.float64).reshape(-1, 7)


@pytest.mark.parametrize("closed", [False, True])
def test_a_long_curve_goes_in_several_lines_that_share_their_ends(closed: bool) -> None:
    rng = np.random.default_rng(1)
    path = np.hstack([rng.uniform(-500, 500, (3000, 3)), rng.uniform(-1, 1, (3000, 3))])
    scans = scans_on_curve(path, closed=closed)
    assert len(scans) > 2
    assert all(len(command_line("00001", scan)) - 2 <= LONGEST_LINE for scan in scans)
    parts = [points_of(scan) for scan in scans]
    assert all("Closed(0)" in scan for scan in scans)
    for before, after in pairwise(parts):
        np.testing.assert_array_equal(before[-1], after[0])
    told = np.vstack([parts[0], *(part[1:] for part in parts[1:])])
    expected = np.vstack([path, path[:1]]) if closed else path
    np.testing.assert_allclose(told[:, :6], expected, atol=0.51e-6)
    assert (told[:, 6] == 1).all()


def test_a_short_curve_goes_in_one_line() -> None:
    path = np.array([[0.0, 0, 0, 0, 0, 1], [1, 0, 0, 0, 0, 1]])
    assert scans_on_curve(path, closed=True) == (
        "ScanOnCurve(Closed(1), Format(X(),Y(),Z(),IJK(),tag), Data(0,0,0,0,0,1,1,1,0,0,0,0,1,1))",
    )
    assert curve_density(0.1, 10) == "ScanOnCurveDensity(Dis(0.1), Angle(10), AtNominals(0))"
