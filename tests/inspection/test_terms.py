"""Terms of an inspection that cannot be."""

from typing import Any

import numpy as np
import pytest

from inspection import LiveInspection, RigidTransform
from inspection.terms import Terms
from tests.inspection.profiles import nominal_of
from tests.inspection.scans import ZONE

CANNOT_BE: list[tuple[dict[str, Any], str]] = [
    ({"fit": "hope"}, "fit must be one of best-fit, minimum-zone, none, not 'hope'"),
    ({"method": "spline"}, "method must be one of exact, circle, chord, pcp, veaw, hermite, inversion, not 'spline'"),
    ({"tip_radius_mm": -1.0}, "tip radius -1 mm: must be a finite number, zero or more"),
    ({"tip_radius_mm": float("nan")}, "tip radius nan mm: must be a finite number, zero or more"),
]


@pytest.mark.parametrize(("options", "message"), CANNOT_BE, ids=str)
def test_options_that_cannot_be_are_refused_at_the_start(options: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        LiveInspection(nominal_of("P3"), ZONE, **options)


def test_the_pose_is_known_by_a_datum_or_when_nothing_is_fitted() -> None:
    def terms(datum: RigidTransform | None, fit: Any) -> Terms:
        return Terms(nominal_of("P3"), ZONE, datum, fit, "exact", 0.0, np.inf, 0.0, False)

    datum = RigidTransform(0.5, np.array([1.0, 2.0]))
    assert terms(datum, "best-fit").known_pose is datum
    assert terms(datum, "none").known_pose is datum
    assert terms(None, "best-fit").known_pose is None
    still = terms(None, "none").known_pose
    assert still is not None
    assert still.rotation_rad == 0
    assert not still.translation_mm.any()
