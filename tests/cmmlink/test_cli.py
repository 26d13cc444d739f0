"""Every command as its user meets it: what it prints, its exit code, and one clear message for every wrong input."""

import json
import os
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cmmlink import __version__
from cmmlink.demo import plan_file as demo_plan_file
from tests.cmmlink.command import Ended, cmmlink
from tests.cmmlink.oval_part import LENGTH_MM, oval_points, station_mm, write_nominal, write_points

COMMANDS = ["demo", "run", "inspect", "nominal", "check", "ports", "simulate"]
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
TOLERANCE = ("--tolerance", -0.05, 0.05)


@pytest.fixture
def nominal(tmp_path: Path) -> Path:
    return write_nominal(tmp_path / "oval.yaml")


def inspected(nominal: Path, deviation_mm: Any, *options: object) -> Ended:
    """Inspect an oval with these deviations where it lies: turned by half, it is the same."""
    points = write_points(nominal.parent / "points.csv", oval_points(deviation_mm))
    return cmmlink("inspect", points, "--nominal", nominal, *TOLERANCE, "--fit", "none", *options)


def one_off(value_mm: float) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    deviation = np.zeros(360)
    deviation[100] = value_mm
    return deviation


# What a command says of a part


def test_a_conform_part_is_said_to_be_so(nominal: Path) -> None:
    ended = inspected(nominal, 0.03)
    assert (ended.code, ended.err) == (0, "")
    assert ended.out.splitlines()[:4] == [
        "CONFORM   points, file points.csv",
        "received 360 = judged 360 + rejected 0; lost 0 points",
        "deviation +0.0300 .. +0.0300 mm, zone -0.05 .. +0.05 mm",
        "profile error 0.0600 mm (2 x largest), rms 0.0300 mm, 0 points out",
    ]


def test_a_part_with_one_point_out_does_not_conform(nominal: Path) -> None:
    ended = inspected(nominal, one_off(0.2), "--json")
    facts = ended.json()
    assert (ended.code, ended.err, facts["verdict"], facts["out_of_tolerance"]) == (1, "", "nonconform", 1)
    assert facts["worst"]["deviation_mm"] == pytest.approx(0.2, abs=1e-8)
    assert facts["worst"]["station_mm"] == pytest.approx(station_mm(100), abs=1e-6)


def test_a_point_nearer_to_the_limit_than_the_uncertainty_proves_nothing(nominal: Path) -> None:
    ended = inspected(nominal, one_off(0.048), "--uncertainty", 0.005)
    assert ended.code == 3
    assert ended.out.splitlines()[:2] == ["NOT PROVEN   points, file points.csv", "  1 points lie nearer to a limit than the uncertainty"]


def test_a_part_measured_in_part_says_so(nominal: Path) -> None:
    points = write_points(nominal.parent / "points.csv", oval_points(0.0)[:180])
    told = ("inspect", points, "--nominal", nominal, *TOLERANCE, "--fit", "none")
    said = "  only 49.8% of the nominal was measured: nothing is known of the rest"
    assert said in cmmlink(*told).out.splitlines()
    proven = cmmlink(*told, "--coverage-min", 0.6)
    assert proven.code == 3
    assert said in proven.out.splitlines()


def test_rejected_outliers_neither_pass_nor_prove_a_part(nominal: Path) -> None:
    noisy = np.random.default_rng(3).normal(0, 0.004, 360)
    noisy[[40, 41, 200, 300]] = (1.5, 1.5, -0.8, 2.0)
    points = write_points(nominal.parent / "points.csv", oval_points(noisy))
    told = ("inspect", points, "--nominal", nominal, *TOLERANCE)
    assert cmmlink(*told, "--json").json()["verdict"] == "nonconform"
    ended = cmmlink(*told, "--reject-outliers")
    assert ended.code == 3
    lines = ended.out.splitlines()
    assert lines[1] == "  4 outliers were rejected, not judged: look whether they are dirt or a defect"
    assert "received 360 = judged 356 + rejected 4; lost 0 points" in lines
    facts = cmmlink(*told, "--reject-outliers", "--json").json()
    assert (facts["verdict"], facts["rejected_by_reason"], facts["out_of_tolerance"]) == ("uncertain", {"outlier": 4}, 0)
    assert facts["max_deviation_mm"] < 0.02


