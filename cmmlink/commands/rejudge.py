"""The command that judges an archive again by a changed plan, and tells what changed its verdict."""

from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from cmmlink.commands.exit_codes import EXIT_OF, NO_RECORD, UNUSABLE, say, worst_of
from cmmlink.commands.options import Json, settings_in, who_asks
from cmmlink.commands.output import now, print_json, stop_on_ctrl_c
from cmmlink.commands.progress import progress
from cmmlink.errors import PlanError
from cmmlink.words import printable, utc_words

if TYPE_CHECKING:
    from cmmlink.archive import Keeper, Rejudged, Row, Workers
    from cmmlink.record import Store

_DAYS = ["%Y-%m-%d"]
_TABLES = (".csv", ".xlsx")
_CAUSE = 60  # letters of a cause by which failures are told together


def rejudge(
    archive: Annotated[
        Path, typer.Argument(metavar="ARCHIVE", help="Records: their folder, a backup of them, or the folder that a run was exported to.")
    ],
    settings: Annotated[
        list[str], typer.Option("--set", metavar="KEY=VALUE", help="Judge with another value of any key of the plans; as often as wanted.")
    ],
    part: Annotated[str, typer.Option(metavar="TEXT", help="Only runs of parts whose name holds this.")] = "",
    since: Annotated[datetime | None, typer.Option(formats=_DAYS, help="Only runs of this day or later.")] = None,
    why: Annotated[
        str | None, typer.Option("--why", metavar="TEXT", help="Why: what was found is then kept in the records, chained to the runs.")
    ] = None,
    operator: Annotated[
        str | None, typer.Option("--operator", metavar="O", help="Who judges again.", show_default="the user of this computer")
    ] = None,
    workers: Annotated[
        int | None, typer.Option(min=1, max=64, metavar="N", help="Processes that judge.", show_default="one a core, four at most")
    ] = None,
    scheduler: Annotated[
        str | None,
        typer.Option(metavar="tcp://HOST:PORT", help="Let the workers of this Dask scheduler judge, on any computers."),
    ] = None,
    out: Annotated[Path | None, typer.Option("--out", metavar="FILE.csv|.xlsx", help="Write the table of all runs to this file.")] = None,
    records: Annotated[
        Path | None,
        typer.Option("--records", metavar="DIR", help="Where judgements are kept.", show_default="ARCHIVE, where it is a folder"),
    ] = None,
    as_json: Json = False,
) -> int:
    """Judge every run of an archive again by a changed plan, and tell what changed its verdict.

    Without --why nothing is kept: it is tried what would come out. With it, every judgement is added to the records with who, when and
    why, as `replay --reason` does; what was judged by the same plan before is not judged again, so that what was stopped goes on.

    Exit status: the worst of all runs, as each would have by itself: 5, then 1, 4, 2, 3 and 0; 2 also where some are left.
    """
    from cmmlink.archive import rejudge as judge_archive
    from cmmlink.record import RunSearch, open_archive

    changes = settings_in(settings)
    _check(out, scheduler, workers)
    search = RunSearch(part=part, since=None if since is None else since.date())
    with ExitStack() as opened:
        store = opened.enter_context(open_archive(archive, now))
        keeper, kept_in = _keeping(opened, store, archive, records, why, operator)
        stop = opened.enter_context(stop_on_ctrl_c())
        tell = opened.enter_context(progress(f"judging {archive} again"))
        found = judge_archive(
            store,
            changes,
            lambda runs: opened.enter_context(_workers(runs, workers, scheduler, store)),
            search=search,
            stop=stop,
            keeper=keeper,
            kept_in=kept_in,
            tell=tell,
        )
    for note in keeper.notes if keeper is not None else ():
        say(note)
    code = _code_of(found)
    if out is not None:
        _write(found.rows, out)
    if as_json:
        print_json(_document(found, archive, changes, code))
    else:
        _print(found, keeper, out)
    if found.left:
        say(f"stopped by the operator: {found.left} runs are left; the same command goes on with them{'' if keeper else ' and the others'}")
    return code


def _check(out: Path | None, scheduler: str | None, workers: int | None) -> None:
    """Raise PlanError for what cannot be, before an hour of work."""
    if out is not None and out.suffix.lower() not in _TABLES:
        raise PlanError(f"--out {out}: expected a file that ends in .csv or .xlsx")
    if out is not None and not out.resolve().parent.is_dir():
        raise PlanError(f"--out {out}: there is no folder {out.resolve().parent}")
    if scheduler is not None and workers is not None:
        raise PlanError(
            "--workers and --scheduler are both given; expected one of them: a cluster has the workers that were started for it"
        )


