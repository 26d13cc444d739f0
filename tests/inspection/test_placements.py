"""Proofs over every placement: reference parts, minimum zones known from elsewhere, parts that can pass, and open profiles."""

import numpy as np
import pytest

from inspection import FreedomName, Freedoms, RigidTransform, deviations, discretize, fit_minimum_zone
from inspection.bands import EvenBand
from inspection.placements import PlacementSearch
from inspection.rigid import rotation_about
from tests.inspection import profiles
from tests.inspection.profiles import Array
from tests.inspection.reference_parts import middles, nominal_of, reference_form, scan, stations

# Half minimum zones of the reference scans, found by independent branch and bound in long double (500 points, form as in `reference_form`).
HALF_ZONES_MM = {"goe404": 0.036958537, "mh42": 0.037013398, "naca65410": 0.035523921}


def dented(name: str) -> Array:
    """The reference part that cannot pass: a dent of 0.16 mm at 30 % of the length."""
    s, length = stations(name, 800), nominal_of(name).curve.length_mm
    form = 0.01 * np.sin(6 * np.pi * s / length + 0.5) - 0.16 * np.exp(-(((s - 0.3 * length) / 3) ** 2))
    return scan(name, 800, form, 124, (20, -10))


@pytest.mark.parametrize("name", ["goe404", "mh42"])
def test_a_prefix_is_refuted_as_soon_as_no_placement_is_left(name: str) -> None:
    points, search = dented(name), PlacementSearch(nominal_of(name), 0.05)
    assert [search.look(points[:count]).outcome for count in (160, 180, 200, 220, 240, 400, 800)] == ["fits"] * 4 + ["refuted"] * 3


@pytest.mark.parametrize("name", HALF_ZONES_MM)
def test_the_minimum_zone_is_the_border_between_fitting_and_refuted(name: str) -> None:
    points = scan(name, 500, reference_form(name, 500), 92, (15, -7))
    for half in (HALF_ZONES_MM[name] + 1e-6, HALF_ZONES_MM[name] - 1e-5):
        found = PlacementSearch(nominal_of(name), half).look(points)
        assert found.outcome == ("fits" if half > HALF_ZONES_MM[name] else "refuted")
        if found.pose is not None:
            again = PlacementSearch(nominal_of(name), half).look(points, found.pose)
            assert again.outcome == "fits"


@pytest.mark.parametrize("seed", range(12))
def test_a_part_that_can_pass_is_never_refuted(seed: int) -> None:
    """Form just inside the zone, in any place, whole or in part, in any order: the truth is a placement that passes."""
    rng = np.random.default_rng(seed)
    name = str(rng.choice(["goe404", "mh42", "naca65410"]))
    length = nominal_of(name).curve.length_mm
    s = 2 * np.pi * stations(name, 300) / length
    form = sum(rng.uniform(-1, 1) * np.cos(k * s + rng.uniform(0, 7)) for k in range(1, 9))
    form *= 0.0499 / np.abs(form).max()
    points = scan(name, 300, np.asarray(form), rng.uniform(-180, 180), tuple(rng.uniform(-50, 50, 2)))
    first, count = int(rng.integers(0, 200)), int(rng.integers(40, 300))
    part = rng.permutation(points[first : first + count])
    start = RigidTransform(0.0, np.zeros(2)) if seed % 3 == 0 else None
    assert PlacementSearch(nominal_of(name), 0.05).look(part, start).outcome != "refuted"


def test_a_scan_that_runs_over_an_open_end_is_not_refuted_for_it() -> None:
    """The sign of the deviation turns round behind an end; a point just behind it lies within the zone's round cap."""
    nominal = discretize(profiles.p1(), samples=1000)
    curve = nominal.curve
    u = profiles.even_in_arc_length(curve, 200)
    tangent = curve.derivatives(u[-1:], 1)[1][0]
    behind = curve.point(u[-1:]) + 0.03 * tangent / np.hypot(*tangent)
    points = np.vstack([curve.point(u) + 0.02 * profiles.left_normal(curve, u), behind])
    for middle in (0.0, 0.02):
        half = 0.04
        found = PlacementSearch(nominal, EvenBand(half, middle)).look(RigidTransform(0.7, np.array([5.0, 9.0])).apply(points))
        assert found.outcome == "fits"


