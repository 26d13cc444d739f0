"""The pose of the first part of a fixture is taken over by the others, and their records hold the hash of its chain."""

import json
from pathlib import Path

import numpy as np
import pytest

from inspection import RigidTransform
from tests.cmmlink.command import cmmlink
from tests.cmmlink.oval_part import COUNT, oval_points, write_nominal, write_points

FIXTURE = RigidTransform(0.01, np.array([0.2, 0.1]))
TURN = np.arange(COUNT) * 2 * np.pi / COUNT


def plan_of(folder: Path, datum: str) -> Path:
    (folder / "plan.yaml").write_text(
        "part: {name: oval}\nnominal: {file: oval.yaml}\ndevice: {type: file, file: points.csv}\nrecords: records\nout: null\n"
        f"registration: {{datum: {datum}}}\ntolerance: {{lower_mm: -0.02, upper_mm: 0.02}}\n",
        encoding="utf-8",
    )
    return folder / "plan.yaml"


@pytest.fixture
def first(tmp_path: Path) -> dict[str, object]:
    """The first part, which has a mark by which its pose is the only one, and result.json of its run."""
    write_nominal(tmp_path / "oval.yaml")
    write_points(tmp_path / "points.csv", FIXTURE.apply(oval_points(0.0)))
    back = FIXTURE.inverse()
    x, y = back.translation_mm.tolist()
    told = cmmlink(
        "run", plan_of(tmp_path, f"{{rotation_deg: {np.degrees(back.rotation_rad)}, translation_mm: [{x}, {y}]}}"), "--json"
    ).json()
    (tmp_path / "first.json").write_text(json.dumps(told), encoding="utf-8")
    return told


def test_the_second_part_is_judged_where_the_first_one_lay(tmp_path: Path, first: dict[str, object]) -> None:
    write_points(tmp_path / "points.csv", FIXTURE.apply(oval_points(0.015 * np.cos(TURN))))
    told = cmmlink("run", plan_of(tmp_path, "{result: first.json}"), "--json").json()
    assert told["rule"] == "datum"
    assert told["profile_error_mm"] == pytest.approx(0.03, abs=1e-4)  # a shift, which a fit would have taken away
    assert any(f"the pose of run {first['run']} (chain {first['chain_sha256']})" in note for note in told["notes"])
    replayed = cmmlink("replay", told["run"], "--records", tmp_path / "records", "--json").json()
    assert replayed["identical"]
    (tmp_path / "first.json").unlink()
    assert cmmlink("replay", told["run"], "--records", tmp_path / "records", "--json").json()["identical"], "the record holds the pose"


@pytest.mark.parametrize(
    ("key", "value", "words"),
    [
        ("run", None, "is of no recorded run"),
        ("ending", "aborted", "did not come to its end"),
        ("nominal_sha256", "0" * 64, "against another nominal"),
        ("registration", {"converged": False}, "no pose that settled"),
    ],
)
def test_a_pose_that_cannot_be_taken_over_is_refused_with_its_place(
    tmp_path: Path, first: dict[str, object], key: str, value: object, words: str
) -> None:
    (tmp_path / "first.json").write_text(json.dumps({**first, key: value}), encoding="utf-8")
    told = cmmlink("check", plan_of(tmp_path, "{result: first.json}")).refused()
    assert "registration.datum.result" in told
    assert words in told
