"""Commands that measure and judge: the demonstration, a plan with its device, a file of points."""

import itertools
import math
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from cmmlink.commands.options import (
    AllowUnseen,
    Closed,
    ColumnsText,
    CurveNumber,
    EndAllowance,
    GapMax,
    Headless,
    Invalid,
    Json,
    Layer,
    NoBrowser,
    NominalScale,
    NominalUnit,
    NoRecord,
    Out,
    Plane,
    PlanFile,
    Records,
    RejectOutliers,
    Rule,
    SectionPlaneNumbers,
    Uncertainty,
    Unit,
    Weights,
    columns_from,
    plan_from_options,
    records_folder,
    section_in,
)
from cmmlink.commands.output import Output, now, report_outcome, stop_on_ctrl_c
from cmmlink.commands.series import NextPart
from cmmlink.errors import PlanError
from cmmlink.words import printable
from inspection import FitName, Material, Method

if TYPE_CHECKING:
    from cmmlink.devices import Connect, Connected
    from cmmlink.plan import Plan
    from inspection import NominalProfile

_PATIENCE_S = 60.0  # files are inspected side by side, and each waits for its turn to be recorded
_OPTION_OF = {
    "device": "POINTS",
    "nominal.file": "--nominal",
    "nominal.scale": "--scale",
    "nominal.unit": "--nominal-unit",
    "nominal.layer": "--layer",
    "nominal.curve": "--curve",
    "tolerance.uncertainty_mm": "--uncertainty",
    "tolerance": "--tolerance",
    "probe.tip_radius_mm": "--tip-radius",
    "registration.coverage_min": "--coverage-min",
    "gap_max_mm": "--gap-max",
    "end_allowance_mm": "--end-allowance",
    "allow.unseen_mm": "--allow-unseen",
    "registration.reject_outliers": "--reject-outliers",
}


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
        return run_on_page(demo_plan_file(), lambda plan: connect_demo_device(plan, profile, next(seeds), bump), output)
    return _run(plan, profile, lambda plan: connect_demo_device(plan, profile, seed, bump), output)


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
    from cmmlink.plan import load_plan
    from cmmlink.report import prepare

    plan = load_plan(plan_file)
    profile = check_plan(plan, plan_file)
    output = Output(headless, as_json, out or plan.out.folder, records or plan.records, no_browser)
    part = NextPart(serial, operator, count_up)
    plan, notes = part.of(plan, records_folder(output.records), asks=not as_json)
    prepare(output.out)
    connect_part = partial(_connect_part, connect, plan.part.serial_number, notes)
    if output.on_page:
        entered = (plan.part.serial_number, plan.operator) if part.is_asked_for else (None, None)
        return run_on_page(plan_file, connect_part, output, *entered)
    return _run(plan, profile, connect_part, output)


@contextmanager
def _connect_part(connect: "Connect", serial_number: str | None, notes: tuple[str, ...], plan: "Plan") -> Iterator["Connected"]:
    """Connect the device of a plan; what is known of the part with this serial number stands beside its verdict."""
    with connect(plan) as device:
        yield replace(device, notes=(*notes, *device.notes)) if plan.part.serial_number == serial_number else device


def _run(plan: "Plan", profile: "NominalProfile", connect: "Connect", output: Output) -> int:
    """Carry out a plan, record it, and report the outcome; a live table is shown when the output goes to a terminal."""
    from rich.console import Console

    from cmmlink.report import LiveTable
    from cmmlink.run import carry_out
    from cmmlink.run_view import RunContext, RunView

    quiet = output.headless or output.as_json or not sys.stderr.isatty()
    view = RunView(RunContext.of(plan, profile, now(), number="", plan_name=""), time.monotonic, now)
    table = nullcontext() if quiet else LiveTable(Console(stderr=True), view)
    with connect(plan) as device, stop_on_ctrl_c() as stop, table:
        finished = carry_out(
            plan,
            profile,
            device,
            records=records_folder(output.records),
            clock=time.monotonic,
            now=now,
            stop=stop,
            sinks=[] if quiet else [view],
            on_ready=view.await_device,
        )
    return report_outcome(finished, output)


