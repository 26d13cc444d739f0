"""One fit of several sections: a motion that all share is found, and rings that disagree meet at their mean by length."""

import numpy as np
import pytest

from inspection import RegistrationError, RigidTransform, SectionToFit, WeightName, discretize, fit_together
from tests.inspection import profiles

HERE = RigidTransform.identity()
MOVED = RigidTransform(0.4, np.array([3.0, -2.0]))


def test_a_motion_that_all_sections_share_is_found() -> None:
    nominals = [discretize(profiles.naca(name, chord), samples=1000) for name, chord in (("2412", 100.0), ("4415", 80.0))]
    near = RigidTransform(MOVED.rotation_rad + 0.01, MOVED.translation_mm + 0.2).inverse()
    fit = fit_together([SectionToFit(MOVED.apply(one.points_mm[::7]), one, near) for one in nominals])
    assert fit.converged
    assert fit.rms_mm < 1e-8
    together = fit.nominal_from_section.after(MOVED)
    assert together.rotation_rad == pytest.approx(0.0, abs=1e-10)
    np.testing.assert_allclose(together.translation_mm, 0.0, atol=1e-8)


@pytest.mark.parametrize(("weights", "expected"), [("arc-length", -(3 * 0.02 - 1 * 0.04) / 4), ("points", -(0.02 - 9 * 0.04) / 10)])
def test_rings_that_lie_apart_meet_at_their_mean_by_length_or_by_points(weights: WeightName, expected: float) -> None:
    large, small = (discretize(profiles.circle(radius), samples=3600) for radius in (30.0, 10.0))
    sections = [
        SectionToFit(large.points_mm[::18] + np.array([0.02, 0.0]), large, HERE),
        SectionToFit(small.points_mm[::2] - np.array([0.04, 0.0]), small, HERE),  # nine times as many points on a third of the length
    ]
    fit = fit_together(sections, weights=weights)
    assert fit.converged
    assert fit.nominal_from_section.apply(np.zeros((1, 2)))[0, 0] == pytest.approx(expected, abs=1e-4)


def test_no_section_has_no_fit() -> None:
    with pytest.raises(RegistrationError, match="no section has points"):
        fit_together([])
