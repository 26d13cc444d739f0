"""Simulated machine tools that probe a part on their table and print each touched point as lines of text.

`machine-tool` prints the language of inspection (G800 nominal, G801 measured), `machine-tool-dprnt` one line of DPRNT a point, or
a line of the user's own, as cameras and line scanners send. Numbers are printed as controls do: DPRNT shows leading zeros as blanks, the
posts of CAM systems leave them out.
"""

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from simulators.answers import STOPPED, await_answer
from simulators.faults import Injector
from simulators.line import open_line_of_control
from simulators.motion import walk
from simulators.settings import LAST_REQUEST, Announce, SimulatorSettings, refuse_answer
from simulators.stream import Device, Sample, stream

_MM_PER_INCH = 25.4
_OTHER_TOOL_MM = 0.5  # how much larger the ball of another tool is
_DC2, _DC4 = "\x12", "\x14"
_OTHER_PART = ("START", "RESULTSFILE OTHER-RESULTS", "G800 N1 X0. Y0. Z0. I0. J1. K0. O0. U.1 L.1", "G801 N1 X0. Y9.9 Z0. R1.5", "END")


def short(value: float, decimals: int) -> str:
    """A number as posts write it: without the zeros behind, but with its point."""
    return f"{value:.{decimals}f}".rstrip("0")


def bare(value: float, decimals: int) -> str:
    """A number as a control prints it that leaves out leading zeros."""
    text = f"{value:.{decimals}f}"
    sign, digits = ("-", text[1:]) if text.startswith("-") else ("", text)
    return sign + (digits[1:] if digits.startswith("0.") else digits)


def dprnt(value: float, before: int, after: int) -> str:
    """A number as `DPRNT[#100[wf]]` prints it: sign or blank, leading zeros as blanks; the field grows where the number does."""
    return f"{value:{before + after + 1}.{after}f}"


@dataclass(frozen=True, slots=True)
class Quirks:
    """How the control prints: the end of its lines, whether in inches, whether with parity, and what it leaves out."""

    end: str = "\r\n"
    inch: bool = False
    parity: bool = False
    closes: bool = True
    old_set: bool = False

    @classmethod
    def asked_for(cls, injector: Injector) -> "Quirks":
        """The quirks among the faults that were asked for."""
        end = "\r" if injector.expects("cr-only") else "\r\n"
        return cls(end, injector.expects("inch"), injector.expects("parity"), not injector.expects("no-end"), injector.expects("old-set"))

    def bytes_of(self, *lines: str) -> bytes:
        """Lines as they leave the control."""
        data = "".join(line + self.end for line in lines).encode("ascii")
        return bytes(byte | 0x80 if byte.bit_count() % 2 else byte for byte in data) if self.parity else data

    def own(self, millimetres: NDArray[np.float64] | float) -> NDArray[np.float64]:
        """A length in the unit of the control."""
        return np.asarray(millimetres, dtype=np.float64) / (_MM_PER_INCH if self.inch else 1.0)


