"""The commands `run`, `check` and `demo`: plans carried out, and plans refused."""

import json
import re
from pathlib import Path

import numpy as np
import pytest

from tests.cmmlink.command import cmmlink
from tests.cmmlink.commands.oval_files import PLAN, write_plan
from tests.cmmlink.oval_part import LENGTH_MM, oval_points


@pytest.mark.parametrize(("deviation_mm", "code", "verdict"), [(0.01, 0, "conform"), (0.06, 1, "nonconform")])
def test_run_carries_out_a_plan(nominal: Path, deviation_mm: float, code: int, verdict: str) -> None:
    ended = cmmlink("run", write_plan(nominal, deviation_mm), "--headless", "--json")
    facts = ended.json()
    assert (ended.code, facts["verdict"], facts["received"], facts["judged"]) == (code, verdict, 360, 360)
    assert (facts["part"], facts["serial_number"], facts["operator"], facts["device"]) == ("oval", "0012", "A. Operator", "file points.csv")
    assert facts["max_deviation_mm"] == pytest.approx(deviation_mm, abs=1e-8)


def test_points_off_the_plane_are_the_reason_that_is_given(nominal: Path) -> None:
    plan = write_plan(nominal, 0.0, PLAN.replace("registration: {datum: {}}", "section: {off_plane_max_mm: 0.5}"))
    points = np.column_stack([oval_points(0.0), np.full(360, 60.0)])
    np.savetxt(nominal.parent / "points.csv", points, fmt="%.9f", delimiter=",", header="x_mm,y_mm,z_mm", comments="")
    ended = cmmlink("run", plan, "--json")
    assert ended.code == 2
    assert "360 of 360 points lie farther than 0.5 mm from the plane of the section" in ended.err
    error = ended.json()["error"]
    assert (error["exit_status"], error["message"] in ended.err) == (2, True)


def test_run_without_a_terminal_prints_the_summary_alone(nominal: Path) -> None:
    ended = cmmlink("run", write_plan(nominal, 0.01))
    assert (ended.code, ended.err) == (0, "")
    assert ended.out.startswith("CONFORM   oval 0012, file points.csv\nreceived 360 = judged 360 + rejected 0; lost 0 points\n")


def test_a_plan_that_says_nothing_has_a_folder_for_every_run_and_null_has_none(nominal: Path) -> None:
    plan = write_plan(nominal, 0.0)
    results = nominal.parent / "results"
    runs = [cmmlink("run", plan, "--json", "--records", nominal.parent / "records").json()["run"] for _ in range(2)]
    assert sorted(path.name for path in (results / "oval").iterdir()) == [f"0012_{run}" for run in runs]
    for run in runs:
        facts = json.loads((results / "oval" / f"0012_{run}" / "result.json").read_text(encoding="utf-8"))
        assert (facts["run"], facts["serial_number"]) == (run, "0012")
    words = cmmlink("run", plan, "--records", nominal.parent / "records").out
    assert f"results in {results / 'oval'}" in words
    assert len(list(results.rglob("result.json"))) == 3
    assert cmmlink("run", write_plan(nominal, 0.0, PLAN + "out: null\n")).code == 0
    assert len(list(results.rglob("result.json"))) == 3


def test_nothing_is_written_of_a_run_without_a_point(nominal: Path) -> None:
    plan = write_plan(nominal, 0.0, PLAN.replace("{type: file, file: points.csv}", "{type: serial, address: no-such-port}"))
    assert cmmlink("run", plan, "--json").code == 4
    assert not (nominal.parent / "results").exists()


def test_out_of_a_plan_is_relative_to_the_plan_and_yields_to_the_option(nominal: Path) -> None:
    plan = write_plan(nominal, 0.0, PLAN + "out: found\n")
    assert cmmlink("run", plan).code == 0
    assert (nominal.parent / "found" / "result.json").exists()
    assert cmmlink("run", plan, "--out", nominal.parent / "elsewhere").code == 0
    assert (nominal.parent / "elsewhere" / "result.json").exists()


