"""Sends a recorded run through the same driver and the same pipeline again.

With nothing changed the result is the recorded one, bit for bit; with another tolerance or method it is a new evaluation,
which says what was changed and what came out differently.
"""

import threading
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import TYPE_CHECKING, Any, Protocol

from cmmlink.characteristics import notes_on_characteristics
from cmmlink.errors import StoreError
from cmmlink.events import RunStarted, Sink
from cmmlink.from_plan import inspection_of, notes_on_datum, notes_on_nominal, notes_on_temperature
from cmmlink.pipeline import Outcome, RunOutcome, run_inspection
from cmmlink.plan import Plan, SurfacePlan
from cmmlink.record.agreement import Agreement, compare, differences_of
from cmmlink.record.changed_plan import with_changes
from cmmlink.record.derived import Change, Judgement, keep_judgements
from cmmlink.record.kept_result import judged_bodies
from cmmlink.record.reader import RecordedRun
from cmmlink.record.recorded_arrivals import Reading, arrivals_in, failure_of
from cmmlink.record.recorded_inputs import recorded_decoder, recorded_plan, with_recorded_file
from cmmlink.record.recorded_nominal import recorded_profile
from cmmlink.record.recorder import result_sha256
from cmmlink.record.run_inputs import software
from cmmlink.record.seal import Seal
from cmmlink.record.store import Store
from cmmlink.result_json import density_notes, density_of, result_json, stations_of
from cmmlink.scratch import scratch_in
from cmmlink.words import utc_words
from drivers import Capture, Decoder
from inspection import NominalProfile, Reason, SectionCharacteristic

if TYPE_CHECKING:
    from inspection.surface import SurfaceResult


@dataclass(frozen=True, slots=True, eq=False)
class Replay:
    """The outcome of a replay.

    plan      : what was evaluated, with what was changed in it
    changed   : settings and software that are not those of the recorded run
    agreement : how the result compares with the recorded one
    notes     : what was assumed about nominal and points when they were recorded
    """

    plan: Plan
    outcome: RunOutcome
    profile: NominalProfile
    result_json: dict[str, Any]
    changed: tuple[Change, ...]
    agreement: Agreement
    notes: tuple[str, ...]

    @property
    def identical(self) -> bool | None:
        """Whether all is as recorded, to the last bit of every deviation; None where there is no recorded result."""
        return self.agreement.identical

    @property
    def differs(self) -> tuple[Change, ...]:
        """Values of the result that are not as recorded."""
        return self.agreement.differs


def replay_run(
    store: Store,
    recorded: RecordedRun,
    decoder_of: Callable[[Plan], Decoder | None],
    *,
    tolerance: tuple[float, float] | None = None,
    method: str | None = None,
    settings: Mapping[str, str] | None = None,
    clock: Callable[[], float] = time.monotonic,
    sinks: Sequence[Sink] = (),
    stop: threading.Event | None = None,
    shown: bool = False,
    profile: NominalProfile | None = None,
    numbers: Sequence[SectionCharacteristic] = (),
) -> Replay:
    """Evaluate a recorded run again. `decoder_of` gives the decoder of a plan's device, None for one without wire bytes.

    `settings` are keys of the plan with what is to stand behind them, as it would be written there.
    `sinks` take the events; setting `stop` aborts the replay. `shown`: somebody looks on, who is told the characteristics meanwhile.
    `profile` is the nominal of the record, where it is known already; `numbers` are found as well, without a part in the verdict.

    Raises StoreError where the record is altered or cannot be read, PlanError where the changed plan cannot be used.
    """
    refuse_altered(store, recorded)
    plan = recorded_plan(recorded)
    changed = with_changes(plan, tolerance, method, settings or {})
    profile = profile or recorded_profile(changed, recorded)
    stop = stop or threading.Event()
    decoder = recorded_decoder(plan, recorded, decoder_of)
    reading = Reading(arrivals_in(store, recorded, decoder, stop))
    source = Capture(reading, decoder, failure_of(recorded))
    started = RunStarted.from_header(recorded.header)
    is_seen = bool(sinks) or shown  # else a provisional pose, which takes most of the time, would be told to nobody
    live = inspection_of(changed, profile, scratch_in(store.path.parent), numbers=numbers, provisional=is_seen)
    outcome = run_inspection(
        source,
        live,
        sinks,
        started,
        buffer_points=plan.buffer_points,
        clock=clock,
        stop=stop,
        doubt=_doubt_of(recorded),
        shown=shown,
        cut_short="as recorded" if plan.stop_when_failed else "never",
    )
    reading.raise_failure(recorded.run, outcome.failure)
    replayed = result_json(outcome.result, outcome.counts)
    notes = (
        *_notes_on(changed, plan, started.notes, recorded),
        *density_notes(density_of(stations_of(outcome.result), profile.length_mm), profile.length_mm),
    )
    return Replay(
        changed,
        outcome,
        profile,
        replayed,
        changes_between(plan, changed, recorded),
        compare(store, recorded, replayed, outcome.result),
        notes,
    )


