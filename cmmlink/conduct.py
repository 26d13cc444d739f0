"""How every run is conducted, whatever its points are held against: with its record from its first to its last event.

The walk: open the record, hand the device's source to the pipeline, keep what ties the result to the record, tell the machine that asked
for the verdict.
"""

import logging
import threading
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from dataclasses import asdict, dataclass, replace
from datetime import datetime
from pathlib import Path
from typing import Generic, Protocol

from cmmlink.devices import Connected
from cmmlink.events import Answered, Event, RunStarted, Sink
from cmmlink.from_plan import run_started
from cmmlink.pipeline import CutShort, Live, Outcome, Refusal, Result, run_inspection
from cmmlink.plan import FileDevice, Plan, SurfacePlan
from cmmlink.record import (
    PATIENCE_S,
    QUEUE_BYTES,
    DocumentOf,
    Recorder,
    RecordReference,
    RunInputs,
    Seal,
    anchor_ends,
    document_of_section,
    keep_answer,
    open_to_record,
    seal_of,
)
from cmmlink.result_folder import folder_of
from cmmlink.run_log import log_event
from cmmlink.words import utc_words
from inspection import InspectionError

_FILE_POINTS, _FILE_BYTES = 1 << 15, 4 << 20  # a file can wait: no more of it is held than keeps judging and recording busy
_log = logging.getLogger(__name__)


class Answering(Protocol[Result]):
    """What tells a machine the verdict that it asked for."""

    def __call__(self, event: Event) -> None:
        """Take one event of the run."""

    def deliver(self, outcome: Outcome[Result], run: str, keep: Callable[[Answered], str]) -> Answered:
        """Tell the machine the verdict, once the run is on record."""


@dataclass(frozen=True, slots=True, eq=False)
class Conducted(Generic[Result]):
    """A run that is over, and its evidence; None where nothing was recorded. `answer` says whether a machine was told the verdict."""

    started: RunStarted
    outcome: Outcome[Result]
    evidence: RecordReference | None
    began: datetime
    answer: Answered | None


def conduct(
    plan: Plan | SurfacePlan,
    live: Live[Result],
    device: Connected,
    notes: tuple[str, ...],
    *,
    records: Path | None,
    clock: Callable[[], float],
    now: Callable[[], datetime],
    stop: threading.Event,
    sinks: Sequence[Sink] = (),
    answer: Answering[Result] | None = None,
    patience_s: float = PATIENCE_S,
    document_of: DocumentOf = document_of_section,
    no_room: Refusal = lambda received, announced: "",
    shown: bool = False,
    cut_short: CutShort = "never",
) -> Conducted[Result]:
    """Conduct one run of a plan to its end. Blocks the calling thread, in which all sinks are called, the recorder first.

    notes       : what was assumed about nominal, points and device
    document_of : what the record says of a result

    The rest is as in `cmmlink.run.carry_out` and `cmmlink.pipeline.run_inspection`. Raises StoreError when the record cannot be kept.
    """
    followed = bool(sinks) or not isinstance(plan.device, FileDevice)
    with ExitStack() as stack:
        recorder: Recorder | None = None
        if records is not None:
            store = stack.enter_context(open_to_record(records, now, patience_s))
            seal: Seal = seal_of(store, station=plan.records.station, key=plan.records.key)
            queue_bytes, inputs = QUEUE_BYTES if followed else _FILE_BYTES, RunInputs.of(plan)
            made = Recorder(store, inputs, clock=clock, now=now, queue_bytes=queue_bytes, seal=seal, document_of=document_of)
            recorder = stack.enter_context(made)
            notes = (*notes, *seal.notes)
        started = run_started(plan, device.device, device.simulated, notes)
        began = recorder.began if recorder else now()
        listeners: list[Sink] = [*([recorder] if recorder else []), *sinks, log_event, *([answer] if answer else [])]
        outcome = run_inspection(
            device.source,
            live,
            listeners,
            started,
            buffer_points=plan.buffer_points if followed else min(plan.buffer_points, _FILE_POINTS),
            clock=clock,
            stop=stop,
            watch=recorder.check if recorder else lambda: None,
            no_room=no_room,
            shown=shown,
            cut_short=cut_short,
        )
        evidence = recorder.evidence if recorder else None
        answered: Answered | None = None
        if answer is not None:  # a machine waits: before all others
            run = evidence.run if evidence else ""
            answered = answer.deliver(outcome, run, lambda given: keep_answer(store, seal, run, given))
        if evidence is not None:
            told = anchor_ends(store, seal, plan.records.places, utc_words(now()), [evidence])
            evidence = replace(evidence, anchors=[asdict(one) for one in told])
    if evidence is not None:
        _log.info("recorded in %s as run %s, chain %s, plan %s", records, evidence.run, evidence.chain_sha256, evidence.plan_sha256)
    return Conducted(started, outcome, evidence, began, answered)


# --- what a run that is over says of itself -------------------------------------------------------------------------------


def title_of(started: RunStarted) -> str:
    """The part, its serial number, and whether it was simulated."""
    return " ".join(filter(None, [started.part, started.serial_number, "(SIMULATED)" if started.simulated else ""]))


def refusal_of(refused: InspectionError | None, plan: Plan | SurfacePlan, started: RunStarted) -> InspectionError | None:
    """Why no result could be given, with what was assumed of a file of points: that may be the cause. None where there is one."""
    if refused is None or not isinstance(plan.device, FileDevice):
        return refused
    of_file = [note for note in started.notes if note.startswith(f"{plan.device.file.name}: ")]
    return type(refused)("; ".join([str(refused), *of_file]))


def results_folder(pattern: Path, started: RunStarted, evidence: RecordReference | None, began: datetime) -> Path:
    """The folder of a run's results, its placeholders filled in; without a record the run is named by when it began."""
    run = evidence.run if evidence else f"{began:%Y%m%d-%H%M%S}"
    return folder_of(pattern, part=started.part, serial_number=started.serial_number, run=run)
