"""What a simulated machine tool prints, byte for byte as the transcripts of the language say."""

import numpy as np
import pytest

from simulators.devices.machine_tool import InspectingControl, OwnLines, PrintingControl, Quirks, bare, dprnt, short
from simulators.faults import Fault, Injector
from simulators.stream import Sample
from tests.drivers.codecs.g800_transcript import INCHES, POINTS, RADIUS_MM

NOMINAL_MM = np.array([[-0.4394, 0.5291, -0.0753], [-0.4, 0.5, 0.0]]) * 25.4
OUTWARD = np.array([[0.63893, -0.76927, 0.0], [1.0, 0.0, 0.0]])
SAMPLES = [Sample(index, 0.0, (25.4 * x, 25.4 * y, 25.4 * z)) for index, (x, y, z) in enumerate(INCHES)]


def control(quirks: Quirks, *faults: str, kind: type[InspectingControl] = InspectingControl) -> InspectingControl:
    return kind(NOMINAL_MM, OUTWARD, RADIUS_MM, quirks, Injector([Fault.parse(fault) for fault in faults], 0))


def test_points_are_printed_as_in_the_golden_set() -> None:
    printed = b"".join(control(Quirks(inch=True)).frame([sample]) for sample in SAMPLES).decode("ascii")
    assert printed.splitlines() == [line for line in POINTS.splitlines() if not line.startswith("G802")]
    assert printed.count("\r\n") == 4


def test_numbers_are_printed_as_controls_do() -> None:
    assert [dprnt(1.5436, 4, 4), dprnt(-0.054, 4, 3)] == ["   1.5436", "  -0.054"]
    assert [dprnt(12345.5, 3, 1), dprnt(7.0, 4, 0)] == ["12345.5", "    7"]
    assert [bare(-0.4187, 4), bare(0.504, 4), bare(12.0, 4), bare(0.0, 4)] == ["-.4187", ".5040", "12.0000", ".0000"]
    assert [short(0.5291, 4), short(0.0, 5), short(-1.0, 5)] == ["0.5291", "0.", "-1."]


def test_a_plain_macro_prints_a_line_a_point() -> None:
    made = control(Quirks(end="\r"), kind=PrintingControl)
    assert made.opening(1) + made.frame(SAMPLES[:1]) + made.closing(1) == b"\x12\rN    1 X -10.6350 Y  12.8016 Z  -1.9126\rM30\x14\r"


def test_every_quirk_shows_in_the_bytes() -> None:
    untouched = control(Quirks(), "no-contact:1").frame(SAMPLES[:1])
    assert untouched == b"G800 N1 X-11.1608 Y13.4391 Z-1.9126 I0.63893 J-0.76927 K0. O0. U0.127 L0.127\r\n"
    assert control(Quirks(), "mislabelled:1").frame(SAMPLES[:1]).count(b"G801 N1 ") == 2
    assert b"OTHER-RESULTS" in control(Quirks(old_set=True)).opening(1)
    assert control(Quirks(closes=False)).closing(1) == b""
    with_parity = control(Quirks(parity=True)).closing(1)
    assert all(byte.bit_count() % 2 == 0 for byte in with_parity)
    assert bytes(byte & 0x7F for byte in with_parity) == b"END\x14\r\n"


def camera(line: str, *faults: str, request: int | None = None) -> OwnLines:
    return OwnLines(line, NOMINAL_MM, OUTWARD, Quirks(), Injector([Fault.parse(fault) for fault in faults], 0), request)


def test_a_camera_sends_the_lines_that_it_was_told() -> None:
    made = camera("{number:04d};{x:+.3f};{y:.2f}")
    assert made.opening(1) + made.frame(SAMPLES[:1]) + made.closing(1) == b"0001;-10.635;12.80\r\nEND\r\n"
    assert camera("{z}", "no-contact:1").frame(SAMPLES[:1]) == b""
    assert camera("{z}", request=7).opening(1) == b"REQUEST       7\r\n"


@pytest.mark.parametrize("line", ["{a}", "{}", "{x.real.y}", "{x:q}", "{x", "\u00b5{x}"])
def test_a_line_that_cannot_be_filled_in_is_refused(line: str) -> None:
    with pytest.raises(ValueError, match="expected ASCII with the fields number, x, y and z"):
        camera(line)
