"""Sections evaluated beforehand by other processes: the same result to the last bit, whatever becomes of the processes."""

import pickle
import threading
from collections.abc import Iterator
from concurrent.futures import Future
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.interpolate import BSpline

from cmmlink import foresight
from cmmlink.foresight import Foresight, look_ahead
from cmmlink.other_processes import OtherProcesses, _Process
from cmmlink.plan import CtPlan
from cmmlink.record import make_key
from cmmlink.stack import SectionOutcome, StackOutcome, inspect_stack
from tests.cmmlink.blade import plan_of
from tests.drivers.surface.ct_phantom import write_spline
from tests.drivers.surface.meshes import binary_stl, box, tube, write

HEIGHTS = (2.0, 5.0, 9.0, 12.0, 15.0, 30.0)  # at the last one is only a pin, which is no blade
ASKED: list[dict[str, object]] = [
    {"name": "form", "type": "line-profile", "zone": {"width_mm": 0.2}, "fit": "minimum-zone"},
    {"name": "chord", "type": "chord", "lower_mm": -0.2, "upper_mm": 0.2},
]
TWIST: list[dict[str, object]] = [{"name": "twist", "type": "relative-twist", "lower_deg": -0.1, "upper_deg": 0.1}]


@pytest.fixture(scope="module")
def plan(tmp_path_factory: pytest.TempPathFactory, spline: BSpline) -> CtPlan:
    folder = tmp_path_factory.mktemp("stack")
    profile = spline(np.linspace(0, 1, 300))
    rings = tube(profile, np.linspace(0.0, 20.0, 5))
    rings[:, :, 0] += 0.02 * np.sin(rings[:, :, 1] + rings[:, :, 2])
    mesh = write(folder / "blade.stl", binary_stl(np.concatenate([rings, box((20, 0.5, 22), (23, 3.5, 40))])))
    nominal = write_spline(spline, folder / "n.yaml")
    make_key(folder / "station.key")  # one for all folders of records, so that the signatures are the same, too
    keeping = {"key": folder / "station.key"}
    return plan_of(mesh, nominal, {"heights_mm": HEIGHTS}, characteristics=ASKED, stack_characteristics=TWIST, records=keeping)


@pytest.fixture
def looking(monkeypatch: pytest.MonkeyPatch) -> list[Foresight]:
    """Every foresight that is made, on a computer with two cores where few sections are worth a process."""
    made: list[Foresight] = []

    class Noted(Foresight):
        def __init__(self) -> None:
            super().__init__()
            made.append(self)

    monkeypatch.setattr("cmmlink.stack.Foresight", Noted)
    monkeypatch.setattr(foresight, "processes_here", lambda: 2)
    monkeypatch.setattr(foresight, "_WORTH_A_PROCESS", 1)
    return made


class Here:
    """Stands for other processes: what it is asked and what it answers goes through pickle, in this process."""

    def __init__(self, count: int, serving: str) -> None:
        assert (count, serving) == (2, foresight.__name__)
        self._seer = foresight._Seer()

    def ask(self, question: object) -> "Future[Any]":
        answer: Future[Any] = Future()
        answer.set_result(pickle.loads(pickle.dumps(self.changed(self._seer(pickle.loads(pickle.dumps(question)))))))
        return answer

    def changed(self, answer: Any) -> Any:
        return answer

    def close(self) -> None:
        pass


def inspected(plan: CtPlan, records: Path, **further: Any) -> StackOutcome:
    now = datetime(2026, 1, 2, tzinfo=UTC)
    stop = further.pop("stop", threading.Event())
    return inspect_stack(plan, clock=lambda: 0.0, stop=stop, now=lambda: now, records=records, **further)


def all_of(stack: StackOutcome) -> tuple[object, ...]:
    """All that is known of a stack, with the hashes of its records."""
    results = [section.run.result for section in stack.sections]
    found = [(result.characteristics, result.numbers, result.deviation_mm.tobytes()) for result in results if result is not None]
    told = [(section.started, section.warnings) for section in stack.sections]
    return repr(stack.result_json()), repr(found), repr(told), stack.verdict