def test_many_stretches_are_summed_up(nominal: Path) -> None:
    deviation = np.where(np.arange(360) % 20 == 0, 0.1 + np.arange(360) * 1e-4, 0.0)
    lines = [line for line in inspected(nominal, deviation).out.splitlines() if "out of tolerance" in line]
    assert len(lines) == 11
    assert lines[-1] == "  out of tolerance: 8 more stretches, none of them worse"
    assert f"{station_mm(340):.2f} mm, worst +0.1340 mm" in lines[-2]


AS_PROCESS = (sys.executable, "-m", "cmmlink")
ROOT = Path(__file__).resolve().parents[2]


def inspection(nominal: Path, out: Path, name: str = "points.csv") -> list[str]:
    points = write_points(nominal.parent / name, oval_points(0.01))
    return [*AS_PROCESS, *map(str, ("inspect", points, "--nominal", nominal, *TOLERANCE, "--fit", "none", "--out", out))]


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no full device on this system")
def test_an_answer_that_cannot_be_written_is_not_taken_for_nonconform_and_loses_no_result(nominal: Path, tmp_path: Path) -> None:
    with open("/dev/full", "w", encoding="utf-8") as full:
        ended = subprocess.run(inspection(nominal, tmp_path / "a"), cwd=ROOT, stdout=full, stderr=subprocess.PIPE, text=True, check=False)
    assert ended.returncode == 2
    assert ended.stderr.splitlines()[-1].startswith("cmmlink: the answer could not be written: ")
    assert "Traceback" not in ended.stderr
    reading, writing = os.pipe()
    os.close(reading)  # a pipe that nobody reads
    unread = subprocess.run(inspection(nominal, tmp_path / "b"), cwd=ROOT, stdout=writing, stderr=subprocess.PIPE, text=True, check=False)
    os.close(writing)
    assert (unread.returncode, "Traceback" in unread.stderr) == (2, False)
    for folder in ("a", "b"):
        assert json.loads((tmp_path / folder / "result.json").read_text())["verdict"] == "conform"


def test_a_name_that_the_terminal_has_no_letters_for_costs_no_verdict(nominal: Path, tmp_path: Path) -> None:
    latin = os.environ | {"PYTHONUTF8": "0", "PYTHONIOENCODING": "cp1252:strict"}
    ended = subprocess.run(inspection(nominal, tmp_path / "a", "\u53f6\u7247.csv"), cwd=ROOT, env=latin, capture_output=True, check=False)
    assert ended.returncode == 0
    assert ended.stdout.startswith(b"CONFORM   ??, file ??.csv")


def test_json_is_one_object_with_the_stable_keys(nominal: Path) -> None:
    facts = inspected(nominal, 0.01, "--json").json()
    assert set(facts) >= KEYS
    assert (facts["received"], facts["judged"], facts["rejected"], facts["lost"]) == (360, 360, 0, 0)
    assert facts["part"] == "points"
    assert facts["simulated"] is False


def test_options_may_stand_before_and_after_the_argument(nominal: Path) -> None:
    points = write_points(nominal.parent / "points.csv", oval_points(0.02))
    options = ["--nominal", nominal, *TOLERANCE, "--fit", "none", "--json"]
    after, before = cmmlink("inspect", points, *options), cmmlink("inspect", *options, points)
    among = cmmlink("inspect", *options[:2], points, *options[2:])
    assert after.code == 0
    assert after == before == among


@pytest.mark.parametrize("method", ["exact", "circle", "chord", "pcp", "veaw", "inversion"])
def test_every_method_is_taken_and_named(nominal: Path, method: str) -> None:
    facts = inspected(nominal, 0.03, "--method", method, "--json").json()
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


