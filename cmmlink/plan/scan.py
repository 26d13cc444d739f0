"""The inspection plan: a YAML file, validated into an immutable model.

A plan needs four keys; everything else has the default shown. Relative paths are relative to the plan's own folder.

    part: {name: blade, serial_number: null}
    operator: null
    nominal:
      file: blade.dat               # UIUC dat, points, or NURBS yaml
      scale: 1.0                    # file units to mm: the chord, for airfoils in chord units
      closed: null                  # true, false, or null: what the file shows
      material: null                # left or right of the direction of travel; null: inside a closed profile
    tolerance:
      lower_mm: -0.05               # deviation, positive out of material
      upper_mm: 0.05
      uncertainty_mm: 0.0           # expanded uncertainty U (95 %) of one deviation, ISO 14253-1
    device:
      type: serial                  # a stream over a serial port or a TCP socket
      address: COM3                 # port name, or host:port
      format: ascii                 # ascii, binary, optoncdt, riftek, riftek-ascii
      options: {}                   # of the format, like {range_mm: 50, rate_hz: 1000, count: 5000}
      baud_rate: 115200
      parity: N                     # N, E, O
      silence_s: 5.0                # a device silent for longer has failed
      reconnect_s: 0.0              # how long a lost link is tried again
      axis: null                    # for distance sensors: {feed_mm_s: 10, origin_mm: [0, 0, 0], distance_direction: [0, 1, 0],
                                    # axis_direction: [1, 0, 0]}; or, instead of feed_mm_s, follow: {another device}
    # device:
    #   type: modbus                # registers over TCP (host:port) or RTU (a port name)
    #   address: 192.168.1.10:502
    #   map: gocator                # or generic-ring, generic-fifo, riftek-rf60x; anything else is a yaml file of yours
    #   device_id: 1
    #   points: null                # the scan ends after so many, for devices that tell no end
    #   timeout_s: 1.0              # longer than the slowest answer
    # device: {type: file, file: points.csv, scale: 1.0}    a file of points in place of a device
    probe: {tip_radius_mm: 0.0}     # above 0: the points are ball centres
    section:                        # the plane of the section in machine coordinates
      origin_mm: [0, 0, 0]
      x_axis: [1, 0, 0]             # direction, any length; what of it lies along the normal is dropped
      normal: [0, 0, 1]
      off_plane_max_mm: null        # reject points farther from the plane; null: none
    registration:
      fit: best-fit                 # best-fit, minimum-zone, none; none is also the default where a datum is given
      method: exact                 # exact, circle, chord, pcp, veaw, inversion
      datum: null                   # {rotation_deg: 0, translation_mm: [0, 0]}: known pose, nominal from section
      coverage_min: 0.95            # fraction of the nominal's length to be measured before conform is proven
      reject_outliers: false        # find gross outliers, fit without them, report them as rejected; conform is then not proven
    discretisation: {samples: 10000, pole_angle_min_deg: 178.0, step_min: 1e-4}
    buffer_points: 500000
    out: null                       # folder for the results; null: none written
    records: null                   # folder of the run records; null: the user's. A console keeps all runs in its own

A further device is a further model with its own `type`, added to the union `Device`.
"""

from collections.abc import Callable
from math import hypot
from pathlib import Path
from typing import Annotated, Any, Literal

import yaml
from pydantic import BaseModel, ConfigDict, Field, ValidationInfo, field_validator, model_validator

from cmmlink.errors import PlanError, YamlError
from cmmlink.plan.yaml_model import line_of, read_model
from drivers.codecs.register_map import shipped_maps
from drivers.errors import PointFileError
from drivers.files.point_file import read_text
from inspection import ToleranceZone

Vector = tuple[float, float, float]
Text = Annotated[str, Field(min_length=1)]
Positive = Annotated[float, Field(gt=0)]

_LEAST_SINE = 1e-3  # between x axis and normal: below it the direction of x in the plane is noise


class _Settings(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False, str_strip_whitespace=True)


class Part(_Settings):
    """What is measured."""

    name: Text = Field(description="the name of the part")
    serial_number: Text | None = None


class Nominal(_Settings):
    """The nominal profile, as load_nominal takes it, and the side of the material."""

    file: Path = Field(description="the file of the nominal profile")
    scale: Positive = 1.0
    closed: bool | None = None
    material: Literal["left", "right"] | None = None