def test_a_device_that_is_not_there_is_a_device_failure_and_proves_nothing(nominal: Path) -> None:
    plan = write_plan(nominal, 0.0, PLAN.replace("{type: file, file: points.csv}", "{type: serial, address: no-such-port}"))
    ended = cmmlink("run", plan, "--json")
    assert re.match("no-such-port: cannot be opened: .*; is it plugged in,", ended.failed(4))
    facts = ended.json()
    assert (facts["verdict"], facts["received"], facts["judged"], facts["complete"]) == ("uncertain", 0, 0, False)
    words = cmmlink("run", plan, "--out", nominal.parent / "found")
    assert words.out.splitlines()[:2] == ["NOT MEASURED   oval 0012, serial no-such-port", "  No point was judged."]
    assert list((nominal.parent / "found").iterdir()) == [], "no result of nothing"


def test_check_says_what_would_be_run(nominal: Path) -> None:
    ended = cmmlink("check", write_plan(nominal))
    assert (ended.code, ended.err) == (0, "")
    first, room, nominal_line, rule, *_ = ended.out.splitlines()
    assert first.endswith("can be run: oval, zone -0.05 .. +0.05 mm, file points.csv")
    assert rule == "decision rule: U not stated: simple acceptance"
    assert "room for" in room
    assert nominal_line.startswith(f"nominal {LENGTH_MM:.3f} mm long")


def test_check_does_not_touch_the_device(nominal: Path) -> None:
    plan = write_plan(nominal, 0.0, PLAN.replace("{type: file, file: points.csv}", "{type: serial, address: no-such-port}"))
    assert cmmlink("check", plan).code == 0


WRONG_PLANS = [
    (("lower_mm: -0.05", "lower_mm: 0.06"), r"line 6: tolerance\.upper_mm is '0\.05'; expected a number above the lower limit, 0\.06"),
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
    ended = cmmlink(command, write_plan(nominal, 0.0, PLAN.replace(*change)))
    assert re.search(r"plan\.yaml: .*" * ("plan" not in message) + message, ended.refused())
    assert ended.out == ""


@pytest.mark.parametrize("command", ["check", "run"])
def test_a_ball_that_fits_nowhere_is_refused(nominal: Path, command: str) -> None:
    text = PLAN.replace("file: oval.yaml", "file: oval.yaml, material: right").replace("tip_radius_mm: 0", "tip_radius_mm: 60")
    message = cmmlink(command, write_plan(nominal, 0.0, text)).refused()
    assert re.search(r"plan\.yaml: line 8: probe\.tip_radius_mm: tip radius 60 mm: the ball touches the profile nowhere", message)


@pytest.mark.parametrize("command", ["check", "run"])
def test_a_plan_that_is_no_file_is_refused(tmp_path: Path, command: str) -> None:
    assert cmmlink(command, tmp_path / "plan.yaml").refused() == f"{tmp_path / 'plan.yaml'}: no such file"
    assert cmmlink(command, tmp_path).refused() == f"{tmp_path}: is a folder; expected a file"


def test_check_looks_at_the_points_of_a_plan(nominal: Path) -> None:
    plan = write_plan(nominal, 0.0, PLAN.replace("points.csv", "pints.csv"))
    assert re.search(r"plan\.yaml: line 7: device: .*pints\.csv: no such file", cmmlink("check", plan).refused())


@pytest.mark.parametrize("defect", ["foo", "0.1", "@", "0.1@", "nan@40", "0.1@nan", "0.1@-1", "0.1@206", "inf@40"])
def test_a_wrong_defect_is_refused_with_an_example(tmp_path: Path, defect: str) -> None:
    message = cmmlink("demo", "--headless", "--out", tmp_path / "out", "--defect", defect).refused()
    assert message.startswith(f"--defect {defect}: expected MM@STATION, a station between 0 and 205.0 mm, like 0.12@40")
    assert not (tmp_path / "out").exists()


def test_a_wrong_seed_is_refused() -> None:
    assert cmmlink("demo", "--seed", -1).refused().startswith("Invalid value for '--seed'")
