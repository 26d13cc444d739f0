"""The command `report`: a recorded run on paper."""

from pathlib import Path
from typing import Annotated

import typer

from cmmlink.commands.options import Json, Records, RunName, records_folder
from cmmlink.commands.output import now, print_json
from cmmlink.errors import PlanError
from cmmlink.plan import LanguageName, PaperName

AS_IN_PLAN = "as its plan says"


def report(
    name: RunName,
    out: Annotated[Path | None, typer.Option("--out", "-o", metavar="FILE", help="The file to be written.", show_default="RUN.pdf")] = None,
    language: Annotated[LanguageName | None, typer.Option(help="Its language.", show_default=AS_IN_PLAN)] = None,
    paper: Annotated[PaperName | None, typer.Option(help="The size of its pages.", show_default=AS_IN_PLAN)] = None,
    company: Annotated[str | None, typer.Option(metavar="NAME", help="Name at the head of its pages.", show_default=AS_IN_PLAN)] = None,
    logo: Annotated[Path | None, typer.Option(metavar="FILE", help="Picture in place of the name.", show_default=AS_IN_PLAN)] = None,
    records: Records = None,
    as_json: Json = False,
) -> int:
    """Write the report of a recorded run as a PDF; it is the same to the last byte each time."""
    from cmmlink.record import find_run, open_to_read
    from cmmlink.report import input_on_record, with_settings, write_report
    from cmmlink.result_files import new_files

    if logo is not None and not logo.is_file():
        raise PlanError(f"{logo}: there is no such picture; --logo takes a PNG or JPEG file")
    given = {"language": language, "paper": paper, "company": company, "logo": logo}
    with open_to_read(records_folder(records), now) as store:
        run = find_run(store, name)
        file = out or Path(f"{run}.pdf")
        wanted = with_settings(input_on_record(store, run), {key: value for key, value in given.items() if value is not None})
        try:
            with new_files(file.parent) as files:
                write_report(wanted, files(file.name))
        except OSError as error:
            raise PlanError(f"{file}: the report cannot be written there ({error.strerror}); choose another file with --out") from None
    if as_json:
        print_json({"run": run, "file": str(file)})
    else:
        typer.echo(str(file))
    return 0