class Tolerance(_Settings):
    """Limits of the deviation, positive out of material, and its expanded uncertainty."""

    lower_mm: float = Field(description="the lower limit of the deviation in mm, like -0.05")
    upper_mm: float = Field(description="the upper limit of the deviation in mm, like 0.05")
    uncertainty_mm: float = 0.0

    @field_validator("upper_mm")
    @classmethod
    def _above_lower(cls, upper_mm: float, info: ValidationInfo) -> float:
        lower_mm = info.data.get("lower_mm")
        if lower_mm is not None and upper_mm <= lower_mm:
            raise ValueError(f"a number above lower_mm, which is {lower_mm:g}")
        return upper_mm

    @field_validator("uncertainty_mm")
    @classmethod
    def _provable(cls, uncertainty_mm: float, info: ValidationInfo) -> float:
        if "lower_mm" in info.data and "upper_mm" in info.data:
            width = info.data["upper_mm"] - info.data["lower_mm"]
            if not 0 <= 2 * uncertainty_mm < width:
                raise ValueError(f"zero or more, and less than half the zone of {width:g} mm: more leaves nothing provable")
        return uncertainty_mm

    @property
    def zone(self) -> ToleranceZone:
        """The tolerance as the inspection takes it."""
        return ToleranceZone(self.lower_mm, self.upper_mm, self.uncertainty_mm)


class Axis(_Settings):
    """What makes points of the distances of a one-dimensional sensor: a constant feed, or a second device that tells the position."""

    origin_mm: Vector = (0.0, 0.0, 0.0)
    distance_direction: Vector = (0.0, 1.0, 0.0)
    axis_direction: Vector = (1.0, 0.0, 0.0)
    feed_mm_s: float | None = None
    follow: "Annotated[SerialDevice | ModbusDevice, Field(discriminator='type')] | None" = None

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


class SerialDevice(_Settings):
    """A device that streams over a serial port or a TCP socket, in one of the formats of drivers, with that format's options."""

    type: Literal["serial"]
    address: Text = Field(description="a port name like COM3 or /dev/ttyUSB0, or host:port")
    baud_rate: Annotated[int, Field(gt=0)] = 115200
    silence_s: Positive = 5.0
    reconnect_s: Annotated[float, Field(ge=0)] = 0.0
    format: Text = "ascii"
    options: dict[str, Annotated[int | float | str, Field(union_mode="left_to_right")]] = {}
    parity: Literal["N", "E", "O"] = "N"
    axis: Axis | None = None


class ModbusDevice(_Settings):
    """A device whose points are read from registers, over TCP (host:port) or RTU (a port name), as its map describes."""

    type: Literal["modbus"]
    address: Text = Field(description="host:port, or the port name of an RTU line")
    map: Text | dict[str, Any] = Field(description="a register map: a yaml file, or the name of a shipped one like generic-ring or gocator")
    device_id: Annotated[int, Field(ge=0, le=255)] = 1
    points: Annotated[int, Field(ge=1)] | None = None
    baud_rate: Annotated[int, Field(gt=0)] = 19200
    parity: Literal["N", "E", "O"] = "E"
    timeout_s: Positive = 1.0
    silence_s: Positive = 5.0
    reconnect_s: Annotated[float, Field(ge=0)] = 0.0
    axis: Axis | None = None

    @property
    def own_map(self) -> Path | None:
        """The file of a map that is not shipped; None also where the plan holds the map itself, as that of a record does."""
        return Path(self.map) if isinstance(self.map, str) and self.map not in shipped_maps() else None


class FileDevice(_Settings):
    """A file of points in place of a device."""

    type: Literal["file"]
    file: Path = Field(description="the file of points: csv, txt, asc, xyz or npy")
    scale: Positive = 1.0


Device = Annotated[SerialDevice | ModbusDevice | FileDevice, Field(discriminator="type")]
Axis.model_rebuild()


class Probe(_Settings):
    """The tip of the probe; a radius above zero says that the points are ball centres."""

    tip_radius_mm: Annotated[float, Field(ge=0)] = 0.0


class Section(_Settings):
    """The plane of the section in machine coordinates; directions of any length, not parallel."""

    origin_mm: Vector = (0.0, 0.0, 0.0)
    normal: Vector = (0.0, 0.0, 1.0)
    x_axis: Annotated[Vector, Field(validate_default=True)] = (1.0, 0.0, 0.0)
    off_plane_max_mm: Positive | None = None

    @field_validator("normal", "x_axis")
    @classmethod
    def _some_direction(cls, direction: Vector) -> Vector:
        if hypot(*direction) == 0:
            raise ValueError("a direction other than [0, 0, 0]")
        return direction

    @field_validator("x_axis")
    @classmethod
    def _not_along_normal(cls, x_axis: Vector, info: ValidationInfo) -> Vector:
        (a, b, c), (x, y, z) = info.data.get("normal", (0.0, 0.0, 0.0)), x_axis
        if hypot(a, b, c) > 0 and hypot(b * z - c * y, c * x - a * z, a * y - b * x) < _LEAST_SINE * hypot(a, b, c) * hypot(x, y, z):
            raise ValueError(f"a direction other than that of the normal, {list(info.data['normal'])}")
        return x_axis


