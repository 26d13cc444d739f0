"""Whole surfaces judged: the verdict, its reasons, defects and what was not measured, against what is known of made-up parts."""

from dataclasses import replace

import numpy as np
import pytest

from inspection import InspectionError, Missing, NotMeasured, ToleranceZone, Verdict
from inspection.surface import LiveSurface, PatchSurface, RigidMotion, SurfaceTerms, TriangleSurface, judge_surface
from inspection.verdict import NOT_JUDGED, Rejection
from tests.inspection.surface import faces, meshes
from tests.inspection.surface.surface_scans import MOTION, NEAR, NOTCHED, WHERE_IT_IS, ZONE, kinds, scan

DENT_AT = (20.0, 5.0, 20.0)


def test_a_good_part_conforms_and_one_with_a_dent_does_not() -> None:
    places, normals, points = scan(NOTCHED, 8000)
    good = judge_surface(MOTION.inverse().apply(points), NOTCHED, NEAR)
    assert (good.verdict, good.reasons, good.regions, good.unmeasured) == (Verdict.CONFORM, (), (), ())
    assert (good.coverage, good.rule, good.judged) == (1.0, "best-fit", len(points))
    assert good.gap_mm <= good.gap_max_mm
    dent = (np.linalg.norm(places - DENT_AT, axis=1) < 1.5) & (normals[:, 2] > 0.9)
    bad = judge_surface(MOTION.inverse().apply(points - 0.3 * dent[:, None] * normals), NOTCHED, NEAR)
    assert bad.verdict is Verdict.NONCONFORM
    assert kinds(bad) == ["out-of-tolerance"]
    (region,) = bad.regions
    assert region.points == bad.out_of_tolerance == np.count_nonzero(dent)
    assert region.area_mm2 == pytest.approx(np.pi * 1.5**2, rel=0.2)
    assert region.worst_mm == pytest.approx(-0.3, abs=0.03)
    assert region.centre_mm == pytest.approx(DENT_AT, abs=0.5)
    assert bad.worst is not None
    assert bad.feet.distance_mm[bad.worst] == region.worst_mm == bad.min_deviation_mm


def test_dents_apart_are_regions_of_their_own_and_the_deepest_comes_first() -> None:
    places, normals, points = scan(NOTCHED, 20_000)
    depth = np.zeros(len(places))
    for x, mm in ((10.0, 0.1), (20.0, 0.2), (30.0, 0.15)):
        depth[(np.linalg.norm(places - (x, 5, 20), axis=1) < 1.5) & (normals[:, 2] > 0.9)] = mm
    found = judge_surface(points - depth[:, None] * normals, NOTCHED, WHERE_IT_IS)
    assert [region.worst_mm for region in found.regions] == pytest.approx([-0.2, -0.15, -0.1], abs=0.02)
    assert [region.centre_mm[0] for region in found.regions] == pytest.approx([20, 30, 10], abs=0.5)
    assert sum(region.points for region in found.regions) == np.count_nonzero(depth) == found.out_of_tolerance
    thick = np.concatenate(
        [points - depth[:, None] * normals, np.repeat(points[depth > 0] - depth[depth > 0, None] * normals[depth > 0], 5, 0)]
    )
    dense = judge_surface(thick, NOTCHED, WHERE_IT_IS)
    assert [region.area_mm2 for region in dense.regions] == pytest.approx([np.pi * 1.5**2] * 3, rel=0.2)


def test_a_side_that_was_not_scanned_is_named() -> None:
    places, normals, points = scan(NOTCHED, 8000)
    top = normals[:, 2] > 0.9
    found = judge_surface(points[~top], NOTCHED, replace(WHERE_IT_IS, coverage_min=0.9))
    assert found.verdict is Verdict.UNCERTAIN
    assert kinds(found) == ["coverage", "gap"]
    area = 10 * 10 * 6.0
    assert found.coverage == pytest.approx(1 - area / NOTCHED.area_mm2, abs=0.02)
    part = found.unmeasured[0]
    assert part.area_mm2 == pytest.approx(area, rel=0.1)
    assert part.centre_mm[2] == pytest.approx(20)
    assert 8 < part.width_mm < 60
    hole = np.linalg.norm(places - (20, 5, 20), axis=1) < 4
    found = judge_surface(points[~hole], NOTCHED, WHERE_IT_IS)
    assert kinds(found) == ["gap"]
    assert found.unmeasured[0].centre_mm == pytest.approx(DENT_AT, abs=1)
    assert found.gap_mm == found.unmeasured[0].width_mm == pytest.approx(8, abs=2)


