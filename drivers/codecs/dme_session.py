"""A session with an I++ DME server, from StartSession to the last point of the last scan, without any input or output.

The session is a script: each command it yields goes out once the one before is complete, and it gets back what the server said to it.
What is asked of the machine stands in `DmeJob`. The script begins by ending a session that a lost client left behind, asks what machine,
tool and coordinate system it has, and refuses to measure with a tip whose radius is not the plan's. The default report of scans is
never relied on: servers differ in it.
"""

from collections.abc import Generator
from dataclasses import dataclass, field

from drivers.codecs.dme_commands import MOVE, command_line
from drivers.codecs.dme_lines import EVENT_TAG, LineReader, MachineError, Response, error_in, number_in, values_in
from drivers.codecs.dme_points import PointCheck, PointReader
from drivers.errors import DeviceRefused
from drivers.source import Arrival, Damaged, Heartbeat, ScanClosed, ScanOpened

DME_UNSEEN = "I++ DME: points carry neither a checksum nor a number, so a point that the machine does not send shows only as a gap"

_LAST_TAG = 99_999
_LONGEST_ANSWER = 200  # of what is told on: a place of six numbers has half as many characters
_COLUMNS = (("X", "Y", "Z", "IJK", "Q", "ER"), ("X", "Y", "Z", "Q"), ("X", "Y", "Z"))
_ABORT_TAG = "E0001"


@dataclass(frozen=True, slots=True)
class DmeJob:
    """What is asked of the machine.

    tool                the tool to measure with; None: the one that is there
    home                whether a machine that is not homed may be sent home, which moves it
    coordinate_system   the coordinate system to measure in; None: the active one
    check               what a point has to be like
    settings            further properties to set, like Tool.PtMeasPar.Speed(5)
    preparations        commands before the scans: hints and densities
    scans               the scans or single points, in their order, with the moves before them
    single_points       the scans are single points, which are reported by their names
    """

    check: PointCheck
    scans: tuple[str, ...]
    tool: str | None = None
    home: bool = False
    coordinate_system: str | None = None
    settings: tuple[str, ...] = ()
    preparations: tuple[str, ...] = ()
    single_points: bool = False


@dataclass(slots=True)
class _Reply:
    """What the server said to one command."""

    data: list[str] = field(default_factory=list)
    errors: list[MachineError] = field(default_factory=list)

    @property
    def breakdown(self) -> MachineError | None:
        """The first error by which the machine gave up; the others follow from it."""
        return next((error for error in self.errors if error.is_breakdown), None)

    def value(self, name: str) -> str:
        """The value of this name among the answers, without its quotes; nothing where there is none."""
        for line in self.data:
            told = values_in(line)
            if told and name in told:
                return told[name].strip('"')[:_LONGEST_ANSWER]
        return ""


_Script = Generator[str, _Reply, None]


