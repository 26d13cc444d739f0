"""Names that look like markup, are very long, or are read from right to left: no output breaks on them or shows another name."""

import io
import time
from datetime import UTC, datetime
from pathlib import Path

import pytest
from matplotlib.figure import Figure
from matplotlib.image import imread
from rich.console import Console

from cmmlink.console.past_runs import PastRuns
from cmmlink.events import Counts, RunFinished, RunStarted
from cmmlink.report import LiveTable, print_summary
from cmmlink.report.heading import draw_heading, heading_of, save_picture
from cmmlink.report.judged_scan import scan_of
from cmmlink.report.picture import ProfilePictures
from cmmlink.report.picture_content import content_of
from cmmlink.result_folder import folder_of
from cmmlink.run_context import RunContext
from cmmlink.run_view import RunView
from inspection import NominalProfile, ToleranceZone
from tests.cmmlink.command import cmmlink
from tests.cmmlink.commands.oval_files import write_plan
from tests.cmmlink.judged_oval import inspect_oval
from tests.cmmlink.oval_part import write_nominal
from tests.cmmlink.recorded import no_decoder, today

RIGHT_TO_LEFT = "\u05d7\u05dc\u05e7 7"
NAMES = [
    "a$_$",
    "$x^{2}",
    "\\frac{1}",
    "blade [/] 7",
    "[bold red]x",
    "<b>x</b>",
    "{0} %s %(x)d",
    "-n",
    "x" * 300,
    RIGHT_TO_LEFT,
    "\U0001f527",
]


@pytest.mark.parametrize("name", NAMES)
def test_terminal_and_heading_show_the_name_as_it_is(profile: NominalProfile, tmp_path: Path, name: str) -> None:
    context = RunContext("", "", profile, ToleranceZone(-0.05, 0.07), 0.95, 1000, datetime(2026, 11, 26, tzinfo=UTC))
    view = RunView(context, lambda: 1.0, lambda: context.began)
    view(RunStarted(name, name, name, f"device {name}", simulated=False, notes=(name,)))
    view(RunFinished("interrupted", None, Counts(received=1, rejected=1, rejected_by_reason={name: 1}), name))
    screen = io.StringIO()
    console = Console(file=screen, force_terminal=True, color_system=None, width=4000)
    with LiveTable(console, view):
        pass
    assert f"{name} {name}" in screen.getvalue()
    printed = io.StringIO()
    counts = Counts(received=360, judged=359, rejected=1, rejected_by_reason={name: 1})
    print_summary(Console(file=printed, width=4000), inspect_oval(profile, 0.0), counts, name, notes=[name])
    assert printed.getvalue().count(name) == 3
    figure = Figure(figsize=(12, 2))
    draw_heading(figure, heading_of(name, "NOT CONFORM"))
    save_picture(figure, tmp_path / "heading.png")
    width = figure.get_suptitle().count("x")
    assert width <= 60
    assert figure.texts == [] or imread(tmp_path / "heading.png").min() < 0.5
    folder = folder_of(tmp_path / "{part}/{serial}", part=name, serial_number=name, run="1")
    folder.mkdir(parents=True)
    assert folder.parent.parent == tmp_path


def test_a_part_of_such_a_name_is_measured_recorded_listed_and_drawn(tmp_path: Path) -> None:
    name = f"a$_$ [/] <b>x</b> {RIGHT_TO_LEFT}"
    plan = write_plan(write_nominal(tmp_path / "oval.yaml"))
    plan.write_text(
        plan.read_text(encoding="utf-8").replace("name: oval, serial_number: 0012", f"name: '{name}', serial_number: '{name}'"), "utf-8"
    )
    records = ("--records", tmp_path / "records")
    ended = cmmlink("run", plan, *records)
    assert (ended.code, ended.err) == (0, "")
    assert f"{name} {name}" in ended.out
    assert len(list((tmp_path / "results").rglob("profile.png"))) == 1
    assert f"{name} {name}" in cmmlink("runs", *records).out
    assert f"{name} {name}" in cmmlink("show", "last", *records).out
    assert cmmlink("replay", "last", *records).code == 0
    assert cmmlink("export", "last", *records, "--out", tmp_path / "out").code == 0
    (row,) = PastRuns(tmp_path / "records", no_decoder, time.monotonic, today).runs()
    assert (row.part, row.serial_number) == (name, name)


def test_the_picture_draws_it(profile: NominalProfile, tmp_path: Path) -> None:
    content = content_of(scan_of(inspect_oval(profile, 0.0)), profile, "a$_$ \\frac{ " + "x" * 300, said="run $_$")
    ProfilePictures().write(content, tmp_path / "a.png")
    assert imread(tmp_path / "a.png").shape[:2] == (1240, 1420)


@pytest.mark.parametrize("sign", ["\\n", "\\x1b[31m", "\\u202e", "\\0"])
def test_a_name_that_steers_the_terminal_is_refused(tmp_path: Path, sign: str) -> None:
    plan = write_plan(write_nominal(tmp_path / "oval.yaml"))
    plan.write_text(plan.read_text(encoding="utf-8").replace("name: oval", f'name: "blade{sign}7"'), "utf-8")
    assert "expected printable text on one line" in cmmlink("check", plan).refused()
