"""What a registration says of itself."""

import numpy as np
import pytest

from inspection import Registration, RigidTransform, deviations, register_coarse, register_fine
from inspection.registration import datum_registration
from tests.inspection import profiles
from tests.inspection.profiles import measured, nominal_of


def test_a_result_says_what_it_is() -> None:
    points = profiles.rotated(measured("P3", 200, 18), 33.0)
    coarse = register_coarse(points, nominal_of("P3"))
    assert isinstance(coarse, Registration)
    assert coarse.iterations == 0
    fine = register_fine(points, nominal_of("P3"), coarse)
    assert fine.covariance.shape == (3, 3)
    assert (np.linalg.eigvalsh(fine.covariance) > 0).all()
    rms = np.sqrt(np.mean(deviations(fine.nominal_from_section.apply(points), nominal_of("P3")).deviation_mm ** 2))
    assert fine.rms_mm == pytest.approx(rms, rel=1e-9)
    assert fine.rms_mm < coarse.rms_mm


def test_a_datum_is_certain_and_leaves_no_point_out() -> None:
    pose = RigidTransform(0.3, np.array([1.0, 2.0]))
    given = datum_registration(pose, 5)
    assert given.nominal_from_section is pose
    assert given.converged
    assert given.iterations == 0
    assert np.isnan(given.rms_mm)
    assert not given.covariance.any()
    assert given.rivals == ()
    assert given.outliers.tolist() == [False] * 5
    for array in (given.covariance, given.centre_mm, given.outliers):
        with pytest.raises(ValueError, match="read-only"):
            array[...] = 1
