"""Commands on the key that a station signs its runs with: show it, give the station a new one, make one for somebody else to keep."""

from pathlib import Path
from typing import Annotated

import typer

from cmmlink.commands.options import Json, Records, records_folder, who_asks
from cmmlink.commands.output import now, print_json
from cmmlink.errors import PlanError
from cmmlink.words import printable

key = typer.Typer(help="Show the key that signs the runs, change it, or make one for somebody else to keep.", rich_markup_mode=None)


@key.command()
def show(records: Records = None, as_json: Json = False) -> int:
    """Show the public key of this station: give it to whoever will verify its runs.

    Whoever has it beforehand needs to trust nobody who may write the records.
    """
    from cmmlink.record import PUBLIC_FILE, handover_words, handovers_of, has_records, key_id_of, open_to_read, public_key_given

    folder = records_folder(records)
    file = folder / PUBLIC_FILE
    if not file.exists():
        raise PlanError(f"{file}: there is no key yet; the first run that is recorded makes one")
    public_key = public_key_given(str(file))
    handovers = []
    if has_records(folder):
        with open_to_read(folder, now, close_interrupted=False) as store:
            handovers = [handover for _, handover in handovers_of(store)]
    if as_json:
        told = [one.model_dump() for one in handovers]
        print_json({"key_id": key_id_of(public_key), "public_key": public_key, "file": str(file), "handovers": told})
        return 0
    typer.echo(f"key {key_id_of(public_key)}\npublic key {public_key}")
    typer.echo(printable(f"as a file: {file}"))
    for one in handovers:
        typer.echo(printable(handover_words(one)))
    return 0


@key.command()
def rotate(
    reason: Annotated[str, typer.Option("--reason", metavar="TEXT", help="Why: it is kept in the records with who and when.")],
    operator: Annotated[
        str | None, typer.Option("--operator", metavar="O", help="Who changes it.", show_default="the user of this computer")
    ] = None,
    records: Records = None,
    as_json: Json = False,
) -> int:
    """Give the station a new key, which the old one hands over to in the records; runs of before verify as they did.

    The old private key is gone afterwards. A run that is being recorded has to end first.
    """
    from cmmlink.record import handover_words, open_to_record, rotate_key

    if not reason.strip():
        raise PlanError("--reason is empty; expected why the key is changed")
    with open_to_record(records_folder(records), now) as store:
        done = rotate_key(store, who=who_asks(operator), why=reason.strip(), now=now())
    if as_json:
        print_json(done.model_dump())
        return 0
    typer.echo(printable(handover_words(done)))
    typer.echo(f"the new public key is {done.after}; give it to whoever verifies")
    return 0


@key.command()
def new(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="A new file for the private key, as on a stick.")],
    as_json: Json = False,
) -> int:
    """Make a key for somebody else to keep: the plan key records.key names its file, and runs are signed with it while it is there.

    Without the file a run is measured and judged as always, and a note beside its verdict says that it is not signed.
    """
    from cmmlink.record import make_key

    made = make_key(file)
    if as_json:
        print_json({"key_id": made.key_id, "public_key": made.public_key, "file": str(file)})
        return 0
    typer.echo(printable(f"key {made.key_id} in {file}: whoever has this file can sign. Give its public key to whoever verifies:"))
    typer.echo(made.public_key)
    return 0
