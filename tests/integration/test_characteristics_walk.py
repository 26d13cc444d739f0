"""The drawing of docs/characteristics.md with its twelve, measured from a file: every number found again from deviations.csv by other code.

What finds it again knows the nominal as a dense polygon, points, and least squares; it shares no line with the inspection.
"""

import csv
import json
import math
import shutil
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from numpy.typing import NDArray
from scipy.interpolate import BSpline
from scipy.optimize import least_squares, linprog
from scipy.spatial import cKDTree

from cmmlink.nominal_files.nurbs_yaml import save_nurbs_yaml
from inspection import Verdict
from tests.cmmlink.command import cmmlink
from tests.inspection import profiles

Array = NDArray[np.float64]

COUNT = 1500
DOCS = Path(__file__).resolve().parents[2] / "docs"
PAGE = (DOCS / "characteristics.md").read_text(encoding="utf-8")
PLAN = PAGE.split("```yaml\n")[1].split("```")[0] + "discretisation: {samples: 1500}\nrecords: kept\n"
MOVED_DEG, MOVED_MM = 0.05, np.array([0.03, -0.02])


@dataclass(frozen=True)
class Walk:
    """What the run left in its folder, and the nominal as a polygon."""

    folder: Path
    facts: dict[str, Any]

    def found(self, name: str) -> dict[str, Any]:
        one: dict[str, Any] = next(one for one in self.facts["characteristics"] if one["name"] == name)
        return one

    @cached_property
    def rows(self) -> dict[str, Array]:
        with (self.folder / "out" / "deviations.csv").open(encoding="utf-8") as file:
            rows = list(csv.DictReader(file))
        return {key: np.array([float(row[key]) for row in rows]) for key in ("x_mm", "y_mm", "station_mm", "deviation_mm")}

    @cached_property
    def actual(self) -> Array:
        """The points (m, 2) in the nominal's coordinates, at the pose of the run."""
        return np.column_stack([self.rows["x_mm"], self.rows["y_mm"]])

    @cached_property
    def polygon(self) -> "Polygon":
        return Polygon(self.folder / "blade.yaml")

    @cached_property
    def at_datum(self) -> Array:
        """The points brought back to where they were measured, and from there onto the nominal by the datum."""
        pose = self.facts["registration"]
        shift = np.array(pose["translation_mm"])
        measured = turned(self.actual - shift, -pose["rotation_deg"])
        return np.asarray(turned(measured, 20.0) + np.array([5.0, -3.0]))

    def in_region(self, name: str) -> NDArray[np.bool_]:
        region, s = self.found(name)["region"], self.rows["station_mm"]
        if region["from_mm"] <= region["to_mm"]:
            return np.asarray((s >= region["from_mm"]) & (s <= region["to_mm"]))
        return np.asarray((s >= region["from_mm"]) | (s <= region["to_mm"]))


class Polygon:
    """The nominal of a yaml file as 60,000 vertices: its material lies inside."""

    def __init__(self, file: Path) -> None:
        given = yaml.safe_load(file.read_text(encoding="utf-8"))
        spline = BSpline(np.array(given["knots"]), np.array(given["control_points_mm"]), given["degree"])
        u = np.linspace(given["knots"][given["degree"]], given["knots"][-given["degree"] - 1], 60_001)
        self.points = spline(u)[:-1]
        self.ahead = np.roll(self.points, -1, axis=0) - self.points
        self.step = np.hypot(*self.ahead.T)
        self.station = np.concatenate([[0.0], np.cumsum(self.step)])[:-1]
        self.length = float(self.step.sum())
        area = float((self.points[:, 0] * np.roll(self.points[:, 1], -1) - self.points[:, 1] * np.roll(self.points[:, 0], -1)).sum())
        self.outward = -np.sign(area) * np.column_stack([-self.ahead[:, 1], self.ahead[:, 0]]) / self.step[:, None]
        self.tree = cKDTree(self.points)

    def distances(self, places: Array) -> tuple[Array, Array, Array]:
        """Signed distances (m,) out of the material, the normals (m, 2) there, and the stations (m,)."""
        near = self.tree.query(places)[1]
        best, normal, station = np.full(len(places), np.inf), np.zeros_like(places), np.zeros(len(places))
        for k in ((near - 1) % len(self.points), near):
            t = np.clip(((places - self.points[k]) * self.ahead[k]).sum(axis=1) / self.step[k] ** 2, 0, 1)
            off = places - self.points[k] - t[:, None] * self.ahead[k]
            size = np.hypot(*off.T)
            nearer = size < np.abs(best)
            best = np.where(nearer, size * np.sign((off * self.outward[k]).sum(axis=1)), best)
            normal = np.where(nearer[:, None], self.outward[k], normal)
            station = np.where(nearer, self.station[k] + t * self.step[k], station)
        return best, normal, station


