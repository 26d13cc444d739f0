"""The command `inspect`: what it says of a part, and what it writes."""

import json
from pathlib import Path

import numpy as np
import pytest

from tests.cmmlink.command import cmmlink
from tests.cmmlink.commands.oval_files import TOLERANCE, inspect_oval, one_off, peanut
from tests.cmmlink.oval_part import oval_points, station_mm, write_points


def test_a_conform_part_is_said_to_be_so(nominal: Path) -> None:
    ended = inspect_oval(nominal, 0.03)
    assert (ended.code, ended.err) == (0, "")
    assert ended.out.splitlines()[:5] == [
        "CONFORM   points, file points.csv",
        "received 360 = judged 360 + rejected 0; lost 0 points",
        "deviation +0.0300 .. +0.0300 mm, zone -0.05 .. +0.05 mm",
        "decision rule: U not stated: simple acceptance",
        "profile error 0.0600 mm (2 x largest), zone error 0.0600 mm (2 x farthest from the zone's middle), rms 0.0300 mm, 0 points out",
    ]


def test_a_part_with_one_point_out_does_not_conform(nominal: Path) -> None:
    ended = inspect_oval(nominal, one_off(0.2), "--json")
    facts = ended.json()
    assert (ended.code, ended.err, facts["verdict"], facts["out_of_tolerance"]) == (1, "", "nonconform", 1)
    assert facts["worst"]["deviation_mm"] == pytest.approx(0.2, abs=1e-8)
    assert facts["worst"]["station_mm"] == pytest.approx(station_mm(100), abs=1e-6)


def test_a_point_nearer_to_the_limit_than_the_uncertainty_proves_nothing(nominal: Path) -> None:
    ended = inspect_oval(nominal, one_off(0.048), "--uncertainty", 0.005)
    assert ended.code == 3
    assert ended.out.splitlines()[:2] == [
        "NOT PROVEN   points, file points.csv",
        "  1 point lies nearer to a limit than U = 0.005 mm: neither side is proven.",
    ]


def test_a_part_measured_in_part_says_so(nominal: Path) -> None:
    points = write_points(nominal.parent / "points.csv", oval_points(0.0)[:180])
    told = ("inspect", points, "--nominal", nominal, *TOLERANCE, "--fit", "none")
    assert "  49.8% of the profile was measured; 95.0% are needed." in cmmlink(*told).out.splitlines()
    little = cmmlink(*told, "--coverage-min", 0.6)
    assert little.code == 3
    assert "  49.8% of the profile was measured; 60.0% are needed." in little.out.splitlines()
    assert "  The largest gap is 28.5 mm, from station 28.29 to 0.06981 mm; 0.5672 mm are allowed." in little.out.splitlines()


def test_rejected_outliers_neither_pass_nor_prove_a_part(nominal: Path) -> None:
    noisy = np.random.default_rng(3).normal(0, 0.004, 360)
    noisy[[40, 41, 200, 300]] = (1.5, 1.5, -0.8, 2.0)
    points = write_points(nominal.parent / "points.csv", oval_points(noisy))
    told = ("inspect", points, "--nominal", nominal, *TOLERANCE)
    assert cmmlink(*told, "--json").json()["verdict"] == "nonconform"
    ended = cmmlink(*told, "--reject-outliers")
    assert ended.code == 3
    lines = ended.out.splitlines()
    assert lines[1].startswith("  Points were rejected (4 outlier): up to ")
    assert lines[2] == "  Look whether the outliers are dirt or a defect: they were rejected, not judged."
    assert "received 360 = judged 356 + rejected 4; lost 0 points" in lines
    facts = cmmlink(*told, "--reject-outliers", "--json").json()
    assert (facts["verdict"], facts["rejected_by_reason"], facts["out_of_tolerance"]) == ("uncertain", {"outlier": 4}, 0)
    assert facts["max_deviation_mm"] < 0.02


