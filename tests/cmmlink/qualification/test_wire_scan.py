"""The scan from the wire to the verdict: outside its limits when a point is lost or moved. The command's test has it sound."""

from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from cmmlink.devices import source_of
from cmmlink.plan import Plan
from cmmlink.qualification import wire
from cmmlink.qualification.budget import ARRIVED, LOST, WIRE_DEVIATION, WIRE_VERDICTS, Quantity
from cmmlink.qualification.wire import WireToVerdict, scan_on_the_wire
from drivers import Arrival, PointBatch, ScanSource

POINTS = 600
Change = Callable[[Iterator[Arrival]], Iterator[Arrival]]


def _outside(done: WireToVerdict) -> set[Quantity]:
    return {error.quantity for error in done.errors if not error.error <= error.quantity.limit}


class _Changed:
    """A source between which and the run something happens to what arrives."""

    def __init__(self, source: ScanSource, change: Change) -> None:
        self._source, self._change = source, change
        self.stop = source.stop

    def arrivals(self) -> Iterator[Arrival]:
        yield from self._change(self._source.arrivals())


def _move(arrivals: Iterator[Arrival]) -> Iterator[Arrival]:
    """Move every point by ten nanometres."""
    for one in arrivals:
        yield replace(one, points_mm=one.points_mm + np.array([1e-5, 0, 0])) if isinstance(one, PointBatch) else one


def _drop_a_point(arrivals: Iterator[Arrival]) -> Iterator[Arrival]:
    """Drop the last point of the first batch, in silence."""
    dropped = False
    for one in arrivals:
        if isinstance(one, PointBatch) and not dropped:
            dropped = True
            if len(one) > 1:
                yield PointBatch(one.sequence[:-1].copy(), one.time_s[:-1].copy(), one.points_mm[:-1].copy())
            continue
        yield one


def test_the_truth_crosses_both_limits() -> None:
    _, deviation = wire._sent(POINTS)
    assert POINTS / 8 < np.count_nonzero(deviation > wire._LIMIT_MM) < POINTS / 2
    assert POINTS / 8 < np.count_nonzero(deviation < -wire._LIMIT_MM) < POINTS / 2


@pytest.mark.parametrize(("change", "expected"), [(_move, {ARRIVED}), (_drop_a_point, {LOST, ARRIVED, WIRE_DEVIATION, WIRE_VERDICTS})])
def test_a_line_that_changes_what_it_carries_does_not_qualify(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, change: Change, expected: set[Quantity]
) -> None:
    def changed(plan: Plan) -> ScanSource:
        return _Changed(source_of(plan), change)

    monkeypatch.setattr(wire, "source_of", changed)
    assert _outside(scan_on_the_wire(tmp_path, POINTS)) >= expected


def test_a_device_that_does_not_start_is_told_and_does_not_qualify(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(*_: object) -> None:
        raise OSError("no process can be started")

    monkeypatch.setattr(wire, "simulated_device", fail)
    done = scan_on_the_wire(tmp_path, POINTS)
    assert len(_outside(done)) == 4
    assert {error.problem for error in done.errors} == {"wire: no process can be started"}
    assert done.document()["latency_ms"] is None
