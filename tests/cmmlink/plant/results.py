"""Runs as a station pushes them, made up: the k-th began k hours after the first."""

from dataclasses import replace
from datetime import UTC, datetime, timedelta
from typing import Any

import numpy as np

from cmmlink.plant import STRIP_PARTS, ProfileStrip, StoredRun, StoredValue

BEGAN = datetime(2026, 3, 1, 12, tzinfo=UTC)


def strip(offset: float) -> ProfileStrip:
    """Deviations that rise along the profile; nothing was judged in the last part."""
    mean = np.linspace(offset, offset + 0.01, STRIP_PARTS, dtype=np.float32)
    mean[-1] = np.nan
    return ProfileStrip(123.5, -0.05, None, mean, 2 * mean)


def a_run(k: int, part: str = "blade", station: str = "hall-1", **others: Any) -> StoredRun:
    """The k-th run of a part."""
    values = (
        StoredValue("profile", "line-profile", "mm", 0.04 + k / 1000, None, 0.1, 0.002, "conform"),
        StoredValue("chord", "chord", "mm", 60 + k / 100, 59.9, 60.1, 0.004, "uncertain"),
    )
    run = StoredRun(
        station, f"20260301-{k:04d}", part, "", f"SN {k}", "Ada", BEGAN + timedelta(hours=k), "complete", "uncertain", "cmmlink 1",
        f"{k:064x}", "1" * 64, "2" * 64, 1000, 990, 10, 3, 7, False, values, strip(k / 1000),
    )  # fmt: skip
    return replace(run, **others)


def plain(run: StoredRun) -> tuple[object, ...]:
    """A run as values that can be compared."""
    strip = run.strip
    told = None if strip is None else (strip.length_mm, strip.lower_mm, strip.upper_mm, strip.mean_mm.tobytes(), strip.worst_mm.tobytes())
    return (*[getattr(run, name) for name in run.__slots__ if name != "strip"], told)