def turned(points: Array, degrees: float) -> Array:
    c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    return np.asarray(points @ np.array([[c, s], [-s, c]]))


def moved(points: Array, motion: Array) -> Array:
    """Points (m, 2) turned about (50, 0) and shifted: shift in mm, angle in tenths of a degree."""
    pivot = np.array([50.0, 0.0])
    return np.asarray(turned(points - pivot, motion[2] / 10) + pivot + motion[:2])


def smallest_largest(polygon: Polygon, points: Array, limits: Any) -> tuple[float, Array]:
    """The least share of limits that any motion leaves the worst point with, by linear programs of its own."""
    motion = np.zeros(3)
    for _ in range(12):
        places = moved(points, motion)
        e, n, s = polygon.distances(places)
        low, high = limits(s)
        half, middle = (high - low) / 2, (high + low) / 2
        arm = places - np.array([50.0, 0.0]) - motion[:2]
        J = np.column_stack([n, np.radians(0.1) * (arm[:, 0] * n[:, 1] - arm[:, 1] * n[:, 0])])
        rows = np.vstack([np.column_stack([J, -half]), np.column_stack([-J, -half])])
        found = linprog([0, 0, 0, 1], A_ub=rows, b_ub=np.concatenate([middle - e, e - middle]), bounds=[(-1, 1)] * 3 + [(0, None)])
        motion = motion + np.asarray(found.x)[:3]
    e, _, s = polygon.distances(moved(points, motion))
    low, high = limits(s)
    return float(np.abs((2 * e - low - high) / (high - low)).max()), motion


def made(polygon: Polygon, station: Array) -> Array:
    """The surface (m, 2) of the part where it was made, at stations (m,) of its nominal."""
    k = np.minimum(np.searchsorted(polygon.station, station, side="right"), len(polygon.points)) - 1
    foot = polygon.points[k] + ((station - polygon.station[k]) / polygon.step[k])[:, None] * polygon.ahead[k]
    s = 2 * np.pi * station / polygon.length
    form = 0.012 * np.sin(2 * s + 0.4) + 0.008 * np.cos(5 * s) + 0.004 * np.sin(60 * s)
    return np.asarray(foot + form[:, None] * polygon.outward[k])


def best_motion(polygon: Polygon, points: Array, middle: float) -> Array:
    """The motion of least squares of points (m, 2) about a deviation."""

    def rest(motion: Array) -> Array:
        return polygon.distances(moved(points, motion))[0] - middle

    return np.asarray(least_squares(rest, np.zeros(3), xtol=1e-12).x)


