"""What a run or a replay of the station does in its own thread. Whatever goes wrong becomes an alarm, never silence."""

import logging
from collections.abc import Callable
from dataclasses import replace

from cmmlink.console.alarms import Alarms
from cmmlink.console.choice import CheckedPlan, CheckedSurface
from cmmlink.console.job import Job
from cmmlink.console.refused import without_folders
from cmmlink.console.station_setup import StationSetup
from cmmlink.devices import Connected
from cmmlink.errors import PlanError, StoreError
from cmmlink.events import Answered, Event, Sink
from cmmlink.run import FinishedRun, carry_out
from cmmlink.run_view import RunView
from cmmlink.surface_run import FinishedSurface, carry_out_surface
from drivers import DeviceError

_log = logging.getLogger(__name__)


def raise_alarms(job: Job, view: RunView, alarms: Alarms, work: Callable[[], None]) -> None:
    """Do the work of a run that is shown in a view; what breaks it off becomes an alarm."""
    try:
        work()
    except StoreError as error:
        _break_off(job, view, alarms, "Record not kept", error)
    except DeviceError as error:
        _break_off(job, view, alarms, "Device failed", error)
    except ValueError as error:  # plan, nominal or points cannot be used
        _break_off(job, view, alarms, "Cannot be inspected", error)
    except Exception as error:
        _break_off(job, view, alarms, f"Defect in the program ({type(error).__name__})", error)


def _break_off(job: Job, view: RunView, alarms: Alarms, what: str, error: Exception) -> None:
    _log.error("%s: %s", what, error, exc_info=error)
    job.failure = error
    view.fail(f"{what}: {error}")
    alarms.raise_alarm("fault", what, str(error))


def measure(job: Job, view: RunView, checked: CheckedPlan | CheckedSurface, setup: StationSetup, alarms: Alarms) -> None:
    """Measure a part as its plan says, keep the record, and write the results where the plan wants them."""
    with setup.connect(checked.plan) as connected:
        job.attach(connected.source, moves=connected.moves)
        known = tuple(note for note in checked.notes if note not in connected.notes)
        device = replace(connected, notes=(*known, *connected.notes))
        finished = job.finished = _carry_out(job, view, checked, device, setup, alarms)
        job.detach()
    if finished.evidence is not None:
        view.name_record(finished.evidence.run)
        alarms.take_anchors(finished.evidence.anchors)
    try:
        setup.write(finished)
    except PlanError as error:
        job.unwritten = error
        alarms.raise_alarm("fault", "The results could not be written", str(error))


def _carry_out(
    job: Job, view: RunView, checked: CheckedPlan | CheckedSurface, device: Connected, setup: StationSetup, alarms: Alarms
) -> FinishedRun | FinishedSurface:
    records = None if setup.records is None else setup.records.folder
    sinks: list[Sink] = [alarms, sink_of(view, alarms)]
    if isinstance(checked, CheckedSurface):
        return carry_out_surface(
            checked.plan,
            checked.file,
            device,
            records=records,
            clock=setup.clock,
            now=setup.now,
            stop=job.stop,
            sinks=sinks,
            on_ready=view.await_device,
        )
    return carry_out(
        checked.plan,
        checked.profile,
        device,
        records=records,
        clock=setup.clock,
        now=setup.now,
        stop=job.stop,
        sinks=sinks,
        on_ready=view.await_device,
        shown=True,
    )


def sink_of(view: RunView, alarms: Alarms) -> Sink:
    """The view as a sink that cannot end a run: a fault in drawing is an alarm, not a lost measurement."""

    def show(event: Event) -> None:
        try:
            view(replace(event, problem=without_folders(event.problem)) if isinstance(event, Answered) else event)
        except Exception as error:
            alarms.raise_alarm("fault", "The page cannot show this run", repr(error))

    return show
