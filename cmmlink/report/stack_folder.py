"""The folder of results of a stack: one object, one table, one map, and a folder for each section."""

import csv
import json
from collections.abc import Callable, Iterable
from pathlib import Path

import numpy as np

from cmmlink.characteristics_csv import write_characteristics
from cmmlink.characteristics_json import number
from cmmlink.csv_rows import Texts, write_rows
from cmmlink.deviations_csv import write_deviations
from cmmlink.errors import PlanError
from cmmlink.exports import part_of_stack, write_exports
from cmmlink.plan import CtPlan
from cmmlink.report.section_pictures import SectionPictures
from cmmlink.result_files import new_files
from cmmlink.result_folder import make_room
from cmmlink.result_keys import SectionInspected
from cmmlink.stack import SectionOutcome, StackOutcome
from cmmlink.uncertainty_tables import write_uncertainty
from drivers.surface import Contour
from inspection import ToleranceZone

CONTOUR_COLUMNS = {
    "contour": "the number of the contour in its section, from 1",
    "closed": "closed or open; a closed contour does not repeat its first point",
    "hole": "hole or outer",
    "x_mm": "x in the coordinates of the surface",
    "y_mm": "y in the coordinates of the surface",
    "z_mm": "z in the coordinates of the surface",
    "section_x_mm": "x in the plane of the section",
    "section_y_mm": "y in the plane of the section",
}
_SECTION_KEYS = (
    "height_mm", "asked_height_mm", "verdict", "ending", "received", "judged", "rejected", "out_of_tolerance", "max_deviation_mm",
    "min_deviation_mm", "rms_mm", "profile_error_mm", "coverage", "contours", "holes", "open_contours", "set_aside", "cutter",
)  # fmt: skip
SECTION_COLUMNS = {
    **{key: SectionInspected.model_fields[key].description or "" for key in _SECTION_KEYS},
    "worst_station_mm": "the station of the point farthest from the middle of the zone",
    "worst_deviation_mm": "the deviation of that point",
    "warnings": "what was not as it should be in this section, separated by semicolons",
}


STACK_COLUMNS = {
    "name": "the name of the characteristic of the stack",
    "height_mm": "the height of the section",
    "value": "its value; empty: it has none",
    "nominal": "the value that the deviation is counted from",
    "unit": "the unit of all numbers of the line but the height",
    "deviation": "value - nominal",
    "lower": "the lower limit of the deviation; empty: no limit",
    "upper": "the upper limit, likewise",
    "verdict": "the verdict on this value",
}


def write_stack(
    folder: Path,
    stack: StackOutcome,
    zone: ToleranceZone,
    title: str,
    *,
    plan: CtPlan | None = None,
    pictures: SectionPictures | None = None,
    on_section: Callable[[], None] = lambda: None,
) -> None:
    """Write result.json, sections.csv, stack.png, stack.svg and for each section its deviations, contours and picture.

    Of a stack with characteristics there are characteristics.csv and, with the value of each section, stack.csv as well.

    plan     : says how report.pdf looks, which is written beside pictures, and in which further formats; None writes none of these
    pictures : draws those of the sections that it wants; None where no picture is wanted, and no report
    """
    try:
        with new_files(folder, make_room) as files:
            files("result.json").write_text(json.dumps(stack.result_json(), indent=2) + "\n", encoding="utf-8")
            _write_sections(stack, files("sections.csv"))
            if stack.characteristics:
                write_characteristics([one.found for one in stack.characteristics], files("characteristics.csv"))
                _write_shares(stack, files("stack.csv"))
            for number, section in enumerate(stack.sections, start=1):
                own = section_folder(number, section)
                write_contours(section.slice.contours, files(f"{own}/contours.csv"))
                result = section.run.result
                if result is not None and result.judged:
                    write_deviations(result.blocks(), files(f"{own}/deviations.csv"), section.run.ending)
                    if result.uncertainty is not None:
                        write_uncertainty(result.uncertainty, files(f"{own}/uncertainty.csv"))
                    if pictures is not None and pictures.wants(section):
                        pictures.write(number, section, files(f"{own}/profile.png"), files(f"{own}/profile.svg"))
                on_section()
            if pictures is not None:
                from cmmlink.report.stack_picture import write_stack_picture  # noqa: PLC0415 - it loads matplotlib, half a second

                write_stack_picture(stack, zone, title, *files.together("stack.png", "stack.svg"))
                if plan is not None:
                    from cmmlink.report.stack_input import input_of_stack  # noqa: PLC0415 - only reports need it
                    from cmmlink.report.stack_pdf import write_stack_report  # noqa: PLC0415 - it loads reportlab

                    write_stack_report(input_of_stack(stack, plan), files("report.pdf"))
            if plan is not None and plan.out.formats:
                write_exports([part_of_stack(stack, plan)], [name for name in plan.out.formats if name != "json"], files, "result")
    except OSError as error:
        raise PlanError(f"{folder}: the results cannot be written ({error.strerror}); choose another folder with --out") from None


def section_folder(number: int, section: SectionOutcome) -> str:
    """Name of a section's folder, like section-002_50.000mm."""
    return f"section-{number:03d}_{section.slice.asked_mm:.3f}mm"


def write_contours(contours: Iterable[Contour], path: Path) -> None:
    """Write every contour point, in machine and in section coordinates; closed contours do not repeat their first point."""
    with path.open("wb") as file:
        file.write((",".join(CONTOUR_COLUMNS) + "\r\n").encode())
        for number, contour in enumerate(contours, start=1):
            head = f"{number},{'closed' if contour.closed else 'open'},{'hole' if contour.hole else 'outer'}"
            heads = Texts(np.zeros(len(contour.points_mm), dtype=np.int64), [head])
            write_rows(file, [heads, np.column_stack([contour.points_mm, contour.section_mm])])


def _write_shares(stack: StackOutcome, path: Path) -> None:
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(STACK_COLUMNS)
        for one in stack.characteristics:
            for share in one.sections:
                limits = [number(one.found.lower), number(one.found.upper)]
                values = [number(share.value), one.found.nominal, one.found.unit, number(share.deviation), *limits]
                writer.writerow(
                    [one.found.name, share.height_mm, *("" if value is None else value for value in values), share.verdict.word]
                )


def _write_sections(stack: StackOutcome, path: Path) -> None:
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(SECTION_COLUMNS)
        for section in stack.sections:
            result = section.result_json()
            worst = result["worst"] or {}
            values = ["" if result[key] is None else result[key] for key in _SECTION_KEYS]
            writer.writerow((*values, worst.get("station_mm", ""), worst.get("deviation_mm", ""), "; ".join(section.warnings)))
