"""The plan of a CT inspection: a YAML file, validated into an immutable model.

    part: {name: blade, serial_number: null}
    mesh: {file: blade.stl, scale: 1.0}       # STL, PLY or OBJ; mm per unit of the file
    nominal: {file: blade.dat, scale: 60, closed: null, material: null}
    tolerance: {lower_mm: -0.05, upper_mm: 0.05, uncertainty_mm: 0.0}
    sections:
      normal: [0, 0, 1]                       # the part's axis in the scan, of any length
      heights_mm: [20, 50, 80]                # along the unit normal, from the scan's origin
      # every_mm: 0.5                         # in place of heights_mm: a section every 0.5 mm
      # from_mm: 10                           # null: half a step above the lowest point
      # to_mm: 90                             # null: the highest point
      nominal_at: []                          # {height_mm: 80, file: tip.dat}: sections with a nominal of their own
    cut:
      cutter: auto                            # auto, open3d, numpy; auto: Open3D, and numpy for more than 50 sections
      weld_mm: 1e-6                           # loose ends no farther apart are one point
      shortest_mm: null                       # shorter pieces are dust; null: 5 % of the section's longest
    registration: {fit: best-fit, method: exact, datum: null, coverage_min: 0.95, reject_outliers: false}
    out: null

Relative paths are relative to the plan's own folder.
"""

from pathlib import Path
from typing import Annotated, Literal, Self

from pydantic import BaseModel, ConfigDict, Field, field_validator, model_validator

from cmmlink.errors import PlanError, YamlError
from cmmlink.plan.scan import Nominal, Part, Registration, Tolerance
from cmmlink.plan.yaml_model import read_model
from drivers.errors import PointFileError
from drivers.files.point_file import read_text

Positive = Annotated[float, Field(gt=0)]


class _Settings(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False, str_strip_whitespace=True)


class Mesh(_Settings):
    """The surface."""

    file: Path = Field(description="the surface file: STL, PLY or OBJ")
    scale: Positive = 1.0


class NominalAt(_Settings):
    """A nominal of its own for the section at one height; scale, ends and material as for the common nominal."""

    height_mm: float = Field(description="one of the heights")
    file: Path = Field(description="the file of the nominal profile there")


class Sections(_Settings):
    """Where the surface is cut."""

    normal: tuple[float, float, float] = (0.0, 0.0, 1.0)
    heights_mm: tuple[float, ...] = ()
    every_mm: Positive | None = None
    from_mm: float | None = None
    to_mm: float | None = None
    nominal_at: tuple[NominalAt, ...] = ()

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


class Cut(_Settings):
    """How the surface is cut."""

    cutter: Literal["auto", "open3d", "numpy"] = "auto"
    weld_mm: Positive = 1e-6
    shortest_mm: Annotated[float, Field(ge=0)] | None = None


class CtPlan(_Settings):
    """One CT inspection: a surface, its sections, and what they are held against."""

    part: Part = Field(description="a mapping with the part's name")
    mesh: Mesh = Field(description="a mapping with the surface's file")
    nominal: Nominal = Field(description="a mapping with the nominal's file")
    tolerance: Tolerance = Field(description="a mapping with lower_mm and upper_mm")
    sections: Sections = Field(description="a mapping with heights_mm or every_mm")
    cut: Cut = Cut()
    registration: Registration = Registration()
    out: Path | None = None


def load_ct_plan(path: Path) -> CtPlan:
    """Read and check a plan. Raises PlanError: file, line, key, the value found and what is allowed."""
    try:
        plan = read_model(read_text(path), CtPlan)
    except PointFileError as error:
        raise PlanError(str(error)) from None
    except YamlError as error:
        raise PlanError(f"{path}: {error}") from None
    folder = path.resolve().parent
    own = tuple(at.model_copy(update={"file": folder / at.file}) for at in plan.sections.nominal_at)
    return plan.model_copy(
        update={
            "mesh": plan.mesh.model_copy(update={"file": folder / plan.mesh.file}),
            "nominal": plan.nominal.model_copy(update={"file": folder / plan.nominal.file}),
            "sections": plan.sections.model_copy(update={"nominal_at": own}),
            "out": folder / plan.out if plan.out else None,
        }
    )
