"""What a stack of sections is as a whole comes to the database beside its sections, and is held against its record."""

import sqlite3
from contextlib import nullcontext
from pathlib import Path
from unittest.mock import patch

import numpy as np
import pytest

from cmmlink.archive import Here
from cmmlink.plant import ResultsDatabase, RunFound
from cmmlink.plant_push import push, verify_plant
from tests.cmmlink.command import cmmlink
from tests.cmmlink.recorded import today
from tests.drivers.surface.ct_phantom import GOE404, airfoil, write_spline
from tests.drivers.surface.meshes import binary_stl, tube, write


def blade(folder: Path) -> Path:
    """The plan of a blade whose upper half is turned by 0.2 degrees against its lower one; one motion places both."""
    spline = airfoil(GOE404, 60.0)
    outline, turn = spline(np.linspace(0, 1, 400)), np.radians(0.2)
    turned = outline @ np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])
    write(folder / "blade.stl", binary_stl(np.concatenate([tube(outline, np.array([0.0, 10.0])), tube(turned, np.array([10.0, 20.0]))])))
    write_spline(spline, folder / "blade.yaml")
    plan = folder / "plan.yaml"
    plan.write_text(
        "part: {name: blade}\nmesh: {file: blade.stl}\nnominal: {file: blade.yaml}\ntolerance: {lower_mm: -0.2, upper_mm: 0.2}\n"
        "sections: {heights_mm: [5, 15]}\ncut: {cutter: numpy}\nstack_fit: common\n"
        "stack_characteristics: [{name: turned, type: twist, lower_deg: -0.5, upper_deg: 0.5}]\n",
        encoding="utf-8",
    )
    return plan


def check_stack_judged_again(records: Path, stack: RunFound) -> None:
    """With a narrower limit of the stack its sections stay as they are, and it is another; of what nobody changed nothing is kept."""
    narrower = ("--set", "stack_characteristics.turned.upper_deg=0.05", "--workers", 1, "--why", "a question", "--operator", "Ada")
    with patch("cmmlink.commands.rejudge._workers", lambda *_: nullcontext(Here())):
        ended = cmmlink("rejudge", records, *narrower, "--json")
    first, second, whole = ended.json()["runs"]
    assert (ended.code, first["changed"], second["changed"], whole["run"]) == (1, False, False, stack.run)
    assert (whole["recorded"], whole["again"], whole["changed"]) == ("CONFORM", "NOT CONFORM", True)
    assert whole["characteristics"] == ["turned: conform -> nonconform"]
    assert [row["kept"] for row in (first, second, whole)] == [False, False, False]


def test_the_characteristics_of_a_stack_are_pushed_and_verified(tmp_path: Path) -> None:
    found = cmmlink("ct", blade(tmp_path), "--no-pictures", "--records", tmp_path, "--json").json()
    (turned,) = found["characteristics"]
    assert abs(turned["value"]) == pytest.approx(0.1, abs=0.02), "half of the turn on either side"
    assert push(tmp_path, today).added == 3, "two sections, and the stack"
    with ResultsDatabase(tmp_path / "plant.sqlite") as results:
        series = results.series("blade", "turned")
        (stack,) = (run for run in results.search(part="blade") if run.run == series.run[0])
    assert series.value.tolist() == [pytest.approx(turned["value"], abs=1e-9)]
    assert (series.lower.tolist(), series.upper.tolist(), series.unit) == ([-0.5], [0.5], "deg")
    assert stack.run not in {section["run"] for section in found["slices"]}
    assert (stack.verdict, stack.chain_sha256) == (found["verdict"], found["slices"][1]["chain_sha256"])
    assert verify_plant(tmp_path, today).sound
    check_stack_judged_again(tmp_path, stack)
    with sqlite3.connect(tmp_path / "plant.sqlite") as connection:
        connection.execute("UPDATE characteristic_value SET value = 0 WHERE run_id = (SELECT max(run_id) FROM characteristic_value)")
    connection.close()
    (altered,) = verify_plant(tmp_path, today).altered
    assert (altered.run, altered.what.startswith("turned: ")) == (series.run[0], True)
