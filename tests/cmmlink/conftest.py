"""Parts that several tests inspect: a blade as a surface without noise with its nominal, and the oval."""

from pathlib import Path

import numpy as np
import pytest
from scipy.interpolate import BSpline

from inspection import NominalProfile
from tests.cmmlink.oval_part import oval_profile
from tests.drivers.surface.ct_phantom import (
    GOE404,
    airfoil,
    write_spline,
)
from tests.drivers.surface.meshes import binary_stl, tube, write


@pytest.fixture(scope="module")
def spline() -> BSpline:
    return airfoil(GOE404, 60.0)


@pytest.fixture
def blade(tmp_path: Path, spline: BSpline) -> tuple[Path, Path]:
    """A straight blade from z = 0 to 20 mm, and its nominal."""
    profile = spline(np.linspace(0, 1, 600))
    return write(tmp_path / "blade.stl", binary_stl(tube(profile, np.array([0.0, 20.0])))), write_spline(spline, tmp_path / "blade.yaml")


@pytest.fixture(scope="module")
def profile() -> NominalProfile:
    return oval_profile()
