"""Options that several commands share, and what they mean."""

import getpass
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any, Literal

import typer

from cmmlink.errors import PlanError, RunError
from drivers import UnitName
from inspection import RuleName, WeightName

PlanFile = Annotated[Path, typer.Argument(metavar="PLAN.yaml", help="The inspection plan.")]
Json = Annotated[bool, typer.Option("--json", help="Print one JSON object instead of words.")]
RejectOutliers = Annotated[
    bool, typer.Option("--reject-outliers", help="Fit without gross outliers and reject them; conform is then not proven.")
]
Rule = Annotated[RuleName, typer.Option(help="What decides without a datum: any placement that passes, or the best fit.")]
Weights = Annotated[WeightName, typer.Option(help="How points count in the best fit.")]
GapMax = Annotated[
    float | None,
    typer.Option(min=0, metavar="MM", help="Longest stretch without a point that counts as measured.", show_default="1 % of the length"),
]
EndAllowance = Annotated[
    float | None,
    typer.Option(min=0, metavar="MM", help="How far points may lie beyond an open end.", show_default="half the zone"),
]
AllowUnseen = Annotated[
    float | None,
    typer.Option(
        min=0,
        metavar="MM",
        help="Longest stretch that may be unseen where points were lost, damaged or rejected.",
        show_default="none may be",
    ),
]
Out = Annotated[Path | None, typer.Option("--out", metavar="DIR", help="Folder for deviations.csv, result.json and profile.png.")]
Records = Annotated[Path | None, typer.Option("--records", metavar="DIR", help="Folder of the run records.")]
NoRecord = Annotated[bool, typer.Option("--no-record", help="Keep no record of it.")]


def runs_like(context: typer.Context, incomplete: str) -> list[str]:
    """The names that a shell offers for a run: newest first its ids and serial numbers, and last."""
    from datetime import datetime

    from cmmlink.errors import RunError, StoreError
    from cmmlink.record import list_runs

    try:
        found = list_runs(records_folder(context.params.get("records")), lambda: datetime.now().astimezone())
    except (RunError, StoreError, OSError):  # a shell has no place for what is wrong
        found = []
    names = ["last", *(str(entry[key]) for entry in reversed(found) for key in ("run", "serial_number") if entry[key])]
    return [name for name in dict.fromkeys(names) if name.startswith(incomplete)]


RunName = Annotated[
    str,
    typer.Argument(
        metavar="RUN",
        help="A run: its id or the beginning, its counter, a serial number, last, or last~1.",
        autocompletion=runs_like,
    ),
]
RunOrFolder = Annotated[
    str,
    typer.Argument(
        metavar="RUN|FOLDER",
        help="A run: its id or the beginning, its counter, a serial number, last, or last~1; or the folder that a run was exported to.",
        autocompletion=runs_like,
    ),
]
Unit = Annotated[UnitName | None, typer.Option("--unit", help="Unit of the points, above what their file states.")]
NominalUnit = Annotated[UnitName | None, typer.Option("--nominal-unit", help="Unit of the nominal file, in place of --scale.")]
PlaneName = Literal["xy", "xz", "yz"]
Plane = Annotated[PlaneName, typer.Option("--plane", help="The plane that the points of the section lie in.")]
SectionPlaneNumbers = Annotated[
    tuple[float, float, float, float, float, float] | None,
    typer.Option("--section", metavar="X Y Z I J K", help="A point of the section and its normal, in place of --plane."),
]
Invalid = Annotated[
    list[float] | None, typer.Option("--invalid", metavar="V", help="A coordinate that means no point, like -9999; as often as wanted.")
]
ColumnsText = Annotated[str | None, typer.Option("--columns", metavar="x=2,y=3", help="Columns of x, y and z in the file, from 1.")]
Headless = Annotated[bool, typer.Option("--headless", help="No page, no live table.")]
NoBrowser = Annotated[bool, typer.Option("--no-browser", help="Serve the page and print its address, but open no browser.")]
Uncertainty = Annotated[float, typer.Option(metavar="U", help="Expanded uncertainty of a deviation, mm.")]
NominalScale = Annotated[float, typer.Option(metavar="S", help="Units of the nominal file to mm (a chord, for airfoils).")]
Layer = Annotated[str | None, typer.Option("--layer", metavar="NAME", help="Layer of a drawing that the nominal is drawn on.")]
CurveNumber = Annotated[
    int | None, typer.Option("--curve", min=1, metavar="N", help="Which curve of a drawing is the nominal, the longest being 1.")
]
Closed = Annotated[bool | None, typer.Option("--closed/--open", help="Close the nominal, or leave it open.")]


