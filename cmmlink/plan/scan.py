"""The inspection plan: a YAML file, validated into an immutable model.

Relative paths are relative to the plan's own folder. Every field says in its description what it means; docs/plan.md is written
from these descriptions. Its devices stand in scan_devices.
"""

import re
from collections.abc import Iterator
from contextlib import contextmanager
from math import hypot
from os import PathLike
from pathlib import Path
from typing import Any, Protocol, TypeVar

from pydantic import Field, TypeAdapter, ValidationError, ValidationInfo, field_validator, model_validator

from cmmlink.buffer import CAPACITY_POINTS
from cmmlink.errors import PlanError, YamlError
from cmmlink.plan.answer import ANSWER, Answer
from cmmlink.plan.datum import Datum
from cmmlink.plan.deciding import PROFILE, Deciding
from cmmlink.plan.keeping import RECORDS, RecordKeeping, RecordsOrFolder
from cmmlink.plan.report import REPORT, ReportSettings
from cmmlink.plan.results import OUT, Results, ResultsOrFolder
from cmmlink.plan.scan_devices import Device, FileDevice, LinesDevice, Unit, Vector, with_own_maps
from cmmlink.plan.serial_numbers import SERIAL_NUMBER, SerialNumbers
from cmmlink.plan.yaml_model import Positive, Settings, Text, line_of, read_model
from drivers import PointFileError, device_address, read_text
from inspection import FitName, Material, Method

_STOP = (
    "whether the scan is ended as soon as it is proven that the part can no longer pass; a machine that can be told so stops. A scan of "
    "such a plan that somebody ends early is not complete either"
)
_LEAST_SINE = 1e-3  # between x axis and normal: below it the direction of x in the plane is noise


class Part(Settings):
    """What is measured."""

    name: Text = Field(description="the name of the part")
    serial_number: Text | None = Field(default=None, description="the serial number of this one part; digits keep their leading zeros")


class Nominal(Settings):
    """The nominal profile, and on which side of it the material lies."""

    file: Path = Field(description="the file of the nominal profile: UIUC dat, points, NURBS yaml, or CAD: DXF, IGES, STEP")
    layer: Text | None = Field(
        default=None, description="the layer of a drawing that the profile is drawn on; null: it is not chosen by its layer"
    )
    curve: int | None = Field(
        default=None,
        ge=1,
        description="the number of the profile among the curves of a drawing, the longest being 1; null: the only closed one",
    )
    scale: Positive = Field(
        default=1.0,
        description="how many mm a unit of the file is; for an airfoil the chord in mm; 1 leaves the unit of a drawing to its file",
    )
    unit: Unit = Field(default=None, description="the unit of the file in words, in place of scale: mm, um or inch")
    closed: bool | None = Field(default=None, description="whether the profile is closed; null: as the file shows; a blunt edge is closed")
    material: Material | None = Field(
        default=None, description="the side of the material, seen along the direction of travel; null: inside a closed profile"
    )


class Probe(Settings):
    """The tip of the probe."""

    tip_radius_mm: float = Field(default=0.0, ge=0, description="the radius of the tip's ball; above 0, the points are ball centres")


class Section(Settings):
    """The plane of the section in machine coordinates; directions of any length, not parallel."""

    origin_mm: Vector = Field(default=(0.0, 0.0, 0.0), description="a point of the plane, which becomes the section's origin")
    normal: Vector = Field(default=(0.0, 0.0, 1.0), description="the direction of the plane's normal, of any length")
    x_axis: Vector = Field(
        default=(1.0, 0.0, 0.0),
        validate_default=True,
        description="the direction of the section's x axis, of any length; what of it lies along the normal is dropped",
    )
    off_plane_max_mm: Positive | None = Field(
        default=None, description="the distance from the plane beyond which a point is rejected; null: no point is rejected for it"
    )

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


class Registration(Settings):
    """How the points come onto the nominal, and how much of it they must cover."""

    datum: Datum | None = Field(default=None, description="a known pose, from section to nominal; null: the pose is found by a fit")
    fit: FitName = Field(
        default="best-fit",
        validate_default=True,
        description="how the pose is found; none is also the default where a datum is given",
    )
    method: Method = Field(default="exact", description="how deviations are found: exact, or one of the published approximations")
    coverage_min: float = Field(
        default=0.95, ge=0, le=1, description="the share of the nominal's length that must be measured before conform is proven"
    )
    reject_outliers: bool = Field(
        default=False, description="find gross outliers, fit without them and report them as rejected; conform is then not proven"
    )

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
            raise ValueError("false where fit is none: outliers are found by fitting the other points")
        return reject


