"""The commands; the one place where parts are chosen and joined, and where errors become exit codes.

0 conform, 1 nonconform, 3 uncertain; 2 unusable input or plan, 4 device or link failure, 5 the record could not be kept.
"""

import io
import itertools
import json
import math
import os
import platform
import re
import signal
import subprocess
import sys
import tempfile
import textwrap
import threading
import time
import traceback
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager, nullcontext, suppress
from dataclasses import asdict, dataclass, replace
from datetime import datetime
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from platformdirs import user_data_path
from rich.console import Console

from cmmlink import __version__
from cmmlink.commands.open3d_doctor import look_after_open3d
from cmmlink.commands.surfaces import ManyHeights, SectionBar, given, own_nominals, plan_from, print_stack
from cmmlink.console.ct_import import Section
from cmmlink.console.launch import CONSOLE_PORT, graphical_browser, kept_token, served, stay_while_seen
from cmmlink.console.past_runs import PastRuns
from cmmlink.console.station import Connected, Means, Refused
from cmmlink.demo import plan_file as demo_plan_file
from cmmlink.demo import write_part_path
from cmmlink.errors import PlanError, RunError, StoreError
from cmmlink.events import RunStarted, Sink
from cmmlink.from_plan import planned_inspection, planned_profile, profile_of
from cmmlink.nominal_files import NominalFile, load_nominal, material_side
from cmmlink.pipeline import RunOutcome, run_inspection
from cmmlink.plan.scan import Device, FileDevice, ModbusDevice, Plan, SerialDevice, load_plan, place_of
from cmmlink.plan.surface import CtPlan, load_ct_plan
from cmmlink.record.export import export_run
from cmmlink.record.reader import check_chain, default_folder, describe, find_run, list_runs, reading, recorded_run, recording
from cmmlink.record.recorder import Basis, Evidence, Recorder
from cmmlink.record.replay import Replay
from cmmlink.record.replay import replay as replayed
from cmmlink.report.folder import prepare, write_results
from cmmlink.report.stack_folder import write_stack
from cmmlink.report.terminal import LiveTable, print_summary
from cmmlink.result_json import identity, summary
from cmmlink.run_view import Ended, RunContext
from cmmlink.stack import SectionOutcome, inspect_stack
from cmmlink.words import VERDICT_WORDS
from drivers import (
    Decoder,
    DeviceError,
    LinkError,
    MeshError,
    PointFileError,
    PointFileSource,
    RegisterDecoder,
    ScanSource,
    decoder,
    load_map,
)
from drivers.links.axis import Beam, ConstantFeed, FollowedAxis
from drivers.links.serial_scanner import SerialScanner, ports
from inspection import InspectionError, LiveInspection, NominalProfile, ToleranceZone, Verdict, rehearse, while_compiling

if TYPE_CHECKING:
    from cmmlink.console.server import ConsoleServer

app = typer.Typer(
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 120},
)

_EXIT = {Verdict.CONFORM: 0, Verdict.NONCONFORM: 1, Verdict.UNCERTAIN: 3}
_UNUSABLE, _DEVICE_FAILED, _NO_RECORD = 2, 4, 5
_STOPPED = 130  # Ctrl-C outside a run, as shells and typer have it
_BUFFER_POINTS = 500_000
_SIMULATOR_STARTS_S = 20.0
_DEMO_RATE_HZ, _DEMO_POINTS = 2000, 4000
_PAGE_OPENS_S = 20.0  # a run waits so long for the page that is to show it
_LOOK_S = 0.2
_LONGEST_PLAN = 200_000

Connect = Callable[[Plan], AbstractContextManager[Connected]]
PlanFile = Annotated[Path, typer.Argument(metavar="PLAN.yaml", help="The inspection plan.")]
Json = Annotated[bool, typer.Option("--json", help="Print one JSON object instead of words.")]
RejectOutliers = Annotated[
    bool, typer.Option("--reject-outliers", help="Fit without gross outliers and reject them; conform is then not proven.")
]
Out = Annotated[Path | None, typer.Option("--out", metavar="DIR", help="Folder for deviations.csv, result.json and profile.png.")]
Records = Annotated[Path | None, typer.Option("--records", metavar="DIR", help="Folder of the run records.")]
RunName = Annotated[str, typer.Argument(metavar="RUN", help="The id of a run, the beginning of one, or last.")]
Headless = Annotated[bool, typer.Option("--headless", help="No page, no live table.")]
NoBrowser = Annotated[bool, typer.Option("--no-browser", help="Serve the page and print its address, but open no browser.")]


class Side(StrEnum):
    """Side of the direction of travel."""

    LEFT = "left"
    RIGHT = "right"


class FitName(StrEnum):
    """How points come onto the nominal."""

    BEST_FIT = "best-fit"
    MINIMUM_ZONE = "minimum-zone"
    NONE = "none"


class CutterName(StrEnum):
    """What cuts a surface."""

    AUTO = "auto"
    OPEN3D = "open3d"
    NUMPY = "numpy"


class MethodName(StrEnum):
    """How deviations are found."""

    EXACT = "exact"
    CIRCLE = "circle"
    CHORD = "chord"
    PCP = "pcp"
    VEAW = "veaw"
    INVERSION = "inversion"


