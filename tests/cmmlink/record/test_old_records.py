"""A record that version 0.1.0 wrote: unaltered, read, and judged again to the same result.

tests/data/record-0.1.0 is what `cmmlink demo --headless --seed 5 --defect 0.12@40` recorded, its 4,000 points cut to 400, before
the application was divided into its present rooms.
"""

import shutil
from pathlib import Path

import pytest

from cmmlink.devices import decoder_of
from cmmlink.record import check_chain, describe, find_run, open_to_read, recorded_run, replay_run
from tests.cmmlink.recorded import today

RECORD = Path(__file__).resolve().parents[2] / "data" / "record-0.1.0"
CHAIN_SHA256 = "f7185cdd10fc593f678678e6ff055778ff4ee071176a380b7c6591c0cd9ecc5a"


@pytest.fixture
def records(tmp_path: Path) -> Path:
    return Path(shutil.copytree(RECORD, tmp_path / "records"))


def test_the_chain_of_an_old_record_still_fits(records: Path) -> None:
    with open_to_read(records, today) as store:
        checked = check_chain(store, None)
    assert (checked["altered"], checked["records"], checked["chain_sha256"]) == (False, 16, CHAIN_SHA256)


def test_an_old_record_is_read_whole(records: Path) -> None:
    with open_to_read(records, today) as store:
        found = describe(store, find_run(store, "last"))
    assert (found["state"], found["part"], found["serial_number"], found["verdict"]) == (
        "complete",
        "NACA 4512 section",
        "DEMO-1",
        "nonconform",
    )
    assert (found["recorded"]["points"], found["received"], found["recorded"]["wire_bytes"]) == (400, 400, 21028)
    assert found["result"]["worst"]["deviation_mm"] == pytest.approx(0.1262, abs=5e-5)


def test_an_old_record_is_judged_again_by_the_rules_of_today(records: Path) -> None:
    """The same points get the same verdict; the pose moves by what arc-length weights change, and the keys of today are added."""
    with open_to_read(records, today) as store:
        recorded = recorded_run(store, find_run(store, "last"))
        again = replay_run(store, recorded, decoder_of)
    assert recorded.result is not None
    for key in ("verdict", "received", "judged", "rejected", "lost", "method", "fit"):
        assert again.result_json[key] == recorded.result[key], key
    for key in ("max_deviation_mm", "min_deviation_mm", "rms_mm"):
        assert again.result_json[key] == pytest.approx(recorded.result[key], abs=2e-3), key
    assert set(again.result_json) >= set(recorded.result)