class Discretisation(Settings):
    """How finely the nominal is sampled."""

    samples: int = Field(default=10_000, ge=8, le=400_000, description="the number of samples to begin with, even in the parameter")
    pole_angle_min_deg: float = Field(default=178.0, gt=0, lt=180, description="samples are added until every pole angle is at least this")
    step_min: float = Field(default=1e-4, gt=0, lt=1, description="the smallest step between samples, as a share of the parameter's range")


Operator: TypeAdapter[str | None] = TypeAdapter(Text | None)


class Plan(Deciding):
    """One inspection: what, against what, with what, and where the results go."""

    part: Part = Field(description="a mapping with the part's name")
    operator: Text | None = Field(default=None, description="who measures")
    serial_number: SerialNumbers | None = Field(default=None, description=SERIAL_NUMBER)
    nominal: Nominal = Field(description="a mapping with the nominal's file")
    device: Device = Field(description="a mapping with the device's type and address")
    stop_when_failed: bool = Field(default=False, description=_STOP)
    probe: Probe = Field(default=Probe(), description="the tip of the probe")
    section: Section = Field(default=Section(), description="the plane of the section in machine coordinates")
    registration: Registration = Field(default=Registration(), description="how the points come onto the nominal")
    discretisation: Discretisation = Field(default=Discretisation(), description="how finely the nominal is sampled")
    buffer_points: int = Field(default=CAPACITY_POINTS, ge=1, description="how many points may wait between the device and the inspection")
    out: ResultsOrFolder = Field(default=Results(), description=OUT)
    answer: Answer | None = Field(default=None, description=ANSWER)
    report: ReportSettings = Field(default=ReportSettings(), description=REPORT)
    records: RecordsOrFolder = Field(default=RecordKeeping(), description=RECORDS)

    @field_validator("serial_number")
    @classmethod
    def _spelled_so(cls, asked: SerialNumbers | None, info: ValidationInfo) -> SerialNumbers | None:
        return spelled_as(asked, info.data.get("part"))

    @field_validator("answer")
    @classmethod
    def _can_be_asked_for(cls, answer: Answer | None, info: ValidationInfo) -> Answer | None:
        device: Device | None = info.data.get("device")
        if answer is None or device is None:
            return answer
        if not isinstance(device, LinesDevice):
            raise ValueError("an answer only beside a device of type lines: no other tells which request it answers")
        if not device.format.tells_request:
            raise ValueError("device.format.request beside a pattern, so that the machine can tell an answer from an earlier one")
        known = [*([PROFILE] if info.data.get("tolerance") else []), *(asked.name for asked in info.data.get("characteristics", ()))]
        if unknown := [name for name in answer.characteristics if name not in known]:
            raise ValueError(f"characteristics of this plan; {unknown[0]} is none of {', '.join(known)}")
        return answer

    def with_part(self, serial_number: str, operator: str | None = None) -> "Plan":
        """Give the same plan for one part, and who measures it. Raises PlanError for a serial number that it does not allow.

        operator : None leaves the plan's
        """
        return part_given(self, serial_number, operator)

    def with_address(self, address: str) -> "Plan":
        """Give the same plan with its device at another address. Raises PlanError for an address that is none."""
        return address_given(self, address)

    @property
    def nominal_file(self) -> Path:
        """The file of the nominal."""
        return self.nominal.file

    def with_nominal_file(self, file: Path) -> "Plan":
        """Give the same plan with its nominal in another file."""
        return self.model_copy(update={"nominal": self.nominal.model_copy(update={"file": file})})

    @property
    def has_address(self) -> bool:
        """Whether the device is reached at an address, and not read from a file."""
        return getattr(self.device, "address", None) is not None


class _OfOnePart(Protocol):
    """A plan that one part at a time is measured by, with a device."""

    @property
    def serial_number(self) -> SerialNumbers | None: ...
    @property
    def part(self) -> Part: ...
    @property
    def operator(self) -> str | None: ...
    @property
    def device(self) -> Device: ...
    def model_copy(self, *, update: dict[str, Any]) -> Any: ...


