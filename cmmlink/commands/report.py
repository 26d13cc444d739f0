"""The command `report`: a recorded run, or a recorded stack of sections, on paper."""

from collections.abc import Callable, Mapping
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
    records: Records = None,
    as_json: Json = False,
) -> int:
    """Write the report of a recorded run as a PDF, or that of a stack; it is the same to the last byte each time."""
    from cmmlink.record import open_to_read
    from cmmlink.result_files import new_files

    if logo is not None and not logo.is_file():
        raise PlanError(f"{logo}: there is no such picture; --logo takes a PNG or JPEG file")
    given = {"language": language, "paper": paper, "company": company, "logo": logo, "section_pages": sections}
    look = {key: value for key, value in given.items() if value is not None}
    with open_to_read(records_folder(records), now) as store:
        found, write = _report_of(store, name, stack, look)
        file = out or Path(f"{found}.pdf")
        try:
            with new_files(file.parent) as files, progress(f"writing {file.name}"):
                write(files(file.name))
        except OSError as error:
            raise PlanError(f"{file}: the report cannot be written there ({error.strerror}); choose another file with --out") from None
    if as_json:
        print_json({"run": found, "file": str(file)})
    else:
        typer.echo(str(file))
    return 0


def _report_of(store: "Store", name: str, whole: bool, look: Mapping[str, Any]) -> tuple[str, Callable[[Path], None]]:
    """The id of the run or the stack that is meant, and what writes its report."""
    from cmmlink.record import find_run, find_stack

    if not whole:
        try:
            run = find_run(store, name)
        except RunError:
            whole = _names_a_stack(store, name)
            if not whole:
                raise
    if whole:
        stack, runs = find_stack(store, name)
        return stack, lambda file: _write_stack(store, runs, look, file)
    return run, lambda file: _write_run(store, run, look, file)


def _names_a_stack(store: "Store", name: str) -> bool:
    from cmmlink.record import find_stack

    try:
        find_stack(store, name)
    except RunError:
        return False
    return True


def _write_run(store: "Store", run: str, look: Mapping[str, Any], file: Path) -> None:
    from cmmlink.record import recorded_run
    from cmmlink.report import input_on_record, picture_on_record, surface_on_record, with_settings, write_report, write_surface_report

    if recorded_run(store, run).is_of_surface:
        report = with_settings(surface_on_record(store, run), look)
        write_surface_report(report, picture_on_record(store, run, report), file)
    else:
        write_report(with_settings(input_on_record(store, run), look), file)


def _write_stack(store: "Store", runs: list[str], look: Mapping[str, Any], file: Path) -> None:
    from cmmlink.report import stack_on_record, write_stack_report

    write_stack_report(stack_on_record(store, runs).with_settings(look), file)
