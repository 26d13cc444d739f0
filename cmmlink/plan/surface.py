"""The plan of a CT inspection: a YAML file, validated into an immutable model.

Relative paths are relative to the plan's own folder. Every field says in its description what it means; docs/ct-plan.md is written
from these descriptions.
"""

from itertools import pairwise
from os import PathLike
from pathlib import Path
from typing import Annotated, Literal, Self

from pydantic import Field, ValidationInfo, field_validator, model_validator

from cmmlink.errors import PlanError, YamlError
from cmmlink.plan.characteristics import AskedProfile
from cmmlink.plan.cutters import CutterName
from cmmlink.plan.deciding import Deciding, check_names
from cmmlink.plan.keeping import RECORDS, RecordKeeping, RecordsOrFolder
from cmmlink.plan.report import REPORT, ReportSettings
from cmmlink.plan.results import NO_RESULTS, OUT, ResultsOrFolder
from cmmlink.plan.scan import Nominal, Part, Registration, place_of
from cmmlink.plan.scan_devices import Unit
from cmmlink.plan.stack_characteristics import AskedOfStack
from cmmlink.plan.yaml_model import Positive, Settings, read_model
from drivers import PointFileError, mm_per, read_text

_SAME_HEIGHT_MM = 1e-6  # of two sections of one stack: over a shorter way no slope means anything


class Mesh(Settings):
    """The surface."""

    file: Path = Field(description="the surface file: STL, PLY or OBJ")
    scale: Positive = Field(default=1.0, description="how many mm a unit of the file is")
    unit: Unit = Field(default=None, description="the unit of the file in words, in place of scale: mm, um or inch; null: mm")

    @property
    def mm_per_unit(self) -> float:
        """How many mm a unit of the file is."""
        return mm_per(self.unit) if self.unit else self.scale


class NominalAt(Settings):
    """A nominal of its own for the section at one height; scale, ends and material as for the common nominal."""

    height_mm: float = Field(description="one of the heights")
    file: Path = Field(description="the file of the nominal profile there")


class Sections(Settings):
    """Where the surface is cut."""

    normal: tuple[float, float, float] = Field(default=(0.0, 0.0, 1.0), description="the part's axis in the scan, of any length")
    heights_mm: tuple[float, ...] = Field(default=(), description="the heights of the sections along the normal, from the scan's origin")
    every_mm: Positive | None = Field(default=None, description="the step from section to section, in place of heights_mm")
    from_mm: float | None = Field(default=None, description="the first height with every_mm; null: half a step above the lowest point")
    to_mm: float | None = Field(default=None, description="the last height with every_mm; null: the highest point")
    nominal_at: tuple[NominalAt, ...] = Field(default=(), description="the sections that have a nominal of their own")

    @field_validator("normal")
    @classmethod
    def _some_direction(cls, direction: tuple[float, float, float]) -> tuple[float, float, float]:
        if not any(direction):
            raise ValueError("a direction other than [0, 0, 0]")
        return direction

    @model_validator(mode="after")
    def _some_heights(self) -> Self:
        if bool(self.heights_mm) == (self.every_mm is not None):
            raise ValueError("either heights_mm or every_mm")
        if self.every_mm is None and (self.from_mm is not None or self.to_mm is not None):
            raise ValueError("from_mm and to_mm only with every_mm")
        if self.from_mm is not None and self.to_mm is not None and self.to_mm < self.from_mm:
            raise ValueError(f"a to_mm not below from_mm, which is {self.from_mm:g}")
        return self


class Cut(Settings):
    """How the surface is cut."""

    cutter: CutterName = Field(
        default="auto",
        description="what cuts; auto: Open3D where it is there, numpy for more than 50 sections; the points are the same",
    )
    weld_mm: Positive = Field(default=1e-6, description="loose ends no farther apart than this are one point")
    shortest_mm: Annotated[float, Field(ge=0)] | None = Field(
        default=None,
        description="pieces shorter than this are dust; null: 5 % of the section's longest, but of no more than 1.5 times the nominal",
    )


