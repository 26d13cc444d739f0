"""The trend of a part as a workbook: its values with what they break, its indices, the profiles of its runs, and their drift."""

from collections.abc import Iterator, Mapping
from datetime import UTC, datetime
from pathlib import Path

import numpy as np

from cmmlink.exports.tables import Cell
from cmmlink.exports.workbook import write_sheets
from cmmlink.part_trend import HeatStrip, PartTrend
from cmmlink.trend_json import run_at

_VALUES = {
    "run": "the id of the run at its station",
    "station": "the station that measured it",
    "serial_number": "the serial number of the part",
    "measured_at": "when the measurement began, in UTC (ISO 8601)",
    "value": "the value of the characteristic, in its unit; empty where the run gave none",
    "lower": "the lower limit of the value; empty: none",
    "upper": "the upper limit of the value; empty: none",
    "verdict": "the verdict on the characteristic: conform, nonconform or uncertain",
    "plotted": "what the chart of location plots: the value, or in the last row of each subgroup its mean",
    "range": "what the chart of spread plots: the moving range, or the range of the subgroup",
    "rules": "the rules of Western Electric that are broken with this row",
}
_FIGURES = {"figure": "what the number is", "value": "the number", "lower": "its lower limit of confidence", "upper": "the upper one",
            "words": "why something is not stated, or a note"}  # fmt: skip
_DRIFT = {
    "from_mm": "the station that the place begins at",
    "to_mm": "the station that the place ends at",
    "slope_mm": "the median slope of the mean deviation, mm a run, positive out of material; empty where too few runs measured it",
    "level": "the level of Kendall's test, corrected for the number of places by Holm; below 0.05 the place drifts",
}


def write_trend_workbook(found: PartTrend, path: Path) -> None:
    """Write the workbook. Raises OSError where it cannot be written."""
    sheets = [("trend", _VALUES, _value_rows(found)), ("figures", _FIGURES, _figure_rows(found))]
    if found.strip is not None:
        columns = _profile_columns(found.strip)
        sheets += [("profiles", columns, _profile_rows(found.strip, list(columns)[1:])), ("drift", _DRIFT, _drift_rows(found.strip))]
    newest = float(found.series.started_s[-1]) if found.series.run else 0.0
    write_sheets(sheets, path, datetime.fromtimestamp(newest, UTC).isoformat())


def _value_rows(found: PartTrend) -> Iterator[Mapping[str, Cell]]:
    charts = found.trend.charts
    drawn: dict[int, dict[str, Cell]] = {}
    if charts is not None:
        for at, row in enumerate(found.last_rows.tolist()):
            broken = [one.words for one in charts.location.violations if one.at == at]
            broken += [f"range: {one.words}" for one in charts.spread.violations if one.at == at]
            plotted, spread = float(charts.location.plotted[at]), float(charts.spread.plotted[at])
            drawn[row] = {"plotted": plotted, "range": spread, "rules": "; ".join(dict.fromkeys(broken))}
    for row in range(len(found.series.run)):
        yield run_at(found, row) | drawn.get(row, {})


def _figure_rows(found: PartTrend) -> Iterator[Mapping[str, Cell]]:
    series, trend, capability = found.series, found.trend, found.trend.capability
    named = {
        "part": series.part,
        "characteristic": series.name,
        "type": series.type,
        "unit": series.unit,
        "station": found.station or "all",
    }
    yield from ({"figure": name, "words": words} for name, words in named.items())
    yield {"figure": "runs", "value": len(series.run)}
    yield {"figure": "runs in a subgroup", "value": trend.subgroup}
    if trend.charts is not None:
        for name, chart in (("location", trend.charts.location), ("spread", trend.charts.spread)):
            yield from ({"figure": f"{name}: {line}", "value": getattr(chart.limits, line)} for line in ("centre", "lower", "upper"))
    if capability is not None:
        for name in ("cp", "cpk", "pp", "ppk"):
            index = getattr(capability, name)
            yield {"figure": name.capitalize(), "value": index.value, "lower": index.lower, "upper": index.upper, "words": index.reason}
        yield {"figure": "mean", "value": capability.mean}
        yield {"figure": "standard deviation", "value": capability.overall_sigma}
        yield {"figure": "distribution", "words": capability.distribution}
        yield {"figure": "confidence", "value": capability.confidence}
    yield from ({"figure": "drift", "words": words} for words in found.drifts)
    yield from ({"figure": "note", "words": words} for words in found.notes)


def _profile_columns(strip: HeatStrip) -> dict[str, str]:
    """A column for every place, by the station of its middle."""
    places = strip.levels.shape[1]
    middles = [f"{(place + 0.5) * strip.length_mm / places:.3f}" for place in range(places)]
    names = (f"{middle} mm" for middle in middles)
    said = (f"the worst deviation in the part of the profile around station {middle} mm; empty: not measured" for middle in middles)
    return {"run": _VALUES["run"], **dict(zip(names, said, strict=True))}


def _profile_rows(strip: HeatStrip, places: list[str]) -> Iterator[Mapping[str, Cell]]:
    for run, worst in zip(strip.strips.run, strip.strips.worst_mm.astype(np.float64).tolist(), strict=True):
        yield {"run": run, **dict(zip(places, worst, strict=True))}


def _drift_rows(strip: HeatStrip) -> Iterator[Mapping[str, Cell]]:
    ends = np.linspace(0, strip.length_mm, len(strip.drift.slope) + 1).tolist()
    for place, (slope, level) in enumerate(zip(strip.drift.slope.tolist(), strip.drift.level.tolist(), strict=True)):
        yield {"from_mm": ends[place], "to_mm": ends[place + 1], "slope_mm": slope, "level": level}
