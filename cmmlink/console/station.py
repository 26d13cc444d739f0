"""The station: which plan, which part, the run that is on, what went wrong and what was measured before.

It knows no page and no device. Commands come in from any thread and return at once; the run has a thread of its own.
`Refused` is the answer to a command that cannot be carried out; its message is for the operator.
"""

import math
import re
import threading
from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager, ExitStack
from dataclasses import dataclass, replace
from datetime import datetime
from pathlib import Path
from typing import Protocol, TypeVar

from cmmlink.console.alarms import Alarms
from cmmlink.console.ct_import import CtImport, InspectSurface
from cmmlink.console.past_runs import Recorded
from cmmlink.console.protocol import ChosenPlan, DeviceTest, RunRow, StationState
from cmmlink.devices import Connected
from cmmlink.errors import PlanError, RunError, StoreError
from cmmlink.events import Event, RunStarted, Sink
from cmmlink.from_plan import inspection_of, profile_of
from cmmlink.pipeline import RunOutcome, run_inspection
from cmmlink.plan.scan import FileDevice, Plan, load_plan
from cmmlink.run_view import RunContext, RunView
from drivers import DeviceError, PointBatch, PointFileError, ScanOpened, ScanSource
from inspection import InspectionError, NominalProfile, rehearse

Found = TypeVar("Found")

_LONGEST_NAME = 120
_TEST_S = 5.0
_TEST_POINTS = 200
_MOST_PLAN_BYTES = 50_000
_LIST_EVERY_S = 1.0
_UNTESTED = DeviceTest("none", "")


class Refused(Exception):  # noqa: N818 - it is the answer, not a failure
    """A command cannot be carried out now; the message says why and what to do."""


class Records(Protocol):
    """What the station asks of its records."""

    def recorder(self, plan: Plan, started: RunStarted) -> AbstractContextManager[Sink]:
        """Give the sink that writes the record of a run."""

    def runs(self) -> Sequence[RunRow]:
        """All runs, newest first."""

    def opened(self, run: str) -> Recorded:
        """Give one run as it was recorded."""

    def replayed(self, run: str, sinks: Sequence[Sink], stop: threading.Event) -> str:
        """Measure a run again from its record; say whether the result is identical."""

    def exported(self, run: str, folder: Path) -> Path:
        """Write one run as a zip archive into a folder."""


@dataclass(frozen=True, slots=True)
class Means:
    """What the station works with; the command line joins it.

    plans   : name -> file, looked up anew each time
    connect : opens the device of a plan for one scan
    devices : addresses of devices that can be seen now, with a description each
    records : None where nothing is recorded
    ct_plans, inspect_surface : plans of CT surfaces, and what inspects one; None where that is not possible
    write   : writes the results of a run where its plan wants them
    """

    plans: Callable[[], Mapping[str, Path]]
    connect: Callable[[Plan], AbstractContextManager[Connected]]
    devices: Callable[[], Sequence[tuple[str, str]]]
    records: Records | None
    clock: Callable[[], float]
    now: Callable[[], datetime]
    ct_plans: Callable[[], Mapping[str, Path]] = dict
    inspect_surface: InspectSurface | None = None
    write: Callable[[Plan, NominalProfile, RunOutcome, RunStarted], None] = lambda *_: None


@dataclass(frozen=True, slots=True, eq=False)
class Choice:
    """The plan chosen, checked. `problem` is empty when it can be run, `line` the line it points at."""

    name: str
    text: str
    plan: Plan | None
    profile: NominalProfile | None
    problem: str
    line: int | None


@dataclass(slots=True)
class _Work:
    """What the operator entered."""

    serial_number: str = ""
    operator: str = ""
    address: str = ""
    choice: Choice | None = None
    test: DeviceTest = _UNTESTED


