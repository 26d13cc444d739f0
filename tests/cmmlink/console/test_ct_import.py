"""The inspection of a surface, while others look at its sections."""

import threading
from collections.abc import Callable, Sequence
from dataclasses import replace
from datetime import datetime
from pathlib import Path

import numpy as np
import pytest

from cmmlink.console.ct_import import CtImport, Section
from cmmlink.console.refused import Refused
from cmmlink.console.station import Station
from cmmlink.endings import Ended
from cmmlink.events import Counts, RunStarted
from cmmlink.result_json import result_json
from cmmlink.run_context import RunContext
from inspection import NominalProfile, NurbsCurve, ToleranceZone, discretize

from .played import Device, setup_of

Summary = tuple[str, Sequence[str]]


@pytest.fixture(scope="module")
def profile() -> NominalProfile:
    return discretize(NurbsCurve.interpolate(np.array([[0.0, 0.0], [50.0, 10.0], [100.0, 0.0], [150.0, 5.0]])), material="left")


def section_at(height_mm: float, profile: NominalProfile) -> Section:
    context = RunContext(f"section {height_mm:g}", "ct.yaml", profile, ToleranceZone(-0.1, 0.2), 0.9, 1000, datetime(2026, 11, 22, 12))
    return Section(
        height_mm, context, RunStarted("blade", "", "", "", False), Ended("complete", "", result_json(None, Counts()), None), ("thin",)
    )


def test_sections_are_counted_and_the_time_left_is_told_while_they_come(profile: NominalProfile) -> None:
    now_s = [100.0]
    surface = CtImport(lambda: now_s[0])
    assert surface.state.state == "none"
    surface.begin("ct.yaml")
    assert (surface.state.plan, surface.state.state) == ("ct.yaml", "reading")
    surface.expect(4)
    now_s[0] = 106.0
    surface.add(section_at(3.0, profile))
    state = surface.state
    assert (state.state, state.done, state.total, state.remaining_s) == ("inspecting", 1, 4, 18)
    assert (state.sections[0].height_mm, state.sections[0].verdict, state.sections[0].lower_mm) == (3.0, "uncertain", -0.1)
    assert state.sections[0].warnings == ("thin",)
    surface.end("the surface cannot be read", failed=True)
    assert (surface.state.state, surface.state.message, surface.state.remaining_s) == ("failed", "the surface cannot be read", None)
    assert state.state == "inspecting", "what a page was given stays as it was"


def test_section_is_given_or_not_however_many_imports_begin_meanwhile(profile: NominalProfile) -> None:
    surface, over = CtImport(lambda: 0.0), threading.Event()
    whole = section_at(3.0, profile)

    def begin_again_and_again() -> None:
        while not over.is_set():
            surface.begin("ct.yaml")
            surface.expect(2)
            surface.add(whole)
            surface.add(whole)

    thread = threading.Thread(target=begin_again_and_again)
    thread.start()
    try:
        found = {surface.section(1) for _ in range(20_000)}
        states = [surface.state for _ in range(20_000)]
    finally:
        over.set()
        thread.join(30.0)
    assert found <= {whole, None}
    assert all(len(state.sections) == state.done for state in states)
    assert surface.section(-1) is None
    assert surface.section(2) is None


def test_section_of_a_surface_is_opened_while_the_next_import_has_begun(profile: NominalProfile, tmp_path: Path) -> None:
    begun, released = threading.Event(), threading.Event()

    def inspect(file: Path, stop: threading.Event, on_start: Callable[[int], None], on_section: Callable[[Section], None]) -> Summary:
        on_start(1)
        on_section(section_at(3.0, profile))
        begun.set()
        assert stop.wait(60.0) or released.is_set()
        return "done", ("a note",)

    setup = setup_of({}, Device().connect)
    station = Station(replace(setup, ct_plans=lambda: {"ct.yaml": tmp_path / "ct.yaml"}, inspect_surface=inspect))
    station.import_ct("ct.yaml")
    assert begun.wait(30.0)
    view = station.open_section(0)
    assert view.state().number == "section 3"
    with pytest.raises(Refused, match="no such section"):
        station.open_section(1)
    with pytest.raises(Refused, match="a run is on"):
        station.import_ct("ct.yaml")
    begun.clear()
    station.abort()
    assert station.wait(30.0)
    assert station.ct.state.state == "done"
    station.import_ct("ct.yaml")
    assert begun.wait(30.0)
    assert view.state().number == "section 3", "what was opened stays what it was"
    station.abort()
    assert station.wait(30.0)