def peanut(folder: Path) -> tuple[Path, np.ndarray[Any, np.dtype[np.float64]]]:
    """r = 20 + 6 cos 2t in mm: at its waist concave with radius (r^2 + r'^2)^1.5 / |r^2 + 2 r'^2 - r r''| = 14^3 / 140 = 19.6 mm."""
    t = np.linspace(0, 2 * np.pi, 401)
    points = (20 + 6 * np.cos(2 * t))[:, None] * np.column_stack([np.cos(t), np.sin(t)])
    points[-1] = points[0]
    return write_points(folder / "peanut.csv", points), points[:-1]


# Files


def test_out_holds_the_results(nominal: Path) -> None:
    ended = inspected(nominal, 0.01, "--out", nominal.parent / "results", "--json")
    assert sorted(path.name for path in (nominal.parent / "results").iterdir()) == ["deviations.csv", "profile.png", "result.json"]
    assert json.loads((nominal.parent / "results" / "result.json").read_text(encoding="utf-8")) == ended.json()


def test_the_summary_says_where_the_files_are(nominal: Path) -> None:
    folder = nominal.parent / "results"
    assert (
        inspected(nominal, 0.01, "--out", folder).out.splitlines()[-1] == f"results in {folder}: result.json, deviations.csv, profile.png"
    )


def test_nominal_shows_what_was_understood(nominal: Path) -> None:
    facts = cmmlink("nominal", nominal, "--json").json()
    assert set(facts) >= {"degree", "knots", "control_points_mm", "weights", "closed", "length_mm", "source_format"}
    assert (facts["degree"], facts["closed"], len(facts["knots"]), len(facts["weights"])) == (2, True, 12, 9)
    assert facts["length_mm"] == pytest.approx(LENGTH_MM, rel=1e-9)
    assert facts["control_points_mm"][1] == [10.0, 8.0]
    words = cmmlink("nominal", nominal)
    assert words.code == 0
    assert f"degree 2, 9 control points\nclosed, length {LENGTH_MM:.4f} mm" in words.out


def test_a_scaled_nominal_is_as_much_longer(nominal: Path) -> None:
    assert cmmlink("nominal", nominal, "--scale", 25.4, "--json").json()["length_mm"] == pytest.approx(25.4 * LENGTH_MM, rel=1e-9)


# Plans

PLAN = """\
part: {name: oval, serial_number: 0012}
operator: A. Operator
nominal: {file: oval.yaml}
tolerance:
  lower_mm: -0.05
  upper_mm: 0.05
device: {type: file, file: points.csv}
probe: {tip_radius_mm: 0}
registration: {datum: {}}
discretisation: {samples: 400}
"""


def planned(nominal: Path, deviation_mm: Any = 0.0, text: str = PLAN) -> Path:
    write_points(nominal.parent / "points.csv", oval_points(deviation_mm))
    plan = nominal.parent / "plan.yaml"
    plan.write_text(text, encoding="utf-8")
    return plan


@pytest.mark.parametrize(("deviation_mm", "code", "verdict"), [(0.01, 0, "conform"), (0.06, 1, "nonconform")])
def test_run_carries_out_a_plan(nominal: Path, deviation_mm: float, code: int, verdict: str) -> None:
    ended = cmmlink("run", planned(nominal, deviation_mm), "--headless", "--json")
    facts = ended.json()
    assert (ended.code, facts["verdict"], facts["received"], facts["judged"]) == (code, verdict, 360, 360)
    assert (facts["part"], facts["serial_number"], facts["operator"], facts["device"]) == ("oval", "0012", "A. Operator", "file points.csv")
    assert facts["max_deviation_mm"] == pytest.approx(deviation_mm, abs=1e-8)