def records_folder(records: Path | None) -> Path:
    """The folder of the run records: the one that was asked for, or the user's own."""
    from cmmlink.record import default_folder

    return records or default_folder()


def station_records(records: Path | None, *, is_needed: bool = False) -> Path:
    """The same of a station whose records are read, or its settings. Raises RunError where it was asked for and is not there.

    is_needed : the user's own has to be there as well
    """
    folder = records_folder(records)
    if folder.exists() and not folder.is_dir():
        raise RunError(f"{folder}: is no folder; --records DIR says in which one the records are")
    if (is_needed or records is not None) and not folder.exists():
        raise RunError(f"{folder}: there is no such folder; --records DIR says in which one the records are")
    return folder


def columns_from(text: str | None) -> dict[str, int] | None:
    """The columns of x, y and z from an option like x=2,y=3. Raises PlanError."""
    if text is None:
        return None
    told = [part.partition("=") for part in text.replace(" ", "").lower().split(",")]
    columns = {axis: int(place) for axis, _, place in told if axis in ("x", "y", "z") and place.isdecimal() and len(place) < 7}
    if len(columns) != len(told) or len(columns) < 2 or len(set(columns.values())) < len(columns) or min(columns.values()) < 1:
        raise PlanError(f"--columns {text}: expected different columns, counted from 1, for two or three of x, y and z, like x=2,y=3")
    return columns


def section_in(plane: PlaneName, given: tuple[float, ...] | None) -> dict[str, Any]:
    """The section of a plan: a plane of the machine, whose first axis becomes x and whose second y, or one of a point and a normal."""
    if given is not None:
        return _section_of(given, plane)
    if plane == "xy":
        return {}  # a nominal that lies in space brings its own
    normal = {"xy": (0.0, 0.0, 1.0), "xz": (0.0, -1.0, 0.0), "yz": (1.0, 0.0, 0.0)}[plane]
    return {"normal": normal, "x_axis": (0.0, 1.0, 0.0) if plane == "yz" else (1.0, 0.0, 0.0)}


def _section_of(given: tuple[float, ...], plane: PlaneName) -> dict[str, Any]:
    """The section through a point with a normal; its x axis is what a cut of a surface has. Raises PlanError."""
    from drivers.surface import axes_of

    if plane != "xy":
        raise PlanError(f"--section and --plane {plane} are both given; expected one of them")
    try:
        axes = axes_of(given[3:])
    except ValueError as error:
        raise PlanError(f"--section: {error}") from None
    return {"origin_mm": given[:3], "normal": tuple(axes.normal.tolist()), "x_axis": tuple(axes.x.tolist())}


def who_asks(operator: str | None) -> str:
    """Who does something that is kept with his name: as --operator says, else the user of this computer. Raises PlanError."""
    if operator:
        return operator
    try:
        return getpass.getuser()
    except (OSError, KeyError, ImportError):  # which of them depends on the system and the version of Python
        raise PlanError("the system does not tell who you are; expected --operator O") from None


def settings_in(texts: Sequence[str]) -> dict[str, str]:
    """The keys of --set with their values. Raises PlanError."""
    changes: dict[str, str] = {}
    for text in texts:
        key, equals, value = text.partition("=")
        key = key.strip()
        if not equals or not key or key in changes:
            problem = f"{key} is given twice" if key in changes else "expected KEY=VALUE, like tolerance.upper_mm=0.08"
            raise PlanError(f"--set {text}: {problem}")
        changes[key] = value.strip()
    return changes
