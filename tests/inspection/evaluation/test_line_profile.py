"""Line profiles at poses of their own: the printed values of independent programs, and what is proven where."""

import numpy as np
import pytest

from inspection import (
    CharacteristicFit,
    CharacteristicResult,
    ConsumptionCertificate,
    FreedomName,
    Freedoms,
    LineProfile,
    LiveInspection,
    ProfileFilter,
    Region,
    RigidTransform,
    StatedUncertainty,
    ToleranceZone,
    UncertaintyBudget,
    VaryingZone,
    Verdict,
    WholeProfile,
    ZoneCertificate,
    discretize,
)
from inspection.rigid import rotation_about
from inspection.tolerance import DecisionRule
from tests.inspection.evaluation.asked import COUNT, DATUM, even, form, named, nominal, points_at, run, stations
from tests.inspection.profiles import Array, even_in_arc_length, naca, offset_points
from tests.inspection.reference_parts import nominal_of, reference_form, scan

PIVOT = np.array([40.0, 3.0])
SHARES = np.array([0, 0.04, 0.06, 0.44, 0.46, 0.54, 0.56, 0.94, 0.96, 1])
LOWER = np.array([-0.03, -0.03, -0.02, -0.02, -0.03, -0.03, -0.06, -0.06, -0.03, -0.03])
UPPER = np.array([0.03, 0.03, 0.08, 0.08, 0.03, 0.03, 0.06, 0.06, 0.03, 0.03])
HALF_ZONE = {"goe404": (0.036958537, [141, 309, 445, 499]), "mh42": (0.037013398, [251, 308, 445, 499])}
CONSUMED = {"goe404": 1.025950758, "mh42": 1.046509439}
LOCKED: list[tuple[tuple[FreedomName, ...], float]] = [
    (("x", "y"), 0.065880484),
    (("rotation",), 0.071607420),
    (("x",), 0.085171728),
    (("y",), 0.086135719),
    (("y", "rotation"), 0.067137563),
]


def of_reference(name: str, points: Array, *asked: LineProfile) -> tuple[CharacteristicResult, ...]:
    live = LiveInspection(nominal_of(name), ToleranceZone(-0.5, 0.5), provisional=False, characteristics=asked)
    live.add(points)
    return live.finish().characteristics


def even_on(name: str, half_mm: float) -> VaryingZone:
    return VaryingZone.constant(-half_mm, half_mm, nominal_of(name).length_mm, True)


@pytest.mark.parametrize("name", HALF_ZONE)
def test_a_minimum_zone_is_the_printed_one_with_its_points_and_its_proof(name: str) -> None:
    half, rows = HALF_ZONE[name]
    points = scan(name, 500, reference_form(name, 500), 92.0, (15.0, -7.0))
    (found,) = of_reference(name, points, LineProfile("contour", even_on(name, 0.05), fit="minimum-zone"))
    assert found.value == pytest.approx(2 * half, abs=4e-9)
    proof = found.certificate
    assert isinstance(proof, ZoneCertificate)
    assert proof.active.tolist() == rows
    assert proof.proven
    assert 0 < proof.gap_mm <= 1e-3 * 0.1
    assert proof.boxes > 1000
    assert proof.balanced
    assert found.verdict is Verdict.CONFORM


@pytest.mark.parametrize("name", CONSUMED)
def test_a_least_consumption_is_the_printed_one_and_above_the_zone_it_is_proven_so(name: str) -> None:
    length = nominal_of(name).length_mm
    points = scan(name, 500, reference_form(name, 500), 92.0, (15.0, -7.0))
    zone = VaryingZone(SHARES * length, LOWER, UPPER, length, True)
    (found,) = of_reference(name, points, LineProfile("flank", zone, fit="tolerance"))
    assert found.consumption == pytest.approx(CONSUMED[name], abs=2e-8)
    assert found.verdict is Verdict.NONCONFORM
    assert isinstance(found.certificate, ConsumptionCertificate)
    assert found.certificate.proven
    assert found.certificate.bound > 1


@pytest.mark.parametrize(("free", "largest"), LOCKED, ids=lambda value: "-".join(value) if isinstance(value, tuple) else "")
def test_locked_freedoms_leave_what_is_printed(free: tuple[FreedomName, ...], largest: float) -> None:
    points = rotation_about(PIVOT, np.radians(0.05), np.array([0.05, -0.03])).apply(
        scan("goe404", 500, reference_form("goe404", 500), 0, (0, 0))
    )
    asked = LineProfile("form", even_on("goe404", 0.5), freedoms=Freedoms.about(PIVOT, free), datum=RigidTransform.identity())
    live = LiveInspection(nominal_of("goe404"), ToleranceZone(-0.5, 0.5), weights="points", provisional=False, characteristics=(asked,))
    live.add(points)
    (found,) = live.finish().characteristics
    assert found.value == pytest.approx(2 * largest, abs=1e-8)
    assert found.fit == f"best-fit, free: {', '.join(free)} about (40, 3) mm"


