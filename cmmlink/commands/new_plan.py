"""The command `plan new`: at most six questions, each with an answer offered where one is sensible, and a plan.

Every answer may be an option as well. Where nobody can be asked, because standard input is no terminal, what is offered is taken, and
what decides about parts (tolerance, source of the points) has to be an option.
"""

import sys
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, TypeVar

import typer

from cmmlink.commands.check import check
from cmmlink.commands.options import Closed, CurveNumber, Layer, NominalUnit
from cmmlink.errors import PlanError
from cmmlink.words import printable
from inspection import InspectionError, Material

if TYPE_CHECKING:
    from cmmlink.new_plan import NominalReading
    from cmmlink.nominal_files import NominalFile

Answer = TypeVar("Answer")

_WHAT = "What is it? The name of the part"
_WHICH = "Which of its curves is the nominal? The longest is 1"
_CHORD = "The file is in units of its chord. How long is the chord, in mm?"
_UNIT = "In which unit is the file? mm, um, inch, or how many mm a unit is"
_ENDS = "The ends of the profile nearly meet. Is it closed or open?"
_SIDE = "The profile is open. On which side of it is the material, seen along the arrows? left or right"
_TOLERANCE = "How far may points be off, in mm? Lower and upper limit, or one number for both; positive is out of material"
_SOURCE = "Where do the points come from? A file, a surface (STL), a port like COM3, host:port, or modbus host:port my-map.yaml"
_TIP = "Are the points centres of the probe's ball? Its radius in mm; 0 where they are points of the surface"
_RESULTS = "Where do the results go?"
_MOST_QUESTIONS = 6
_USUAL_TOLERANCE = "-0.05 0.05"
_SIDES: tuple[Material, ...] = ("left", "right")

PlanOut = Annotated[
    Path | None, typer.Option("--out", "-o", metavar="PLAN.yaml", help="The plan to write.", show_default="NOMINAL-plan.yaml")
]
Source = Annotated[str | None, typer.Option(metavar="SOURCE", help="Where points come from: a file, a surface, a port, host:port.")]


def new(
    nominal: Annotated[Path, typer.Argument(metavar="NOMINAL", help="The nominal profile: UIUC dat, points, nurbs yaml, or a drawing.")],
    out: PlanOut = None,
    part: Annotated[str | None, typer.Option(metavar="NAME", help="What it is: the name of the part.")] = None,
    curve: CurveNumber = None,
    layer: Layer = None,
    unit: NominalUnit = None,
    scale: Annotated[float | None, typer.Option(metavar="S", help="Units of the nominal file to mm (a chord, for airfoils).")] = None,
    closed: Closed = None,
    material: Annotated[Material | None, typer.Option(help="Side of the material of an open profile, seen along it.")] = None,
    tolerance: Annotated[
        tuple[float, float] | None, typer.Option(metavar="LO HI", help="Deviations allowed, mm, positive out of material.")
    ] = None,
    device: Source = None,
    tip_radius: Annotated[
        float | None, typer.Option(min=0, metavar="R", help="The points are centres of a ball of this radius, mm.")
    ] = None,
    results: Annotated[str | None, typer.Option(metavar="FOLDER", help="Where results go; may hold {part}, {serial} and {run}.")] = None,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace a plan that is there.")] = False,
) -> int:
    """Make a plan by answering at most six questions, and check it.

    SOURCE is a file of points, a surface of a CT scan (STL, PLY, OBJ), or a serial port or host:port, perhaps with the format behind it and
    the options of the format: 'COM3 optoncdt range_mm=50'. A device with registers: 'modbus 192.168.1.10:502 my-map.yaml'.
    """
    from cmmlink.new_plan import (
        RESULTS,
        NominalReading,
        PlanAnswers,
        plan_text,
        radius_from,
        refuse_name,
        save_plan,
        source_from,
        tolerance_from,
    )

    path = out if out is not None else nominal.with_name(f"{nominal.stem}-plan.yaml")
    if unit is not None and scale is not None:
        raise PlanError("--nominal-unit and --scale are both given; expected one of them")
    ask = _Asking(sys.stdin.isatty())
    replaced = overwrite or (path.exists() and ask.confirm(f"{path} is there already. Replace it?"))
    refuse_name(path.parent, path.name, overwrite=replaced)
    first = NominalReading(unit, scale or 1.0, curve, layer, closed)
    reading, understood = _understand(ask, nominal, first, stated=(unit or scale) is not None)
    _show(understood, path)
    name = part or ask(_WHAT, "--part", str, nominal.stem)
    side = material or _side(ask, understood)
    limits = tolerance or ask(_TOLERANCE, "--tolerance", tolerance_from, _USUAL_TOLERANCE, decides=True)
    understand = partial(source_from, folder=path.parent)
    source = understand(device) if device else ask(_SOURCE, "--device", understand, _offered_source(nominal), decides=True)
    tip = 0.0 if "mesh" in source else ask(_TIP, "--tip-radius", radius_from, "0") if tip_radius is None else tip_radius
    folder = results or (ask(_RESULTS, "--results", str, RESULTS) if ask.count < _MOST_QUESTIONS else RESULTS)
    text = plan_text(PlanAnswers(name, nominal, reading, *limits, source, folder, side, tip), understood, path.parent)
    save_plan(path.parent, path.name, text, overwrite=replaced)
    typer.echo(f"{text}\nwritten to {path}")
    return check(path)


