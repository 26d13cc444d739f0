"""The picture of a profile: its band, its whiskers, and points drawn by their verdicts."""

import math
from pathlib import Path

import numpy as np
import pytest
from matplotlib.colors import to_rgb
from matplotlib.image import imread

from cmmlink.report.judged_scan import scan_of, unmeasured_stretches
from cmmlink.report.picture import ProfilePictures
from cmmlink.report.picture_content import NamedRegion, content_of, headline_on_picture, magnification
from cmmlink.report.profile_drawing import names_of_limits, round_stations, rows_that_show, side_of_label
from inspection import (
    InspectionResult,
    LiveInspection,
    NominalProfile,
    RigidTransform,
    StatedUncertainty,
    ToleranceZone,
    UncertaintyBudget,
    discretize,
)
from tests.cmmlink.judged_oval import bumped, inspect_oval
from tests.cmmlink.oval_part import oval_points
from tests.inspection import profiles


def write_picture(
    result: InspectionResult, profile: NominalProfile, title: str, path: Path, ending: str = "complete", said: str = ""
) -> None:
    ProfilePictures().write(content_of(scan_of(result), profile, title, ending, said), path)


def pixels_of(path: Path, colour: str) -> int:
    """Number of pixels of this colour, or nearly so where lines are smoothed."""
    return int((np.abs(imread(path)[:, :, :3] - to_rgb(colour)) < 0.1).all(axis=2).sum())


ABOVE, BELOW, GOOD, UNPROVEN, BAND = "#c2410c", "#6d28d9", "#2a7fa5", "#a16207", "#dfe7ee"


def test_the_picture_shows_band_whiskers_and_what_is_out(profile: NominalProfile, tmp_path: Path) -> None:
    good, bad = tmp_path / "good.png", tmp_path / "bad.png"
    write_picture(inspect_oval(profile, 0.02), profile, "oval", good)
    write_picture(inspect_oval(profile, bumped()), profile, "oval", bad)
    assert imread(good).shape[:2] == (1240, 1420)
    assert min(pixels_of(good, BAND), pixels_of(bad, BAND)) > 10_000
    assert pixels_of(good, GOOD) > 100
    assert min(pixels_of(bad, ABOVE), pixels_of(bad, BELOW)) > 10
    assert pixels_of(good, BELOW) == 0
    assert pixels_of(bad, ABOVE) > pixels_of(good, ABOVE)  # which has it only in the ring around its worst point


@pytest.mark.parametrize("deviation_mm", [0.065, -0.055])
def test_points_nearer_to_a_limit_than_the_uncertainty_are_drawn_neither_good_nor_out(
    profile: NominalProfile, tmp_path: Path, deviation_mm: float
) -> None:
    """The zone is -0.05 .. 0.07 mm with U = 0.01 mm: just inside of the one limit and outside of the other nothing is proven."""
    write_picture(inspect_oval(profile, deviation_mm), profile, "oval", tmp_path / "a.png")
    assert pixels_of(tmp_path / "a.png", UNPROVEN) > 1000
    assert pixels_of(tmp_path / "a.png", GOOD) == pixels_of(tmp_path / "a.png", BELOW) == 0


def test_the_label_of_the_worst_point_stays_inside_the_drawing_at_either_end() -> None:
    assert [side_of_label(share) for share in (0.0, 0.1, 0.5, 0.9, 1.0)] == ["left", "left", "center", "right", "right"]


def test_every_line_that_a_verdict_depends_on_has_its_name() -> None:
    named = names_of_limits(ToleranceZone(-0.05, 0.07, 0.01))
    assert [(round(limit, 9), words) for limit, words in named] == [
        (0.07, "upper +0.07"),
        (-0.05, "lower -0.05"),
        (0.08, "limit + U"),
        (0.06, "limit - U"),
        (-0.04, "limit + U"),
        (-0.06, "limit - U"),
    ]
    assert [words for _, words in names_of_limits(ToleranceZone(-0.05, 0.07))] == ["upper +0.07", "lower -0.05"]


def test_the_magnification_is_a_round_number_that_shows_the_band(profile: NominalProfile) -> None:
    factor = magnification(ToleranceZone(-0.05, 0.07, 0.01), profile)
    assert factor in {step * power for step in (1, 2, 5) for power in (1, 10, 100)}
    assert 0.024 <= factor * 0.12 / np.hypot(20, 16) <= 0.06


def test_the_picture_of_an_aborted_run_says_so(profile: NominalProfile) -> None:
    result = scan_of(inspect_oval(profile, bumped()))
    assert headline_on_picture(result, "oval", "complete").endswith("NOT CONFORM")
    assert headline_on_picture(result, "oval", "aborted") == f"oval    ABORTED AT {math.floor(100 * result.coverage)} %"


def test_pictures_on_one_figure_are_those_on_a_new_one_each(profile: NominalProfile, tmp_path: Path) -> None:
    pictures, bad, uncertain = ProfilePictures(), inspect_oval(profile, 3 * bumped()), inspect_oval(profile, 0.065)
    for number, result in enumerate((bad, uncertain, bad)):
        said = f"run {number}" if number % 2 else ""
        pictures.write(content_of(scan_of(result), profile, f"part {number}", "complete", said), tmp_path / "one.png")
        write_picture(result, profile, f"part {number}", tmp_path / "new.png", "complete", said)
        np.testing.assert_array_equal(imread(tmp_path / "one.png"), imread(tmp_path / "new.png"))


