"""Thickness and camber of fourteen airfoil files against engeom, an independent program that works on polylines.

Its circles touch a polygon of 4,000 corners, which lies within 4e-6 mm of the spline but for the nose: that bounds what can agree.
"""

import importlib

import numpy as np
import pytest

from inspection import find_camber_line, maximum_thickness
from inspection.characteristics.inscribed import inscribe_circles
from tests.inspection.characteristics.airfoils import Array, file_section

CORNERS = 4000
TABLE = ("n0012", "goe404", "mh42", "rae2822", "s1223", "naca65410", "e387")
OTHERS = ("ag35", "clarky", "dae11", "fx63137", "goe227", "s1223_hires", "sc20714")


def engeom_circles(name: str) -> tuple[Array, Array]:
    """Centres (k, 2) and radii (k,) of the circles that engeom inscribes."""
    airfoil2 = pytest.importorskip("engeom.airfoil2", reason="engeom is not installed: pip install 'cmmlink[bench]' brings it")
    geom2 = importlib.import_module("engeom.geom2")
    curve = file_section(name).curve
    fine = np.linspace(*curve.domain, 20_001)
    corners = curve.point(np.interp(np.linspace(0, curve.length_mm, CORNERS), curve.station_mm(fine), fine))
    if np.hypot(*(corners[0] - corners[-1])) < 1e-6:
        corners = corners[:-1]
    try:
        circles = airfoil2.extract_inscribed_circles(geom2.Curve2(corners, tol=1e-9), 1e-4)
    except ValueError as error:
        pytest.skip(f"engeom gives up on {name}: {error}")
    return np.array([(one.center.x, one.center.y) for one in circles]), np.array([one.radius for one in circles])


@pytest.mark.parametrize("name", TABLE + OTHERS)
def test_thickness_and_camber_line_agree_with_engeom(name: str) -> None:
    centres, radii = engeom_circles(name)
    section = file_section(name)
    camber = find_camber_line(section)
    assert maximum_thickness(section, camber).value == pytest.approx(2 * radii.max(), abs=1e-4)
    ours = inscribe_circles(section, np.linspace(camber.circles.u.min(), camber.circles.u.max(), 2001))
    nearest = np.array([int(np.argmin(np.hypot(*(ours.centre_mm - one).T))) for one in centres])
    inner = (nearest > 0) & (nearest < 2000)
    across, along = centres - ours.centre_mm[nearest], ours.along()[nearest]
    off = np.abs(along[:, 0] * across[:, 1] - along[:, 1] * across[:, 0])[inner]
    assert inner.sum() > 100
    assert off.max() < 1e-4