OfOnePart = TypeVar("OfOnePart", bound=_OfOnePart)


def spelled_as(asked: SerialNumbers | None, part: Part | None) -> SerialNumbers | None:
    """What a plan asks of serial numbers, which that of its own part has. Raises ValueError where it has not."""
    if asked is not None and part is not None and part.serial_number and (problem := asked.problem_with(part.serial_number)):
        raise ValueError(f"a pattern that part.serial_number has: {problem}")
    return asked


def part_given(plan: OfOnePart, serial_number: str, operator: str | None) -> OfOnePart:
    """The same plan for one part, and who measures it; None leaves who does in the plan. Raises PlanError."""
    problem = plan.serial_number.problem_with(serial_number) if plan.serial_number is not None else ""
    if problem:
        raise PlanError(problem)
    given = {"name": plan.part.name, "serial_number": serial_number or None}
    try:
        part, who = Part.model_validate(given), Operator.validate_python(plan.operator if operator is None else operator or None)
    except ValidationError:
        raise PlanError("a serial number and the name of an operator are printable text on one line") from None
    found: OfOnePart = plan.model_copy(update={"part": part, "operator": who})
    return found


def address_given(plan: OfOnePart, address: str) -> OfOnePart:
    """The same plan with its device at another address. Raises PlanError for an address that is none."""
    try:
        device_address(address)
    except ValueError as error:
        raise PlanError(str(error)) from None
    found: OfOnePart = plan.model_copy(update={"device": plan.device.model_copy(update={"address": address})})
    return found


def load_plan(path: str | PathLike[str]) -> Plan:
    """Read and check a plan. Raises PlanError: file, line, key, the value found and what is allowed."""
    path = Path(path)
    try:
        text = read_text(path)
    except PointFileError as error:
        raise PlanError(str(error)) from None
    try:
        plan = read_model(text, Plan).named(path.name)
    except YamlError as error:
        raise PlanError(f"{path}: {error}") from None
    plan = _with_paths_from(path.resolve().parent, plan)
    with naming(path, "registration.datum.result"):
        return plan.model_copy(update={"registration": with_fixture(plan.registration, plan.nominal.file)})


def with_fixture(registration: Registration, nominal: Path) -> Registration:
    """The registration with the pose of the run that its datum names, if it names one. Raises ValueError for one that cannot be."""
    datum = registration.datum
    return registration if datum is None else registration.model_copy(update={"datum": datum.taken_over(nominal)})


@contextmanager
def naming(path: Path, key: str) -> Iterator[None]:
    """Turn a ValueError about a key's value into a PlanError with file, line and key."""
    try:
        yield
    except ValueError as error:
        raise PlanError(f"{place_of(path, key)}: {error}") from None


def place_of(path: Path, key: str) -> str:
    """Where a key of a plan stands, for messages about its value: file, line and key; that of an item of a list ends in its number."""
    shown = re.sub(r"[.]([0-9]+)", r"[\1]", key)
    return f"{path}: line {line_of(read_text(path), key)}: {shown}"


def _with_paths_from(folder: Path, plan: Plan) -> Plan:
    """Make the paths of a plan absolute, seen from its folder."""
    datum = plan.registration.datum
    if datum is not None and datum.result is not None:
        datum = datum.model_copy(update={"result": folder / datum.result})
    return plan.model_copy(
        update={
            "registration": plan.registration.model_copy(update={"datum": datum}),
            "nominal": plan.nominal.model_copy(update={"file": folder / plan.nominal.file}),
            "device": device_from(folder, plan.device),
            "out": plan.out.with_path_from(folder),
            "answer": None if plan.answer is None else plan.answer.model_copy(update={"file": folder / plan.answer.file}),
            "records": plan.records.with_path_from(folder),
            "report": plan.report.with_path_from(folder),
        }
    )


def device_from(folder: Path, device: Device) -> Device:
    """The device of a plan with its paths absolute, seen from a folder."""
    device = with_own_maps(device, lambda own: str(folder / own))
    if isinstance(device, FileDevice):
        device = device.model_copy(update={"file": folder / device.file})
    elif isinstance(device, LinesDevice):
        sample = None if device.format.sample is None else folder / device.format.sample
        file = None if device.file is None else folder / device.file
        device = device.model_copy(update={"file": file, "format": device.format.model_copy(update={"sample": sample})})
    return device
