"""A set-up that contradicts the points is no verdict: nothing was measured, and the message says what to change. A bad part stays bad."""

import re
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from inspection import (
    LiveInspection,
    NominalProfile,
    NotMeasured,
    NurbsCurve,
    SectionPlane,
    ToleranceZone,
    Verdict,
    discretize,
    setup_check,
)
from inspection.cloud import MANY

Array = NDArray[np.float64]
ZONE = ToleranceZone(-0.05, 0.05)
ROOM = np.array([303.0, 179.0])  # where the part lies on the machine


def blade_points(count: int, chord_mm: float = 100.0) -> Array:
    """A closed, round-edged, cambered section: no mirror image of itself."""
    t = np.linspace(0, 2 * np.pi, count, endpoint=False)
    x = (1 + np.cos(t)) / 2
    thick = 0.12 * np.sin(t) * (0.35 + 0.65 * np.sqrt(np.clip(1.02 - x, 0.0, None)))
    camber = 0.16 * x * (1 - x) * (1 - 0.6 * x)
    return chord_mm * np.column_stack([x, camber + thick])


@pytest.fixture(scope="module")
def nominal() -> NominalProfile:
    return discretize(NurbsCurve.interpolate(blade_points(240), closed=True), samples=2000)


def scan(nominal: NominalProfile, off_mm: Any = 0.0, count: int = 400, seed: int = 1, share: float = 1.0) -> Array:
    """Points (m, 2) of a part with these deviations out of material, turned and moved, with 2 um of noise."""
    rng = np.random.default_rng(seed)
    low, high = nominal.curve.domain
    u = low + (high - low) * np.arange(count) / count * share
    points, slope = nominal.curve.point(u), nominal.curve.derivatives(u, 1)[1]
    out = nominal.outward * np.column_stack([-slope[:, 1], slope[:, 0]]) / np.hypot(slope[:, 0], slope[:, 1])[:, None]
    points = points + out * (np.asarray(off_mm) + rng.normal(0, 0.002, count))[:, None]
    c, s = np.cos(0.3), np.sin(0.3)
    return np.asarray(points @ np.array([[c, s], [-s, c]]) + ROOM)


def judge(points: Array, nominal: NominalProfile, **settings: Any) -> Any:
    live = LiveInspection(nominal, settings.pop("zone", ZONE), provisional=False, **settings)
    live.add(points)
    return live.finish()


def refusal(points: Array, nominal: NominalProfile, **settings: Any) -> str:
    with pytest.raises(NotMeasured) as caught:
        judge(points, nominal, **settings)
    return str(caught.value)


def test_the_part_itself_is_measured(nominal: NominalProfile) -> None:
    assert judge(scan(nominal), nominal).verdict == Verdict.CONFORM


@pytest.mark.parametrize(
    ("factor", "mend"),
    [
        (1 / 25.4, "--unit inch"),
        (25.4, "--nominal-unit inch"),
        (1000.0, "--unit um"),
        (0.001, "points in metres"),
        (0.1, "points in centimetres"),
        (0.01, "points in chord units"),
        (0.5, "Check the unit, the scale and the nominal"),
        (3.0, "Check the unit, the scale and the nominal"),
    ],
)
@pytest.mark.parametrize("fit", ["best-fit", "none"])
def test_a_scan_of_another_size_is_not_measured(nominal: NominalProfile, factor: float, mend: str, fit: str) -> None:
    wide = ToleranceZone(-0.5, 0.5)
    told = refusal(scan(nominal) * factor, nominal, zone=wide, coverage_min=0.0, fit=fit)
    assert "mm across, the nominal 100" in told
    assert mend in told


def test_a_scan_in_micrometres_is_not_measured_while_its_pose_is_sought(nominal: NominalProfile) -> None:
    live = LiveInspection(nominal, ZONE)
    live.add(scan(nominal) * 1000)
    with pytest.raises(NotMeasured, match="--unit um"):
        live.finish()


def test_a_unit_is_named_for_points_in_any_order(nominal: NominalProfile) -> None:
    points = np.random.default_rng(3).permutation(scan(nominal)) / 25.4
    assert "--unit inch" in refusal(points, nominal, zone=ToleranceZone(-0.5, 0.5), coverage_min=0.0)


