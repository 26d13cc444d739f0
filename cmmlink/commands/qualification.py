"""The command that qualifies an installation: it judges the reference set and keeps a certificate of what came of it."""

import json
from collections.abc import Mapping
from datetime import datetime
from pathlib import Path
from typing import Annotated, Any

import typer

from cmmlink.commands.exit_codes import EXIT_OF, NO_RECORD, fail
from cmmlink.commands.options import Json
from cmmlink.commands.output import now, print_json
from cmmlink.commands.progress import progress
from inspection import Verdict

_JSON, _PDF = "qualification-{moment}.json", "qualification-{moment}.pdf"


def qualify(
    out: Annotated[
        Path | None, typer.Option("--out", metavar="DIR", help="Folder for the certificate.", show_default="the station's own")
    ] = None,
    as_json: Json = False,
) -> int:
    """Qualify this installation: judge parts whose truth is known, and write a dated certificate. Takes about a minute.

    Deviations, poses, zones, filters, characteristics and a scan from the wire to the verdict are held against their truth. Exit status 0
    only where every error is inside its limit, else 1. Results and reports name the last qualification, also a failed one, and say when
    the installation changed since.
    """
    from cmmlink.installation import read_installation, station_folder
    from cmmlink.last_qualification import keep_as_last
    from cmmlink.qualification import last_from
    from cmmlink.qualification import qualify as qualify_on
    from cmmlink.reference import reference_cases

    station = station_folder()
    folder = out or station
    try:
        folder.mkdir(parents=True, exist_ok=True)  # before a minute's work, which could not be kept
    except OSError as error:
        return _refuse(error, folder)
    with progress("qualifying this installation, about a minute") as tell:
        cases = list(reference_cases())
        done = iter(range(len(cases) + 2))
        certificate, installation = qualify_on(
            cases, now, lambda: read_installation(station), on_case=lambda _: tell(next(done) / (len(cases) + 2))
        )
    try:
        files = _written(certificate, folder)
        keep_as_last(last_from(certificate, installation, files[0].absolute()), station)
    except OSError as error:
        return _refuse(error, folder)
    if as_json:
        print_json(certificate)
    else:
        for line in _told(certificate):
            typer.echo(line)
        typer.echo(f"certificate in {' and '.join(map(str, files))}")
    return EXIT_OF[Verdict.CONFORM if certificate["result"] == "passed" else Verdict.NONCONFORM]


def _refuse(error: OSError, folder: Path) -> int:
    return fail(f"{error.filename or folder}: the certificate cannot be kept: {error.strerror or error}", NO_RECORD)


def _written(certificate: Mapping[str, Any], folder: Path) -> list[Path]:
    """Write the certificate into a folder as JSON and as PDF. Raises OSError."""
    from cmmlink.report import write_certificate
    from cmmlink.result_files import new_files

    moment = f"{datetime.fromisoformat(certificate['date']):%Y%m%d-%H%M%S}"
    names = [name.format(moment=moment) for name in (_JSON, _PDF)]
    with new_files(folder) as files:
        files(names[0]).write_text(json.dumps(certificate, indent=1) + "\n", encoding="utf-8")
        write_certificate(certificate, files(names[1]))
    return [folder / name for name in names]


def _told(certificate: Mapping[str, Any]) -> list[str]:
    """The certificate in words: the budget as a table, what went wrong, and what came of it."""
    head = ("kind", "what", "values", "largest", "median", "limit", "")
    rows = [head, *(_row(line) for line in certificate["budget"])]
    widths = [max(len(row[place]) for row in rows) for place in range(len(head))]
    table = [
        "  ".join(_set(cell, width, place) for place, (cell, width) in enumerate(zip(row, widths, strict=True))).rstrip() for row in rows
    ]
    wire, judged = certificate["wire"], certificate["set"]
    latency = wire["latency_ms"]
    waited = f"; arrival to verdict {latency['median']:.2g} ms, 99 % within {latency['p99']:.2g} ms, no limit" if latency else ""
    outside = f": {', '.join(certificate['outside'])} outside the limits" if certificate["outside"] else ""
    return [
        *table,
        f"wire: {wire['received']} of {wire['sent']} points at {wire['rate_hz']:g} points/s{waited}",
        *certificate["problems"],
        f"{judged['cases']} cases of the reference set {judged['sha256'][:16]}, installation {certificate['installation']['sha256'][:16]}",
        f"{certificate['result'].upper()}{outside}",
    ]


def _row(line: Mapping[str, Any]) -> tuple[str, ...]:
    limit = f"{line['limit']:g}" if line["unit"] == "count" else f"{line['limit']:g} {line['unit']}"
    found = (_error(line, name) for name in ("largest", "median"))
    return (line["kind"], line["quantity"], str(line["values"]), *found, limit, "" if line["inside"] else "OUTSIDE")


def _error(line: Mapping[str, Any], name: str) -> str:
    if line[name] is None:
        return "none"
    return f"{line[name]:.0f}" if line["unit"] == "count" else f"{line[name]:.1e}"


def _set(cell: str, width: int, place: int) -> str:
    """A cell as wide as its column; those of numbers to the right."""
    return cell.rjust(width) if 2 <= place <= 5 else cell.ljust(width)
