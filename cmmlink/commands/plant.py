"""Commands on the results database of a plant: push what a station has recorded, tell what waits, hold the database against the records."""

import sys
import threading
import time
from dataclasses import asdict
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from cmmlink.commands.exit_codes import DEVICE_FAILED, UNUSABLE, fail
from cmmlink.commands.options import Json, Records, records_folder, station_records
from cmmlink.commands.output import now, print_json
from cmmlink.commands.progress import progress
from cmmlink.commands.trends import trends
from cmmlink.words import local_words, printable

if TYPE_CHECKING:
    from cmmlink.plant_push import Outbox, PlantVerified

_MOST_TOLD = 20
_ROWS = ("missing", "altered", "extra")

plant = typer.Typer(help="Push results to a database that many stations share, and check what is in it.", rich_markup_mode=None)


@plant.command()
def push(
    everything: Annotated[
        bool, typer.Option("--all", help="Push every run of the records anew; what is in the database already stays as it is.")
    ] = False,
    stay: Annotated[
        bool, typer.Option("--stay", help="Go on until standard input is closed, and push whenever something was recorded.")
    ] = False,
    records: Records = None,
    as_json: Json = False,
) -> int:
    """Push the results of all runs that the database has not got yet. The console does so by itself after each run.

    The records are the outbox: what cannot be pushed now is pushed the next time, and a run is in the database once. Exit status 4 where
    the database cannot be reached.
    """
    from cmmlink.plant_push import push as push_results

    folder = station_records(records)
    if stay:
        return _stay(folder)
    with progress("pushing results") as tell:
        outbox = push_results(folder, now, again=everything, tell=tell)
    _tell(outbox, as_json)
    if outbox.problem:
        return _failed(outbox, as_json)
    return 0


@plant.command()
def status(records: Records = None, as_json: Json = False) -> int:
    """Show which database the results go to and what waits to be pushed, without asking the database."""
    from cmmlink.plant_push import outbox_of

    outbox = outbox_of(station_records(records), now)
    _tell(outbox, as_json)
    return 0


@plant.command()
def verify(records: Records = None, as_json: Json = False) -> int:
    """Hold every row of the database against this station's records: its hash, values, verdict and deviations along the profile.

    Exit status 0 only where all runs are there as the records have them, and no other of this station.
    """
    from cmmlink.plant_push import verify_plant

    with progress("comparing the database with the records") as tell:
        found = verify_plant(station_records(records), now, tell)
    if as_json:
        print_json(_verified_json(found))
        return 0 if found.sound else 1
    typer.echo(printable(f"{found.address}: {found.agree} of {found.runs} runs are there as the records have them"))
    for name, rows in (("missing", found.missing), ("altered", found.altered), ("extra", found.extra)):
        for row in rows[:_MOST_TOLD]:
            typer.echo(printable(f"{name}: {row.station} {row.run}: {row.what}"))
        if len(rows) > _MOST_TOLD:
            typer.echo(f"{name}: and {len(rows) - _MOST_TOLD} more")
    if found.record:
        typer.echo(printable(f"the records themselves were altered: {found.record}"))
    return 0 if found.sound else 1


@plant.command()
def address(
    given: Annotated[
        str | None, typer.Argument(metavar="[ADDRESS]", help="postgresql://USER@HOST/DATABASE, or a file. Without it, show where they go.")
    ] = None,
    records: Records = None,
    as_json: Json = False,
) -> int:
    """Say where the results of this station go. The database is asked first, and gets its tables where it has none.

    A password is never part of an address: write it to PostgreSQL's own password file, ~/.pgpass, or to the file that the address names
    with ?passfile=FILE.
    """
    from cmmlink.plant import ResultsDatabase, words_of
    from cmmlink.plant_push import address_for, keep_address

    folder = records_folder(records)
    if given is not None:
        whole = given if "://" in given else str(Path(given).resolve())
        ResultsDatabase(whole).close()
        keep_address(folder, whole)
    told = words_of(address_for(folder))
    if as_json:
        print_json({"address": told})
    else:
        typer.echo(printable(f"results of {folder} go to {told}"))
    return 0


plant.command()(trends)


def _stay(folder: Path) -> int:
    """Push whenever something was recorded, and tell each attempt as one JSON object on a line."""
    from cmmlink.plant_push import be_last_in_line, follow

    ended = threading.Event()

    def tell(outbox: "Outbox") -> None:
        print_json(outbox_json(outbox))
        sys.stdout.flush()

    def listen() -> None:
        while sys.stdin.readline():
            pass
        ended.set()

    threading.Thread(target=listen, name="end of input", daemon=True).start()
    be_last_in_line()
    follow(folder, tell, now=now, clock=time.monotonic, wait=ended.wait)
    return 0


def outbox_json(outbox: "Outbox") -> dict[str, Any]:
    """What waits, as `--json` tells it."""
    since = None if outbox.since_s is None else datetime.fromtimestamp(outbox.since_s).astimezone().isoformat(timespec="seconds")
    return {
        "address": outbox.address,
        "added": outbox.added,
        "waiting": outbox.waiting,
        "since": since,
        "late": outbox.late,
        "problem": outbox.problem or None,
        "away": outbox.away,
        "pushed": outbox.pushed or None,
        "unreadable": [{"run": run, "problem": problem} for run, problem in outbox.unreadable.items()],
        "others": list(outbox.others),
        "alarms": [asdict(alarm) for alarm in outbox.alarms],
    }


def _tell(outbox: "Outbox", as_json: bool) -> None:
    if as_json:
        print_json(outbox_json(outbox))
        return
    from drivers import count_of

    added = f"{count_of(outbox.added, 'run')} pushed to" if outbox.added else "results go to"
    since = "" if outbox.since_s is None else f", the oldest since {local_words(datetime.fromtimestamp(outbox.since_s))}"
    waits = f"{count_of(outbox.waiting, 'run')} waiting{since}" if outbox.waiting else "nothing waits"
    typer.echo(printable(f"{added} {outbox.address}; {waits}"))
    for run, problem in outbox.unreadable.items():
        typer.echo(printable(f"not pushed, for it cannot be read: run {run}: {problem}"))
    for alarm in outbox.alarms:
        whose = alarm.serial_number or alarm.run
        typer.echo(printable(f"the process has changed: {alarm.part} {whose}, {alarm.characteristic}: {alarm.rule}"))
    for run in outbox.others:
        typer.echo(
            printable(f"not pushed, for the database has another run of that name and station: {run}; has each station its own name?")
        )


def _failed(outbox: "Outbox", as_json: bool) -> int:
    code = DEVICE_FAILED if outbox.away else UNUSABLE
    return code if as_json else fail(f"{outbox.problem}; nothing is lost: the records keep it for the next time", code)


def _verified_json(found: "PlantVerified") -> dict[str, Any]:
    rows = {name: [{"station": row.station, "run": row.run, "what": row.what} for row in getattr(found, name)] for name in _ROWS}
    return {
        "address": found.address,
        "sound": found.sound,
        "runs": found.runs,
        "agree": found.agree,
        **rows,
        "record": found.record or None,
    }
