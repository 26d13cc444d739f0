"""A plan carried out on a simulated device with every fault of the line: no wrong point, no wrong count."""

import csv
from contextlib import AbstractContextManager
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from tests.cmmlink.command import cmmlink
from tests.cmmlink.oval_part import LENGTH_MM, oval_points, write_nominal
from tests.integration.simulated import RATE_HZ, Simulated, simulated

COUNT = 800
PLAN = """\
part: {name: oval}
nominal: {file: oval.yaml}
tolerance: {lower_mm: -0.1, upper_mm: 0.1}
device: {type: serial, address: "ADDRESS", silence_s: 20}
registration: {datum: {}, coverage_min: 0.5}
discretisation: {samples: 400}
out: found
"""


def scanning(folder: Path, *faults: str) -> AbstractContextManager[Simulated]:
    """A device that goes once around the oval, as fast as its points are taken."""
    told = ["--unpaced", *(f"--fault={fault}" for fault in faults)]
    speed_mm_s = LENGTH_MM * RATE_HZ / COUNT
    return simulated("serial", "127.0.0.1:0", folder, *told, count=COUNT, speed_mm_s=speed_mm_s, path_mm=oval_points(0.0))


def planned(folder: Path, device: Simulated) -> Path:
    write_nominal(folder / "oval.yaml")
    plan = folder / "plan.yaml"
    plan.write_text(PLAN.replace("ADDRESS", device.address), encoding="utf-8")
    return plan


def points_of(folder: Path) -> NDArray[np.float64]:
    """Actual points (m, 2) of the judged rows, which in a datum are the points as they were sent."""
    with (folder / "found" / "deviations.csv").open(newline="", encoding="utf-8") as file:
        return np.array([(float(row["x_mm"]), float(row["y_mm"])) for row in csv.DictReader(file) if row["x_mm"]])


def sent_rows(found_mm: NDArray[np.float64], sent_mm: NDArray[np.float64]) -> NDArray[np.int64]:
    """Which sent point each found one is; a point that was never sent fails."""
    distance = np.abs(found_mm[:, None, :] - sent_mm[None, :, :2]).max(axis=2)
    assert distance.min(axis=1).max() < 2e-6
    return np.asarray(distance.argmin(axis=1), dtype=np.int64)


FAULTS = [
    ("flip:0.0005@10",),
    ("flip:0.005@10",),
    ("lost-bytes:0.001@10",),
    ("inserted-bytes:0.001@10",),
    ("lost-frames:0.05",),
    ("repeated-frames:0.05",),
    ("reordered-frames:0.05",),
    ("invalid:0.05",),
    ("gap:50@300", "burst:300@500", "flip:0.001@10", "invalid:0.02"),
]


@pytest.mark.parametrize("faults", FAULTS, ids="+".join)
def test_no_fault_of_the_line_makes_a_wrong_point_or_a_wrong_count(faults: tuple[str, ...], tmp_path: Path) -> None:
    with scanning(tmp_path, *faults) as device:
        facts = cmmlink("run", planned(tmp_path, device), "--headless", "--json").json()
        tally = device.tally()
    rows = sent_rows(points_of(tmp_path), device.sent_mm)
    assert len(set(rows.tolist())) == len(rows) == facts["judged"]
    reasons = facts["rejected_by_reason"]
    invalid, repeated = reasons.get("marked invalid by the device", 0), reasons.get("frame repeated", 0)
    assert facts["received"] == facts["judged"] + facts["rejected"] == facts["judged"] + invalid + repeated
    assert facts["lost"] == COUNT - facts["judged"] - invalid  # what the sequence numbers say
    assert facts["complete"] is True
    assert sum(tally[fault.partition(":")[0]] for fault in faults) > 0
    if "reordered-frames:0.05" not in faults:
        assert np.all(np.diff(rows) > 0)
    if tally.get("invalid"):
        assert 0 < invalid <= tally["invalid"]
    if "lost-frames:0.05" in faults:
        assert facts["lost"] == tally["lost-frames"]
    if "repeated-frames:0.05" in faults:
        assert (facts["lost"], repeated) == (0, tally["repeated-frames"])
    if "reordered-frames:0.05" in faults:
        assert (facts["lost"], facts["judged"]) == (0, COUNT)


def test_a_device_that_dies_half_way_gives_exit_code_4_and_no_proof(tmp_path: Path) -> None:
    with scanning(tmp_path, "die@600") as device:
        ended = cmmlink("run", planned(tmp_path, device), "--headless", "--json")
    assert ended.failed(4).startswith(f"{device.address}: the link was lost")
    facts = ended.json()
    assert (facts["verdict"], facts["complete"]) == ("uncertain", False)
    assert 0 < facts["received"] == facts["judged"] <= 600
    rows = sent_rows(points_of(tmp_path), device.sent_mm)
    assert rows.tolist() == list(range(len(rows)))
