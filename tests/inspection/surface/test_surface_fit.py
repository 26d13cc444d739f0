"""Poses in six freedoms: known motions found again, whatever the order and density; what is not determined is said."""

import numpy as np
import pytest
from numpy.typing import NDArray

from inspection import RegistrationError
from inspection.surface import PatchSurface, RigidMotion, TriangleSurface, register_surface, surface_fit
from tests.inspection.surface import faces, meshes

Array = NDArray[np.float64]
NOTCHED = TriangleSurface(meshes.prism(meshes.NOTCHED, 2.0))


def scan_of(surface: TriangleSurface | PatchSurface, count: int, motion: RigidMotion) -> Array:
    places, _ = surface.sample(count)
    return motion.inverse().apply(places)


def apart(one: RigidMotion, other: RigidMotion, points: Array) -> float:
    return float(np.abs(one.apply(points) - other.apply(points)).max())


@pytest.mark.parametrize(("form_mm", "noise_mm"), [(0.0, 0.0), (0.02, 0.005)])
def test_a_motion_of_one_degree_and_one_millimetre_is_found_in_six_steps(form_mm: float, noise_mm: float) -> None:
    """Against the motion itself where there is no form error, else against where the squares have no slope left."""
    surface = PatchSurface([faces.blade(40, 5)])
    places, normals = surface.sample(1200)
    rng = np.random.default_rng(7)
    form = form_mm * np.sqrt(2) * np.sin(places @ np.array([0.11, 0.07, 0.05])) + noise_mm * rng.normal(size=len(places))
    for turn, shift in (((0.6, -0.5, 0.6), (0.5, -0.6, 0.6)), ((-0.2, 0.9, 0.38), (-0.7, 0.1, 0.7))):
        motion = RigidMotion.about((0, 0, 70), np.radians(turn), shift)
        points = motion.inverse().apply(places + form[:, None] * normals)
        found = register_surface(points, surface, RigidMotion.identity())
        assert found.converged
        assert found.steps <= 6
        again = register_surface(points, surface, found.nominal_from_scan) if form_mm else found
        exact = again.nominal_from_scan if form_mm else motion
        assert apart(found.nominal_from_scan, exact, points) < 1e-9 * (1 if form_mm else 10)  # feet to 1e-11, a weak direction of 80
        assert found.rms_mm < 1e-10 or form_mm


