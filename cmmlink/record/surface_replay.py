"""Sends a recorded run of a whole surface through the same driver and the same pipeline again, as `replay` does with one of a section."""

import threading
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from cmmlink.events import RunStarted, Sink
from cmmlink.from_surface_plan import live_surface_of, notes_of_result, notes_on_surface, surface_of, words_of_nominal
from cmmlink.nominal_files.surface_file import SurfaceFile
from cmmlink.pipeline import Outcome, run_inspection
from cmmlink.plan import SurfacePlan
from cmmlink.record.agreement import Agreement, compare
from cmmlink.record.changed_plan import with_changes
from cmmlink.record.derived import Change
from cmmlink.record.reader import RecordedRun
from cmmlink.record.recorded_arrivals import Reading, arrivals_in, failure_of
from cmmlink.record.recorded_inputs import recorded_decoder, recorded_surface_plan, with_recorded_file
from cmmlink.record.replay import changes_between, refuse_altered
from cmmlink.record.store import Store
from cmmlink.surface_json import surface_json
from drivers import Capture, Decoder

if TYPE_CHECKING:
    from inspection.surface import SurfaceResult


@dataclass(frozen=True, slots=True, eq=False)
class SurfaceReplay:
    """The outcome of a replay; the fields are those of a `Replay`, and `file` is the nominal."""

    plan: SurfacePlan
    outcome: "Outcome[SurfaceResult]"
    file: SurfaceFile
    result_json: dict[str, Any]
    changed: tuple[Change, ...]
    agreement: Agreement
    notes: tuple[str, ...]


def replay_surface(
    store: Store,
    recorded: RecordedRun,
    decoder_of: Callable[[SurfacePlan], Decoder | None],
    *,
    tolerance: tuple[float, float] | None = None,
    method: str | None = None,
    settings: Mapping[str, str] | None = None,
    clock: Callable[[], float] = time.monotonic,
    sinks: Sequence[Sink] = (),
    stop: threading.Event | None = None,
) -> SurfaceReplay:
    """Evaluate a recorded run again; see `replay_run`, whose arguments these are.

    Raises StoreError where the record is altered or cannot be read, PlanError where the changed plan cannot be used.
    """
    refuse_altered(store, recorded)
    plan = recorded_surface_plan(recorded)
    changed = with_changes(plan, tolerance, method, settings or {})
    file = recorded_surface(changed, recorded)
    stop = stop or threading.Event()
    decoder = recorded_decoder(plan, recorded, decoder_of)
    reading = Reading(arrivals_in(store, recorded, decoder, stop))
    source = Capture(reading, decoder, failure_of(recorded))
    started = RunStarted.from_header(recorded.header)
    live = live_surface_of(changed, file, provisional=bool(sinks))
    outcome = run_inspection(source, live, sinks, started, buffer_points=plan.buffer_points, clock=clock, stop=stop)
    reading.raise_failure(recorded.run, outcome.failure)
    replayed = surface_json(outcome.result, outcome.counts, words_of_nominal(file))
    noted = started.notes
    if changed.surface != plan.surface:
        head = f"{plan.surface.file.name}: "
        noted = (*notes_on_surface(plan, file), *(note for note in noted if not note.startswith(head)))
    agreement = compare(store, recorded, replayed, outcome.result)
    changes = changes_between(plan, changed, recorded)
    return SurfaceReplay(changed, outcome, file, replayed, changes, agreement, (*noted, *notes_of_result(outcome.result, file)))


def recorded_surface(plan: SurfacePlan, recorded: RecordedRun) -> SurfaceFile:
    """The nominal from its recorded file; the one that the plan names may have changed since, or be gone."""
    with with_recorded_file(plan, recorded) as at_hand:
        return surface_of(at_hand)