class Station:
    """One station with one device at a time."""

    def __init__(self, means: Means) -> None:
        self._means = means
        self.alarms = Alarms(means.now)
        self.ct = CtImport(means.clock)
        self.view: RunView | None = None
        self.history_version = 0
        self.outcome: RunOutcome | None = None
        self.started: RunStarted | None = None
        self.failure: Exception | None = None
        self.unwritten: PlanError | None = None  # why the results of a run are not where its plan wants them
        self._work = _Work()
        self._lock = threading.RLock()
        self._stop = threading.Event()
        self._source: ScanSource | None = None
        self._thread: threading.Thread | None = None
        self._number = 0
        self._history: tuple[RunRow, ...] = ()
        self._listed: dict[str, list[str]] = {}
        self._listed_s = -math.inf
        self._read_history()

    # What is so.

    @property
    def running(self) -> bool:
        """Whether a run, or a test of the device, is on."""
        return self._thread is not None and self._thread.is_alive()

    @property
    def history(self) -> tuple[RunRow, ...]:
        """All runs on record, newest first."""
        return self._history

    def state(self) -> StationState:
        """The operator's choices and what may be done next."""
        with self._lock:
            work, choice, listed = self._work, self._work.choice, self._listed_plans()
            return StationState(
                plans=tuple(listed["plans"]),
                ct_plans=tuple(listed["ct_plans"]),
                choice=None if choice is None else _described(choice),
                serial_number=work.serial_number,
                operator=work.operator,
                address=work.address,
                test=work.test,
                running=self.running,
                can_start=not self.running and choice is not None and choice.plan is not None,
                keeps_records=self._means.records is not None,
            )

    def now_ms(self) -> float:
        """Time of day, ms since 1970."""
        return self._means.now().timestamp() * 1e3

    def devices(self) -> list[dict[str, str]]:
        """Addresses of devices that can be seen now."""
        return [{"address": address, "description": description} for address, description in self._means.devices()]

    # What the operator does.

    def choose(self, name: str) -> str:
        """Choose a plan and check it with everything it names, short of the device."""
        self._refuse_while_running("another plan can be chosen")
        file = self._means.plans().get(name)
        if file is None:
            raise Refused(f"there is no plan {name!r} at this station")
        choice = checked(name, file)
        with self._lock:
            plan = choice.plan
            other = self._work.choice is None or self._work.choice.name != name
            self._work.choice = choice
            if other:
                self._work.test = _UNTESTED
                self._work.address = str(getattr(plan.device, "address", "")) if plan else ""
                self._work.serial_number = (plan.part.serial_number or "") if plan else ""
                self._work.operator = self._work.operator or ((plan.operator or "") if plan else "")
        if choice.problem:
            raise Refused(choice.problem)
        return f"{name} can be run"

    def enter(self, serial_number: str | None = None, operator: str | None = None, address: str | None = None) -> str:
        """Enter what belongs to the next part."""
        self._refuse_while_running("the next part can be entered")
        with self._lock:
            if serial_number is not None:
                self._work.serial_number = _short(serial_number, "serial number")
            if operator is not None:
                self._work.operator = _short(operator, "operator")
            if address is not None:
                self._work.address = _short(address, "address")
        return "entered"

    def start(self) -> str:
        """Start a run of the chosen plan."""
        with self._lock:
            self._refuse_while_running("the next one can be started")
            if self._work.choice is None:
                raise Refused("choose a plan first")
            self.choose(self._work.choice.name)
            plan, profile = self._planned()
            started = RunStarted(plan.part.name, self._work.serial_number, self._work.operator, _device_words(plan), False)
            view = self._new_view(plan, profile, started)
            self._begin(lambda: self._measure(plan, profile, started, view), view)
        return "started"

    def replay(self, run: str) -> str:
        """Measure a recorded run again, from its recorded bytes."""
        with self._lock:
            self._refuse_while_running("a record can be replayed")
            records = self._records()
            recorded = _told(lambda: records.opened(run))
            view = RunView(_facts_of(recorded, f"replay of {recorded.run}"), self._means.clock, self._means.now)

            def work() -> None:
                view.remark(records.replayed(recorded.run, [self._shown_in(view)], self._stop))

            self._begin(work, view)
        return f"replaying {recorded.run}"

    def test_device(self) -> str:
        """Listen to the device for a moment; the answer appears in the state."""
        with self._lock:
            self._refuse_while_running("the device can be tested")
            if self._work.choice is None or self._work.choice.plan is None:
                raise Refused("choose a plan that can be run first")
            plan, _ = self._planned()
            self._work.test = DeviceTest("testing", "listening")
            self._thread = threading.Thread(target=self._listen, args=(plan,), name="device test", daemon=True)
            self._thread.start()
        return "testing the device"

    def import_ct(self, name: str) -> str:
        """Inspect the sections of a CT surface as its plan says."""
        with self._lock:
            self._refuse_while_running("a surface can be inspected")
            file, inspect = self._means.ct_plans().get(name), self._means.inspect_surface
            if file is None or inspect is None:
                raise Refused(f"there is no CT plan {name!r} at this station")
            self.ct.begin(name)
            self._stop, self._source = threading.Event(), None
            self._thread = threading.Thread(target=self._inspect, args=(inspect, file), name="ct", daemon=True)
            self._thread.start()
        return f"inspecting {name}"

    def section(self, index: int) -> RunView:
        """Give one section of the CT surface to look at."""
        if not 0 <= index < len(self.ct.sections):
            raise Refused("there is no such section")
        section = self.ct.sections[index]
        view = RunView(section.context, self._means.clock, lambda: section.context.began)
        view.recall(section.started, section.ended)
        return view

    def end_scan(self) -> str:
        """End the scan here: what was received is judged, and the coverage says whether it suffices."""
        source, view = self._source, self.view
        if not self.running or source is None or view is None or view.over:
            raise Refused("nothing is being measured")
        view.end_soon()
        source.stop()
        return "ending the scan"

    def abort(self) -> str:
        """Abort the run: what was received is judged, and nothing is proven by it."""
        if not self.running:
            raise Refused("nothing is being measured")
        if self.view is not None:
            self.view.end_soon()
        self._stop.set()
        if self._source is not None:
            self._source.stop()
        return "aborting"

    def acknowledge(self, number: int | None = None) -> str:
        """Mark one alarm, or all, as seen."""
        seen = self.alarms.acknowledge(number)
        return f"{seen} alarm{'s' if seen != 1 else ''} acknowledged"

    def opened(self, run: str) -> RunView:
        """Give a recorded run to look at."""
        records = self._records()
        recorded = _told(lambda: records.opened(run))
        title = f"Recorded run {recorded.run} of {recorded.began:%Y-%m-%d %H:%M}"
        view = RunView(_facts_of(recorded, title), self._means.clock, lambda: recorded.began)
        view.recall(recorded.started, recorded.ended)
        return view

    def exported(self, run: str, folder: Path) -> Path:
        """Write a recorded run as a zip archive into a folder."""
        records = self._records()
        return _told(lambda: records.exported(run, folder))

    def wait(self, timeout_s: float | None = None) -> bool:
        """Wait for the run to end; False when it is still on."""
        if self._thread is not None:
            self._thread.join(timeout_s)
        return not self.running

    # How it is done.

    def _listed_plans(self) -> dict[str, list[str]]:
        """Names of all plans, looked up now and then: pages ask many times a second."""
        now_s = self._means.clock()
        if now_s - self._listed_s > _LIST_EVERY_S:
            surfaces = self._means.ct_plans() if self._means.inspect_surface else {}
            self._listed, self._listed_s = {"plans": sorted(self._means.plans()), "ct_plans": sorted(surfaces)}, now_s
        return self._listed

    def _refuse_while_running(self, what: str) -> None:
        if self.running:
            raise Refused(f"a run is on; {what} when it is over")

    def _records(self) -> Records:
        if self._means.records is None:
            raise Refused("this station keeps no records")
        return self._means.records

    def _work_name(self) -> str:
        return self._work.choice.name if self._work.choice else ""

    def _planned(self) -> tuple[Plan, NominalProfile]:
        """The chosen plan at the address the operator chose, and its nominal."""
        choice = self._work.choice
        assert choice is not None
        assert choice.plan is not None
        assert choice.profile is not None
        plan = choice.plan
        if self._work.address and not isinstance(plan.device, FileDevice):
            plan = plan.with_address(self._work.address)
        part = plan.part.model_copy(update={"serial_number": self._work.serial_number or None})
        return plan.model_copy(update={"part": part, "operator": self._work.operator or None}), choice.profile

    def _new_view(self, plan: Plan, profile: NominalProfile, started: RunStarted) -> RunView:
        self._number += 1
        facts = RunContext(
            str(self._number),
            self._work_name(),
            profile,
            plan.tolerance.zone,
            plan.registration.coverage_min,
            plan.buffer_points,
            self._means.now(),
        )
        view = RunView(facts, self._means.clock, self._means.now)
        view(started)
        return view

    def _begin(self, work: Callable[[], None], view: RunView) -> None:
        self._stop = threading.Event()
        self._source, self.outcome, self.failure, self.unwritten, self.view = None, None, None, None, view
        self._thread = threading.Thread(target=self._carried_out, args=(work, view), name="run", daemon=True)
        self._thread.start()

    def _carried_out(self, work: Callable[[], None], view: RunView) -> None:
        """Do the work of a run; whatever goes wrong becomes an alarm, never silence."""
        try:
            work()
        except StoreError as error:
            self._break_off(view, "Record not kept", error)
        except DeviceError as error:
            self._break_off(view, "Device failed", error)
        except ValueError as error:  # plan, nominal or points cannot be used
            self._break_off(view, "Cannot be inspected", error)
        except Exception as error:
            self._break_off(view, f"Defect in the program ({type(error).__name__})", error)
        finally:
            self._source = None
            self._read_history()

    def _break_off(self, view: RunView, what: str, error: Exception) -> None:
        self.failure = error
        view.fail(f"{what}: {error}")
        self.alarms.raise_alarm("fault", what, str(error))

    def _measure(self, plan: Plan, profile: NominalProfile, started: RunStarted, view: RunView) -> None:
        with ExitStack() as stack:
            # compiled before the device is asked for points: twenty seconds, once after installation
            rehearse(profile, plan.registration.method, plan.registration.reject_outliers)
            view.await_device()
            live = inspection_of(plan, profile)
            connected = stack.enter_context(self._means.connect(plan))
            started = self.started = replace(started, device=connected.device, simulated=connected.simulated)
            sinks: list[Sink] = [self.alarms, self._shown_in(view)]
            if self._means.records is not None:
                sinks.insert(0, stack.enter_context(self._means.records.recorder(plan, started)))
            self._source = connected.source
            self.outcome = run_inspection(
                connected.source, live, sinks, started, buffer_points=plan.buffer_points, clock=self._means.clock, stop=self._stop
            )
        try:
            self._means.write(plan, profile, self.outcome, started)
        except PlanError as error:
            self.unwritten = error
            self.alarms.raise_alarm("fault", "The results could not be written", str(error))
        self._next_part(self.outcome)

    def _shown_in(self, view: RunView) -> Sink:
        """The view as a sink that cannot end a run: a fault in drawing is an alarm, not a lost measurement."""

        def show(event: Event) -> None:
            try:
                view(event)
            except Exception as error:
                self.alarms.raise_alarm("fault", "The page cannot show this run", repr(error))

        return show

    def _inspect(self, inspect: InspectSurface, file: Path) -> None:
        try:
            self.ct.end(inspect(file, self._stop, self.ct.expect, self.ct.add))
        except (DeviceError, ValueError, OSError) as error:  # plan, surface or nominal cannot be used
            self.ct.end(str(error).replace(str(file), file.name), failed=True)
        except Exception as error:
            self.ct.end(f"defect in the program ({type(error).__name__}): {error}", failed=True)
            self.alarms.raise_alarm("fault", "Defect in the program", repr(error))

    def _next_part(self, outcome: RunOutcome) -> None:
        """After a part was judged, suggest the serial number of the next."""
        if outcome.ending == "complete" and outcome.result is not None:
            with self._lock:
                self._work.serial_number = next_serial_number(self._work.serial_number)

    def _listen(self, plan: Plan) -> None:
        """Test the device: what it says in the first seconds."""
        try:
            with self._means.connect(plan) as connected:
                message = _heard(connected, self._means.clock)
            answer = DeviceTest("passed", message)
        except (DeviceError, PlanError, PointFileError) as error:
            answer = DeviceTest("failed", str(error))
        with self._lock:
            self._work.test = answer

    def _read_history(self) -> None:
        if self._means.records is not None:
            try:
                self._history = tuple(self._means.records.runs())
            except StoreError as error:
                self.alarms.raise_alarm("fault", "Records cannot be read", str(error))
        self.history_version += 1


