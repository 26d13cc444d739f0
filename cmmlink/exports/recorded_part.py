"""A measured part from its record: the same as when it was measured, whatever version measured it."""

from collections.abc import Iterator, Mapping
from dataclasses import asdict
from datetime import datetime
from typing import Any

from cmmlink.errors import RunError, StoreError
from cmmlink.events import Counts, RunStarted
from cmmlink.exports.earlier_results import earlier_notes, with_keys_of_today
from cmmlink.exports.measured_part import MeasuredPart, part_of_document
from cmmlink.record import (
    RecordedRun,
    Store,
    anchors_of,
    answer_of,
    end_missing,
    recorded_plan,
    recorded_profile,
    recorded_run,
    signature_of,
    unpack_judged,
)
from cmmlink.result_json import density_notes, density_of, result_json, run_document
from cmmlink.words import utc_words
from inspection import JudgedRows, NominalProfile

_HASHES = ("plan_sha256", "nominal_sha256", "software")


def part_on_record(store: Store, run: str) -> MeasuredPart:
    """The part of a run on record, for as long as the records are open.

    Raises RunError where it is still being recorded, StoreError where its record was altered or cannot be read.
    """
    recorded = sound_run(store, run)
    if recorded.end is None and store.recording:
        raise RunError(f"{store.path}: run {run} is still being recorded; export it when it has ended")
    plan = recorded_plan(recorded)
    place = recorded.header.get("stack")
    document = document_on_record(store, recorded, recorded_profile(plan, recorded))
    return part_of_document(document, plan, lambda: judged_rows(store, run), place and place["height_mm"])


def sound_run(store: Store, run: str) -> RecordedRun:
    """A run on record. Raises StoreError where its record was altered: of what was altered nothing is handed on."""
    altered, _, _ = store.first_alteration(run)
    if altered is not None:
        raise StoreError(f"{store.path}: {altered}; of what was altered there is no report and no export")
    return recorded_run(store, run)


def judged_rows(store: Store, run: str) -> Iterator[JudgedRows]:
    """The rows of a recorded result, piece by piece."""
    return (unpack_judged(record.body) for record in store.records(run, "deviations"))


def document_on_record(store: Store, recorded: RecordedRun, profile: NominalProfile) -> dict[str, Any]:
    """What result.json says of a run, from its record."""
    end = recorded.end or end_missing(store, recorded.run)
    received = end["received"] or 0
    found = result_json(None, Counts(received=received, rejected=received))
    if recorded.result is not None:
        found = with_keys_of_today(recorded.result)
    started = RunStarted.from_header(recorded.header)
    stations = (rows.station_mm for rows in judged_rows(store, recorded.run)) if recorded.result is not None else ()
    notes = [
        *started.notes,
        *earlier_notes(recorded.result or {}),
        *density_notes(density_of(stations, profile.length_mm), profile.length_mm),
    ]
    return run_document(found, started, notes, end["state"], began_of(recorded), evidence_of(store, recorded))


def began_of(recorded: RecordedRun) -> str:
    """When a run on record began, in UTC."""
    return utc_words(datetime.fromisoformat(recorded.header["started"]))


def evidence_of(store: Store, recorded: RecordedRun) -> Mapping[str, Any]:
    """What ties the result of a run to its record."""
    header, signature = recorded.header, signature_of(store, recorded.run)
    return {
        "run": recorded.run,
        "chain_sha256": recorded.chain_sha256,
        **{key: header[key] for key in _HASHES if key in header},
        "signature": None if signature is None else signature.beside_result(),
        "anchors": [asdict(one) for one in anchors_of(store, recorded.run)],
        **_answer(store, recorded.run),
    }


def _answer(store: Store, run: str) -> Mapping[str, Any]:
    """What came of the answer to the machine, as the result told it, where that is on record."""
    kept = answer_of(store, run)
    told = {key: value for key, value in (kept or {}).items() if key not in ("text", "chain_sha256")}
    return {"answer": {**told, "unrecorded": None}} if told else {}