class Datum(_Settings):
    """A known pose: the motion that brings section coordinates onto the nominal."""

    rotation_deg: float = 0.0
    translation_mm: tuple[float, float] = (0.0, 0.0)


class Registration(_Settings):
    """How the points come onto the nominal, and how much of it they must cover."""

    datum: Datum | None = None
    fit: Annotated[Literal["best-fit", "minimum-zone", "none"], Field(validate_default=True)] = "best-fit"
    method: Literal["exact", "circle", "chord", "pcp", "veaw", "inversion"] = "exact"
    coverage_min: Annotated[float, Field(ge=0, le=1)] = 0.95
    reject_outliers: bool = False

    @model_validator(mode="before")
    @classmethod
    def _datum_needs_no_fit(cls, given: object) -> object:
        return {"fit": "none", **given} if isinstance(given, dict) and given.get("datum") is not None else given

    @field_validator("fit")
    @classmethod
    def _datum_is_kept(cls, fit: str, info: ValidationInfo) -> str:
        if fit != "none" and info.data.get("datum") is not None:
            raise ValueError("none, or no fit at all, beside a datum: a known pose is not fitted away")
        return fit

    @field_validator("reject_outliers")
    @classmethod
    def _outliers_are_those_of_a_fit(cls, reject: bool, info: ValidationInfo) -> bool:
        if reject and info.data.get("fit") == "none":
            raise ValueError("false without a fit: outliers are found by fitting the other points")
        return reject


class Discretisation(_Settings):
    """Sampling of the nominal; see inspection.discretize."""

    samples: Annotated[int, Field(ge=8, le=400_000)] = 10_000
    pole_angle_min_deg: Annotated[float, Field(gt=0, lt=180)] = 178.0
    step_min: Annotated[float, Field(gt=0, lt=1)] = 1e-4


class Plan(_Settings):
    """One inspection: what, against what, with what, and where the results go."""

    part: Part = Field(description="a mapping with the part's name")
    operator: Text | None = None
    nominal: Nominal = Field(description="a mapping with the nominal's file")
    tolerance: Tolerance = Field(description="a mapping with lower_mm and upper_mm")
    device: Device = Field(description="a mapping with the device's type and address")
    probe: Probe = Probe()
    section: Section = Section()
    registration: Registration = Registration()
    discretisation: Discretisation = Discretisation()
    buffer_points: Annotated[int, Field(ge=1)] = 500_000
    out: Path | None = None
    records: Path | None = None

    def effective_yaml(self) -> str:
        """Spell the plan with every default filled in and every path absolute; as a plan it means the same."""
        return yaml.safe_dump(self.model_dump(mode="json"), sort_keys=False, allow_unicode=True)

    def with_address(self, address: str) -> "Plan":
        """Give the same plan with its device at another address."""
        return self.model_copy(update={"device": self.device.model_copy(update={"address": address})})


def load_plan(path: Path) -> Plan:
    """Read and check a plan. Raises PlanError: file, line, key, the value found and what is allowed."""
    try:
        text = read_text(path)
    except PointFileError as error:
        raise PlanError(str(error)) from None
    try:
        plan = read_model(text, Plan)
    except YamlError as error:
        raise PlanError(f"{path}: {error}") from None
    return _with_paths_from(path.resolve().parent, plan)


def place_of(path: Path, key: str) -> str:
    """Where a key of a plan stands, for messages about its value: file, line and key."""
    return f"{path}: line {line_of(read_text(path), key)}: {key}"


def with_own_maps(device: Device, replaced: Callable[[Path], str | dict[str, Any]]) -> Device:
    """Give the same device with the register maps of the user's own replaced: its own, and those of what its axis follows."""
    if isinstance(device, FileDevice):
        return device
    update: dict[str, Any] = {}
    if isinstance(device, ModbusDevice) and device.own_map is not None:
        update["map"] = replaced(device.own_map)
    if device.axis is not None and device.axis.follow is not None:
        update["axis"] = device.axis.model_copy(update={"follow": with_own_maps(device.axis.follow, replaced)})
    return device.model_copy(update=update)


def _with_paths_from(folder: Path, plan: Plan) -> Plan:
    """Make the paths of a plan absolute, seen from its folder."""
    device = with_own_maps(plan.device, lambda own: str(folder / own))
    if isinstance(device, FileDevice):
        device = device.model_copy(update={"file": folder / device.file})
    return plan.model_copy(
        update={
            "nominal": plan.nominal.model_copy(update={"file": folder / plan.nominal.file}),
            "device": device,
            "out": folder / plan.out if plan.out else None,
            "records": folder / plan.records if plan.records else None,
        }
    )
