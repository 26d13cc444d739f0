"""The command `registers`: what a Modbus device holds, and a register map made of what was seen there."""

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, get_args

import typer

from cmmlink.commands.options import Json
from cmmlink.commands.output import print_json
from cmmlink.errors import PlanError
from drivers import LinkError

if TYPE_CHECKING:
    from cmmlink.devices import ModbusPlace
    from cmmlink.new_map import FieldPlace
    from drivers import RegisterSurvey

Table = Literal["holding", "input"]  # these three are what drivers have under these names, which would load numpy for a help
WordOrder = Literal["high-first", "low-first"]
Kind = Literal["uint16", "int16", "uint32", "int32", "uint64", "int64", "float32", "float64"]
_USUAL: tuple[Kind, ...] = ("uint16", "int16", "int32", "float32")  # more would not fit on a line
_SHORT = {"high-first": "high", "low-first": "low"}
_WIDTH = 14
_TAKEN = "reading takes nothing from most devices; from one with a queue it may take the oldest message"
_PLACE = "AT:TYPE"


def registers(
    address: Annotated[str, typer.Argument(metavar="ADDRESS", help="host:port, or the port of an RTU line like COM3.")],
    first: Annotated[int, typer.Option("--first", min=0, max=65535, metavar="N", help="The first register, counted from 0.")] = 0,
    count: Annotated[int, typer.Option("--count", min=1, max=125, metavar="N", help="How many registers.")] = 20,
    table: Annotated[Table, typer.Option(help="Holding registers (function 3) or input registers (4).")] = "holding",
    kind: Annotated[Kind | None, typer.Option("--type", help="Show this type.", show_default="16 bits, int32, float32")] = None,
    device_id: Annotated[int, typer.Option(min=0, max=255, metavar="N", help="The unit identifier of the device.")] = 1,
    baud_rate: Annotated[int, typer.Option(min=1, metavar="N", help="The speed of an RTU line.")] = 19_200,
    parity: Annotated[Literal["N", "E", "O"], typer.Option(help="None, even or odd, of an RTU line.")] = "E",
    x: Annotated[str, typer.Option("--x", metavar=_PLACE, help="Where x lies, like 41:float32; with --out.")] = "",
    y: Annotated[str, typer.Option("--y", metavar=_PLACE, help="Where y lies.")] = "",
    z: Annotated[str, typer.Option("--z", metavar=_PLACE, help="Where z lies, or the distance of a distance sensor.")] = "",
    sequence: Annotated[str, typer.Option("--sequence", metavar=_PLACE, help="Where the counter of the points lies.")] = "",
    word_order: Annotated[WordOrder, typer.Option(help="Which register of a longer number comes first.")] = "high-first",
    scale: Annotated[float, typer.Option(metavar="MM", help="mm per unit of coordinates that are whole numbers.")] = 1.0,
    name: Annotated[str, typer.Option("--name", metavar="TEXT", help="The name of the device.", show_default="its address")] = "",
    out: Annotated[Path | None, typer.Option("--out", "-o", metavar="MAP.yaml", help="Write a register map with --x and --y.")] = None,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Write over a map of this name.")] = False,
    as_json: Json = False,
) -> int:
    """Show what the registers of a Modbus device hold, as numbers of every type in both word orders; nothing is written to the device.

    With --x and --y (or --z) and --out it writes a register map of them: `cmmlink registers 192.168.1.10:502 --x 41:float32 --y
    43:float32 --out my-map.yaml`. The page of `cmmlink console` shows the same while it changes, and takes x and y by a click.
    """
    from cmmlink.devices import ModbusPlace

    given = {field: text for field, text in (("x", x), ("y", y), ("z", z), ("sequence", sequence)) if text}
    if bool(given) != (out is not None):
        raise PlanError("a register map is written where --out and the places of its numbers, like --x and --y, are both given")
    places = _places(given)
    survey = _read(ModbusPlace(address, device_id, baud_rate, parity), table, first, count)
    written = out and _write(out, name or address, table, word_order, places, scale, overwrite)
    if as_json:
        print_json(_document(survey, None if written is None else str(written)))
        return 0
    _print(survey, _USUAL if kind is None else (kind,))
    if written is not None:
        typer.echo(f"written to {written}; a plan takes it as its map: `cmmlink plan new NOMINAL --device 'modbus {address} {written}'`")
    return 0


def _places(given: dict[str, str]) -> "dict[str, FieldPlace]":
    from cmmlink.new_map import place_from

    return {field: place_from(text, f"--{field}") for field, text in given.items()}


def _read(place: "ModbusPlace", table: Table, first: int, count: int) -> "RegisterSurvey":
    """Read the registers once. Raises PlanError, DeviceError."""
    from cmmlink.devices import source_of_survey
    from drivers import RegisterSurvey

    try:
        survey = RegisterSurvey(table, first, count, passes=1, device=place.address)
    except ValueError as error:
        raise PlanError(f"--first {first} --count {count}: {error}") from None
    for _ in source_of_survey(place, survey, 0.0).arrivals():
        pass
    if not survey.done:
        raise LinkError(f"{place.address}: the registers were not read to their end")
    return survey


def _write(
    out: Path, device: str, table: Table, word_order: WordOrder, places: "dict[str, FieldPlace]", scale: float, overwrite: bool
) -> Path:
    from cmmlink.new_map import MapAnswers, map_text
    from cmmlink.new_plan import save_plan

    text = map_text(MapAnswers(device, table, word_order, places, scale))
    return save_plan(out.parent, out.name, text, overwrite=overwrite)


def _document(survey: "RegisterSurvey", written: str | None) -> dict[str, Any]:
    from drivers import WORD_ORDERS, stored_number
    from drivers import registers_of as size_of

    rows = []
    for at in range(survey.first, survey.first + survey.count):
        values: dict[str, Any] = {}
        for kind in get_args(Kind):
            numbers = {order: _finite(stored_number(survey.words, at, kind, order)) for order in WORD_ORDERS}
            values[kind] = numbers if size_of(kind) > 1 else numbers["high-first"]
        rows.append({"register": at, "holds": survey.words.get(at), **values})
    return {"table": survey.table, "registers": rows, "map": written}


def _finite(number: int | float | None) -> int | float | None:
    """The number as JSON can hold it."""
    return number if number is not None and math.isfinite(number) else None


def _print(survey: "RegisterSurvey", kinds: tuple[Kind, ...]) -> None:
    from drivers import WORD_ORDERS, stored_number
    from drivers import registers_of as size_of

    columns = [(kind, order) for kind in kinds for order in WORD_ORDERS[: 1 if size_of(kind) == 1 else 2]]
    heads = [kind if size_of(kind) == 1 else f"{kind} {_SHORT[order]}" for kind, order in columns]
    typer.echo(f"{'register':>8}  {'hex':>6}" + "".join(f"{head:>{_WIDTH}}" for head in heads))
    for at in range(survey.first, survey.first + survey.count):
        if at in survey.missing:
            typer.echo(f"{at:>8}  the device has no such register")
            continue
        numbers = [stored_number(survey.words, at, kind, order) for kind, order in columns]
        typer.echo(f"{at:>8}  {survey.words[at]:#06x}" + "".join(f"{_spelled(number):>{_WIDTH}}" for number in numbers))
    typer.echo(f"note: {_TAKEN}")


def _spelled(number: int | float | None) -> str:
    return "-" if number is None else f"{number:.6g}" if isinstance(number, float) else str(number)
