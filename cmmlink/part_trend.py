"""The trend of a part: one of its characteristics over the newest runs, and where along the profile those runs drift.

What is drawn and told of it, on the page, as JSON, as a workbook and on paper, is this one record.
"""

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from datetime import datetime
from itertools import compress
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
from numpy.typing import NDArray

from cmmlink import plant  # whose statistics are loaded when they serve

if TYPE_CHECKING:
    from cmmlink.plant import Drift, ProfileStrips, ResultSeries, Trend

MOST_STRIPS = 60  # runs of a heat strip: more rows are not told apart
LEVELS = (0.2, 0.6, 1.0)  # of the way from the middle of the zone to its limit: where the colours of a heat strip change


class Results(Protocol):
    """What is asked of the results of a plant; a ResultsDatabase answers it."""

    def series(
        self,
        part: str,
        characteristic: str,
        *,
        station: str | None = None,
        since: datetime | None = None,
        until: datetime | None = None,
        last: int | None = None,
    ) -> "ResultSeries":
        """The values of one characteristic of a part, oldest first."""

    def sections(self, part: str) -> list[str]:
        """The heights of a part's sections of a surface; empty text among them where there are runs that are none."""

    def strips(
        self, part: str, last: int = 60, *, station: str | None = None, section: str = "", until: datetime | None = None
    ) -> "ProfileStrips":
        """The deviations along the profile of the newest runs of a part, oldest first."""


@dataclass(frozen=True, slots=True, eq=False)
class HeatStrip:
    """The profiles of the newest runs of a part, one row a run, the oldest first, and their drift.

    strips : (k, 120); a run with a nominal of another length is not among them
    levels : (k, 120) from -3 to 3, by how far the worst deviation lies from the middle of the zone of that run, positive out of material;
             3 and -3 are out of tolerance. nan where nothing was measured or no zone is known
    drift  : of the mean deviations, in mm a run
    """

    strips: "ProfileStrips"
    levels: NDArray[np.float64]
    drift: "Drift"

    @property
    def length_mm(self) -> float:
        """The length of the nominal."""
        return float(self.strips.length_mm[-1])


@dataclass(frozen=True, slots=True, eq=False)
class PartTrend:
    """One characteristic of a part over the newest runs.

    station : that the runs are of; None: of all
    strip   : None where no run has a profile on record
    drifts  : the stretches that drift, the steepest first, or that there is none, in whole sentences
    notes   : what was assumed and what speaks against it, likewise
    """

    series: "ResultSeries"
    trend: "Trend"
    station: str | None
    strip: HeatStrip | None
    drifts: tuple[str, ...]
    notes: tuple[str, ...]

    @property
    def last_rows(self) -> NDArray[np.int64]:
        """The row of the run that each plotted value ends with: of single values every row, of subgroups the last of each."""
        size, runs = self.trend.subgroup, len(self.series.run)
        return np.arange(size - 1 + runs % size, runs, size)


def look_at_trend(
    results: Results,
    part: str,
    characteristic: str,
    *,
    station: str | None = None,
    since: datetime | None = None,
    until: datetime | None = None,
    last: int = 100,
    subgroup: int = 1,
) -> PartTrend:
    """The trend of a characteristic over the newest runs of a part.

    until    : a moment, before which the runs began that are looked at; None: all of them
    last     : how many of the newest runs are looked at
    subgroup : how many runs in a row were made under the same conditions; 1: each stands alone
    """
    series = results.series(part, characteristic, station=station, since=since, until=until, last=last)
    unproven = sum(verdict == "uncertain" for verdict in series.verdict)
    is_form = series.type in plant.FORM_TYPES
    trend = plant.trend_of(series.value, series.lower, series.upper, is_form=is_form, subgroup=subgroup, unproven=unproven)
    section = next((height for height in results.sections(part) if height and characteristic.endswith(f" at {height}")), "")
    strips = results.strips(part, min(last, MOST_STRIPS), station=station, section=section, until=until)
    strips = strips if since is None else _only(strips, strips.started_s >= since.timestamp())
    strip, told = heat_strip_of(strips) if strips.run else (None, ("No run has a profile on record.",))
    left = (f"Left out: {series.left_out} values of the same name but of another type or unit.",) if series.left_out else ()
    return PartTrend(series, trend, station, strip, _drift_words(strip), (*trend.notes, *left, *told))


def _drift_words(strip: HeatStrip | None) -> tuple[str, ...]:
    if strip is None or not np.isfinite(strip.drift.slope).any():
        return ()
    runs, length = len(strip.strips.run), strip.length_mm
    if not strip.drift.stretches:
        return (f"No place along the profile drifts significantly over the last {runs} runs.",)
    return tuple(
        f"The profile drifts from station {one.from_share * length:.2f} to {one.to_share * length:.2f} mm: "
        f"{1e3 * one.steepest:+.3g} \u00b5m a run at station {one.at_share * length:.2f} mm, "
        f"{one.change:+.4f} mm over the last {runs} runs."
        for one in strip.drift.stretches
    )


def heat_strip_of(strips: "ProfileStrips") -> tuple[HeatStrip, Sequence[str]]:
    """The heat strip of runs, of which there is one at least, and what stands beside it."""
    same = strips.length_mm == strips.length_mm[-1]
    left, kept = int((~same).sum()), _only(strips, same)
    levels = levels_of(kept.worst_mm, kept.lower_mm, kept.upper_mm)
    drift = plant.drift_of(kept.mean_mm)
    notes = list(drift.notes)
    if left:
        notes.append(f"Left out of the heat strip: {left} runs whose nominal has another length.")
    if np.isnan(kept.lower_mm * kept.upper_mm).any():
        notes.append("Runs without a zone of two limits have no colours in the heat strip.")
    return HeatStrip(kept, levels, drift), notes


def levels_of(worst_mm: NDArray[np.float32], lower_mm: NDArray[np.float64], upper_mm: NDArray[np.float64]) -> NDArray[np.float64]:
    """The levels (k, p) of the worst deviations (k, p) of k runs, each within its own zone (k,)."""
    middle, half = (lower_mm + upper_mm)[:, None] / 2, (upper_mm - lower_mm)[:, None] / 2
    share = (worst_mm.astype(np.float64) - middle) / half
    level = np.sign(share) * np.searchsorted(LEVELS, np.abs(share) * (1 - 1e-6))  # float32 has a limit itself inside
    return np.where(np.isnan(share), np.nan, level)


def _only(strips: "ProfileStrips", kept: NDArray[np.bool_]) -> "ProfileStrips":
    """Some of the runs, by a mask (k,)."""
    columns: dict[str, Any] = {field.name: getattr(strips, field.name) for field in fields(strips)}
    for name, column in columns.items():
        columns[name] = tuple(compress(column, kept)) if isinstance(column, tuple) else column[kept]
    return replace(strips, **columns)