@pytest.fixture(scope="module")
def walk(tmp_path_factory: pytest.TempPathFactory) -> Walk:
    folder = tmp_path_factory.mktemp("walk")
    curve = profiles.naca("4412")
    save_nurbs_yaml(curve, folder / "blade.yaml")
    polygon = Polygon(folder / "blade.yaml")
    actual = turned(made(polygon, (np.arange(COUNT) + 0.5) / COUNT * polygon.length), MOVED_DEG) + MOVED_MM
    np.save(folder / "points.npy", turned(actual - np.array([5.0, -3.0]), -20.0))
    (folder / "plan.yaml").write_text(PLAN, encoding="utf-8")
    ended = cmmlink("run", folder / "plan.yaml", "--headless", "--json", "--out", folder / "out")
    return Walk(folder, ended.json() | {"exit_status": ended.code})


def test_the_part_has_the_worst_of_its_verdicts_and_the_exit_status_says_so(walk: Walk) -> None:
    verdicts = {one["name"]: one["verdict"] for one in walk.facts["characteristics"]}
    assert len(verdicts) == 12
    assert verdicts.pop("twist") == "nonconform"  # 0.05 degrees of 0.02 allowed
    assert set(verdicts.values()) == {"conform"}
    assert walk.facts["verdict"] == "nonconform"
    assert walk.facts["exit_status"] == 1
    assert walk.facts["reasons"][0]["words"].startswith("twist: It is 0.0")
    written = json.loads((walk.folder / "out" / "result.json").read_text(encoding="utf-8"))
    assert written["characteristics"] == walk.facts["characteristics"]


def test_the_line_profiles_are_found_again(walk: Walk) -> None:
    polygon, actual, off = walk.polygon, walk.actual, walk.rows["deviation_mm"]
    share, _ = smallest_largest(polygon, actual, lambda s: (np.full(len(s), -0.05), np.full(len(s), 0.05)))
    assert walk.found("contour")["value"] == pytest.approx(0.1 * share, abs=2e-6)

    def limits(s: Array) -> tuple[Array, Array]:
        at = [0, 60, 120, 180, polygon.length]
        return np.interp(s, at, [-0.04, -0.06, -0.04, -0.03, -0.04]), np.interp(s, at, [0.04, 0.04, 0.05, 0.03, 0.04])

    assert walk.found("varying")["consumption"] == pytest.approx(smallest_largest(polygon, actual, limits)[0], abs=2e-5)
    flank = off[walk.in_region("flank")] + 0.01  # 0.05 of the zone's 0.12 lie out of material, so that its middle is 0.01 inside
    assert walk.found("flank")["value"] == pytest.approx(2 * np.abs(flank).max(), abs=2e-6)
    assert walk.found("flank")["zone"] == "0.12 UZ -0.01; 0.12 (U) 0.05"
    assert (walk.found("flank")["lower"], walk.found("flank")["upper"]) == (-0.07, 0.05)
    assert walk.found("location")["value"] == pytest.approx(2 * np.abs(polygon.distances(walk.at_datum)[0]).max(), abs=2e-6)


LIMITS = {"contour": (-0.05, 0.05), "LE form": (-0.02, 0.04), "flank": (-0.07, 0.05), "location": (-0.09, 0.09)}