class InspectingControl(Device):
    """Prints nominal and measured points, and around them what a post prints."""

    kind = "lines"
    impatience_s = 0.0  # nobody asks a control to begin: its operator does, when somebody listens

    def __init__(
        self,
        nominal_mm: NDArray[np.float64],
        outward: NDArray[np.float64],
        radius_mm: float,
        quirks: Quirks,
        injector: Injector,
        request: int | None = None,
    ) -> None:
        """`request` is the number by which the control asks for the verdict; None where it does not ask."""
        self._nominal_mm, self._outward, self._radius_mm = nominal_mm, outward, radius_mm
        self._quirks, self._injector, self._request = quirks, injector, request
        self._stands = self._has_other_tool = False

    @property
    def stands(self) -> bool:
        """Whether somebody pressed the emergency stop: nothing is printed any more, and nobody waits for an answer."""
        return self._stands

    def told_to_begin(self) -> bool:
        """Nobody tells a control."""
        return False

    def opening(self, count: int) -> bytes:
        """Switch the printer on, and say of which part the results are."""
        old = _OTHER_PART if self._quirks.old_set else ()
        planes = ("G331 N1 A0. B0. C0. X0. Y0. Z0.", "G330 N1 A0. B0. C0. X0 Y0 Z0 I0 R0")
        heading = ("START", "RESULTSFILE PART-RESULTS", "TIMESTAMP 260314 150926", "TOOLPATHID 1", "TOOLPATH SECTION")
        return self._quirks.bytes_of(*old, *self.request_lines(), _DC2 + heading[0], *heading[1:], *planes)

    def request_lines(self) -> list[str]:
        """The line with the number of the request, DPRNT[REQUEST*#500[70]], where the control asks for the verdict."""
        return [] if self._request is None else [f"REQUEST{dprnt(self._request, 7, 0)}"]

    def frame(self, samples: Sequence[Sample]) -> bytes:
        """Print one point: where it should be, and where the ball was when it touched."""
        [taken] = samples
        if self._is_stopped_at(taken.index):
            return b""
        nominal = self.nominal_line(taken.index)
        if self._injector.strikes("mislabelled", taken.index):
            nominal = nominal.replace("G800", "G801")
        if self._injector.strikes("no-contact", taken.index):
            return self._quirks.bytes_of(nominal)
        return self._quirks.bytes_of(nominal, self.measured_line(taken.index, self._touched(taken)))

    def _is_stopped_at(self, index: int) -> bool:
        self._stands |= self._injector.strike("emergency-stop", index) is not None
        return self._stands

    def _touched(self, taken: Sample) -> Sequence[float]:
        """Where the centre of the ball was; that of another tool is larger, and so farther from the part."""
        self._has_other_tool |= self._injector.strike("tool-change", taken.index) is not None
        if not self._has_other_tool:
            return taken.point_mm
        return [float(value) for value in np.array(taken.point_mm) + _OTHER_TOOL_MM * self._outward[taken.index]]

    def nominal_line(self, index: int) -> str:
        """The nominal point of this number, as a post wrote it into the program."""
        x, y, z = (short(value, 4) for value in self._quirks.own(self._nominal_mm[index]).tolist())
        i, j, k = (short(value, 5) for value in self._outward[index].tolist())
        limit = short(float(self._quirks.own(0.127)), 4)
        return f"G800 N{index + 1} X{x} Y{y} Z{z} I{i} J{j} K{k} O0. U{limit} L{limit}"

    def measured_line(self, index: int, centre_mm: Sequence[float]) -> str:
        """The centre of the ball, as the control printed it."""
        x, y, z = (bare(value, 4) for value in self._quirks.own(np.array(centre_mm)).tolist())
        radius_mm = self._radius_mm + (_OTHER_TOOL_MM if self._has_other_tool else 0.0)
        return f"G801 N{index + 1} X{x} Y{y} Z{z} R{bare(float(self._quirks.own(radius_mm)), 4)}"

    def closing(self, count: int) -> bytes:
        """End the results, and switch the printer off."""
        return self._quirks.bytes_of("END" + _DC4) if self._quirks.closes and not self._stands else b""


class PrintingControl(InspectingControl):
    """Prints one line a point, as a short macro of the user's own does."""

    def opening(self, count: int) -> bytes:
        """Switch the printer on."""
        return self._quirks.bytes_of(_DC2, *self.request_lines())

    def frame(self, samples: Sequence[Sample]) -> bytes:
        """Print one point."""
        [taken] = samples
        if self._is_stopped_at(taken.index):
            return b""
        if self._injector.strikes("no-contact", taken.index):
            return b""
        return self._quirks.bytes_of(self.point_line(taken.index, self._touched(taken)))

    def point_line(self, index: int, centre_mm: Sequence[float]) -> str:
        """One point with its number: DPRNT[N#1[40]*X#2[44]*Y#3[44]*Z#4[44]]."""
        x, y, z = (dprnt(value, 4, 4) for value in self._quirks.own(np.array(centre_mm)).tolist())
        return f"N{index + 1:5d} X{x} Y{y} Z{z}"

    def closing(self, count: int) -> bytes:
        """Print a last line, and switch the printer off."""
        return self._quirks.bytes_of("M30" + _DC4) if self._quirks.closes and not self._stands else b""