def test_the_other_side_of_a_thin_wall_is_not_measured_through_it() -> None:
    thin = TriangleSurface(10 * meshes.prism(meshes.NOTCHED, 0.02))  # 0.2 mm thick
    _, normals, points = scan(thin, 8000)
    found = judge_surface(points[normals[:, 2] > -0.9], thin, WHERE_IT_IS)
    assert found.verdict is Verdict.UNCERTAIN
    assert found.coverage == pytest.approx(0.5, abs=0.06)  # an edge that was seen from one side is narrow
    assert found.unmeasured[0].width_mm > 10


def test_a_mesh_coarser_than_the_zone_proves_nothing_and_says_what_would() -> None:
    coarse = TriangleSurface(10 * meshes.prism(meshes.NOTCHED, 2.0), nominal_error_mm=0.05)
    _, _, points = scan(coarse, 6000, noise_mm=0.0)
    for zone in (ToleranceZone(-0.02, 0.02), ToleranceZone(-0.02, 0.02, 0.001), ToleranceZone(-0.02, 0.02, 0.001, rule="simple")):
        found = judge_surface(points, coarse, replace(WHERE_IT_IS, zone=zone))
        assert found.verdict is Verdict.UNCERTAIN
        assert kinds(found) == ["within-uncertainty", "nominal"]
        assert "0.05 mm off" in found.reasons[1].words
        assert "STEP or IGES" in found.reasons[1].words
        assert "chord tolerance of 0.004 mm" in found.reasons[1].words or "0.0038 mm" in found.reasons[1].words
        assert found.zone.uncertainty_mm >= 0.05
    fine = TriangleSurface(10 * meshes.prism(meshes.NOTCHED, 2.0), nominal_error_mm=0.002)
    found = judge_surface(points, fine, replace(WHERE_IT_IS, zone=ToleranceZone(-0.02, 0.02, 0.001)))
    assert found.verdict is Verdict.CONFORM
    assert found.zone.uncertainty_mm == pytest.approx(0.003)
    assert any("0.002 mm off" in note for note in found.notes)


def test_what_slides_does_not_conform_unless_the_part_is_round() -> None:
    cylinder = PatchSurface([faces.cylinder(30.0, 80.0)])
    places, _, points = scan(cylinder, 8000, noise_mm=0.001)
    terms = SurfaceTerms(ZONE, start=RigidMotion.identity(), gap_max_mm=8.0, edge_allowance_mm=1.0)
    whole = judge_surface(points, cylinder, terms)
    assert (whole.verdict, whole.reasons) == (Verdict.CONFORM, ())
    plate = PatchSurface(faces.box((40.0, 30.0, 20.0)))
    places, normals, points = scan(plate, 4000, noise_mm=0.001)
    wide = replace(terms, gap_max_mm=100.0)
    top = judge_surface(points[normals[:, 2] > 0.9], plate, wide)  # shifts over the top and turns within it stay free
    assert top.verdict is Verdict.UNCERTAIN
    assert "pose" in kinds(top)
    words = top.reasons[kinds(top).index("pose")].words
    assert "slides" in words
    assert "datum" in words
    dented = points - 0.3 * (np.linalg.norm(points - (20, 15, 20), axis=1) < 3)[:, None] * normals
    out = judge_surface(dented[normals[:, 2] > 0.9], plate, replace(wide, coverage_min=0.1))
    assert (out.verdict, kinds(out)) == (Verdict.UNCERTAIN, ["placement", "pose"])
    held = judge_surface(points[normals[:, 2] > 0.9], plate, replace(wide, locked=("x", "y", "rz")))
    assert "pose" not in kinds(held)
    datum = judge_surface(points[normals[:, 2] > 0.9], plate, replace(wide, locked=("x", "y", "z", "rx", "ry", "rz")))
    assert (datum.rule, datum.registration) == ("datum", None)
    assert len(places) == len(points)