@pytest.fixture(scope="module")
def alone(plan: CtPlan, tmp_path_factory: pytest.TempPathFactory) -> tuple[object, ...]:
    """The stack without other processes."""
    return all_of(inspected(plan, tmp_path_factory.mktemp("alone")))


def test_what_was_evaluated_beforehand_is_the_same_to_the_last_bit(
    alone: tuple[object, ...], plan: CtPlan, tmp_path: Path, looking: list[Foresight], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(foresight, "OtherProcesses", Here)
    assert all_of(inspected(plan, tmp_path / "beside")) == alone
    assert [one.taken for one in looking] == [5]


def test_a_process_that_is_killed_loses_nothing(
    alone: tuple[object, ...], plan: CtPlan, tmp_path: Path, looking: list[Foresight], monkeypatch: pytest.MonkeyPatch
) -> None:
    begun: list[_Process] = []
    start = _Process.__init__

    def note(process: _Process, serving: str) -> None:
        start(process, serving)
        begun.append(process)

    monkeypatch.setattr(_Process, "__init__", note)

    def kill(section: SectionOutcome) -> None:
        if section.slice.asked_mm == HEIGHTS[1]:
            begun[0]._child.kill()

    assert all_of(inspected(plan, tmp_path / "beside", on_section=kill)) == alone
    assert 2 <= looking[0].taken <= 5
    assert [process._child.returncode is not None for process in begun] == [True, True]


def test_what_another_process_found_of_other_points_or_not_at_all_is_found_here(
    alone: tuple[object, ...], plan: CtPlan, tmp_path: Path, looking: list[Foresight], monkeypatch: pytest.MonkeyPatch
) -> None:
    class Mistaken(Here):
        def changed(self, answer: Any) -> Any:
            if looking[0].taken == 0 and answer is not None:  # a nominal that was written anew in the meantime
                return replace(answer, basis=replace(answer.basis, sha256=64 * "0"), characteristics=())
            return None

    monkeypatch.setattr(foresight, "OtherProcesses", Mistaken)
    assert all_of(inspected(plan, tmp_path / "beside")) == alone
    assert looking[0].taken == 0


def test_a_stack_that_is_stopped_ends_after_the_section_at_hand(
    plan: CtPlan, tmp_path: Path, looking: list[Foresight], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(foresight, "OtherProcesses", Here)
    stop = threading.Event()
    stack = inspected(plan, tmp_path / "beside", stop=stop, on_section=lambda _: stop.set())
    assert (len(stack.sections), stack.complete, looking[0].taken) == (1, False, 1)


def test_processes_that_cannot_be_started_and_few_characteristics_leave_all_to_this_one(
    looking: list[Foresight], monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(count: int, serving: str) -> OtherProcesses:
        raise OSError("no process")

    monkeypatch.setattr(foresight, "OtherProcesses", refuse)
    with Foresight() as one:
        one.expect(100, 10)
        assert one.ahead == 0
    monkeypatch.setattr(foresight, "_WORTH_A_PROCESS", 200)
    with Foresight() as other:
        other.expect(19, 20)
        other.expect(1000, 0)
    assert other.ahead == 0


def test_what_goes_wrong_in_looking_ahead_is_raised_when_its_turn_comes() -> None:
    made: list[int] = []

    def items() -> Iterator[int]:
        for number in range(3):
            made.append(number)
            yield number
        raise ValueError("the fourth")

    taken = [(next(ahead), len(made)) for ahead in [look_ahead(items(), 1)] for _ in range(3)]
    assert taken == [(0, 2), (1, 3), (2, 3)]
    with pytest.raises(ValueError, match="the fourth"):
        list(look_ahead(items(), 10))
    assert list(look_ahead(iter("abc"), 0)) == list("abc")
