"""Sections of a surface on record: each is a run like any other, and names its stack."""

import hashlib
import json
from pathlib import Path
from threading import Event

import numpy as np
import pytest
from scipy.interpolate import BSpline

from cmmlink.errors import StoreError
from cmmlink.record import FILE_NAME, Store
from cmmlink.result_keys import RunLine, Shown
from cmmlink.stack import inspect_stack
from tests.cmmlink.blade import plan_of
from tests.cmmlink.command import Ended, cmmlink
from tests.drivers.surface.ct_phantom import write_spline
from tests.drivers.surface.meshes import binary_stl, box, tube, write


@pytest.fixture
def told(tmp_path: Path, spline: BSpline) -> tuple[Path, Path, Ended]:
    """A stack of three sections, the last of them a pin that is no blade; the records, the surface, and what `ct` said."""
    outline = tube(spline(np.linspace(0, 1, 600)), np.array([0.0, 10.0]))
    mesh = write(tmp_path / "blade.stl", binary_stl(np.concatenate([outline, box((20, 0.5, 12), (23, 3.5, 20))])))
    nominal, records = write_spline(spline, tmp_path / "n.yaml"), tmp_path / "records"
    axis = ("--normal", 0.011, 0.007, 1.0)  # a plane whose numbers are not round
    options = ("--nominal", nominal, "--tolerance", -0.3, 0.3, "--heights", 5, 7.3, 16, *axis, "--cutter", "numpy")
    return records, mesh, cmmlink("ct", mesh, *options, "--records", records, "--json")


def test_every_section_is_a_run_that_names_its_stack(told: tuple[Path, Path, Ended]) -> None:
    records, mesh, ended = told
    slices = ended.json()["slices"]
    runs = [RunLine.model_validate(run) for run in cmmlink("runs", "--records", records, "--json").json()["runs"]]
    assert [run.run for run in runs] == [cut["run"] for cut in slices]
    assert [run.verdict for run in runs] == ["conform", "conform", None]
    places = [run.stack for run in runs]
    assert len({place.stack for place in places if place}) == 1
    assert [(place.section, place.sections, place.asked_height_mm) for place in places if place] == [(1, 3, 5.0), (2, 3, 7.3), (3, 3, 16.0)]
    assert {place.surface_sha256 for place in places if place} == {hashlib.sha256(mesh.read_bytes()).hexdigest()}
    words = cmmlink("runs", "--records", records).out.splitlines()
    assert "  CONFORM  " in words[0]
    assert words[0].endswith("blade section 1 of 3 at 5.000 mm")
    assert "NOT MEASURED" in words[2]


def test_a_section_on_record_gives_the_same_result_to_the_last_bit(told: tuple[Path, Path, Ended], tmp_path: Path) -> None:
    records, mesh, ended = told
    slices = ended.json()["slices"]
    mesh.unlink()  # the record needs neither the surface nor the nominal
    (tmp_path / "n.yaml").unlink()
    for cut, code in zip(slices, (0, 0, 2), strict=True):
        again = cmmlink("replay", cut["run"], "--records", records, "--json")
        facts = again.json()
        assert (again.code, facts["identical"], facts["chain_sha256"]) == (code, True, cut["chain_sha256"])
        assert {key: facts[key] for key in ("worst", "registration", "coverage", "reasons", "received")} == {
            key: cut[key] for key in ("worst", "registration", "coverage", "reasons", "received")
        }
        assert cmmlink("verify", cut["run"], "--records", records).code == 0
    shown = Shown.model_validate(cmmlink("show", slices[1]["run"], "--records", records, "--json").json())
    assert shown.stack is not None
    assert "heights_mm:" in shown.stack.plan
    assert shown.recorded.points == slices[1]["received"]
    cmmlink("export", slices[1]["run"], "--records", records, "--out", tmp_path / "out")
    assert len(np.load(tmp_path / "out" / "points.npy")) == slices[1]["received"]
    assert json.loads((tmp_path / "out" / "result.json").read_text())["worst"] == slices[1]["worst"]
    refused = cmmlink("show", "last", "--records", records, "--json").json()
    assert (refused["verdict"], refused["result"], refused["recorded"]["points"]) == (None, None, 0)
    assert refused["message"] in slices[2]["warnings"]
    assert refused["events"][1]["count"] == slices[2]["received"]


def test_a_doubt_about_the_outline_is_on_record_and_in_the_replay(tmp_path: Path, spline: BSpline) -> None:
    outline = spline(np.linspace(0, 1, 600))
    bad = outline + np.array([0.0, 100.0])
    bad[100:140, 1] += 0.5 * np.sin(np.linspace(0, np.pi, 40))
    both = np.concatenate([tube(ring, np.array([0.0, 20.0])) for ring in (outline, bad)])
    mesh, nominal = write(tmp_path / "two.stl", binary_stl(both)), write_spline(spline, tmp_path / "n.yaml")
    options = ("--nominal", nominal, "--tolerance", -0.1, 0.1, "--heights", 5, "--cutter", "numpy", "--records", tmp_path / "records")
    (cut,) = cmmlink("ct", mesh, *options, "--json").json()["slices"]
    again = cmmlink("replay", "last", "--records", tmp_path / "records", "--json").json()
    assert (cut["verdict"], cut["reasons"][0]["kind"]) == ("uncertain", "outline")
    assert (again["identical"], again["reasons"]) == (True, cut["reasons"])


def test_a_stack_is_not_recorded_where_that_is_asked_and_not_inspected_where_it_cannot_be(
    blade: tuple[Path, Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    options = ("--nominal", blade[1], "--tolerance", -0.1, 0.1, "--heights", 5, "--cutter", "numpy", "--records", tmp_path / "records")
    (cut,) = cmmlink("ct", blade[0], *options, "--no-record", "--json").json()["slices"]
    assert (cut["run"], cut["chain_sha256"]) == (None, None)
    assert not (tmp_path / "records" / FILE_NAME).exists()

    def refuse(*_: object) -> None:
        raise StoreError("no space left on the device")

    monkeypatch.setattr(Store, "append", refuse)
    assert "no space left on the device" in cmmlink("ct", blade[0], *options).failed(5)
    with pytest.raises(StoreError):
        inspect_stack(plan_of(*blade, {"heights_mm": (5.0,)}), clock=lambda: 0.0, stop=Event(), records=tmp_path / "records")