@pytest.mark.parametrize("name", [*LIMITS, "varying"])
def test_every_number_of_a_line_profile_is_that_of_its_points_at_its_pose(walk: Walk, name: str) -> None:
    """The points as they were measured, brought to the pose that stands in the result: worst point, value, limits and share of the zone."""
    found, pose = walk.found(name), walk.found(name)["pose"]
    places = turned(np.load(walk.folder / "points.npy"), pose["rotation_deg"]) + np.array(pose["translation_mm"])
    e, _, s = walk.polygon.distances(places)
    at = [0, 60, 120, 180, walk.polygon.length]
    low = np.interp(s, at, [-0.04, -0.06, -0.04, -0.03, -0.04]) if name == "varying" else np.full(len(s), LIMITS[name][0])
    high = np.interp(s, at, [0.04, 0.04, 0.05, 0.03, 0.04]) if name == "varying" else np.full(len(s), LIMITS[name][1])
    inside = walk.in_region(name) if found["region"] else np.ones(len(s), dtype=bool)
    share = np.where(inside, np.abs(2 * e - low - high) / (high - low), -1.0)
    k = int(np.argmin(np.hypot(*(places - [found["worst"]["x_mm"], found["worst"]["y_mm"]]).T)))
    assert share[k] == pytest.approx(share.max(), abs=1e-5)  # of points that hold a zone, any may be told
    assert found["consumption"] == pytest.approx(share.max(), abs=5e-5)  # of a zone of 0.06 mm that is 1.5 nm
    told = [found[key] for key in ("deviation", "lower", "upper", "value")]
    width = 2 * np.abs(e - (low + high) / 2)[inside].max()
    assert told == pytest.approx([e[k], low[k], high[k], width], abs=2e-6)
    worst = [found["worst"][key] for key in ("deviation_mm", "station_mm", "x_mm", "y_mm")]
    assert worst == pytest.approx([e[k], s[k], *places[k]], abs=2e-5)
    assert found["verdict"] == ("conform" if share.max() <= 1 else "nonconform")
    stations = np.sort(s)
    longest = max(np.diff(stations).max(), stations[0] + walk.polygon.length - stations[-1])
    assert found["largest_gap_mm"] <= longest + 1e-4
    assert found["coverage"] == pytest.approx(1.0)


def test_what_the_longest_gap_could_hide_is_how_far_the_curve_stands_off_it(walk: Walk) -> None:
    """The gap is at the nose, shorter than the samples of the nominal are apart, and hides a flat all the same."""
    gap, polygon = walk.facts["largest_gap"], walk.polygon
    stations = np.sort(walk.rows["station_mm"])
    k = int(np.diff(stations).argmax())
    assert [gap["from_mm"], gap["to_mm"]] == pytest.approx(stations[k : k + 2].tolist(), abs=2e-6)
    arc = polygon.points[(polygon.station >= gap["from_mm"]) & (polygon.station <= gap["to_mm"])]
    across = (arc[-1] - arc[0]) / np.hypot(*(arc[-1] - arc[0]))
    off = np.abs((arc - arc[0]) @ np.array([-across[1], across[0]])).max()
    assert off > 1e-3
    assert gap["could_hide_mm"] == pytest.approx(off, rel=0.1)


@pytest.mark.parametrize("name", ["contour", "varying"])
def test_the_points_of_a_certificate_are_those_of_the_csv_and_balance(walk: Walk, name: str) -> None:
    """No small motion lowers all of them: the rates of what each consumes, by differences, cancel with its multipliers."""
    proof, measured = walk.found(name)["certificate"], np.load(walk.folder / "points.npy")
    active = measured[[point["index"] for point in proof["active"]]]
    assert [(point["x_mm"], point["y_mm"]) for point in proof["active"]] == [tuple(place) for place in active.tolist()]
    assert f"held by points (index) {proof['active'][0]['index']} (" in proof["words"]
    places = turned(active, proof["pose"]["rotation_deg"]) + np.array(proof["pose"]["translation_mm"])
    at = [0, 60, 120, 180, walk.polygon.length]

    def consumed(motion: Array) -> Array:
        e, _, s = walk.polygon.distances(moved(places, motion))
        if name == "contour":
            return e
        low, high = np.interp(s, at, [-0.04, -0.06, -0.04, -0.03, -0.04]), np.interp(s, at, [0.04, 0.04, 0.05, 0.03, 0.04])
        return np.asarray((2 * e - low - high) / (high - low))

    here, share = consumed(np.zeros(3)), np.array([point["multiplier"] for point in proof["active"]])
    assert np.abs(here) == pytest.approx(proof["consumption"] or proof["zone_mm"] / 2, abs=2e-6)
    assert share.sum() == pytest.approx(1.0)
    assert (share > 0).all()
    rates = [(consumed(step) - consumed(-step)) / 2e-3 for step in 1e-3 * np.eye(3)]
    left = [float((share * np.sign(here)) @ rate) / np.abs(rate).max() for rate in rates]
    assert left == pytest.approx([0, 0, 0], abs=2e-3)


