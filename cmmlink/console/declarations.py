"""The protocol for the page's scripts: its constants as `protocol.js`, its types as `protocol.d.ts`.

Both files are kept with the page, so that nothing has to be built; a test compares them with what this file gives. Write them
anew after a change of the protocol with `python -m cmmlink.console.declarations`.
"""

import json
from collections.abc import Iterator, Mapping
from dataclasses import fields, is_dataclass
from pathlib import Path
from types import NoneType, UnionType
from typing import Any, Literal, Union, get_args, get_origin, get_type_hints

import numpy as np

from cmmlink import colour_map, extremes, words
from cmmlink.console import protocol
from cmmlink.console.form_answers import PlanSaved, Understood
from cmmlink.console.register_words import MapSaved
from cmmlink.console.trend_words import TrendChoices, TrendShown
from inspection import Verdict

_HEAD = "// Written by `python -m cmmlink.console.declarations`; change cmmlink/console/protocol.py, not this file.\n\n"
_MOST_ON_A_LINE = 6
_WORDS = {str: "string", bool: "boolean", int: "number", float: "number", NoneType: "null"}


def constants_js() -> str:
    """The constants of the protocol as a module of the page."""
    return _HEAD + "".join(f"export const {name} = {_constant(value)};\n" for name, value in _constants().items())


def declarations_ts() -> str:
    """The types of the messages and of the constants."""
    lines = [f"export const {name}: {_literal(value)};\n" for name, value in _constants().items()]
    seen: dict[type, None] = {}
    for union in (protocol.Message, protocol.Command):
        for message in get_args(union):
            _collect(message, seen)
    for answer in (protocol.Device, Understood, PlanSaved, MapSaved, TrendChoices, TrendShown):
        _collect(answer, seen)
    lines += [_interface(record) for record in seen]
    lines += [f"\nexport type {name} = {_type(union)};\n" for name, union in _unions().items()]
    return _HEAD + "".join(lines)


def write_files(folder: Path) -> None:
    """Write both files into the folder of the page."""
    (folder / "protocol.js").write_text(constants_js(), encoding="utf-8")
    (folder / "protocol.d.ts").write_text(declarations_ts(), encoding="utf-8")


def _constants() -> dict[str, Any]:
    header = np.dtype(list(protocol.HEADER))
    columns = ("STATION", "DEVIATION", "FOOT_X", "FOOT_Y", "NORMAL_X", "NORMAL_Y", "VERDICT", "COLUMNS")
    return {
        "WRONG_TOKEN": protocol.WRONG_TOKEN,
        "LARGEST_NOMINAL": protocol.LARGEST_NOMINAL,
        "HEADER_BYTES": protocol.HEADER_BYTES,
        "HEADER_AT": {name: header.fields[name][1] for name, _ in protocol.HEADER} if header.fields else {},
        "POINTS": protocol.POINTS,
        "NOMINAL": protocol.NOMINAL,
        "SURFACE_POINTS": protocol.SURFACE_POINTS,
        "NOMINAL_SURFACE": protocol.NOMINAL_SURFACE,
        "CLOSED": protocol.CLOSED,
        **{name: getattr(extremes, name) for name in columns},
        **{verdict.name: int(verdict) for verdict in Verdict},
        "WORDS_OF_VERDICTS": protocol.WORDS_OF_VERDICTS,
        "POSE_MOVES": words.POSE_MOVES,
        "SURFACE_COLOURS": colour_map.NAMED,
    }


def _constant(value: Any) -> str:
    """A constant on one line, or a line for each of many names."""
    return json.dumps(value, indent=2 if isinstance(value, Mapping) and len(value) > _MOST_ON_A_LINE else None)


def _unions() -> dict[str, Any]:
    return {"Message": protocol.Message, "Command": protocol.Command}


def _literal(value: Any) -> str:
    """The type that has this value alone."""
    if isinstance(value, Mapping):
        return "{ " + "; ".join(f"readonly {name}: {_literal(one)}" for name, one in value.items()) + " }"
    return json.dumps(value)


def _collect(record: type, seen: dict[type, None]) -> None:
    """Add a record and every record in its fields, those it needs first."""
    for hint in get_type_hints(record).values():
        for part in _parts(hint):
            _collect(part, seen)
    seen.setdefault(record)


def _parts(hint: Any) -> Iterator[type]:
    if is_dataclass(hint) and isinstance(hint, type):
        yield hint
    elif get_origin(hint) is not Literal:
        for argument in get_args(hint):
            yield from _parts(argument)


def _interface(record: type) -> str:
    hints = get_type_hints(record)
    optional = {field.name: "?" if field.default is None else "" for field in fields(record)}
    lines = [f"  readonly {name}{mark}: {_type(hints[name])};" for name, mark in optional.items()]
    description = " ".join((record.__doc__ or "").split())
    return "\n".join(["", f"/** {description} */", f"export interface {record.__name__} {{", *lines, "}", ""])


def _type(hint: Any) -> str:
    """How TypeScript writes a type of the protocol."""
    origin, arguments = get_origin(hint), get_args(hint)
    if hint in _WORDS:
        return _WORDS[hint]
    if is_dataclass(hint) and isinstance(hint, type):
        return hint.__name__
    if origin is Literal:
        return " | ".join(json.dumps(value) for value in arguments)
    if origin in (Union, UnionType):
        return " | ".join(_type(argument) for argument in arguments)
    if origin is tuple and arguments[-1] is Ellipsis:
        return f"readonly {_bracketed(arguments[0])}[]"
    if origin is tuple:
        return f"readonly [{', '.join(_type(argument) for argument in arguments)}]"
    if isinstance(origin, type) and issubclass(origin, Mapping):
        return f"{{ readonly [key: string]: {_type(arguments[1])} }}"
    raise TypeError(f"the protocol holds a type that is not known here: {hint!r}")


def _bracketed(hint: Any) -> str:
    name = _type(hint)
    return f"({name})" if " " in name else name


if __name__ == "__main__":
    write_files(Path(__file__).with_name("static"))