def good(bump_mm: float = 0.0, at_mm: float = 60.0) -> Array:
    return points_at(stations(), form(stations(), bump_mm, at_mm))


@pytest.mark.parametrize(
    ("rule", "verdict"), [("iso-14253-1", Verdict.UNCERTAIN), ("ilac-g8", Verdict.UNCERTAIN), ("simple", Verdict.CONFORM)]
)
def test_u_counts_by_the_decision_rule_of_the_run(rule: DecisionRule, verdict: Verdict) -> None:
    live = LiveInspection(
        nominal(),
        ToleranceZone(-0.06, 0.06, 0.001, rule),
        provisional=False,
        characteristics=(LineProfile("near", even(-0.018, 0.018), 0.005, fit="minimum-zone"),),
    )
    live.add(good())
    (found,) = live.finish().characteristics
    assert 0.013 < found.value / 2 < 0.018
    assert found.verdict is verdict
    assert found.uncertainty == 0.005


def test_at_a_datum_the_errors_count_that_a_free_fit_takes_away() -> None:
    """The device's error over the length moves the part as a whole as well; a free fit leaves little of it."""
    stated = StatedUncertainty(UncertaintyBudget(mpe_mm=0.01))
    asked = (LineProfile("form", even(-0.06, 0.06)), LineProfile("place", even(-0.06, 0.06), fit="datum", datum=DATUM))
    live = LiveInspection(nominal(), ToleranceZone(-0.06, 0.06), provisional=False, characteristics=asked, uncertainty=stated)
    live.add(good())
    form_, place = live.finish().characteristics
    assert 0 < form_.uncertainty < 0.9 * place.uncertainty


def test_what_passes_in_another_placement_conforms_by_the_rule_minimum_zone_alone() -> None:
    """A bump tilts the best fit; the minimum zone halves it."""
    zone = even(-0.09, 0.09)
    points = good(0.2)
    by_rule = {
        rule: named(run(points, asked=(LineProfile("contour", zone, rule=rule),)))["contour"] for rule in ("minimum-zone", "best-fit")
    }
    assert by_rule["best-fit"].verdict is Verdict.NONCONFORM
    assert by_rule["minimum-zone"].verdict in (Verdict.CONFORM, Verdict.NONCONFORM)
    assert by_rule["minimum-zone"].value <= by_rule["best-fit"].value


def test_points_far_out_at_a_pose_that_is_not_known_are_not_proven_out_where_another_placement_passes() -> None:
    """At the pose of the run the filtered profile decides; a plain one is asked in every placement."""
    twisted = rotation_about(np.array([50.0, 0.0]), np.radians(0.2), np.zeros(2)).apply(DATUM.apply(good()))
    points = DATUM.inverse().apply(twisted)
    asked = (
        LineProfile("location", even(-0.06, 0.06), fit="datum", datum=DATUM),
        LineProfile("turned back", even(-0.06, 0.06), freedoms=Freedoms.about((50.0, 0.0), ("rotation",)), datum=DATUM),
        LineProfile("not so far", even(-0.06, 0.06), freedoms=Freedoms.about((50.0, 0.0), ("x",)), datum=DATUM),
    )
    found = named(run(points, asked=asked))
    assert found["location"].verdict is Verdict.NONCONFORM
    assert found["turned back"].verdict is Verdict.CONFORM
    assert found["not so far"].verdict is Verdict.NONCONFORM


@pytest.mark.parametrize("fit", ["minimum-zone", "tolerance"])
@pytest.mark.parametrize("filter_", [None, ProfileFilter(2.0)])
def test_what_locked_freedoms_bring_into_no_zone_is_proven_out_of_those_motions_alone(
    fit: CharacteristicFit, filter_: ProfileFilter | None
) -> None:
    """The part turned by 0.2 degrees fits in other placements, of which a datum that locks the rotation allows none."""
    twisted = DATUM.inverse().apply(rotation_about(np.array([50.0, 0.0]), np.radians(0.2), np.zeros(2)).apply(DATUM.apply(good())))
    free, locked = (
        Freedoms.about((50.0, 0.0), ("x", "y")),
        Freedoms.about((50.0, 0.0), ("x", "rotation"), limits={"rotation": (-0.01, 0.01)}),
    )
    asked = [
        LineProfile(name, even(-0.06, 0.06), fit=fit, freedoms=freedoms, datum=datum, filter=filter_)
        for name, freedoms, datum in (("out", free, DATUM), ("in", locked, DATUM), ("of no datum", free, None))
    ]
    found = named(run(twisted, asked=tuple(asked)))
    assert found["out"].verdict is Verdict.NONCONFORM
    assert found["out"].value > 0.3
    assert found["in"].verdict is Verdict.CONFORM
    assert found["of no datum"].verdict is Verdict.CONFORM  # it counts from the best fit of the run, where the part is not turned