@dataclass(frozen=True, slots=True)
class Telling:
    """How a command tells what it found."""

    headless: bool
    as_json: bool
    out: Path | None
    records: Path | None = None
    no_browser: bool = False

    @property
    def on_page(self) -> bool:
        """Whether the run is shown on the console's page: where somebody can see it."""
        quiet = self.headless or self.as_json
        return not quiet and (self.no_browser or (sys.stderr.isatty() and graphical_browser() is not None))


def main() -> None:
    """Run the command line; every error a user can cause ends as one message and an exit code."""
    _speak_somehow()
    try:
        with while_compiling(_say_that_it_compiles):
            code = app(prog_name="cmmlink", standalone_mode=False)
        sys.stdout.flush()
        if code == _STOPPED:
            _fail("stopped by the operator", _STOPPED)
    except typer.TyperException as error:
        code = _fail(_usage(error), _UNUSABLE)
    except (PlanError, RunError, InspectionError, PointFileError, MeshError) as error:
        code = _fail(str(error), _UNUSABLE)
    except DeviceError as error:
        code = _fail(str(error), _DEVICE_FAILED)
    except StoreError as error:
        code = _fail(str(error), _NO_RECORD)
    except OSError as error:
        code = _fail(str(error) if error.filename else f"the answer could not be written: {error}", _UNUSABLE)
        _hush()
    except SystemExit as ended:  # typer ends with 1 when nobody reads on, which would say that a part does not conform
        code = _UNUSABLE if ended.code == 1 else ended.code
    except Exception as error:  # likewise a defect must not end with 1
        traceback.print_exc()
        code = _fail(f"a defect of cmmlink, please report it: {error}", _UNUSABLE)
    sys.exit(code or 0)


def _speak_somehow() -> None:
    """Have streams to write to, and letters that they cannot show replaced: a verdict is not lost to a name in another script."""
    sys.stdout = sys.stdout or open(os.devnull, "w", encoding="utf-8")  # noqa: SIM115 - for as long as the program runs
    sys.stderr = sys.stderr or open(os.devnull, "w", encoding="utf-8")  # noqa: SIM115
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="replace")


def _hush() -> None:
    """Let what is still to be written to a broken standard output go nowhere, or the interpreter fails once more at its end."""
    with suppress(OSError):
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _say_that_it_compiles() -> None:
    sys.stderr.write("cmmlink: compiling the inspection, once after an installation, up to half a minute\n")


def _usage(error: typer.TyperException) -> str:
    """What is wrong with the arguments, and where to read what is right."""
    context = getattr(error, "ctx", None)
    command = context.command_path if context else "cmmlink"
    problem = " ".join(error.format_message().replace("Value error, ", "").rstrip(".").split())
    return f"{problem}; `{command} --help` shows what is allowed"


def _fail(message: str, code: int) -> int:
    sys.stderr.write(f"cmmlink: {message}\n")
    return code


@app.callback(invoke_without_command=True)
def cmmlink(
    context: typer.Context,
    version: Annotated[bool, typer.Option("--version", help="Show the version and exit.")] = False,
) -> None:
    """Acquire points from coordinate measuring machines and scanners and judge every one against the nominal profile as it arrives.

    Exit status: 0 conform, 1 nonconform, 3 uncertain; 2 unusable input or plan, 4 device or link failure, 5 the record could not be kept.
    """
    if version:
        typer.echo(f"cmmlink {__version__}")
        raise typer.Exit
    if context.invoked_subcommand is None:
        typer.echo(context.get_help())
        raise typer.Exit(_UNUSABLE)


@app.command()
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
    plan = load_plan(demo_plan_file())
    profile = _checked_profile(plan, demo_plan_file())
    bump = None if defect is None else _defect(defect, profile.length_mm)
    prepare(out)
    telling = Telling(headless, as_json, out, records, no_browser)
    if telling.on_page:
        seeds = itertools.count(seed)
        return _run_on_page(demo_plan_file(), profile, lambda plan: _demo_device(plan, profile, next(seeds), bump), telling)
    with _demo_device(plan, profile, seed, bump) as device:
        return _run(plan, profile, device, telling)


