"""The trends of a plant as a page asks for them: out of the results database, and as files for whoever wants to take them away."""

import math
from collections.abc import Callable, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING

from cmmlink.characteristics_json import number
from cmmlink.console.paper_process import make_trend
from cmmlink.console.refused import Refused, answer_errors
from cmmlink.console.trend_words import (
    BrokenRule,
    TrendChart,
    TrendChoices,
    TrendIndex,
    TrendRun,
    TrendShown,
    TrendStrip,
)
from cmmlink.part_trend import HeatStrip, PartTrend, look_at_trend
from cmmlink.words import local_words

if TYPE_CHECKING:
    from collections.abc import Iterator

    from cmmlink.plant import Capability, ControlChart, ResultsDatabase

MOST_RUNS, MOST_IN_SUBGROUP = 500, 100
_DIGITS = 5  # of a deviation in mm on a heat strip


@dataclass(frozen=True, slots=True)
class AskedTrend:
    """What a page asks for."""

    part: str
    characteristic: str
    station: str | None
    last: int
    subgroup: int

    @classmethod
    def of(cls, asked: Mapping[str, str]) -> "AskedTrend":
        """What stands in an address, checked. Raises Refused."""
        last, subgroup = (_count(asked.get(name, ""), name, most) for name, most in (("last", MOST_RUNS), ("subgroup", MOST_IN_SUBGROUP)))
        return cls(asked.get("part", ""), asked.get("characteristic", ""), asked.get("station") or None, last, subgroup)

    @property
    def options(self) -> list[str]:
        """The same as words of the command `plant trends`, behind the part."""
        of_station = [] if self.station is None else [f"--station={self.station}"]
        return [f"--characteristic={self.characteristic}", *of_station, f"--last={self.last}", f"--subgroup={self.subgroup}"]


class TrendLook:
    """Looks into a results database for pages. Each look opens it anew, so that none holds it, and one that is away is told.

    open_results : opens the results database of the station
    records      : the folder of the station's records
    """

    def __init__(self, open_results: Callable[[], "ResultsDatabase"], records: Path) -> None:
        self._open_results, self._records = open_results, records

    def choices(self) -> TrendChoices:
        """What trends there are. Raises Refused."""
        with self._results() as results:
            return TrendChoices(tuple(results.parts()), tuple(results.stations()))

    def trend(self, asked: AskedTrend) -> TrendShown:
        """The trend of a characteristic, of the first one where the part has none of that name. Raises Refused."""
        with self._results() as results:
            names = tuple(dict.fromkeys(one.name for one in results.characteristics(asked.part)))
            name = asked.characteristic if asked.characteristic in names or not names else names[0]
            found = look_at_trend(results, asked.part, name, station=asked.station, last=asked.last, subgroup=asked.subgroup)
        return _shown(found, names)

    def write(self, asked: AskedTrend, folder: Path, suffix: str, language: str) -> Path:
        """Write the trend as a drawing or a workbook into a folder. Raises Refused."""
        file = folder / f"trend{suffix}"
        with answer_errors():
            make_trend(self._records, asked.part, file, [*asked.options, f"--language={language}"])
        return file

    @contextmanager
    def _results(self) -> "Iterator[ResultsDatabase]":
        with answer_errors(), self._open_results() as results:
            yield results


def trends_of(look: TrendLook | None) -> TrendLook:
    """What looks into the results of a station. Raises Refused where it has no results database."""
    if look is None:
        raise Refused("this station has no results database")
    return look


def _count(given: str, name: str, most: int) -> int:
    if given.isascii() and given.isdigit() and 1 <= int(given) <= most:
        return int(given)
    raise Refused(f"{name} {given!r}: expected a whole number from 1 to {most}")


def _shown(found: PartTrend, names: tuple[str, ...]) -> TrendShown:
    series, trend = found.series, found.trend
    runs = tuple(
        TrendRun(
            series.run[row],
            series.station[row],
            series.serial_number[row],
            local_words(datetime.fromtimestamp(float(series.started_s[row])).astimezone()),
            number(float(series.value[row])),
            number(float(series.lower[row])),
            number(float(series.upper[row])),
            series.verdict[row],
        )
        for row in range(len(series.run))
    )
    charts, capability = trend.charts, trend.capability
    return TrendShown(
        series.part,
        series.name,
        names,
        series.unit,
        trend.is_form,
        trend.subgroup,
        runs,
        tuple(found.last_rows.tolist()),
        None if charts is None else _chart(charts.location),
        None if charts is None else _chart(charts.spread),
        () if capability is None else _indices(capability),
        "" if capability is None else _basis(capability, series.unit),
        None if found.strip is None else _strip(found.strip),
        found.drifts,
        found.notes,
    )


def _chart(chart: "ControlChart") -> TrendChart:
    limits = chart.limits
    broken = tuple(BrokenRule(one.at, one.words, one.above) for one in chart.violations)
    return TrendChart(limits.centre, limits.lower, limits.upper, tuple(map(number, chart.plotted.tolist())), broken)


def _indices(found: "Capability") -> tuple[TrendIndex, ...]:
    named = (("Cp", found.cp), ("Cpk", found.cpk), ("Pp", found.pp), ("Ppk", found.ppk))
    return tuple(TrendIndex(name, index.value, index.lower, index.upper, index.reason) for name, index in named)


def _basis(found: "Capability", unit: str) -> str:
    spread = f"mean {found.mean:.5g}, standard deviation {found.overall_sigma:.3g} ({unit})"
    return f"{spread}; distribution: {found.distribution}; limits of confidence {found.confidence:.0%}"


def _strip(found: HeatStrip) -> TrendStrip:
    strips, length = found.strips, found.length_mm
    worst = tuple(tuple(None if value is None else round(value, _DIGITS) for value in map(number, row)) for row in strips.worst_mm.tolist())
    levels = tuple(tuple(None if math.isnan(level) else int(level) for level in row) for row in found.levels.tolist())
    return TrendStrip(
        length,
        tuple(serial or run for serial, run in zip(strips.serial_number, strips.run, strict=True)),
        worst,
        levels,
        tuple(None if slope is None else 1e3 * slope for slope in map(number, found.drift.slope.tolist())),
        tuple((one.from_share * length, one.to_share * length) for one in found.drift.stretches),
    )
