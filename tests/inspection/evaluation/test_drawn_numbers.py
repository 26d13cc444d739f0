"""What a drawn section may mislead by: a part of another size is never told better than it is, however roughly its edges are drawn."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy.interpolate import make_interp_spline

from inspection import (
    CharacteristicResult,
    InspectionError,
    LineProfile,
    LiveInspection,
    NominalProfile,
    NurbsCurve,
    Outline,
    Region,
    SectionCharacteristic,
    ToleranceZone,
    VaryingZone,
    Verdict,
    ZoneCertificate,
    discretize,
    find_airfoil,
    find_camber_line,
    with_nominal,
)
from inspection.characteristics.inscribed import continue_to_edges, inscribe_circles
from inspection.characteristics.outline import Edge
from tests.inspection import profiles
from tests.inspection.profiles import Array, even_in_arc_length, left_normal

POINTS = 1500
WIDE = ToleranceZone(-2.0, 2.0)
KINDS = (
    SectionCharacteristic("chord", "chord", "tangent", -1.0, 1.0),
    SectionCharacteristic("nose to tail", "chord", "nose-tail", -1.0, 1.0),
    SectionCharacteristic("thickness", "thickness", "inscribed", -1.0, 1.0),
    SectionCharacteristic("leading radius", "edge-radius", "circle", -1.0, 1.0),
    SectionCharacteristic("trailing radius", "edge-radius", "circle", -1.0, 1.0, edge="trailing"),
    SectionCharacteristic("trailing thickness", "edge-thickness", "tip-arc", -1.0, 1.0, edge="trailing", offset_mm=3.0),
    SectionCharacteristic("camber", "camber", "inscribed", -1.0, 1.0),
)


@cache
def blade(scale_x: float = 1.0, scale_y: float = 1.0) -> NominalProfile:
    """A cambered section 100 mm long whose edges are round, with radii of about 0.7 and 0.3 mm: less than the knots of a drawn section."""
    turn = np.linspace(0.0, 2 * np.pi, 401)
    x = (1 + np.cos(turn)) / 2
    y = 10 * np.sin(turn) * (0.6 * (1 - x) + 0.35 * x + 0.25 * x * (1 - x)) + 16 * x * (1 - x)
    places = np.column_stack([100 * scale_x * x, scale_y * y])
    places[-1] = places[0]
    spline = make_interp_spline(turn, places, k=3, bc_type="periodic")
    return discretize(NurbsCurve(3, spline.c, spline.t, closed=True), samples=2000)


@cache
def numbers_of(scale_x: float, scale_y: float) -> dict[str, float]:
    """What every kind gives of a section that was drawn in this size."""
    outline = Outline(find_airfoil(blade(scale_x, scale_y)))
    return {one.name: with_nominal(one, lambda: outline).nominal_value for one in KINDS}


@cache
def known() -> dict[str, SectionCharacteristic]:
    """Every kind with what it is worked out from on the nominal, which its limits do not change."""
    outline = Outline(find_airfoil(blade()))
    return {one.name: with_nominal(one, lambda: outline) for one in KINDS}


def judged(points: Array, limits: dict[str, float]) -> dict[str, CharacteristicResult]:
    """What comes of the kinds that have a limit, which holds to both sides."""
    asked = [replace(known()[name], lower=-limit, upper=limit) for name, limit in limits.items()]
    live = LiveInspection(blade(), WIDE, provisional=False, characteristics=asked)
    live.add(points)
    return {one.name: one for one in live.finish(True).characteristics}


def points_on(profile: NominalProfile, bump_mm: float = 0.0, at: float = 0.0) -> Array:
    """Even points (m, 2) on a profile, with a bump at a share of its length."""
    u = even_in_arc_length(profile.curve, POINTS)
    off = (np.arange(POINTS) + 0.5) / POINTS - at
    bump = bump_mm * np.exp(-np.square(off * profile.length_mm / 1.2))
    return np.asarray(profile.curve.point(u) + bump[:, None] * profile.outward * left_normal(profile.curve, u))


@pytest.mark.parametrize("scales", [(1.002, 1.0), (0.998, 1.0), (1.0, 1.03), (1.0, 0.98), (1.003, 1.01)])
def test_a_part_of_another_size_conforms_to_no_limit_that_it_exceeds_and_fails_none_that_it_keeps(scales: tuple[float, float]) -> None:
    off = {name: value - numbers_of(1.0, 1.0)[name] for name, value in numbers_of(*scales).items()}
    told = [one.name for one in KINDS if abs(off[one.name]) > 1e-3]
    points = points_on(blade(*scales))
    for share, never in ((0.97, Verdict.CONFORM), (1.03, Verdict.NONCONFORM)):
        found = judged(points, {name: share * abs(off[name]) for name in told})
        assert not [(name, one.deviation, off[name]) for name, one in found.items() if one.verdict is never]


@pytest.mark.parametrize("at", [0.07, 0.12, 0.24, 0.7, 0.88])
def test_a_bump_changes_no_number_of_what_it_is_not_on(at: float) -> None:
    """The camber line goes on past the bump, on whichever side: it once ran straight on from there, and the chord was 23 mm too short."""
    found = judged(points_on(blade(), 0.4, at), dict.fromkeys(known(), 1.0))
    for name in ("chord", "nose to tail", "trailing radius", "trailing thickness"):
        assert found[name].deviation == pytest.approx(0.0, abs=0.02), name
    assert abs(found["camber"].deviation) < 0.3  # half of the bump, where it is on the highest place


def test_a_camber_line_that_was_followed_to_no_edge_is_refused() -> None:
    section = find_airfoil(blade())
    whole = find_camber_line(section).circles
    for part, edge in ((slice(60, None), "leading"), (slice(None, -60), "trailing")):
        with pytest.raises(InspectionError, match=f"no circle touches both sides over the last .* before the {edge} edge"):
            continue_to_edges(section, inscribe_circles(section, whole.u[part]))


@pytest.mark.parametrize("edge", ["leading", "trailing"])
def test_a_window_that_runs_into_the_sides_gives_no_radius_of_the_edge(edge: Edge) -> None:
    """From 90 degrees on it holds a whole side, and the circle through it has a radius of 500 mm, which noise moves by 60."""
    outline = Outline(find_airfoil(blade()))
    for window in (1.0, 30.0, 60.0):
        asked = SectionCharacteristic("radius", "edge-radius", "circle", -1.0, 1.0, edge=edge, window_deg=window)
        assert with_nominal(asked, lambda: outline).nominal_value < 1.2
    for window in (90.0, 120.0, 180.0):
        asked = SectionCharacteristic("radius", "edge-radius", "circle", -1.0, 1.0, edge=edge, window_deg=window)
        with pytest.raises(InspectionError, match=f"window of {window:g} degrees reaches .* into its sides"):
            with_nominal(asked, lambda: outline)


@pytest.mark.parametrize("count", [800, 8000])
def test_a_smooth_flank_has_a_settled_minimum_zone_however_densely_it_was_measured(count: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """The last steps are shorter than what the solver of linear programs errs by: it took its errors for gains, and never settled."""
    monkeypatch.setattr("inspection.evaluation.placing._MOST_BOXES", 256)
    profile = blade()
    length = profile.length_mm
    station = (np.arange(count) + 0.5) / count * length
    u = np.interp(station, profile.station_mm, profile.parameter)
    normal = profile.outward * left_normal(profile.curve, u)
    form = 0.012 * np.sin(8 * np.pi * station / length + 0.4) + 0.01 * np.cos(18 * np.pi * station / length)
    zone = VaryingZone.constant(-0.05, 0.05, length, True)
    flank = LineProfile("flank", zone, region=Region(0.1 * length, 0.35 * length), fit="minimum-zone")
    live = LiveInspection(profile, WIDE, provisional=False, characteristics=[flank], tip_radius_mm=1.0)
    live.add(profile.curve.point(u) + (1.0 + form)[:, None] * normal)
    (found,) = live.finish().characteristics
    assert found.verdict is Verdict.CONFORM
    assert isinstance(found.certificate, ZoneCertificate)
    assert len(found.certificate.multipliers) == 4


def test_a_camber_line_that_bulges_as_far_to_both_sides_is_judged_by_both_and_not_by_which_of_them_is_larger_by_a_hair() -> None:
    """A symmetric section with two waves of 0.01 mm: its camber is +0.01 or -0.01 mm, and where both are allowed that is no doubt."""
    profile = discretize(profiles.naca("0012"), samples=2000)
    u = even_in_arc_length(profile.curve, 800)
    off = 0.01 * np.sin(4 * np.pi * profile.curve.station_mm(u) / profile.length_mm + 0.4)
    points = profile.curve.point(u) + off[:, None] * profile.outward * left_normal(profile.curve, u)
    outline = Outline(find_airfoil(profile))
    asked = [
        with_nominal(SectionCharacteristic(f"{lower} .. {upper}", "camber", "inscribed", lower, upper), lambda: outline)
        for lower, upper in ((-0.02, 0.02), (-0.002, 0.05), (-0.05, 0.002), (-0.001, 0.001))
    ]
    live = LiveInspection(profile, WIDE, provisional=False, characteristics=asked)
    live.add(points)
    both, up, down, none = live.finish(True).characteristics
    assert abs(both.value) == pytest.approx(0.01, abs=2e-3)
    assert both.verdict is Verdict.CONFORM
    assert {up.verdict, down.verdict} <= {Verdict.UNCERTAIN, Verdict.NONCONFORM}
    assert Verdict.UNCERTAIN in {up.verdict, down.verdict}
    assert none.verdict is Verdict.NONCONFORM
    assert any("to the other" in one.reasons[0].words for one in (up, down))
