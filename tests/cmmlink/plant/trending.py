"""Results of a part whose profile drifts out at one place, made up: what the trends of a plant are shown with."""

from collections.abc import Sequence
from datetime import UTC, datetime, timedelta
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cmmlink.part_trend import PartTrend, look_at_trend
from cmmlink.plant import STRIP_PARTS, ProfileStrip, ProfileStrips, ResultSeries, StoredRun, StoredValue
from tests.cmmlink.plant.results import a_run

BEGAN = datetime(2026, 3, 2, 6, tzinfo=UTC)
LENGTH_MM, UPPER_MM = 187.5, 0.03
DRIFT_MM = 0.0005  # a run, at three tenths of the length


def drifting_runs(count: int, part: str = "blade", drift_mm: float = DRIFT_MM) -> list[StoredRun]:
    """Runs of a part, one in ten minutes; one in sixteen was not measured in the tenth before the end, so that it is not proven."""
    rng = np.random.default_rng(22)
    share = (np.arange(STRIP_PARTS) + 0.5) / STRIP_PARTS
    still, moving = 0.008 * np.sin(9 * share), np.exp(-(((share - 0.3) / 0.06) ** 2))
    runs = []
    for k in range(count):
        mean = still + rng.normal(0, 0.002, STRIP_PARTS) + drift_mm * k * moving
        partly = k % 16 == 5
        if partly:
            mean[int(0.9 * STRIP_PARTS) :] = np.nan
        worst = mean + np.sign(mean) * 0.003
        form = 2 * float(np.nanmax(np.abs(worst)))
        runs.append(_run(k, part, form, 60 + rng.normal(0, 0.01), partly, (mean, worst)))
    return runs


def _run(k: int, part: str, form: float, chord: float, partly: bool, along: tuple[np.ndarray, np.ndarray]) -> StoredRun:
    verdict = "nonconform" if form > 2 * UPPER_MM else "uncertain" if partly else "conform"
    values = (
        StoredValue("contour", "line-profile", "mm", form, None, 2 * UPPER_MM, 0.002, verdict),
        StoredValue("chord", "chord", "mm", chord, 59.95, 60.05, 0.004, "conform"),
    )
    mean, worst = (column.astype(np.float32) for column in along)
    return a_run(
        k,
        part,
        f"hall-{1 + k % 2}",
        run=f"20260302-{k:04d}",
        serial_number=f"SN-{k:04d}",
        started=BEGAN + timedelta(minutes=10 * k),
        verdict=verdict,
        values=values,
        strip=ProfileStrip(LENGTH_MM, -UPPER_MM, UPPER_MM, mean, worst),
    )


class Remembered:
    """Results that lie in memory, for whoever needs no database."""

    def __init__(self, runs: Sequence[StoredRun]) -> None:
        self.runs = runs

    def series(
        self,
        part: str,
        characteristic: str,
        *,
        station: str | None = None,
        since: datetime | None = None,
        until: datetime | None = None,
        last: int | None = None,
    ) -> ResultSeries:
        found = [run for run in self._between(since, until) if station in (None, run.station)][-(last or 0) :]
        values = [next(one for one in run.values if one.name == characteristic) for run in found]
        value, lower, upper = (numbers([getattr(one, name) for one in values]) for name in ("value", "lower", "upper"))
        verdicts = tuple(one.verdict for one in values)
        runs, stations, serial_numbers = (tuple(getattr(run, name) for run in found) for name in ("run", "station", "serial_number"))
        kind = values[0]
        return ResultSeries(
            part, characteristic, kind.type, kind.unit, value, lower, upper, _began(found), verdicts, runs, stations, serial_numbers
        )

    def _between(self, since: datetime | None, until: datetime | None) -> list[StoredRun]:
        return [run for run in self.runs if (since is None or run.started >= since) and (until is None or run.started < until)]

    def sections(self, part: str) -> list[str]:
        return sorted({run.section for run in self.runs})

    def strips(
        self, part: str, last: int = 60, *, station: str | None = None, section: str = "", until: datetime | None = None
    ) -> ProfileStrips:
        found = [run for run in self._between(None, until) if station in (None, run.station) and run.section == section][-last:]
        strips = [run.strip for run in found if run.strip is not None]
        length, lower, upper = (numbers([getattr(one, name) for one in strips]) for name in ("length_mm", "lower_mm", "upper_mm"))
        mean, worst = (np.array([getattr(one, name) for one in strips]) for name in ("mean_mm", "worst_mm"))
        verdicts = tuple(run.verdict for run in found)
        whose = [tuple(getattr(run, name) for run in found) for name in ("run", "station", "serial_number")]
        return ProfileStrips(mean, worst, length, lower, upper, _began(found), verdicts, *whose)


def numbers(values: Sequence[float | None]) -> NDArray[np.float64]:
    """A column of numbers; nan where there is none."""
    return np.array(values, dtype=np.float64)


def _began(runs: Sequence[StoredRun]) -> NDArray[np.float64]:
    return np.array([run.started.timestamp() for run in runs])


def drifting_trend(count: int = 40, **asked: Any) -> PartTrend:
    """The trend of the contour over so many runs that drift."""
    return look_at_trend(Remembered(drifting_runs(count)), "blade", "contour", **asked)
