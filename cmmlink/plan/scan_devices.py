"""The devices that an inspection plan may name, each a model with its own `type`; a further device is a further model in `Device`."""

from collections.abc import Callable
from math import hypot
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, Field, ValidationInfo, field_validator, model_validator

from cmmlink.plan.dme import DmeSettings
from cmmlink.plan.lines import LinesSettings
from cmmlink.plan.yaml_model import Positive, Settings, Text
from drivers import AxisName, HostPort, UnitName, device_address, shipped_maps

Vector = tuple[float, float, float]


def _address(text: str) -> str:
    try:
        device_address(text)
    except ValueError:
        raise ValueError("host:port, or the name of a serial port of this computer, like COM3 or /dev/ttyUSB0") from None
    return text


Address = Annotated[Text, AfterValidator(_address)]

_SILENCE = "how long a device may send nothing before it counts as failed"
_RECONNECT = "how long a lost link is tried again while the run goes on"
_PARITY = "the parity of a serial port: none, even or odd"
_AXIS = "what makes points of the distances of a one-dimensional sensor"


def _in_place_of_scale(unit: UnitName | None, info: ValidationInfo) -> UnitName | None:
    """A unit in words, refused where a scale is given as well."""
    if unit is not None and info.data.get("scale", 1.0) != 1.0:
        raise ValueError("either unit or scale")
    return unit


Unit = Annotated[UnitName | None, AfterValidator(_in_place_of_scale)]


class Axis(Settings):
    """How the distances of a one-dimensional sensor become points: by a constant feed, or by a second device that measures the position."""

    origin_mm: Vector = Field(default=(0.0, 0.0, 0.0), description="where a distance of zero lies while the axis stands at zero")
    distance_direction: Vector = Field(default=(0.0, 1.0, 0.0), description="the direction in which distances grow, of length 1")
    axis_direction: Vector = Field(default=(1.0, 0.0, 0.0), description="the direction in which the axis moves the sensor, of length 1")
    feed_mm_s: float | None = Field(default=None, description="the constant speed of the axis, timed by the sensor's own clock")
    follow: "Annotated[SerialDevice | ModbusDevice, Field(discriminator='type')] | None" = Field(
        default=None, description="a second device, in place of feed_mm_s, whose x is the position of the axis"
    )

    @field_validator("distance_direction", "axis_direction")
    @classmethod
    def _unit(cls, direction: Vector) -> Vector:
        if abs(hypot(*direction) - 1.0) > 1e-6:
            raise ValueError("a direction of length 1, like [0, 1, 0]")
        return direction

    @model_validator(mode="after")
    def _one_of_two(self) -> "Axis":
        if (self.feed_mm_s is None) == (self.follow is None):
            raise ValueError("either feed_mm_s or follow")
        return self


class SerialDevice(Settings):
    """A device that streams over a serial port or a TCP socket, in one of the formats of drivers, with that format's options."""

    type: Literal["serial"] = Field(description="a stream over a serial port or a TCP socket")
    address: Address = Field(description="a port name like COM3 or /dev/ttyUSB0, or host:port")
    baud_rate: int = Field(default=115200, gt=0, description="the speed of a serial port in bits per second")
    silence_s: Positive = Field(default=5.0, description=_SILENCE)
    reconnect_s: float = Field(default=0.0, ge=0, description=_RECONNECT)
    format: Text = Field(default="ascii", description="how points are spelled on the wire, like ascii, binary or optoncdt")
    options: dict[str, Annotated[int | float | str, Field(union_mode="left_to_right")]] = Field(
        default_factory=dict, description="options of the format, like {range_mm: 50, rate_hz: 1000, count: 5000}"
    )
    parity: Literal["N", "E", "O"] = Field(default="N", description=_PARITY)
    axis: Axis | None = Field(default=None, description=_AXIS)