def _keeping(
    opened: ExitStack, store: "Store", archive: Path, records: Path | None, why: str | None, operator: str | None
) -> "tuple[Keeper | None, Store | None]":
    """Who keeps the judgements, and the records that hold those of before where they are others than the archive. Raises PlanError."""
    from cmmlink.archive import Keeper
    from cmmlink.record import has_records, open_to_read

    if why is None:
        if records is not None:
            raise PlanError("--records says where judgements are kept: expected --why TEXT, which is kept with them")
        return None, None
    if not why.strip():
        raise PlanError("--why is empty: expected the reason, which is kept with the judgements")
    folder = records or archive
    if not has_records(folder):
        raise PlanError(f"{folder}: judgements are kept in a folder of records; expected --records DIR, whose records hold these runs")
    keeper = Keeper(folder, who=who_asks(operator), why=why.strip(), now=now)
    return keeper, None if records is None else opened.enter_context(open_to_read(records, now))


@contextmanager
def _workers(runs: int, workers: int | None, scheduler: str | None, store: "Store") -> "Iterator[Workers]":
    """Who judges so many runs: a few are done here before another process has started."""
    from cmmlink.archive import MOST_RUNS, Here, Processes
    from cmmlink.other_processes import processes_here

    if scheduler is not None:
        from cmmlink.archive import Cluster

        with Cluster(scheduler) as cluster:
            cluster.require_same(store.path)
            yield cluster
    elif workers is None and runs <= MOST_RUNS:
        yield Here()
    else:
        with Processes(min(runs, workers or processes_here() or 1)) as processes:
            yield processes


def _code_of(found: "Rejudged") -> int:
    return worst_of([_code_of_row(row) for row in found.rows] + [UNUSABLE] * bool(found.left))


def _code_of_row(row: "Row") -> int:
    if row.failure is not None:
        return NO_RECORD if row.failure.kind == "no-record" else UNUSABLE
    return UNUSABLE if row.verdict is None else EXIT_OF[row.verdict]


def _write(rows: "Sequence[Row]", out: Path) -> None:
    from cmmlink.archive import COLUMNS
    from cmmlink.exports import write_table
    from cmmlink.result_files import new_files

    with new_files(out.resolve().parent) as files:
        write_table("runs", COLUMNS, (row.cells for row in rows), files(out.name), utc_words(now()))


def _document(found: "Rejudged", archive: Path, changes: dict[str, str], code: int) -> dict[str, Any]:
    rows = [row.cells | {key: bool(row.cells[key]) for key in ("changed", "kept")} for row in found.rows]
    return {
        "exit_status": code,
        "archive": str(archive),
        "settings": changes,
        "changed": sum(row.changed for row in found.rows),
        "failed": sum(row.state == "failed" for row in found.rows),
        "left": found.left,
        "runs": [row | {"characteristics": one.characteristics} for row, one in zip(rows, found.rows, strict=True)],
    }


def _print(found: "Rejudged", keeper: "Keeper | None", out: Path | None) -> None:
    """The runs that are another than they were, what could not be judged, and how many there are of each."""
    rows = found.rows
    _print_changed([row for row in rows if row.changed or row.characteristics])
    causes = Counter(row.failure.message[:_CAUSE] for row in rows if row.failure is not None)
    for row in rows:
        if row.failure is not None and (count := causes.pop(row.failure.message[:_CAUSE], 0)):
            more = f" (and {count - 1} more by the same cause)" if count > 1 else ""
            say(f"{row.run}: {row.failure.message}{more}")
    told = Counter(row.state for row in rows)
    typer.echo(
        f"{len(rows)} runs: {told['judged']} judged again, {told['known']} as judged before, {told['failed']} cannot be judged again"
    )
    verdicts = Counter(f"{row.recorded} -> {row.again}" for row in rows if row.changed)
    typer.echo(f"changed: {sum(verdicts.values())}" + "".join(f", {count} {words}" for words, count in verdicts.most_common()))
    if rows:
        now_told = Counter(row.again for row in rows if row.after is not None)
        typer.echo("now: " + ", ".join(f"{count} {words}" for words, count in now_told.most_common()))
    if keeper is not None:
        typer.echo(printable(f"kept in {keeper.folder}: {len(keeper.kept)} judgements"))
    else:
        typer.echo("nothing was kept: --why TEXT keeps the judgements with who, when and why")
    if out is not None:
        typer.echo(f"all runs are in {out}")


def _print_changed(rows: "Sequence[Row]") -> None:
    """A line for each run that is another than it was: both headlines, the deviations in mm, and why."""
    if not rows:
        return
    width = max(len("part"), *(len(_name(row)) for row in rows))
    typer.echo(f"{'run':20}  {'part':{width}}  {'recorded':12}     {'again':12}  {'lowest':>8}  {'highest':>8}")
    for row in rows:
        found = (row.cells["min_deviation_mm"], row.cells["max_deviation_mm"])
        deviations = "  ".join(" " * 8 if value is None else f"{value:+8.4f}" for value in found)
        why = "; ".join([*row.characteristics, *([str(row.cells["reason"])] if row.changed and row.cells["reason"] else [])])
        line = f"{row.run:20}  {_name(row):{width}}  {row.recorded:12}  -> {row.again:12}  {deviations}  {why}"
        typer.echo(printable(line.rstrip()))


def _name(row: "Row") -> str:
    return " ".join(str(row.cells[key]) for key in ("part", "serial_number", "section") if row.cells[key])
