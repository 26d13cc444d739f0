"""What the report of a recorded run of a whole surface is made of: its document, its points, its plan and its nominal, as recorded."""

from cmmlink.exports import sound_run, surface_document
from cmmlink.from_surface_plan import held_against
from cmmlink.record import Store, end_missing, recorded_surface, recorded_surface_plan, unpack_surface
from cmmlink.report.report_input import ReportInput
from cmmlink.report.surface_content import SurfaceContent
from cmmlink.report.surface_report import content_of_surface


def surface_on_record(store: Store, run: str) -> ReportInput:
    """What the report of a run on record is made of, without its picture. Raises StoreError where it was altered or cannot be read."""
    recorded = sound_run(store, run)
    end = recorded.end or end_missing(store, run)
    return ReportInput(surface_document(store, recorded), recorded_surface_plan(recorded), end["message"] or "")


def picture_on_record(store: Store, run: str, report: ReportInput) -> SurfaceContent | None:
    """What the picture of that run shows; None where no point was judged."""
    recorded = sound_run(store, run)
    if recorded.result is None or not report.document["judged"]:
        return None
    plan = recorded_surface_plan(recorded)
    nominal = held_against(plan, recorded_surface(plan, recorded))
    return content_of_surface(report, nominal, (unpack_surface(record.body) for record in store.records(run, "deviations")))