def test_points_off_the_plane_are_the_reason_that_is_given(nominal: Path) -> None:
    plan = planned(nominal, 0.0, PLAN.replace("registration: {datum: {}}", "section: {off_plane_max_mm: 0.5}"))
    points = np.column_stack([oval_points(0.0), np.full(360, 60.0)])
    np.savetxt(nominal.parent / "points.csv", points, fmt="%.9f", delimiter=",", header="x_mm,y_mm,z_mm", comments="")
    ended = cmmlink("run", plan, "--json")
    assert ended.code == 2
    assert "360 of 360 points lie farther than 0.5 mm from the plane of the section" in ended.err
    assert ended.json()["rejected_by_reason"] == {"off section": 360}


def test_run_without_a_terminal_prints_the_summary_alone(nominal: Path) -> None:
    ended = cmmlink("run", planned(nominal, 0.01))
    assert (ended.code, ended.err) == (0, "")
    assert ended.out.startswith("CONFORM   oval 0012, file points.csv\nreceived 360 = judged 360 + rejected 0; lost 0 points\n")


def test_out_of_a_plan_is_relative_to_the_plan_and_yields_to_the_option(nominal: Path) -> None:
    plan = planned(nominal, 0.0, PLAN + "out: found\n")
    assert cmmlink("run", plan).code == 0
    assert (nominal.parent / "found" / "result.json").exists()
    assert cmmlink("run", plan, "--out", nominal.parent / "elsewhere").code == 0
    assert (nominal.parent / "elsewhere" / "result.json").exists()


def test_a_device_that_is_not_there_is_a_device_failure_and_proves_nothing(nominal: Path) -> None:
    plan = planned(nominal, 0.0, PLAN.replace("{type: file, file: points.csv}", "{type: serial, address: no-such-port}"))
    ended = cmmlink("run", plan, "--json")
    assert re.match("no-such-port: cannot be opened: .*; is it plugged in, free, and named right", ended.failed(4))
    facts = ended.json()
    assert (facts["verdict"], facts["received"], facts["judged"], facts["complete"]) == ("uncertain", 0, 0, False)
    words = cmmlink("run", plan)
    assert words.out.splitlines()[:2] == ["NOT PROVEN   oval 0012, serial no-such-port", "  nothing was judged"]


def test_check_says_what_would_be_run(nominal: Path) -> None:
    ended = cmmlink("check", planned(nominal))
    assert (ended.code, ended.err) == (0, "")
    assert f"can be run: oval, zone -0.05 .. +0.05 mm, file points.csv\nnominal {LENGTH_MM:.3f} mm long" in ended.out


def test_check_does_not_touch_the_device(nominal: Path) -> None:
    plan = planned(nominal, 0.0, PLAN.replace("{type: file, file: points.csv}", "{type: serial, address: no-such-port}"))
    assert cmmlink("check", plan).code == 0


WRONG_PLANS = [
    (("lower_mm: -0.05", "lower_mm: 0.06"), r"line 6: tolerance\.upper_mm is '0\.05'; expected a number above lower_mm, which is 0\.06"),
    (("operator:", "operater:"), r"line 2: operater is not a known key; did you mean operator\?"),
    (("upper_mm: 0.05", "uper_mm: 0.05"), r"line 6: tolerance\.uper_mm is not a known key; did you mean upper_mm\?"),
    (("upper_mm: 0.05", "upper_mm: 0,05"), r"line 6: tolerance\.upper_mm is '0,05'; expected a number, with a decimal point"),
    (("tip_radius_mm: 0", "tip_radius_mm: -1"), r"line 8: probe\.tip_radius_mm is '-1'; expected"),
    (("oval.yaml", "disk.yaml"), r"line 3: nominal\.file: .*disk\.yaml: no such file"),
    (("type: file", "type: fail"), r"line 7: device\.type is 'fail'; did you mean file\?"),
    (("{datum: {}}", "{fit: best}"), r"line 9: registration\.fit is 'best'; expected 'best-fit', 'minimum-zone' or 'none'"),
    ((PLAN, ""), r"plan\.yaml: the file is empty"),
    ((PLAN, "just words"), r"line 1: found 'just words'; expected keys with values"),
    (("part: {", "part: {{"), r"line 1: "),
]


