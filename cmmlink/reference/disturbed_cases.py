"""Cases about scans that are not whole or not clean: points that are none of the part, and parts that were measured in part.

None of them can prove that a part conforms: their verdict is uncertain, and what is known of the rest stays true.
"""

from collections.abc import Iterator
from dataclasses import replace
from decimal import Decimal
from typing import Any

import numpy as np

from cmmlink.reference.balance import without_motion
from cmmlink.reference.case import ReferenceCase
from cmmlink.reference.deviation_cases import Build, feet_of, form, known_at
from cmmlink.reference.exact_curve import ExactCurve
from cmmlink.reference.exact_numbers import Number, as_array
from cmmlink.reference.laying import Asked, Laid, Pose, case_of, lay
from cmmlink.reference.shapes import cam, open_wave

_SETTINGS: dict[str, Any] = {"registration": {"fit": "best-fit"}, "weights": "points", "rule": "best-fit"}
_LIMITS = (-0.06, 0.06)


def builders() -> Iterator[Build]:
    """What builds each case."""
    yield lambda: _outliers("outliers-closed", cam(), Pose.of("-28", "9", "-14"), {12: "4", 77: "-6.5", 150: "9", 201: "2.5", 266: "-3"})
    yield lambda: _outliers("outliers-open", open_wave(), Pose.of("95", "-70", "8"), {31: "7", 32: "7.5", 33: "6", 240: "-2.5"})
    yield lambda: _part_of("half-of-it", cam(), Pose.of("41", "33", "12"), (("0.1", "0.6", 150),))
    yield lambda: _part_of("a-stretch-missing", cam(), Pose.of("-172", "-8", "51"), (("0", "0.3", 90), ("0.37", "1", 190)))
    yield _gap_at_the_datum


def _outliers(name: str, curve: ExactCurve, pose: Pose, far: dict[int, Number]) -> ReferenceCase:
    """A best fit of all points but a few that lie millimetres off. far : by row, how far."""
    feet = feet_of(curve, 300)
    kept = [row for row in range(len(feet)) if row not in far]
    found = without_motion([feet[row] for row in kept], form(len(kept), "0.02"))
    deviation = [Decimal(far.get(row, 0)) for row in range(len(feet))]
    for row, value in zip(kept, found, strict=True):
        deviation[row] = value
    laid = lay(feet, deviation, pose)
    part = Laid(pose, [laid.measured[i] for i in kept], [laid.placed[i] for i in kept], [laid.deviation[i] for i in kept])
    worst = max(kept, key=lambda row: abs(laid.deviation[row]))
    known = as_array(laid.deviation)
    known[sorted(far)] = np.nan
    about = f"{len(far)} points lie millimetres off the part; the pose is that of least squares of all others, which count alike."
    settings = {**_SETTINGS, "registration": {"fit": "best-fit", "reject_outliers": True}}
    asked = Asked(name, "disturbed", about, _LIMITS, "uncertain", settings)
    place = replace(part.worst, row=worst)
    return case_of(asked, curve, laid, deviation=known, worst=place, rms=part.rms, outliers=tuple(sorted(far)))


def _part_of(name: str, curve: ExactCurve, pose: Pose, stretches: tuple[tuple[Number, Number, int], ...]) -> ReferenceCase:
    """A best fit of a part that was not measured everywhere."""
    feet = [curve.foot(u) for first, last, count in stretches for u in curve.spread(count, first, last)]
    laid = lay(feet, without_motion(feet, form(len(feet), "0.02")), pose)
    about = "A part of the profile was not measured: deviations and best fit of the rest are known, and conformity cannot be proven."
    return case_of(Asked(name, "disturbed", about, _LIMITS, "uncertain", _SETTINGS), curve, laid)


def _gap_at_the_datum() -> ReferenceCase:
    curve = open_wave()
    feet = [curve.foot(u) for first, last, count in (("0", "0.5", 90), ("0.56", "1", 80)) for u in curve.spread(count, first, last)]
    about = "A stretch of an open curve was not measured: the deviations of the rest are known, and conformity cannot be proven."
    deviation = form(len(feet), "0.03")
    return known_at("gap-at-the-datum", about, curve, feet, deviation, Pose.of("73", "5", "5"), limits_mm=_LIMITS, verdict="uncertain")
