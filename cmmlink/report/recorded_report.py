"""What the report of a recorded run is made of: the result as it was recorded, its points, its plan and its nominal."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from cmmlink.events import RunStarted
from cmmlink.exports import document_on_record, judged_rows, sound_run
from cmmlink.record import RecordedRun, Replay, Store, SurfaceReplay, end_missing, recorded_plan, recorded_profile, software
from cmmlink.report.judged_scan import scan_on_record
from cmmlink.report.picture_content import content_of
from cmmlink.report.report_input import ReportInput, places_in, regions_in, zone_in
from cmmlink.result_json import identity_json


def input_on_record(store: Store, run: str) -> ReportInput:
    """What the report of a run on record is made of, for as long as the records are open.

    Raises StoreError where its record was altered or cannot be read.
    """
    recorded = sound_run(store, run)
    plan = recorded_plan(recorded)
    profile = recorded_profile(plan, recorded)
    document = document_on_record(store, recorded, profile)
    end = recorded.end or end_missing(store, run)
    report = ReportInput(document, plan, end["message"] or "")
    if recorded.result is None or not document["judged"]:
        return report
    scan = scan_on_record(document, zone_in(document["tolerance"]), lambda: judged_rows(store, run))
    regions, places = regions_in(document), places_in(document)
    return replace(report, content=content_of(scan, profile, report.title, end["state"], regions=regions, places_mm=places))


def input_of_replay(again: Replay | SurfaceReplay, document: Mapping[str, Any], recorded: RecordedRun) -> ReportInput:
    """What the report of a run that was judged again is made of, without its drawings; `document` is what is printed of it."""
    known = {**identity_json(RunStarted.from_header(recorded.header)), "software": software(), **document}
    return ReportInput(known, again.plan, str(again.outcome.failure or again.outcome.refusal or ""))
