"""A record survives the death of its process and a full disk: what was acknowledged is there."""

import os
import random
import shlex
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from cmmlink.demo import plan_file
from cmmlink.record.reader import list_runs, open_to_read, points_of
from tests.cmmlink.recorded import Script, record, scan_arrivals, today
from tests.integration.killed import ROOT, kill_one
from tests.integration.simulated import simulated

KILLS = 6
PLAN = """
part: {{name: part, serial_number: 7}}
nominal: {{file: {nominal}}}
tolerance: {{lower_mm: -0.05, upper_mm: 0.05}}
device: {{type: serial, address: "{address}"}}
registration: {{datum: {{rotation_deg: 0}}, coverage_min: 0}}
discretisation: {{samples: 1000}}
"""


def test_every_acknowledged_point_survives_a_kill(tmp_path: Path) -> None:
    """One station, whose file every killed process leaves to the next."""
    rng = random.Random(2)
    killed = [kill_one(tmp_path, rng) for _ in range(KILLS)]
    runs = [run for run, _ in killed if run]
    assert sum(points > 0 for _, points in killed) >= KILLS // 2
    record(tmp_path, Script(*scan_arrivals(count=120)))
    entries = list_runs(tmp_path, today)
    assert [(entry["run"], entry["state"]) for entry in entries[:-1]] == [(run, "interrupted") for run in runs]
    assert (entries[-1]["state"], entries[-1]["received"]) == ("complete", 123)


@pytest.mark.skipif(os.name != "posix", reason="file-size limits exist on POSIX systems only")
def test_a_full_disk_ends_with_exit_code_5_and_all_that_was_acknowledged(tmp_path: Path) -> None:
    """Files may grow to 1.5 MB; the scan needs that within a second or two."""
    records, plan = tmp_path / "records", tmp_path / "plan.yaml"
    with simulated("serial", "127.0.0.1:0", tmp_path, count=60_000, rate_hz=20_000) as device:
        plan.write_text(PLAN.format(nominal=plan_file().with_name("nominal.csv"), address=device.address))
        command = [sys.executable, "-m", "cmmlink", "run", str(plan), "--headless", "--records", str(records)]
        limited = ["sh", "-c", f"ulimit -f 3000; exec {shlex.join(command)}"]
        ended = subprocess.run(limited, capture_output=True, text=True, cwd=ROOT, check=False)
    assert ended.returncode == 5, ended.stderr
    *notes, message = ended.stderr.splitlines()
    assert all("compiling" in note for note in notes)
    assert "so it has no result" in message
    assert "--records DIR" in message
    acknowledged = int(message.split(" points are safe")[0].rpartition(" ")[2])
    (entry,) = list_runs(records, today)
    assert (entry["state"], entry["serial_number"]) == ("interrupted", "7")
    with open_to_read(records, today) as store:
        sequence = np.concatenate([batch.sequence for batch in points_of(store, entry["run"])])
        assert store.first_alteration()[0] is None
    assert acknowledged == len(sequence) == entry["received"] > 1000
    np.testing.assert_array_equal(sequence, np.arange(len(sequence)))