@pytest.mark.parametrize("command", ["check", "run"])
@pytest.mark.parametrize(("change", "message"), WRONG_PLANS)
def test_a_wrong_plan_is_refused_by_file_line_and_key(nominal: Path, command: str, change: tuple[str, str], message: str) -> None:
    ended = cmmlink(command, planned(nominal, 0.0, PLAN.replace(*change)))
    assert re.search(r"plan\.yaml: .*" * ("plan" not in message) + message, ended.refused())
    assert ended.out == ""


@pytest.mark.parametrize("command", ["check", "run"])
def test_a_tip_larger_than_the_smallest_concave_radius_is_refused(tmp_path: Path, command: str) -> None:
    peanut(tmp_path)
    text = PLAN.replace("oval.yaml", "peanut.csv").replace("tip_radius_mm: 0", "tip_radius_mm: 25")
    message = cmmlink(command, planned(tmp_path / "oval.yaml", 0.0, text)).refused()
    assert re.search(r"plan\.yaml: line 8: probe\.tip_radius_mm: tip radius 25 mm: .*smallest concave radius, 19\.59 mm", message)


@pytest.mark.parametrize("command", ["check", "run"])
def test_a_plan_that_is_no_file_is_refused(tmp_path: Path, command: str) -> None:
    assert cmmlink(command, tmp_path / "plan.yaml").refused() == f"{tmp_path / 'plan.yaml'}: no such file"
    assert cmmlink(command, tmp_path).refused() == f"{tmp_path}: is a folder; expected a file"


def test_check_looks_at_the_points_of_a_plan(nominal: Path) -> None:
    plan = planned(nominal, 0.0, PLAN.replace("points.csv", "pints.csv"))
    assert re.search(r"plan\.yaml: line 7: device: .*pints\.csv: no such file", cmmlink("check", plan).refused())


# Wrong points

GOOD_ROWS = "".join(f"{x:.6f},{y:.6f}\n" for x, y in oval_points(0.0))
WRONG_POINTS = {
    "empty": (b"", "the file is empty"),
    "blank": (b"\n\n  \n", "the file is empty"),
    "text": (b"this is\nno list of points\n", "no line of numbers"),
    "header alone": (b"x_mm,y_mm\n", "no line of numbers"),
    "bytes": (bytes(range(256)), "line 1: not a text file"),
    "nan": (f"1,2\n3,nan\n{GOOD_ROWS}".encode(), r"line 2: nan is not a finite number"),
    "infinite": (f"x,y\n1,2\n3,inf\n{GOOD_ROWS}".encode(), r"line 3: inf is not a finite number"),
    "word": (f"1,2\n3,four\n{GOOD_ROWS}".encode(), r"line 2: 'four' is not a number"),
    "ragged": (f"1,2\n3\n{GOOD_ROWS}".encode(), r"line 2: "),
    "one column": (b"1\n2\n3\n", r"line 1: one column"),
    "one point": (b"1,2\n", r"1 point; expected at least two"),
    "two points": (b"1,2\n2,3\n", r"2 points: a registration needs at least \d"),
    "one point many times": (b"1.5,2.5\n" * 50, r"all 50 points coincide at \(1\.5, 2\.5\)"),
    "another unit": (f"x_inch,y_inch\n{GOOD_ROWS}".encode(), "the header gives x in inch"),
    "another part": (b"".join(b"%d,%d\n" % (i, i % 7) for i in range(200)), "the points do not fit the nominal"),
}


@pytest.mark.parametrize("name", WRONG_POINTS)
def test_points_that_cannot_be_used_are_refused_by_file_and_line(nominal: Path, name: str) -> None:
    content, message = WRONG_POINTS[name]
    points = nominal.parent / "wrong.csv"
    points.write_bytes(content)
    ended = cmmlink("inspect", points, "--nominal", nominal, *TOLERANCE)
    assert re.match(re.escape(f"{points}: ") + message, ended.refused())
    assert ended.out == ""


