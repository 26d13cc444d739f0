"""A recorded run gives its result again, bit for bit, whatever went wrong on the line; on another machine too."""

import json
import os
import shutil
import subprocess
import sys
import threading
from copy import deepcopy
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cmmlink.demo import part_path
from cmmlink.events import Arrived, Event, RunFinished
from cmmlink.record.export import export_run
from cmmlink.record.reader import open_to_read, recorded_run
from cmmlink.record.recorder import result_sha256
from cmmlink.record.replay import Replay, replay_run
from drivers.codecs.ascii_frames import AsciiDecoder
from drivers.links.link_settings import LinkSettings
from drivers.links.serial_scanner import SerialScanner
from drivers.source import PointBatch
from inspection import Verdict
from tests.cmmlink.recorded import Script, decoder_of, no_decoder, record, scan_arrivals, small_profile, today
from tests.integration.killed import ROOT
from tests.integration.simulated import simulated

COUNT = 500
SCATTERED = ["flip:0.002@10", "lost-bytes:0.001", "inserted-bytes:0.001"]
FAULTS: list[list[str]] = [
    [],
    ["flip:0.001"],
    ["flip:0.01@5"],
    ["lost-bytes:0.002"],
    ["inserted-bytes:0.002"],
    ["burst:300@250"],
    ["burst:900@100"],
    ["lost-frames:0.05"],
    ["repeated-frames:0.05"],
    ["reordered-frames:0.05"],
    ["invalid:0.1"],
    ["gap:60@200"],
    ["stall:0.3@250"],
    ["silence:9@400"],
    ["die@350"],
    ["unplug:0.2@300"],
    ["unplug:0.2@300", "flip:0.005"],
    ["lost-frames:0.02", "repeated-frames:0.02", "reordered-frames:0.02", "flip:0.002", "invalid:0.02"],
    [*SCATTERED, "gap:30@300"],
    [*SCATTERED, "die@300"],
]
OTHER_MACHINE = {
    "OPENBLAS_CORETYPE": "Nehalem",
    "OPENBLAS_NUM_THREADS": "1",
    "NPY_DISABLE_CPU_FEATURES": "X86_V3 X86_V4 AVX512_ICL",
    "GLIBC_TUNABLES": "glibc.cpu.hwcaps=-FMA,-AVX2,-AVX512F",
    "LC_ALL": "de_DE.UTF-8",
    "LANG": "de_DE.UTF-8",
    "TZ": "Pacific/Chatham",
    "PYTHONHASHSEED": "19",
}


def recorded_scan(folder: Path, *faults: str, stop: threading.Event | None = None, abort_at: int | None = None) -> str:
    """Record one scan of the simulated device; gives the run's id."""
    points = 0

    def abort(event: Event) -> None:
        nonlocal points
        points += len(event.arrival) if isinstance(event, Arrived) and isinstance(event.arrival, PointBatch) else 0
        if stop is not None and abort_at is not None and points >= abort_at:
            stop.set()

    path = part_path(small_profile().curve, 2000)
    if abort_at is not None:
        faults = (*faults, f"stall:30@{abort_at}")  # the operator does not wait for the end of it
    options = ["--tip-radius-mm", "1", "--rotation-deg", "30", *(f"--fault={fault}" for fault in faults)]
    folder.mkdir(exist_ok=True)
    with simulated("serial", "127.0.0.1:0", folder, *options, count=COUNT, path_mm=path) as device:
        silence_s = 2.0 if "silence" in str(faults) else 60.0  # what else goes wrong ends by itself, on a busy machine late
        settings = LinkSettings(115_200, "N", silence_s, reconnect_s=30.0 if "unplug" in str(faults) else 0.0)
        source = SerialScanner(device.address, AsciiDecoder(), settings)
        outcome, recorder = record(folder, source, stop=stop, before=[abort])
    ending = (
        "aborted"
        if stop is not None
        else "interrupted"
        if {"die", "silence"} & {fault[:7].split("@")[0] for fault in faults}
        else "complete"
    )
    assert outcome.ending == ending
    assert outcome.result is not None
    return recorder.run


def replayed(folder: Path, run: str, **changes: object) -> Replay:
    with open_to_read(folder, today) as store:
        return replay_run(store, recorded_run(store, run), decoder_of, **changes)  # type: ignore[arg-type]


@pytest.mark.parametrize("faults", FAULTS, ids=" ".join)
def test_nothing_changed_is_identical(faults: list[str], tmp_path: Path) -> None:
    run = recorded_scan(tmp_path, *faults)
    again = replayed(tmp_path, run)
    assert again.identical is True
    assert (again.changed, again.differs) == ((), ())
    with open_to_read(tmp_path, today) as store:
        recorded = recorded_run(store, run)
    assert recorded.result == again.result_json
    assert recorded.end is not None
    assert again.outcome.ending == recorded.end["state"]


def test_an_aborted_run_is_replayed_as_one(tmp_path: Path) -> None:
    run = recorded_scan(tmp_path, stop=threading.Event(), abort_at=400)
    again = replayed(tmp_path, run)
    assert again.identical is True
    assert again.outcome.ending == "aborted"
    assert again.outcome.counts.received == 400


