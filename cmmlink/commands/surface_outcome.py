"""How commands carry out the plan of a whole surface with its device, and what they print and write of a run of a surface."""

import time
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from cmmlink.commands.console import run_on_page
from cmmlink.commands.exit_codes import DEVICE_FAILED, EXIT_OF, NO_RECORD, UNUSABLE, say
from cmmlink.commands.options import records_folder
from cmmlink.commands.output import Output, now, print_json, say_untold, stop_on_ctrl_c, terminal
from cmmlink.commands.progress import progress
from cmmlink.commands.pushed import pushing_after
from cmmlink.commands.series import NextPart, connect_part
from cmmlink.errors import StoreError
from inspection import NotMeasured

if TYPE_CHECKING:
    from cmmlink.run import FinishedRun
    from cmmlink.surface_run import FinishedSurface


def run_surface(plan_file: Path, part: NextPart, output: Output) -> int:
    """Carry out the plan of a whole surface, record it, and report the outcome. Returns the exit code."""
    from cmmlink.devices import connect
    from cmmlink.from_surface_plan import check_surface_plan
    from cmmlink.plan import load_surface_plan
    from cmmlink.report import prepare
    from cmmlink.surface_run import carry_out_surface

    plan = load_surface_plan(plan_file)
    with progress(f"reading {plan.surface.file.name}"):
        file = check_surface_plan(plan, plan_file)
    out, records = output.out or plan.out.folder, records_folder(output.records or plan.records.folder)
    plan, notes = part.of(plan, records, asks=not output.as_json)
    prepare(out)
    if output.on_page:
        shown = replace(output, out=out, records=records)
        connect_this = partial(connect_part, connect, plan.part.serial_number, notes)
        report = partial(_report_shown, as_json=output.as_json)
        return run_on_page(plan_file, connect_this, shown, report, plan.part.serial_number, plan.operator)
    with pushing_after(records) as recorded:
        with connect(plan) as device, stop_on_ctrl_c() as stop, progress(f"measuring {plan.part.name}"):
            noted = replace(device, notes=(*notes, *device.notes))
            finished = carry_out_surface(plan, file, noted, records=records, clock=time.monotonic, now=now, stop=stop)
        recorded.append(finished.evidence)
        return report_surface(finished, out, as_json=output.as_json)


def _report_shown(run: "FinishedRun | FinishedSurface", *, as_json: bool) -> int:
    """Print the outcome of a run that was shown on a page; its files are written already."""
    from cmmlink.surface_run import FinishedSurface

    assert isinstance(run, FinishedSurface)
    return report_surface(run, None, as_json=as_json)


def report_surface(run: "FinishedSurface", out: Path | None, *, as_json: bool) -> int:
    """Print the outcome of a run of a surface and write its files. Returns the exit code.

    Raises NotMeasured where the set-up contradicts the points, and why there is no result where a file of points gave none.
    """
    from cmmlink.report import print_surface_summary, write_surface_run

    outcome, evidence, refusal = run.outcome, run.evidence, run.refusal
    if isinstance(refusal, NotMeasured) and outcome.failure is None and outcome.ending == "complete":
        raise refusal
    message = str(outcome.failure or refusal or "")
    if outcome.ending == "aborted":
        message = message or "stopped by the operator: the scan is not complete"
    if message:
        say(message)
    say_untold(() if evidence is None else evidence.anchors)
    document = run.result_json()
    folder = run.folder_of(out) if out is not None and outcome.measured else None
    written: list[str] = []
    try:
        if folder is not None:
            with progress(f"writing results to {folder}"):
                written = write_surface_run(folder, run)
    finally:
        if as_json:
            print_json(document)
        else:
            print_surface_summary(terminal(), document, f"{run.title}, {run.started.device}", run.notes)
    if not as_json:
        if written:
            typer.echo(f"results in {folder}: {', '.join(written)}")
        if evidence is not None:
            typer.echo(f"recorded as run {evidence.run}")
    if outcome.failure is not None:
        return NO_RECORD if isinstance(outcome.failure, StoreError) else DEVICE_FAILED
    return UNUSABLE if outcome.result is None else EXIT_OF[run.verdict]
