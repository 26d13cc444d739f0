"""A judged scan as pictures and reports take it: the same whether it was just measured or is read from its record."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from inspection import JudgedRows, ToleranceZone, Verdict

if TYPE_CHECKING:  # a process that only draws loads nothing of what judges
    from inspection import InspectionResult

Array = NDArray[np.float64]
Rows = NDArray[np.int64]
Blocks = Callable[[], Iterable[JudgedRows]]

_VERDICTS = {verdict.word: verdict for verdict in Verdict}


@dataclass(frozen=True, slots=True, eq=False)
class JudgedScan:
    """The points of a judged scan, and what pictures say of them.

    station_mm, deviation_mm, verdicts : (m,) of every received point, NaN and NOT_JUDGED where it was rejected
    rows_at    : gives whole rows by their indices (k,) in rising order
    worst      : index of the point farthest from the middle of the zone, None where nothing was judged
    gap_max_mm : the longest gap that counted as measured
    u_mm       : (k, 2) stations and the expanded uncertainty there, where a budget was stated; (0, 2) without one
    """

    station_mm: Array
    deviation_mm: Array
    verdicts: NDArray[np.int8]
    rows_at: Callable[[Rows], JudgedRows]
    worst: int | None
    zone: ToleranceZone
    verdict: Verdict
    coverage: float
    gap_max_mm: float
    out_of_tolerance: int
    fit: str
    method: str
    u_mm: Array


def scan_of(result: "InspectionResult") -> JudgedScan:
    """What was just measured."""
    found, along = result.uncertainty, np.empty((0, 2))
    if found is not None and result.zone.guard_mm:
        rows = found.telling_places()
        along = np.column_stack([found.station_mm[rows], found.expanded_mm[rows]])
    return JudgedScan(
        result.station_mm,
        result.deviation_mm,
        result.verdicts,
        result.rows_at,
        result.worst,
        result.zone,
        result.verdict,
        result.coverage,
        result.gap_max_mm,
        result.out_of_tolerance,
        result.fit,
        result.method,
        along,
    )


def scan_on_record(document: Mapping[str, Any], zone: ToleranceZone, blocks: Blocks) -> JudgedScan:
    """A scan from its record: the result as JSON, the zone that was applied, and what gives its rows, as often as it is called."""
    columns = [(rows.station_mm, rows.deviation_mm, rows.verdicts) for rows in blocks()]
    station, deviation, verdicts = (np.concatenate(parts) for parts in zip(*columns, strict=True))
    away = np.where(np.isnan(deviation), -1.0, np.abs(deviation - zone.middle_mm))
    places = (document.get("uncertainty") or {}).get("stations", ()) if zone.guard_mm else ()
    return JudgedScan(
        station,
        deviation,
        verdicts,
        lambda rows: _rows_in(blocks(), rows),
        int(away.argmax()) if document["judged"] else None,
        zone,
        _VERDICTS[document["verdict"]],
        document["coverage"],
        document["largest_gap"]["allowed_mm"] if document["largest_gap"] else np.inf,  # earlier versions knew no gaps
        document["out_of_tolerance"],
        document["fit"],
        document["method"],
        np.array([(place["station_mm"], place["expanded_mm"]) for place in places]).reshape(-1, 2),
    )


def _rows_in(blocks: Iterable[JudgedRows], wanted: Rows) -> JudgedRows:
    """Pick rows by their indices, which rise, out of blocks that follow one another."""
    first, picked = 0, []
    for block in blocks:
        here = wanted[(wanted >= first) & (wanted < first + block.received)] - first
        columns = (block.actual_mm, block.foot_mm, block.station_mm, block.deviation_mm, block.verdicts, block.rejection)
        picked.append([column[here] for column in columns])
        first += block.received
    actual, foot, station, deviation, verdicts, rejection = (np.concatenate(parts) for parts in zip(*picked, strict=True))
    return JudgedRows(actual, foot, station, deviation, verdicts, rejection)


def unmeasured_stretches(station_mm: Array, length_mm: float, closed: bool, gap_max_mm: float) -> list[tuple[float, float]]:
    """The stretches without a judged point that are longer than what counts as measured, from stations (m,), NaN where not judged.

    One that crosses the seam of a closed profile comes in two pieces. The points are not sorted: their extremes in shares of the length
    that are shorter than any such stretch are enough. Stretches too short to be seen on a drawing are left out.
    """
    shares = int(np.clip(np.ceil(4 * length_mm / max(gap_max_mm, 1e-9)), 64, 1 << 16))
    low, high = np.full(shares, np.inf), np.full(shares, -np.inf)
    for first in range(0, len(station_mm), 1 << 16):
        station = station_mm[first : first + (1 << 16)]
        station = station[np.isfinite(station)]
        share = np.minimum((station * (shares / length_mm)).astype(np.int64), shares - 1)
        np.minimum.at(low, share, station)
        np.maximum.at(high, share, station)
    met = np.isfinite(low)
    if not met.any():
        return [(0.0, length_mm)]
    low, high = low[met], high[met]
    found = [(start, end) for start, end in zip(high[:-1].tolist(), low[1:].tolist(), strict=True) if end - start > gap_max_mm]
    before, after = float(low[0]), length_mm - float(high[-1])
    if (before + after if closed else before) > gap_max_mm:
        found.insert(0, (0.0, before))
    if (before + after if closed else after) > gap_max_mm:
        found.append((length_mm - after, length_mm))
    return found
