"""The folder of results that `--out` asks for, of a run of a whole surface."""

import json
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from cmmlink.colour_map import colours_of, kinds_of
from cmmlink.from_surface_plan import held_against
from cmmlink.report.folder import or_refuse
from cmmlink.report.report_input import ReportInput, input_of_surface
from cmmlink.report.speech import Speech
from cmmlink.report.surface_pdf import write_surface_report
from cmmlink.report.surface_picture import write_surface_picture
from cmmlink.report.surface_report import content_of_surface
from cmmlink.result_files import NewFiles, new_files
from cmmlink.result_folder import make_room
from cmmlink.surface_csv import write_surface_deviations
from cmmlink.surface_rows import SurfaceRows, surface_blocks
from inspection import ToleranceZone

if TYPE_CHECKING:
    from cmmlink.surface_run import FinishedSurface
    from inspection.surface import NominalSurface, SurfaceResult

_ROWS = 1 << 16  # written together
_PLY_POINT = np.dtype([("place", "<f8", (3,)), ("deviation", "<f4"), ("colour", "u1", (3,))])


def write_surface_run(folder: Path, run: "FinishedSurface") -> list[str]:
    """Write the files of a finished run, as `FinishedSurface.folder_of` names its folder. Returns their names; raises PlanError."""
    report = input_of_surface(run)
    return write_surface(folder, report, run.outcome.result, held_against(run.plan, run.file))


def write_surface(folder: Path, report: ReportInput, result: "SurfaceResult | None", nominal: "NominalSurface") -> list[str]:
    """Write result.json and report.pdf and, when points were judged, deviations.csv, deviations.ply and surface.png.

    Returns their names; raises PlanError.

    What an earlier run left there is moved aside, into a folder of its own; the new files take its place together.
    """
    with or_refuse(folder), new_files(folder, make_room) as files:
        document, content = report.document, None
        files("result.json").write_text(json.dumps(document, indent=2) + "\n", encoding="utf-8")
        if result is not None and result.judged:
            write_surface_points(lambda: surface_blocks(result, _ROWS), result.received, result.zone, document["ending"], files)
            content = content_of_surface(report, nominal, surface_blocks(result, _ROWS))
            write_surface_picture(content, files("surface.png"), say=Speech(report.settings.language))
        write_surface_report(report, content, files("report.pdf"))
    return files.names


def write_surface_points(
    blocks: Callable[[], Iterable[SurfaceRows]], received: int, zone: ToleranceZone, ending: str, files: NewFiles
) -> None:
    """Write deviations.csv and deviations.ply of rows that come piece by piece, as often as they are asked for."""
    write_surface_deviations(blocks(), files("deviations.csv"), ending)
    write_ply(blocks(), received, zone, files("deviations.ply"))


def write_ply(blocks: Iterable[SurfaceRows], received: int, zone: ToleranceZone, path: Path) -> None:
    """Write every received point in nominal coordinates with its deviation (NaN where it was rejected) and the colour of the pictures."""
    places = [f"property double {axis}" for axis in "xyz"]
    colours = [f"property uchar {colour}" for colour in ("red", "green", "blue")]
    head = ["ply", "format binary_little_endian 1.0", "comment deviations by cmmlink, in mm", f"element vertex {received}"]
    with path.open("wb") as file:
        file.write("\n".join([*head, *places, "property float deviation", *colours, "end_header", ""]).encode("ascii"))
        for rows in blocks:
            points = np.empty(rows.received, dtype=_PLY_POINT)
            points["place"], points["deviation"] = rows.actual_mm, rows.deviation_mm
            points["colour"] = colours_of(kinds_of(rows.verdicts, rows.deviation_mm, zone.middle_mm), rows.deviation_mm, zone)
            file.write(points.tobytes())