@contextmanager
def _demo_device(plan: Plan, profile: NominalProfile, seed: int, defect: tuple[float, float] | None) -> Iterator[Connected]:
    """The demonstration's simulated device, for one part."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "path.csv"
        write_part_path(profile.curve, path)
        with _simulator("serial", ["--path", str(path), *_demo_motion(plan, profile, seed, defect)]) as address:
            source, device = _source_of(plan.with_address(address))
            yield Connected(source, device, simulated=True)


def _demo_motion(plan: Plan, profile: NominalProfile, seed: int, defect: tuple[float, float] | None) -> list[str]:
    """Arguments of the simulator: form error and noise well inside the tolerance, an arbitrary pose on the table."""
    zone = plan.tolerance.zone
    speed = profile.length_mm * _DEMO_RATE_HZ / _DEMO_POINTS
    motion = {
        "rate": _DEMO_RATE_HZ,
        "speed": speed,
        "count": _DEMO_POINTS,
        "seed": seed,
        "form-error-mm": 0.4 * zone.upper_mm,
        "noise-mm": 0.04 * zone.upper_mm,
        "tip-radius-mm": plan.probe.tip_radius_mm,
        "rotation-deg": 37.0 + 11.0 * (seed % 30),
    }
    arguments = [text for name, value in motion.items() for text in (f"--{name}", f"{value:.17g}")]
    arguments += ["--translation-mm", "210", "145", "60"]
    if defect is not None:
        arguments += ["--defect-mm", str(defect[0]), "--defect-station-mm", str(defect[1])]
    return arguments


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


@contextmanager
def _simulator(device: str, arguments: Sequence[str]) -> Iterator[str]:
    """A simulated device as a process of its own; gives the address it serves."""
    address = "127.0.0.1:0" if sys.platform == "win32" else "pty"
    command = [sys.executable, "-m", "cmmlink", "simulate", device, "--address", address, *arguments]
    # In a session of its own: Ctrl-C is for the run, which then stops the device.
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True)
    assert process.stdout is not None
    assert process.stderr is not None
    with process.stdout, process.stderr:
        try:
            served = process.stdout.readline().strip()
            if not served:
                raise LinkError(f"the simulated device did not start: {process.stderr.read().strip()}")
            yield served
        finally:
            process.terminate()
            process.wait(_SIMULATOR_STARTS_S)


@app.command()
def run(
    plan_file: PlanFile,
    headless: Headless = False,
    out: Out = None,
    records: Records = None,
    as_json: Json = False,
    no_browser: NoBrowser = False,
) -> int:
    """Acquire and inspect with the device of a plan."""
    plan = load_plan(plan_file)
    profile = _checked_profile(plan, plan_file)
    prepare(out or plan.out)
    telling = Telling(headless, as_json, out or plan.out, records or plan.records, no_browser)
    if telling.on_page:
        return _run_on_page(plan_file, profile, _connected, telling)
    with _connected(plan) as device:
        return _run(plan, profile, device, telling)


@contextmanager
def _connected(plan: Plan) -> Iterator[Connected]:
    source, device = _source_of(plan)
    yield Connected(source, device, simulated=False)


def _checked_profile(plan: Plan, plan_file: Path) -> NominalProfile:
    """The profile of a plan whose other values, too, are fit for it; a PlanError names file, line and key."""
    with _naming(plan_file, "nominal.file"):
        profile = planned_profile(plan)
    with _naming(plan_file, "probe.tip_radius_mm"):
        planned_inspection(plan, profile)
    return profile


@contextmanager
def _naming(plan_file: Path, key: str) -> Iterator[None]:
    """Put the place in the plan before what is wrong with a value."""
    try:
        yield
    except ValueError as error:
        raise PlanError(f"{place_of(plan_file, key)}: {error}") from None


def _run(plan: Plan, profile: NominalProfile, device: Connected, telling: Telling) -> int:
    """Carry out a plan and tell what came of it."""
    rehearse(profile, plan.registration.method, plan.registration.reject_outliers)
    live = planned_inspection(plan, profile)
    started = RunStarted(plan.part.name, plan.part.serial_number or "", plan.operator or "", device.device, device.simulated)
    table = LiveTable(Console(stderr=True), plan.tolerance.zone)
    quiet = telling.headless or telling.as_json or not sys.stderr.isatty()
    with (
        recording(telling.records or default_folder(), _today) as store,
        Recorder(store, Basis.of(plan), clock=time.monotonic, today=_today) as recorder,
        nullcontext() if quiet else table,
    ):
        outcome = _carry_out(device.source, live, started, [recorder, *([] if quiet else [table])], plan.buffer_points)
    return _tell(outcome, profile, telling, started, recorder.evidence)


def _run_on_page(plan_file: Path, profile: NominalProfile, connect: Connect, telling: Telling) -> int:
    """Carry out a plan on the console's page, and stay for the next part while the page is open."""
    past = _past_runs(telling.records)
    write = _writing(past, telling.out)
    means = Means(lambda: {plan_file.name: plan_file}, connect, ports, past, time.monotonic, _today, write=write)
    with _stopped_by_ctrl_c() as stop, served(means, __version__) as server:
        station = server.station
        _show(server, telling.no_browser)
        server.wait_for_page(_PAGE_OPENS_S)
        try:
            station.choose(plan_file.name)
            station.start()
        except Refused as refusal:
            raise PlanError(str(refusal)) from None
        while not station.wait(_LOOK_S):
            if stop.is_set():
                station.abort()
        if station.failure is not None:
            raise station.failure
        assert station.outcome is not None
        assert station.started is not None
        code = _tell(station.outcome, profile, replace(telling, out=None), station.started, past.evidence)
        if station.unwritten is not None:
            raise station.unwritten
        if telling.out is not None:
            typer.echo(f"results in {telling.out}")
        if server.pages and not stop.is_set():
            sys.stderr.write("the page stays for the next part until it is closed, or Ctrl-C\n")
            stay_while_seen(server, stop)
    return code


def _past_runs(folder: Path | None) -> PastRuns:
    return PastRuns(folder or default_folder(), decoder_of, time.monotonic, _today)


def _show(server: "ConsoleServer", no_browser: bool) -> None:
    """Say where the page is, and open it."""
    sys.stderr.write(f"console: {server.address}\n")
    if server.remote:
        sys.stderr.write("WARNING: the console is open to the network, unencrypted; whoever knows this address can control it\n")
    sys.stderr.flush()
    browser = None if no_browser else graphical_browser()
    if browser is not None:
        browser.open(server.address)


