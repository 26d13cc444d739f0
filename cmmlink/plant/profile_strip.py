"""The deviations of one run along the profile, in even parts of its length: what heat strips and studies along the profile read."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

STRIP_PARTS = 120


@dataclass(frozen=True, slots=True, eq=False)
class ProfileStrip:
    """Deviations in 120 even parts of the nominal's length.

    length_mm : of the nominal
    lower_mm, upper_mm : the zone of the run; None where there is no such limit
    mean_mm   : (120,) float32, mean deviation of the points of each part; NaN where none was judged
    worst_mm  : (120,) float32, the deviation farthest from the middle of the zone, or from zero where a limit is missing; NaN likewise
    """

    length_mm: float
    lower_mm: float | None
    upper_mm: float | None
    mean_mm: NDArray[np.float32]
    worst_mm: NDArray[np.float32]

    def __post_init__(self) -> None:
        for array in (self.mean_mm, self.worst_mm):
            if array.shape != (STRIP_PARTS,):
                raise ValueError(f"expected ({STRIP_PARTS},) for each, got {array.shape}")
            array.setflags(write=False)


def strip_of(
    rows: Iterable[tuple[NDArray[np.float64], NDArray[np.float64]]], length_mm: float, lower_mm: float | None, upper_mm: float | None
) -> ProfileStrip:
    """The strip of judged points that come piece by piece, each piece as their stations and their deviations, mm, (m,) each."""
    count, total = np.zeros(STRIP_PARTS), np.zeros(STRIP_PARTS)
    highest, lowest = np.full(STRIP_PARTS, -np.inf), np.full(STRIP_PARTS, np.inf)
    for station_mm, deviation_mm in rows:
        known = np.isfinite(station_mm) & np.isfinite(deviation_mm)
        part = np.clip(station_mm[known] * (STRIP_PARTS / length_mm), 0, STRIP_PARTS - 1).astype(np.intp)
        count += np.bincount(part, minlength=STRIP_PARTS)
        total += np.bincount(part, deviation_mm[known], minlength=STRIP_PARTS)
        np.maximum.at(highest, part, deviation_mm[known])
        np.minimum.at(lowest, part, deviation_mm[known])
    seen = count > 0
    mean = np.divide(total, count, out=np.full(STRIP_PARTS, np.nan), where=seen)
    middle = 0.0 if lower_mm is None or upper_mm is None else (lower_mm + upper_mm) / 2  # what is out is farther from it than what is not
    worst = np.where(seen, np.where(highest - middle >= middle - lowest, highest, lowest), np.nan)
    return ProfileStrip(length_mm, lower_mm, upper_mm, mean.astype(np.float32), worst.astype(np.float32))
