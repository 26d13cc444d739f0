"""What a run or a replay of the station does in its own thread. Whatever goes wrong becomes an alarm, never silence."""

import logging
from collections.abc import Callable
from dataclasses import replace

from cmmlink.console.alarms import Alarms
from cmmlink.console.choice import CheckedPlan
from cmmlink.console.job import Job
from cmmlink.console.refused import without_folders
from cmmlink.console.station_setup import StationSetup
from cmmlink.errors import PlanError, StoreError
from cmmlink.events import Answered, Event, Sink
from cmmlink.run import carry_out
from cmmlink.run_view import RunView
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


def measure(job: Job, view: RunView, checked: CheckedPlan, setup: StationSetup, alarms: Alarms) -> None:
    """Measure a part as its plan says, keep the record, and write the results where the plan wants them."""
    plan, records = checked.plan, setup.records
    with setup.connect(plan) as connected:
        job.attach(connected.source, moves=connected.moves)
        known = tuple(note for note in checked.notes if note not in connected.notes)
        finished = job.finished = carry_out(
            plan,
            checked.profile,
            replace(connected, notes=(*known, *connected.notes)),
            records=None if records is None else records.folder,
            clock=setup.clock,
            now=setup.now,
            stop=job.stop,
            sinks=[alarms, sink_of(view, alarms)],
            on_ready=view.await_device,
            shown=True,
        )
        job.detach()
    if finished.evidence is not None:
        view.name_record(finished.evidence.run)
        alarms.take_anchors(finished.evidence.anchors)
    try:
        setup.write(plan, finished)
    except PlanError as error:
        job.unwritten = error
        alarms.raise_alarm("fault", "The results could not be written", str(error))


def sink_of(view: RunView, alarms: Alarms) -> Sink:
    """The view as a sink that cannot end a run: a fault in drawing is an alarm, not a lost measurement."""

    def show(event: Event) -> None:
        try:
            view(replace(event, problem=without_folders(event.problem)) if isinstance(event, Answered) else event)
        except Exception as error:
            alarms.raise_alarm("fault", "The page cannot show this run", repr(error))

    return show