def refuse_altered(store: Store, recorded: RecordedRun) -> None:
    """Raise StoreError where the record of a run was altered."""
    altered, _, _ = store.first_alteration(recorded.run)
    if altered is not None:
        raise StoreError(f"{store.path}: {altered}; what was altered is not judged again")


def changes_between(plan: Plan | SurfacePlan, changed: Plan | SurfacePlan, recorded: RecordedRun) -> tuple[Change, ...]:
    """The settings and the software that are not those of the recorded run."""
    settings = differences_of(plan.model_dump(mode="json"), changed.model_dump(mode="json"))
    return (*settings, *differences_of(dict(recorded.header["software"]), software(), "software."))


class JudgedAgain(Protocol):
    """What a replay found, be it of a section or of a surface."""

    @property
    def plan(self) -> Plan | SurfacePlan:
        """What was evaluated, with what was changed in it."""

    @property
    def outcome(self) -> "RunOutcome | Outcome[SurfaceResult]":
        """How it ended."""

    @property
    def result_json(self) -> dict[str, Any]:
        """What was found, as the record tells it."""

    @property
    def changed(self) -> tuple[Change, ...]:
        """Settings and software that are not those of the recorded run."""


def judgement_of(recorded: RecordedRun, again: JudgedAgain) -> Judgement:
    """What a replay with changes found, as the records keep it."""
    return Judgement(
        recorded.run,
        recorded.chain_sha256,
        changed=tuple(change for change in again.changed if not change.key.startswith("software.")),
        plan=again.plan.effective_yaml(),
        software=software(),
        result=again.result_json,
        result_sha256=result_sha256(again.result_json, (body for _, body in judged_bodies(again.outcome.result))),
        key=again.plan.records.key,
    )


def keep_judgement(
    store: Store, recorded: RecordedRun, again: JudgedAgain, *, who: str, why: str, now: datetime, seal: Seal | None = None
) -> dict[str, Any]:
    """Add what a replay with changes found to the records, chained to them and to its run. Returns what says where it stands.

    Raises StoreError where it cannot be kept.
    """
    (kept,) = keep_judgements(store, [judgement_of(recorded, again)], who=who, why=why, when=utc_words(now), seal=seal)
    return {"when": utc_words(now), "who": who, "why": why, "record": kept.number, "chain_sha256": kept.sha256.hex()}


def _notes_on(changed: Plan, plan: Plan, noted: Sequence[str], recorded: RecordedRun) -> Iterator[str]:
    """What was assumed: as it was noted for the recorded plan, but anew where it follows from what was changed."""
    stale = _notes_from(plan) if changed != plan else []
    head = f"{plan.nominal.file.name}: "
    if changed.nominal != plan.nominal:
        with with_recorded_file(changed, recorded) as at_hand:
            yield from (head + note.removeprefix(f"{at_hand.nominal.file.name}: ") for note in notes_on_nominal(at_hand))
        stale += [note for note in noted if note.startswith(head)]
    yield from (note for note in noted if note not in stale)
    if changed != plan:
        yield from _notes_from(changed)


def _notes_from(plan: Plan) -> list[str]:
    return [*notes_on_datum(plan), *notes_on_temperature(plan), *notes_on_characteristics(plan)]


def _doubt_of(recorded: RecordedRun) -> Reason | None:
    """The doubt about the outline of a section of a surface, whose other contours are not on record."""
    words = (recorded.header.get("stack") or {}).get("doubt")
    return Reason("outline", words) if words else None
