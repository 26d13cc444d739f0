"""The device catalogue: the one place that knows concrete devices. It turns the device of a plan into a source, a decoder and words."""

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from typing import Literal

from cmmlink.errors import PlanError
from cmmlink.line_sample import check_existing, line_decoder
from cmmlink.plan import Device, DmeDevice, FileDevice, LinesDevice, ModbusDevice, Plan, SerialDevice, SurfacePlan, map_of
from cmmlink.scratch import Scratch, scratch_in
from drivers import (
    DME_UNSEEN,
    Decoder,
    PointArraySource,
    PointFile,
    PointFileSource,
    RegisterDecoder,
    RegisterSurvey,
    ScanSource,
    axes_in,
    decoder,
    unseen_in,
)
from drivers.links.axis import Beam, ConstantFeed, FollowedAxis
from drivers.links.link_settings import LinkSettings

_NO_NORMALS = "the device gives no normals: on which side of a wall a point lies is decided by distance alone"


@dataclass(frozen=True, slots=True, eq=False)
class Connected:
    """A device made ready for one scan. `simulated` says that no real device is measured; `notes` are what was assumed about it.

    moves : a scan moves a machine, so that somebody has to look on
    trial : what tells that the device answers without moving it; None where listening to its scan does no harm
    """

    source: ScanSource
    device: str
    simulated: bool
    notes: tuple[str, ...] = ()
    moves: bool = False
    trial: ScanSource | None = None


Connect = Callable[[Plan | SurfacePlan], AbstractContextManager[Connected]]
"""Open the device of a plan for one scan, for as long as the context is entered."""


@contextmanager
def connect(plan: Plan | SurfacePlan, scratch: Scratch | None = None) -> Iterator[Connected]:
    """Make the real device of a plan ready for one scan. Raises PlanError where the plan describes none.

    scratch : gives the points of a long file their room; None takes it in the folder of the plan's records
    """
    source, device = source_of(plan, scratch), plan.device
    if isinstance(source, PointArraySource) and isinstance(device, FileDevice):
        notes = tuple(f"{device.file.name}: {note}" for note in source.notes)
    else:
        notes = (*notes_on(device), *([_NO_NORMALS] if isinstance(plan, SurfacePlan) else []))
    trial = _trial(plan, device) if isinstance(device, DmeDevice) else None
    yield Connected(source, words_of(device), simulated=False, notes=notes, moves=trial is not None, trial=trial)


def notes_on(device: Device) -> Iterator[str]:
    """Say what a device's format cannot show, and what is taken for granted of the axis that moves it."""
    if isinstance(device, FileDevice):
        return
    if isinstance(device, DmeDevice):
        yield DME_UNSEEN
        return
    if isinstance(device, LinesDevice):
        yield from (f"{device.format.name}: {words}" for words in unseen_in(device.format.name))
        yield f"the lines are taken to be in {'inches' if device.unit == 'inch' else 'millimetres'}, as the plan says (device.unit)"
        return
    if isinstance(device, SerialDevice):
        yield from (f"{device.format}: {words}" for words in unseen_in(device.format))
    elif not (registers := map_of(device.map)).counts_points:
        yield f"{registers.device}: the device counts no points, so what lay between two readings is not seen"
    if device.axis is not None and device.axis.feed_mm_s is not None:
        yield f"the axis is taken to move at {device.axis.feed_mm_s:g} mm/s all the time, and to begin at zero with the first point"
    if device.axis is not None and device.axis.follow is not None:
        yield from (f"axis: {note}" for note in notes_on(device.axis.follow))


def words_of(device: Device) -> str:
    """How results, records and pages call a device."""
    if isinstance(device, FileDevice):
        return f"file {device.file.name}"
    if isinstance(device, LinesDevice) and device.file is not None:
        return f"lines of {device.file.name}"
    return f"{device.type} {device.address}"


def source_of(plan: Plan | SurfacePlan, scratch: Scratch | None = None) -> ScanSource:
    """The source of a plan's device; a file of points is read here. Raises PlanError, PointFileError, or StoreError for want of room."""
    device, in_space = plan.device, isinstance(plan, SurfacePlan)
    if isinstance(device, FileDevice):
        room = scratch or scratch_in(plan.records.folder)
        if in_space:
            return PointArraySource(words_of(device), scan_of(device, room))
        return PointFileSource(device.file, device.scale, unit=device.unit, columns=device.columns, invalid=device.invalid, room=room)
    if in_space and len(axes := _axes_of(device)) < 3:
        raise PlanError(
            f"device: it tells {' and '.join(axes)} alone, and points on a whole surface need x, y and z; expected a device or a format "
            "that tells all three, or an axis for a sensor of distances"
        )
    try:
        if isinstance(device, LinesDevice):
            return _machine_tool(plan, device)
        return _machine(plan, device) if isinstance(device, DmeDevice) else _source_with_axis(device)
    except ValueError as error:
        raise PlanError(f"device: {error}") from None


def scan_of(device: FileDevice, room: Scratch) -> PointFile:
    """The points of a scan of a whole surface, with their normals where the file has any or a mesh tells them."""
    from drivers.scan_file import read_scan  # noqa: PLC0415 - it loads what cuts surfaces

    return read_scan(device.file, device.scale, unit=device.unit, columns=device.columns, invalid=device.invalid, room=room)


