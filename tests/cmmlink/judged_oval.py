"""Results of the oval part, judged as its known deviations say."""

from typing import Any

import numpy as np

from inspection import InspectionResult, LiveInspection, NominalProfile, RigidTransform, ToleranceZone
from tests.cmmlink.oval_part import oval_points


def inspect_oval(profile: NominalProfile, deviation_mm: Any, **settings: Any) -> InspectionResult:
    live = LiveInspection(profile, ToleranceZone(-0.05, 0.07, 0.01), datum=RigidTransform.identity(), **settings)
    live.add(oval_points(deviation_mm))
    return live.finish()


def bumped() -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    """Five points in a row above the zone, one apart below it."""
    deviation = np.full(360, 0.01)
    deviation[40:45] = [0.1, 0.12, 0.2, 0.12, 0.1]
    deviation[200] = -0.09
    return deviation
