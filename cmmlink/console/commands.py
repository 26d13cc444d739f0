"""The commands of a page: read from JSON and checked, and what each asks of the station."""

import json
from collections.abc import Callable, Mapping
from dataclasses import fields
from datetime import date
from typing import Any, NamedTuple, get_args, get_type_hints

from cmmlink.console.protocol import Acknowledge, Choose, Command, Enter, ImportSurface, OfRun, Plain, Search, json_of
from cmmlink.console.refused import Refused
from cmmlink.console.register_words import KeepMap, LookAtRegisters
from cmmlink.console.station import Station
from cmmlink.record import RunSearch, VerdictSought

_LONGEST_WORD = 40  # of a command's name in an answer
_WORDS = {str: "text", int: "whole number", bool: "yes or no"}
_RECORDS = {word: record for record in get_args(Command) for word in get_args(get_type_hints(record)["do"])}


class Received(NamedTuple):
    """A command as a page sent it; `number` and `do` go back with the answer."""

    number: int | None
    do: str
    document: Mapping[str, Any]

    def command(self) -> Command:
        """The command, checked. Raises Refused."""
        record = _RECORDS.get(self.do)
        if record is None:
            raise Refused(f"there is no command {self.do!r}")
        hints = get_type_hints(record)
        names = [field.name for field in fields(record) if field.name != "do"]
        command: Command = record(**{name: _checked_value(self.document, name, hints[name]) for name in names}, do=self.do)
        return command


def read_json(text: str) -> dict[str, Any]:
    """A JSON object; an empty one where the text is none."""
    try:
        value = json.loads(text)
    except (ValueError, RecursionError):
        return {}
    return value if isinstance(value, dict) else {}


def receive(text: str) -> Received:
    """What a page sent, whatever it was."""
    document = read_json(text)
    number, do = document.get("number"), document.get("do")
    return Received(number if isinstance(number, int) else None, str(do)[:_LONGEST_WORD], document)


def action_of(command: Command, station: Station) -> Callable[[], str] | None:
    """What a command of the page in control asks of the station; None for what any page may ask of the server."""
    actions: Mapping[str, Callable[[], str]] = {
        "start": station.start,
        "start again": lambda: station.start(again=True),
        "end": station.end_scan,
        "abort": station.abort,
        "test": station.test_device,
        "demo": station.run_demo,
    }
    match command:
        case Choose(plan):
            return lambda: station.choose(plan)
        case Enter(serial_number, operator, address):
            return lambda: station.enter(serial_number, operator, address)
        case Acknowledge(alarm):
            return lambda: station.acknowledge(alarm)
        case LookAtRegisters():
            return lambda: station.look_at_registers(command)
        case KeepMap():
            return lambda: json_of(station.keep_map(command))
        case ImportSurface(plan):
            return lambda: station.import_ct(plan)
        case OfRun(run, "replay"):
            return lambda: station.replay(run)
        case Plain(do):
            return actions.get(do)
    return None


def search_of(sought: Search) -> RunSearch | None:
    """What a page looks for; None where that is everything. Raises Refused."""
    verdict = next((name for name in get_args(VerdictSought) if name == sought.verdict), None)
    if verdict is None:
        raise Refused(f"there is no verdict {sought.verdict!r}")
    days = [_day_of(text) for text in (sought.since, sought.until)]
    search = RunSearch(sought.part, sought.serial_number, sought.operator, sought.plan, verdict, *days)
    return None if search == RunSearch() else search


def _day_of(text: str) -> date | None:
    try:
        return date.fromisoformat(text) if text else None
    except ValueError:
        raise Refused(f"{text!r} is no day; expected one like 2026-03-31") from None


def _checked_value(document: Mapping[str, Any], key: str, hint: Any) -> Any:
    value = document.get(key)
    allowed = get_args(hint) or (hint,)
    if type(value) in allowed:
        return value
    raise Refused(f"the command needs a {_WORDS[allowed[0]]} {key!r}")
