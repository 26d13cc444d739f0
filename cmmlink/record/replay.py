"""Sends a recorded run through the same driver and the same pipeline again.

With nothing changed the result is the recorded one, bit for bit; with another tolerance or method it is a new evaluation,
which says what was changed and what came out differently.
"""

import tempfile
import threading
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from cmmlink.characteristics import notes_on_zone
from cmmlink.errors import PlanError, StoreError, YamlError
from cmmlink.events import RunStarted, Sink
from cmmlink.from_plan import inspection_of, notes_on_datum, notes_on_nominal, notes_on_temperature, profile_of
from cmmlink.pipeline import RunOutcome, run_inspection
from cmmlink.plan import Plan, read_model, value_of, words_of_allowed
from cmmlink.record.agreement import Agreement, compare, differences_of
from cmmlink.record.bodies import PlacedArrival
from cmmlink.record.derived import Change, derived_draft
from cmmlink.record.reader import RecordedRun, arrivals_of, points_of, reads_of
from cmmlink.record.recorder import judged_bodies, result_sha256
from cmmlink.record.run_inputs import software
from cmmlink.record.seal import Seal
from cmmlink.record.shapes import plain_name
from cmmlink.record.store import Store
from cmmlink.result_json import density_notes, density_of, result_json, stations_of
from cmmlink.scratch import scratch_in
from cmmlink.words import utc_words
from drivers import Arrival, Capture, Decoder, LinkDown, LinkUp, PointBatch
from inspection import NominalProfile, Reason, SectionCharacteristic

# Keys that have no part in judging, or stand for what is on record itself.
_SETTLED = (
    "buffer_points",
    "device",
    "nominal.file",
    "operator",
    "out",
    "part",
    "records",
    "registration.datum.result",
    "report",
    "serial_number",
)


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
    altered, _, _ = store.first_alteration(recorded.run)
    if altered is not None:
        raise StoreError(f"{store.path}: {altered}; what was altered is not judged again")
    plan = recorded_plan(recorded)
    changed = _with_changes(plan, tolerance, method, settings or {})
    profile = profile or recorded_profile(changed, recorded)
    stop = stop or threading.Event()
    decoder = _decoder_of(plan, recorded, decoder_of)
    reading = _Reading(_arrivals(store, recorded, decoder, stop))
    source = Capture(reading, decoder, _failure(recorded))
    started = RunStarted.from_header(recorded.header)
    live = inspection_of(changed, profile, scratch_in(store.path.parent), numbers=numbers)
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
    reading.raise_failure(recorded.run, outcome)
    replayed = result_json(outcome.result, outcome.counts)
    changes = (*_settings_changed(plan, changed), *_software_changed(recorded.header["software"]))
    notes = (
        *_notes_on(changed, plan, started.notes, recorded),
        *density_notes(density_of(stations_of(outcome.result), profile.length_mm), profile.length_mm),
    )
    return Replay(changed, outcome, profile, replayed, changes, compare(store, recorded, replayed, outcome.result), notes)


class _Reading:
    """The arrivals of a record, and what kept them from being read: that is no failure of the recorded scan."""

    def __init__(self, arrivals: Iterator[Arrival]) -> None:
        self._arrivals = arrivals
        self._has_begun = False
        self._failure: StoreError | None = None

    def __iter__(self) -> Iterator[Arrival]:
        self._has_begun = True
        try:
            yield from self._arrivals
        except StoreError as error:
            self._failure = error
            raise

    def raise_failure(self, run: str, outcome: RunOutcome) -> None:
        """Raise StoreError where not all of the record was read."""
        if self._failure is not None:
            raise self._failure
        if outcome.failure is not None and not self._has_begun:
            raise StoreError(f"run {run} cannot be judged again: {outcome.failure}")


def recorded_plan(recorded: RecordedRun) -> Plan:
    """The effective plan of a recorded run. Raises StoreError when this version cannot read it."""
    try:
        return read_model(recorded.plan, Plan)
    except YamlError as error:
        raise StoreError(f"the plan of run {recorded.run} cannot be read by this version of cmmlink: {error}") from None


def _decoder_of(plan: Plan, recorded: RecordedRun, decoder_of: Callable[[Plan], Decoder | None]) -> Decoder | None:
    try:
        return decoder_of(plan)
    except ValueError as error:  # a format, an option or a register map that was valid on that day, or is gone
        raise StoreError(f"the device in the plan of run {recorded.run} cannot be read by this version of cmmlink: {error}") from None