def _today() -> datetime:
    return datetime.now().astimezone()


def _source_of(plan: Plan) -> tuple[ScanSource, str]:
    """The source that a plan's device is, and how to call it."""
    device = plan.device
    if isinstance(device, FileDevice):
        return PointFileSource(device.file, device.scale), f"file {device.file.name}"
    try:
        return _on_its_axis(device), f"{device.type} {device.address}"
    except ValueError as error:
        raise PlanError(f"device: {error}") from None


def _on_its_axis(device: SerialDevice | ModbusDevice) -> ScanSource:
    """The source of a device, with its distances made points where the plan has an axis."""
    source, axis = _link_of(device), device.axis
    if axis is None:
        return source
    beam = Beam(axis.origin_mm, axis.distance_direction, axis.axis_direction)
    if axis.follow is not None:
        return FollowedAxis(source, _link_of(axis.follow), beam)
    assert axis.feed_mm_s is not None
    return ConstantFeed(source, beam, axis.feed_mm_s)


def _link_of(device: SerialDevice | ModbusDevice) -> ScanSource:
    if isinstance(device, SerialDevice):
        return SerialScanner(
            device.address,
            decoder(device.format, **device.options),
            baud_rate=device.baud_rate,
            parity=device.parity,
            silence_s=device.silence_s,
            reconnect_s=device.reconnect_s,
        )
    from drivers.links.modbus_scanner import ModbusScanner  # noqa: PLC0415 - pymodbus is loaded for those who need it

    return ModbusScanner(
        device.address,
        load_map(device.map),
        device_id=device.device_id,
        count=device.points,
        baud_rate=device.baud_rate,
        parity=device.parity,
        timeout_s=device.timeout_s,
        silence_s=device.silence_s,
        reconnect_s=device.reconnect_s,
    )


def decoder_of(device: Device) -> Decoder | None:
    """The decoder of what a device sends; None where its points themselves are what is recorded."""
    if isinstance(device, FileDevice) or device.axis is not None:
        return None
    if isinstance(device, SerialDevice):
        return decoder(device.format, **device.options)

    return RegisterDecoder(load_map(device.map), count=device.points)


@contextmanager
def _stopped_by_ctrl_c() -> Iterator[threading.Event]:
    """An event that Ctrl-C sets; a second one ends at once."""
    stop = threading.Event()

    def interrupted(*_: object) -> None:
        stop.set()
        signal.signal(signal.SIGINT, before)

    before = signal.signal(signal.SIGINT, interrupted)
    try:
        yield stop
    finally:
        signal.signal(signal.SIGINT, before)


def _carry_out(source: ScanSource, live: LiveInspection, started: RunStarted, sinks: Sequence[Sink], buffer_points: int) -> RunOutcome:
    """Run to the end, or to Ctrl-C."""
    with _stopped_by_ctrl_c() as stop:
        return run_inspection(source, live, sinks, started, buffer_points=buffer_points, clock=time.monotonic, stop=stop)


def _facts(outcome: RunOutcome, started: RunStarted, evidence: Evidence | None) -> dict[str, Any]:
    return summary(outcome.result, outcome.counts) | identity(started) | (asdict(evidence) if evidence else {})


def _writing(past: PastRuns, out: Path | None = None) -> Callable[[Plan, NominalProfile, RunOutcome, RunStarted], None]:
    """What writes the results of every run on a page into a folder, or into that of its plan."""

    def write(plan: Plan, profile: NominalProfile, outcome: RunOutcome, started: RunStarted) -> None:
        folder = out or plan.out
        if folder is not None:
            write_results(folder, _facts(outcome, started, past.evidence), outcome.result, profile, _title(started))

    return write


def _tell(outcome: RunOutcome, profile: NominalProfile, telling: Telling, started: RunStarted, evidence: Evidence | None = None) -> int:
    """Write and print the outcome, each whatever happens to the other; the exit code."""
    facts = _facts(outcome, started, evidence)
    message = str(outcome.failure or outcome.refusal or "")
    if outcome.ending == "aborted":
        message = message or "stopped by the operator: the scan is not complete"
    if message:
        sys.stderr.write(f"cmmlink: {message}\n")
    written: Sequence[str] = ()
    try:
        if telling.out is not None:
            written = write_results(telling.out, facts, outcome.result, profile, _title(started))
    finally:
        if telling.as_json:
            _print_json(facts)
        else:
            heading = f"{_title(started)}, {started.device}"
            print_summary(Console(highlight=False, soft_wrap=not sys.stdout.isatty()), outcome.result, outcome.counts, heading)
    if written and not telling.as_json:
        typer.echo(f"results in {telling.out}: {', '.join(written)}")
    if evidence is not None and not telling.as_json:
        typer.echo(f"recorded as run {evidence.run}")
    if outcome.failure is not None:
        return _DEVICE_FAILED
    return _UNUSABLE if outcome.result is None else _EXIT[outcome.result.verdict]


def _title(started: RunStarted) -> str:
    return " ".join(filter(None, [started.part, started.serial_number, "(SIMULATED)" if started.simulated else ""]))


