"""The keys of what a comparison of two scans gives: their types and what they mean. The objects are made in the command."""

from typing import Literal

from pydantic import Field

from cmmlink.inspection_keys import JsonObject
from cmmlink.words import VerdictName


class ComparedScan(JsonObject):
    """One of two scans that were compared."""

    kind: Literal["run", "file"] = Field(description="a recorded run, or a file of points that was judged for the comparison")
    name: str = Field(description="the id of the run, or the name of the file without its suffix")
    part: str | None = Field(description="the name of the part; of a file that of the file")
    serial_number: str | None = Field(description="the serial number of the part")
    measured_at: str | None = Field(description="when it was measured, in UTC; null for a file")
    verdict: VerdictName | None = Field(description="the recorded verdict; null for a file")
    judged: int = Field(description="the points judged")
    fit: str = Field(description="how it came onto the nominal")
    rule: str = Field(description="what decided its verdict; of a file best-fit")
    target_mm: float = Field(description="the deviation that the fit aims at: the middle of the zone")
    method: str = Field(description="how its deviations were found")
    coverage: float = Field(description="the share of the profile that it measured")
    max_deviation_mm: float | None = Field(description="its largest deviation")
    min_deviation_mm: float | None = Field(description="its smallest deviation")
    rms_mm: float | None = Field(description="the root mean square of its deviations, a point as much as any other")
    rotation_deg: float = Field(description="the rotation of its pose about the section's origin, counterclockwise")
    translation_mm: list[float] = Field(description="the translation of its pose after the rotation, [x, y]")


class ComparedPlace(JsonObject):
    """A place of the profile, and what both scans have there."""

    station_mm: float = Field(description="its station")
    x_mm: float = Field(description="x of the nominal there")
    y_mm: float = Field(description="y of the nominal there")
    first_mm: float = Field(description="the deviation of the first scan")
    second_mm: float = Field(description="the deviation of the second scan")
    difference_mm: float = Field(description="the second less the first")


class ComparedStretch(JsonObject):
    """One of twelve equal stretches of the profile."""

    from_mm: float = Field(description="the station that it begins at")
    to_mm: float = Field(description="the station that it ends at")
    largest: ComparedPlace | None = Field(description="where the two differ most; null where nothing was measured by both")


class Compared(JsonObject):
    """The answer of `compare`. Differences are the second scan less the first."""

    first: ComparedScan = Field(description="the scan that the other one is held against")
    second: ComparedScan = Field(description="the other scan")
    nominal: str = Field(description="the name of the nominal's file")
    length_mm: float = Field(description="the length of the nominal")
    compared: float = Field(description="the share of that length that both measured")
    largest: ComparedPlace = Field(description="where the two differ most, whatever the sign")
    mean_mm: float = Field(description="the mean difference along the profile, whatever the density of points")
    rms_mm: float = Field(description="the root mean square of the difference, likewise")
    stretches: list[ComparedStretch] = Field(description="the largest difference in each of twelve stretches")
    notes: list[str] = Field(description="how the poses were found, and what else a reader has to know")
    file: str | None = Field(description="the drawing that was written; null where none was asked for")