class OwnLines(PrintingControl):
    """Prints lines of the user's own, as a camera or a line scanner sends them; the last one is END."""

    def __init__(
        self,
        line: str,
        nominal_mm: NDArray[np.float64],
        outward: NDArray[np.float64],
        quirks: Quirks,
        injector: Injector,
        request: int | None = None,
    ) -> None:
        """Take the line of a point with the fields number, x, y and z. Raises ValueError for one that cannot be filled in."""
        super().__init__(nominal_mm, outward, 0.0, quirks, injector, request)
        self._line = line
        try:
            self.point_line(0, (0.0, 0.0, 0.0)).encode("ascii")
        except (KeyError, IndexError, AttributeError, TypeError, ValueError) as error:
            raise ValueError(f"line {line!r}: expected ASCII with the fields number, x, y and z, like {{x:.4f}} ({error!r})") from None

    def opening(self, count: int) -> bytes:
        """A camera says nothing before its first point, unless it asks for the verdict."""
        return self._quirks.bytes_of(*self.request_lines())

    def point_line(self, index: int, centre_mm: Sequence[float]) -> str:
        """One point in the line of the user's own."""
        x, y, z = self._quirks.own(np.array(centre_mm)).tolist()
        return self._line.format(number=index + 1, x=x, y=y, z=z)

    def closing(self, count: int) -> bytes:
        """Say that this was the last point."""
        return self._quirks.bytes_of("END") if self._quirks.closes else b""


def serve(settings: SimulatorSettings, announce: Announce, control: type[InspectingControl]) -> None:
    """Probe a part and print it; the address may also be `to:host:port` or `file:PATH`. A control that asks then waits for the verdict."""
    injector = Injector(settings.faults, settings.motion.seed)
    quirks = Quirks.asked_for(injector)
    ideal = replace(settings.motion, noise_mm=0.0, form_error_mm=0.0, defect_mm=0.0, tip_radius_mm=0.0, resolution_mm=0.0)
    nominal_mm = walk(settings.path_mm, ideal).points_mm
    outward = walk(settings.path_mm, replace(ideal, tip_radius_mm=1.0)).points_mm - nominal_mm
    request = settings.request
    if request is None and settings.answer is not None:
        request = int(time.time()) % LAST_REQUEST + 1
    if control is PrintingControl and settings.line:
        refuse_answer(settings)
        if injector.expects("tool-change"):
            raise ValueError("fault 'tool-change' strikes no device that prints --line: nobody changes its tool")
        made: InspectingControl = OwnLines(settings.line, nominal_mm, outward, quirks, injector, request)
    else:
        made = control(nominal_mm, outward, settings.motion.tip_radius_mm, quirks, injector, request)
    stream(settings, made, announce, open_line=open_line_of_control)
    if settings.answer is not None and request is not None:
        stopped = f"request {request}: emergency stop: {STOPPED}"
        announce(stopped if made.stands else await_answer(settings.answer, request, settings.answer_s))


def serve_inspection(settings: SimulatorSettings, announce: Announce) -> None:
    """Serve a machine tool that prints the language of inspection."""
    serve(settings, announce, InspectingControl)


def serve_dprnt(settings: SimulatorSettings, announce: Announce) -> None:
    """Serve a machine tool that prints one line a point."""
    serve(settings, announce, PrintingControl)


DEVICES = {"machine-tool": serve_inspection, "machine-tool-dprnt": serve_dprnt}