def test_a_direction_that_scatter_alone_moves_by_a_quarter_of_the_zone_is_not_judged() -> None:
    blade = PatchSurface([faces.blade(40, 5)])
    places, normals, points = scan(blade, 3000, noise_mm=0.008)
    terms = SurfaceTerms(ZONE, start=RigidMotion.identity(), gap_max_mm=20.0, edge_allowance_mm=3.0)
    one_side = (normals[:, 1] > 0.3) & (np.abs(places[:, 2] - 75) < 40)
    found = judge_surface(points[one_side], blade, terms)
    assert found.registration is not None
    assert not found.registration.weakest.undetermined
    assert "pose" in kinds(found)
    assert "more than a quarter of the zone" in found.reasons[kinds(found).index("pose")].words


def test_out_at_the_best_fit_is_nonconform_only_where_the_part_is_placed() -> None:
    places, normals, points = scan(NOTCHED, 8000)
    dent = (np.linalg.norm(places - DENT_AT, axis=1) < 1.5) & (normals[:, 2] > 0.9)
    points = points - 0.3 * dent[:, None] * normals
    some = normals[:, 0] < 0.9  # but for one wall
    assert judge_surface(points, NOTCHED, NEAR).verdict is Verdict.NONCONFORM
    assert kinds(judge_surface(points, NOTCHED, NEAR, complete=False)) == ["placement", "incomplete"]
    partly = judge_surface(points[some], NOTCHED, NEAR)
    assert (partly.verdict, kinds(partly)[0], len(partly.regions)) == (Verdict.UNCERTAIN, "placement", 1)
    assert judge_surface(points[some], NOTCHED, replace(NEAR, coverage_min=0.6)).verdict is Verdict.NONCONFORM
    assert judge_surface(points[some], NOTCHED, WHERE_IT_IS, complete=False).verdict is Verdict.NONCONFORM


def test_a_symmetric_part_is_out_only_where_it_is_out_in_every_pose() -> None:
    """A step of 0.12 mm about a zone of -0.15 .. 0.03: out on one side of the box, at home on the other."""
    box = PatchSurface(faces.box((40.0, 30.0, 20.0)))
    places, normals, points = scan(box, 3000, noise_mm=0.0)
    terms = SurfaceTerms(ToleranceZone(-0.1, 0.1, 0.01), gap_max_mm=6.0)
    dent = (np.linalg.norm(places - (20, 15, 20), axis=1) < 3) & (normals[:, 2] > 0.9)
    found = judge_surface(points - 0.3 * dent[:, None] * normals, box, terms)
    assert found.registration is not None
    assert found.registration.rivals == 3
    assert found.verdict is Verdict.NONCONFORM


def test_rejected_points_keep_a_part_from_conforming() -> None:
    _, normals, points = scan(NOTCHED, 6000)
    few = np.flatnonzero(normals[:, 2] > 0.9)[::75]
    for terms, reason, off in (
        (replace(WHERE_IT_IS, gross_mm=2.0), Rejection.OFF_SURFACE, 5.0),
        (replace(NEAR, reject_outliers=True), Rejection.OUTLIER, 0.08),
    ):
        dust = points.copy()
        dust[few] += off * normals[few]
        found = judge_surface(dust, NOTCHED, terms)
        assert found.verdict is Verdict.UNCERTAIN
        assert found.rejected_by_reason == {reason.words: len(few)}
        assert kinds(found) == ["rejected"]
        assert found.received == found.judged + found.rejected == len(points)
        assert (found.verdicts[found.rejection != Rejection.NONE] == NOT_JUDGED).all()
        assert judge_surface(found.points_mm, NOTCHED, replace(terms, allow_unseen_mm=5.0)).verdict is Verdict.CONFORM
    turned = 2 * normals
    turned[few] *= -1
    found = judge_surface(points, NOTCHED, WHERE_IT_IS, turned)
    assert (found.rejected_by_reason, found.verdict) == ({"opposite face": len(few)}, Verdict.UNCERTAIN)
    lost = np.where(np.arange(len(points))[:, None] % 600 == 0, np.nan, points)
    assert judge_surface(lost, NOTCHED, NEAR).rejected_by_reason == {"not finite": len(points[::600])}