def _axes_of(device: Device) -> tuple[str, ...]:
    """Which of x, y and z a device tells. What an axis carries is placed in space by the plan."""
    if isinstance(device, FileDevice | DmeDevice) or getattr(device, "axis", None) is not None:
        return ("x", "y", "z")
    if isinstance(device, LinesDevice):
        return axes_in(device.format.name, device.format.options)
    return axes_in(device.format, device.options) if isinstance(device, SerialDevice) else map_of(device.map).axes


def decoder_of(plan: Plan | SurfacePlan) -> Decoder | None:
    """The decoder of what the device of a plan sends. None where the points themselves are recorded.

    That is so for files and for devices on an axis, and for machines: what their answers mean depends on what they were asked.
    """
    device = plan.device
    if isinstance(device, LinesDevice):
        return line_decoder(device, plan.probe.tip_radius_mm, device.parity_in_bytes)
    return None if isinstance(device, FileDevice | DmeDevice) or device.axis is not None else _decoder(device)


def _decoder(device: SerialDevice | ModbusDevice) -> Decoder:
    return _stream_decoder(device) if isinstance(device, SerialDevice) else _register_decoder(device)


def _stream_decoder(device: SerialDevice) -> Decoder:
    return decoder(device.format, **device.options)


def _register_decoder(device: ModbusDevice) -> RegisterDecoder:
    return RegisterDecoder(map_of(device.map), count=device.points)


def _source_with_axis(device: SerialDevice | ModbusDevice) -> ScanSource:
    """The source of a device. Where the plan has an axis, the source turns distances into points along it."""
    source, axis = _link(device), device.axis
    if axis is None:
        return source
    beam = Beam(axis.origin_mm, axis.distance_direction, axis.axis_direction)
    if axis.follow is not None:
        return FollowedAxis(source, _link(axis.follow), beam)
    assert axis.feed_mm_s is not None
    return ConstantFeed(source, beam, axis.feed_mm_s)


def _machine_tool(plan: Plan | SurfacePlan, device: LinesDevice) -> ScanSource:
    """The source of a machine tool's lines. A port is opened with eight data bits where it has seven: its parity is checked with them."""
    from drivers.links.growing_file import GrowingFile  # noqa: PLC0415 - for those who have one
    from drivers.links.listener import Listener  # noqa: PLC0415 - likewise
    from drivers.links.serial_scanner import SerialScanner  # noqa: PLC0415 - it loads pyserial

    checked = device.parity_in_bytes
    settings = LinkSettings(device.baud_rate, "N" if checked else device.parity, device.silence_s, device.reconnect_s)
    made = line_decoder(device, plan.probe.tip_radius_mm, checked)
    if device.file is not None:
        check_existing(device)
        return SerialScanner(GrowingFile(device.file, existing=device.existing), made, settings)
    assert device.address is not None
    return SerialScanner(Listener(device.address) if device.listen else device.address, made, settings)


def _machine(plan: Plan | SurfacePlan, device: DmeDevice) -> ScanSource:
    from cmmlink.dme_job import job_of  # noqa: PLC0415 - it loads what reads a nominal
    from drivers.links.dme_machine import DmeMachine  # noqa: PLC0415 - for those who have one

    return DmeMachine(device.address, job_of(plan, device), device.silence_s)


def _trial(plan: Plan | SurfacePlan, device: DmeDevice) -> ScanSource:
    from cmmlink.dme_job import questions_of  # noqa: PLC0415 - likewise
    from drivers.links.dme_machine import DmeMachine  # noqa: PLC0415 - likewise

    return DmeMachine(device.address, questions_of(plan, device), device.silence_s)


def _link(device: SerialDevice | ModbusDevice) -> ScanSource:
    """The source of a device's own points. Its library is loaded here, for those who need it."""
    settings = LinkSettings(device.baud_rate, device.parity, device.silence_s, device.reconnect_s)
    if isinstance(device, SerialDevice):
        from drivers.links.serial_scanner import SerialScanner  # noqa: PLC0415 - it loads pyserial

        return SerialScanner(device.address, _stream_decoder(device), settings)
    from drivers.links.modbus_scanner import ModbusScanner  # noqa: PLC0415 - it loads pymodbus

    registers = _register_decoder(device)
    return ModbusScanner(device.address, registers, settings, device_id=device.device_id, timeout_s=device.timeout_s)


Parity = Literal["N", "E", "O"]
PARITIES: tuple[Parity, ...] = ("N", "E", "O")


@dataclass(frozen=True, slots=True)
class ModbusPlace:
    """Where a Modbus device is asked for its registers: host:port, or the port of an RTU line with its speed and parity."""

    address: str
    device_id: int = 1
    baud_rate: int = 19_200
    parity: Parity = "E"


def source_of_survey(place: ModbusPlace, survey: RegisterSurvey, pause_s: float) -> ScanSource:
    """What reads registers for their own sake, with a pause between two readings of all of them. Raises PlanError for an address."""
    from drivers.links.modbus_scanner import ModbusScanner  # noqa: PLC0415 - it loads pymodbus

    settings = LinkSettings(place.baud_rate, place.parity)
    try:
        return ModbusScanner(place.address, survey, settings, device_id=place.device_id, poll_s=pause_s)
    except ValueError as error:
        raise PlanError(str(error)) from None


def serial_ports() -> list[tuple[str, str]]:
    """Name and description of every serial port that this computer has now."""
    from drivers.links.serial_scanner import ports  # noqa: PLC0415 - it loads pyserial

    return ports()
