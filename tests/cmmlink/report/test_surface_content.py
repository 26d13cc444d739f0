"""Pictures of a judged surface: a ball whose every place, depth and verdict is known in closed form."""

from pathlib import Path

import numpy as np
import pytest
from matplotlib.image import imread
from numpy.typing import NDArray

from cmmlink.colour_map import AT_LOWER, AT_MIDDLE, AT_UPPER, COLOURS, Kind, colours_of, kinds_of, rgb_of, severity_of
from cmmlink.report.raster import Camera, Dots, draw_view
from cmmlink.report.surface_content import JudgedSurface, Region, surface_content
from cmmlink.report.surface_picture import write_surface_picture
from cmmlink.report.surface_sides import four_sides
from inspection import ToleranceZone, Verdict

Array = NDArray[np.float64]
RADIUS_MM = 20.0
ZONE = ToleranceZone(-0.05, 0.07, 0.01)


def directions(count: int) -> Array:
    """Unit directions (n, 3) spread evenly over the ball, by the golden angle."""
    k = np.arange(count) + 0.5
    z, angle = 1 - 2 * k / count, k * np.pi * (3 - np.sqrt(5))
    return np.column_stack([np.sqrt(1 - z**2) * np.cos(angle), np.sqrt(1 - z**2) * np.sin(angle), z])


def ball(deviation_mm: Array, at: Array, **more: object) -> JudgedSurface:
    places = directions(40_000)
    worst = int(np.argmax(np.abs(deviation_mm - ZONE.middle_mm)))
    given = {"reach_mm": 1.0, "worst": worst} | more
    area = 4 * np.pi * RADIUS_MM**2
    return JudgedSurface(RADIUS_MM * places, places, RADIUS_MM * at, at, deviation_mm, ZONE.verdicts(deviation_mm), ZONE, area, **given)  # type: ignore[arg-type]


def nearly(image: NDArray[np.uint8], kind: Kind) -> int:
    """Pixels of the colour of a kind, at whatever light."""
    colour = np.array(rgb_of(COLOURS[kind]), dtype=np.float64)
    pixels = image.reshape(-1, 3).astype(np.float64)
    light = pixels.max(axis=1) / colour.max()
    return int((np.abs(pixels - light[:, None] * colour) < 4.0).all(axis=1).sum())


@pytest.mark.parametrize("at", [(0.3, -0.8, 0.5), (0.0, 0.1, -1.0)])
def test_one_bad_point_of_many_shows_in_a_picture_wherever_it_lies(at: tuple[float, float, float]) -> None:
    """One point in 30,000 is out: thinning by lot would hide it from nine pictures in ten."""
    points = directions(30_000)
    bad = int(np.argmax(points @ np.array(at)))
    deviation = np.zeros(len(points))
    deviation[bad] = 0.3
    region = Region(0.2, 0.3, tuple(RADIUS_MM * points[bad]))
    content = surface_content(ball(deviation, points, regions=(region,)), "Ball", "")
    shown = [nearly(side.image, Kind.ABOVE) for side in content.sides]
    assert max(shown) >= 5
    assert content.nearby is not None
    assert nearly(content.nearby.image, Kind.ABOVE) >= 20
    for side, pixels in zip(content.sides, shown, strict=True):
        seen = [mark for mark in side.marks if not mark.hidden]
        assert bool(seen) == bool(pixels)  # a place is marked where it is seen, and hidden by the ball where it is not
        for mark in seen:
            row, column = np.argwhere((side.image == side.image[int(mark.row), int(mark.column)]).all(axis=2)).mean(axis=0)
            assert abs(row - mark.row) < 3
            assert abs(column - mark.column) < 3


def test_what_was_not_measured_is_grey_and_what_was_is_not() -> None:
    points = directions(30_000)
    half = points[points[:, 2] > 0]
    sides = surface_content(ball(np.full(len(half), ZONE.middle_mm), half), "Ball", "").sides
    grey = sum(nearly(side.image, Kind.NOT_JUDGED) for side in sides)
    part = sum(int((side.image != 255).any(axis=2).sum()) for side in sides)
    assert grey == pytest.approx((1 - 1.0 / RADIUS_MM) * part / 2, rel=0.02)  # 1 mm beside a point counts as measured
    whole = surface_content(ball(np.full(len(points), ZONE.middle_mm), points), "Ball", "").sides
    assert sum(nearly(side.image, Kind.NOT_JUDGED) for side in whole) == 0


