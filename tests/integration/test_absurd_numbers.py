"""No number from a device costs memory or time out of proportion: scans of 1,000 points, in a process of their own.

The numbers come at the beginning of a scan and now and then; the module of the scans tries every place when asked for `everywhere`.
"""

import subprocess
import sys
from pathlib import Path

import pytest

from inspection import rehearse
from tests.integration.absurd_numbers import COUNT, part

MOST_MB, MOST_TIMES = 300.0, 12.0  # of processor time, as many times as a scan takes that is as it should be: it took four


@pytest.mark.skipif(sys.platform == "win32", reason="the peak of memory is asked of POSIX")
def test_no_number_from_a_device_takes_memory_or_time() -> None:
    rehearse(part()[0])  # what is compiled here takes no memory there
    module = [sys.executable, "-W", "error", "-m", "tests.integration.absurd_numbers"]
    told = subprocess.run(module, cwd=Path(__file__).resolve().parents[2], check=True, stdout=subprocess.PIPE, text=True).stdout
    scans = [line.split(maxsplit=5) for line in told.splitlines()]
    assert len(scans) == 10
    most_s = MOST_TIMES * next(float(cost_s) for cost_s, *_, name in scans if name.strip() == "as it should be")
    assert [name for cost_s, peak_mb, *_, name in scans if float(cost_s) > most_s or float(peak_mb) > MOST_MB] == []
    assert all(int(received) == int(judged) + int(rejected) for _, _, received, judged, rejected, _ in scans)
    judged = {name.strip(): int(count) for _, _, _, count, _, name in scans}
    assert judged["as it should be"] == COUNT
    assert judged["1e9, every tenth"] == judged["3.4e38, every tenth"] == judged["NaN, every tenth"] == COUNT - COUNT // 10