def checked(name: str, file: Path) -> Choice:
    """Check a plan with everything it names, short of the device."""
    try:
        with file.open("rb") as opened:
            text = opened.read(_MOST_PLAN_BYTES).decode("utf-8", errors="replace")
        plan = load_plan(file)
        profile = profile_of(plan)
        inspection_of(plan, profile)
    except OSError as error:
        return Choice(name, "", None, None, f"{file.name}: {error.strerror or error}", None)
    except (PlanError, InspectionError, PointFileError, ValueError) as error:
        found = re.search(r"\bline (\d+)", str(error))
        about_plan = isinstance(error, PlanError) and str(error).startswith(str(file))
        problem = str(error).replace(str(file), file.name)
        return Choice(name, text, None, None, problem, int(found[1]) if found and about_plan else None)
    return Choice(name, text, plan, profile, "", None)


def next_serial_number(serial_number: str) -> str:
    """Count the last number in a serial number up by one, keeping its width: B-0099 becomes B-0100."""
    found = re.fullmatch(r"(.*?)(\d+)(\D*)", serial_number)
    if not found:
        return ""
    head, digits, tail = found.groups()
    return f"{head}{int(digits) + 1:0{len(digits)}d}{tail}"


def _heard(connected: Connected, clock: Callable[[], float]) -> str:
    """Listen until the device has shown itself or the time is over."""
    began_s, points, opened = clock(), 0, ""
    silence = threading.Timer(_TEST_S, connected.source.stop)
    silence.start()
    try:
        for arrival in connected.source.arrivals():
            if isinstance(arrival, ScanOpened):
                opened = " ".join(filter(None, (arrival.device, arrival.serial_number)))
            elif isinstance(arrival, PointBatch):
                points += len(arrival)
            if points >= _TEST_POINTS:
                break
    finally:
        silence.cancel()
        connected.source.stop()
    took_s = clock() - began_s
    if not points:
        return f"{opened or connected.device}: the link opened, but no point came within {_TEST_S:g} s"
    return f"{opened or connected.device}: {points} points in {took_s:.1f} s"


