"""A datum that is measured on the part itself: what it decides, what leaves nothing decided, and what it brings into U."""

from typing import Any

import numpy as np
import pytest

from inspection import (
    CharacteristicResult,
    LineProfile,
    LiveInspection,
    Missing,
    StatedUncertainty,
    ToleranceZone,
    UncertaintyBudget,
    VaryingZone,
    Verdict,
    discretize,
)
from inspection.datum import DatumFeature, DatumFeatures, find_datum
from inspection.signed_deviations import deviations
from tests.inspection import profiles
from tests.inspection.evaluation.asked import DATUM, by_features, even, form, named, nominal, points_at, run, stations, value
from tests.inspection.profiles import Array

PLACED = LineProfile("placed", even(-0.06, 0.06), fit="datum", features=by_features())
FREE = LineProfile("free", even(-0.06, 0.06), fit="best-fit")
TWIST = value("twist", "twist", "best-fit", 0.05, features=by_features())
FACTOR = 2.0


def tilted() -> Array:
    """The line of the datum leans by 1.8 in a thousand; the rest of the part is right."""
    s = stations()
    return points_at(s, np.where((s > 18) & (s < 72), 0.0018 * (s - 45), 0.0))


def judged(points: Array, **settings: Any) -> dict[str, CharacteristicResult]:
    return named(run(points, asked=(PLACED, FREE, TWIST), **settings))


def test_a_part_that_leans_on_its_datum_fails_there_and_conforms_where_it_may_be_fitted() -> None:
    found = judged(tilted())
    assert found["free"].verdict is Verdict.CONFORM
    assert found["placed"].verdict is Verdict.NONCONFORM
    assert found["twist"].verdict is Verdict.NONCONFORM
    assert found["twist"].value == pytest.approx(np.degrees(0.0018), rel=0.25)  # the best fit of all points leans a little too
    assert found["placed"].fit.startswith("datum: line station 20 .. 70 mm, point at station")
    assert found["placed"].datum is not None
    assert [one.feature.kind for one in found["placed"].datum.seen] == ["line", "point"]


@pytest.mark.parametrize(("first", "last"), [(40.0, 46.0), (98.0, 104.0)])
@pytest.mark.parametrize("points", [tilted(), points_at(stations(), form(stations()))], ids=["bad", "good"])
def test_where_a_feature_was_not_measured_nothing_is_decided(points: Array, first: float, last: float) -> None:
    nose = by_features().features[1]
    at = (first, last) if first < 90 else (nose.from_mm + 1.0, nose.to_mm - 1.0)
    found = judged(points[(stations() < at[0]) | (stations() > at[1])])
    for name in ("placed", "twist"):
        assert found[name].verdict is Verdict.UNCERTAIN
        assert "The datum was not found: of its" in found[name].reasons[0].words
    assert found["placed"].reasons[0].kind == "datum"


def test_what_no_placement_brings_in_fails_without_its_datum() -> None:
    s = stations()
    points = points_at(s, 0.4 * np.sin(8 * np.pi * s / nominal().length_mm))
    placed = judged(points[(s < 40) | (s > 46)])["placed"]
    assert placed.verdict is Verdict.NONCONFORM
    assert placed.reasons[0].words == "No placement of the part brings its points into the zone: it fails at any datum."


def test_points_of_a_scan_that_broke_off_prove_nothing_at_their_datum() -> None:
    found = judged(tilted(), complete=False)
    assert found["placed"].verdict is Verdict.UNCERTAIN
    assert found["placed"].reasons[0].words.startswith("The scan did not come to its end: the points of the datum")
    assert judged(points_at(stations(), form(stations())), missing=Missing(lost=1))["placed"].verdict is Verdict.UNCERTAIN


def test_a_part_that_fits_in_two_poses_has_no_datum() -> None:
    oval = discretize(profiles.ellipse(40.0, 20.0), samples=2000)
    points = tuple(DatumFeature("point", at - 3.0, at + 3.0, f"point at station {at:g} mm") for at in (30.0, 60.0, 100.0))
    zone = VaryingZone.constant(-0.1, 0.1, oval.length_mm, True)
    asked = LineProfile("placed", zone, fit="datum", features=DatumFeatures(points))
    live = LiveInspection(oval, ToleranceZone(-0.1, 0.1), coverage_min=0.95, provisional=False, characteristics=(asked,))
    live.add(DATUM.inverse().apply(oval.points_mm[::5]))
    (placed,) = live.finish().characteristics
    assert placed.verdict is Verdict.UNCERTAIN
    assert "fits the nominal in another pose as well" in placed.reasons[0].words


def test_a_stated_u_counts_for_every_point_of_the_datum_at_its_worst() -> None:
    points = points_at(stations(), form(stations()))
    live = LiveInspection(
        nominal(), ToleranceZone(-0.06, 0.06, 0.004), coverage_min=0.95, provisional=False, characteristics=(PLACED, FREE)
    )
    live.add(points)
    placed, free = live.finish().characteristics
    assert free.uncertainty == 0.004
    assert placed.datum is not None
    rear = nominal().points_mm[:1] - placed.datum.pivot_mm
    normal = nominal().outward * nominal().normal[:1]
    moved = placed.datum.gain[:2].T @ normal[0] + placed.datum.gain[2] * (rear[0, 0] * normal[0, 1] - rear[0, 1] * normal[0, 0])
    assert placed.uncertainty >= 0.004 * (1 + np.abs(moved).sum())  # as it is at one place of the profile
    assert placed.uncertainty > 0.008
    assert judged(points)["placed"].notes == ("no uncertainty is stated, so that none of the datum is counted",)


def test_u_at_a_datum_by_the_budget_is_that_of_a_monte_carlo() -> None:
    budget = UncertaintyBudget(repeatability_mm=0.002, tip_radius_mm=0.001)
    s = stations()
    live = LiveInspection(
        nominal(),
        ToleranceZone(-0.06, 0.06),
        coverage_min=0.95,
        provisional=False,
        characteristics=(PLACED, TWIST),
        uncertainty=StatedUncertainty(budget, FACTOR),
    )
    live.add(points_at(s, form(s)))
    placed, twist = live.finish().characteristics
    random, true = np.random.default_rng(7), points_at(s, np.zeros(len(s)))
    outward = deviations(DATUM.apply(true), nominal()).normal
    places, normals = nominal().points_mm[::20], nominal().outward * nominal().normal[::20]
    off, turned = [], []
    for _ in range(160):
        tip = 0.001 * random.standard_normal()
        errors = 0.002 * random.standard_normal(len(s)) + tip
        points = DATUM.inverse().apply(DATUM.apply(true) + errors[:, None] * outward)
        pose = find_datum(points, nominal(), by_features(), DATUM, 5.0).pose.after(DATUM.inverse())
        off.append(((pose.apply(places) - places) * normals).sum(axis=1) + tip + 0.002 * random.standard_normal(len(places)))
        turned.append(np.degrees(pose.rotation_rad))
    assert placed.uncertainty == pytest.approx(FACTOR * np.std(off, axis=0).max(), rel=0.2)
    assert placed.uncertainty > 1.3 * FACTOR * np.hypot(0.002, 0.001)  # more than at a known pose
    assert twist.uncertainty >= FACTOR * np.std(turned) * 0.85
