"""The station: which plan, which part, the job that is on, what went wrong and what was measured before.

It knows no page and no device. Commands come in from any thread; each takes as long as it needs and holds nobody else up.
`Refused` is the answer to a command that cannot be carried out; its message is for the operator.
"""

import threading
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

from cmmlink.console.alarms import Alarms
from cmmlink.console.choice import CheckedPlan, CheckedSurface
from cmmlink.console.ct_import import CtImport, InspectSurface
from cmmlink.console.device_test import TESTING, listen_to_device
from cmmlink.console.entry import Entry
from cmmlink.console.form_answers import PlanSaved, Understood
from cmmlink.console.job import Job, JobKind
from cmmlink.console.plan_shelf import DEMO, Listed, PlanShelf
from cmmlink.console.protocol import DeviceTest, FoundRuns, History, StationState
from cmmlink.console.refused import Refused, answer_errors
from cmmlink.console.register_look import RegisterLook
from cmmlink.console.register_words import KeepMap, LookAtRegisters, MapSaved
from cmmlink.console.results_push import PushedResults
from cmmlink.console.run_job import measure, raise_alarms, sink_of
from cmmlink.console.station_setup import Records, StationSetup
from cmmlink.devices import words_of
from cmmlink.errors import StoreError
from cmmlink.events import RunStarted
from cmmlink.plan import Plan, SurfacePlan
from cmmlink.record import RunSearch
from cmmlink.run_view import RunView
from cmmlink.words import repetition_words

_MOST_HISTORY = 500
_LOOK_ENDS_S = 3.0


