"""The console brought to the operator: the command `console`, and a single run shown on the page."""

import itertools
import os
import re
import signal
import sys
import threading
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from cmmlink.commands.options import NoBrowser, Records, records_folder
from cmmlink.commands.output import Output, now, stop_on_ctrl_c
from cmmlink.errors import PlanError
from cmmlink.version import __version__
from cmmlink.words import VERDICT_WORDS

if TYPE_CHECKING:
    from contextlib import AbstractContextManager

    from cmmlink.console.ct_import import Section
    from cmmlink.console.past_runs import PastRuns
    from cmmlink.console.server import ConsoleServer
    from cmmlink.console.trend_look import TrendLook
    from cmmlink.devices import Connect, Connected
    from cmmlink.plan import CtPlan, Plan, SurfacePlan
    from cmmlink.plant import ResultsDatabase
    from cmmlink.run import FinishedRun
    from cmmlink.stack import SectionOutcome
    from cmmlink.surface_run import FinishedSurface

CONSOLE_PORT = 8207
_PAGE_OPENS_S = 20.0  # how long a run waits for the page that is to show it
_LOOK_S = 0.2
_LONGEST_PLAN = 200_000


def serve_console(
    folder: Annotated[Path, typer.Argument(metavar="[FOLDER]", help="Folder of the station's plans.")] = Path(),
    host: Annotated[
        str, typer.Option(help="Address to serve. One that others can reach needs --certificate or --unencrypted.")
    ] = "127.0.0.1",
    port: Annotated[int, typer.Option(min=0, max=65535, help="0 takes a free one.")] = CONSOLE_PORT,
    no_browser: NoBrowser = False,
    certificate: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Serve https with this certificate, PEM with its key in it or in --key.")
    ] = None,
    key: Annotated[Path | None, typer.Option(metavar="FILE", help="The certificate's private key, PEM.")] = None,
    unencrypted: Annotated[bool, typer.Option("--unencrypted", help="Serve other computers without a certificate.")] = False,
    records: Records = None,
) -> int:
    """Serve the operator console: plans, runs, history and CT import of this station on one page.

    The address that it prints opens one page, once, within a minute. Enter prints another, and `new` turns out every page first.
    """
    from cmmlink.console.launch import serve
    from cmmlink.console.listening import Access
    from cmmlink.console.station_setup import StationSetup
    from cmmlink.demo import plan_file
    from cmmlink.devices import connect, serial_ports

    if not folder.is_dir():
        raise PlanError(f"{folder}: there is no such folder; give the folder that holds the plans")
    past = _past_runs(records)
    scans, surfaces = (lambda: _plans_in(folder, surfaces=False)), (lambda: _plans_in(folder, surfaces=True))
    inspect = partial(inspect_surface, past.folder)
    open_device = or_demo(connect)
    trends = _trends_of(past.folder)
    setup = StationSetup(
        scans, open_device, serial_ports, past, time.monotonic, now, surfaces, inspect, _write_for(), folder, plan_file(), trends=trends,
        push_from=_push_from(past.folder),
    )  # fmt: skip
    if key is not None and certificate is None:
        raise PlanError("--key belongs to a certificate; give that with --certificate")
    access = Access(host, port, certificate, key, unencrypted)
    with stop_on_ctrl_c() as stop, serve(setup, __version__, access) as server:
        _show(server, no_browser)
        typed = _standard_input()
        if typed is not None:
            threading.Thread(target=_give_addresses, args=(server, typed), name="addresses", daemon=True).start()
        while not stop.wait(_LOOK_S):
            pass
    return 0


def _trends_of(records: Path) -> "TrendLook | None":
    """What looks into the results that the station with these records pushes; None where the extra for that is not installed."""
    from cmmlink.console.trend_look import TrendLook

    def open_results() -> "ResultsDatabase":
        from cmmlink.plant import ResultsDatabase
        from cmmlink.plant_push import address_for

        return ResultsDatabase(address_for(records))

    return TrendLook(open_results, records) if find_spec("sqlalchemy") else None