def test_a_wall_that_lacks_more_than_half_is_judged_from_the_side_that_was_seen() -> None:
    """0.2 mm thick, its top 0.15 mm too low: the bottom is nearer, and from there the part would look 0.05 mm off."""
    for thin in (TriangleSurface(10 * meshes.prism(meshes.NOTCHED, 0.02)), PatchSurface(faces.box((40.0, 30.0, 0.2)))):
        places, normals, points = scan(thin, 4000, noise_mm=0.0)
        low = (normals[:, 2] > 0.9) & (np.linalg.norm(places - (20, 5, 0.2), axis=1) < 4)
        points = points - 0.15 * low[:, None] * normals
        blind = judge_surface(points, thin, WHERE_IT_IS)
        assert blind.out_of_tolerance < 0.1 * np.count_nonzero(low)
        found = judge_surface(points, thin, WHERE_IT_IS, normals)
        assert found.verdict is Verdict.NONCONFORM
        assert found.out_of_tolerance == np.count_nonzero(low)
        assert found.feet.distance_mm[low] == pytest.approx(-0.15, abs=1e-9)
        assert not found.rejected
    ball = PatchSurface([faces.sphere(20.0)])
    far = judge_surface([(0.0, 0, 19.9), (0, 19.8, 0), (0, 0, 15)], ball, WHERE_IT_IS, [(0.0, 0, 1), (0, 0.8, 0.6), (0, 0, -1)])
    assert far.rejected_by_reason == {"off surface": 1}
    assert far.feet.distance_mm[:2] == pytest.approx([-0.1, -0.2], abs=1e-9)


def test_points_beyond_an_edge_of_an_open_surface_need_an_allowance() -> None:
    sheet = TriangleSurface(meshes.wave(30))
    _, _, points = scan(sheet, 8000, noise_mm=0.002)
    edge = points[points[:, 0] > 59.0]
    beyond = np.concatenate([points, edge + np.array([1.5, 0.0, 0.0])])
    terms = SurfaceTerms(ZONE, fit="none", gap_max_mm=5.0)
    found = judge_surface(beyond, sheet, terms)
    assert (found.verdict, kinds(found)) == (Verdict.UNCERTAIN, ["ends"])
    assert found.beyond_edge_mm == pytest.approx(1.5, abs=0.2)
    assert judge_surface(beyond, sheet, replace(terms, edge_allowance_mm=2.0)).verdict is Verdict.CONFORM


def test_what_is_known_to_be_missing_is_named_in_the_order_of_its_weight() -> None:
    _, _, points = scan(NOTCHED, 6000)
    found = judge_surface(points, NOTCHED, WHERE_IT_IS, complete=False, missing=Missing(lost=12, damaged_bytes=5))
    assert kinds(found) == ["incomplete", "missing"]
    assert "12 points were lost and 5 bytes were damaged on the line: places of the surface up to" in found.reasons[1].words


def test_a_set_up_that_contradicts_the_points_is_no_verdict() -> None:
    _, _, points = scan(NOTCHED, 2000)
    with pytest.raises(NotMeasured, match="--nominal-unit inch"):
        judge_surface(25.4 * points, NOTCHED, WHERE_IT_IS)
    with pytest.raises(InspectionError, match="too few"):
        judge_surface(points[:3], NOTCHED, NEAR)
    sheet = TriangleSurface(meshes.wave(10))
    with pytest.raises(NotMeasured, match="coordinates of the nominal"):
        judge_surface(sheet.sample(500)[0] + 100.0, sheet, WHERE_IT_IS)
    with pytest.raises(InspectionError, match=r"no gap below 0\.4 mm can be told"):
        LiveSurface(NOTCHED, replace(NEAR, gap_max_mm=0.1))
    empty = judge_surface(np.empty((0, 3)), NOTCHED, WHERE_IT_IS)
    assert (empty.verdict, kinds(empty)) == (Verdict.UNCERTAIN, ["nothing-judged", "gap"])
    for wrong, told in (
        ({"fit": "loose"}, "fit must be"),
        ({"coverage_min": 2.0}, "between 0 and 1"),
        ({"gap_max_mm": 0.0}, "more than zero"),
    ):
        with pytest.raises(ValueError, match=told):
            SurfaceTerms(ZONE, **wrong)