def inspect(
    points: Annotated[Path, typer.Argument(metavar="POINTS", help="Measured points: csv, txt, asc, xyz or npy.")],
    nominal: Annotated[Path, typer.Option(metavar="FILE", help="The nominal profile.")],
    tolerance: Annotated[tuple[float, float], typer.Option(metavar="LO HI", help="Deviations allowed, mm, positive out of material.")],
    method: Annotated[Method, typer.Option(help="How deviations are found.")] = "exact",
    fit: Annotated[FitName, typer.Option(help="How points come onto the nominal.")] = "best-fit",
    tip_radius: Annotated[float, typer.Option(metavar="R", help="The points are centres of a ball of this radius, mm.")] = 0.0,
    uncertainty: Uncertainty = 0.0,
    scale: NominalScale = 1.0,
    nominal_unit: NominalUnit = None,
    layer: Layer = None,
    curve: CurveNumber = None,
    unit: Unit = None,
    columns: ColumnsText = None,
    invalid: Invalid = None,
    plane: Plane = "xy",
    section: SectionPlaneNumbers = None,
    closed: Closed = None,
    material: Annotated[Material | None, typer.Option(help="Side of the material, seen along the nominal.")] = None,
    coverage_min: Annotated[
        float, typer.Option(min=0, max=1, metavar="SHARE", help="Share of the nominal to be measured before conform is proven.")
    ] = 0.95,
    reject_outliers: RejectOutliers = False,
    rule: Rule = "minimum-zone",
    weights: Weights = "arc-length",
    gap_max: GapMax = None,
    end_allowance: EndAllowance = None,
    allow_unseen: AllowUnseen = None,
    out: Out = None,
    records: Records = None,
    no_record: NoRecord = False,
    as_json: Json = False,
) -> int:
    """Inspect a file of points, and record it as a run."""
    from cmmlink.devices import connect
    from cmmlink.from_plan import inspection_of, profile_of
    from cmmlink.plan import Plan
    from cmmlink.report import Pictures, prepare, processes_here
    from cmmlink.run import carry_out
    from cmmlink.scratch import scratch_in

    settings = {
        "part": {"name": printable((points.stem.strip() or points.name).replace("\n", " "))},
        "nominal": {
            "file": nominal,
            "layer": layer,
            "curve": curve,
            "scale": scale,
            "unit": nominal_unit,
            "closed": closed,
            "material": material,
        },
        "tolerance": {"lower_mm": tolerance[0], "upper_mm": tolerance[1], "uncertainty_mm": uncertainty},
        "device": {"type": "file", "file": points, "unit": unit, "columns": columns_from(columns), "invalid": invalid or ()},
        "section": section_in(plane, section),
        "probe": {"tip_radius_mm": tip_radius},
        "registration": {"fit": fit, "method": method, "coverage_min": coverage_min, "reject_outliers": reject_outliers},
        "rule": rule,
        "weights": weights,
        "gap_max_mm": gap_max,
        "end_allowance_mm": end_allowance,
        "allow": {"unseen_mm": allow_unseen},
        "out": None,
    }
    plan = plan_from_options(Plan, settings, _OPTION_OF)
    with Pictures() as pictures:
        pictures.start(min(processes_here(), 0 if out is None else 1))  # it loads what it draws with while points are read and judged
        profile = profile_of(plan)
        folder = None if no_record else records_folder(records)
        with connect(plan, scratch_in(folder)) as device, stop_on_ctrl_c() as stop:
            try:
                inspection_of(plan, profile)
            except ValueError as error:
                raise PlanError(f"--tip-radius {tip_radius:g}: {error}") from None
            prepare(out)
            finished = carry_out(plan, profile, device, records=folder, clock=time.monotonic, now=now, stop=stop, patience_s=_PATIENCE_S)
        if finished.outcome.refusal is not None:
            refusal = finished.outcome.refusal
            raise type(refusal)(f"{points}: {refusal}")
        return report_outcome(finished, Output(headless=True, as_json=as_json, out=out), pictures)