def or_demo(connect: "Connect") -> "Connect":
    """Connect the device of a plan; that of the demonstration's plan is simulated, and every part of it is another one."""
    from cmmlink.demo import plan_file
    from cmmlink.plan import Plan, load_plan

    seeds, demo = itertools.count(1), load_plan(plan_file())

    def connect_any(plan: "Plan | SurfacePlan") -> "AbstractContextManager[Connected]":
        from cmmlink.from_plan import profile_of
        from cmmlink.simulated import connect_demo_device

        if isinstance(plan, Plan) and (plan.device, plan.nominal) == (demo.device, demo.nominal):
            return connect_demo_device(plan, profile_of(plan), next(seeds), None)
        return connect(plan)

    return connect_any


def run_on_page(
    plan_file: Path,
    connect: "Connect",
    output: Output,
    report: "Callable[[FinishedRun | FinishedSurface], int]",
    serial_number: str | None = None,
    operator: str | None = None,
) -> int:
    """Carry out a plan on the console's page, and stay for the next part while the page is open.

    report : prints the outcome of the first part, whose files are written already, and gives the exit code
    serial_number, operator : of the first part; None leaves what the plan says
    """
    from cmmlink.console.launch import serve, stay_while_seen
    from cmmlink.console.refused import Refused
    from cmmlink.console.station_setup import StationSetup
    from cmmlink.devices import serial_ports

    past = _past_runs(output.records)
    write = _write_for(output.out)
    setup = StationSetup(
        lambda: {plan_file.name: plan_file}, connect, serial_ports, past, time.monotonic, now, write=write, trends=_trends_of(past.folder),
        push_from=_push_from(past.folder),
    )  # fmt: skip
    with stop_on_ctrl_c() as stop, serve(setup, __version__) as server:
        station = server.station
        _show(server, output.no_browser)
        server.wait_for_page(_PAGE_OPENS_S)
        try:
            station.choose(plan_file.name)
            station.enter(serial_number, operator)
            station.start(again=True)  # where it was measured before, that was asked for here
        except Refused as refusal:
            raise PlanError(str(refusal)) from None
        job = station.job
        assert job is not None
        while not job.wait(_LOOK_S):
            if stop.is_set():
                job.abort()
        if job.failure is not None:
            raise job.failure
        assert job.finished is not None
        code = report(job.finished)
        if job.unwritten is not None:
            raise job.unwritten
        if output.out is not None and job.finished.outcome.measured:
            typer.echo(f"results in {job.finished.folder_of(output.out)}")
        if server.pages and not stop.is_set():
            sys.stderr.write("the page stays for the next part until it is closed, or Ctrl-C\n")
            stay_while_seen(server, stop)
    return code


def inspect_surface(
    records: Path, file: Path, stop: threading.Event, on_start: Callable[[int], None], on_section: "Callable[[Section], None]"
) -> tuple[str, Sequence[str]]:
    """Inspect the surface of a CT plan for the console and record its sections. Returns the outcome as a sentence, and the notes."""
    from cmmlink.plan import load_ct_plan
    from cmmlink.report import prepare, write_stack
    from cmmlink.stack import inspect_stack

    plan = load_ct_plan(file)
    prepare(plan.out.folder)
    stack = inspect_stack(
        plan,
        clock=time.monotonic,
        stop=stop,
        records=records,
        on_start=on_start,
        on_section=lambda section: on_section(_section(plan, section, file.name)),
    )
    folder = None if plan.out.folder is None else stack.folder_of(plan.out.folder, plan)
    if folder is not None:
        write_stack(folder, stack, plan.zone, plan.part.name, plan=plan)
    worst = max(section.verdict for section in stack.sections)
    count = sum(section.verdict is worst for section in stack.sections)
    words = f"{count} of {stack.asked} sections of {plan.mesh.file.name} {VERDICT_WORDS[worst]}"
    return f"{words}. Results in {folder}" if folder is not None else words, stack.notes


