"""The two binary messages to a page: the nominal profile once, and the bins that changed. Little-endian, float32.

Every message begins with 32 bytes: kind u32, generation u32, rows u32, flags u32, time of the newest verdict f64 (ms since
1970, 0 for none), a number f64. Then come columns, one after the other, `rows` values each:

points  (kind 1): bin u32; of the lowest, then of the highest point in the bin: station, deviation, foot x, y, normal x, y,
                  verdict code f32. The number is how many bins there are.
nominal (kind 2): station, x, y, outward normal x, y, f32; NaN in every column between two pieces. Flag 1: closed. The number is
                  the length in mm.
"""

import struct
from datetime import datetime

import numpy as np

from cmmlink.console.extremes import BINS, ChangedBins
from inspection import NominalProfile

POINTS, NOMINAL = 1, 2
_HEAD = struct.Struct("<4I2d")
_MOST_SAMPLES = 6000  # of the nominal, for drawing


def points_message(changed: ChangedBins, verdict_at: datetime | None) -> bytes:
    """The bins that changed."""
    rows = len(changed.bins)
    time_ms = verdict_at.timestamp() * 1e3 if verdict_at else 0.0
    columns = changed.extremes.reshape(rows, 14).T.astype("<f4")
    return _HEAD.pack(POINTS, changed.generation, rows, 0, time_ms, BINS) + changed.bins.astype("<u4").tobytes() + columns.tobytes()


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
    head = _HEAD.pack(NOMINAL, 0, len(columns), int(profile.curve.closed), 0.0, profile.length_mm)
    return head + columns.T.astype("<f4").tobytes()