class CtPlan(Deciding):
    """One CT inspection: a surface, its sections, and what they are held against."""

    part: Part = Field(description="a mapping with the part's name")
    mesh: Mesh = Field(description="a mapping with the surface's file")
    nominal: Nominal = Field(description="a mapping with the nominal's file")
    sections: Sections = Field(description="a mapping with heights_mm or every_mm")
    cut: Cut = Field(default=Cut(), description="how the surface is cut")
    registration: Registration = Field(default=Registration(), description="how the points of a section come onto its nominal")
    stack_fit: Literal["each", "common"] = Field(
        default="each",
        validate_default=True,
        description="what places the sections: each its own fit, or one common best fit of all of them (common), where each is then judged "
        "as at a known pose; by weights arc-length every millimetre of profile counts alike in it, whichever section it is of",
    )
    stack_characteristics: tuple[AskedOfStack, ...] = Field(
        default=(), description="what is evaluated of all sections together, each with a verdict of its own; the part has the worst of all"
    )
    out: ResultsOrFolder = Field(default=NO_RESULTS, description=f"{OUT}; so it is without this key")
    report: ReportSettings = Field(default=ReportSettings(), description=REPORT)
    records: RecordsOrFolder = Field(default=RecordKeeping(), description=RECORDS)

    @field_validator("stack_fit")
    @classmethod
    def _fit_of_least_squares(cls, stack_fit: str, info: ValidationInfo) -> str:
        registration: Registration | None = info.data.get("registration")
        if stack_fit == "common" and registration is not None:
            if registration.fit == "none":
                raise ValueError("each where the pose is known: a datum places all sections already")
            if registration.fit == "minimum-zone":
                raise ValueError("each where registration.fit is minimum-zone: a common fit is of least squares, a zone is of one section")
            if registration.reject_outliers:
                raise ValueError("each where registration.reject_outliers: a common fit is of all points")
        if stack_fit == "common" and info.data.get("tolerance") is None and info.data.get("characteristics"):
            first = next((one for one in info.data["characteristics"] if isinstance(one, AskedProfile)), None)
            if first is not None and first.fit != "none":
                raise ValueError(
                    f"each, or fit none of {first.name}: a common fit is of least squares, and fit {first.fit} is of one section"
                )
        return stack_fit

    @field_validator("stack_characteristics")
    @classmethod
    def _names_of_the_stack(cls, asked: tuple[AskedOfStack, ...], info: ValidationInfo) -> tuple[AskedOfStack, ...]:
        check_names(asked)
        sections: Sections | None = info.data.get("sections")
        if sections is not None and asked and sections.every_mm is None:
            heights = sections.heights_mm
            if len(heights) < 2 or any(high - low < _SAME_HEIGHT_MM for low, high in pairwise(sorted(heights))):
                raise ValueError("sections at two heights or more, each once")
            for one in asked:
                for key in ("reference_mm", "root_mm", "tip_mm"):
                    if (at := getattr(one, key, None)) is not None and at not in heights:
                        raise ValueError(f"a {key} that is one of heights_mm, not {at:g} ({one.name})")
        return asked


def load_ct_plan(path: str | PathLike[str]) -> CtPlan:
    """Read and check a plan. Raises PlanError: file, line, key, the value found and what is allowed."""
    path = Path(path)
    try:
        plan = read_model(read_text(path), CtPlan).named(path.name)
    except PointFileError as error:
        raise PlanError(str(error)) from None
    except YamlError as error:
        raise PlanError(f"{path}: {error}") from None
    folder = path.resolve().parent
    own = tuple(at.model_copy(update={"file": folder / at.file}) for at in plan.sections.nominal_at)
    datum = plan.registration.datum
    if datum is not None and datum.result is not None:
        raise PlanError(f"{place_of(path, 'registration.datum.result')}: a pose is taken over by plans of scans alone")
    return plan.model_copy(
        update={
            "mesh": plan.mesh.model_copy(update={"file": folder / plan.mesh.file}),
            "nominal": plan.nominal.model_copy(update={"file": folder / plan.nominal.file}),
            "sections": plan.sections.model_copy(update={"nominal_at": own}),
            "out": plan.out.with_path_from(folder),
            "records": plan.records.with_path_from(folder),
            "report": plan.report.with_path_from(folder),
        }
    )