def _print_json(facts: dict[str, Any]) -> None:
    typer.echo(json.dumps(facts))


@app.command()
def inspect(
    points: Annotated[Path, typer.Argument(metavar="POINTS", help="Measured points: csv, txt, asc, xyz or npy.")],
    nominal: Annotated[Path, typer.Option(metavar="FILE", help="The nominal profile.")],
    tolerance: Annotated[tuple[float, float], typer.Option(metavar="LO HI", help="Deviations allowed, mm, positive out of material.")],
    method: Annotated[MethodName, typer.Option(help="How deviations are found.")] = MethodName.EXACT,
    fit: Annotated[FitName, typer.Option(help="How points come onto the nominal.")] = FitName.BEST_FIT,
    tip_radius: Annotated[float, typer.Option(metavar="R", help="The points are centres of a ball of this radius, mm.")] = 0.0,
    uncertainty: Annotated[float, typer.Option(metavar="U", help="Expanded uncertainty of a deviation, mm.")] = 0.0,
    scale: Annotated[float, typer.Option(metavar="S", help="Units of the nominal file to mm (a chord, for airfoils).")] = 1.0,
    closed: Annotated[bool | None, typer.Option("--closed/--open", help="Close the nominal, or leave it open.")] = None,
    material: Annotated[Side | None, typer.Option(help="Side of the material, seen along the nominal.")] = None,
    coverage_min: Annotated[
        float, typer.Option(min=0, max=1, metavar="SHARE", help="Share of the nominal to be measured before conform is proven.")
    ] = 0.95,
    reject_outliers: RejectOutliers = False,
    out: Out = None,
    as_json: Json = False,
) -> int:
    """Inspect a file of points."""
    zone = _zone(tolerance, uncertainty)
    if reject_outliers and fit is FitName.NONE:
        raise PlanError("--reject-outliers needs a fit: outliers are found by fitting the other points. Leave out --fit none")
    profile = profile_of(load_nominal(nominal, scale, closed), nominal, material.value if material else None)
    source = PointFileSource(points)
    try:
        live = LiveInspection(
            profile,
            zone,
            fit=fit.value,
            method=method.value,
            tip_radius_mm=tip_radius,
            coverage_min=coverage_min,
            reject_outliers=reject_outliers,
        )
    except ValueError as error:
        raise PlanError(f"--tip-radius {tip_radius:g}: {error}") from None
    prepare(out)
    started = RunStarted(points.stem, "", "", f"file {points.name}", False)
    outcome = _carry_out(source, live, started, [], _BUFFER_POINTS)
    if outcome.refusal is not None:
        raise PlanError(f"{points}: {outcome.refusal}")
    return _tell(outcome, profile, Telling(True, as_json, out), started)


def _zone(tolerance: tuple[float, float], uncertainty: float) -> ToleranceZone:
    limits = f"--tolerance {tolerance[0]:g} {tolerance[1]:g}"
    try:
        return replace(ToleranceZone(*tolerance), uncertainty_mm=uncertainty)
    except ValueError as error:
        option = f"{limits} --uncertainty {uncertainty:g}" if uncertainty else limits
        raise PlanError(f"{option}: {error}") from None