class Station:
    """One station with one job at a time.

    Guarded by its own lock, which is held only while references are replaced: the operator's entry, the job, the view. What
    takes time - checking a plan, building a nominal, reading folders or records - is done outside it. After every change the
    station publishes immutable snapshots (`state`, `history`); readers take the newest and wait for nobody.
    """

    def __init__(self, setup: StationSetup) -> None:
        self._setup = setup
        self.alarms = Alarms(setup.now)
        self.pushed = PushedResults(self.alarms)
        self.ct, self.trends = CtImport(setup.clock), setup.trends
        self.registers = RegisterLook(setup.clock)
        self._lock = threading.RLock()
        self._entry = Entry()
        self._job: Job | None = None
        self._view: RunView | None = None
        self._runs_begun = 0
        self._shelf = PlanShelf(setup)
        self._listed = Listed()
        self._history = History(())
        self._state = self._newest_state()
        self.list_plans()
        self._read_history()

    # What anybody may look at, at any time.

    @property
    def running(self) -> bool:
        """Whether a job is on: a run, a replay, a test of the device, the inspection of a surface."""
        job = self._job
        return job is not None and not job.over

    @property
    def job(self) -> Job | None:
        """The job that is on, or was the last."""
        return self._job

    @property
    def view(self) -> RunView | None:
        """The run or replay that is on, or was the last."""
        return self._view

    @property
    def history(self) -> History:
        """The runs on record, newest first."""
        return self._history

    @property
    def state(self) -> StationState:
        """The operator's choices and what may be done next."""
        return self._state

    def now_ms(self) -> float:
        """Time of day, ms since 1970."""
        return self._setup.now().timestamp() * 1e3

    # What the operator may do.

    def choose(self, name: str) -> str:
        """Choose a plan and check it with everything it names, short of the device."""
        self._refuse_while_running("another plan can be chosen")
        choice = self._shelf.check(name)
        with self._lock:
            self._refuse_while_running("another plan can be chosen")
            self._set_entry(self._entry.with_choice(choice))
        if choice.checked is None:
            raise Refused(choice.shown.problem)
        return f"{name} can be run"

    def understand_nominal(self, answers: Mapping[str, str], content: bytes) -> Understood:
        """Read a nominal that a page hands in, for a new plan."""
        self._refuse_while_running("a plan can be made")
        return self._shelf.understand(answers, content)

    def save_plan(self, answers: Mapping[str, str], content: bytes) -> PlanSaved:
        """Save a new plan and the nominal that a page hands in, and choose it; or say what is wrong, and save nothing."""
        self._refuse_while_running("a plan can be made")
        saved = self._shelf.save(answers, content)
        self.list_plans()
        if saved.name and not saved.surface:
            self.choose(saved.name)
        return saved

    def enter(self, serial_number: str | None = None, operator: str | None = None, address: str | None = None) -> str:
        """Enter what belongs to the next part; None leaves a value as it is."""
        with self._lock:
            self._refuse_while_running("the next part can be entered")
            self._set_entry(self._entry.with_values(serial_number, operator, address))
        return "entered"

    def start(self, *, again: bool = False) -> str:
        """Start a run of the chosen plan, which is checked once more; `again`: also where the part was measured before."""
        with self._new_job("run", "the next one can be started") as job:
            chosen = self._entry.choice
            if chosen is None:
                raise Refused("choose a plan first")
            choice = self._shelf.check(chosen.name)
            with self._lock:
                self._set_entry(self._entry.with_choice(choice))
                checked = self._entry.planned()
            checked = self._knowing_the_part(checked, again=again)
            view = self._new_view(choice.name, checked)
            if job.stop.is_set():
                raise Refused("the run was aborted before it began")
            job.view = view
            self.show(view)
            job.start(lambda: self._run(job, view, checked))
        return "started"

    def run_demo(self) -> str:
        """Measure a part of the demonstration with its simulated device, which needs no set-up."""
        self._refuse_while_running("the demonstration can be run")
        self._shelf.show_demo()
        self.list_plans()
        self.choose(DEMO)
        return self.start()

    def replay(self, run: str) -> str:
        """Measure a recorded run again, from its recorded bytes."""
        with self._new_job("replay", "a record can be replayed") as job:
            with self._records() as records:
                recorded = records.open_run(run)
            view = RunView(recorded.context(f"replay of {recorded.run}", "replay"), self._setup.clock, lambda: recorded.began)
            job.view = view
            self.show(view)
            job.start(lambda: self._replay(job, view, records, recorded.run))
        return f"replaying {recorded.run}"

    def test_device(self) -> str:
        """Listen to the device for a moment; the answer appears in the state."""
        with self._new_job("device test", "the device can be tested") as job, self._lock:
            plan = self._entry.planned().plan
            self._set_entry(replace(self._entry, test=TESTING))
            job.start(lambda: self._test(job, plan))
        return "testing the device"

    def look_at_registers(self, asked: LookAtRegisters) -> str:
        """Read registers of a Modbus device over and over, until it is aborted."""
        with self._new_job("registers", "registers can be looked at") as job:
            look = self.registers.begin(asked)
            job.start(lambda: look(job))
        return f"reading the registers of {asked.address}"

    def keep_map(self, asked: KeepMap) -> MapSaved:
        """Save a register map beside the plans, or say what is wrong; a look at registers that goes on ends with it."""
        job = self._job
        if job is not None and job.kind == "registers" and not job.over:
            job.abort()
            job.wait(_LOOK_ENDS_S)
        self._refuse_while_running("a map can be saved")
        return self._shelf.keep_map(asked)

    def import_ct(self, name: str) -> str:
        """Inspect the sections of a CT surface as its plan says."""
        with self._new_job("surface", "a surface can be inspected") as job:
            file, inspect = self._shelf.surface_plan(name), self._setup.inspect_surface
            if inspect is None:
                raise Refused("this station inspects no surfaces")
            self.ct.begin(name)
            job.start(lambda: self._inspect(job, inspect, file))
        return f"inspecting {name}"

    def end_scan(self) -> str:
        """End the scan here: what was received is judged, and the coverage says whether it suffices."""
        job = self._job
        if job is None or not job.end_scan():
            raise Refused("nothing is being measured")
        return "ending the scan"

    def abort(self) -> str:
        """Abort the job: what was received is judged, and nothing is proven by it."""
        job = self._job
        if job is None or job.over:
            raise Refused("nothing is being measured")
        job.abort()
        return "aborting"

    def acknowledge(self, number: int | None = None) -> str:
        """Mark one alarm, or all, as seen."""
        seen = self.alarms.acknowledge(number)
        return f"{seen} alarm{'s' if seen != 1 else ''} acknowledged"

    def open_run(self, run: str) -> RunView:
        """Give a recorded run to look at."""
        with self._records() as records:
            recorded = records.open_run(run)
        title = f"Recorded run {recorded.run} of {recorded.began:%Y-%m-%d %H:%M}"
        view = RunView(recorded.context(title, "recorded"), self._setup.clock, lambda: recorded.began)
        view.recall(recorded.started, recorded.ended)
        view.name_record(recorded.run)
        return view

    def open_section(self, index: int) -> RunView:
        """Give one section of the CT surface to look at."""
        section = self.ct.section(index)
        if section is None:
            raise Refused("there is no such section")
        view = RunView(section.context, self._setup.clock, lambda: section.context.began)
        view.recall(section.started, section.ended)
        return view

    def find_runs(self, search: RunSearch) -> FoundRuns:
        """Look for recorded runs."""
        with self._records() as records:
            rows, total = records.find_runs(search)
        return FoundRuns(tuple(rows), total)

    def export_run(self, run: str, folder: Path) -> Path:
        """Write a recorded run as a zip archive into a folder."""
        with self._records() as records:
            return records.export_run(run, folder)

    def report_run(self, run: str, folder: Path, settings: Mapping[str, str]) -> Path:
        """Write the report of a recorded run into a folder; `settings` are those of its look that are not as its plan says."""
        with self._records() as records:
            return records.report_run(run, folder, settings)

    def compare_runs(self, first: str, second: str, folder: Path) -> Path:
        """Draw two recorded runs of one profile and their difference into a folder."""
        with self._records() as records:
            return records.compare_runs(first, second, folder)

    def devices(self) -> list[tuple[str, str]]:
        """Addresses of devices that can be seen now, with a description each."""
        return list(self._setup.devices())

    # What others than the operator ask for.

    def list_plans(self) -> None:
        """Look which plans there are now. Reads folders, which may be far away: call it in a thread that may wait."""
        listed = self._shelf.listed()
        with self._lock:
            news = listed.problem if listed.problem != self._listed.problem else ""
            self._listed = listed
            self._publish()
        if news:
            self.alarms.raise_alarm("warning", "Plans cannot be listed", news)

    def show(self, view: RunView) -> None:
        """Make a run the one that pages look at while they have opened none themselves."""
        with self._lock:
            self._view = view

    def wait(self, timeout_s: float | None = None) -> bool:
        """Wait for the job to end; returns False when it is still on."""
        job = self._job
        return job is None or job.wait(timeout_s)

    # Jobs: the command makes one, prepares it and starts its thread, which runs one of the four that follow.

    @contextmanager
    def _new_job(self, kind: JobKind, what: str) -> Iterator[Job]:
        """Replace the job by a new one for its command to prepare and start; where that fails, nothing is on any more."""
        with self._lock:
            self._refuse_while_running(what)
            job = self._job = Job(kind, self._publish)
            self._publish()
        try:
            yield job
        except BaseException:
            job.give_up()
            raise

    def _run(self, job: Job, view: RunView, checked: CheckedPlan | CheckedSurface) -> None:
        raise_alarms(job, view, self.alarms, lambda: measure(job, view, checked, self._setup, self.alarms))
        finished = job.finished
        if finished is not None and finished.outcome.ending == "complete" and finished.outcome.result is not None:
            with self._lock:
                self._set_entry(self._entry.for_next_part())
        self._read_history()

    def _replay(self, job: Job, view: RunView, records: Records, run: str) -> None:
        sinks = [sink_of(view, self.alarms)]
        raise_alarms(job, view, self.alarms, lambda: view.remark(records.replay_run(run, sinks, job.stop)))

    def _test(self, job: Job, plan: Plan | SurfacePlan) -> None:
        try:
            test = listen_to_device(job, lambda: self._setup.connect(plan), self._setup.clock)
        except Exception as error:
            test = DeviceTest("failed", f"defect in the program: {error!r}")
        with self._lock:
            self._set_entry(replace(self._entry, test=test))

    def _inspect(self, job: Job, inspect: InspectSurface, file: Path) -> None:
        self.ct.carry_out(inspect, file, job.stop, lambda what, detail: self.alarms.raise_alarm("fault", what, detail))
        self._read_history()

    # What is chosen, entered and shown.

    def _refuse_while_running(self, what: str) -> None:
        if self.running:
            busy = "registers are being read" if self._job is not None and self._job.kind == "registers" else "a run is on"
            raise Refused(f"{busy}; {what} when it is over")

    @contextmanager
    def _records(self) -> Iterator[Records]:
        if self._setup.records is None:
            raise Refused("this station keeps no records")
        with answer_errors():
            yield self._setup.records

    def _knowing_the_part(self, checked: CheckedPlan | CheckedSurface, *, again: bool) -> CheckedPlan | CheckedSurface:
        """The plan with a note where its part was measured before, which is refused unless it is to be measured again."""
        part = checked.plan.part
        if self._setup.records is None or not part.serial_number:
            return checked
        with answer_errors():
            run = self._setup.records.measured_before(part.name, part.serial_number)
        if run is None:
            return checked
        told = repetition_words(part.serial_number, run)
        if not again:
            with self._lock:
                self._set_entry(replace(self._entry, question=told))
            raise Refused(told)
        return replace(checked, notes=(told,))

    def _new_view(self, name: str, checked: CheckedPlan | CheckedSurface) -> RunView:
        with self._lock:
            self._runs_begun += 1
            number = str(self._runs_begun)
        plan = checked.plan
        view = RunView(checked.context(self._setup.now(), number, name), self._setup.clock, self._setup.now)
        part, operator = plan.part, plan.operator or ""
        started = RunStarted(part.name, part.serial_number or "", operator, words_of(plan.device), simulated=False)
        view(started)
        self.alarms(started)  # from here on alarms belong to this run, also where its device cannot be opened
        return view

    def _read_history(self) -> None:
        if self._setup.records is None:
            return
        try:
            self._history = History(tuple(self._setup.records.runs())[:_MOST_HISTORY])
        except StoreError as error:
            self.alarms.raise_alarm("fault", "Records cannot be read", str(error))

    def _set_entry(self, entry: Entry) -> None:
        """Replace what the operator entered; called with the lock held."""
        self._entry = entry
        self._publish()

    def _publish(self) -> None:
        with self._lock:
            self._state = self._newest_state()

    def _newest_state(self) -> StationState:
        entry, choice, running = self._entry, self._entry.choice, self.running
        return StationState(
            plans=self._listed.plans,
            ct_plans=self._listed.ct_plans,
            choice=None if choice is None else choice.shown,
            serial_number=entry.serial_number,
            operator=entry.operator,
            address=entry.address,
            test=entry.test,
            question=entry.question,
            running=running,
            can_start=not running and choice is not None and choice.checked is not None,
            keeps_records=self._setup.records is not None,
            can_make_plans=self._shelf.can_make_plans,
            can_run_demo=self._shelf.can_run_demo,
            has_trends=self._setup.trends is not None,
        )
