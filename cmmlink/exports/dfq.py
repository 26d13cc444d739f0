"""Q-DAS AQDEF (.dfq), the ASCII transfer format of statistics programs, keyed by K-fields.

A run is one value in each of a few characteristics. A file grows by whole runs: one of the same part with the same characteristics and
limits adds a value to each, another one adds a part of its own, whose characteristics are numbered on. The file is written anew beside the
old one and takes its place when it is whole.

The K-fields, with their greatest lengths, are those of the transfer format: 1001 number and 1002 name of the part, 1082 machine; 2001
number and 2002 name of the characteristic, 2004 kind, 2022 decimals, 2101 nominal, 2110 and 2111 limits, 2120 and 2121 kinds of limits
(0 none, 1 limit, 2 natural), 2142 unit; 0001 value, 0002 attribute, 0004 time, 0009 text, 0014 identity of the part.
"""

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from datetime import datetime
from pathlib import Path
from typing import Any

from cmmlink.errors import PlanError
from cmmlink.exports.measured_part import MeasuredPart
from cmmlink.result_files import NewFiles
from cmmlink.words import printable

_VALID, _NOT_VALID, _MISSING = 0, 255, 256  # of K0002: only the first counts in statistics
_LIMIT, _NATURAL, _NONE = "1", "2", "0"
_MOST_LETTERS = {"K1001": 30, "K1002": 80, "K1082": 40, "K2001": 20, "K2002": 80, "K2142": 20, "K0009": 255, "K0014": 40}
_LINE = re.compile(r"(K\d{4})/(\d+) (.*)")
_MARK = "\ufeff"  # by which programs know UTF-8


@dataclass(slots=True)
class _Block:
    """A part of a file: what it is, its characteristics, and the values of the runs that were added to it.

    head   : the K-fields of the part; characteristics : those of each characteristic; runs : those of each value of each run
    """

    head: list[tuple[str, str]] = field(default_factory=list)
    characteristics: list[list[tuple[str, str]]] = field(default_factory=list)
    runs: list[list[list[tuple[str, str]]]] = field(default_factory=list)


@dataclass(frozen=True, slots=True)
class _Asked:
    """One column of a statistics program: a number with its limits, None where there is none."""

    name: str
    value: float | None
    nominal: float | None
    lower: float | None
    upper: float | None
    unit: str
    natural: bool = False


def write_dfq(parts: Sequence[MeasuredPart], files: NewFiles, stem: str) -> None:
    """Write STEM.dfq, with the runs that it has already before the new ones. Raises PlanError where it is none that cmmlink wrote."""
    name = f"{stem}.dfq"
    blocks = _read(files.standing(name))
    for part in parts:
        _add(blocks, _block_of(part))
    text = "".join(f"{line}\r\n" for line in _lines(blocks))
    files(name).write_bytes((text if text.isascii() else _MARK + text).encode())


def _add(blocks: list[_Block], new: _Block) -> None:
    """Add a run to the part that it is of, or as a part of its own; one that is there already is not added again."""
    same = next((block for block in blocks if (block.head, block.characteristics) == (new.head, new.characteristics)), None)
    if same is None:
        blocks.append(new)
    else:
        same.runs += [run for run in new.runs if run not in same.runs]


def _block_of(part: MeasuredPart) -> _Block:
    asked = list(_asked(part))
    machine = "simulated device: no real part" if part.identity["simulated"] else part.text("device")
    head = [("K1001", part.text("part")), ("K1002", part.text("part")), ("K1082", machine)]
    return _Block(
        _fitted(head),
        [_fitted(_described(one, place)) for place, one in enumerate(asked, start=1)],
        [[_fitted(_measured(part, one)) for one in asked]],
    )


def _asked(part: MeasuredPart) -> Iterator[_Asked]:
    """The columns of a part: every characteristic, and of what judged the points as they arrived the extremes as well."""
    varying = {one.name for one in part.plan.characteristics if one.type == "line-profile" and one.zone.stations_mm is not None}
    for section in part.sections:
        found, at = section.document, "" if section.height_mm is None else f" at {section.height_mm:.3f}"
        for one in found["characteristics"]:
            yield _column(one, at, one["name"] in varying)
        zone = found["tolerance"]
        if zone is not None:
            for key, words in (("max_deviation_mm", "largest deviation"), ("min_deviation_mm", "smallest deviation")):
                yield _Asked(words + at, found[key], 0.0, zone["lower_mm"], zone["upper_mm"], "mm")
    yield from (_column(one, "", False) for one in part.of_stack)