class DmeSession:
    """Bytes of an I++ DME server to arrivals, and what has to be said to it meanwhile."""

    def __init__(self, job: DmeJob) -> None:
        self._job = job
        self._lines = LineReader()
        self._points = PointReader(job.check, _COLUMNS[0])
        self._out = self._points.out
        self._script = self._run()
        self._outgoing = b""
        self._number = 0
        self._tag = self._command = ""
        self._acknowledged = self._is_scan = False
        self._called_off = self._has_stopped = False  # asked to give up; the machine has
        self._radius_known = False
        self._reply = _Reply()
        self.is_over = False  # nothing more is expected of the server
        self._send(next(self._script))

    def request(self) -> bytes:
        """Return what has to be sent now."""
        outgoing, self._outgoing = self._outgoing, b""
        return outgoing

    def feed(self, data: bytes) -> list[Arrival]:
        """Take the next bytes. Raises DeviceRefused where the machine gave up; what came before it is still to be taken by `break_off`."""
        for line in self._lines.feed(data):
            if isinstance(line, Damaged):
                self._points.drop_held()
                self._points.damage(line.byte_count, line.reason)
            else:
                self._take(line)
        return self._out.hand_over()

    def break_off(self) -> list[Arrival]:
        """Account for what was begun when the link ended or the machine gave up."""
        self._points.drop_held()
        for damage in self._lines.break_off():
            self._out.append(damage)
        return self._out.hand_over()

    def call_off(self) -> None:
        """Have the machine give up what it does, and end the session."""
        if self.is_over or self._called_off or self._out.closed:
            return
        self._called_off = True
        self._outgoing += command_line(_ABORT_TAG, "AbortE()")

    def _run(self) -> _Script:
        """The whole session, command by command."""
        yield from self._start()
        version = (yield "GetDMEVersion()").value("DMEVersion")
        kind = (yield "GetMachineClass()").value("GetMachineClass")
        yield from self._home()
        tool = yield from self._take_tool()
        system = yield from self._choose_system()
        yield from self._check_radius(tool)
        for setting in self._job.settings:
            self._require_taken((yield f"SetProp({setting})"), setting)
        yield from self._choose_columns()
        for preparation in self._job.preparations:
            yield from self._insist(preparation)
        told = f"I++ DME {version or 'of unknown version'}, {kind or 'unknown class'}, tool {tool or 'without a name'}, {system}"
        if not (self._radius_known or "ER" in self._points.columns):
            told += ", the radius of whose tip it does not tell"
        self._out.append(ScanOpened(told, "", len(self._job.scans) if self._job.single_points else None))
        yield from self._scan_all()
        self._out.append(ScanClosed(None))
        yield "EndSession()"

    def _scan_all(self) -> _Script:
        """Carry out every scan, and every move before one; of several it is told which one the machine gave up."""
        count, number = sum(not command.startswith(MOVE) for command in self._job.scans), 1
        for command in self._job.scans:
            is_scan = not command.startswith(MOVE)
            which = "" if count == 1 else f" {number} of {count}" if is_scan else f" before scan {number} of {count}"
            yield from self._insist(command, is_scan=is_scan, which=which)
            number += is_scan

    def _start(self) -> _Script:
        """Start a session; one that a lost client left behind is ended first."""
        reply = yield "StartSession()"
        if reply.breakdown is not None:  # 0008 by the specification; servers say 0507 as well
            yield "EndSession()"
            reply = yield "StartSession()"
        self._require(reply, "StartSession()")

    def _home(self) -> _Script:
        reply = yield from self._ask("IsHomed()")
        if reply.value("IsHomed") == "1":
            return
        if not self._job.home:
            raise DeviceRefused("the machine is not homed; home it, or let it be sent home, which moves it: device.home: true")
        yield from self._insist("Home()")

    def _take_tool(self) -> Generator[str, _Reply, str]:
        """Change to the tool of the plan where another is there; return the name of the one that is."""
        name = (yield from self._ask("GetProp(Tool.Name())")).value("Tool.Name")
        if self._job.tool is None or name == self._job.tool:
            return name
        yield from self._insist(f'ChangeTool("{self._job.tool}")')
        name = (yield from self._ask("GetProp(Tool.Name())")).value("Tool.Name")
        if name and name != self._job.tool:
            raise DeviceRefused(f"the machine took tool {name!r} in place of {self._job.tool!r}")
        return name or self._job.tool

    def _choose_system(self) -> Generator[str, _Reply, str]:
        """Choose the coordinate system of the plan; return words for the one that is active and where it lies."""
        if self._job.coordinate_system is not None:
            yield from self._insist(f"SetCoordSystem({self._job.coordinate_system})")
        name = (yield from self._ask("GetCoordSystem()")).value("CoordSystem")
        if self._job.coordinate_system is not None and name and name != self._job.coordinate_system:
            raise DeviceRefused(f"the machine measures in {name}, not in {self._job.coordinate_system}")
        if name != "PartCsy":
            return name or "an unknown coordinate system"
        place = (yield from self._ask("GetCsyTransformation(PartCsy)")).value("GetCsyTransformation")
        return f"PartCsy at {place}" if place else "PartCsy"

    def _check_radius(self, tool: str) -> _Script:
        """Refuse a tip whose radius is not the plan's. A machine that does not tell it here may tell it with every point."""
        told = (yield from self._ask("GetProp(Tool.AvrRadius())")).value("Tool.AvrRadius")
        radius_mm, check = number_in(told), self._job.check
        self._radius_known = radius_mm is not None
        if radius_mm is not None and abs(radius_mm - check.tip_radius_mm) > check.radius_tolerance_mm:
            raise DeviceRefused(
                f"by the machine the tip of tool {tool or 'without a name'} has a radius of {radius_mm:g} mm, by the plan "
                f"{check.tip_radius_mm:g} mm; put the right tool, or its radius under probe.tip_radius_mm"
            )

    def _choose_columns(self) -> _Script:
        """Ask for as much about every point as the machine tells, and for its place at least."""
        report = "OnPtMeasReport" if self._job.single_points else "OnScanReport"
        for columns in _COLUMNS:
            command = f"{report}({', '.join(f'{name}()' for name in columns)})"
            reply = yield command
            self._points.columns = columns
            if reply.breakdown is None:
                return
            if columns == _COLUMNS[-1]:
                self._require(reply, command)
            yield "ClearAllErrors()"

    def _ask(self, question: str) -> Generator[str, _Reply, _Reply]:
        """Ask what a machine need not know; its errors are cleared."""
        reply = yield question
        if reply.breakdown is not None:
            yield "ClearAllErrors()"
        return reply

    def _insist(self, command: str, *, is_scan: bool = False, which: str = "") -> _Script:
        """Give a command that has to be carried out."""
        self._is_scan = is_scan
        reply = yield command
        self._is_scan = False
        self._points.end_scan()
        self._require(reply, command, which)

    def _require(self, reply: _Reply, command: str, which: str = "") -> None:
        if reply.breakdown is not None:
            raise DeviceRefused(f"the machine gave up {command.partition('(')[0]}{which}: {reply.breakdown.words}")

    def _require_taken(self, reply: _Reply, setting: str) -> None:
        """Raise DeviceRefused where a property is not as it was to be: of one out of range a server only warns."""
        if reply.errors:
            raise DeviceRefused(f"the machine does not take {setting}: {reply.errors[0].words}")

    def _send(self, command: str) -> None:
        self._number = self._number % _LAST_TAG + 1
        self._tag, self._command, self._acknowledged, self._reply = f"{self._number:05d}", command, False, _Reply()
        self._outgoing += command_line(self._tag, command)

    def _take(self, line: Response) -> None:
        """Take one sound line."""
        if line.tag == EVENT_TAG:
            self._take_event(line)
        elif line.tag == _ABORT_TAG and self._called_off:
            self._take_abort(line)
        elif line.tag != self._tag or self.is_over:
            self._points.drop_held()
            self._points.damage(line.size, "answer to a command that was not sent")
        elif line.sign == "&":
            self._acknowledged = True
            self._out.append(Heartbeat())
        elif not self._acknowledged:
            self._points.damage(line.size, "answer before the command was acknowledged")
        elif line.sign == "#":
            self._take_data(line.data)
        elif line.sign == "!":
            self._take_error(line.data)
        else:
            self._complete()

    def _take_data(self, data: str) -> None:
        if not self._is_scan:
            self._reply.data.append(data)
        elif self._job.single_points:
            self._points.take_measured_point(data)
        else:
            self._points.take_scan_line(data)

    def _take_error(self, data: str) -> None:
        error = error_in(data)
        if error is None:
            self._points.damage(len(data), "error that cannot be read")
            error = MachineError(3, 511, "", f"an error that cannot be read: {data:.80}")
        self._reply.errors.append(error)

    def _complete(self) -> None:
        """Go on with the script, unless the run was called off."""
        self._out.append(Heartbeat())
        if self._called_off and not self._has_stopped:
            return
        try:
            self._send(self._script.send(self._reply))
        except StopIteration:
            self.is_over = True

    def _take_event(self, line: Response) -> None:
        """Take what the server says of its own: an emergency stop and a tool changed by hand end the run."""
        error = error_in(line.data) if line.sign == "!" else None
        if error is not None and error.is_breakdown and not self._called_off:
            raise DeviceRefused(f"the machine stopped: {error.words}")
        told = values_in(line.data) if line.sign == "#" else None
        if told and {"ChangeTool", "SetTool"} & set(told) and not self._called_off and self._command != f'ChangeTool("{self._job.tool}")':
            name = told.get("ChangeTool", told.get("SetTool", "")).strip('"')
            raise DeviceRefused(f"the tool was changed to {name} by hand while the machine measured; measure again")
        self._out.append(Heartbeat())

    def _take_abort(self, line: Response) -> None:
        """After its own completion the machine may be spoken to again: clear what the abort left, and end the session."""
        if line.sign != "%" or self._has_stopped:
            return
        self._has_stopped = True
        self._points.drop_held()
        self._script = self._farewell()
        self._send(next(self._script))

    def _farewell(self) -> _Script:
        yield "ClearAllErrors()"
        yield "EndSession()"
