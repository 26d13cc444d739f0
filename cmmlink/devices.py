"""The device catalogue: the one place that knows concrete devices. It turns the device of a plan into a source, a decoder and words."""

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass

from cmmlink.errors import PlanError
from cmmlink.plan import Device, FileDevice, ModbusDevice, Plan, SerialDevice
from drivers import Decoder, PointFileSource, RegisterDecoder, ScanSource, decoder, load_map
from drivers.links.axis import Beam, ConstantFeed, FollowedAxis
from drivers.links.serial_scanner import SerialScanner, ports


@dataclass(frozen=True, slots=True, eq=False)
class Connected:
    """A device made ready for one scan. `simulated` says that no real device is measured."""

    source: ScanSource
    device: str
    simulated: bool


Connect = Callable[[Plan], AbstractContextManager[Connected]]
"""Open the device of a plan for one scan, for as long as the context is entered."""


@contextmanager
def connect(plan: Plan) -> Iterator[Connected]:
    """Make the real device of a plan ready for one scan. Raises PlanError where the plan describes none."""
    yield Connected(source_of(plan), words_of(plan.device), simulated=False)


def words_of(device: Device) -> str:
    """How results, records and pages call a device."""
    return f"file {device.file.name}" if isinstance(device, FileDevice) else f"{device.type} {device.address}"


def source_of(plan: Plan) -> ScanSource:
    """The source of a plan's device; a file of points is read here. Raises PlanError or PointFileError."""
    device = plan.device
    if isinstance(device, FileDevice):
        return PointFileSource(device.file, device.scale)
    try:
        return _source_with_axis(device)
    except ValueError as error:
        raise PlanError(f"device: {error}") from None


def decoder_of(device: Device) -> Decoder | None:
    """The decoder of what a device sends. None for files and devices on an axis: of these the points themselves are recorded."""
    return None if isinstance(device, FileDevice) or device.axis is not None else _decoder(device)


def _decoder(device: SerialDevice | ModbusDevice) -> Decoder:
    if isinstance(device, SerialDevice):
        return decoder(device.format, **device.options)
    return RegisterDecoder(load_map(device.map), count=device.points)


def _source_with_axis(device: SerialDevice | ModbusDevice) -> ScanSource:
    """The source of a device; where the plan has an axis, its distances are made points on it."""
    source, axis = _link(device), device.axis
    if axis is None:
        return source
    beam = Beam(axis.origin_mm, axis.distance_direction, axis.axis_direction)
    if axis.follow is not None:
        return FollowedAxis(source, _link(axis.follow), beam)
    assert axis.feed_mm_s is not None
    return ConstantFeed(source, beam, axis.feed_mm_s)


def _link(device: SerialDevice | ModbusDevice) -> ScanSource:
    if isinstance(device, SerialDevice):
        return SerialScanner(
            device.address,
            _decoder(device),
            baud_rate=device.baud_rate,
            parity=device.parity,
            silence_s=device.silence_s,
            reconnect_s=device.reconnect_s,
        )
    from drivers.links.modbus_scanner import ModbusScanner  # noqa: PLC0415 - pymodbus is loaded for those who need it

    return ModbusScanner(
        device.address,
        load_map(device.map),
        device_id=device.device_id,
        count=device.points,
        baud_rate=device.baud_rate,
        parity=device.parity,
        timeout_s=device.timeout_s,
        silence_s=device.silence_s,
        reconnect_s=device.reconnect_s,
    )


def serial_ports() -> list[tuple[str, str]]:
    """Name and description of every serial port that this computer has now."""
    return ports()
