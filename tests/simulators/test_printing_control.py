"""What a simulated machine tool prints, byte for byte as the transcripts of the language say."""

from pathlib import Path

import numpy as np
import pytest

from simulators.devices.machine_tool import InspectingControl, OwnLines, PrintingControl, Quirks, bare, dprnt, serve_dprnt, short
from simulators.faults import Fault, Injector
from simulators.settings import settings_from
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


def test_a_control_that_asks_prints_the_number_of_its_request_first() -> None:
    asking = InspectingControl(NOMINAL_MM, OUTWARD, RADIUS_MM, Quirks(old_set=True), Injector([], 0), request=4711)
    old, _, own = asking.opening(2).partition(b"REQUEST    4711\r\n")
    assert old.endswith(b"END\r\n")
    assert own.startswith(b"\x12START\r\n")
    plain = PrintingControl(NOMINAL_MM, OUTWARD, RADIUS_MM, Quirks(), Injector([], 0), request=9_999_999)
    assert plain.opening(2) == b"\x12\r\nREQUEST 9999999\r\n"
    assert b"REQUEST" not in control(Quirks()).opening(2)


def test_behind_an_emergency_stop_nothing_is_printed() -> None:
    for kind in (InspectingControl, PrintingControl):
        stopped = control(Quirks(), "emergency-stop@1", kind=kind)
        assert stopped.frame(SAMPLES[:1])
        assert not stopped.stands
        assert stopped.frame(SAMPLES[1:]) + stopped.closing(2) == b""
        assert stopped.stands


def test_a_larger_ball_touches_from_farther_away() -> None:
    changed = control(Quirks(), "tool-change@1")
    assert changed.frame(SAMPLES[:1]) == control(Quirks()).frame(SAMPLES[:1])
    before, behind = (made.frame(SAMPLES[1:]).splitlines()[1].decode("ascii") for made in (control(Quirks()), changed))
    assert before == f"G801 N2 X{bare(-0.3655 * 25.4, 4)} Y{bare(0.5 * 25.4, 4)} Z.0000 R{bare(RADIUS_MM, 4)}"
    assert behind == f"G801 N2 X{bare(-0.3655 * 25.4 + 0.5, 4)} Y{bare(0.5 * 25.4, 4)} Z.0000 R{bare(RADIUS_MM + 0.5, 4)}"


@pytest.mark.parametrize("options", [("--answer", "O9100.nc"), ("--request", "7"), ("--fault", "tool-change")])
def test_a_camera_asks_for_no_verdict_and_has_no_tool(options: tuple[str, str], tmp_path: Path) -> None:
    (tmp_path / "path.csv").write_text("0,0\n1,0\n0,1\n", encoding="utf-8")
    words = ["--address", "127.0.0.1:0", "--path", str(tmp_path / "path.csv"), "--line", "{x};{y}", *options]
    with pytest.raises(ValueError, match=r"machine tools|nobody changes its tool"):
        serve_dprnt(settings_from(words), lambda _: None)