def test_a_run_cut_off_before_its_result_is_evaluated_from_what_was_kept(tmp_path: Path) -> None:
    def failing(event: Event) -> None:
        if isinstance(event, RunFinished):
            raise RuntimeError("a defect")

    with pytest.raises(RuntimeError):
        record(tmp_path, Script(*scan_arrivals()), before=[failing])
    with open_to_read(tmp_path, today) as store:
        (begin, _), *_ = store.begins_and_ends()
        again = replay_run(store, recorded_run(store, begin.run), no_decoder)
    assert again.identical is None
    assert again.outcome.ending == "interrupted"
    assert (again.result_json["received"], again.result_json["complete"], again.result_json["verdict"]) == (612, False, "uncertain")


def test_points_are_replayed_where_there_are_no_wire_bytes(tmp_path: Path) -> None:
    _, recorder = record(tmp_path, Script(*scan_arrivals()))
    with open_to_read(tmp_path, today) as store:
        again = replay_run(store, recorded_run(store, recorder.run), no_decoder)
    assert again.identical is True
    assert (again.outcome.counts.rejected, again.outcome.counts.lost) == (12, 3)


def test_another_tolerance_is_a_new_evaluation_that_says_so(tmp_path: Path) -> None:
    run = recorded_scan(tmp_path)
    again = replayed(tmp_path, run, tolerance=(-0.001, 0.001))
    assert again.identical is False
    assert [(change.key, change.replayed) for change in again.changed] == [("tolerance.lower_mm", -0.001), ("tolerance.upper_mm", 0.001)]
    assert again.outcome.result is not None
    assert again.outcome.result.verdict is Verdict.NONCONFORM
    assert {"verdict", "out_of_tolerance"} <= {change.key for change in again.differs}
    deviations = {"max_deviation_mm", "min_deviation_mm", "rms_mm", "registration.rotation_deg"}
    assert not deviations & {change.key for change in again.differs}


def test_another_method_is_a_new_evaluation_that_says_so(tmp_path: Path) -> None:
    again = replayed(tmp_path, recorded_scan(tmp_path), method="pcp")
    assert again.identical is False
    assert [(change.key, change.recorded, change.replayed) for change in again.changed] == [("registration.method", "exact", "pcp")]
    assert ("method", "exact", "pcp") in [(change.key, change.recorded, change.replayed) for change in again.differs]


def test_the_recorded_nominal_counts_not_the_file_of_that_name_today(tmp_path: Path) -> None:
    run = recorded_scan(tmp_path)
    with open_to_read(tmp_path, today) as store:
        recorded = recorded_run(store, run)
        moved = recorded.plan.replace("nominal.csv", "gone.csv")
        assert moved != recorded.plan
        again = replay_run(store, type(recorded)(recorded.header, moved, recorded.nominal, recorded.end, recorded.result, ""), decoder_of)
    assert again.identical is True


def test_what_a_later_version_tells_as_well_is_no_difference(tmp_path: Path) -> None:
    run = recorded_scan(tmp_path)
    with open_to_read(tmp_path, today) as store:
        recorded = recorded_run(store, run)
        rows = [record.body for record in store.records(run, "deviations")]

        def replayed_with(result: dict[str, Any]) -> Replay:
            """Replay as if the version of that day had written this result."""
            end = {**(recorded.end or {}), "result_sha256": result_sha256(result, rows)}
            return replay_run(store, replace(recorded, result=result, end=end), decoder_of)

        assert recorded.result is not None
        told = deepcopy(recorded.result)
        del told["coverage"], told["characteristics"][0]["fit"]
        again = replayed_with(told)
        assert again.identical is True
        assert again.differs == ()
        told["characteristics"][0]["value"] = np.nextafter(told["characteristics"][0]["value"], 1.0)
        again = replayed_with(told)
        assert again.identical is False
        assert [change.key for change in again.differs] == ["characteristics[0].value"]


def test_replay_on_another_machine_is_identical(tmp_path: Path) -> None:
    """An export alone, in another folder of a station without records, elsewhere in the world, on a processor without this one's vector
    instructions (as far as the libraries go)."""
    run = recorded_scan(tmp_path / "here", *SCATTERED, "lost-frames:0.1", "die@450")
    with open_to_read(tmp_path / "here", today) as store:
        export_run(store, run, tmp_path / "there" / "evidence")
        (end,) = store.records(run, "end")
    shutil.rmtree(tmp_path / "here")
    command = [sys.executable, "-m", "cmmlink", "replay", "./evidence", "--records", "none", "--json"]
    environment = os.environ | OTHER_MACHINE | {"PYTHONPATH": str(ROOT)}
    ended = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path / "there", env=environment, check=False)
    told = json.loads(ended.stdout)
    assert told["identical"] is True, told["differs"]
    assert told["result_sha256"] == json.loads(end.body)["result_sha256"]
    assert told["changed"] == []
    assert told["lost"] > 0
    assert np.isfinite(told["rms_mm"])
    assert [file.name for file in (tmp_path / "there").iterdir()] == ["evidence"]
