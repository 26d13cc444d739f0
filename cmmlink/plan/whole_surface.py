"""The plan of a scan of a whole surface: a YAML file, validated into an immutable model.

Its `surface` stands in the place that `nominal` has in a plan of one section; device, folders and records are as there.
Relative paths are relative to the plan's own folder. Every field says in its description what it means; docs/surface-plan.md is written
from these descriptions.
"""

from math import hypot
from os import PathLike
from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field, ValidationInfo, field_validator

from cmmlink.buffer import CAPACITY_POINTS
from cmmlink.errors import PlanError, YamlError
from cmmlink.plan.deciding import Tolerance
from cmmlink.plan.dme import CurveScan, PointsScan
from cmmlink.plan.keeping import RECORDS, RecordKeeping, RecordsOrFolder
from cmmlink.plan.report import REPORT, ReportSettings
from cmmlink.plan.results import OUT, Results, ResultsOrFolder
from cmmlink.plan.scan import Part, Probe, address_given, device_from, part_given, spelled_as
from cmmlink.plan.scan_devices import Device, DmeDevice, Unit, Vector
from cmmlink.plan.serial_numbers import SERIAL_NUMBER, SerialNumbers
from cmmlink.plan.spelled import Spelled
from cmmlink.plan.surface_fits import SurfaceFit
from cmmlink.plan.uncertainty import DECISION_RULE
from cmmlink.plan.yaml_model import Positive, Settings, Text, read_model
from drivers import PointFileError, mm_per, read_text
from inspection import DecisionRule, ToleranceZone

FreedomName = Literal["x", "y", "z", "rx", "ry", "rz"]

_LENGTHS = 1e-6  # how far rows of a rotation may be from length 1 and from right angles: results print all digits, people six


class SurfaceNominal(Settings):
    """The nominal surface."""

    file: Path = Field(
        description="the file of the nominal surface: CAD (STEP, IGES), a mesh (STL, PLY, OBJ), or a cloud of points (PLY, xyz, asc, npy)"
    )
    scale: Positive = Field(default=1.0, description="how many mm a unit of a mesh or a cloud is; CAD files state their own unit")
    unit: Unit = Field(default=None, description="the unit of a mesh or a cloud in words, in place of scale: mm, um or inch")
    chord_mm: Annotated[float, Field(ge=0)] | None = Field(
        default=None,
        description="of a mesh the chord tolerance with which it was exported from CAD, which counts against every verdict as U does; "
        "null: the mesh is the nominal itself. Of CAD how far triangles may lie off trimmed faces; null: 0.001",
    )

    @property
    def mm_per_unit(self) -> float:
        """How many mm a unit of the file is."""
        return mm_per(self.unit) if self.unit else self.scale


class Pose(Settings):
    """Where the scan lies on the nominal: a rotation about zero, then a translation."""

    rotation: tuple[Vector, Vector, Vector] = Field(description="the rotation as a matrix, row by row")
    translation_mm: Vector = Field(description="the translation after it")

    @field_validator("rotation")
    @classmethod
    def _is_rotation(cls, rows: tuple[Vector, Vector, Vector]) -> tuple[Vector, Vector, Vector]:
        (a, b, c) = rows
        angles = [sum(x * y for x, y in zip(one, other, strict=True)) for one, other in ((a, b), (a, c), (b, c))]
        turned = (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])
        right_handed = sum(x * y for x, y in zip(turned, c, strict=True)) > 0
        if any(abs(hypot(*row) - 1) > _LENGTHS for row in rows) or any(abs(angle) > _LENGTHS for angle in angles) or not right_handed:
            raise ValueError("three rows of length 1 at right angles to each other, right-handed")
        return rows


class SurfacePlacing(Settings):
    """How the scan comes onto the nominal, and how much of it must be covered."""

    fit: SurfaceFit = Field(
        default="best-fit",
        description="how the pose is found; none: the scan lies as start says, or in the coordinates of the nominal where there is none",
    )
    start: Pose | None = Field(
        default=None, description="the pose from scan to nominal that the fit begins with; null: it is sought, of a scan of the whole part"
    )
    locked: tuple[FreedomName, ...] = Field(
        default=(), description="shifts and turns in the coordinates of the nominal that stay as start has them, like [z, rx]"
    )
    coverage_min: float = Field(
        default=0.95, ge=0, le=1, description="the share of the nominal's area that must be measured before conform is proven"
    )
    reject_outliers: bool = Field(
        default=False, description="find gross outliers, fit without them and report them as rejected; conform is then not proven"
    )
    gross_mm: Positive | None = Field(
        default=None,
        description="points farther from the surface than this are rejected as dust or a fixture; null: 2 % of the nominal's size",
    )

    @field_validator("locked")
    @classmethod
    def _locked_at_a_start(cls, locked: tuple[FreedomName, ...], info: ValidationInfo) -> tuple[FreedomName, ...]:
        if locked and info.data.get("start") is None:
            raise ValueError("no freedom without a start: what is locked stays as the start has it")
        if locked and info.data.get("fit") == "none":
            raise ValueError("no freedom where fit is none: then all of them stay")
        return locked

    @field_validator("reject_outliers")
    @classmethod
    def _outliers_are_those_of_a_fit(cls, reject: bool, info: ValidationInfo) -> bool:
        if reject and info.data.get("fit") == "none":
            raise ValueError("false where fit is none: outliers are found by fitting the other points")
        return reject