@app.command(cls=ManyHeights)
def ct(
    context: typer.Context,
    mesh: Annotated[Path, typer.Argument(metavar="MESH", help="Surface: STL, PLY, OBJ; or a plan (YAML) of all that follows.")],
    nominal: Annotated[Path | None, typer.Option(metavar="FILE", help="The nominal profile.")] = None,
    tolerance: Annotated[
        tuple[float, float] | None, typer.Option(metavar="LO HI", help="Deviations allowed, mm, positive out of material.")
    ] = None,
    normal: Annotated[tuple[float, float, float], typer.Option(metavar="X Y Z", help="The part's axis in the scan.")] = (0.0, 0.0, 1.0),
    heights: Annotated[list[float] | None, typer.Option(metavar="H [H ...]", help="Heights of the sections along the normal, mm.")] = None,
    every: Annotated[float | None, typer.Option(metavar="STEP", help="A section every STEP mm, in place of --heights.")] = None,
    start: Annotated[float | None, typer.Option("--from", metavar="A", help="First height with --every.")] = None,
    end: Annotated[float | None, typer.Option("--to", metavar="B", help="Last height with --every.")] = None,
    nominal_at: Annotated[list[str] | None, typer.Option(metavar="HEIGHT FILE", help="Another nominal for one section.")] = None,
    method: Annotated[MethodName, typer.Option(help="How deviations are found.")] = MethodName.EXACT,
    fit: Annotated[FitName, typer.Option(help="How each section comes onto its nominal.")] = FitName.BEST_FIT,
    uncertainty: Annotated[float, typer.Option(metavar="U", help="Expanded uncertainty of a deviation, mm.")] = 0.0,
    scale: Annotated[float, typer.Option(metavar="S", help="Units of the nominal file to mm (a chord, for airfoils).")] = 1.0,
    mesh_scale: Annotated[float, typer.Option(metavar="S", help="Units of the surface file to mm.")] = 1.0,
    closed: Annotated[bool | None, typer.Option("--closed/--open", help="Close the nominal, or leave it open.")] = None,
    material: Annotated[Side | None, typer.Option(help="Side of the material, seen along the nominal.")] = None,
    coverage_min: Annotated[float, typer.Option(help="Share of a nominal to be there before conform is proven.")] = 0.95,
    reject_outliers: RejectOutliers = False,
    cutter: Annotated[CutterName, typer.Option(help="auto: Open3D, and numpy for more than 50 sections; same points.")] = CutterName.AUTO,
    weld: Annotated[float, typer.Option(metavar="MM", help="Loose ends no farther apart are one point.")] = 1e-6,
    shortest: Annotated[float | None, typer.Option(metavar="MM", help="Shorter pieces are dust; 5 % of the longest if not given.")] = None,
    pictures: Annotated[bool, typer.Option("--pictures/--no-pictures", help="Draw them into the folder of --out.")] = True,
    out: Out = None,
    as_json: Json = False,
) -> int:
    """Inspect sections of a CT surface."""
    if mesh.suffix.lower() in (".yaml", ".yml"):
        beside = [name for name in given(context) if name not in ("mesh", "out", "as_json", "pictures")]
        if beside:
            raise PlanError(f"{mesh}: --{beside[0].replace('_', '-')} stands beside a plan, which says it all itself: set it in the plan")
        return _ct(load_ct_plan(mesh), Telling(False, as_json, out), pictures)
    if nominal is None or tolerance is None:
        raise PlanError(f"{mesh}: a surface needs --nominal FILE and --tolerance LO HI")
    settings: dict[str, object] = {
        "part": {"name": mesh.stem},
        "mesh": {"file": mesh, "scale": mesh_scale},
        "nominal": {"file": nominal, "scale": scale, "closed": closed, "material": material.value if material else None},
        "tolerance": {"lower_mm": tolerance[0], "upper_mm": tolerance[1], "uncertainty_mm": uncertainty},
        "sections": {
            "normal": normal,
            "heights_mm": tuple(heights or ()),
            "every_mm": every,
            "from_mm": start,
            "to_mm": end,
            "nominal_at": own_nominals(nominal_at or ()),
        },
        "cut": {"cutter": cutter.value, "weld_mm": weld, "shortest_mm": shortest},
        "registration": {"fit": fit.value, "method": method.value, "coverage_min": coverage_min, "reject_outliers": reject_outliers},
    }
    return _ct(plan_from(settings), Telling(False, as_json, out), pictures)


def _ct(plan: CtPlan, telling: Telling, pictures: bool) -> int:
    """Inspect a stack, with a progress bar, and tell and write what came of it, each whatever happens to the other."""
    folder = telling.out or plan.out
    prepare(folder)
    bar = SectionBar(Console(stderr=True), visible=not telling.as_json and sys.stderr.isatty())
    steps: list[Callable[[], None]] = []
    with bar.shown(), _stopped_by_ctrl_c() as stop:
        stack = inspect_stack(
            plan,
            clock=time.monotonic,
            stop=stop,
            on_start=lambda sections: steps.append(bar.round("inspected", sections)),
            on_section=lambda _: steps[0](),
        )
    try:
        if folder is not None:
            with bar.shown():
                done = bar.round("written", len(stack.sections))
                write_stack(folder, stack, plan.tolerance.zone, plan.part.name, pictures=pictures, on_section=done)
    finally:
        if telling.as_json:
            _print_json(stack.facts())
        else:
            print_stack(Console(highlight=False, soft_wrap=not sys.stdout.isatty()), stack)
    if folder is not None and not telling.as_json:
        typer.echo(f"results in {folder}: result.json, sections.csv, a folder for each section{', stack.png' if pictures else ''}")
    return _EXIT[stack.verdict]


@app.command()
def nominal(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="The nominal profile: UIUC dat, points, or nurbs yaml.")],
    scale: Annotated[float, typer.Option(metavar="S", help="Units of the file to mm.")] = 1.0,
    closed: Annotated[bool | None, typer.Option("--closed/--open", help="Close the nominal, or leave it open.")] = None,
    as_json: Json = False,
) -> int:
    """Show what was understood of a nominal file."""
    understood = load_nominal(file, scale, closed)
    if as_json:
        _print_json(_nominal_facts(understood))
        return 0
    curve = understood.curve
    typer.echo(f"{file}: {understood.source_format}, degree {curve.degree}, {len(curve.control_points_mm)} control points")
    typer.echo(f"{'closed' if curve.closed else 'open'}, length {curve.length_mm:.4f} mm, corners {len(curve.corners)}")
    for note in understood.notes:
        typer.echo(f"  {note}")
    return 0


def _nominal_facts(understood: NominalFile) -> dict[str, Any]:
    curve = understood.curve
    assert curve.weights is not None
    return {
        "degree": curve.degree,
        "knots": curve.knots.tolist(),
        "control_points_mm": curve.control_points_mm.tolist(),
        "weights": curve.weights.tolist(),
        "closed": curve.closed,
        "length_mm": curve.length_mm,
        "source_format": understood.source_format,
        "corners": len(curve.corners),
        "material": material_side(curve),
        "notes": list(understood.notes),
    }


