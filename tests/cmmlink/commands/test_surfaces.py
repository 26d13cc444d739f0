"""The command `ct`: what it prints, writes and refuses."""

import csv
import json
from pathlib import Path

from scipy.interpolate import BSpline

from cmmlink.commands.surfaces import _grouped
from tests.cmmlink.blade import tapered
from tests.cmmlink.command import cmmlink
from tests.drivers.surface.ct_phantom import (
    write_spline,
)
from tests.drivers.surface.meshes import ascii_stl, write


def test_the_command_writes_results_for_the_stack_and_every_section(blade: tuple[Path, Path], tmp_path: Path) -> None:
    out = tmp_path / "results"
    earlier = out / "section-007_99.000mm"
    earlier.mkdir(parents=True)
    write(earlier / "deviations.csv", "of an earlier run")
    arguments = [
        "--nominal",
        blade[1],
        "--tolerance",
        -0.05,
        0.05,
        "--heights",
        5,
        10.5,
        15,
        "--normal",
        0,
        0,
        2,
        "--out",
        out,
        "--json",
        "--cutter",
        "numpy",
    ]
    ran = cmmlink("ct", blade[0], *arguments, "--out", out, "--pictures", "all", "--json")
    assert ran.code == 0
    facts = json.loads(ran.out)
    assert json.loads((out / "result.json").read_text()) == facts
    assert facts["verdict"] == "conform"
    assert [cut["height_mm"] for cut in facts["slices"]] == [5, 10.5, 15]
    assert {"contours", "verdict", "worst", "registration", "stretches", "profile_error_mm", "set_aside"} <= set(facts["slices"][0])
    assert sorted(path.name for path in out.iterdir()) == [
        "earlier", "report.pdf", "result.json", "section-001_5.000mm", "section-002_10.500mm", "section-003_15.000mm", "sections.csv",
        "stack.png",
        "stack.svg",
    ]  # fmt: skip
    own = out / "section-002_10.500mm"
    assert sorted(path.name for path in own.iterdir()) == ["contours.csv", "deviations.csv", "profile.png", "profile.svg"]
    with (own / "contours.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == facts["slices"][1]["received"]
    assert {row["z_mm"] for row in rows} == {"10.500000"}
    assert {(row["closed"], row["hole"]) for row in rows} == {("closed", "outer")}
    for picture in (out / "stack.png", own / "profile.png"):
        assert picture.read_bytes()[:8] == b"\x89PNG\r\n\x1a\n"


def test_the_exit_status_is_that_of_the_worst_section(blade: tuple[Path, Path], tmp_path: Path, spline: BSpline) -> None:
    mesh = write(tmp_path / "tapered.stl", ascii_stl(tapered(spline)))
    options = ["--nominal", blade[1], "--tolerance", -0.1, 0.1, "--cutter", "numpy"]
    assert cmmlink("ct", mesh, *options, "--heights", 0.2).code == 0
    ran = cmmlink("ct", mesh, *options, "--heights", 0.2, 10, "--out", tmp_path / "out")
    assert ran.code == 1
    *_, verdict, written, left = ran.out.splitlines()
    assert verdict.startswith("NOT CONFORM  2 sections")
    assert written.startswith("results in ")
    assert left == "sections that were not drawn: 1; --pictures all draws those that conform as well"
    assert [path.parent.name for path in (tmp_path / "out").rglob("profile.png")] == ["section-002_10.000mm"]
    assert len(list((tmp_path / "out").rglob("deviations.csv"))) == 2
    small = write_spline(spline, tmp_path / "small.yaml", 0.95)
    assert cmmlink("ct", mesh, *options, "--heights", 0.2, 10, "--nominal-at", 10, small).code == 0
    assert cmmlink("ct", mesh, *options, "--heights", 0.2, "--uncertainty", 0.099).code == 3


def test_what_is_said_of_many_sections_is_said_once_with_their_heights() -> None:
    told = [(float(height), "The outline is open.") for height in range(10)] + [(3.5, "Nothing was cut.")]
    assert list(_grouped(told)) == [
        "heights 0, 1, 2, 3, 4, 5, 6, 7 and 2 more mm: The outline is open.",
        "height 3.5 mm: Nothing was cut.",
    ]


def test_a_plan_says_the_same_as_options(blade: tuple[Path, Path], tmp_path: Path) -> None:
    text = (
        "part: {name: blade}\nmesh: {file: blade.stl}\nnominal: {file: blade.yaml}\ntolerance: {lower_mm: -0.05, upper_mm: 0.05}\n"
        "sections: {every_mm: 5, from_mm: 5, to_mm: 10}\ncut: {cutter: numpy}\n"
    )
    by_plan = cmmlink("ct", write(tmp_path / "plan.yaml", text), "--no-record", "--json")
    options = ["--nominal", blade[1], "--tolerance", -0.05, 0.05, "--every", 5, "--from", 5, "--to", 10, "--cutter", "numpy"]
    by_options = cmmlink("ct", blade[0], *options, "--no-record", "--json")
    assert by_plan.code == by_options.code == 0
    assert json.loads(by_plan.out)["slices"] == json.loads(by_options.out)["slices"]


def test_an_option_beside_a_plan_is_refused_and_not_ignored(blade: tuple[Path, Path], tmp_path: Path) -> None:
    text = "part: {name: blade}\nmesh: {file: blade.stl}\nnominal: {file: blade.yaml}\ntolerance: {lower_mm: -0.05, upper_mm: 0.05}\n"
    plan = write(tmp_path / "plan.yaml", text + "sections: {heights_mm: [5]}\ncut: {cutter: numpy}\n")
    for option in (("--tolerance", -1e-7, 1e-7), ("--heights", 3, 4), ("--reject-outliers",), ("--coverage-min", 0.95)):
        ran = cmmlink("ct", plan, *option)
        assert (ran.code, ran.out) == (2, "")
        assert f"{option[0]} stands beside a plan" in ran.err
    assert cmmlink("ct", plan, "--no-pictures", "--json").code == 0


def test_bad_input_is_one_message_and_status_2(blade: tuple[Path, Path], tmp_path: Path) -> None:
    mesh, nominal = blade
    options = ["--nominal", nominal, "--tolerance", -0.05, 0.05, "--cutter", "numpy"]
    cut_off = write(tmp_path / "cut.stl", mesh.read_bytes()[:1000])
    cases: list[tuple[list[object], str]] = [
        ([cut_off, *options, "--heights", 5], "truncated"),
        ([tmp_path / "nowhere.stl", *options, "--heights", 5], "nowhere.stl"),
        ([tmp_path / "part.step", *options, "--heights", 5], "expected .stl, .ply or .obj"),
        ([mesh, *options, "--heights", 25], "misses the surface"),
        ([mesh, *options], "either heights_mm or every_mm"),
        ([mesh, *options, "--every", 0], "--every is 0: expected a number greater than 0"),
        ([mesh, *options, "--every", 1e-9], "expected 1 to 100000"),
        ([mesh, *options, "--heights", 5, "--normal", 0, 0, 0], "direction"),
        ([mesh, *options, "--heights", 5, "--nominal-at", "x", nominal], "--nominal-at x="),
        ([mesh, "--heights", 5], "needs --nominal FILE and --tolerance LO HI"),
        ([mesh, *options, "--heights", 5, "--nonsense", 1], "No such option"),
    ]
    for arguments, message in cases:
        ran = cmmlink("ct", *arguments)
        assert ran.code == 2, arguments
        assert message in ran.err
        assert ran.out == ""