def test_another_size_is_named_for_points_in_any_order_and_no_part_of_the_profile_is_taken_for_one(nominal: NominalProfile) -> None:
    wide, small, part = ToleranceZone(-0.5, 0.5), scan(nominal) * 0.5, scan(nominal, share=0.55)
    told = refusal(small, nominal, zone=wide)
    for order in (np.arange(400)[::-1], np.roll(np.arange(400), 150), np.random.default_rng(3).permutation(400)):
        assert refusal(small[order], nominal, zone=wide) == told
        assert judge(part[order], nominal, zone=wide).verdict == Verdict.UNCERTAIN, "a part of the profile, not a smaller one"


def test_a_nominal_in_chord_units_is_named() -> None:
    chord = discretize(NurbsCurve.interpolate(blade_points(240, 1.0), closed=True), samples=2000)
    points = blade_points(300, 82.0)
    told = refusal(points, chord)
    assert (
        "are the nominal in chord units? Give the scale, about 82" in told
        or "is the nominal in chord units? Give the scale, about 82" in told
    )


@pytest.mark.parametrize(("factor", "mend"), [(1 / 25.4, "--unit inch"), (0.1, "points in centimetres")])
def test_a_scan_of_a_part_in_another_unit_is_named_where_it_fits_far_better(nominal: NominalProfile, factor: float, mend: str) -> None:
    told = refusal(scan(nominal, share=0.5) * factor, nominal, zone=ToleranceZone(-0.01, 0.01))
    assert "times as large" in told
    assert mend in told


def test_what_is_not_of_the_part_is_named_by_its_place(nominal: NominalProfile) -> None:
    points = scan(nominal)
    assert "two groups, 400 around" in refusal(np.vstack([points, points + np.array([200.0, 0.0])]), nominal)
    fixture = np.random.default_rng(1).uniform(300.0, 301.0, (100, 2))
    assert "100 around (300.5, 300.5)" in refusal(np.vstack([points, fixture]), nominal)
    assert "groups" not in refusal(points * 39.37, nominal)


@pytest.mark.parametrize("share", [0.03, 0.1, 0.5, 0.9])
def test_a_part_of_a_profile_is_no_other_size(nominal: NominalProfile, share: float) -> None:
    assert judge(scan(nominal, share=share), nominal, coverage_min=0.95).verdict != Verdict.CONFORM


PLANES: dict[str, tuple[Callable[[Array, float], Array], str]] = {
    "xz": (lambda p, h: np.column_stack([p[:, 0], h + 0 * p[:, 0], p[:, 1]]), "in the plane y = 12: say --plane xz"),
    "yz": (lambda p, h: np.column_stack([h + 0 * p[:, 0], p]), "in the plane x = 12: say --plane yz"),
    "tilted": (
        lambda p, h: np.column_stack([p[:, 0], p[:, 1] * np.cos(0.2), h + p[:, 1] * np.sin(0.2)]),
        "in a plane that is tilted by 11.5 deg against the section: say section.normal [0, -0.1987, 0.9801]",
    ),
}


@pytest.mark.parametrize("name", PLANES)
@pytest.mark.parametrize("fit", ["best-fit", "none"])
def test_points_in_another_plane_are_not_measured(nominal: NominalProfile, name: str, fit: str) -> None:
    place, words = PLANES[name]
    assert words in refusal(place(scan(nominal), 12.0), nominal, fit=fit)


def test_points_in_the_plane_that_is_set_up_are_measured(nominal: NominalProfile) -> None:
    place, _ = PLANES["xz"]
    plane = SectionPlane(np.zeros(3), np.array([1.0, 0, 0]), np.array([0.0, -1.0, 0]))
    assert judge(place(scan(nominal), 12.0), nominal, section=plane).verdict == Verdict.CONFORM


@pytest.mark.parametrize("tilt_deg", [30.0, 45.0, 80.0, -45.0])
@pytest.mark.parametrize("axis", [0, 1])
def test_a_tilted_plane_is_named_with_the_side_up_that_keeps_x_and_y(nominal: NominalProfile, tilt_deg: float, axis: int) -> None:
    points, angle = scan(nominal), np.radians(tilt_deg)
    space = np.column_stack([points, np.zeros(400)])
    space[:, 2] = points[:, axis] * np.sin(angle)
    space[:, axis] *= np.cos(angle)
    told = refusal(space, nominal)
    normal = np.array([float(value) for value in told.rsplit("[", 1)[1].rstrip("]").split(",")])
    assert normal[2] > 0
    x_axis = np.zeros(3)
    x_axis[0] = np.cos(angle) if axis == 0 else 1.0
    x_axis[2] = np.sin(angle) if axis == 0 else 0.0
    assert judge(space, nominal, section=SectionPlane(np.zeros(3), x_axis, normal)).verdict == Verdict.CONFORM


