"""The command `export`: recorded runs as files, all that is on record of one or the results of many in the formats of other programs."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, get_args

import typer

from cmmlink.commands.options import Json, Records, records_folder
from cmmlink.commands.output import now, print_json
from cmmlink.commands.progress import progress
from cmmlink.errors import PlanError
from cmmlink.plan import FormatName

if TYPE_CHECKING:
    from cmmlink.record import Store

MANY = "runs"


def export(
    names: Annotated[list[str], typer.Argument(metavar="RUN...", help="The ids of runs, the beginnings of them, or last.")],
    formats: Annotated[
        list[str] | None,
        typer.Option(
            "--format",
            metavar="qif|dfq|xlsx|csv|json",
            help="Write the result for another program: QIF 3.0, Q-DAS, Excel, tables, JSON; as often as wanted. "
            "Without it all that is on record of one run is written.",
        ),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(
            "--out",
            metavar="DIR|FILE",
            help="Folder for the files; with one --format the file itself, which ends in .FORMAT. To a .dfq that is there runs are added.",
            show_default="with --format here, as RUN.FORMAT",
        ),
    ] = None,
    records: Records = None,
    as_json: Json = False,
) -> int:
    """Write recorded runs for other programs, or all that is on record of one as csv, npy, json and raw bytes.

    Who checks such a folder needs the hash of the run's end from elsewhere: the printed report, an anchor, or `cmmlink show RUN`.
    """
    from cmmlink.record import export_run, find_run, open_to_read

    wanted = _formats_in(formats or ())
    if not wanted and (len(names) > 1 or out is None):
        missing = "one run at a time" if len(names) > 1 else "--out DIR, the folder for the files"
        raise PlanError(f"all that is on record is exported with {missing}; --format qif, dfq, xlsx, csv or json writes the result alone")
    with open_to_read(records_folder(records), now) as store:
        runs = list(dict.fromkeys(find_run(store, name) for name in names))
        with progress(f"exporting {runs[0] if len(runs) == 1 else f'{len(runs)} runs'}"):
            if not wanted:
                assert out is not None
                written = export_run(store, runs[0], out)
            else:
                written = _write_formats(store, runs, wanted, out)
    if as_json:
        print_json({"run": runs[0], "runs": runs, "files": [str(path) for path in written]})
    else:
        typer.echo("\n".join(str(path) for path in written))
    return 0


def _formats_in(texts: Sequence[str]) -> list[FormatName]:
    """The formats of an option that was given as often as wanted, or with commas. Raises PlanError."""
    known: dict[str, FormatName] = {name: name for name in get_args(FormatName)}
    names = [name.strip().lower() for text in texts for name in text.split(",")]
    unknown = next((name for name in names if name not in known), None)
    if unknown is not None:
        raise PlanError(f"--format {unknown}: expected one of {', '.join(known)}")
    return [known[name] for name in names]


def _write_formats(store: "Store", runs: Sequence[str], formats: Sequence[FormatName], out: Path | None) -> list[Path]:
    """Write the results of runs. Returns the files; raises PlanError where they cannot be written."""
    from cmmlink.exports import part_on_record, write_exports, write_surfaces
    from cmmlink.record import recorded_run
    from cmmlink.result_files import new_files

    folder, stem = out or Path(), runs[0] if len(runs) == 1 else MANY
    if out is not None and len(formats) == 1 and out.suffix.lower() == f".{formats[0]}" and not out.is_dir():
        folder, stem = out.parent, out.stem
    surfaces = [run for run in runs if recorded_run(store, run).is_of_surface]
    if surfaces and len(surfaces) < len(runs):
        raise PlanError(f"{surfaces[0]} is a run of a whole surface and others are of sections; export them one after the other")
    parts = [] if surfaces else [part_on_record(store, run) for run in runs]
    try:
        with new_files(folder, alone=True) as files:
            if surfaces:
                write_surfaces(store, surfaces, formats, files, stem)
            else:
                write_exports(parts, formats, files, stem)
    except OSError as error:
        raise PlanError(f"{folder}: the results cannot be written there ({error.strerror}); choose another folder with --out") from None
    return [folder / name for name in files.names]