def _section(plan: "CtPlan", outcome: "SectionOutcome", plan_name: str) -> "Section":
    from cmmlink.buffer import CAPACITY_POINTS
    from cmmlink.console.ct_import import Section
    from cmmlink.endings import Ended
    from cmmlink.from_plan import zone_of
    from cmmlink.run_context import RunContext

    height_mm, run = outcome.slice.height_mm, outcome.run
    title = f"Section at height {height_mm:.3f} mm of {plan.mesh.file.name}"
    zone, coverage_min = zone_of(plan, outcome.profile), plan.registration.coverage_min
    context = RunContext(title, plan_name, outcome.profile, zone, coverage_min, CAPACITY_POINTS, now(), "section")
    ended = Ended(run.ending, str(run.refusal or ""), outcome.result_json(), run.result.blocks if run.result is not None else None)
    return Section(height_mm, context, outcome.started, ended, outcome.warnings)


def _push_from(records: Path) -> Path | None:
    """The folder whose results are pushed; None where the extra for that is missing and nobody has asked for it."""
    from importlib.util import find_spec

    from cmmlink.plant_push import SETTINGS_FILE

    return records if find_spec("sqlalchemy") or (records / SETTINGS_FILE).exists() else None


def _past_runs(folder: Path | None) -> "PastRuns":
    from cmmlink.console.past_runs import PastRuns
    from cmmlink.devices import decoder_of

    return PastRuns(records_folder(folder), decoder_of, time.monotonic, now)


def _write_for(out: Path | None = None) -> "Callable[[FinishedRun | FinishedSurface], None]":
    """Return the function that writes the results of each run: into `out`, or else into the folder that its plan names."""
    from cmmlink.report import write_run, write_surface_run
    from cmmlink.run import FinishedRun

    def write(run: "FinishedRun | FinishedSurface") -> None:
        folder = out or run.plan.out.folder
        if folder is None or not run.outcome.measured:
            return
        if isinstance(run, FinishedRun):
            write_run(run.folder_of(folder), run)
        else:
            write_surface_run(run.folder_of(folder), run)

    return write


def _show(server: "ConsoleServer", no_browser: bool) -> None:
    """Say where the page is, and open it. The browser's address is its own, because the printed one may be used elsewhere."""
    from cmmlink.console.browser import graphical_browser

    sys.stderr.write(f"console: {server.new_address()}\n")
    if server.encryption is not None:
        sys.stderr.write(f"certificate: SHA-256 {server.encryption.fingerprint}\n")
    elif server.remote:
        sys.stderr.write("WARNING: the console is open to the network, unencrypted; whoever listens there can control it\n")
    sys.stderr.flush()
    browser = None if no_browser else graphical_browser()
    if browser is not None:
        browser.open(server.new_address())


def _give_addresses(server: "ConsoleServer", typed: int) -> None:
    """Print another address for every line that is typed; `new` turns out every page before.

    typed : a descriptor, because a buffered file that is being read when the program ends is a fatal error of Python
    """
    if hasattr(signal, "SIGTTIN"):  # a program in the background would be stopped, with its measurement, for reading here
        signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGTTIN])  # of this thread; reading fails instead
    with suppress(OSError):
        while lines := os.read(typed, 4096).splitlines():
            for line in lines:
                if line.strip().lower() == b"new":
                    server.renew()
                sys.stderr.write(f"console: {server.new_address()}\n")
            sys.stderr.flush()


def _standard_input() -> int | None:
    """The descriptor of standard input, None where there is none."""
    try:
        return sys.stdin.fileno()
    except (AttributeError, OSError, ValueError):
        return None


def _plans_in(folder: Path, surfaces: bool) -> dict[str, Path]:
    """The plans of scans in a folder, or those of CT surfaces."""
    files = (path for path in sorted(folder.iterdir()) if path.suffix in (".yaml", ".yml") and path.is_file())
    return {path.name: path for path in files if _is_of_surface(path) == surfaces}


def _is_of_surface(plan_file: Path) -> bool:
    try:
        with plan_file.open("rb") as opened:
            return re.search(rb"^mesh\s*:", opened.read(_LONGEST_PLAN), re.MULTILINE) is not None
    except OSError:
        return False