@app.command()
def check(plan_file: PlanFile) -> int:
    """Check a plan and what it names, not the device."""
    plan = load_plan(plan_file)
    profile = _checked_profile(plan, plan_file)
    with _naming(plan_file, "device"):
        _, device = _source_of(plan)
    zone = plan.tolerance.zone
    typer.echo(f"{plan_file} can be run: {plan.part.name}, zone {zone.lower_mm:+g} .. {zone.upper_mm:+g} mm, {device}")
    typer.echo(f"nominal {profile.length_mm:.3f} mm long, {len(profile)} samples, material on the {profile.material}")
    return 0


@app.command("console")
def serve_console(
    folder: Annotated[Path, typer.Argument(metavar="[FOLDER]", help="Folder of the station's plans.")] = Path(),
    host: Annotated[str, typer.Option(help="Address to serve; another than 127.0.0.1 opens the console to the network.")] = "127.0.0.1",
    port: Annotated[int, typer.Option(min=0, max=65535, help="0 takes a free one.")] = CONSOLE_PORT,
    no_browser: NoBrowser = False,
    records: Records = None,
) -> int:
    """Serve the operator console: plans, runs, history and CT import of this station on one page."""
    if not folder.is_dir():
        raise PlanError(f"{folder}: there is no such folder; give the folder that holds the plans")
    past = _past_runs(records)
    scans, surfaces = (lambda: _plans_in(folder, surfaces=False)), (lambda: _plans_in(folder, surfaces=True))
    means = Means(scans, _connected, ports, past, time.monotonic, _today, surfaces, _inspect_surface, _writing(past))
    token = kept_token(user_data_path("cmmlink", appauthor=False))
    with _stopped_by_ctrl_c() as stop, served(means, __version__, host, port, token) as server:
        _show(server, no_browser)
        while not stop.wait(_LOOK_S):
            pass
    return 0


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


def _inspect_surface(file: Path, stop: threading.Event, on_start: Callable[[int], None], on_section: Callable[[Section], None]) -> str:
    """Inspect the surface of a CT plan for the console; what came of it in one sentence."""
    plan = load_ct_plan(file)
    prepare(plan.out)
    stack = inspect_stack(
        plan, clock=time.monotonic, stop=stop, on_start=on_start, on_section=lambda section: on_section(_section(plan, section, file.name))
    )
    if plan.out is not None:
        write_stack(plan.out, stack, plan.tolerance.zone, plan.part.name, pictures=False)
    told = [f"{VERDICT_WORDS[stack.verdict]}: {len(stack.sections)} sections of {plan.mesh.file.name}", *stack.notes]
    return ". ".join([*told, *([f"Results in {plan.out}"] if plan.out is not None else [])])


def _section(plan: CtPlan, outcome: SectionOutcome, plan_name: str) -> Section:
    height_mm, run = outcome.slice.height_mm, outcome.run
    title = f"Section at height {height_mm:.3f} mm of {plan.mesh.file.name}"
    context = RunContext(title, plan_name, outcome.profile, plan.tolerance.zone, plan.registration.coverage_min, _BUFFER_POINTS, _today())
    started = RunStarted(plan.part.name, plan.part.serial_number or "", "", plan.mesh.file.name, simulated=False)
    ended = Ended(run.ending, str(run.refusal or ""), outcome.facts(), run.result)
    return Section(height_mm, context, started, ended, outcome.warnings)


@app.command()
def doctor() -> int:
    """Look at what cmmlink needs of this computer, and mend or name what is missing."""
    typer.echo(f"cmmlink {__version__} on Python {platform.python_version()}, {platform.system()} {platform.machine()}")
    rehearse(planned_profile(load_plan(demo_plan_file())))
    typer.echo("inspection: compiled and working")
    folder = default_folder()
    nearest = next(path for path in (folder, *folder.parents) if path.exists())
    writable = os.access(nearest, os.W_OK)
    typer.echo(f"records: {folder}" + ("" if writable else f" cannot be written: choose another folder with --records ({nearest})"))
    typer.echo(f"serial ports: {', '.join(name for name, _ in ports()) or 'none found'}")
    whole = look_after_open3d(typer.echo)
    return 0 if whole and writable else _UNUSABLE


@app.command("ports")
def list_ports() -> int:
    """List the serial ports of this computer."""
    found = ports()
    for name, description in found:
        typer.echo(f"{name}\t{description}")
    if not found:
        typer.echo("no serial port was found")
    return 0


@app.command(add_help_option=False, context_settings={"allow_extra_args": True, "ignore_unknown_options": True})
def simulate(context: typer.Context, device: Annotated[str, typer.Argument(metavar="DEVICE")] = "") -> int:
    """Serve a simulated device."""
    from simulators import known_devices, say, settings_from  # noqa: PLC0415 - only this command knows simulators

    known = known_devices()
    if device in ("-h", "--help"):
        typer.echo(textwrap.fill(f"cmmlink simulate DEVICE, one of: {', '.join(sorted(known))}", 80) + "\n")
        settings_from(["--help"], "cmmlink simulate DEVICE")
    if device not in known:
        problem = f"no simulated device is called {device}" if device else "name the device to simulate"
        raise PlanError(f"{problem}; known: {', '.join(sorted(known))}; `cmmlink simulate --help` shows their options")
    settings = settings_from(context.args, f"cmmlink simulate {device}")
    try:
        known[device](settings, say)
    except (ValueError, OSError) as error:
        raise LinkError(f"the simulated device cannot serve {settings.address}: {error}") from None
    return 0