def test_nothing_shines_through_a_thin_wall() -> None:
    """Two sheets 0.02 mm apart, a fifth of a pixel: the bad one of them is seen from its own side alone."""
    x, y = (axis.ravel() for axis in np.meshgrid(np.linspace(-5, 5, 101), np.linspace(-5, 5, 101)))
    sheets = [np.column_stack([x, y, np.full(len(x), height)]) for height in (0.01, -0.01)]
    normals = np.repeat([[0.0, 0.0, 1.0], [0.0, 0.0, -1.0]], len(x), axis=0)
    good, bad = (np.repeat(np.array([colour], dtype=np.uint8), len(x), axis=0) for colour in ((250, 250, 250), (200, 0, 0)))
    severity = np.repeat(np.array([1.0, 3000.0], dtype=np.float32), len(x))
    dots = Dots(np.concatenate(sheets), normals, np.concatenate([good, bad]), severity, 0.1)
    for side, red in ((1.0, False), (-1.0, True)):
        camera = Camera(np.array([side, 0, 0]), np.array([0.0, 1, 0]), np.array([0, 0, side]), np.zeros(3), 0.1, 80, 80)
        image = draw_view(camera, dots, dots).image
        assert bool((image[..., 1] < 100).all()) is red
        assert bool((image[..., 1] < 100).any()) is red


def test_four_sides_see_every_face_and_the_part_fills_them() -> None:
    """A plate, a rod and a cube: every axis is seen at least a little from the front by one of the cameras, on both its sides."""
    for extent in ([60.0, 4.0, 100.0], [200.0, 3.0, 3.0], [10.0, 10.0, 10.0], [50.0, 50.0, 0.0]):
        corners = np.array(np.meshgrid([-1, 1], [-1, 1], [-1, 1])).reshape(3, -1).T * np.array(extent) / 2
        cameras = four_sides(corners, 690, 470)
        for axis in (*np.eye(3), *-np.eye(3)):
            assert max(float(camera.towards @ axis) for camera in cameras) > 0.12
        for camera in cameras:
            assert np.array([camera.right, camera.up, camera.towards]) @ np.array(
                [camera.right, camera.up, camera.towards]
            ).T == pytest.approx(np.eye(3))
            pixels = camera.pixels(corners)
            assert (pixels >= 0).all()
            assert (pixels <= (690, 470)).all()
        assert max(float((np.ptp(camera.pixels(corners), axis=0) / (690, 470)).max()) for camera in cameras) == pytest.approx(0.94)


def test_colours_hang_on_the_zone_and_never_on_the_data() -> None:
    deviation = np.array([-0.05, 0.01, 0.07, 0.085, -0.065, 0.065, np.nan])
    kinds = kinds_of(ZONE.verdicts(deviation), deviation, ZONE.middle_mm)
    assert kinds.tolist() == [Kind.UNCERTAIN, Kind.WITHIN, Kind.UNCERTAIN, Kind.ABOVE, Kind.BELOW, Kind.UNCERTAIN, Kind.NOT_JUDGED]
    assert kinds_of([7], [0.0], 0.0).tolist() == [Kind.NOT_JUDGED]
    within = np.full(3, Kind.WITHIN, dtype=np.int8)
    assert colours_of(within, deviation[:3], ZONE).tolist() == [list(rgb_of(colour)) for colour in (AT_LOWER, AT_MIDDLE, AT_UPPER)]
    severity = severity_of(kinds, deviation, ZONE)
    assert severity[3] == severity.max()
    assert severity[6] == severity.min() > 0


def test_the_colours_differ_for_colour_blind_eyes() -> None:
    """Deuteranopia and protanopia by Vienot, Brettel and Mollon (1999), in linear light: the kinds stay far apart."""
    told = np.array([rgb_of(colour) for colour in (AT_LOWER, AT_MIDDLE, AT_UPPER, *COLOURS.values())]) / 255
    linear = np.where(told <= 0.04045, told / 12.92, ((told + 0.055) / 1.055) ** 2.4)
    deuteran = np.array([[0.29275, 0.70725, 0.0], [0.29275, 0.70725, 0.0], [-0.02234, 0.02234, 1.0]])
    protan = np.array([[0.11238, 0.88762, 0.0], [0.11238, 0.88762, 0.0], [0.00401, -0.00401, 1.0]])
    for eyes in (np.eye(3), deuteran, protan):
        seen = np.clip(linear @ eyes.T, 0, 1) ** (1 / 2.4)
        apart = np.linalg.norm(seen[:, None] - seen[None, :], axis=2) + np.eye(len(seen))
        assert apart.min() > 0.2


def test_the_picture_has_the_same_bytes_each_time_and_says_its_limits(tmp_path: Path) -> None:
    points = directions(3_000)
    deviation = np.where(points @ np.array([0.3, -0.8, 0.5]) > 0.97, -0.2, 0.0)
    for name in ("a.png", "b.png"):
        write_surface_picture(surface_content(ball(deviation, points), "Ball    NOT CONFORM", "fit none"), tmp_path / name)
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()
    assert imread(tmp_path / "a.png").shape[1] == 1420
    assert Verdict.NONCONFORM in ZONE.verdicts(deviation)


def test_a_scan_without_a_judged_point_shows_the_bare_part(tmp_path: Path) -> None:
    content = surface_content(ball(np.full(5, np.nan), directions(5), worst=None), "Ball", "")
    assert content.nearby is None
    assert nearly(content.sides[0].image, Kind.NOT_JUDGED) > 1000
    write_surface_picture(content, tmp_path / "bare.png")