def keep_judgement(
    store: Store, recorded: RecordedRun, again: Replay, *, who: str, why: str, now: datetime, seal: Seal | None = None
) -> dict[str, Any]:
    """Add what a replay with changes found to the records, chained to them and to its run. Returns what says where it stands.

    Raises StoreError where it cannot be kept.
    """
    draft = derived_draft(
        recorded.run,
        recorded.chain_sha256,
        when=utc_words(now),
        who=who,
        why=why,
        changed=[change for change in again.changed if not change.key.startswith("software.")],
        plan=again.plan.effective_yaml(),
        software=software(),
        result=again.result_json,
        result_sha256=result_sha256(again.result_json, (body for _, body in judged_bodies(again.outcome.result))),
    )
    kept = store.append([draft], *([seal.countersign] if seal else []))[0]
    return {"when": utc_words(now), "who": who, "why": why, "record": kept.number, "chain_sha256": kept.sha256.hex()}


def _with_changes(plan: Plan, tolerance: tuple[float, float] | None, method: str | None, settings: Mapping[str, str]) -> Plan:
    document = plan.model_dump()
    if tolerance is not None and plan.tolerance is None:
        raise PlanError("the recorded plan has no tolerance to be changed: its characteristics have limits of their own")
    if tolerance is not None:
        document["tolerance"] |= {"lower_mm": tolerance[0], "upper_mm": tolerance[1]}
    if method is not None:
        document["registration"]["method"] = method
    for key, text in settings.items():
        _set(document, key, text)
    try:
        return Plan.model_validate(document)
    except ValidationError as error:
        first = error.errors()[0]
        key, told = ".".join(map(str, first["loc"])), words_of_allowed(first)
        if first["type"] == "extra_forbidden":
            raise PlanError(f"the recorded plan cannot be changed so: {key} is no key of a plan; `cmmlink plan keys` lists them") from None
        if first["type"] == "missing":
            raise PlanError(f"the recorded plan cannot be changed so: {key} is missing; set it as well") from None
        raise PlanError(f"the recorded plan cannot be changed so: {key} is {first['input']!r}; expected {told}") from None


def _set(document: dict[str, Any], key: str, text: str) -> None:
    """Set a dotted key of a plan. Raises PlanError for what has no part in judging, and where there is no such place."""
    settled = next((one for one in _SETTLED if f"{key}.".startswith(f"{one}.")), None)
    if settled is not None:
        raise PlanError(f"{key} cannot be changed: what arrived, and the nominal it was held against, are those on record ({settled})")
    *groups, last = key.split(".")
    here: Any = document
    for group in groups:
        if isinstance(here, dict) and here.get(group) is None:
            here[group] = {}  # whether there is such a group of keys is told with the rest
        here = _within(here, group, key)
    value = _value_of(key, text)
    if isinstance(here, list):
        here[_index(here, last, key)] = value
    elif isinstance(here, dict):
        here[last] = value
    else:
        raise PlanError(f"{key}: there are no keys below {'.'.join(groups)}; `cmmlink plan keys` lists those there are")


def _within(here: Any, group: str, key: str) -> Any:
    if isinstance(here, list | tuple):
        return here[_index(here, group, key)]
    if isinstance(here, dict):
        if isinstance(here[group], tuple):
            here[group] = list(here[group])
        return here[group]
    raise PlanError(f"{key}: there are no keys below {group}; `cmmlink plan keys` lists those there are")


def _index(items: Sequence[Any], name: str, key: str) -> int:
    """The place in a list by its number, from 0 as messages about plans count, or by the name of what stands there."""
    named = [place for place, item in enumerate(items) if isinstance(item, dict) and item.get("name") == name]
    place = int(name) if name.isdecimal() and len(name) < 7 else None
    if named or (place is not None and place < len(items)):
        return named[0] if named else place or 0
    raise PlanError(f"{key}: there is no {name} among {len(items)}; expected its name, or its number from 0")


def _value_of(key: str, text: str) -> Any:
    try:
        return value_of(text)
    except YamlError as error:
        raise PlanError(f"{key}={text}: {error}") from None


def recorded_profile(plan: Plan, recorded: RecordedRun) -> NominalProfile:
    """Discretise the nominal from its recorded file; the one that the plan names may have changed since, or be gone."""
    with _with_recorded_file(plan, recorded) as at_hand:
        return profile_of(at_hand)