def _described(choice: Choice) -> ChosenPlan:
    """A checked plan as a page shows it."""
    plan, profile = choice.plan, choice.profile
    facts: list[tuple[str, str]] = []
    if plan is not None and profile is not None:
        zone, registration = plan.tolerance.zone, plan.registration
        uncertainty = f", U {zone.uncertainty_mm:g} mm" if zone.uncertainty_mm else ""
        facts = [
            ("Part", plan.part.name),
            ("Tolerance", f"{zone.lower_mm:+g} to {zone.upper_mm:+g} mm{uncertainty}"),
            ("Nominal", f"{plan.nominal.file.name}, {profile.length_mm:.1f} mm, {'closed' if profile.curve.closed else 'open'}"),
            ("Device", _device_words(plan)),
            ("Fit", f"{'datum' if registration.datum else registration.fit}, {registration.method}"),
            ("Coverage", f"at least {registration.coverage_min:.0%}"),
        ]
        if plan.probe.tip_radius_mm:
            facts.append(("Probe", f"ball, radius {plan.probe.tip_radius_mm:g} mm"))
    return ChosenPlan(
        name=choice.name,
        text=choice.text,
        problem=choice.problem,
        line=choice.line,
        part=plan.part.name if plan else "",
        facts=tuple(facts),
        has_address=plan is not None and not isinstance(plan.device, FileDevice),
    )


def _device_words(plan: Plan) -> str:
    device = plan.device
    return f"file {device.file.name}" if isinstance(device, FileDevice) else f"{device.type} {device.address}"


def _facts_of(recorded: Recorded, number: str) -> RunContext:
    plan = recorded.plan
    coverage_min, buffer_points = plan.registration.coverage_min, plan.buffer_points
    return RunContext(number, "", recorded.profile, plan.tolerance.zone, coverage_min, buffer_points, recorded.began)


def _short(text: str, what: str) -> str:
    text = text.strip()
    if len(text) > _LONGEST_NAME or not text.isprintable():
        raise Refused(f"the {what} must be printable and at most {_LONGEST_NAME} characters long")
    return text


def _told(ask: Callable[[], Found]) -> Found:
    """What was asked for, or the reason as an answer to the operator."""
    try:
        return ask()
    except (StoreError, RunError, PlanError, InspectionError, PointFileError) as error:
        raise Refused(str(error)) from None