def test_centres_of_a_ball_are_held_against_their_surface_points() -> None:
    nominal = nominal_of("goe404")
    u = middles(nominal.curve, 400)
    normal = nominal.outward * profiles.left_normal(nominal.curve, u)
    for form, outcome in ((0.03, "fits"), (0.09, "refuted")):
        bump = form * np.exp(-(((np.arange(400) - 150) / 3) ** 2))
        centres = nominal.curve.point(u) + (1.0 + bump)[:, None] * normal
        assert PlacementSearch(nominal, 0.04, tip_radius_mm=1.0).look(centres).outcome == outcome


def test_a_search_that_may_not_go_on_is_undecided() -> None:
    assert PlacementSearch(nominal_of("goe404"), 0.05).look(dented("goe404")[:240], most_boxes=300).outcome == "undecided"


def test_what_few_of_many_points_prove_holds_for_all() -> None:
    """A single point in a long scan decides: refuted with it, and a placement that is found is one of all the points."""
    name, count = "goe404", 9000
    points = scan(name, count, reference_form(name, count), 92, (15, -7))
    half = fit_minimum_zone(points, nominal_of(name)).zone_mm / 2
    for allowed, outcome in ((half + 1e-6, "fits"), (half - 1e-5, "refuted")):
        found = PlacementSearch(nominal_of(name), allowed).look(points)
        assert found.outcome == outcome
        assert all(0 <= witness < count for witness in found.witnesses)
    form = reference_form(name, count)
    form[4321] -= 0.12
    assert PlacementSearch(nominal_of(name), half + 0.005).look(scan(name, count, form, 92, (15, -7))).outcome == "refuted"


@pytest.mark.parametrize(
    ("free", "between", "is_limited"),
    [
        ((), (0.0, 0.0), False),
        (("x",), (-0.03, 0.2), True),
        (("x",), (-0.2, 0.2), False),
        (("y",), (-0.2, 0.2), False),
        (("rotation",), (-5e-4, 2e-3), True),
        (("rotation",), (-3e-3, 3e-3), False),
    ],
)
def test_within_freedoms_the_smallest_zone_is_that_of_a_walk_through_them(
    free: tuple[FreedomName, ...], between: tuple[float, float], is_limited: bool
) -> None:
    """Of one free motion every amount can be tried in steps; of none there is one placement. The axis x lies along 30 degrees."""
    nominal, points = nominal_of("goe404"), scan("goe404", 200, reference_form("goe404", 200), 0, (0, 0))
    start = rotation_about(np.array([40.0, 3.0]), np.radians(0.05), np.array([0.05, -0.03]))
    freedoms = Freedoms.about((40.0, 3.0), free, np.radians(30.0), {free[0]: between} if is_limited else None)
    amounts = np.linspace(*between, 1001)[:, None][:, : len(free)]
    least = min(float(np.abs(deviations(freedoms.pose(start, one).apply(points), nominal).deviation_mm).max()) for one in amounts)
    step = (between[1] - between[0]) / 1000 * (65.0 if "rotation" in free else 1.0)  # mm, of the point that is farthest from the pivot
    assert PlacementSearch(nominal, least - step / 2 - 1e-8, freedoms=freedoms).look(points, start).outcome == "refuted"
    assert PlacementSearch(nominal, least - 1e-10, freedoms=freedoms).look(points, start, 2000).outcome != "refuted"  # by round-off alone
    found = PlacementSearch(nominal, least + 1e-6, freedoms=freedoms).look(points, start)
    assert found.pose is not None
    assert np.abs(deviations(found.pose.apply(points), nominal).deviation_mm).max() <= least + 1e-6
    assert PlacementSearch(nominal, least - step).look(points, start).outcome == "fits"  # where every motion counts, it goes in


def test_a_search_within_freedoms_needs_the_pose_from_which_they_count() -> None:
    with pytest.raises(ValueError, match="needs the pose"):
        PlacementSearch(nominal_of("goe404"), 0.05, freedoms=Freedoms.about((0.0, 0.0), ("x",))).look(dented("goe404"))
