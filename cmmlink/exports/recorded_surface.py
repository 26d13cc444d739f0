"""Runs of whole surfaces from their records, in the formats that can hold them."""

import json
from collections.abc import Sequence
from typing import Any

from cmmlink.errors import PlanError, RunError
from cmmlink.events import Counts, RunStarted
from cmmlink.exports.recorded_part import began_of, evidence_of, sound_run
from cmmlink.plan import FormatName
from cmmlink.record import RecordedRun, Store, end_missing, unpack_surface
from cmmlink.result_files import NewFiles
from cmmlink.result_json import run_document
from cmmlink.surface_csv import write_surface_deviations
from cmmlink.surface_json import surface_json

_HELD: tuple[FormatName, ...] = ("json", "csv")


def write_surfaces(store: Store, runs: Sequence[str], formats: Sequence[FormatName], files: NewFiles, stem: str) -> None:
    """Write runs of surfaces in each of the formats, as STEM.FORMAT; where there are many, RUN.FORMAT for each.

    Raises PlanError for a format that cannot hold a surface, RunError where a run is still being recorded, StoreError where its record
    was altered or cannot be read.
    """
    unfit = next((name for name in formats if name not in _HELD), None)
    if unfit is not None:
        raise PlanError(f"--format {unfit} holds results of sections; {runs[0]} is a run of a whole surface: expected json or csv")
    for run in runs:
        recorded, name = sound_run(store, run), stem if len(runs) == 1 else run
        if recorded.end is None and store.recording:
            raise RunError(f"{store.path}: run {run} is still being recorded; export it when it has ended")
        document = surface_document(store, recorded)
        if "json" in formats:
            files(f"{name}.json").write_text(json.dumps(document, indent=2) + "\n", encoding="utf-8")
        if "csv" in formats:
            bodies = (record.body for record in store.records(run, "deviations")) if recorded.result is not None else ()
            write_surface_deviations(map(unpack_surface, bodies), files(f"{name}.csv"), document["ending"])


def surface_document(store: Store, recorded: RecordedRun) -> dict[str, Any]:
    """What result.json says of a run of a surface, from its record."""
    end = recorded.end or end_missing(store, recorded.run)
    received = end["received"] or 0
    found = recorded.result or surface_json(None, Counts(received=received, rejected=received), None)
    started = RunStarted.from_header(recorded.header)
    told = {note.removeprefix(f"{recorded.header['nominal']}: ") for note in started.notes}
    notes = [*started.notes, *(note for note in found["assumed"] if note not in told)]
    return run_document(found, started, notes, end["state"], began_of(recorded), evidence_of(store, recorded))