def test_the_form_of_a_region_is_found_again_by_least_squares_of_its_own(walk: Walk) -> None:
    polygon, inside = walk.polygon, walk.in_region("LE form")
    points = walk.actual[inside]
    nose = polygon.station[int(np.argmin(polygon.points[:, 0]))]
    assert np.abs(walk.rows["station_mm"][inside] - nose).max() == pytest.approx(15, abs=0.5)  # the nose is where it curves most
    e = polygon.distances(moved(points, best_motion(polygon, points, 0.01)))[0]
    found = walk.found("LE form")
    assert found["value"] == pytest.approx(2 * np.abs(e - 0.01).max(), abs=1e-4)
    assert found["zone"] == "0.06 UZ +0.01; 0.06 (U) 0.04"
    assert (found["lower"], found["upper"]) == (-0.02, 0.04)


def test_a_filtered_profile_is_found_again_by_sums_of_its_own(walk: Walk) -> None:
    s, z = walk.rows["station_mm"], walk.rows["deviation_mm"]
    # at the sharp trailing edge, which is at the seam, no weight reaches across
    weight = np.exp(-(np.pi**2) / np.log(2) * ((s[:, None] - s[None, :]) / 8.0) ** 2)
    order = np.argsort(s)
    share = np.gradient(s[order])[np.argsort(order)]
    waviness = (weight * share) @ z / (weight @ share)
    found = walk.found("waviness")
    assert found["value"] == pytest.approx(2 * np.abs(waviness).max(), abs=1e-4)
    assert found["value"] < 2 * np.abs(z).max() - 0.005
    assert found["filter"] == "Gaussian regression of order 0, cutoff 8 mm"


def test_twist_and_displacement_are_found_again_by_a_fit_of_the_points_at_the_datum(walk: Walk) -> None:
    motion = best_motion(walk.polygon, walk.at_datum, 0.0)
    assert walk.found("twist")["value"] == pytest.approx(-motion[2] / 10, abs=3e-5)
    assert walk.found("twist")["value"] == pytest.approx(MOVED_DEG, abs=0.02)
    place = np.array([[40.0, 3.0]])
    back = turned(place - np.array([50.0, 0.0]) - motion[:2], -motion[2] / 10) + np.array([50.0, 0.0])
    assert walk.found("displacement")["value"] == pytest.approx((back - place)[0, 0], abs=3e-5)


def test_the_values_of_the_section_are_found_again_from_the_points(walk: Walk) -> None:
    actual = walk.actual
    surface = made(walk.polygon, np.linspace(0.0, walk.polygon.length, 100_001))
    nose, tail = surface[int(np.argmin(surface[:, 0]))], surface[int(np.argmax(surface[:, 0]))]
    along = (tail - nose) / np.hypot(*(tail - nose))
    assert walk.found("chord")["value"] == pytest.approx(np.ptp(surface @ along), abs=5e-3)  # a sharp tail lies between two points
    tree = cKDTree(actual)
    x, y = np.meshgrid(np.linspace(20, 45, 401), np.linspace(2, 6, 201))
    assert walk.found("thickness")["value"] == pytest.approx(2 * np.max(tree.query(np.column_stack([x.ravel(), y.ravel()]))[0]), abs=5e-3)
    names = [place["name"] for place in walk.found("camber")["places"]]
    top, one, other = (np.array([place["x_mm"], place["y_mm"]]) for place in walk.found("camber")["places"])
    assert names == ["on the camber line", "nose", "tail"]
    chord = (other - one) / np.hypot(*(other - one))
    assert walk.found("camber")["value"] == pytest.approx(float((top - one) @ np.array([-chord[1], chord[0]])), abs=1e-6)
    upper, lower = (tree.query(top + way * np.array([-chord[1], chord[0]]) * 3)[0] for way in (1, -1))
    assert upper == pytest.approx(lower, abs=0.02)  # the place lies in the middle between both sides