def test_too_few_points_for_a_fit_prove_nothing() -> None:
    found = named(run(good()[: COUNT // 24]))
    assert {one.verdict for one in found.values()} == {Verdict.UNCERTAIN}


def test_a_region_with_too_few_points_for_its_fit_is_proven_nowhere_else_than_where_it_was_asked_for() -> None:
    """Two points in a region, a part 0.3 mm off its datum: it lies out there, and no fit of a region says anything of it."""
    region = Region(0.2 * nominal().length_mm, 0.206 * nominal().length_mm)
    locked = Freedoms.about((0.0, 0.0), ("x",))
    asked = [
        LineProfile("none", even(-0.06, 0.06), region=region, fit="none"),
        LineProfile("datum", even(-0.06, 0.06), region=region, fit="datum", datum=DATUM),
        *(LineProfile(fit, even(-0.06, 0.06), region=region, fit=fit) for fit in ("best-fit", "minimum-zone", "tolerance")),
        *(
            LineProfile(f"{fit} within", even(-0.06, 0.06), region=region, fit=fit, datum=DATUM, freedoms=locked)
            for fit in ("best-fit", "minimum-zone", "tolerance")
        ),
        LineProfile("by its fit", even(-0.06, 0.06), region=region, fit="best-fit", rule="best-fit"),
    ]
    found = named(run(RigidTransform(0.0, np.array([0.0, 0.3])).apply(good()), asked=tuple(asked)))
    assert found["none"].verdict is Verdict.CONFORM
    assert found["datum"].verdict is Verdict.NONCONFORM
    for one in asked[2:]:
        assert found[one.name].verdict is Verdict.UNCERTAIN
        assert "too few for a fit" in found[one.name].reasons[0].words


def test_a_filtered_verdict_tells_what_the_filter_took_away() -> None:
    """A dent that is shorter than the cutoff passes a filter; what it was stands beside the verdict."""
    dented = points_at(stations(), form(stations(), -0.3, 60.0, 0.5))
    asked = [
        LineProfile("raw", even(-0.06, 0.06), fit="none"),
        *(
            LineProfile(name, even(-0.06, 0.06), fit="none", filter=ProfileFilter(20.0, 2, name == "robust"))
            for name in ("plain", "robust")
        ),
    ]
    found = named(run(dented, asked=tuple(asked)))
    assert found["raw"].notes == ()
    for name in ("plain", "robust"):
        assert any("before the filter 1 point lies beyond the limits" in note for note in found[name].notes)
    assert any("for spikes" in note for note in found["robust"].notes)
    assert not any("for spikes" in note for note in found["plain"].notes)


def at_an_end(off_mm: float, waves: int) -> CharacteristicResult:
    """An open section scanned with a ball of 0.5 mm, and one ball more whose centre lies so far behind the end of the nominal."""
    curve = naca("2412", sharp=False)
    wave = 0.02 * np.sin(2 * np.pi * (waves * np.arange(198) / 198 + 0.3))
    centres = offset_points(curve, even_in_arc_length(curve, 198), -(wave + 0.5))
    end, before = curve.point(np.array([curve.domain[1], curve.domain[1] - 1e-3]))
    centres = np.vstack([centres, end + off_mm * (end - before) / np.hypot(*(end - before))])
    opened, zone = discretize(curve, samples=600, material="left"), ToleranceZone(-0.05, 0.05)
    live = LiveInspection(opened, zone, fit="minimum-zone", tip_radius_mm=0.5, characteristics=[WholeProfile("profile")])
    live.add(centres)
    return live.finish().characteristics[0]


@pytest.mark.parametrize("off_mm", [0.1, 0.4, 0.5, 0.6, 2.0])
def test_a_ball_behind_an_end_touches_it_or_the_part_is_longer_or_shorter(off_mm: float) -> None:
    found = at_an_end(off_mm, 2)
    assert found.verdict is (Verdict.CONFORM if off_mm == 0.5 else Verdict.UNCERTAIN)
    if off_mm != 0.5:
        (reason,) = found.reasons
        assert reason.kind == "ends"
        assert float(reason.words.split(" up to ")[1].split()[0]) == pytest.approx(
            abs(off_mm - 0.5), abs=0.02
        )  # by so much the waves move the fit


def test_a_smaller_zone_in_another_placement_is_said_beside_the_value() -> None:
    """The fit takes a ball at the very end for one within the profile, half a millimetre deep in the part; elsewhere it takes no part."""
    found = at_an_end(0.02, 3)
    assert found.verdict is Verdict.NONCONFORM
    assert found.value > 0.4
    assert isinstance(found.certificate, ZoneCertificate)
    assert found.certificate.zone_mm == pytest.approx(0.04, abs=1e-4)
    (note,) = found.notes
    assert f"{found.certificate.zone_mm:.6g} mm" in note