@app.command()
def runs(records: Records = None, as_json: Json = False) -> int:
    """List the recorded runs."""
    found = list_runs(records or default_folder(), _today)
    if as_json:
        _print_json({"runs": found})
        return 0
    for entry in found:
        part = " ".join(filter(None, [entry["part"], entry["serial_number"]]))
        verdict = entry["verdict"] or "-"
        received = "-" if entry["received"] is None else entry["received"]
        typer.echo(
            f"{entry['run']}  {(entry['started'] or '-')[:19]:<19}  {entry['state']:<11}  {verdict:<10}  {received:>9} points  {part}"
        )
    if not found:
        typer.echo(f"no run was recorded yet in {records or default_folder()}")
    return 0


@app.command()
def show(name: RunName, records: Records = None, as_json: Json = False) -> int:
    """Show one recorded run."""
    with reading(records or default_folder(), _today) as store:
        found = describe(store, find_run(store, name))
    if as_json:
        _print_json(found)
        return 0
    for key in ("run", "started", "ended", "state", "message", "verdict", "part", "serial_number", "operator", "device", "chain_sha256"):
        if found[key]:
            typer.echo(f"{key:<14} {found[key]}{' (simulated)' if key == 'device' and found['simulated'] else ''}")
    for key in ("software", "recorded"):
        typer.echo(f"{key:<14} {', '.join(f'{name} {value}' for name, value in found[key].items() if value)}")
    for event in found["events"]:
        told = ", ".join(f"{name} {value}" for name, value in event.items() if name not in ("event", "time_s", "after_points"))
        typer.echo(f"  {event['time_s'] - found['clock_s']:9.3f} s  after {event['after_points']} points: {event['event']} {told}")
    typer.echo("\n" + found["plan"].rstrip())
    return 0


@app.command()
def export(
    name: RunName,
    out: Annotated[Path, typer.Option("--out", metavar="DIR", help="Folder for the files.")],
    records: Records = None,
    as_json: Json = False,
) -> int:
    """Write a recorded run as csv, npy, json and raw bytes."""
    with reading(records or default_folder(), _today) as store:
        run_id = find_run(store, name)
        written = export_run(store, run_id, out)
    if as_json:
        _print_json({"run": run_id, "files": [str(path) for path in written]})
    else:
        typer.echo("\n".join(str(path) for path in written))
    return 0


@app.command()
def replay(
    name: RunName,
    tolerance: Annotated[tuple[float, float] | None, typer.Option(metavar="LO HI", help="Evaluate with another tolerance, mm.")] = None,
    method: Annotated[MethodName | None, typer.Option(help="Evaluate with another method.")] = None,
    out: Out = None,
    records: Records = None,
    as_json: Json = False,
) -> int:
    """Evaluate a recorded run once more; with nothing changed the result is the same to the last bit."""
    with reading(records or default_folder(), _today) as store:
        recorded = recorded_run(store, find_run(store, name))
        again = replayed(store, recorded, decoder_of, tolerance=tolerance, method=method.value if method else None)
    facts = again.facts | {"replay_of": recorded.run, "chain_sha256": recorded.chain_sha256, "identical": again.identical}
    facts |= {"changed": [asdict(change) for change in again.changed], "differs": [asdict(change) for change in again.differs]}
    if out is not None:
        write_results(out, facts, again.outcome.result, again.profile, f"{recorded.header['part']}, run {recorded.run} replayed")
    if as_json:
        _print_json(facts)
    else:
        _print_replay(again, recorded.run)
    if again.identical is False and not again.changed:
        return _fail(f"run {recorded.run}: nothing was changed, yet the result is not the recorded one", _NO_RECORD)
    return _UNUSABLE if again.outcome.result is None else _EXIT[again.outcome.result.verdict]


def _print_replay(again: Replay, run_id: str) -> None:
    heading = f"run {run_id}, evaluated again"
    print_summary(Console(highlight=False, soft_wrap=not sys.stdout.isatty()), again.outcome.result, again.outcome.counts, heading)
    for title, changes in (("changed", again.changed), ("differs", again.differs)):
        for change in changes:
            typer.echo(f"{title}: {change.key} {change.recorded} -> {change.replayed}")
    if again.identical is None:
        typer.echo(f"run {run_id} has no recorded result to compare with")
    elif again.identical:
        typer.echo(f"identical to the recorded result of run {run_id}, to the last bit")


@app.command()
def verify(
    name: Annotated[str | None, typer.Argument(metavar="[RUN]", help="One run; without it all records.")] = None,
    records: Records = None,
    as_json: Json = False,
) -> int:
    """Recompute the hash chain and name the first record that was altered."""
    with reading(records or default_folder(), _today, close_interrupted=False) as store:
        found = check_chain(store, find_run(store, name) if name else None)
    if as_json:
        _print_json(found)
    elif found["altered"]:
        return _fail(found["first"]["message"], _NO_RECORD)
    else:
        typer.echo(f"nothing was altered: {found['records']} records, chain {found['chain_sha256']}")
    return _NO_RECORD if found["altered"] else 0
