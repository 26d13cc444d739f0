"""The table of a run in the terminal: it says what the run's view says."""

import io
from datetime import UTC, datetime

import pytest
from rich.console import Console

from cmmlink.events import Arrived, Counts, Judged, RunFinished, RunStarted
from cmmlink.report.live_table import LiveTable
from cmmlink.run_context import RunContext
from cmmlink.run_view import RunView
from drivers import LinkDown, ScanOpened
from inspection import LiveInspection, NominalProfile, RigidTransform, ToleranceZone
from tests.cmmlink.judged_oval import bumped
from tests.cmmlink.oval_part import oval_points, station_mm

MIDNIGHT = datetime(2026, 11, 26, tzinfo=UTC)
ROWS = ("part", "device", "link", "points", "rate", "registration", "worst", "verdict")


@pytest.fixture
def live(profile: NominalProfile) -> LiveInspection:
    return LiveInspection(profile, ToleranceZone(-0.05, 0.07), datum=RigidTransform.identity())


@pytest.fixture
def view(profile: NominalProfile) -> RunView:
    context = RunContext("", "", profile, ToleranceZone(-0.05, 0.07), 0.95, 1000, MIDNIGHT)
    view = RunView(context, lambda: 1.0, lambda: MIDNIGHT)
    view(RunStarted("blade [b]", "0012", "", "serial COM3", True))
    return view


def paint(view: RunView) -> tuple[dict[str, str], str]:
    """The rows of the table by their names, as a terminal shows them, and the line of the progress bar."""
    screen = io.StringIO()
    console = Console(file=screen, force_terminal=True, color_system=None, width=120)
    with LiveTable(console, view):
        pass  # painted once on entering, and cleared on leaving
    lines = [line.strip() for line in screen.getvalue().split("\x1b[?25l")[1].splitlines()]
    found = {name: line for name, line in zip(ROWS, lines, strict=False) if line.startswith(name)}
    assert tuple(found) == ROWS
    return {name: line[len(name) :].strip() for name, line in found.items()}, lines[len(ROWS)]


def test_before_the_first_point_nothing_is_claimed(view: RunView) -> None:
    view.await_device()
    rows, _ = paint(view)
    assert rows["part"] == "blade [b] 0012"
    assert rows["device"] == "SIMULATED, serial COM3"
    assert (rows["link"], rows["registration"], rows["worst"]) == ("connecting", "seeking", "")
    assert rows["verdict"] == "NOT PROVEN: waiting for points"


def test_while_the_scan_runs_the_worst_point_and_the_verdict_so_far_stand_there(view: RunView, live: LiveInspection) -> None:
    view(Arrived(0.0, ScanOpened("scanner", "S-1", 720)))
    update = live.add(oval_points(bumped()))
    view(Judged(1.0, 0.1, update, Counts(received=363, judged=360, rejected=3, lost=2)))
    rows, bar = paint(view)
    assert rows["points"] == "363 received, 360 judged, 3 rejected, 2 lost"
    assert rows["worst"] == f"+0.2000 mm at station {station_mm(42):.1f} mm"
    assert rows["verdict"] == "NOT CONFORM: 6 points out so far"
    assert (rows["link"], rows["registration"]) == ("up", "settled")
    assert bar.endswith("363/720")


def test_a_lost_link_and_the_end_are_said(view: RunView, live: LiveInspection) -> None:
    view(Arrived(0.0, LinkDown("unplugged")))
    assert paint(view)[0]["link"] == "down: unplugged"
    live.add(oval_points(0.0))
    view(RunFinished("complete", live.finish(), Counts(received=360, judged=360), ""))
    assert paint(view)[0]["verdict"] == "CONFORM: all 360 points within tolerance"