@contextmanager
def _with_recorded_file(plan: Plan, recorded: RecordedRun) -> Iterator[Plan]:
    """The plan with the nominal's file as it was recorded, which is there while this is entered."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / f"nominal-{plain_name(recorded.header['nominal'])}"
        try:
            file.write_bytes(recorded.nominal)
        except OSError as error:
            raise StoreError(f"{folder}: the nominal cannot be written there: {error.strerror or error}; free some space") from error
        yield plan.model_copy(update={"nominal": plan.nominal.model_copy(update={"file": file})})


def _notes_on(changed: Plan, plan: Plan, noted: Sequence[str], recorded: RecordedRun) -> Iterator[str]:
    """What was assumed: as it was noted for the recorded plan, but anew where it follows from what was changed."""
    stale = _notes_from(plan) if changed != plan else []
    head = f"{plan.nominal.file.name}: "
    if changed.nominal != plan.nominal:
        with _with_recorded_file(changed, recorded) as at_hand:
            yield from (head + note.removeprefix(f"{at_hand.nominal.file.name}: ") for note in notes_on_nominal(at_hand))
        stale += [note for note in noted if note.startswith(head)]
    yield from (note for note in noted if note not in stale)
    if changed != plan:
        yield from _notes_from(changed)


def _notes_from(plan: Plan) -> list[str]:
    return [*notes_on_datum(plan), *notes_on_temperature(plan), *notes_on_zone(plan)]


def _doubt_of(recorded: RecordedRun) -> Reason | None:
    """The doubt about the outline of a section of a surface, whose other contours are not on record."""
    words = (recorded.header.get("stack") or {}).get("doubt")
    return Reason("outline", words) if words else None


def _failure(recorded: RecordedRun) -> str:
    end = recorded.end or {"state": "interrupted", "message": ""}
    return str(end["message"] or "the record ends here") if end["state"] == "interrupted" else ""


def _arrivals(store: Store, recorded: RecordedRun, decoder: Decoder | None, stop: threading.Event) -> Iterator[Arrival]:
    """Recorded arrivals in their order: reads and link events where there is a decoder, else points and all other arrivals."""
    moments = arrivals_of(store, recorded.run)
    if decoder is not None:
        links = (moment for moment in moments if isinstance(moment.arrival, LinkDown | LinkUp))
        yield from _merge(reads_of(store, recorded.run), lambda _: 1, links, lambda moment: moment.reads)
    else:
        yield from _merge_points(points_of(store, recorded.run), moments)
    if recorded.end is not None and recorded.end["state"] == "aborted":
        stop.set()  # at the point where the operator aborted the recorded run


def _merge(
    items: Iterator[Arrival], size: Callable[[Arrival], int], moments: Iterator[PlacedArrival], place: Callable[[PlacedArrival], int]
) -> Iterator[Arrival]:
    """Merge counted arrivals with others, each of which has its place after a number of them."""
    done, moment = 0, next(moments, None)
    for item in items:
        while moment is not None and place(moment) <= done:
            yield moment.arrival
            moment = next(moments, None)
        yield item
        done += size(item)
    while moment is not None:
        yield moment.arrival
        moment = next(moments, None)


def _merge_points(batches: Iterator[PointBatch], moments: Iterator[PlacedArrival]) -> Iterator[Arrival]:
    """Merge points with other arrivals. An arrival between two points of one record splits that record."""
    done, moment = 0, next(moments, None)
    for batch in batches:
        begin = 0
        while moment is not None and moment.points < done + len(batch):
            cut = moment.points - done
            if cut > begin:
                yield _rows(batch, begin, cut)
            yield moment.arrival
            begin, moment = max(begin, cut), next(moments, None)
        yield _rows(batch, begin, len(batch))
        done += len(batch)
    while moment is not None:
        yield moment.arrival
        moment = next(moments, None)


def _rows(batch: PointBatch, begin: int, end: int) -> PointBatch:
    return PointBatch(batch.sequence[begin:end], batch.time_s[begin:end], batch.points_mm[begin:end])


def _settings_changed(plan: Plan, changed: Plan) -> Iterator[Change]:
    return differences_of(plan.model_dump(mode="json"), changed.model_dump(mode="json"))


def _software_changed(recorded: Mapping[str, str]) -> Iterator[Change]:
    return differences_of(dict(recorded), software(), "software.")