def test_swapped_columns_are_named_as_the_cause(tmp_path: Path) -> None:
    nominal = demo_plan_file().with_name("nominal.csv")
    points = np.loadtxt(nominal, delimiter=",", skiprows=2)[:-1]
    swapped = write_points(tmp_path / "swapped.csv", points[:, ::-1])
    message = cmmlink("inspect", swapped, "--nominal", nominal, *TOLERANCE, "--json").refused()
    assert re.match(re.escape(f"{swapped}: the points fit the nominal only mirrored") + ".*are the x and y columns swapped", message)


def test_points_that_are_no_file_are_refused(nominal: Path) -> None:
    for points, message in ((nominal.parent / "none.csv", "no such file"), (nominal.parent, "is a folder; expected a file")):
        assert cmmlink("inspect", points, "--nominal", nominal, *TOLERANCE).refused() == f"{points}: {message}"


# Wrong options

WRONG_OPTIONS = [
    (("--tolerance", 0.05, -0.05), r"--tolerance 0\.05 -0\.05: the lower limit must be below the upper one, got 0\.05 \.\. -0\.05 mm"),
    (("--tolerance", 0.05, 0.05), r"--tolerance 0\.05 0\.05: the lower limit must be below"),
    (("--tolerance", "nan", 0.05), r"--tolerance nan 0\.05: "),
    (("--uncertainty", 0.05), r"--tolerance -0\.05 0\.05 --uncertainty 0\.05: .* leaves nothing provable of a zone 0\.1 mm wide"),
    (("--uncertainty", -1), r".*--uncertainty -1: the uncertainty must be zero or more, got -1 mm"),
    (
        ("--method", "guess"),
        r"Invalid value for '--method': 'guess' is not one of 'exact', 'circle', 'chord', 'pcp', 'veaw', 'inversion'; ",
    ),
    (("--fit", "tight"), r"Invalid value for '--fit': 'tight' is not one of 'best-fit', 'minimum-zone', 'none'; "),
    (("--material", "up"), r"Invalid value for '--material': 'up' is not one of 'left', 'right'; "),
    (("--tip-radius", -1), r"--tip-radius -1: .*must be zero or more"),
    (("--tip-radius", "big"), r"Invalid value for '--tip-radius': .*number"),
    (("--scale", 0), r"the scale must be a positive number, not 0"),
    (("--scale", "nan"), r"the scale must be a positive number, not nan"),
    (("--coverage-min", 2), r"Invalid value for '--coverage-min': .*less than or equal to 1"),
    (("--reject-outliers",), r"--reject-outliers needs a fit: .*Leave out --fit none"),
    (("--metod", "exact"), r"No such option: --metod.*--method"),
    (("further.csv",), r"Got unexpected extra argument"),
    (("--out",), r"Option '--out' requires an argument"),
]


@pytest.mark.parametrize(("options", "message"), WRONG_OPTIONS)
def test_a_wrong_option_is_named_with_what_is_allowed(nominal: Path, options: tuple[object, ...], message: str) -> None:
    ended = inspected(nominal, 0.0, *options)
    assert re.match(message, ended.refused())
    assert ended.out == ""


def test_a_tip_radius_is_checked_against_the_smallest_concave_radius(tmp_path: Path) -> None:
    nominal, points = peanut(tmp_path)
    told = ("inspect", write_points(tmp_path / "p.csv", points), "--nominal", nominal, *TOLERANCE, "--fit", "none", "--tip-radius")
    assert "--tip-radius 19.7: " in cmmlink(*told, 19.7).refused()
    assert cmmlink(*told, 19.5).code == 1  # taken; the points are no ball centres, so they are out of tolerance


def test_a_ball_centre_is_judged_by_its_distance_less_the_radius(nominal: Path) -> None:
    facts = inspected(nominal, 2.03, "--tip-radius", 2, "--json").json()
    assert facts["max_deviation_mm"] == pytest.approx(0.03, abs=1e-8)
    assert facts["verdict"] == "conform"


