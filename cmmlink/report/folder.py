"""The folder of results that `--out` asks for."""

import json
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cmmlink.characteristics import is_short_form
from cmmlink.characteristics_csv import write_characteristics
from cmmlink.deviations_csv import write_deviations
from cmmlink.errors import PlanError
from cmmlink.report.judged_scan import scan_of
from cmmlink.report.picture_content import content_of
from cmmlink.report.picture_processes import Pictures, Sheet
from cmmlink.report.report_input import ReportInput, input_of, places_in, regions_in
from cmmlink.result_files import NewFiles, new_files
from cmmlink.result_folder import fixed_part, make_room
from cmmlink.run import FinishedRun
from cmmlink.uncertainty_tables import write_uncertainty
from cmmlink.zone_file import zone_document
from inspection import InspectionResult, NominalProfile

if TYPE_CHECKING:
    from cmmlink.exports import MeasuredPart


def prepare(pattern: Path | None) -> None:
    """Check that the folder can be written, before anything is measured. Raises PlanError.

    A folder without placeholders is created here; one that is named by the run is created once there is something to write.
    """
    if pattern is None:
        return
    folder = fixed_part(pattern)
    with or_refuse(folder):
        if folder == pattern:
            folder.mkdir(parents=True, exist_ok=True)
        there = next(above for above in (folder, *folder.parents) if above.exists())
        with tempfile.TemporaryFile(dir=there):
            pass


def write_results(
    folder: Path,
    document: dict[str, Any],
    result: InspectionResult | None,
    profile: NominalProfile,
    title: str,
    pictures: Pictures | None = None,
    report: ReportInput | None = None,
    part: "MeasuredPart | None" = None,
) -> list[str]:
    """Write result.json and, when points were judged, deviations.csv and the picture. Returns their names; raises PlanError.

    report : what report.pdf is made of, without what its drawings show; it is written whether points were judged or not. None writes none

    Of a plan with characteristics there is characteristics.csv as well, and zone.json where one of them is a minimum zone.
    Where a budget was stated, uncertainty.csv is written as well.

    pictures : draws the picture, in another process where one was started

    part : what the further formats are written from that its plan names, as result.FORMAT; None writes none

    What an earlier run left there is moved aside, into a folder of its own; the new files take its place together.
    """
    pictures, drawn = pictures or Pictures(), result is not None and result.judged > 0
    with or_refuse(folder), new_files(folder, make_room) as files:
        files("result.json").write_text(json.dumps(document, indent=2) + "\n", encoding="utf-8")
        content = None
        if result is not None and drawn:
            ending, regions = document.get("ending", "complete"), regions_in(document)
            content = content_of(scan_of(result), profile, title, ending, _said_at_foot(document), regions, places_in(document))
        asked: list[tuple[Sheet, tuple[str, ...]]] = [] if content is None else [(content, ("profile.png", "profile.svg"))]
        if report is not None:
            asked.append((replace(report, content=content), ("report.pdf",)))
        begun = [(names, sheet, pictures.begin(sheet, *(Path(name).suffix for name in names))) for sheet, names in asked]
        if result is not None and drawn:
            _write_tables(result, document, profile, files)
        for names, sheet, drawing in begun:
            pictures.write(drawing, partial(_give, sheet), *(files(name) for name in names))
        if part is not None:
            from cmmlink.exports import write_exports  # noqa: PLC0415 - most runs have no further formats

            write_exports([part], [name for name in part.plan.out.formats if name != "json"], files, "result")
    return files.names


def _give(sheet: Sheet) -> Sheet:
    return sheet


def _write_tables(result: InspectionResult, document: dict[str, Any], profile: NominalProfile, files: NewFiles) -> None:
    """Write the points and whatever else was found of a result."""
    write_deviations(result.blocks(), files("deviations.csv"), document.get("ending", "complete"))
    if not is_short_form(result.characteristics):
        write_characteristics(result.characteristics, files("characteristics.csv"))
    if (zones := zone_document(document, profile)) is not None:
        files("zone.json").write_text(json.dumps(zones, indent=2) + "\n", encoding="utf-8")
    if result.uncertainty is not None:
        write_uncertainty(result.uncertainty, files("uncertainty.csv"))


def _said_at_foot(document: dict[str, Any]) -> str:
    """Which run a picture is of, and when it was measured, as far as the result says so."""
    run, measured_at = document.get("run") or document.get("replay_of"), document.get("measured_at")
    return "   ".join(filter(None, [run and f"run {run}", measured_at and f"measured {measured_at}"]))


def write_run(folder: Path, run: FinishedRun, pictures: Pictures | None = None) -> list[str]:
    """Write the files of a finished run, as `FinishedRun.folder_of` names its folder. Returns their names; raises PlanError."""
    report = input_of(run)
    part = None
    if run.plan.out.formats:
        from cmmlink.exports import part_of_run  # noqa: PLC0415 - most runs have no further formats

        part = part_of_run(run)
    return write_results(folder, dict(report.document), run.outcome.result, run.profile, run.title, pictures, report, part)


@contextmanager
def or_refuse(folder: Path) -> Iterator[None]:
    """Turn an error of the file system into one that says what to do."""
    try:
        yield
    except OSError as error:
        mend = "choose another folder with --out, or none with out: null in the plan"
        raise PlanError(f"{folder}: the results cannot be written ({error.strerror}); {mend}") from None