def test_many_stretches_are_summed_up(nominal: Path) -> None:
    deviation = np.where(np.arange(360) % 20 == 0, 0.1 + np.arange(360) * 1e-4, 0.0)
    lines = [line for line in inspect_oval(nominal, deviation).out.splitlines() if "out of tolerance" in line]
    assert len(lines) == 11
    assert lines[-1] == "  out of tolerance: 8 more stretches, none of them worse"
    assert f"{station_mm(340):.2f} mm, worst +0.1340 mm" in lines[-2]


KEYS = {
    "verdict",
    "received",
    "judged",
    "rejected",
    "lost",
    "out_of_tolerance",
    "max_deviation_mm",
    "min_deviation_mm",
    "rms_mm",
    "profile_error_mm",
    "worst",
    "fit",
    "method",
    "registration",
    "stretches",
}


def test_json_is_one_object_with_the_stable_keys(nominal: Path) -> None:
    facts = inspect_oval(nominal, 0.01, "--json").json()
    assert set(facts) >= KEYS
    assert (facts["received"], facts["judged"], facts["rejected"], facts["lost"]) == (360, 360, 0, 0)
    assert facts["part"] == "points"
    assert facts["simulated"] is False


def test_options_may_stand_before_and_after_the_argument(nominal: Path) -> None:
    points = write_points(nominal.parent / "points.csv", oval_points(0.02))
    options = ["--nominal", nominal, *TOLERANCE, "--fit", "none", "--json", "--no-record"]
    after, before = cmmlink("inspect", points, *options), cmmlink("inspect", *options, points)
    among = cmmlink("inspect", *options[:2], points, *options[2:])
    assert after.code == 0
    facts = [ended.json() | {"measured_at": ""} for ended in (after, before, among)]
    assert facts[0] == facts[1] == facts[2]


@pytest.mark.parametrize("method", ["exact", "circle", "chord", "pcp", "veaw", "inversion"])
def test_every_method_is_taken_and_named(nominal: Path, method: str) -> None:
    facts = inspect_oval(nominal, 0.03, "--method", method, "--json").json()
    assert facts["method"] == method
    assert facts["max_deviation_mm"] == pytest.approx(0.03, abs=1e-4)


@pytest.mark.parametrize("fit", ["best-fit", "minimum-zone"])
def test_a_fitted_part_is_brought_onto_its_nominal(tmp_path: Path, fit: str) -> None:
    nominal, points = peanut(tmp_path)
    turned = points @ np.array([[0.8, 0.6], [-0.6, 0.8]]) + [30.0, -20.0]
    ended = cmmlink("inspect", write_points(tmp_path / "p.csv", turned), "--nominal", nominal, *TOLERANCE, "--fit", fit, "--json")
    facts = ended.json()
    assert (ended.code, facts["fit"], facts["registration"]["converged"]) == (0, fit, True)
    assert facts["profile_error_mm"] < 1e-3
    assert facts["registration"]["rotation_deg"] % 180 == pytest.approx(np.degrees(np.arctan2(-0.6, 0.8)) % 180, abs=1e-3)


def test_out_holds_the_results(nominal: Path) -> None:
    ended = inspect_oval(nominal, 0.01, "--out", nominal.parent / "results", "--json")
    assert sorted(path.name for path in (nominal.parent / "results").iterdir()) == [
        "deviations.csv",
        "profile.png",
        "profile.svg",
        "report.pdf",
        "result.json",
    ]
    assert json.loads((nominal.parent / "results" / "result.json").read_text(encoding="utf-8")) == ended.json()


def test_the_summary_says_where_the_files_are(nominal: Path) -> None:
    folder = nominal.parent / "results"
    assert (
        inspect_oval(nominal, 0.01, "--out", folder, "--no-record").out.splitlines()[-1]
        == f"results in {folder}: result.json, deviations.csv, profile.png, profile.svg, report.pdf"
    )
