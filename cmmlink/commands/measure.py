"""Commands that measure with a device: the demonstration, and a plan."""

import itertools
import math
import sys
import time
from collections.abc import Callable
from contextlib import nullcontext
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from cmmlink.commands.options import (
    Headless,
    Json,
    NoBrowser,
    Out,
    PlanFile,
    Records,
    records_folder,
)
from cmmlink.commands.output import Output, now, report_outcome, stop_on_ctrl_c
from cmmlink.commands.pushed import pushing_after
from cmmlink.commands.series import NextPart, connect_part
from cmmlink.commands.surface_outcome import run_surface
from cmmlink.errors import PlanError

if TYPE_CHECKING:
    from cmmlink.devices import Connect
    from cmmlink.plan import Plan, SurfacePlan
    from cmmlink.run import FinishedRun
    from cmmlink.surface_run import FinishedSurface
    from inspection import NominalProfile


def demo(
    headless: Headless = False,
    seed: Annotated[int, typer.Option(min=0, metavar="N", help="Another seed is another part.")] = 1,
    defect: Annotated[str | None, typer.Option(metavar="MM@STATION", help="A local defect, like 0.12@40.")] = None,
    out: Out = Path("demo-result"),
    records: Records = None,
    as_json: Json = False,
    no_browser: NoBrowser = False,
) -> int:
    """Run the whole chain on a simulated device, no set-up."""
    from cmmlink.commands.console import run_on_page
    from cmmlink.demo import plan_file as demo_plan_file
    from cmmlink.from_plan import check_plan
    from cmmlink.plan import load_plan
    from cmmlink.report import prepare
    from cmmlink.simulated import connect_demo_device

    plan = load_plan(demo_plan_file())
    profile = check_plan(plan, demo_plan_file())
    bump = None if defect is None else _defect(defect, profile.length_mm)
    prepare(out)
    output = Output(headless, as_json, out, records, no_browser)
    if output.on_page:
        seeds = itertools.count(seed)
        return run_on_page(
            demo_plan_file(), lambda plan: connect_demo_device(_of_section(plan), profile, next(seeds), bump), output, _report(output)
        )
    return _run(plan, profile, lambda plan: connect_demo_device(_of_section(plan), profile, seed, bump), output)


def _defect(text: str, length_mm: float) -> tuple[float, float]:
    """Height and station of a defect, both in mm."""
    height, _, station = text.partition("@")
    try:
        bump = float(height), float(station)
    except ValueError:
        bump = math.nan, math.nan
    if not (math.isfinite(bump[0]) and 0 <= bump[1] <= length_mm):
        meaning = f"expected MM@STATION, a station between 0 and {length_mm:.1f} mm"
        raise PlanError(f"--defect {text}: {meaning}, like 0.12@40 for 0.12 mm of excess at station 40 mm")
    return bump


def run(
    plan_file: PlanFile,
    serial: Annotated[str | None, typer.Option("--serial", metavar="S", help="The serial number of this part.")] = None,
    operator: Annotated[str | None, typer.Option("--operator", metavar="O", help="Who measures.")] = None,
    count_up: Annotated[bool, typer.Option("--next", help="The serial number after the last one that was recorded of this part.")] = False,
    headless: Headless = False,
    out: Out = None,
    records: Records = None,
    as_json: Json = False,
    no_browser: NoBrowser = False,
) -> int:
    """Acquire and inspect with the device of a plan."""
    from cmmlink.commands.console import run_on_page
    from cmmlink.devices import connect
    from cmmlink.from_plan import check_plan
    from cmmlink.plan import SurfacePlan, kind_of_plan, load_plan
    from cmmlink.report import prepare

    if kind_of_plan(plan_file) is SurfacePlan:
        return run_surface(plan_file, NextPart(serial, operator, count_up), Output(headless, as_json, out, records, no_browser))
    plan = load_plan(plan_file)
    profile = check_plan(plan, plan_file)
    output = Output(headless, as_json, out or plan.out.folder, records or plan.records.folder, no_browser)
    plan, notes = NextPart(serial, operator, count_up).of(plan, records_folder(output.records), asks=not as_json)
    prepare(output.out)
    connect_this = partial(connect_part, connect, plan.part.serial_number, notes)
    if output.on_page:
        return run_on_page(plan_file, connect_this, output, _report(output), plan.part.serial_number, plan.operator)
    return _run(plan, profile, connect_this, output)


def _of_section(plan: "Plan | SurfacePlan") -> "Plan":
    """The plan of the demonstration, which is one of a section."""
    from cmmlink.plan import Plan

    assert isinstance(plan, Plan)
    return plan


def _report(output: Output) -> "Callable[[FinishedRun | FinishedSurface], int]":
    """What prints the outcome of a run of a section that was shown on a page, and gives the exit code."""
    from cmmlink.run import FinishedRun

    def report(run: "FinishedRun | FinishedSurface") -> int:
        assert isinstance(run, FinishedRun)
        return report_outcome(run, replace(output, out=None))

    return report


def _run(plan: "Plan", profile: "NominalProfile", connect: "Connect", output: Output) -> int:
    """Carry out a plan, record it, and report the outcome; a live table is shown when the output goes to a terminal."""
    from rich.console import Console

    from cmmlink.report import LiveTable
    from cmmlink.run import carry_out
    from cmmlink.run_context import RunContext
    from cmmlink.run_view import RunView

    quiet = output.headless or output.as_json or not sys.stderr.isatty()
    view = RunView(RunContext.of(plan, profile, now(), number="", plan_name=""), time.monotonic, now)
    table = nullcontext() if quiet else LiveTable(Console(stderr=True), view)
    records = records_folder(output.records)
    with pushing_after(records) as recorded:
        with connect(plan) as device, stop_on_ctrl_c() as stop, table:
            finished = carry_out(
                plan,
                profile,
                device,
                records=records,
                clock=time.monotonic,
                now=now,
                stop=stop,
                sinks=[] if quiet else [view],
                on_ready=view.await_device,
            )
        recorded.append(finished.evidence)
        return report_outcome(finished, output)