class SurfaceAllow(Settings):
    """What may be missing although conformity is to be proven."""

    unseen_mm: float | None = Field(
        default=None,
        ge=0,
        description="the width of the widest place that may be unseen where points were lost, damaged or rejected; null: none may be",
    )


class SurfacePlan(Spelled):
    """One inspection of a whole surface: what, against what, with what, and where the results go."""

    part: Part = Field(description="a mapping with the part's name")
    operator: Text | None = Field(default=None, description="who measures")
    serial_number: SerialNumbers | None = Field(default=None, description=SERIAL_NUMBER)
    surface: SurfaceNominal = Field(description="a mapping with the file of the nominal surface")
    tolerance: Tolerance = Field(description="a mapping with lower_mm and upper_mm")
    decision_rule: DecisionRule = Field(default="iso-14253-1", description=DECISION_RULE)
    device: Device = Field(description="a mapping with the device's type and address")
    probe: Probe = Field(default=Probe(), description="the tip of the probe")
    registration: SurfacePlacing = Field(default=SurfacePlacing(), description="how the scan comes onto the nominal")
    gap_max_mm: Positive | None = Field(
        default=None,
        description="the diameter of the widest place without a point that counts as measured; null: a twenty-fifth of the nominal's size",
    )
    edge_allowance_mm: Annotated[float, Field(ge=0)] | None = Field(
        default=None, description="how far points may lie beyond the border of an open surface; null: half the width of the zone"
    )
    allow: SurfaceAllow = Field(default=SurfaceAllow(), description="what may be missing although conformity is to be proven")
    buffer_points: int = Field(default=CAPACITY_POINTS, ge=1, description="how many points may wait between the device and the inspection")
    out: ResultsOrFolder = Field(default=Results(), description=OUT)
    report: ReportSettings = Field(default=ReportSettings(), description=REPORT)
    records: RecordsOrFolder = Field(default=RecordKeeping(), description=RECORDS)

    @field_validator("serial_number")
    @classmethod
    def _spelled_so(cls, asked: SerialNumbers | None, info: ValidationInfo) -> SerialNumbers | None:
        return spelled_as(asked, info.data.get("part"))

    @field_validator("device")
    @classmethod
    def _follows_no_curve(cls, device: Device) -> Device:
        if isinstance(device, DmeDevice) and isinstance(device.asked_scans[0], CurveScan | PointsScan):
            raise ValueError("a scan of type circle, line or unknown, or several scans: a surface has no curve that a machine could follow")
        return device

    @property
    def zone(self) -> ToleranceZone:
        """The zone that judges the points, with the U of the measurement alone."""
        tolerance = self.tolerance
        return ToleranceZone(tolerance.lower_mm, tolerance.upper_mm, tolerance.uncertainty_mm, rule=self.decision_rule)

    @property
    def nominal_file(self) -> Path:
        """The file of the nominal."""
        return self.surface.file

    @property
    def has_address(self) -> bool:
        """Whether the device is reached at an address, and not read from a file."""
        return getattr(self.device, "address", None) is not None

    def with_nominal_file(self, file: Path) -> "SurfacePlan":
        """Give the same plan with its nominal in another file."""
        return self.model_copy(update={"surface": self.surface.model_copy(update={"file": file})})

    def with_part(self, serial_number: str, operator: str | None = None) -> "SurfacePlan":
        """Give the same plan for one part, and who measures it. Raises PlanError for a serial number that it does not allow.

        operator : None leaves the plan's
        """
        return part_given(self, serial_number, operator)

    def with_address(self, address: str) -> "SurfacePlan":
        """Give the same plan with its device at another address. Raises PlanError for an address that is none."""
        return address_given(self, address)


def load_surface_plan(path: str | PathLike[str]) -> SurfacePlan:
    """Read and check a plan. Raises PlanError: file, line, key, the value found and what is allowed."""
    path = Path(path)
    try:
        plan = read_model(read_text(path), SurfacePlan).named(path.name)
    except PointFileError as error:
        raise PlanError(str(error)) from None
    except YamlError as error:
        raise PlanError(f"{path}: {error}") from None
    folder = path.resolve().parent
    return plan.with_nominal_file(folder / plan.surface.file).model_copy(
        update={
            "device": device_from(folder, plan.device),
            "out": plan.out.with_path_from(folder),
            "records": plan.records.with_path_from(folder),
            "report": plan.report.with_path_from(folder),
        }
    )
