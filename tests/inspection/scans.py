"""Scans of parts whose surface is known, inspected live in batches."""

from typing import Any

import numpy as np

from inspection import InspectionResult, LiveInspection, NominalProfile, ToleranceZone
from tests.inspection import profiles
from tests.inspection.profiles import Array, curve_of

ZONE = ToleranceZone(-0.05, 0.05, 0.005)


def surface(name: str, count: int, seed: int, defect_mm: float = 0.0) -> tuple[Array, Array]:
    """Points of a part in place, in scan order, and their true deviations (material left: out is to the right)."""
    curve = curve_of(name)
    u = profiles.even_in_arc_length(curve, count)
    s = curve.station_mm(u)
    deviation = 0.015 * np.sin(6 * np.pi * s / curve.length_mm) + np.random.default_rng(seed).normal(0, 0.004, count)
    deviation += defect_mm * np.exp(-(((s - 40.0) / 3.0) ** 2))
    return profiles.offset_points(curve, u, -deviation), deviation


def inspect_in_batches(nominal: NominalProfile, points: Array, size: int, **options: Any) -> tuple[LiveInspection, InspectionResult]:
    live = LiveInspection(nominal, ZONE, **options)
    for k in range(0, len(points), size):
        live.add(points[k : k + size])
    return live, live.finish()
