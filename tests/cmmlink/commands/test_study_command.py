"""The command `study` over recorded runs of a part in closed form, up to a plan whose results tell where U comes from."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pypdf import PdfReader

from tests.cmmlink.command import cmmlink
from tests.cmmlink.oval_part import LENGTH_MM, oval_points, write_nominal, write_points

PARTS, OPERATORS, REPEATS = (0.01, 0.02), ("Anna", "Bert"), 2
MPE_MM, TIP_MM = 0.0018, 0.0004
PLAN = """
part: {{name: oval, serial_number: "{part}"}}
nominal: {{file: oval.yaml}}
tolerance: {{lower_mm: -0.05, upper_mm: 0.05}}
registration: {{fit: none}}
device: {{type: file, file: {points}}}
records: records
out: null
uncertainty: {{mpe: {{a_mm: 0.0018}}, tip_radius_mm: 0.0004, repeatability_mm: 0.003}}
"""


def size(part: int, operator: int, repeat: int) -> float:
    """How much larger than its nominal a part is found all around: a difference of operators and one of repeats that are known."""
    return PARTS[part] + 0.001 * operator + (-0.0005 if repeat % 2 else 0.0005)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("study")
    write_nominal(folder / "oval.yaml")
    for part in range(2):
        for operator, name in enumerate(OPERATORS):
            for repeat in range(REPEATS):
                write_points(folder / "points.csv", oval_points(size(part, operator, repeat)))
                (folder / "plan.yaml").write_text(PLAN.format(part=f"P{part}", points="points.csv"), encoding="utf-8")
                assert cmmlink("run", folder / "plan.yaml", "--headless", "--operator", name).code == 0
    return folder


@pytest.fixture(scope="module")
def study(folder: Path) -> Path:
    file = folder / "oval.json"
    assert cmmlink("study", "new", file, "--kind", "crossed", "--name", "oval").code == 0
    assert cmmlink("study", "add", file, *range(1, 9), "--records", folder / "records").code == 0
    return file


def test_a_crossed_study_finds_the_spreads_that_its_parts_were_made_with(folder: Path, study: Path, tmp_path: Path) -> None:
    found: dict[str, Any] = cmmlink("study", "report", study, "--json", "--out", tmp_path / "oval.pdf").json()
    assert (found["parts"], found["operators"], found["repeats"]) == (["P0", "P1"], list(OPERATORS), REPEATS)
    (profile,) = found["characteristics"]
    # the profile error of a part that is larger all around by d is 2 d
    lines = {line["source"]: line["sigma"] for line in profile["crossed"]["lines"]}
    along = found["along_the_profile"]
    assert len(along["station_mm"]) == len(along["gauge_mm"])
    assert along["station_mm"][-1] < LENGTH_MM
    # 4 pairs, each with two repeats 0.001 apart: with the interaction, which is none, pooled, its square sum counts over 5 freedoms
    repeatability = np.sqrt(4 * 0.001**2 / 2 / 5)
    assert np.array(along["repeatability_mm"], dtype=float) == pytest.approx(repeatability, abs=2e-7)
    assert lines["repeatability"] == pytest.approx(2 * repeatability, rel=1e-5)
    budget = {line["source"].partition(",")[0]: line["standard"] for line in profile["budget"]["sources"]}
    assert budget["calibrated tip radius"] == pytest.approx(TIP_MM, rel=1e-6)
    assert budget["device"] > 0
    assert "stated in the plan" not in budget
    told = "".join(page.extract_text() for page in PdfReader(tmp_path / "oval.pdf").pages)
    assert "gauge R&R by analysis of variance" in told
    assert "uncertainty_from" in told


def test_the_keys_that_a_study_spells_go_into_a_plan_whose_result_tells_where_u_comes_from(folder: Path, study: Path) -> None:
    (profile,) = cmmlink("study", "report", study, "--json").json()["characteristics"]
    asked = f"characteristics:\n  - {{name: profile, type: line-profile, fit: none, zone: {{width_mm: 0.1}}, {profile['plan']}}}\n"
    plan = PLAN.format(part="P9", points="points.csv").replace("tolerance: {lower_mm: -0.05, upper_mm: 0.05}\n", asked)
    (folder / "next.yaml").write_text(plan, encoding="utf-8")
    found = cmmlink("run", folder / "next.yaml", "--headless", "--json").json()
    (note,) = [note for note in found["notes"] if note.startswith("U of profile is from the study oval of ")]
    assert "repeatability" in note
    (judged,) = found["characteristics"]
    assert profile["budget"]["expanded"] <= judged["uncertainty"] < 1.1 * profile["budget"]["expanded"]  # and not that of the budget


def test_a_run_that_does_not_belong_to_the_study_is_refused_and_the_study_stays_as_it_was(folder: Path, study: Path) -> None:
    before = study.read_text(encoding="utf-8")
    for arguments, words in (
        (("1",), "is in the study already"),
        (("99",), "99"),
    ):
        refused = cmmlink("study", "add", study, *arguments, "--records", folder / "records")
        assert refused.code == 2
        assert words in refused.err
    assert study.read_text(encoding="utf-8") == before
    again = cmmlink("study", "new", study, "--kind", "crossed")
    assert (again.code, "exists already" in again.err) == (2, True)


def test_mistakes_are_named(tmp_path: Path) -> None:
    file = tmp_path / "s.json"
    for arguments, words in (
        (("new", file, "--kind", "type-1"), "needs the value of its part: --reference"),
        (("new", file, "--kind", "type-1", "--reference", "chord"), "expected NAME=VALUE or NAME=VALUE:U"),
        (("new", file, "--kind", "crossed", "--reference", "chord=60"), "nobody needs to know"),
        (("report", file), "begins a study"),
    ):
        refused = cmmlink("study", *arguments)
        assert refused.code == 2
        assert words in refused.err
    assert not file.exists()
    assert cmmlink("study", "new", file, "--kind", "type-1", "--reference", "chord=60.0012:0.0004").code == 0
    assert json.loads(file.read_text())["references"] == {"chord": {"value": 60.0012, "expanded": 0.0004}}
    empty = cmmlink("study", "report", file)
    assert (empty.code, "no runs yet" in empty.err) == (2, True)
    assert cmmlink("study", "report", file, "--out", "x.txt").code == 2
