"""`cmmlink run` with simulated devices from plan to exit code: every point is accounted for."""

import dataclasses
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from cmmlink.devices import decoder_of
from cmmlink.errors import StoreError
from cmmlink.record.reader import open_to_read, recorded_run
from cmmlink.record.replay import replay_run
from tests.cmmlink.command import cmmlink
from tests.cmmlink.recorded import Script, record, scan_arrivals, today
from tests.integration.simulated import Simulated, simulated

ROOT = Path(__file__).resolve().parents[2]
TURN = np.linspace(0.0, 2.0 * np.pi, 4001)
PART_MM = np.column_stack([40.0 * np.cos(TURN) + 4.0 * np.cos(2.0 * TURN), 15.0 * np.sin(TURN)])
COUNT = 2000

PLAN = """\
part: {{name: oval}}
nominal: {{file: nominal.csv, closed: true}}
tolerance: {{lower_mm: -0.05, upper_mm: 0.05}}
device: {device}
out: null
discretisation: {{samples: 1000}}
"""


def run(folder: Path, device: str, *options: str) -> tuple[int, dict[str, Any], str]:
    np.savetxt(folder / "nominal.csv", PART_MM[::20], delimiter=",")
    plan = folder / "plan.yaml"
    plan.write_text(PLAN.format(device=device), encoding="utf-8")
    done = cmmlink("run", plan, "--json", *options)
    assert done.out, done.err
    return done.code, done.json(), done.err


def scanned_oval(folder: Path, *options: str, name: str = "modbus-ring") -> AbstractContextManager[Simulated]:
    return simulated(name, "127.0.0.1:0", folder, *options, path_mm=PART_MM, count=COUNT, speed_mm_s=200.0, noise_mm=0.001)


@pytest.mark.parametrize(
    ("name", "settings"),
    [
        ("serial", "type: serial"),
        ("binary", "type: serial, format: binary"),
        ("binary-block", "type: serial, format: binary"),
        ("modbus-ring", "type: modbus, map: generic-ring"),
        ("modbus-fifo", "type: modbus, map: generic-fifo"),
    ],
)
def test_a_conforming_part_is_found_to_conform(name: str, settings: str, tmp_path: Path) -> None:
    with scanned_oval(tmp_path, "--unpaced", name=name) as device:
        code, facts, errors = run(tmp_path, f"{{{settings}, address: '{device.address}'}}")
    assert (code, facts["verdict"]) == (0, "conform"), errors
    assert (facts["received"], facts["judged"], facts["rejected"], facts["lost"]) == (COUNT, COUNT, 0, 0)


def test_losses_and_rejections_stand_in_the_result(tmp_path: Path) -> None:
    faults = ["--unpaced", "--fault=lost-frames:0.02", "--fault=invalid:0.02", "--fault=sentinel:0.02", "--fault=unplug:0.1@500"]
    with simulated(
        "modbus-ring", "127.0.0.1:0", tmp_path, *faults, path_mm=PART_MM, count=COUNT, speed_mm_s=200.0, noise_mm=0.001
    ) as device:
        code, facts, errors = run(tmp_path, f"{{type: modbus, map: generic-ring, address: '{device.address}', reconnect_s: 20}}")
        tally = device.tally()
    assert code == 3, errors  # what was lost was not seen
    assert [reason["kind"] for reason in facts["reasons"]] == ["missing", "rejected"]
    assert facts["lost"] == tally["lost-frames"] > 0
    assert facts["rejected"] > 0
    assert facts["received"] == facts["judged"] + facts["rejected"] == COUNT - facts["lost"]


def test_a_device_that_dies_half_way_ends_with_code_4_and_what_was_received(tmp_path: Path) -> None:
    with simulated(
        "modbus-ring", "127.0.0.1:0", tmp_path, "--unpaced", "--fault=die@1000", path_mm=PART_MM, count=COUNT, speed_mm_s=200.0
    ) as device:
        code, facts, errors = run(tmp_path, f"{{type: modbus, map: generic-ring, address: '{device.address}'}}")
    assert code == 4
    assert "the link was lost" in errors
    assert 0 < facts["received"] < COUNT


def test_a_replay_reads_registers_as_the_map_of_that_day_told(tmp_path: Path) -> None:
    shipped = (ROOT / "drivers" / "maps" / "generic-ring.yaml").read_text(encoding="utf-8")
    own = tmp_path / "mine.yaml"
    own.write_text(shipped, encoding="utf-8")
    with scanned_oval(tmp_path, "--unpaced") as device:
        code, facts, errors = run(tmp_path, f"{{type: modbus, map: mine.yaml, address: '{device.address}'}}", "--records", str(tmp_path))
    assert (code, facts["received"]) == (0, COUNT), errors
    for changed in (shipped.replace("1.0e-5", "2.0e-5"), "no map any more"):
        own.write_text(changed, encoding="utf-8")
        again = cmmlink("replay", facts["run"], "--records", tmp_path, "--json")
        assert again.code == 0, again.err
        assert again.json()["identical"] is True


def test_a_map_without_a_suffix_lies_beside_the_plan_and_is_replayed_without_it(tmp_path: Path) -> None:
    own = tmp_path / "mymap"
    own.write_text((ROOT / "drivers" / "maps" / "generic-ring.yaml").read_text(encoding="utf-8"), encoding="utf-8")
    with scanned_oval(tmp_path, "--unpaced") as device:
        code, facts, errors = run(tmp_path, f"{{type: modbus, map: mymap, address: '{device.address}'}}", "--records", str(tmp_path))
    assert (code, facts["received"]) == (0, COUNT), errors
    own.unlink()
    again = cmmlink("replay", facts["run"], "--records", tmp_path, "--json")
    assert again.code == 0, again.err
    assert again.json()["identical"] is True


def test_a_map_in_a_record_that_cannot_be_read_is_named_with_its_run(tmp_path: Path) -> None:
    """Records of earlier versions hold the map as its file spelt it, and a plan may name a file that is gone."""
    _, recorder = record(tmp_path, Script(*scan_arrivals()))
    with open_to_read(tmp_path, today) as store:
        recorded = recorded_run(store, recorder.run)
        tree = yaml.safe_load(recorded.plan)
        points = {"at": 0, "fields": {"x": {"at": 0, "type": "int16", "scale": "true"}}}
        for register_map in ({"device": "d", "pattern": "latest", "points": points}, str(tmp_path / "gone")):
            tree["device"] = {"type": "modbus", "address": "h:502", "map": register_map}
            with pytest.raises(StoreError, match=f"the device in the plan of run {recorder.run} cannot be read"):
                replay_run(store, dataclasses.replace(recorded, plan=yaml.safe_dump(tree)), decoder_of)


def test_a_map_with_a_mistake_is_named_with_its_file(tmp_path: Path) -> None:
    (tmp_path / "mine.yaml").write_text(
        "device: mine\npattern: newest\npoints: {at: 0, fields: {x: {at: 0, type: int16}}}\n", encoding="utf-8"
    )
    np.savetxt(tmp_path / "nominal.csv", PART_MM[::20], delimiter=",")
    plan = tmp_path / "plan.yaml"
    plan.write_text(PLAN.format(device="{type: modbus, map: mine.yaml, address: '127.0.0.1:1'}"), encoding="utf-8")
    mine, said = tmp_path / "mine.yaml", cmmlink("check", plan).refused()
    assert f"plan.yaml: line 4: device: {mine}: line 2: pattern is 'newest'; expected 'latest', 'ring', 'queue' or 'fifo'" in said
