"""The command `report`: a recorded run, or a recorded stack of sections, on paper."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from cmmlink.commands.options import Json, Records, RunName, records_folder
from cmmlink.commands.output import now, print_json
from cmmlink.commands.progress import progress
from cmmlink.errors import PlanError, RunError
from cmmlink.plan import LanguageName, PaperName, SectionPages

if TYPE_CHECKING:
    from cmmlink.record import Store
    from cmmlink.run_trends import RunTrend

AS_IN_PLAN = "as its plan says"


def report(
    name: RunName,
    out: Annotated[Path | None, typer.Option("--out", "-o", metavar="FILE", help="The file to be written.", show_default="RUN.pdf")] = None,
    language: Annotated[LanguageName | None, typer.Option(help="Its language.", show_default=AS_IN_PLAN)] = None,
    paper: Annotated[PaperName | None, typer.Option(help="The size of its pages.", show_default=AS_IN_PLAN)] = None,
    company: Annotated[str | None, typer.Option(metavar="NAME", help="Name at the head of its pages.", show_default=AS_IN_PLAN)] = None,
    logo: Annotated[Path | None, typer.Option(metavar="FILE", help="Picture in place of the name.", show_default=AS_IN_PLAN)] = None,
    stack: Annotated[
        bool, typer.Option("--stack", help="Of a section of a surface: the report of its whole stack, as the stack's own id gives it.")
    ] = False,
    sections: Annotated[
        SectionPages | None, typer.Option(help="Of a stack: which sections have a page of their own.", show_default=AS_IN_PLAN)
    ] = None,
    trend: Annotated[
        int | None,
        typer.Option(
            min=2,
            max=10_000,
            metavar="N",
            help="Add the trend over the N runs up to this one, out of the results database: a page for each characteristic that does not "
            "conform or breaks a rule with this run, or else for the first.",
            show_default=False,
        ),
    ] = None,
    characteristic: Annotated[
        list[str] | None, typer.Option(metavar="NAME", help="With --trend: this one, in place of those; as often as wanted.")
    ] = None,
    records: Records = None,
    as_json: Json = False,
) -> int:
    """Write the report of a recorded run as a PDF, or that of a stack; it is the same to the last byte each time."""
    from cmmlink.record import open_to_read
    from cmmlink.result_files import new_files

    if logo is not None and not logo.is_file():
        raise PlanError(f"{logo}: there is no such picture; --logo takes a PNG or JPEG file")
    if characteristic and trend is None:
        raise PlanError("--characteristic chooses a trend; expected --trend N beside it")
    given = {"language": language, "paper": paper, "company": company, "logo": logo, "section_pages": sections}
    look = {key: value for key, value in given.items() if value is not None}
    folder = records_folder(records)
    with open_to_read(folder, now) as store:
        found, is_stack = _named(store, name, stack)
        if is_stack and trend is not None:
            raise PlanError(f"{found}: --trend is for a run; of the characteristics of a stack `cmmlink plant trends` shows it")
        trends = () if trend is None else _trends_of(store, folder, found, trend, characteristic or ())
        file = out or Path(f"{found}.pdf")
        try:
            with new_files(file.parent) as files, progress(f"writing {file.name}"):
                if is_stack:
                    _write_stack(store, found, look, files(file.name))
                else:
                    _write_run(store, found, look, trends, files(file.name))
        except OSError as error:
            raise PlanError(f"{file}: the report cannot be written there ({error.strerror}); choose another file with --out") from None
    if as_json:
        print_json({"run": found, "file": str(file), "trends": [one.found.series.name for one in trends]})
    else:
        typer.echo(str(file))
    return 0


def _named(store: "Store", name: str, whole: bool) -> tuple[str, bool]:
    """The id of the run or the stack that is meant, and whether it is a stack."""
    from cmmlink.record import find_run, find_stack

    if not whole:
        try:
            return find_run(store, name), False
        except RunError:
            try:
                return find_stack(store, name)[0], True
            except RunError:
                pass
            raise
    return find_stack(store, name)[0], True


def _trends_of(store: "Store", folder: Path, run: str, last: int, asked: Sequence[str]) -> "tuple[RunTrend, ...]":
    """The trends that a run ends, out of the results database of its station. Raises PlanError, PlantError."""
    from cmmlink.plant import ResultsDatabase
    from cmmlink.plant_push import address_for, characteristics_of, part_of
    from cmmlink.record import recorded_run
    from cmmlink.run_trends import trends_of_run

    recorded = recorded_run(store, run)
    began = datetime.fromisoformat(recorded.header["started"])
    with ResultsDatabase(address_for(folder), is_made=False) as results, progress("looking at the trend"):
        return trends_of_run(results, run, part_of(recorded), began, characteristics_of(recorded), last=last, asked=asked)


def _write_run(store: "Store", run: str, look: Mapping[str, Any], trends: "tuple[RunTrend, ...]", file: Path) -> None:
    from cmmlink.record import recorded_run
    from cmmlink.report import input_on_record, picture_on_record, surface_on_record, with_settings, write_report, write_surface_report

    if recorded_run(store, run).is_of_surface:
        report = replace(with_settings(surface_on_record(store, run), look), trends=trends)
        write_surface_report(report, picture_on_record(store, run, report), file)
    else:
        write_report(replace(with_settings(input_on_record(store, run), look), trends=trends), file)


def _write_stack(store: "Store", stack: str, look: Mapping[str, Any], file: Path) -> None:
    from cmmlink.record import find_stack
    from cmmlink.report import stack_on_record, write_stack_report

    write_stack_report(stack_on_record(store, find_stack(store, stack)[1]).with_settings(look), file)