class ModbusDevice(Settings):
    """A device whose points are read from registers, over TCP (host:port) or RTU (a port name), as its map describes."""

    type: Literal["modbus"] = Field(description="registers over TCP or RTU")
    address: Address = Field(description="an address host:port, or the port name of an RTU line")
    map: Text | dict[str, Any] = Field(description="a register map: a yaml file, or the name of a shipped one like generic-ring or gocator")
    device_id: int = Field(default=1, ge=0, le=255, description="the unit identifier of the device on its line")
    points: Annotated[int, Field(ge=1)] | None = Field(
        default=None, description="the number of points after which the scan ends, for devices that do not tell an end"
    )
    baud_rate: int = Field(default=19200, gt=0, description="the speed of an RTU line in bits per second")
    parity: Literal["N", "E", "O"] = Field(default="E", description=_PARITY)
    timeout_s: Positive = Field(default=1.0, description="how long an answer is waited for; longer than the slowest answer")
    silence_s: Positive = Field(default=5.0, description=_SILENCE)
    reconnect_s: float = Field(default=0.0, ge=0, description=_RECONNECT)
    axis: Axis | None = Field(default=None, description=_AXIS)

    @property
    def own_map(self) -> Path | None:
        """The file of a map that is not shipped; None also where the plan holds the map itself, as that of a record does."""
        return Path(self.map) if isinstance(self.map, str) and self.map not in shipped_maps() else None


class DmeDevice(DmeSettings):
    """A coordinate measuring machine that an I++ DME server moves and reads."""

    type: Literal["dme"] = Field(description="a coordinate measuring machine behind an I++ DME server")
    address: Address = Field(description="host:port of the server; the usual port is 1294")


class LinesDevice(LinesSettings):
    """A machine tool that prints touched points as lines of text, over a serial port, over TCP, or into a file that grows."""

    type: Literal["lines"] = Field(description="a machine tool that prints touched points as lines of text")
    address: Address | None = Field(default=None, description="a port name like COM3 or /dev/ttyUSB0, or host:port; null beside a file")

    @model_validator(mode="after")
    def _one_place(self) -> "LinesDevice":
        if (self.address is None) == (self.file is None):
            raise ValueError("either an address or a file")
        if self.listen and not isinstance(device_address(self.address or ""), HostPort):
            raise ValueError("listen beside an address host:port only")
        return self

    @property
    def parity_in_bytes(self) -> str:
        """The parity that comes as the eighth bit of each byte: that of a serial port with seven data bits. Nothing where none comes."""
        is_port = self.address is not None and isinstance(device_address(self.address), str)
        return {"E": "even", "O": "odd", "N": ""}[self.parity] if is_port and self.data_bits == 7 else ""


class FileDevice(Settings):
    """A file of points in place of a device."""

    type: Literal["file"] = Field(description="a file of points in place of a device")
    file: Path = Field(
        description="the file of points: csv, txt, asc, xyz or npy; of a whole surface also PLY, STL or OBJ, whose vertices are the points"
    )
    scale: Positive = Field(default=1.0, description="how many mm a unit of the file is")
    unit: Unit = Field(
        default=None,
        description="the unit of the file in words, in place of scale: mm, um or inch; null: mm, unless the file says otherwise",
    )
    columns: dict[AxisName, Annotated[int, Field(ge=1)]] | None = Field(
        default=None,
        description="the columns of x, y and z, counted from 1, like {x: 2, y: 3}; null: as the file names them, or the first",
    )
    invalid: tuple[float, ...] = Field(
        default=(), description="values of a coordinate that mean no point, as they stand in the file, like [-9999]; such rows are rejected"
    )


Device = Annotated[SerialDevice | ModbusDevice | DmeDevice | LinesDevice | FileDevice, Field(discriminator="type")]
Axis.model_rebuild()


def with_own_maps(device: Device, replaced: Callable[[Path], str | dict[str, Any]]) -> Device:
    """Return the device with the user's own register maps replaced, also in the device that its axis follows."""
    if isinstance(device, FileDevice | DmeDevice | LinesDevice):
        return device
    update: dict[str, Any] = {}
    if isinstance(device, ModbusDevice) and device.own_map is not None:
        update["map"] = replaced(device.own_map)
    if device.axis is not None and device.axis.follow is not None:
        update["axis"] = device.axis.model_copy(update={"follow": with_own_maps(device.axis.follow, replaced)})
    return device.model_copy(update=update)
