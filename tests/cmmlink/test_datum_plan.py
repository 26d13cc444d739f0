"""A plan with a datum that is measured on the part: what it gives on the line, in the result, and where it cannot be."""

from pathlib import Path

import numpy as np
import pytest
import yaml

from cmmlink.inspection_keys import Characterised
from inspection import RigidTransform
from tests.cmmlink.command import cmmlink
from tests.cmmlink.oval_part import oval_points, write_nominal

LINE = "{line: {from: {station_mm: 10}, to: {station_mm: 19}}, points: [{station_mm: 28}]}"


def write_plan(folder: Path, datum: str, fit: str = "datum") -> Path:
    write_nominal(folder / "oval.yaml")
    points = RigidTransform(0.01, np.array([0.2, 0.1])).apply(oval_points(0.0))
    np.save(folder / "points.npy", points)
    plan = {
        "part": {"name": "oval"},
        "nominal": {"file": "oval.yaml"},
        "device": {"type": "file", "file": "points.npy"},
        "registration": {"datum": {"rotation_deg": -0.57}},
        "tolerance": {"lower_mm": -0.5, "upper_mm": 0.5},
        "out": None,
        "characteristics": [
            {"name": "placed", "type": "line-profile", "zone": {"width_mm": 0.02}, "fit": fit, "datum": yaml.safe_load(datum)},
            {"name": "turned", "type": "twist", "lower_deg": -0.01, "upper_deg": 0.01, "datum": yaml.safe_load(datum)},
        ],
    }
    (folder / "plan.yaml").write_text(yaml.safe_dump(plan), encoding="utf-8")
    return folder / "plan.yaml"


def test_a_part_off_its_known_pose_is_right_at_the_datum_that_it_brings(tmp_path: Path) -> None:
    told = cmmlink("run", str(write_plan(tmp_path, LINE)), "--records", str(tmp_path / "records"), "--json").json()
    _, placed, turned = (Characterised.model_validate(one) for one in told["characteristics"])
    assert placed.verdict == turned.verdict == "conform"
    assert placed.value == pytest.approx(0.0, abs=1e-5)
    assert turned.value == pytest.approx(0.0, abs=1e-5)
    assert placed.fit == turned.fit == "datum: line station 10 .. 19 mm, point at station 28 mm"
    assert placed.datum is not None
    assert [(one.kind, one.words) for one in placed.datum] == [("line", "line station 10 .. 19 mm"), ("point", "point at station 28 mm")]
    assert placed.datum[0].points > 20
    assert placed.datum[0].rms_mm < 1e-5


def test_a_datum_that_fixes_nothing_is_told_with_its_place_before_anything_is_measured(tmp_path: Path) -> None:
    plan = write_plan(tmp_path, "{line: {from: {station_mm: 2}, to: {station_mm: 26}}, points: [{station_mm: 28}]}")
    checked = cmmlink("check", str(plan))
    assert checked.code == 2
    assert "characteristics[0]: The line station 2 .. 26 mm turns too far for a line" in checked.err
