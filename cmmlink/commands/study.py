"""Commands on studies of the measuring system: begin one, add recorded runs to it, and say what it shows."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from cmmlink.commands.options import Json, Records, records_folder
from cmmlink.commands.output import now, print_json
from cmmlink.commands.progress import progress
from cmmlink.errors import PlanError
from cmmlink.words import printable

if TYPE_CHECKING:
    from cmmlink.plant import Reference, Study

KindOption = Literal["type-1", "crossed"]
StudyFile = Annotated[Path, typer.Argument(metavar="STUDY.json", help="The file of the study.")]

study = typer.Typer(help="Study the measuring system by repeated scans: Cg and Cgk, or gauge R&R, and U.", rich_markup_mode=None)


@study.command()
def new(
    file: StudyFile,
    kind: Annotated[
        KindOption, typer.Option(help="type-1: one part of known value, again and again; crossed: parts by operators (gauge R&R).")
    ],
    name: Annotated[str, typer.Option(metavar="TEXT", help="What is studied.", show_default="the name of the file")] = "",
    reference: Annotated[
        list[str] | None,
        typer.Option(metavar="NAME=VALUE[:U]", help="Value of a characteristic by a better measurement, with its U (k = 2)."),
    ] = None,
) -> int:
    """Begin a study: an empty file, to which `cmmlink study add` adds recorded runs."""
    from cmmlink.plant import Study, study_text

    if file.exists():
        raise PlanError(f"{file} exists already; expected the name of a new file")
    references = dict(_reference_in(told) for told in reference or ())
    if kind == "type-1" and not references:
        raise PlanError("a type-1 study needs the value of its part: --reference NAME=VALUE[:U], like --reference chord=60.0012:0.0004")
    if kind == "crossed" and references:
        raise PlanError("--reference is for a study of type-1; in a crossed study nobody needs to know the values of the parts")
    _write(file, study_text(Study(kind, name or file.stem, references)))
    typer.echo(printable(f"{file}: begun; `cmmlink study add {file} RUN ...` adds recorded runs"))
    return 0


def _reference_in(told: str) -> tuple[str, "Reference"]:
    """A reference value as an option has it. Raises PlanError."""
    from cmmlink.plant import Reference

    name, equals, numbers = told.partition("=")
    value, _, expanded = numbers.partition(":")
    try:
        found = Reference(float(value), float(expanded or 0))
    except ValueError:
        found = None
    if found is None or not equals or not name.strip() or not found.expanded >= 0 or abs(found.value) == float("inf"):
        raise PlanError(f"--reference {told}: expected NAME=VALUE or NAME=VALUE:U with numbers, like chord=60.0012:0.0004")
    return name.strip(), found


@study.command()
def add(
    file: StudyFile,
    runs: Annotated[list[str], typer.Argument(metavar="RUN ...", help="Recorded runs: ids, counters, serial numbers, last, last~1.")],
    part: Annotated[
        str | None, typer.Option(metavar="NAME", help="The part that was measured.", show_default="the serial number of the run")
    ] = None,
    operator: Annotated[str | None, typer.Option(metavar="NAME", help="Who measured it.", show_default="the operator of the run")] = None,
    records: Records = None,
) -> int:
    """Add recorded runs to a study. All of them are added, or none where one does not belong to it."""
    from cmmlink.devices import decoder_of
    from cmmlink.plant import study_text
    from cmmlink.record import find_run, open_to_read
    from cmmlink.studied_runs import with_run

    found = _read(file)
    with open_to_read(records_folder(records), now) as store, progress(f"reading {len(runs)} runs"):
        for named in runs:
            found = with_run(found, store, find_run(store, named), decoder_of, part, operator)
    _write(file, study_text(found))
    studied = ", ".join(one.name for one in found.characteristics)
    typer.echo(printable(f"{file}: {len(found.runs)} runs; studied {'is' if len(found.characteristics) == 1 else 'are'} {studied}"))
    return 0


@study.command()
def report(
    file: StudyFile,
    out: Annotated[Path | None, typer.Option("--out", metavar="FILE.pdf", help="Write it as a PDF.")] = None,
    as_json: Json = False,
) -> int:
    """Say what a study shows: the spread of the gauge by characteristic and along the profile, and U with its budget."""
    from cmmlink.plant import findings_of
    from cmmlink.report import study_document, study_lines

    found = _read(file)
    try:
        findings = findings_of(found)
    except ValueError as error:
        raise PlanError(f"{file}: {error}") from None
    if out is not None:
        if out.suffix.lower() != ".pdf":
            raise PlanError(f"--out {out}: expected a name that ends in .pdf")
        from cmmlink.report import write_study

        with progress(f"writing {out}"):
            write_study(found, findings, out)
    if as_json:
        print_json(study_document(found, findings))
        return 0
    for line in study_lines(found, findings):
        typer.echo(printable(line))
    return 0


def _read(file: Path) -> "Study":
    """The study of a file. Raises PlanError where it cannot be used."""
    from cmmlink.plant import read_study

    try:
        return read_study(file)
    except OSError as error:
        raise PlanError(f"{file}: {error.strerror}; `cmmlink study new {file}` begins a study") from None
    except ValueError as error:
        raise PlanError(str(error)) from None


def _write(file: Path, text: str) -> None:
    """Write a file whole or not at all. Raises PlanError where that cannot be."""
    beside = file.with_name(f".{file.name}.new")
    try:
        beside.write_text(text, encoding="utf-8")
        beside.replace(file)
    except OSError as error:
        beside.unlink(missing_ok=True)
        raise PlanError(f"{file}: cannot be written: {error.strerror}") from None
