"""Cutting: exact where the truth has a closed form, the same by both cutters, and honest about bad surfaces."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from drivers.errors import MeshError
from drivers.surface.contour_source import SurfaceSection
from drivers.surface.cut import Cutter, NumpyCutter, cut_surface, height_range_mm
from drivers.surface.open3d_process import Open3DProcess
from drivers.surface.stl_file import SurfaceMesh, read_stl, surface_of
from tests.drivers.surface.ct_phantom import make_phantom
from tests.drivers.surface.meshes import A, B, Triangles, ascii_stl, binary_stl, box, ellipse, rotation, tube, write

CUBE = box((0, 0, 0), (10, 10, 10))


def mesh_of(triangles: NDArray[np.floating]) -> SurfaceMesh:
    return surface_of(triangles, "test surface", "STL")


def cut(triangles: NDArray[np.floating], height_mm: float, normal: tuple[float, float, float] = (0, 0, 1)) -> SurfaceSection:
    (found,) = cut_surface(mesh_of(triangles), normal, [height_mm], cutter=NumpyCutter())
    return found


def off_ellipse_mm(points: Triangles) -> float:
    """Largest distance from the ellipse, to first order: |F| / |grad F|."""
    x, y = points.T
    value = (x / A) ** 2 + (y / B) ** 2 - 1
    return float(np.max(np.abs(value) / (2 * np.hypot(x / A**2, y / B**2))))


# The truth in closed form ---------------------------------------------------------------------------------------------


def test_an_extruded_ellipse_from_binary_stl_is_cut_exactly_up_to_float32(tmp_path: Path) -> None:
    triangles = tube(ellipse(40_000), np.array([0.0, 7.0, 15.0]))  # the polygon is within 2e-8 mm of the ellipse
    path = tmp_path / "ellipse.stl"
    path.write_bytes(binary_stl(triangles))
    for found in cut_surface(read_stl(path), (0, 0, 1), [3.0, 10.1, 14.999], cutter=NumpyCutter()):
        (contour,) = found.contours
        assert contour.closed
        assert found.warnings == ()
        assert off_ellipse_mm(contour.section_mm) < 1e-6
        assert np.all(contour.points_mm[:, 2] == found.height_mm)


def test_an_extruded_ellipse_from_ascii_stl_is_cut_exactly(tmp_path: Path) -> None:
    profile = ellipse(3_000)
    turn = rotation((0.3, -0.8, 0.2), 0.7)
    triangles = tube(profile, np.array([-4.0, 30.0])) @ turn.T + np.array([100.0, -50.0, 7.0])
    mesh = read_stl(write(tmp_path / "ellipse.stl", ascii_stl(triangles)))
    height = float(np.array([100.0, -50.0, 7.0]) @ turn[:, 2]) + 11.0
    (found,) = cut_surface(mesh, tuple(5 * turn[:, 2]), [height], cutter=NumpyCutter())
    (contour,) = found.contours
    back = (contour.points_mm - np.array([100.0, -50.0, 7.0])) @ turn
    assert np.abs(back[:, 2] - 11.0).max() < 1e-12
    on_corner = np.abs(back[:, None, :2] - profile[None]).sum(axis=2).min(axis=1) < 1e-12
    assert np.count_nonzero(on_corner) == 3_000  # the profile's corners, exactly
    sagitta = (2 * np.pi * A / 3_000) ** 2 / 8 * A / B**2
    assert off_ellipse_mm(back[:, :2]) < 1.01 * sagitta  # and points on its chords


def test_a_cone_is_cut_in_circles_of_the_right_radius() -> None:
    base, apex = tube(ellipse(500), np.array([0.0, 1.0]))[:500, :2], np.array([0.0, 0.0, 20.0])
    cone = np.concatenate([base, np.broadcast_to(apex, (500, 1, 3))], axis=1)
    for found in cut_surface(mesh_of(cone), (0, 0, 1), np.linspace(0.5, 19.5, 77).tolist(), cutter=NumpyCutter()):
        (contour,) = found.contours
        expected = ellipse(500) * (1 - found.height_mm / 20)
        assert len(contour.section_mm) == 500
        assert np.abs(contour.section_mm - expected).max() < 1e-13


def test_the_normal_need_not_be_a_unit_vector() -> None:
    for normal in ((0, 0, 1), (0, 0, 2), (0, 0, 1e-9), (0, 0, 1e200)):
        assert np.all(cut(CUBE, 5.0, normal).contours[0].points_mm[:, 2] == 5.0)


def test_a_hole_is_told_from_its_outer_contour() -> None:
    found = cut(np.concatenate([CUBE, box((3, 3, -1), (5, 5, 11))[:, ::-1]]), 5.0)
    assert [(c.hole, c.length_mm) for c in found.contours] == [(False, 40.0), (True, 8.0)]
    assert found.outer() == found.contours[:1]


def test_heights_come_back_in_the_order_asked_for_and_may_repeat() -> None:
    heights = [7.0, 1.0, 5.0, 1.0, 9.5, 2.0, 3.0, 4.0, 6.0, 8.0]
    slices = list(cut_surface(mesh_of(CUBE), (0, 0, 1), heights, cutter=NumpyCutter()))
    assert [found.asked_mm for found in slices] == heights
    assert all(len(found.contours) == 1 for found in slices)


@pytest.mark.parametrize("workers", [1, 3])
def test_a_stack_is_the_same_as_its_sections_one_by_one(workers: int) -> None:
    phantom = make_phantom(seed=5, voxel_mm=0.3, height_mm=6.0)
    mesh, low = mesh_of(phantom.corners_mm), phantom.machine_height_mm(0.0)
    heights = np.linspace(low + 0.5, low + 5.5, 40).tolist()
    stack = cut_surface(mesh, tuple(phantom.normal), heights, cutter=NumpyCutter(), workers=workers)
    for found, height in zip(stack, heights, strict=True):
        (single,) = cut_surface(mesh, tuple(phantom.normal), [height], cutter=NumpyCutter())
        assert len(found.contours) == len(single.contours) >= 1
        for a, b in zip(found.contours, single.contours, strict=True):
            assert np.array_equal(a.points_mm, b.points_mm)


# The two cutters against each other -----------------------------------------------------------------------------------


def assert_equal_slices(mesh: SurfaceMesh, normal: tuple[float, float, float], heights: list[float], first: Cutter, second: Cutter) -> int:
    points = 0
    pairs = zip(*(list(cut_surface(mesh, normal, heights, cutter=c)) for c in (first, second)), strict=True)
    for a, b in pairs:
        assert (a.cutter, b.cutter) == ("numpy", second.name)
        assert a.warnings == b.warnings
        assert (len(a.contours), a.set_aside) == (len(b.contours), b.set_aside)
        for c, d in zip(a.contours, b.contours, strict=True):
            assert (c.closed, c.hole) == (d.closed, d.hole)
            assert c.points_mm.shape == d.points_mm.shape
            assert np.abs(c.points_mm - d.points_mm).max() < 1e-12
            points += len(c.points_mm)
    return points


def test_open3d_and_numpy_agree_on_a_noisy_tilted_part(open3d: Open3DProcess) -> None:
    phantom = make_phantom(seed=6, voxel_mm=0.2, height_mm=5.0, specks=4)
    heights = (phantom.machine_height_mm(0.0) + np.linspace(0.3, 4.7, 12)).tolist()
    assert assert_equal_slices(mesh_of(phantom.corners_mm), tuple(phantom.normal), heights, NumpyCutter(), open3d) > 15_000


def test_open3d_and_numpy_agree_where_corners_and_facets_lie_in_the_plane(open3d: Open3DProcess) -> None:
    stairs = np.concatenate([box((0, 0, 0), (10, 10, 1)), box((20, 0, -1), (30, 10, 3)), tube(ellipse(60) + 60, np.arange(-1.0, 4.0))])
    assert assert_equal_slices(mesh_of(stairs), (0, 0, 1), [-1.0, 0.0, 0.5, 1.0, 2.0, 3.0], NumpyCutter(), open3d) > 300


@pytest.mark.parametrize("seed", range(3))
def test_open3d_and_numpy_agree_on_loose_triangles(open3d: Open3DProcess, seed: int) -> None:
    rng = np.random.default_rng(seed)
    soup = rng.uniform(-50, 50, (300, 3, 3))
    mesh = mesh_of(soup)
    for height in (-5.0, 0.1, 12.0):
        a, b = (next(cut_surface(mesh, (1, 2, 3), [height], cutter=c, shortest_mm=0.0)) for c in (NumpyCutter(), open3d))
        assert a.triangles == len(a.contours) == len(b.contours) > 100
        for c, d in zip(a.contours, b.contours, strict=True):
            assert np.abs(c.points_mm - d.points_mm).max() < 1e-12


def test_open3d_is_never_loaded_into_this_process(open3d: Open3DProcess) -> None:
    assert open3d.status().version is not None
    program = (
        "import sys\n"
        "from drivers.surface.cut import cut_surface\n"
        "from drivers.surface.open3d_process import Open3DProcess\n"
        "from drivers.surface.stl_file import surface_of\n"
        "from tests.drivers.surface.meshes import box\n"
        "with Open3DProcess() as child:\n"
        "    (found,) = cut_surface(surface_of(box((0, 0, 0), (1, 1, 1)), '', ''), (0, 0, 1), [0.5], cutter=child)\n"
        "assert len(found.contours) == 1\n"
        "assert not any(name.split('.')[0] == 'open3d' for name in sys.modules)\n"
    )
    subprocess.run([sys.executable, "-c", program], check=True, cwd=Path(__file__).parents[3])


# Bad surfaces: a clear error or a stated warning, never an empty result that looks good ---------------------------------


def test_a_plane_beside_the_surface() -> None:
    with pytest.raises(MeshError, match=r"10\.5 mm misses the surface, which spans 0\.0000 to 10\.0000 mm"):
        cut(CUBE, 10.5)
    with pytest.raises(MeshError, match="unit of the file"):
        cut(CUBE / 1000, 5.0)


def test_a_plane_between_two_parts_gives_a_warning_not_a_good_section() -> None:
    found = cut(np.concatenate([CUBE, CUBE + np.array([0.0, 0.0, 20.0])]), 15.0)
    assert found.contours == ()
    assert "nothing is left" in found.warnings[0]


@pytest.mark.parametrize(("height", "moved"), [(0.0, 1e-4), (10.0, -1e-4)])
def test_facets_in_the_plane_move_it_and_say_so(height: float, moved: float) -> None:
    found = cut(CUBE, height)
    assert found.height_mm == height + moved
    assert f"moved by {moved:+.2g} mm" in found.warnings[0]
    assert found.contours[0].length_mm == pytest.approx(40.0)


def test_facets_in_a_tilted_plane_are_found_in_spite_of_float32() -> None:
    turn = rotation((0.2, 0.9, -0.3), 0.4)
    tilted = (box((0, 0, 0), (60, 10, 10)) @ turn.T).astype(np.float32)
    found = cut(tilted, 10.0, tuple(turn[:, 2]))
    assert "facets lie in the plane" in found.warnings[0]
    assert found.contours[0].length_mm == pytest.approx(140.0, abs=1e-4)


def test_stairs_are_cut_beside_every_step() -> None:
    stairs = np.concatenate([box((0, 0, 0), (10, 10, 1)), box((0, 0, 1), (5, 10, 2))])
    found = cut(stairs, 1.0)
    assert found.height_mm != 1.0
    assert len(found.contours) == 1
    assert "moved" in found.warnings[0]


def test_a_surface_that_is_one_plane() -> None:
    with pytest.raises(MeshError, match="facets lie in the plane"):
        cut(np.array([[[0, 0, 3], [10, 0, 3], [0, 10, 3]]], dtype=np.float64), 3.0)


def test_a_hole_in_the_surface_leaves_the_contour_open_and_names_the_place() -> None:
    open_cube = np.delete(CUBE, [10, 11], axis=0)  # the side z = 10 is gone
    found = cut(open_cube, 5.0, (1, 0, 0))
    (contour,) = found.contours
    assert not contour.closed
    (gap,) = found.gaps
    assert {gap.from_mm, gap.to_mm} == {(5.0, 0.0, 10.0), (5.0, 10.0, 10.0)}
    assert gap.width_mm == 10.0
    assert "1 open contour(s), left open: (5.0000, " in found.warnings[0]


def test_a_crack_of_one_float32_step_is_reported_and_a_wider_weld_closes_it() -> None:
    cracked = tube(ellipse(100) + 100, np.array([0.0, 10.0])).astype(np.float32)  # the step is 7.6e-6 mm there
    cracked[17, :, 0] = np.nextafter(cracked[17, :, 0], np.float32(np.inf))
    found = cut(cracked, 5.0)
    assert not any(contour.closed for contour in found.contours)
    assert "open contour" in found.warnings[0]
    (mended,) = cut_surface(mesh_of(cracked), (0, 0, 1), [5.0], cutter=NumpyCutter(), weld_mm=1e-5)
    assert [contour.closed for contour in mended.contours] == [True]


def test_facets_given_twice_count_once_and_are_told() -> None:
    found = cut(np.concatenate([CUBE, CUBE[4:6]]), 5.0)
    assert "2 segment(s) were there twice" in found.warnings[0]
    assert [(c.closed, c.length_mm) for c in found.contours] == [(True, 40.0)]


def test_facets_without_area_do_no_harm() -> None:
    needle = np.array([[[0, 0, 0], [0, 0, 10], [0, 0, 5]], [[10, 10, 2], [10, 10, 2], [10, 10, 9]]], dtype=np.float64)
    found = cut(np.concatenate([CUBE, needle]), 6.0)
    assert [(c.closed, c.length_mm) for c in found.contours] == [(True, 40.0)]


def test_facets_turned_inside_out_give_the_same_contour() -> None:
    mixed = CUBE.copy()
    mixed[::2] = mixed[::2, ::-1]
    assert np.array_equal(cut(mixed, 5.0).contours[0].points_mm, cut(CUBE, 5.0).contours[0].points_mm)


def test_a_fin_on_the_surface_is_a_branch_with_its_place() -> None:
    fin = np.array([[[10, 5, 0], [15, 5, 0], [10, 5, 10]], [[15, 5, 0], [15, 5, 10], [10, 5, 10]]], dtype=np.float64)
    found = cut(np.concatenate([CUBE, fin]), 5.0)
    assert found.branches_mm.tolist() == [[10.0, 5.0, 5.0]]
    assert any("more than two segments meet at 1 place(s): (10.0000, 5.0000, 5.0000)" in text for text in found.warnings)


def test_two_parts_that_touch_along_an_edge_are_a_branch() -> None:
    found = cut(np.concatenate([CUBE, box((10, 10, 0), (20, 20, 10))]), 5.0)
    assert found.branches_mm.tolist() == [[10.0, 10.0, 5.0]]
    assert [contour.closed for contour in found.contours] == [True, True]


def test_dust_is_set_aside_and_counted() -> None:
    dust = np.concatenate([box((20 + k, 0, 4), (20.05 + k, 0.05, 6)) for k in range(7)])
    found = cut(np.concatenate([CUBE, dust]), 5.0)
    assert len(found.contours) == 1
    assert found.set_aside == 7
    assert found.set_aside_mm == pytest.approx(0.2)


def test_nothing_but_pieces_below_the_limit() -> None:
    (found,) = cut_surface(mesh_of(CUBE), (0, 0, 1), [5.0], cutter=NumpyCutter(), shortest_mm=100.0)
    assert found.contours == ()
    assert found.set_aside == 1
    assert "nothing is left" in found.warnings[0]


@pytest.mark.parametrize("heights", [[], [np.nan], [1.0, np.inf]])
def test_heights_that_are_none(heights: list[float]) -> None:
    with pytest.raises(MeshError, match="at least one finite height"):
        list(cut_surface(mesh_of(CUBE), (0, 0, 1), heights, cutter=NumpyCutter()))


def test_the_range_of_heights_is_that_of_the_corners() -> None:
    assert height_range_mm(mesh_of(CUBE), (0, 3, 4)) == pytest.approx((0.0, 14.0))
