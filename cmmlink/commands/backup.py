"""Commands that keep the records safe: a backup in one file, what it holds brought back, and the runs of another station added."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from cmmlink.commands.options import Json, Records, records_folder
from cmmlink.commands.output import now, print_json
from cmmlink.commands.progress import progress
from cmmlink.words import printable

if TYPE_CHECKING:
    from cmmlink.record import Copied

_MOST_NAMES = 5


def backup(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="The file to write, like records-2026-03.sqlite.")],
    replace: Annotated[bool, typer.Option("--replace", help="Write over a backup of this name, once the new one was checked.")] = False,
    records: Records = None,
    as_json: Json = False,
) -> int:
    """Copy all records to one file, and check every hash of the copy. It may run while the station measures.

    What was acknowledged when the command began is in the backup; a run that goes on meanwhile is in it without its end.
    """
    from cmmlink.record import back_up

    folder = records_folder(records)
    with progress("copying the records") as tell:
        made = back_up(folder, file, now, replace=replace, tell=tell)
    return _tell(made, f"backup of {folder} in {file}", as_json)


def restore(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="A backup, or a folder of records.")],
    replace: Annotated[
        bool, typer.Option("--replace", help="Move the records that are there aside first, as when they are damaged.")
    ] = False,
    records: Records = None,
    as_json: Json = False,
) -> int:
    """Bring back what a backup holds: into a folder without records all of it, else what it has beyond those that are there.

    The backup is checked to the last hash first. Records that are there are never overwritten; where they went on otherwise than the
    backup, nothing is changed and that is said. The console may stay open; only a run that is being recorded has to end first.
    """
    from cmmlink.record import restore as bring_back

    with progress("restoring the records") as tell:
        made = bring_back(file, records_folder(records), now, replace=replace, tell=tell)
    return _tell(made, f"records in {made.path.parent}", as_json)


def merge(
    file: Annotated[
        Path, typer.Argument(metavar="FILE", help="The records of another station: a backup or their folder; or an exported run's folder.")
    ],
    records: Records = None,
    as_json: Json = False,
) -> int:
    """Add the runs of another station's records to these, each with its id and with its place in the chain it comes from.

    A run that is there already is not added twice. `cmmlink verify RUN --against result.json` takes the result that was written at
    the other station. A run without its end is left out.
    """
    from cmmlink.record import merge as add_runs

    with progress("merging the records") as tell:
        made = add_runs(file, records_folder(records), now, tell)
    return _tell(made, f"records in {made.path.parent}", as_json)


def _tell(made: "Copied", what: str, as_json: bool) -> int:
    from drivers import count_of

    if as_json:
        print_json(_document(made))
        return 0
    typer.echo(printable(f"{what}: {count_of(made.runs, 'run')}, {count_of(made.records, 'record')}, chain {made.chain_sha256}"))
    for names, told in ((made.added, "added"), (made.unfinished, "without an end")):
        if names:
            more = f" and {len(names) - _MOST_NAMES} more" if len(names) > _MOST_NAMES else ""
            typer.echo(f"{told}: {', '.join(names[:_MOST_NAMES])}{more}")
    if made.aside is not None:
        typer.echo(printable(f"the records that were there are kept in {made.aside}"))
    return 0


def _document(made: "Copied") -> dict[str, Any]:
    return {
        "file": str(made.path),
        "runs": made.runs,
        "records": made.records,
        "chain_sha256": made.chain_sha256,
        "added": list(made.added),
        "unfinished": list(made.unfinished),
        "aside": None if made.aside is None else str(made.aside),
    }
