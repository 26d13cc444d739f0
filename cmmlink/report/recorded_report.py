"""What the report of a recorded run is made of: the result as it was recorded, its points, its plan and its nominal."""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from datetime import datetime
from typing import Any, get_args

from cmmlink.errors import StoreError
from cmmlink.events import Counts, RunStarted
from cmmlink.record import RecordedRun, Replay, Store, end_missing, recorded_plan, recorded_profile, recorded_run, software, unpack_judged
from cmmlink.report.judged_scan import scan_on_record
from cmmlink.report.picture_content import content_of
from cmmlink.report.report_input import ReportInput, places_in, regions_in
from cmmlink.result_json import density_notes, density_of, identity_json, result_json
from cmmlink.words import utc_words
from inspection import DecisionRule, JudgedRows, ToleranceZone

_HASHES = ("plan_sha256", "nominal_sha256", "software")


def input_on_record(store: Store, run: str) -> ReportInput:
    """What the report of a run on record is made of, for as long as the records are open.

    Raises StoreError where its record was altered or cannot be read.
    """
    altered, _, _ = store.first_alteration(run)
    if altered is not None:
        raise StoreError(f"{store.path}: {altered}; of what was altered there is no report")
    recorded = recorded_run(store, run)
    plan = recorded_plan(recorded)
    profile = recorded_profile(plan, recorded)
    end = recorded.end or end_missing(store, run)
    found = recorded.result or result_json(None, Counts(received=end["received"] or 0, rejected=end["received"] or 0))
    started = RunStarted.from_header(recorded.header)

    def blocks() -> Iterator[JudgedRows]:
        return (unpack_judged(record.body) for record in store.records(run, "deviations"))

    scan = scan_on_record(found, zone_in(found["tolerance"]), blocks) if found["rule"] is not None and found["judged"] else None
    density = density_of([scan.station_mm] if scan is not None else [], profile.length_mm)
    notes = [*started.notes, *density_notes(density, profile.length_mm)]
    document = found | identity_json(started) | {"notes": notes} | {"ending": end["state"]} | _identity(recorded)
    report = ReportInput(document, plan, end["message"] or "")
    if scan is None:
        return report
    regions, places = regions_in(document), places_in(document)
    return replace(report, content=content_of(scan, profile, report.title, end["state"], regions=regions, places_mm=places))


def _identity(recorded: RecordedRun) -> dict[str, Any]:
    header = recorded.header
    measured_at = utc_words(datetime.fromisoformat(header["started"]))
    hashes = {key: header[key] for key in _HASHES if key in header}
    return {"measured_at": measured_at, "run": recorded.run, "chain_sha256": recorded.chain_sha256, **hashes}


def zone_in(tolerance: Mapping[str, Any]) -> ToleranceZone:
    """The zone of a result, whose decision rule JSON holds in words."""
    limits = tolerance["lower_mm"], tolerance["upper_mm"], tolerance["uncertainty_mm"]
    zones = [ToleranceZone(*limits, rule, provable=False) for rule in get_args(DecisionRule)]
    return next((zone for zone in zones if zone.decision_rule == tolerance["decision_rule"]), zones[0])


def input_of_replay(again: Replay, document: Mapping[str, Any], recorded: RecordedRun) -> ReportInput:
    """What the report of a run that was evaluated again is made of, without its drawings; `document` is what is printed of it."""
    known = {**identity_json(RunStarted.from_header(recorded.header)), "software": software(), **document}
    return ReportInput(known, again.plan, str(again.outcome.failure or again.outcome.refusal or ""))