def test_points_off_the_section_are_told_with_their_heights(nominal: NominalProfile) -> None:
    told = refusal(np.column_stack([scan(nominal), np.full(400, 60.0)]), nominal, off_section_max_mm=0.5)
    assert "400 of 400 points lie farther than 0.5 mm from the plane of the section, at heights from 60 to 60 mm" in told


@pytest.mark.parametrize("heights", [(10.0, 20.0, 30.0), (-3.0, 0.0), (5.0, 6.5)])
@pytest.mark.parametrize("mixed", [False, True])
def test_several_heights_are_named(nominal: NominalProfile, heights: tuple[float, ...], mixed: bool) -> None:
    points = scan(nominal, count=600)
    height = np.resize(heights, 600) if mixed else np.repeat(heights, 600 // len(heights))
    told = refusal(np.column_stack([points, height + 0.005 * np.sin(np.arange(600))]), nominal)
    for value in heights:
        assert re.search(rf"(heights,|and|,) {value:g}\b", told)
    assert "more than one section" in told


def test_heights_that_run_on_are_no_plane(nominal: NominalProfile) -> None:
    points = scan(nominal)
    told = refusal(np.column_stack([points, np.linspace(0, 8, 400)]), nominal)
    assert "at heights from 0.16 to 7.84 mm, not in one plane" in told


def test_an_uneven_table_is_no_other_plane(nominal: NominalProfile) -> None:
    points = scan(nominal)
    height = 12 + 0.2 * np.sin(np.arange(400) / 40)
    assert judge(np.column_stack([points, height]), nominal).verdict == Verdict.CONFORM


@pytest.mark.parametrize("value", [1e9, 3.4e38])
@pytest.mark.parametrize("rows", [slice(None), slice(8, None), slice(0, None, 2), slice(0, 200)])
@pytest.mark.parametrize("columns", [1, 2])
def test_coordinates_beyond_a_kilometre_are_called_so(nominal: NominalProfile, value: float, rows: slice, columns: int) -> None:
    points = scan(nominal)
    points[rows, :columns] = value
    told = refusal(points, nominal)
    assert f"{len(points[rows])} of 400 points have coordinates that no part can have" in told
    assert "word_order" in told


@pytest.mark.parametrize("value", [-9999.0, 32767.0, 1e6])
@pytest.mark.parametrize("fit", ["best-fit", "none"])
def test_samples_that_mean_no_point_are_named_by_row(nominal: NominalProfile, value: float, fit: str) -> None:
    points = scan(nominal)
    points[[17, 203]] = value
    told = refusal(points, nominal, fit=fit)
    assert "2 of 400 points lie far from all others (rows 18, 204; " in told
    assert "invalid" in told
    assert "--reject-outliers" in told


def test_samples_that_mean_no_point_are_rejected_on_request(nominal: NominalProfile) -> None:
    points = scan(nominal)
    points[[17, 203]] = -9999.0
    result = judge(points, nominal, reject_outliers=True)
    assert result.rejected_by_reason == {"outlier": 2}
    assert result.verdict == Verdict.UNCERTAIN


@pytest.mark.parametrize("rows", [[17], [17, 203], [0, 399], list(range(40, 60)), list(range(0, 400, 3))])
def test_marks_that_lie_near_the_part_are_named_by_row_wherever_they_stand(nominal: NominalProfile, rows: list[int]) -> None:
    """At zero, which is 30 mm inside this part and no farther from its middle than the part itself, and in any order of the points."""
    points = scan(nominal) - ROOM - np.array([40.0, 15.0])
    points[rows] = 0.0
    words = "1 of 400 points lies" if len(rows) == 1 else f"{len(rows)} of 400 points lie"
    for order in (np.arange(400), np.random.default_rng(2).permutation(400)):
        told = refusal(points[order], nominal)
        assert words in told
        assert str(int(np.flatnonzero(np.isin(order, rows))[0]) + 1) in told
        assert "--invalid V" in told


def test_one_value_again_and_again_is_a_mark_and_other_stray_points_are_not(nominal: NominalProfile) -> None:
    points = scan(nominal)
    inside = points.mean(axis=0)
    points[[17, 203]] = inside
    assert "2 of 400 points lie far from all others (rows 18, 204; " in refusal(points, nominal)
    points[203] += 3.0
    assert judge(points, nominal).verdict == Verdict.NONCONFORM


def test_points_that_repeat_are_no_marks(nominal: NominalProfile) -> None:
    points = scan(nominal)
    still = np.vstack([points, np.repeat(points[100:101], 300, axis=0), points[:1]])
    assert judge(still, nominal).verdict == Verdict.CONFORM
    few = scan(nominal, count=12)
    assert judge(np.vstack([few, few[:3]]), nominal).rejected_by_reason == {}


@pytest.mark.parametrize("noise", [0.0, 0.005])
@pytest.mark.parametrize("fit", ["best-fit", "none"])
def test_a_section_seen_from_its_edge_is_named(nominal: NominalProfile, noise: float, fit: str) -> None:
    points = blade_points(400)
    points[:, 1] = 12.0 + np.random.default_rng(1).normal(0, 1, 400) * noise
    told = refusal(points, nominal, fit=fit)
    assert "the points lie on a straight line" in told
    assert "--columns" in told
    assert "--plane" in told


def test_a_flat_profile_is_no_section_seen_from_its_edge() -> None:
    flat = discretize(NurbsCurve.interpolate(np.column_stack([np.linspace(0, 50, 30), np.zeros(30)])), material="right")
    x = np.linspace(0, 50, 300)
    wave = np.column_stack([x, 0.1 * np.sin(x)])
    assert judge(wave, flat, fit="none").verdict == Verdict.NONCONFORM
    assert judge(wave * np.array([1.0, 0.0]) + [0.0, 0.09], flat, fit="none").verdict == Verdict.NONCONFORM


@pytest.mark.parametrize("rows", [range(0, 400, 2), range(0, 400, 3)])
def test_a_fit_that_was_asked_for_is_not_told_to_be_asked_for(nominal: NominalProfile, rows: range) -> None:
    points = scan(nominal)
    points[list(rows), 0] = 5e-324
    assert "datum" not in refusal(points, nominal)


@pytest.mark.parametrize("radius", [0.5, 1.0, 1.5])
def test_ball_centres_are_named(nominal: NominalProfile, radius: float) -> None:
    told = refusal(scan(nominal, radius), nominal)
    assert f"all points are {radius:.3f} mm out" in told
    assert f"ball centres? Give the radius of the tip (--tip-radius {radius:g}" in told
    assert judge(scan(nominal, radius), nominal, tip_radius_mm=radius).verdict == Verdict.CONFORM


def test_a_ball_taken_off_twice_is_named(nominal: NominalProfile) -> None:
    assert re.match(r"all points are 1\.00\d mm inside \(scatter .*taken off twice", refusal(scan(nominal, -1.0), nominal))
    assert "taken off twice? Leave out the tip radius of 1 mm" in refusal(scan(nominal), nominal, tip_radius_mm=1.0)


@pytest.mark.parametrize(("given", "true"), [(2.0, 1.0), (1.0, 2.0), (1.0, 1.5)])
def test_a_diameter_or_another_radius_is_named_with_the_radius_that_fits(nominal: NominalProfile, given: float, true: float) -> None:
    told = refusal(scan(nominal, true), nominal, tip_radius_mm=given)
    assert f"is {given:g} mm the radius of the tip? With {true:g} mm the points would fit" in told


def test_a_part_that_is_too_large_throughout_is_bad_and_its_verdict_asks_for_ball_centres(nominal: NominalProfile) -> None:
    result = judge(scan(nominal, 0.2), nominal)
    assert result.verdict == Verdict.NONCONFORM
    assert [reason.kind for reason in result.reasons] == ["out-of-tolerance", "shift"]
    assert result.reasons[-1].words.startswith("All points are 0.200 mm out (scatter 0.00")
    assert "ball centres?" in result.reasons[-1].words


@pytest.mark.parametrize("zone", [(0.01, 0.05), (0.0, 0.1), (-0.1, 0.0), (0.5, 0.6), (0.02, 0.03)])
def test_a_part_as_its_nominal_is_no_ball_centre_beside_a_zone_of_other_parts(nominal: NominalProfile, zone: tuple[float, float]) -> None:
    off = np.zeros(400)
    off[:200] = 0.01  # out, and in elsewhere, so that no zone is better than another
    off[200:] = -0.01
    result = judge(scan(nominal, off), nominal, zone=ToleranceZone(*zone))
    assert result.verdict == Verdict.NONCONFORM
    assert "shift" not in [reason.kind for reason in result.reasons]


@pytest.mark.parametrize("fit", ["best-fit", "minimum-zone", "none"])
@pytest.mark.parametrize("bump", [0.0, 0.08])
def test_a_mirrored_part_is_named(nominal: NominalProfile, fit: str, bump: float) -> None:
    off = np.zeros(400)
    off[100:120] = bump
    points = scan(nominal, off) * np.array([1.0, -1.0])
    if fit == "none":
        points = blade_points(400) * np.array([1.0, -1.0])
    assert "fit the nominal only mirrored" in refusal(points, nominal, fit=fit)


def test_a_known_pose_far_off_is_named(nominal: NominalProfile) -> None:
    told = refusal(blade_points(400) + np.array([100.0, 0.0]), nominal, fit="none")
    assert "moved by x -100, y" in told
    assert "--fit best-fit" in told


def test_points_of_another_part_are_not_measured(nominal: NominalProfile) -> None:
    t = np.linspace(0, 2 * np.pi, 400, endpoint=False)
    assert "do not fit the nominal" in refusal(45 * np.column_stack([np.cos(t), np.sin(t)]), nominal)


def bad_part(seed: int) -> Array:
    """Deviations (400,) of a part that fails by 20 % to 20 times the zone: a bump, a step, a wave, two lobes, a taper or an oversize."""
    rng = np.random.default_rng(seed)
    t = np.arange(400) / 400
    size = 0.06 * 10 ** rng.uniform(0.1, 1.2) * rng.choice([-1.0, 1.0])
    width, at = rng.uniform(0.01, 0.3), rng.uniform()
    away = np.abs((t - at + 0.5) % 1 - 0.5)
    forms = (
        size * np.exp(-((away / width) ** 2)),
        size * (away < width),
        size * np.sin(2 * np.pi * rng.integers(3, 12) * t),
        size * np.cos(2 * np.pi * (t - at)) * np.sin(2 * np.pi * 2 * t),
        size * (1 - 2 * away),
        np.full(400, 0.12 * np.sign(size)),
    )
    return np.asarray(forms[seed % len(forms)] + rng.normal(0, 0.01, 400))


@pytest.mark.parametrize("seed", range(20))
def test_a_bad_part_is_always_measured(nominal: NominalProfile, seed: int) -> None:
    result = judge(scan(nominal, bad_part(seed), seed=seed), nominal)
    # a part that another placement takes into the zone is no bad part: the rule then says so
    assert result.verdict is not Verdict.CONFORM or result.minimum_zone_mm <= 0.1 < result.best_fit_error_mm
    assert result.judged > 350


def test_what_few_of_very_many_points_tell_does_not_depend_on_their_order(nominal: NominalProfile) -> None:
    points = scan(nominal, 3.0, count=MANY + 4000)  # where they are, every digit of scatter and shift follows from which are drawn
    told = refusal(points, nominal, fit="none")
    assert "scatter" in told
    assert refusal(np.random.default_rng(5).permutation(points), nominal, fit="none") == told


def test_sizes_that_are_alike_for_certain_are_so_and_the_largest_distance_lies_between_its_bounds() -> None:
    """Law: what a few looks tell never differs from what the hull tells."""
    rng, certain = np.random.default_rng(9), 0
    for _ in range(300):
        one = rng.normal(size=(int(rng.integers(3, 60)), 2)) * rng.uniform(0.05, 1.0, 2)
        other = one @ np.linalg.qr(rng.normal(size=(2, 2)))[0] * rng.uniform(0.75, 1.35)
        low, high = setup_check._bounds_across(one)
        assert low * (1 - 1e-12) <= setup_check._across(one) <= high * (1 + 1e-12)
        if setup_check._are_as_wide(one, other):
            certain += 1
            assert 1 / 1.25 < setup_check._across(one) / setup_check._across(other) < 1.25
    assert certain > 150
    assert not setup_check._are_as_wide(np.ones((5, 2)), np.ones((5, 2)))