def test_samples_that_are_left_out_of_a_drawing_do_not_show() -> None:
    """A fine nominal is drawn through some of its samples: none that is left out lies a fiftieth of a dot off."""
    for curve in (profiles.naca("2412", 60.0), profiles.p3()):
        profile = discretize(curve)
        live = LiveInspection(profile, ToleranceZone(-0.05, 0.05), datum=RigidTransform.identity())
        live.add(profile.points_mm[::20])
        rows = rows_that_show(content_of(scan_of(live.finish()), profile, "part"))
        assert len(rows) < 0.3 * len(profile.points_mm)
        drawn = profile.points_mm[rows]
        feet = np.searchsorted(rows, np.arange(len(profile.points_mm)), side="right").clip(1, len(rows) - 1)
        along, beside = drawn[feet] - drawn[feet - 1], profile.points_mm - drawn[feet - 1]
        off = np.abs(along[:, 0] * beside[:, 1] - along[:, 1] * beside[:, 0]) / np.hypot(*along.T)
        assert off.max() < 0.02 * np.hypot(*np.ptp(drawn, axis=0)) / 1200


def test_an_svg_beside_the_picture_has_the_same_bytes_each_time(profile: NominalProfile, tmp_path: Path) -> None:
    content = content_of(scan_of(inspect_oval(profile, bumped())), profile, "oval <&> 1")
    for name in ("a.svg", "b.svg"):
        ProfilePictures().write(content, tmp_path / name)
    written = (tmp_path / "a.svg").read_bytes()
    assert written == (tmp_path / "b.svg").read_bytes()
    assert b"dc:date" not in written


def test_stretches_that_were_not_measured_are_found_also_over_the_seam_and_drawn_grey(profile: NominalProfile, tmp_path: Path) -> None:
    result = inspect_oval(profile, 0.0)
    length, station = profile.length_mm, np.sort(result.station_mm)
    assert unmeasured_stretches(station, length, True, result.gap_max_mm) == []
    kept = station[(station > 5) & (station < length - 3) & ~((station > 20) & (station < 30))]
    (start, a), (b, c), (d, end) = unmeasured_stretches(kept, length, True, 1.0)
    assert (start, end) == (0.0, length)
    assert (a, b, c, d) == (kept[0], kept[kept < 25][-1], kept[kept > 25][0], kept[-1])
    assert [round(x) for pair in unmeasured_stretches(kept, length, False, 4.0) for x in pair] == [0, 5, 20, 30]
    np.random.default_rng(1).shuffle(kept)
    assert unmeasured_stretches(kept, length, True, 1.0) == [(start, a), (b, c), (d, end)]
    assert unmeasured_stretches(np.full(3, np.nan), length, True, 1.0) == [(0.0, length)]


@pytest.mark.parametrize("length", [0.37, 5.0, 56.6, 205.2, 1234.5])
def test_stations_are_numbered_round_and_neither_too_many_nor_too_few(length: float) -> None:
    stations = list(round_stations(length, True))
    assert stations[0] == 0.0
    assert 5 <= len(stations) <= 16
    assert stations[-1] < length - 0.02 * length
    assert len({f"{one:g}" for one in stations}) == len(stations)


def test_the_u_of_each_station_is_shaded_around_the_limits_where_a_budget_was_stated(profile: NominalProfile, tmp_path: Path) -> None:
    """As far as each U goes: twice the budget, twice the shade. By simple acceptance U does not count, and nothing is shaded."""
    shaded = {}
    for name, u_mm in (("none", 0.0), ("one", 0.003), ("two", 0.006), ("simple", 0.006)):
        stated = StatedUncertainty(UncertaintyBudget(tip_radius_mm=u_mm)) if u_mm else None
        zone = ToleranceZone(-0.05, 0.07, rule="simple" if name == "simple" else "iso-14253-1")
        live = LiveInspection(profile, zone, datum=RigidTransform.identity(), uncertainty=stated)
        live.add(oval_points(0.0))
        write_picture(live.finish(), profile, "oval", tmp_path / "a.png")
        shaded[name] = pixels_of(tmp_path / "a.png", "#f3e3c2")
    assert max(shaded["none"], shaded["simple"]) < 500  # smoothed edges of other colours
    assert shaded["one"] > 3000
    assert shaded["two"] == pytest.approx(2 * shaded["one"], rel=0.25)


def test_regions_are_drawn_beside_the_band_and_places_where_values_were_found(profile: NominalProfile, tmp_path: Path) -> None:
    seam = (NamedRegion("over the seam", 0.9 * profile.length_mm, 0.1 * profile.length_mm),)
    drawn = {}
    for name, regions, places in (("none", (), ()), ("region", seam, ()), ("place", (), [(1.0, 2.0)])):
        content = content_of(scan_of(inspect_oval(profile, 0.02)), profile, "oval", regions=regions, places_mm=places)
        ProfilePictures().write(content, tmp_path / "a.png")
        drawn[name] = pixels_of(tmp_path / "a.png", "#5b4490")
    assert drawn["none"] == 0
    assert drawn["region"] > 300
    assert 10 < drawn["place"] < 300
