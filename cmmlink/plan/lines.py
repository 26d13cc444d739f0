"""A machine tool that prints touched points as lines of text, as a plan describes it: how its lines reach us, and what they look like."""

from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, model_validator

from cmmlink.plan.yaml_model import Positive, Settings, Text
from drivers import decoder

_RADIUS_TOLERANCE_MM = 0.002  # four decimals of an inch are rounded by a little more than a thousandth of a millimetre
FORMAT = "what the lines look like: g800, or a mapping with language or a pattern of your own"
LanguageOfLines = Literal["g800"]


class LineFormat(Settings):
    """What the lines of a machine tool look like: a known language, or a pattern of your own."""

    language: LanguageOfLines | None = Field(default=None, description="g800: the G800 and G801 lines of inspection on machine tools")
    result_set: Text | None = Field(
        default=None, description="the RESULTSFILE or DOCUMENTID of the set of g800 lines to take; null: the first one that comes"
    )
    pattern: Text | None = Field(
        default=None,
        description="a regular expression for a whole line with a point, with the groups x, y and z, and seq for a number of the point, "
        "like X(?P<x>[-+ .0-9]+)Y(?P<y>[-+ .0-9]+)",
    )
    end: Text | None = Field(default=None, description="a regular expression for the line that ends the scan, beside a pattern")
    points: Annotated[int, Field(ge=1)] | None = Field(
        default=None, description="the number of points after which the scan ends, beside a pattern"
    )
    pass_over: Text | None = Field(
        default=None, description="a regular expression for lines that mean nothing, beside a pattern; every other line is damage"
    )
    request: Text | None = Field(
        default=None,
        description="a regular expression for the line with the number by which the machine asks for a verdict (answer), beside a pattern, "
        "with the group number, like REQUEST(?P<number>[ 0-9]+)",
    )
    sample: Path | None = Field(
        default=None, description="a file with lines as the machine prints them, on which cmmlink check tries the format"
    )

    @model_validator(mode="after")
    def _can_be_read(self) -> "LineFormat":
        if (self.language is None) == (self.pattern is None):
            raise ValueError("either language or pattern")
        if self.language is not None and (self.end, self.points, self.pass_over, self.request) != (None,) * 4:
            raise ValueError("end, points, pass_over and request only beside a pattern")
        if self.pattern is not None and self.result_set is not None:
            raise ValueError("result_set only beside language: g800")
        if self.pattern is not None and self.end is None and self.points is None:
            raise ValueError("end or points beside a pattern, so that the scan ends")
        try:
            decoder(self.name, unit="mm", **self.options)
        except ValueError as error:
            raise ValueError(f"lines that can be told apart: {error}") from None
        return self

    @property
    def name(self) -> str:
        """How drivers call the format."""
        return self.language or "pattern"

    @property
    def tells_request(self) -> bool:
        """Whether the lines may hold the number by which the machine asks for a verdict."""
        return self.language is not None or self.request is not None

    @property
    def options(self) -> dict[str, Any]:
        """The options of the format as drivers take them."""
        names = ("pattern", "end", "points", "pass_over", "request")
        given = {"set_name": self.result_set, **{name: getattr(self, name) for name in names}}
        return {name: value for name, value in given.items() if value is not None}


def _as_mapping(given: object) -> object:
    """The name of a language alone as the mapping that it is short for."""
    return {"language": given} if isinstance(given, str) else given


FormatOrLanguage = Annotated[LineFormat, BeforeValidator(_as_mapping, json_schema_input_type=LineFormat | LanguageOfLines)]


class LinesSettings(Settings):
    """How the lines of a machine tool reach us, whatever its address."""

    listen: bool = Field(default=False, description="whether the machine connects to us, at the address of this computer that is given")
    file: Path | None = Field(
        default=None, description="in place of an address, a file that the machine, or a program beside it, writes line by line"
    )
    existing: bool = Field(default=False, description="whether what stands in the file before the run begins belongs to the scan, too")
    unit: Literal["mm", "inch"] = Field(description="the unit of the lines, which they do not tell: mm or inch")
    format: FormatOrLanguage = Field(default=LineFormat(language="g800"), validate_default=True, description=FORMAT)
    radius_tolerance_mm: Annotated[float, Field(ge=0)] = Field(
        default=_RADIUS_TOLERANCE_MM, description="how far the radius R of the ball in g800 lines may be from probe.tip_radius_mm"
    )
    baud_rate: int = Field(default=9600, gt=0, description="the speed of a serial port in bits per second")
    data_bits: int = Field(
        default=7, ge=7, le=8, description="the data bits of a serial port; with 7 the parity of every character is checked"
    )
    parity: Literal["N", "E", "O"] = Field(default="E", description="the parity of a serial port: none, even or odd")
    silence_s: Positive = Field(
        default=300.0, description="how long the machine may print nothing, before its first point and between two of them"
    )
    reconnect_s: float = Field(
        default=0.0, ge=0, description="how long a lost link is tried again while the run goes on; only where the points are numbered"
    )

    @model_validator(mode="after")
    def _shows_what_is_lost(self) -> "LinesSettings":
        if self.data_bits == 7 and self.parity == "N":
            raise ValueError("parity: E or O beside 7 data bits")
        if self.existing and self.file is None:
            raise ValueError("existing only beside a file")
        if self.reconnect_s and "(?P<seq>" not in (self.format.pattern or "(?P<seq>"):
            raise ValueError("reconnect_s: 0 where the pattern has no group seq: lines that are lost with the link would not show")
        return self
