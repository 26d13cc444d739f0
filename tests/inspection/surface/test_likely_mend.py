"""Scans in a wrong unit or of the other hand are refused by name; a part that merely fails is judged."""

import re

import numpy as np
import pytest
from numpy.typing import NDArray

from inspection import NotMeasured, ToleranceZone, Verdict
from inspection.surface import RigidMotion, SurfaceTerms, TriangleSurface, judge_surface
from tests.inspection.surface import meshes

Array = NDArray[np.float64]


def leaning(corners: Array) -> Array:
    """Places (.., 3) moved so that what was a prism has a handedness."""
    x, y, z = np.moveaxis(corners, -1, 0)
    return np.stack([x + 0.2 * z, y + 0.15 * x * z, z + 0.1 * x * y], axis=-1)


PART = TriangleSurface(10 * leaning(meshes.prism(meshes.NOTCHED, 2.0)))
ZONE = SurfaceTerms(ToleranceZone(-0.05, 0.05))


def scan(form_mm: float = 0.0) -> Array:
    """Points (1000, 3) of the part, turned, with a bulge of so much."""
    places, normals = PART.sample(1000)
    away = np.linalg.norm(places - places[700], axis=1)
    bulged = places + form_mm * np.exp(-((away / 4.0) ** 2))[:, None] * normals
    return RigidMotion.about((0, 0, 0), (0.3, -0.4, 1.0), (40, 5, -9)).apply(bulged)


@pytest.mark.parametrize(("factor", "told"), [(1 / 25.4, "25.4 times as large.*--unit inch"), (1e-3, "in metres")])
def test_a_scan_in_another_unit_is_refused_with_the_unit(factor: float, told: str) -> None:
    with pytest.raises(NotMeasured, match=told):
        judge_surface(scan() * factor, PART, ZONE)


def test_a_scan_of_the_part_of_the_other_hand_is_refused() -> None:
    with pytest.raises(NotMeasured, match="only mirrored"):
        judge_surface(scan()[:, [1, 0, 2]], PART, ZONE)


def test_a_unit_is_named_at_a_known_pose_too() -> None:
    with pytest.raises(NotMeasured, match="--nominal-unit inch"):
        judge_surface(PART.sample(1000)[0] * 25.4, PART, SurfaceTerms(ToleranceZone(-0.05, 0.05), fit="none"))


def test_a_part_that_fails_is_judged() -> None:
    assert judge_surface(scan(form_mm=-1.5), PART, ZONE).verdict is not Verdict.CONFORM


def test_a_tiny_scan_of_a_flat_place_is_no_scan_of_the_whole_in_another_unit() -> None:
    places, normals = PART.sample(20_000)
    patch = places[np.linalg.norm(places - places[normals[:, 0] > 0.9][0], axis=1) < 2.0]
    assert judge_surface(patch, PART, ZONE).verdict is Verdict.UNCERTAIN


@pytest.mark.parametrize(("shift_mm", "told"), [(1.5, r"1\.500 mm out .*--tip-radius 1\.5"), (-0.7, "0.700 mm inside .*taken off twice")])
def test_points_that_are_all_out_by_the_same_are_told_to_be_perhaps_those_of_a_ball(shift_mm: float, told: str) -> None:
    ball = TriangleSurface(meshes.sphere(8, radius=20.0))
    places, normals = ball.sample(4000)
    found = judge_surface(places + shift_mm * normals, ball, SurfaceTerms(ToleranceZone(-0.05, 0.05), fit="none", gross_mm=3.0))
    assert found.verdict is Verdict.NONCONFORM
    assert re.search(told, found.reasons[-1].words)
    assert "material" in found.reasons[-1].words
