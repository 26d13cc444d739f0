"""What the report of a stack on record is made of: its sections as they were recorded, and the plan of the stack.

For the characteristics of the stack each section is judged again (cmmlink.stack_again).
"""

from collections.abc import Iterator, Mapping, Sequence
from datetime import datetime
from functools import partial
from typing import Any

import numpy as np

from cmmlink.errors import StoreError
from cmmlink.events import Counts
from cmmlink.plan import CtPlan
from cmmlink.record import Nominals, RecordedRun, Store, end_missing, recorded_plan, recorded_run, unpack_judged
from cmmlink.report.judged_scan import JudgedScan, scan_on_record
from cmmlink.report.picture_content import PictureContent, content_of
from cmmlink.report.report_input import places_in, regions_in, zone_in
from cmmlink.report.stack_input import MAP_COLUMNS, MapRow, SectionSheet, StackInput, map_row, runs_words
from cmmlink.result_json import result_json
from cmmlink.stack_again import judge_stack_again, plan_of_stack
from cmmlink.words import utc_words
from inspection import JudgedRows, Verdict

_VERDICTS = {verdict.word: verdict for verdict in Verdict}


def stack_on_record(store: Store, runs: Sequence[str]) -> StackInput:
    """What the report of a stack is made of, whose sections are these runs, in their order, for as long as the records are open.

    Raises StoreError where a record was altered or cannot be read.
    """
    for run in runs:
        altered, _, _ = store.first_alteration(run)
        if altered is not None:
            raise StoreError(f"{store.path}: {altered}; of what was altered there is no report")
    recorded, profiles = [recorded_run(store, run) for run in runs], Nominals()
    place: Mapping[str, Any] = recorded[0].header["stack"]
    plan = plan_of_stack(recorded[0])
    shared = [note for note in recorded[0].header.get("notes", ()) if all(note in one.header.get("notes", ()) for one in recorded)]
    sheets = tuple(_sheet_of(store, one, profiles, shared) for one in recorded)
    asked = int(place["sections"])
    of_stack, told = _characteristics(store, plan, recorded, profiles)
    complete = len(sheets) == asked and all(sheet.document["ending"] == "complete" for sheet in sheets)
    verdicts = [_VERDICTS[found["verdict"]] for found in (*(sheet.document for sheet in sheets), *of_stack)]
    verdict = max(*verdicts, Verdict.CONFORM if complete else Verdict.UNCERTAIN)
    document = {
        "verdict": verdict.word,
        "ending": "complete" if complete else "aborted",
        "measured_at": utc_words(datetime.fromisoformat(recorded[0].header["started"])),
        "run": runs_words([one.run for one in recorded]),
        "software": recorded[0].header["software"],
        **{key: recorded[0].header[key] for key in ("qualification",) if key in recorded[0].header},
    }
    return StackInput(plan, document, sheets, asked, (*shared, *told), of_stack)


def _sheet_of(store: Store, recorded: RecordedRun, profiles: Nominals, shared: Sequence[str]) -> SectionSheet:
    header, end = recorded.header, recorded.end or end_missing(store, recorded.run)
    place, profile = header["stack"], profiles.of(recorded_plan(recorded), recorded)
    received = end["received"] or 0
    found = recorded.result or result_json(None, Counts(received=received, rejected=received))
    own = [note for note in header.get("notes", ()) if note not in shared] + ([end["message"]] if end["message"] else [])
    document = found | {"height_mm": place["height_mm"], "ending": end["state"], "run": recorded.run, "notes": own}
    blocks = partial(_blocks, store, recorded.run)
    row = MapRow(place["height_mm"], profile.length_mm, np.full(MAP_COLUMNS, np.nan))
    scan: JudgedScan | None = None
    if found["rule"] is not None and found["judged"]:
        scan = scan_on_record(found, zone_in(found["tolerance"]), blocks)
        stretches = [(one["from_mm"], one["to_mm"], one["worst_mm"]) for one in found["stretches"]]
        row = map_row(row.height_mm, row.length_mm, scan.station_mm, scan.deviation_mm, stretches, scan.zone.middle_mm)

    def draw() -> PictureContent | None:
        if scan is None:
            return None
        return content_of(scan, profile, "", end["state"], regions=regions_in(document), places_mm=places_in(document))

    return SectionSheet(place["section"], document, end["message"] or "", row, draw)


def _blocks(store: Store, run: str) -> Iterator[JudgedRows]:
    return (unpack_judged(record.body) for record in store.records(run, "deviations"))


def _characteristics(
    store: Store, plan: CtPlan, recorded: Sequence[RecordedRun], profiles: Nominals
) -> tuple[tuple[Mapping[str, Any], ...], list[str]]:
    """The characteristics of the stack, and a note where its sections do not come out today as they are on record."""
    if not plan.stack_characteristics:
        return (), []
    again = judge_stack_again(store, recorded, profiles)
    told = ["the characteristics of the stack were judged again from the points on record"]
    if again.differs:
        told.append(f"judged again, {len(again.differs)} sections are not what is on record, the first of them run {again.differs[0]}")
    return again.characteristics, told
