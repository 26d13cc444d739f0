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


def test_an_old_record_is_judged_again_to_the_same_result(records: Path) -> None:
    """To the last bit by the software of that day; by other versions of the libraries, within their round-off."""
    with open_to_read(records, today) as store:
        recorded = recorded_run(store, find_run(store, "last"))
        again = replay_run(store, recorded, decoder_of)
    if not again.changed:
        assert again.identical
    for change in again.differs:
        if change.key != "deviations":
            assert change.replayed == pytest.approx(change.recorded, rel=1e-9, abs=1e-9), change
    assert recorded.result is not None
    assert set(again.result_json) >= set(recorded.result)
