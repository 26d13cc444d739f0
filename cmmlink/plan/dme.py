"""A coordinate measuring machine behind an I++ DME server, as a plan describes it: how it is reached, and what it is to scan."""

from math import hypot
from typing import Annotated, Literal

from pydantic import AfterValidator, Field, model_validator

from cmmlink.plan.yaml_model import Positive, Settings, Text

Vector = tuple[float, float, float]
_RADIUS_TOLERANCE_MM = 0.001


def _some_direction(direction: Vector) -> Vector:
    if hypot(*direction) == 0:
        raise ValueError("a direction other than [0, 0, 0]")
    return direction


def _without_quotes(text: str) -> str:
    if not text.isascii() or '"' in text:
        raise ValueError("a name of ASCII characters without quotes, as the machine knows it")
    return text


Direction = Annotated[Vector, AfterValidator(_some_direction)]
ToolName = Annotated[Text, AfterValidator(_without_quotes)]
SystemName = Literal["MachineCsy", "MoveableMachineCsy", "MultipleArmCsy", "PartCsy"]


class _AlongNominal(Settings):
    """What follows the nominal in the plane of the section; where the part lies, the coordinate system or the datum says."""

    chord_error_mm: Positive = Field(default=0.002, description="how far the course that the machine is told may leave the nominal")


class CurveScan(_AlongNominal):
    """A scan along the nominal: ScanOnCurve."""

    type: Literal["curve"] = Field(description="a scan along the nominal: ScanOnCurve")
    step_mm: Positive = Field(default=0.1, description="the distance of two points of the scan")
    angle_deg: Positive = Field(default=10.0, description="a point is taken at the latest when the surface has turned by so much")


class PointsScan(_AlongNominal):
    """Single points along the nominal, for probes that cannot scan: PtMeas."""

    type: Literal["points"] = Field(description="single points along the nominal: PtMeas")
    step_mm: Positive = Field(default=1.0, description="the distance of two points; where the nominal bends sharply they lie closer")


class _OwnPath(Settings):
    """A scan whose path its own numbers describe."""

    via_mm: tuple[Vector, ...] = Field(
        default=(),
        description="places that the machine passes before this scan, one after the other, like [[60, 0, 80]]; from the last one, or from "
        "where it stands, it goes straight to the start",
    )


class CircleScan(_OwnPath):
    """A scan around an axis: ScanOnCircle."""

    type: Literal["circle"] = Field(description="a scan around an axis: ScanOnCircle")
    centre_mm: Vector = Field(description="the centre of the circle")
    start_mm: Vector = Field(description="where on the circle the scan begins")
    axis: Direction = Field(description="the direction of the axis, of any length")
    sweep_deg: float = Field(default=360.0, description="the angle of the scan about the axis; a negative one runs the other way")
    surface: Literal["outside", "inside", "plane"] = Field(default="outside", description="which surface is touched")
    step_deg: Positive = Field(default=0.5, description="the angle between two points")


class LineScan(_OwnPath):
    """A scan along a straight line: ScanOnLine."""

    type: Literal["line"] = Field(description="a scan along a straight line: ScanOnLine")
    start_mm: Vector = Field(description="where the scan begins")
    end_mm: Vector = Field(description="where it ends")
    normal: Direction = Field(description="the direction out of the material, at right angles to the line")
    step_mm: Positive = Field(default=0.1, description="the distance of two points")


class UnknownScan(_OwnPath):
    """A scan in a plane along a contour that the machine is not told: ScanInPlaneEndIsSphere."""

    type: Literal["unknown"] = Field(description="a contour that is not known, in a plane: ScanInPlaneEndIsSphere")
    start_mm: Vector = Field(description="where the scan begins")
    start_direction: Direction = Field(description="the direction out of the material at the start")
    plane_normal: Direction = Field(
        default=(0.0, 0.0, 1.0), description="the normal of the plane of the scan; dialect 1.4.0 is not told it"
    )
    towards_mm: Vector = Field(description="a point of the plane on the side to which the scan sets out")
    end_mm: Vector = Field(description="where the scan ends")
    end_diameter_mm: Positive = Field(default=1.0, description="the diameter of the sphere around the end that the scan has to reach")
    end_count: Annotated[int, Field(ge=1)] = Field(default=1, description="how often it has to; dialect 1.4.0 is not told it")
    end_direction: Direction = Field(description="the direction out of the material at the end")
    step_mm: Positive = Field(default=0.1, description="the distance of two points")
    dialect: Literal["1.4.3", "1.4.0"] = Field(
        default="1.4.3", description="the version of the server's I++ DME: 1.4.3 takes 21 numbers, 1.4.0 takes 17"
    )


AskedScan = Annotated[CurveScan | PointsScan | CircleScan | LineScan | UnknownScan, Field(discriminator="type")]
AskedPath = Annotated[CircleScan | LineScan | UnknownScan, Field(discriminator="type")]


class DmeSettings(Settings):
    """How the machine measures, whatever its address."""

    tool: ToolName | None = Field(default=None, description="the tool to measure with, as the machine calls it; null: the one it has")
    home: bool = Field(default=False, description="whether a machine that is not homed is sent home, which moves it")
    coordinate_system: SystemName | None = Field(
        default=None, description="the machine's coordinate system to measure in, like PartCsy; null: the active one"
    )
    scan: AskedScan | None = Field(
        default=None, description="what the machine scans; null: along the nominal as type curve does, or what scans lists"
    )
    scans: tuple[AskedPath, ...] = Field(
        default=(),
        description="several scans in place of scan, in their order: their points are one run, which is complete when the last one is",
    )
    speed_mm_s: Positive | None = Field(default=None, description="the speed of the scan or of touching; null: as the machine is set")
    radius_tolerance_mm: Annotated[float, Field(ge=0)] = Field(
        default=_RADIUS_TOLERANCE_MM, description="how far the radius of the tip by the machine may be from probe.tip_radius_mm"
    )
    quality_max: Annotated[float, Field(ge=0, le=100)] = Field(
        default=50.0, description="points of a worse quality are rejected; 0 is good, 100 is bad, for machines that tell it"
    )
    silence_s: Positive = Field(default=30.0, description="how long the machine may say nothing, be it because it moves")

    @property
    def asked_scans(self) -> tuple[AskedScan, ...]:
        """What the machine scans, one after the other."""
        return self.scans or (self.scan or CurveScan(type="curve"),)

    @model_validator(mode="after")
    def _one_or_several(self) -> "DmeSettings":
        if self.scan is not None and self.scans:
            raise ValueError("either scan or scans")
        return self

    @model_validator(mode="after")
    def _no_reserved_tool(self) -> "DmeSettings":
        if self.tool in ("NoTool", "UnDefTool"):
            raise ValueError(f"a tool that measures; {self.tool} is none")
        return self