def test_many_points_are_found_by_a_choice_that_goes_ahead(monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(8)
    motion = RigidMotion.about((2, 1, 1), (0.02, -0.01, 0.03), (0.1, 0.05, -0.1))
    points = scan_of(NOTCHED, 6000, motion) + rng.normal(0, 0.01, (6000, 3))
    at_once = register_surface(points, NOTCHED, RigidMotion.identity())
    monkeypatch.setattr(surface_fit, "_MANY", 5000)
    monkeypatch.setattr(surface_fit, "_AHEAD", 500)
    found = register_surface(points, NOTCHED, RigidMotion.identity())
    assert found.converged
    assert apart(found.nominal_from_scan, at_once.nominal_from_scan, points) < 1e-9


def test_random_poses_of_a_whole_part_are_all_found() -> None:
    rng = np.random.default_rng(1)
    for _ in range(3):
        motion = RigidMotion.about((1, 1, 1), rng.normal(size=3) * 2, rng.uniform(-50, 50, 3))
        points = scan_of(NOTCHED, 700, motion)
        found = register_surface(points, NOTCHED)
        assert apart(found.nominal_from_scan, motion, points) < 1e-9
        assert found.rivals == 0


def test_a_scan_of_a_part_is_found_by_pairs_where_axes_lead_astray() -> None:
    """A quarter of a mould: its principal axes have nothing to do with those of the whole, and lead to a pose 100 mm off."""
    surface = PatchSurface([faces.mould()])
    places, normals = surface.sample(4000)
    quarter = (places[:, 0] < 55) & (places[:, 1] < 65)
    rng = np.random.default_rng(7)
    scan = places[quarter] + rng.normal(0, 0.005, (np.count_nonzero(quarter), 1)) * normals[quarter]
    motion = RigidMotion.about((3, 5, 1), (1.0, -2.0, 0.7), (40, -20, 90))
    points = motion.inverse().apply(scan)
    found = register_surface(points, surface)
    assert apart(found.nominal_from_scan, motion, points) < 0.02
    assert found.rivals == 0


def test_what_a_scan_of_a_part_leaves_open_is_said() -> None:
    """Half of a box fits at either end and turned over: no fit can tell, so the others are counted."""
    surface = PatchSurface(faces.box((4.0, 3.0, 2.0)))
    places, _ = surface.sample(2000)
    found = register_surface(RigidMotion.about((0, 0, 0), (0.4, 0.2, 1.3), (5, 0, 0)).apply(places[places[:, 0] < 2]), surface)
    assert found.rms_mm < 1e-6
    assert found.rivals >= 3


def test_a_symmetric_part_has_rivals() -> None:
    surface = PatchSurface(faces.box((4.0, 3.0, 2.0)))
    found = register_surface(scan_of(surface, 900, RigidMotion.about((0, 0, 0), (0.1, 0.2, 0.3), (5, 0, 0))), surface)
    assert found.rms_mm < 1e-10
    assert found.rivals == 3


@pytest.mark.parametrize("noise_mm", [0.0, 0.01])
def test_of_the_poses_of_a_symmetric_part_that_of_its_own_coordinates_is_taken(noise_mm: float) -> None:
    surface, rng = PatchSurface(faces.box((4.0, 3.0, 2.0))), np.random.default_rng(3)
    for turn in ((0.2, -0.3, 0.1), (-0.1, 0.1, 0.4), (0.3, 0.2, -0.3)):
        motion = RigidMotion.about((0, 0, 0), turn, (5, 0, 0))
        points = scan_of(surface, 900, motion)
        found = register_surface(points + rng.normal(0, noise_mm, points.shape), surface)
        assert found.rivals == 3
        assert apart(found.nominal_from_scan, motion, points) < 10 * noise_mm + 1e-9


def test_no_bit_of_the_pose_depends_on_the_order_and_density_hardly_moves_it() -> None:
    rng = np.random.default_rng(2)
    motion = RigidMotion.about((2, 1, 1), (0.02, -0.01, 0.03), (0.1, 0.05, -0.1))
    points = scan_of(NOTCHED, 3000, motion) + rng.normal(0, 0.01, (3000, 3))
    first = register_surface(points, NOTCHED, RigidMotion.identity())
    order = rng.permutation(len(points))
    again = register_surface(points[order], NOTCHED, RigidMotion.identity())
    assert np.array_equal(first.nominal_from_scan.rotation, again.nominal_from_scan.rotation)
    assert np.array_equal(first.nominal_from_scan.translation_mm, again.nominal_from_scan.translation_mm)
    assert np.array_equal(first.used[order], again.used)
    left = points[:, 0] < np.median(points[:, 0])
    dense = register_surface(np.concatenate([points, *[points[left]] * 9]), NOTCHED, RigidMotion.identity())
    assert apart(first.nominal_from_scan, dense.nominal_from_scan, points) < 1e-4


def test_what_slides_is_said_and_held() -> None:
    """A cylinder's points fix four freedoms; along and about its axis it stays where it began."""
    surface = PatchSurface([faces.cylinder(30.0, 80.0)])
    places, _ = surface.sample(900)
    places = places[(places[:, 2] > 15) & (places[:, 2] < 65)]
    start = RigidMotion.about((0, 0, 40), (0.01, -0.02, 0.0), (0.3, 0.2, 0.0))
    found = register_surface(start.inverse().apply(places), surface, RigidMotion.identity())
    assert found.weakest.undetermined == 2
    assert found.weakest.mm_per_mm == np.inf
    assert found.rms_mm < 1e-9
    sheet = TriangleSurface(
        meshes.triangles_of_grid(np.stack([*np.meshgrid([0.0, 50], [0.0, 50], indexing="ij"), np.zeros((2, 2))], axis=-1))[:, ::-1]
    )
    rng = np.random.default_rng(3)
    flat = register_surface(np.column_stack([rng.uniform(5, 45, (200, 2)), np.full(200, 0.2)]), sheet, RigidMotion.identity())
    assert flat.weakest.undetermined == 3
    assert np.abs(flat.nominal_from_scan.translation_mm - (0, 0, -0.2)).max() < 1e-12


def test_a_scan_of_one_side_of_a_blade_is_weaker_than_one_of_both() -> None:
    surface = PatchSurface([faces.blade(40, 5)])
    places, normals = surface.sample(1500)
    inner = (places[:, 2] > 10) & (places[:, 2] < 140)
    whole = register_surface(places[inner], surface, RigidMotion.identity()).weakest
    one = register_surface(places[inner & (normals[:, 1] > 0.3)], surface, RigidMotion.identity()).weakest
    assert 1 < whole.mm_per_mm < 200
    assert one.mm_per_mm > 2 * whole.mm_per_mm
    assert whole.undetermined == one.undetermined == 0
    assert "along" in one.words


def test_locked_freedoms_stay_and_the_target_is_met() -> None:
    motion = RigidMotion.about((0, 0, 0), (0, 0, 0), (0.2, -0.1, 0.15))
    points = scan_of(NOTCHED, 600, motion)
    found = register_surface(points, NOTCHED, RigidMotion.identity(), locked=("y", "rx", "ry", "rz"))
    assert np.array_equal(found.nominal_from_scan.rotation, np.eye(3))
    assert found.nominal_from_scan.translation_mm[1] == 0.0
    assert found.nominal_from_scan.translation_mm[[0, 2]] == pytest.approx([0.2, 0.15], abs=0.02)
    places, normals = NOTCHED.sample(600)
    lifted = register_surface(places + 0.05 * normals, NOTCHED, RigidMotion.identity(), target_mm=0.05)
    assert lifted.rms_mm < 0.01
    with pytest.raises(ValueError, match="only be locked at a start"):
        register_surface(points, NOTCHED, locked=("x",))
    with pytest.raises(ValueError, match="not w"):
        register_surface(points, NOTCHED, RigidMotion.identity(), locked=("w",))  # type: ignore[arg-type]  # what no checker lets through


def test_outliers_are_left_out_where_that_is_asked_for() -> None:
    rng = np.random.default_rng(4)
    motion = RigidMotion.about((2, 1, 1), (0.01, 0.02, -0.01), (0.05, -0.04, 0.03))
    points = scan_of(NOTCHED, 1500, motion) + rng.normal(0, 0.001, (1500, 3))
    dust = rng.permutation(1500)[:60]
    points[dust] += rng.uniform(0.2, 0.4, (60, 1)) * np.array([0, 0, 1.0])
    plain = register_surface(points, NOTCHED, RigidMotion.identity())
    robust = register_surface(points, NOTCHED, RigidMotion.identity(), gross_mm=0.02)
    assert apart(robust.nominal_from_scan, motion, points) < 1e-3 < apart(plain.nominal_from_scan, motion, points)
    high = np.abs(NOTCHED.project(motion.apply(points)).distance_mm) > 0.03  # dust on walls was shifted along them
    assert 15 < np.count_nonzero(high) < 60
    assert np.array_equal(robust.outlier, high)
    assert not plain.outlier.any()


def test_what_cannot_be_registered_is_refused() -> None:
    with pytest.raises(RegistrationError, match="3 points are too few"):
        register_surface(np.zeros((3, 3)), NOTCHED)
    with pytest.raises(RegistrationError, match="the pose was not found"):
        register_surface(np.random.default_rng(5).normal(0, 20, (500, 3)), NOTCHED)


def test_motions_are_rotations_and_shifts() -> None:
    one = RigidMotion.about((1, 2, 3), (0.3, -1.2, 2.0), (4, 5, 6))
    points = np.random.default_rng(6).normal(0, 50, (50, 3))
    assert np.abs(one.inverse().apply(one.apply(points)) - points).max() < 1e-12
    assert np.abs(one.after(one).apply(points) - one.apply(one.apply(points))).max() < 1e-12
    assert one.angle_rad == pytest.approx(np.linalg.norm((0.3, -1.2, 2.0)), rel=1e-12)
    assert np.abs(one.apply([(1, 2, 3)]) - (5, 7, 9)).max() < 1e-12
    assert np.array_equal(one.apply(points)[7], one.apply(points[7:8])[0])
    tiny = RigidMotion.about((0, 0, 0), (0, 0, 1e-9), (0, 0, 0))
    assert tiny.rotation[1, 0] == pytest.approx(1e-9, rel=1e-12)
    with pytest.raises(ValueError, match="no rotation"):
        RigidMotion(np.diag([1.0, 1.0, -1.0]), np.zeros(3))
    with pytest.raises(ValueError, match="need a rotation"):
        RigidMotion(np.eye(2), np.zeros(3))
