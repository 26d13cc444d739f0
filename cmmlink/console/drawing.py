"""The two binary messages with what a page draws: the nominal profile once, and the bins of points that changed.

Their layout stands in `protocol.py`.
"""

from datetime import datetime

import numpy as np

from cmmlink.console.protocol import CLOSED, HEADER, NOMINAL, POINTS
from cmmlink.extremes import BINS, COLUMNS, ChangedBins
from inspection import NominalProfile

_MOST_SAMPLES = 6000  # of the nominal, for drawing


def points_message(changed: ChangedBins, generation: int, verdict_at: datetime | None) -> bytes:
    """The bins that changed; another generation than in the message before makes the page forget all points."""
    rows = len(changed.bins)
    time_ms = verdict_at.timestamp() * 1e3 if verdict_at else 0.0
    columns = changed.extremes.reshape(rows, 2 * COLUMNS).T.astype("<f4")
    return header(POINTS, generation, rows, 0, time_ms, BINS) + changed.bins.astype("<u4").tobytes() + columns.tobytes()


def nominal_message(profile: NominalProfile) -> bytes:
    """The nominal profile, thinned to what a screen can show; corners and ends are kept."""
    n = len(profile)
    step = max(1, -(-n // _MOST_SAMPLES))
    ends = (profile.next_site < 0) | (profile.previous_site < 0)
    kept = np.flatnonzero(ends | (np.arange(n) % step == 0))
    normal = profile.outward * profile.normal
    columns = np.column_stack([profile.station_mm, profile.points_mm, normal])[kept]
    breaks = np.flatnonzero(profile.next_site[kept] < 0)[:-1] + 1
    columns = np.insert(columns, breaks, np.nan, axis=0)
    flags = CLOSED if profile.curve.closed else 0
    return header(NOMINAL, 0, len(columns), flags, 0.0, profile.length_mm) + columns.T.astype("<f4").tobytes()


def header(kind: int, generation: int, rows: int, flags: int, time_ms: float, number: float) -> bytes:
    """The fields that a binary message begins with."""
    return np.array((kind, generation, rows, flags, time_ms, number), dtype=list(HEADER)).tobytes()
