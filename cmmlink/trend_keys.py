"""The keys of the answer of `plant trends`: their types and what they mean. The objects are made in cmmlink.trend_json."""

from typing import Literal

from pydantic import Field

from cmmlink.inspection_keys import JsonObject


class TrendRun(JsonObject):
    """One run of a trend."""

    run: str = Field(description="its id at its station")
    station: str = Field(description="the station that measured it")
    serial_number: str = Field(description="the serial number of the part")
    measured_at: str = Field(description="when it began, in UTC")
    value: float | None = Field(description="the value of the characteristic; null where the run gave none")
    lower: float | None = Field(description="the lower limit of the value; null: none")
    upper: float | None = Field(description="the upper limit of the value; null: none")
    verdict: str = Field(description="the verdict on the characteristic: conform, nonconform or uncertain")


class ChartViolation(JsonObject):
    """A rule of Western Electric that is broken."""

    rule: Literal[1, 2, 3, 4] = Field(description="its number")
    words: str = Field(description="what it says")
    above: bool = Field(description="whether it is broken above the centre line")
    run: str = Field(description="the run that completed it; of a subgroup its last one")
    plotted: list[int] = Field(description="the plotted values that count for it, numbered from 0")


class TrendChart(JsonObject):
    """One line of a control chart."""

    centre: float = Field(description="the centre line")
    lower: float = Field(description="the lower limit of control")
    upper: float = Field(description="the upper limit of control")
    plotted: list[float | None] = Field(description="what is plotted, oldest first; null where there is nothing to plot")
    violations: list[ChartViolation] = Field(description="the rules that are broken; of ranges the first rule alone")


class TrendIndex(JsonObject):
    """An index of capability."""

    value: float | None = Field(description="null where it is not stated")
    lower: float | None = Field(description="its lower limit of confidence; null where it is not stated")
    upper: float | None = Field(description="its upper limit of confidence; null where it is not stated")
    reason: str = Field(description="why something is not stated")


class TrendCapability(JsonObject):
    """What the process can hold between the limits of the newest run."""

    cp: TrendIndex = Field(description="the width of the zone over the spread at short term")
    cpk: TrendIndex = Field(description="the same with the location of the process")
    pp: TrendIndex = Field(description="the width of the zone over the spread of all values")
    ppk: TrendIndex = Field(description="the same with the location of the process")
    mean: float = Field(description="the mean of all values")
    sigma: float = Field(description="the standard deviation of all values, with n - 1")
    values: int = Field(description="how many there are")
    distribution: str = Field(description="what the indices assume: normal, folded normal, percentiles of the values or none")
    confidence: float = Field(description="the level of the limits of confidence, two-sided")


class TrendStretch(JsonObject):
    """A stretch of the profile that drifts significantly."""

    from_mm: float = Field(description="the station that it begins at")
    to_mm: float = Field(description="the station that it ends at")
    at_mm: float = Field(description="the station of its steepest place")
    slope_mm: float = Field(description="the slope there, mm a run, positive out of material")
    change_mm: float = Field(description="that slope over all runs that were looked at")


class ProfileDrift(JsonObject):
    """The drift of the mean deviation along the profile."""

    runs: int = Field(description="how many of the newest runs were looked at")
    length_mm: float = Field(description="the length of the nominal, which is looked at in even parts")
    slope_mm: list[float | None] = Field(description="the median slope in each part, mm a run; null where too few runs measured it")
    level: list[float | None] = Field(description="the level of Kendall's test in each part, corrected for their number by Holm")
    stretches: list[TrendStretch] = Field(description="where the level is below 5 %, the steepest first")
    words: list[str] = Field(description="the same in whole sentences, or that there is none")


class PlantTrend(JsonObject):
    """The answer of `plant trends`."""

    part: str = Field(description="the name of the part")
    characteristic: str = Field(description="the name of the characteristic")
    type: str = Field(description="its type")
    unit: str = Field(description="the unit of its values and limits")
    station: str | None = Field(description="the station whose runs these are; null: all stations")
    subgroup: int = Field(description="how many runs in a row make one plotted mean; 1: single values are plotted")
    runs: list[TrendRun] = Field(description="the runs, oldest first")
    location: TrendChart | None = Field(description="the chart of single values or of means; null where there are too few values")
    spread: TrendChart | None = Field(description="the chart of moving ranges or of ranges")
    capability: TrendCapability | None = Field(description="null where the newest run has no limits, or there are too few values")
    drift: ProfileDrift | None = Field(description="null where no run has a profile on record")
    notes: list[str] = Field(description="what was assumed, and what speaks against it")
    file: str | None = Field(description="the file that was written; null where none was asked for")
