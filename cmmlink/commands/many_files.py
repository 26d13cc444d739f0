"""Many files of points in one call: each is a part by itself, and one table and one exit status come of all."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from threading import Event
from typing import TYPE_CHECKING, Any

import typer

from cmmlink.commands.exit_codes import DEVICE_FAILED, EXIT_OF, NO_RECORD, UNUSABLE, kind_of_failure, say, worst_of
from cmmlink.commands.output import print_json
from cmmlink.commands.progress import progress
from cmmlink.errors import PlanError, RunError, StoreError
from cmmlink.words import headline_of, printable
from drivers import DeviceError, PointFileError
from inspection import InspectionError

if TYPE_CHECKING:
    from cmmlink.report import Pictures
    from cmmlink.run import FinishedRun

_WIDEST_NAME = 40
_NOTHING = "NOT MEASURED"


@dataclass(frozen=True, slots=True)
class _Row:
    """What came of one file: its result as JSON, or what is wrong. `code` is the exit status that it would have by itself."""

    file: Path
    code: int
    headline: str
    result: dict[str, Any] | None = None
    error: dict[str, Any] | None = None

    @property
    def json(self) -> dict[str, Any]:
        """The row as --json prints it."""
        return {"file": str(self.file), "exit_status": self.code, "result": self.result, "error": self.error}


def inspect_files(
    files: Sequence[Path],
    inspect: "Callable[[Path, Path | None], FinishedRun]",
    out: Path | None,
    pictures: "Pictures",
    stop: Event,
    *,
    as_json: bool,
) -> int:
    """Inspect each file, write its results into a folder of its own in `out`, and print one table. Returns the worst exit status.

    stop : set by Ctrl-C: the files that are left are not inspected, and that is said
    """
    folders = _folders(files, out)
    rows: list[_Row] = []
    for file, folder in zip(files, folders, strict=True):
        if stop.is_set():
            rows += [_failure(left, PlanError("not inspected: stopped by the operator"), UNUSABLE) for left in files[len(rows) :]]
            break
        with progress(f"inspecting {file.name}, {len(rows) + 1} of {len(files)}") as tell:
            tell(len(rows) / len(files))
            rows.append(_inspected(file, folder, inspect, pictures))
        if rows[-1].error is not None:
            say(str(rows[-1].error["message"]))
    worst = worst_of([row.code for row in rows])
    if as_json:
        print_json({"exit_status": worst, "files": [row.json for row in rows]})
    else:
        _print_table(rows)
        if out is not None:
            typer.echo(f"results in {out}, a folder for each file")
    return worst


def _folders(files: Sequence[Path], out: Path | None) -> list[Path | None]:
    """A folder for the results of each file, no two alike: by its name, and a number where another file has the same one."""
    from cmmlink.result_folder import safe_name

    taken: set[str] = set()
    folders: list[Path | None] = []
    for file in files:
        name, count = safe_name(file.name), 1
        while name.casefold() in taken:
            count += 1
            name = f"{safe_name(file.name)}_{count}"
        taken.add(name.casefold())
        folders.append(None if out is None else out / name)
    return folders


def _inspected(file: Path, folder: Path | None, inspect: "Callable[[Path, Path | None], FinishedRun]", pictures: "Pictures") -> _Row:
    from cmmlink.report import write_run

    try:
        run = inspect(file, folder)
        if folder is not None and run.outcome.measured:
            write_run(folder, run, pictures)
        failure = run.outcome.failure
        if failure is not None:
            return _failure(file, failure, NO_RECORD if isinstance(failure, StoreError) else DEVICE_FAILED)
    except DeviceError as error:
        return _failure(file, error, DEVICE_FAILED)
    except StoreError as error:
        return _failure(file, error, NO_RECORD)
    except (PlanError, RunError, InspectionError, PointFileError, OSError) as error:
        return _failure(file, error, UNUSABLE)
    verdict = run.verdict
    code = UNUSABLE if run.outcome.result is None else EXIT_OF[verdict]
    return _Row(file, code, headline_of(verdict, run.outcome.ending).words, run.result_json())


def _failure(file: Path, error: Exception, code: int) -> _Row:
    message = str(error) if str(file) in str(error) else f"{file}: {error}"
    return _Row(file, code, _NOTHING, error={"kind": kind_of_failure(error, code), "message": message, "exit_status": code})


def _print_table(rows: Sequence[_Row]) -> None:
    """One line for each file, why one is not conform, what was assumed, and how many there are of each headline."""
    width = max(len("file"), *(min(len(row.file.name), _WIDEST_NAME) for row in rows))
    typer.echo(f"{'file':{width}}  {'verdict':12}  {'points':>8}  {'lowest':>8}  {'highest':>8}  {'error':>8}  {'covered':>7}  run")
    for row in rows:
        typer.echo(printable(f"{row.file.name[:_WIDEST_NAME]:{width}}  {row.headline:12}  {_numbers(row)}".rstrip()))
    for row in rows:
        if row.result is not None and row.code and row.result["reasons"]:
            typer.echo(printable(f"  {row.file.name}: {row.result['reasons'][0]['words']}"))
    for note in dict.fromkeys(note for row in rows if row.result is not None for note in row.result["notes"]):
        typer.echo(printable(f"  note: {note}"))
    counts = {headline: sum(row.headline == headline for row in rows) for headline in dict.fromkeys(row.headline for row in rows)}
    typer.echo(f"{len(rows)} files: " + ", ".join(f"{count} {headline}" for headline, count in counts.items()))


def _numbers(row: _Row) -> str:
    """Points judged, deviations, profile error (mm), coverage and run of a file; what is wrong with one that has none."""
    if row.result is None:
        return str((row.error or {}).get("message", ""))
    found = row.result
    deviations = (found["min_deviation_mm"], found["max_deviation_mm"])
    if None in deviations:
        return f"{found['judged']:8d}"
    numbers = f"{found['judged']:8d}  {deviations[0]:+8.4f}  {deviations[1]:+8.4f}  {found['profile_error_mm']:8.4f}"
    return f"{numbers}  {found['coverage']:7.1%}  {found.get('run') or ''}"