def test_what_is_missing_is_named(nominal: Path) -> None:
    assert cmmlink("inspect").refused() == "Missing argument 'POINTS'; `cmmlink inspect --help` shows what is allowed"
    assert cmmlink("inspect", "p.csv", *TOLERANCE).refused().startswith("Missing option '--nominal'; ")
    assert cmmlink("inspect", "p.csv", "--nominal", nominal).refused().startswith("Missing option '--tolerance'; ")
    assert cmmlink("inspect", "p.csv", "--nominal", nominal, "--tolerance", -0.05).refused().startswith("Option '--tolerance' requires 2")
    assert cmmlink("run").refused().startswith("Missing argument 'PLAN.yaml'; `cmmlink run --help`")


def test_an_unknown_command_is_named_and_the_near_one_offered() -> None:
    assert re.match(r"No such command 'inspcet'\. Did you mean 'inspect'\?", cmmlink("inspcet").refused())


@pytest.mark.parametrize("name", ["file", "file/below"])
def test_a_folder_that_cannot_be_written_is_refused_before_the_run(nominal: Path, name: str) -> None:
    (nominal.parent / "file").write_text("", encoding="utf-8")
    plan = planned(nominal, 0.0, PLAN.replace("{type: file, file: points.csv}", "{type: serial, address: no-such-port}"))
    for ended in (inspected(nominal, 0.0, "--out", nominal.parent / name), cmmlink("run", plan, "--out", nominal.parent / name)):
        assert ended.refused().startswith(f"{nominal.parent / name}: the results cannot be written")
    demo = cmmlink("demo", "--headless", "--out", nominal.parent / name)
    assert demo.refused().endswith("choose another folder with --out")


@pytest.mark.parametrize(
    ("content", "message"), [("", "the file is empty"), ("1,2\n", "1 point; expected at least 4"), ("a b\n", "no line of")]
)
@pytest.mark.parametrize("command", ["nominal", "inspect"])
def test_a_wrong_nominal_is_refused(tmp_path: Path, command: str, content: str, message: str) -> None:
    file = tmp_path / "nominal.csv"
    file.write_text(content, encoding="utf-8")
    points = write_points(tmp_path / "points.csv", oval_points(0.0))
    told = ("nominal", file) if command == "nominal" else ("inspect", points, "--nominal", file, *TOLERANCE)
    assert re.match(re.escape(f"{file}: ") + message, cmmlink(*told).refused())


def test_a_nominal_with_duplicate_points_is_refused_by_line(tmp_path: Path) -> None:
    points = oval_points(0.0)
    file = write_points(tmp_path / "nominal.csv", np.insert(points, 7, points[6], axis=0))
    assert re.match(r".*nominal\.csv: line 9: repeats the point \(.*\) of line 8; ", cmmlink("nominal", file).refused())


def test_a_nominal_of_unknown_format_is_refused_with_the_known_ones(tmp_path: Path) -> None:
    assert re.search(
        r"nominal\.foo: no nominal file is known by the suffix '\.foo'; .*\.csv", cmmlink("nominal", tmp_path / "nominal.foo").refused()
    )


def test_an_open_nominal_needs_its_material_side(tmp_path: Path) -> None:
    x = np.linspace(0, 50, 60)
    wave = np.column_stack([x, 3 * np.sin(x / 8) + 0.02 * x**1.5])
    nominal, points = write_points(tmp_path / "wave.csv", wave), write_points(tmp_path / "points.csv", wave + np.array([0, 0.01]))
    told = ("inspect", points, "--nominal", nominal, *TOLERANCE, "--fit", "none")
    assert "wave.csv: an open profile does not show" in cmmlink(*told).refused()
    assert "--material left or --material right" in cmmlink(*told).refused()
    left, right = cmmlink(*told, "--material", "left", "--json").json(), cmmlink(*told, "--material", "right", "--json").json()
    assert left["min_deviation_mm"] == pytest.approx(-right["max_deviation_mm"], abs=1e-9)
    assert -0.0101 < left["min_deviation_mm"] < left["max_deviation_mm"] < 0  # above the wave, material to its left is above it, too