def _column(one: Mapping[str, Any], at: str, varying: bool) -> _Asked:
    """A characteristic: of a profile the width that is used, of a zone that varies the share of it, else the number itself."""
    name, unit = one["name"] + at, "" if one["unit"] == "1" else one["unit"]
    if varying:
        return _Asked(f"{name}: share of its zone", one["consumption"], 0.0, 0.0, 1.0, "", natural=True)
    if one["type"] == "line-profile":
        lower, upper = one["lower"], one["upper"]
        width = None if lower is None or upper is None else upper - lower
        return _Asked(name, one["value"], 0.0, 0.0, width, unit, natural=True)
    nominal = one["nominal"]
    lower, upper = (None if nominal is None or limit is None else nominal + limit for limit in (one["lower"], one["upper"]))
    return _Asked(name, one["value"], nominal, lower, upper, unit)


def _described(one: _Asked, place: int) -> Iterator[tuple[str, str]]:
    most, own = _MOST_LETTERS["K2001"], f"~{place}"  # names that are too long would be the same one when cut
    number = one.name if len(one.name) <= most else one.name[: most - len(own)] + own
    yield from (("K2001", number), ("K2002", one.name), ("K2004", "0"), ("K2022", "5"))
    numbers = (("K2101", one.nominal), ("K2110", one.lower), ("K2111", one.upper))
    yield from ((key, _decimal(number)) for key, number in numbers if number is not None)
    yield "K2120", _NONE if one.lower is None else _NATURAL if one.natural else _LIMIT
    yield "K2121", _NONE if one.upper is None else _LIMIT
    if one.unit:
        yield "K2142", one.unit


def _measured(part: MeasuredPart, one: _Asked) -> Iterator[tuple[str, str]]:
    attribute = _MISSING if one.value is None else _VALID if part.text("ending") == "complete" else _NOT_VALID
    began = datetime.fromisoformat(part.text("measured_at")).astimezone()
    recorded = f"run {part.run}, chain sha256 {part.chain_sha256}" if part.run else "not recorded"
    told = [part.text("verdict"), part.text("ending"), recorded, part.text("operator") and f"operator {part.text('operator')}"]
    yield "K0001", _decimal(one.value or 0.0)
    yield "K0002", str(attribute)
    yield "K0004", f"{began:%d.%m.%Y/%H:%M:%S}"
    yield "K0009", ", ".join(filter(None, told))
    yield "K0014", part.text("serial_number") or part.run or "none"


def _fitted(fields: Sequence[tuple[str, str]] | Iterator[tuple[str, str]]) -> list[tuple[str, str]]:
    """The fields with their text on one line, and no longer than the format allows."""
    return [(key, " ".join(printable(text).split())[: _MOST_LETTERS.get(key)].rstrip() or "-") for key, text in fields]


def _decimal(number: float) -> str:
    """A number without an exponent, with a digit behind the point."""
    text = f"{number:.9f}".rstrip("0")
    return f"{text}0" if text.endswith(".") else text


def _lines(blocks: Sequence[_Block]) -> Iterator[str]:
    """The file: the number of its characteristics, then each part with its characteristics and their values."""
    yield f"K0100 {sum(len(block.characteristics) for block in blocks)}"
    before = 0
    for number, block in enumerate(blocks, start=1):
        yield from (f"{key}/{number} {text}" for key, text in block.head)
        numbered = list(enumerate(block.characteristics, start=before + 1))
        yield from (f"{key}/{place} {text}" for place, fields in numbered for key, text in fields)
        for run in block.runs:
            yield from (f"{key}/{place} {text}" for (place, _), fields in zip(numbered, run, strict=True) for key, text in fields)
        before += len(block.characteristics)


def _read(path: Path | None) -> list[_Block]:
    """What a file holds that this wrote; nothing where there is none. Raises PlanError for any other."""
    if path is None:
        return []
    try:
        lines = path.read_bytes().decode("utf-8-sig").splitlines()
        blocks = _parsed(lines)
        whole = list(_lines(blocks)) == lines
    except (ValueError, IndexError):
        whole = False
    if not whole:
        raise PlanError(f"{path}: this is no file of runs that cmmlink wrote, so none can be added to it; choose another one with --out")
    return blocks


def _parsed(lines: Sequence[str]) -> list[_Block]:
    blocks: list[_Block] = []
    before = 0
    for line in lines[1:]:
        match = _LINE.fullmatch(line)
        if match is None:
            raise ValueError(line)
        key, number, text = match[1], int(match[2]), match[3]
        if key == "K1001":
            before += len(blocks[-1].characteristics) if blocks else 0
            blocks.append(_Block())
        block, place = blocks[-1], number - before - 1
        if key.startswith("K1"):
            block.head.append((key, text))
        elif key.startswith("K2"):
            if key == "K2001":
                block.characteristics.append([])
            block.characteristics[place].append((key, text))
        else:
            if key == "K0001" and place == 0:
                block.runs.append([[] for _ in block.characteristics])
            block.runs[-1][place].append((key, text))
    return blocks
