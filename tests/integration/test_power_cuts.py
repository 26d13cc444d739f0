"""What was acknowledged is there after a power cut, whatever the disk had not yet written; `make powercuts` cuts more often."""

import random
from pathlib import Path

import pytest

from cmmlink.record.store import Store
from tests.integration.power_cuts import cut_often, library, trace_of_a_run, trace_of_records

pytestmark = pytest.mark.skipif(library() is None, reason="Python's SQLite cannot be watched here")
CUTS = 25


def test_a_station_keeps_every_record_that_was_said_to_be_safe(tmp_path: Path) -> None:
    rng = random.Random(3)
    assert not cut_often(trace_of_records(tmp_path, rng, appends=6), CUTS, rng)


def test_a_run_keeps_every_point_that_was_said_to_be_safe(tmp_path: Path) -> None:
    assert not cut_often(trace_of_a_run(tmp_path), CUTS, random.Random(4))


def test_a_record_that_is_not_synchronised_is_found_wanting(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The cuts are worth something: without synchronisation they lose records and break files."""
    durable = Store._be_durable

    def careless(store: Store) -> None:
        durable(store)
        store._connection.execute("PRAGMA synchronous = OFF")

    monkeypatch.setattr(Store, "_be_durable", careless)
    rng = random.Random(5)
    trace = trace_of_records(tmp_path, rng, appends=6)
    monkeypatch.undo()
    assert len(cut_often(trace, CUTS, rng)) >= CUTS // 5
