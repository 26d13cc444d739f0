"""The trend of a part as `plant trends --json` prints it: stable keys, numbers or null."""

from datetime import UTC, datetime
from typing import TYPE_CHECKING, Any

from cmmlink.characteristics_json import number
from cmmlink.part_trend import HeatStrip, PartTrend

if TYPE_CHECKING:
    from cmmlink.plant import Capability, CapabilityIndex, ControlChart


def trend_json(found: PartTrend) -> dict[str, Any]:
    """Everything but the file that is written; cmmlink.trend_keys says what the keys mean."""
    series, trend = found.series, found.trend
    charts = trend.charts
    return {
        "part": series.part,
        "characteristic": series.name,
        "type": series.type,
        "unit": series.unit,
        "station": found.station,
        "subgroup": trend.subgroup,
        "runs": [run_at(found, at) for at in range(len(series.run))],
        "location": None if charts is None else _chart(found, charts.location),
        "spread": None if charts is None else _chart(found, charts.spread),
        "capability": None if trend.capability is None else _capability(trend.capability),
        "drift": None if found.strip is None else _drift(found.strip, found.drifts),
        "notes": list(found.notes),
    }


def run_at(found: PartTrend, at: int) -> dict[str, Any]:
    """One run with its value and its limits."""
    series = found.series
    return {
        "run": series.run[at],
        "station": series.station[at],
        "serial_number": series.serial_number[at],
        "measured_at": datetime.fromtimestamp(float(series.started_s[at]), UTC).isoformat(),
        **{name: number(getattr(series, name)[at]) for name in ("value", "lower", "upper")},
        "verdict": series.verdict[at],
    }


def _chart(found: PartTrend, chart: "ControlChart") -> dict[str, Any]:
    ends = [found.series.run[row] for row in found.last_rows]
    violations = [
        {"rule": one.rule, "words": one.words, "above": one.above, "run": ends[one.at], "plotted": list(one.points)}
        for one in chart.violations
    ]
    limits = {name: getattr(chart.limits, name) for name in ("centre", "lower", "upper")}
    return {**limits, "plotted": [number(value) for value in chart.plotted.tolist()], "violations": violations}


def _capability(found: "Capability") -> dict[str, Any]:
    return {
        **{name: _index(getattr(found, name)) for name in ("cp", "cpk", "pp", "ppk")},
        "mean": found.mean,
        "sigma": found.overall_sigma,
        "values": found.values,
        "distribution": found.distribution,
        "confidence": found.confidence,
    }


def _index(index: "CapabilityIndex") -> dict[str, Any]:
    return {name: getattr(index, name) for name in ("value", "lower", "upper", "reason")}


def _drift(strip: HeatStrip, words: tuple[str, ...]) -> dict[str, Any]:
    length, drift = strip.length_mm, strip.drift
    stretches = [
        {
            "from_mm": one.from_share * length,
            "to_mm": one.to_share * length,
            "at_mm": one.at_share * length,
            "slope_mm": one.steepest,
            "change_mm": one.change,
        }
        for one in drift.stretches
    ]
    return {
        "runs": len(strip.strips.run),
        "length_mm": length,
        "slope_mm": [number(value) for value in drift.slope.tolist()],
        "level": [number(value) for value in drift.level.tolist()],
        "stretches": stretches,
        "words": list(words),
    }