@pytest.mark.parametrize("defect", ["foo", "0.1", "@", "0.1@", "nan@40", "0.1@nan", "0.1@-1", "0.1@206", "inf@40"])
def test_a_wrong_defect_is_refused_with_an_example(tmp_path: Path, defect: str) -> None:
    message = cmmlink("demo", "--headless", "--out", tmp_path / "out", "--defect", defect).refused()
    assert message.startswith(f"--defect {defect}: expected MM@STATION, a station between 0 and 205.0 mm, like 0.12@40")
    assert not (tmp_path / "out").exists()


def test_a_wrong_seed_is_refused() -> None:
    assert cmmlink("demo", "--seed", -1).refused().startswith("Invalid value for '--seed'")


# Small commands


def test_version() -> None:
    assert cmmlink("--version") == Ended(0, f"cmmlink {__version__}\n", "")


@pytest.mark.parametrize("option", ["--help", "-h"])
def test_help_lists_every_command_with_its_meaning(option: str) -> None:
    ended = cmmlink(option)
    assert ended.code == 0
    for command in COMMANDS:
        assert re.search(rf"^  {command} +[A-Z].*[a-z]\.$", ended.out, re.MULTILINE), command
    assert "0 conform, 1 nonconform, 3 uncertain" in ended.out


def test_no_command_shows_the_help_and_is_no_success() -> None:
    ended = cmmlink()
    assert ended.code == 2
    assert ended.out == cmmlink("--help").out


@pytest.mark.parametrize("command", COMMANDS)
def test_help_of_a_command_says_how_to_call_it(command: str) -> None:
    ended = cmmlink(command, "--help")
    assert (ended.code, ended.err) == (0, "")
    assert f"cmmlink {command} " in ended.out.splitlines()[0]
    assert max(map(len, ended.out.splitlines())) <= 120


def test_ports_lists_what_the_system_has(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("cmmlink.commands.ports", lambda: [("COM3", "USB serial"), ("COM4", "a probe")])
    assert cmmlink("ports") == Ended(0, "COM3\tUSB serial\nCOM4\ta probe\n", "")
    monkeypatch.setattr("cmmlink.commands.ports", list)
    assert cmmlink("ports") == Ended(0, "no serial port was found\n", "")


def test_an_unknown_device_is_named_with_the_known_ones() -> None:
    assert re.match(r"no simulated device is called toaster; known: .*serial", cmmlink("simulate", "toaster").refused())
    assert re.match(r"name the device to simulate; known: .*serial", cmmlink("simulate").refused())


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ((), "the following arguments are required: --address, --path"),
        (("--address", "pty", "--path", "no-such.csv"), "no-such.csv: no such file"),
        (("--address", "pty", "--path", "{path}", "--fault", "fire"), "fault 'fire' is none of flip, "),
        (("--address", "pty", "--path", "{path}", "--rate", "0"), "speed 50.0 mm/s and rate 0.0 Hz must be positive"),
    ],
)
def test_wrong_options_of_a_simulated_device_are_one_message(tmp_path: Path, options: tuple[str, ...], message: str) -> None:
    path = write_points(tmp_path / "path.csv", oval_points(0.0))
    ended = cmmlink("simulate", "serial", *(option.format(path=path) for option in options))
    assert (ended.code, ended.out, len(ended.err.splitlines())) == (2, "", 1)
    assert ended.err.startswith(f"cmmlink simulate serial: {message}")


def test_an_address_that_cannot_be_served_is_named(tmp_path: Path) -> None:
    path = write_points(tmp_path / "path.csv", oval_points(0.0))
    message = cmmlink("simulate", "serial", "--address", "nowhere", "--path", path).failed(4)
    assert message.startswith("the simulated device cannot serve nowhere: ")