def test_the_radius_is_found_again_by_a_circle_through_the_points_of_the_window(walk: Walk) -> None:
    found = walk.found("LE radius")
    places = {place["name"]: np.array([place["x_mm"], place["y_mm"]]) for place in found["places"]}
    ends = [places["beginning of the window"], places["end of the window"]]
    _, _, (low, high) = walk.polygon.distances(np.array(ends))
    s = walk.rows["station_mm"]
    arc = walk.actual[(s >= min(low, high)) & (s <= max(low, high))]
    x = np.linalg.lstsq(np.column_stack([2 * arc, np.ones(len(arc))]), (arc * arc).sum(axis=1), rcond=None)[0]
    assert found["value"] == pytest.approx(math.sqrt(x[2] + x[0] ** 2 + x[1] ** 2), rel=0.02)
    assert found["method"] == "circle, window 40 deg"
    assert found["uncertainty"] == 0.01


def test_another_program_verifies_the_minimum_zone_and_finds_what_was_altered(walk: Walk, tmp_path: Path) -> None:
    file = tmp_path / "zone.json"
    shutil.copy(walk.folder / "out" / "zone.json", file)
    assert cmmlink("verify-zone", file).code == 0
    document = json.loads(file.read_text(encoding="utf-8"))
    document["zones"][0]["zone_mm"] += 0.001
    file.write_text(json.dumps(document), encoding="utf-8")
    ended = cmmlink("verify-zone", file, "--json")
    assert ended.code == 5
    assert ended.json()["zones"][0]["problem"] == "the points that hold the zone are not at its limits"


def test_the_page_of_the_walk_shows_what_the_run_found(walk: Walk) -> None:
    page = (DOCS / "walk.md").read_text(encoding="utf-8")
    rows = [[cell.strip() for cell in line.split("|")[1:-1]] for line in page.splitlines() if line.startswith("| ")][2:]
    words = {"conform": "CONFORM", "nonconform": "NOT CONFORM"}
    shown = [
        [
            one["name"],
            f"{one['value']:.4f} {one['unit']}",
            f"{one['deviation']:+.4f}",
            f"{one['lower']:g} .. {one['upper']:g}",
            words[one["verdict"]],
        ]
        for one in walk.facts["characteristics"]
    ]
    either = {"contour", "varying"}  # points at both limits hold these: which of them is told hangs on the last digit
    assert [[cell.lstrip("+-") if row[0] in either else cell for cell in row[:5]] for row in rows] == [
        [cell.lstrip("+-") if row[0] in either else cell for cell in row] for row in shown
    ]
    assert any(note == "the drawn section may mislead by 0.035 mm" for note in walk.found("camber")["notes"])


def test_the_list_of_runs_names_the_characteristic_that_decides(walk: Walk) -> None:
    assert cmmlink("runs", "--records", walk.folder / "kept").out.rstrip().endswith("blade  decided by twist")
    assert cmmlink("runs", "--records", walk.folder / "kept", "--json").json()["runs"][0]["decided_by"] == "twist"


def test_the_record_gives_the_same_characteristics_to_the_last_bit(walk: Walk, tmp_path: Path) -> None:
    again = cmmlink("replay", walk.facts["run"], "--records", walk.folder / "kept", "--json").json()
    assert again["identical"] is True
    assert again["characteristics"] == walk.facts["characteristics"]
    assert cmmlink("export", walk.facts["run"], "--records", walk.folder / "kept", "--out", tmp_path / "export").code == 0
    exported = json.loads((tmp_path / "export" / "result.json").read_text(encoding="utf-8"))
    assert exported["characteristics"] == walk.facts["characteristics"]
    assert exported["verdict"] == Verdict.NONCONFORM.word
