"""Modbus devices as data: a YAML map says which registers hold what, and how they are to be read.

Every field says in its description what it means, as do the tables of the names that a block may hold; docs/register-map.md is
written from them.
"""

import math
from binascii import crc_hqx
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
import yaml
from numpy.typing import NDArray
from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, ValidationError, field_validator, model_validator

MAPS = Path(__file__).parent / "maps"
MOST_REGISTERS = 125  # that one answer can carry
MOST_FIFO = 31
DEEPEST = 20  # collections within each other; a map needs four
NUMPY_TYPES = {
    "uint16": ">u2", "int16": ">i2", "uint32": ">u4", "int32": ">i4", "uint64": ">u8", "int64": ">i8", "float32": ">f4", "float64": ">f8"
}  # fmt: skip


PATTERNS = {
    "latest": "the points block holds one point, which is new when its sequence has changed; without a sequence every reading counts",
    "ring": "point number n lies in place n modulo entries, and `written` runs ahead; points that were overrun are lost, and counted",
    "queue": "reading the block `pop` takes the oldest message out of the device's queue; the points block, read after it, belongs to it",
    "fifo": "function 24 at the address of the points block hands over up to 31 registers, and the device forgets them",
}
STATUS_FIELDS = {
    "magic": "a number with `equals`: any other device is refused",
    "written": "the number of points written so far; a ring needs it",
    "state": "a number with `finished`: at that value the scan is over",
    "announced": "the number of points that the scan is going to have; 0 says nothing",
    "sent": "the number of points taken: the sequence runs from 0 to it; without it, a ring that tells its end has sent what it wrote",
    "overflow": "not 0: the device itself lost points",
    "heartbeat": "a number that changes while the device is alive",
    "crc": "the checksum CRC-16/CCITT-FALSE over the registers before it in the block",
}
POP_FIELDS = {
    "pop": "the register whose reading takes the oldest message out of the queue",
    "queued": "the number of messages that wait",
    "overflow": "not 0: the device itself lost points",
    "sequence": "the counter of the message",
    "time": "the time of the message; seconds = scale * value",
    "x": "the coordinate x; mm = scale * value + offset",
    "y": "the coordinate y; mm = scale * value + offset",
    "z": "the coordinate z, or the distance of a distance sensor; mm = scale * value + offset",
}
POINTS_FIELDS = {
    "sequence": "the counter of the point, which wraps; gaps in it are counted as lost",
    "time": "the time of the point; seconds = scale * value; an integer wraps",
    "x": "the coordinate x; mm = scale * value + offset",
    "y": "the coordinate y; mm = scale * value + offset",
    "z": "the coordinate z, or the distance of a distance sensor; mm = scale * value + offset",
    "flags": "bits of the point; with `invalid_bits` they mark it as invalid",
    "overflow": "not 0: the device itself lost points",
    "crc": "the checksum CRC-16/CCITT-FALSE over the registers before it in the point",
}


def _refuse_truth_value(given: object) -> object:
    if isinstance(given, bool):  # pydantic takes true for 1, YAML takes yes and on for true
        raise ValueError("true or false where a number belongs")
    return given


Whole = Annotated[int, BeforeValidator(_refuse_truth_value)]
Number = Annotated[float, BeforeValidator(_refuse_truth_value)]


