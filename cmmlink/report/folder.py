"""The folder of results that `--out` asks for."""

import json
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from cmmlink.characteristics import is_short_form
from cmmlink.characteristics_csv import write_characteristics
from cmmlink.deviations_csv import write_deviations
from cmmlink.errors import PlanError
from cmmlink.report.picture_content import content_of
from cmmlink.report.picture_processes import Pictures
from cmmlink.result_files import new_files
from cmmlink.result_folder import fixed_part, make_room
from cmmlink.run import FinishedRun
from cmmlink.uncertainty_tables import write_uncertainty
from cmmlink.zone_file import zone_document
from inspection import InspectionResult, NominalProfile


def prepare(pattern: Path | None) -> None:
    """Check that the folder can be written, before anything is measured. Raises PlanError.

    A folder without placeholders is created here; one that is named by the run is created once there is something to write.
    """
    if pattern is None:
        return
    folder = fixed_part(pattern)
    with _or_refuse(folder):
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
) -> list[str]:
    """Write result.json and, when points were judged, deviations.csv and profile.png. Returns their names; raises PlanError.

    Of a plan with characteristics there is characteristics.csv as well, and zone.json where one of them is a minimum zone.
    Where a budget was stated, uncertainty.csv is written as well.

    pictures : draws the picture, in another process where one was started

    What an earlier run left there is moved aside, into a folder of its own; the new files take its place together.
    """
    with _or_refuse(folder), new_files(folder, make_room) as files:
        files("result.json").write_text(json.dumps(document, indent=2) + "\n", encoding="utf-8")
        if result is not None and result.judged:
            ending, pictures = document.get("ending", "complete"), pictures or Pictures()
            content = content_of(result, profile, title, ending, _said_at_foot(document))
            drawing = pictures.begin(content)
            write_deviations(result.blocks(), files("deviations.csv"), ending)
            if not is_short_form(result.characteristics):
                write_characteristics(result.characteristics, files("characteristics.csv"))
            if (zones := zone_document(document, profile)) is not None:
                files("zone.json").write_text(json.dumps(zones, indent=2) + "\n", encoding="utf-8")
            if result.uncertainty is not None:
                write_uncertainty(result.uncertainty, files("uncertainty.csv"))
            pictures.write(drawing, lambda: content, files("profile.png"))
    return files.names


def _said_at_foot(document: dict[str, Any]) -> str:
    """Which run a picture is of, and when it was measured, as far as the result says so."""
    run, measured_at = document.get("run") or document.get("replay_of"), document.get("measured_at")
    return "   ".join(filter(None, [run and f"run {run}", measured_at and f"measured {measured_at}"]))


def write_run(folder: Path, run: FinishedRun, pictures: Pictures | None = None) -> list[str]:
    """Write the files of a finished run, as `FinishedRun.folder_of` names its folder. Returns their names; raises PlanError."""
    return write_results(folder, run.result_json(), run.outcome.result, run.profile, run.title, pictures)


@contextmanager
def _or_refuse(folder: Path) -> Iterator[None]:
    """Turn an error of the file system into one that says what to do."""
    try:
        yield
    except OSError as error:
        mend = "choose another folder with --out, or none with out: null in the plan"
        raise PlanError(f"{folder}: the results cannot be written ({error.strerror}); {mend}") from None
