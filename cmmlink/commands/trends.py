"""The command `plant trends`: the course of a characteristic over the runs of a part, and where along its profile the process drifts."""

from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from cmmlink.commands.options import Json, Records, station_records
from cmmlink.commands.output import print_json
from cmmlink.commands.progress import progress
from cmmlink.errors import PlanError
from cmmlink.plan import LanguageName
from cmmlink.words import printable

if TYPE_CHECKING:
    from cmmlink.part_trend import PartTrend
    from cmmlink.plant import CapabilityIndex, ControlChart, ResultsDatabase

_WRITTEN = (".pdf", ".png", ".svg", ".xlsx")
_NONE = "-"
_MOST_BROKEN = 8  # rules that are printed of each chart, the newest


def trends(
    part: Annotated[str, typer.Argument(metavar="PART", help="The name of the part, as its plan calls it.")],
    characteristic: Annotated[
        str | None, typer.Option(metavar="NAME", help="The characteristic.", show_default="the first one of the part")
    ] = None,
    station: Annotated[str | None, typer.Option(metavar="S", help="Only runs of this station.", show_default="all")] = None,
    since: Annotated[datetime | None, typer.Option(formats=["%Y-%m-%d"], help="Only runs of this day or later.")] = None,
    last: Annotated[int, typer.Option(metavar="N", min=2, help="At most so many of the newest runs.")] = 100,
    subgroup: Annotated[
        int, typer.Option(metavar="N", min=1, max=100, help="So many runs in a row were made under the same conditions: a mean is plotted.")
    ] = 1,
    language: Annotated[LanguageName, typer.Option(help="Of the drawing.")] = "en",
    out: Annotated[
        Path | None, typer.Option("--out", "-o", metavar="FILE", help="A drawing (pdf, png, svg) or a workbook (xlsx).", show_default=False)
    ] = None,
    records: Records = None,
    as_json: Json = False,
) -> int:
    """Show how a characteristic of a part runs: limits of control, broken rules, capability, and where along the profile it drifts."""
    from cmmlink.part_trend import look_at_trend
    from cmmlink.plant import ResultsDatabase
    from cmmlink.plant_push import address_for

    if out is not None and out.suffix.lower() not in _WRITTEN:
        raise PlanError(f"{out}: nothing is written by the suffix '{out.suffix}'; expected one of {', '.join(_WRITTEN)}")
    with ResultsDatabase(address_for(station_records(records, is_needed=True)), is_made=False) as results:
        name = _characteristic_of(results, part, characteristic)
        begin = None if since is None else since.astimezone()
        found = look_at_trend(results, part, name, station=station, since=begin, last=last, subgroup=subgroup)
    if not found.series.run:
        raise PlanError(f"{part}: no run that is asked for has the characteristic {name!r}; leave out --station or --since")
    if out is not None:
        _write(found, out, language)
    if as_json:
        from cmmlink.trend_json import trend_json

        print_json(trend_json(found) | {"file": None if out is None else str(out)})
    else:
        _print(found, out)
    return 0


def _characteristic_of(results: "ResultsDatabase", part: str, asked: str | None) -> str:
    """The characteristic that is looked at. Raises PlanError where there is none, and names those that there are."""
    names = list(dict.fromkeys(one.name for one in results.characteristics(part)))
    if not names:
        parts = results.parts()
        known = f"there are results of: {', '.join(parts)}" if parts else "it has none: `cmmlink plant push` sends the recorded runs"
        raise PlanError(printable(f"{results.words} has no results of a part {part!r}; {known}"))
    if asked is not None and asked not in names:
        raise PlanError(printable(f"{part} has no characteristic {asked!r}; it has: {', '.join(names)}"))
    return asked or names[0]


def _write(found: "PartTrend", out: Path, language: LanguageName) -> None:
    from cmmlink.exports import write_trend_workbook
    from cmmlink.report import Speech, write_trend_picture
    from cmmlink.result_files import new_files

    try:
        with new_files(out.parent) as files, progress(f"writing {out.name}"):
            if out.suffix.lower() == ".xlsx":
                write_trend_workbook(found, files(out.name))
            else:
                write_trend_picture(found, files(out.name), Speech(language))
    except OSError as error:
        raise PlanError(f"{out}: the trend cannot be written there ({error.strerror}); choose another file with --out") from None


def _print(found: "PartTrend", out: Path | None) -> None:
    """Print which runs these are, the charts, the indices, what broke a rule, where the profile drifts, and what was assumed."""
    series, trend = found.series, found.trend
    runs = f"{len(series.run)} runs" + (f" of station {found.station}" if found.station else "")
    began, ended = (datetime.fromtimestamp(at).astimezone().strftime("%Y-%m-%d %H:%M") for at in series.started_s[[0, -1]])
    _say(f"{series.part}: {series.name} ({series.type}, {series.unit}), {runs} from {began} to {ended}")
    if trend.charts is not None:
        kinds = ("mean", "range") if trend.subgroup > 1 else ("value", "moving range")
        for kind, chart in zip(kinds, (trend.charts.location, trend.charts.spread), strict=True):
            _say(f"{kind:<13} {_limits(chart)}")
        for kind, chart in zip(kinds, (trend.charts.location, trend.charts.spread), strict=True):
            for line in _violations(found, chart):
                _say(f"rule broken   {kind} of {line}")
    if trend.capability is not None:
        indices = {"Cp": trend.capability.cp, "Cpk": trend.capability.cpk, "Pp": trend.capability.pp, "Ppk": trend.capability.ppk}
        _say("capability    " + "   ".join(f"{name} {_index(index)}" for name, index in indices.items()))
    for told in found.drifts:
        _say(told)
    for note in found.notes:
        _say(f"note: {note}")
    if out is not None:
        _say(f"trend in {out}")


def _limits(chart: "ControlChart") -> str:
    limits = chart.limits
    return f"centre {limits.centre:.5g}, limits of control {limits.lower:.5g} .. {limits.upper:.5g}"


def _violations(found: "PartTrend", chart: "ControlChart") -> list[str]:
    """The newest violations of a chart, each with its run; how many there are besides."""
    series, rows = found.series, found.last_rows.tolist()
    newest = chart.violations[-_MOST_BROKEN:]
    named = [
        f"{series.serial_number[rows[one.at]] or series.run[rows[one.at]]}: {one.words}, {'upwards' if one.above else 'downwards'}"
        for one in newest
    ]
    more = len(chart.violations) - len(newest)
    return [*([f"earlier ones: {more}"] if more else []), *named]


def _index(index: "CapabilityIndex") -> str:
    if index.value is None:
        return _NONE
    limits = "" if index.lower is None or index.upper is None else f" ({index.lower:.2f} .. {index.upper:.2f})"
    return f"{index.value:.2f}{limits}"


def _say(text: str) -> None:
    """Print what may quote the database; nothing there may steer the terminal."""
    typer.echo(printable(text))