class _Asking:
    """Asks at the terminal, and again where an answer is none; counts the questions."""

    def __init__(self, can_ask: bool) -> None:
        self._can_ask = can_ask
        self.count = 0

    def __call__(
        self, question: str, option: str, understand: Callable[[str], Answer], offered: str | None = None, *, decides: bool = False
    ) -> Answer:
        """The answer, as it is understood. Raises PlanError, naming the option, where it has to be given and nobody can be asked.

        decides : whether the verdict hangs on it, so that what is offered is not taken unseen
        """
        self.count += 1
        if not self._can_ask:
            if offered is None or decides:
                raise PlanError(f"{option} is missing, and nobody can be asked here. {question}")
            return understand(offered)
        while True:
            answer = typer.prompt(question, default=offered, prompt_suffix=" ", err=True)
            try:
                return understand(answer)
            except PlanError as error:
                typer.echo(f"  {printable(str(error))}", err=True)

    def confirm(self, question: str) -> bool:
        """Whether it is confirmed; not where nobody can be asked."""
        return self._can_ask and typer.confirm(question, err=True)


def _understand(ask: _Asking, nominal: Path, reading: "NominalReading", *, stated: bool) -> "tuple[NominalReading, NominalFile]":
    """How the file is read, with what of it had to be asked, and what it then is."""
    from cmmlink.new_plan import open_questions, reading_from

    missing = open_questions(nominal, reading)
    if "curve" in missing:
        try:
            reading.load(nominal)
        except InspectionError as error:
            typer.echo(printable(str(error)), err=True)
        reading = replace(reading, curve=ask(_WHICH, "--curve", _number, "1"))
    if "ends" in missing:
        reading = replace(reading, closed=ask(_ENDS, "--closed or --open", _is_closed, None))
    if "chord" in missing and not stated:
        reading = ask(_CHORD, "--scale", lambda text: reading_from(text, reading), None)
    if "unit" in missing:
        reading = ask(_UNIT, "--nominal-unit", lambda text: reading_from(text, reading), "mm", decides=True)
    return reading, reading.load(nominal)


def _number(text: str) -> int:
    if not text.strip().isdecimal() or int(text) < 1:
        raise PlanError(f"'{text}': expected the number of a curve, the longest being 1")
    return int(text)


def _is_closed(text: str) -> bool:
    if text.strip().lower() not in ("closed", "open"):
        raise PlanError(f"'{text}': expected closed or open")
    return text.strip().lower() == "closed"


def _side(ask: _Asking, understood: "NominalFile") -> Material | None:
    """The side of the material, asked for where the profile has no inside; None where the file shows it."""
    from cmmlink.new_plan import material_of

    def understand(text: str) -> Material:
        found = next((side for side in _SIDES if side == text.strip().lower()), None)
        if found is None:
            raise PlanError(f"'{text}': expected left or right")
        return found

    return None if material_of(understood) else ask(_SIDE, "--material", understand, None)


def _offered_source(nominal: Path) -> str:
    """A serial port that is there, or points.csv beside the nominal."""
    from cmmlink.devices import serial_ports

    ports = serial_ports()
    return ports[0][0] if ports else str(nominal.with_name("points.csv"))


def _show(understood: "NominalFile", path: Path) -> None:
    """Show what was understood of the nominal: in words, and as a picture here or, where it cannot be shown, beside the plan."""
    from cmmlink.new_plan import words_of_nominal

    typer.echo(f"{understood.source_format}: {words_of_nominal(understood)}")
    for note in understood.notes:
        typer.echo(f"  {printable(note)}")
    if _shows_braille():
        from cmmlink.report import text_picture

        typer.echo(text_picture(understood))
        typer.echo("S is the start; the arrows show the direction in which stations count")
        return
    from cmmlink.report import write_nominal_picture

    picture = path.with_suffix(".png")
    write_nominal_picture(understood, path.stem, picture)
    typer.echo(f"the nominal is drawn in {picture}")


def _shows_braille() -> bool:
    """Whether standard output is a terminal whose letters are Unicode's."""
    return sys.stdout.isatty() and (sys.stdout.encoding or "").lower().replace("-", "") in ("utf8", "utf16", "cp65001")