class _Part(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


class RegisterField(_Part):
    """One number: where it lies in its block, and what it means."""

    at: Whole = Field(ge=0, le=65535, description="the first register of the number, counted from the first register of its block")
    type: Literal["uint16", "int16", "uint32", "int32", "uint64", "int64", "float32", "float64"] = Field(
        description="how the number is stored"
    )
    scale: Number = Field(default=1.0, description="the factor from the stored number to mm, or to seconds for a time; not 0")
    offset: Number = Field(default=0.0, description="what is added after scaling")
    invalid: Whole | None = Field(default=None, description="the bit pattern that means no value, like 0x80000000")
    invalid_bits: Whole = Field(default=0, description="any of these bits set marks an invalid point")
    equals: Whole | None = Field(default=None, description="the value that the field must have; at any other the device is refused")
    finished: Whole | None = Field(default=None, description="the value that says that the scan is over")

    @field_validator("scale")
    @classmethod
    def _refuse_zero_scale(cls, scale: float) -> float:
        if scale == 0.0 or not math.isfinite(1.0 / scale):  # ticks per second are 1 / scale
            raise ValueError("a scale of 0, or too close to it, makes every value the same")
        return scale

    @property
    def registers(self) -> int:
        """The number of registers it takes."""
        return np.dtype(NUMPY_TYPES[self.type]).itemsize // 2

    def to_unit(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return scale * value + offset; a scale like 1e-5 divides by 100,000, which rounds once and not twice."""
        whole = round(1.0 / self.scale) if 0.0 < abs(self.scale) < 1.0 else 0
        exact = whole != 0 and 1.0 / whole == self.scale
        return (values / whole if exact else values * self.scale) + self.offset


class Block(_Part):
    """Registers read together."""

    at: Whole = Field(ge=0, le=65535, description="the first register of the block, counted from 0 as on the wire")
    fields: dict[str, RegisterField] = Field(min_length=1, description="the numbers in the block by their names")
    entries: Whole = Field(default=1, ge=1, description="how many points a ring holds; of the points block only")
    registers: Whole = Field(
        default=0, ge=0, le=MOST_REGISTERS, description="the size of one entry, where it is larger than its last field shows"
    )

    @property
    def size(self) -> int:
        """Registers of one entry: as said, or up to the last field."""
        return max(self.registers, *(field.at + field.registers for field in self.fields.values()), 0)

    @model_validator(mode="after")
    def _refuse_what_does_not_fit(self) -> "Block":
        if self.size > MOST_REGISTERS:
            raise ValueError(f"{self.size} registers; one answer carries at most {MOST_REGISTERS}")
        if self.at + self.size * self.entries > 65536:
            raise ValueError(f"{self.entries} entries of {self.size} registers from {self.at} end after register 65535")
        return self


class RegisterMap(_Part):
    """One kind of Modbus device."""

    device: str = Field(min_length=1, description="the name of the device, for messages and results")
    source: str = Field(default="", description="where the addresses come from, like a manual and its section")
    table: Literal["holding", "input"] = Field(default="holding", description="holding registers (function 3), or input registers (4)")
    word_order: Literal["high-first", "low-first"] = Field(
        default="high-first", description="which register of a number of 32 or 64 bits comes first"
    )
    pattern: Literal["latest", "ring", "queue", "fifo"] = Field(description="how the device hands its points over")
    status: Block | None = Field(default=None, description="what is read besides the points; a ring needs it")
    pop: Block | None = Field(default=None, description="what takes the oldest message out of a queue")
    points: Block = Field(description="the points")

    @model_validator(mode="after")
    def _refuse_what_is_missing(self) -> "RegisterMap":
        _refuse_unknown_fields(self.status, STATUS_FIELDS, "status")
        _refuse_unknown_fields(self.pop, POP_FIELDS, "pop")
        _refuse_unknown_fields(self.points, POINTS_FIELDS, "points")
        named = set(self.points.fields) | (set(self.pop.fields) if self.pop else set())
        if not named & {"x", "y", "z"}:
            raise ValueError("points: none of x, y, z is named")
        if self.pattern == "ring" and (self.status is None or "written" not in self.status.fields):
            raise ValueError("a ring needs the field written in status")
        if (self.pattern == "queue") != (self.pop is not None):
            raise ValueError("a queue, and only a queue, needs a block pop")
        if self.pattern != "latest" and "sequence" not in named:
            raise ValueError(f"a {self.pattern} needs a field sequence, or a loss would not show")
        if self.pattern == "fifo" and self.points.size > MOST_FIFO:
            raise ValueError(f"an entry of {self.points.size} registers; function 24 hands over at most {MOST_FIFO}")
        return self


def _refuse_unknown_fields(block: Block | None, names: Mapping[str, str], where: str) -> None:
    unknown = sorted(set(block.fields) - set(names)) if block else []
    if unknown:
        raise ValueError(f"{where}: field {unknown[0]!r} is none of {', '.join(sorted(names))}")


def shipped_maps() -> dict[str, Path]:
    """Files of the maps that are shipped, by their names."""
    return {file.stem: file for file in sorted(MAPS.glob("*.yaml"))}


def load_map(name: str | Path | Mapping[str, Any]) -> RegisterMap:
    """Read a map: the name of one that is shipped, any other YAML file, or its content; raise `ValueError` naming file, line and key.

    A shipped name as text is always the shipped map, whatever else bears that name; a `Path` is always a file.
    """
    if isinstance(name, Mapping):
        return _checked(name, "map", lambda _: "")
    path = shipped_maps().get(name, Path(name)) if isinstance(name, str) else name
    text = _text_of(path)
    try:
        _refuse_what_no_map_needs(text, path)
    except yaml.YAMLError as error:
        raise ValueError(f"{path}: no YAML: {error}") from error
    try:
        tree = yaml.safe_load(text)
    except (yaml.YAMLError, ValueError) as error:  # what looks like a date and is none is a ValueError of the reader's
        raise ValueError(f"{path}: no YAML: {error}") from error
    return _checked(tree, str(path), lambda keys: f", line {_line_of(text, keys)}")


def _text_of(path: Path) -> str:
    try:
        data = path.read_bytes()
    except OSError as error:
        raise ValueError(f"{path}: {error.strerror or error}; give a YAML file or one of {', '.join(shipped_maps())}") from error
    try:
        text = data.decode("utf-16" if data[:2] in (b"\xff\xfe", b"\xfe\xff") else "utf-8-sig")
    except UnicodeDecodeError as error:
        raise ValueError(f"{path}: byte {error.start + 1} is not UTF-8; save the map as UTF-8") from error
    if "\0" in text:  # every other byte of UTF-16 without its mark
        raise ValueError(f"{path}: not a text in UTF-8; save the map as UTF-8")
    return text


def _refuse_what_no_map_needs(text: str, path: Path) -> None:
    """Refuse deep nesting, which would exhaust the stack of the reader proper, and tags, at which it may fail in any way."""
    depth = 0
    for event in yaml.parse(text, Loader=yaml.SafeLoader):
        depth += isinstance(event, yaml.CollectionStartEvent) - isinstance(event, yaml.CollectionEndEvent)
        where = f"{path}, line {event.start_mark.line + 1 if event.start_mark else 1}"
        if depth > DEEPEST:
            raise ValueError(f"{where}: nested more than {DEEPEST} deep")
        if getattr(event, "tag", None) not in (None, "!"):
            raise ValueError(f"{where}: the tag {getattr(event, 'tag', '')} is not supported; write the plain value")


def _checked(tree: object, file: str, line_of: Callable[[list[str]], str]) -> RegisterMap:
    try:
        return RegisterMap.model_validate(tree)
    except ValidationError as error:
        first = error.errors()[0]
        keys = [str(key) for key in first["loc"]]
        where = line_of(keys) if keys else ""
        raise ValueError(f"{file}{where}: {'.'.join(keys) or 'map'}: {first['msg']}; found {first['input']!r:.80}") from error


def _line_of(text: str, keys: Iterable[str]) -> int:
    """Return the line on which the innermost of the nested keys that exists stands."""
    node, line = yaml.compose(text, Loader=yaml.SafeLoader), 1
    for key in keys:
        if not isinstance(node, yaml.MappingNode):
            break
        for name, value in node.value:
            if name.value == key:
                node, line = value, name.start_mark.line + 1
                break
        else:
            break
    return line


@dataclass(frozen=True, slots=True)
class Entries:
    """The fields of m consecutive entries of a block.

    values   (m,) of each field, by its name
    sound    (m,) False where the checksum of an entry is wrong
    """

    values: dict[str, NDArray[np.generic]]
    sound: NDArray[np.bool_]

    def first(self, count: int) -> "Entries":
        """Return the first `count` entries."""
        return Entries({name: column[:count] for name, column in self.values.items()}, self.sound[:count])


def entries_of(block: Block, word_order: str, registers: bytes) -> Entries:
    """Take the big-endian registers of whole entries apart."""
    words = np.frombuffer(registers, dtype=">u2").reshape(-1, block.size)
    values: dict[str, NDArray[np.generic]] = {}
    for name, field in block.fields.items():
        part = words[:, field.at : field.at + field.registers]
        ordered = part if word_order == "high-first" else part[:, ::-1]
        values[name] = np.ascontiguousarray(ordered).view(NUMPY_TYPES[field.type])[:, 0]
    sound = np.ones(len(words), dtype=np.bool_)
    if "crc" in block.fields:
        checked = 2 * block.fields["crc"].at
        size = 2 * block.size
        found = [crc_hqx(registers[at : at + checked], 0xFFFF) for at in range(0, len(registers), size)]
        sound = values["crc"] == np.array(found)
    return Entries(values, sound)


def equals_pattern(column: NDArray[np.generic], pattern: int, kind: str) -> NDArray[np.bool_]:
    """Compare bit patterns, so that 0x80000000 is found in an int32 too."""
    raw = column.view(NUMPY_TYPES[kind].replace("i", "u").replace("f", "u"))
    return np.asarray(raw == pattern)
