"""Modbus devices as data: a map says which registers hold what, and how they are to be read. Reading the map's text is done elsewhere.

Every field says in its description what it means, as do the tables of the names that a block may hold; docs/register-map.md is
written from them.
"""

import math
import re
from binascii import crc_hqx
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from typing import Annotated, Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    GetJsonSchemaHandler,
    ValidationError,
    field_validator,
    model_validator,
)
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema, PydanticCustomError

KEY = "[key]"  # how pydantic marks a place that is a key and no value
MOST_REGISTERS = 125  # that one answer can carry
MOST_FIFO = 31
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
MEASURED = ("time", "x", "y", "z")  # every other field counts or marks
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


def _whole(given: object) -> object:
    """Read whole numbers as YAML writes them, hexadecimal ones too, and refuse truth values, which pydantic takes for 0 and 1."""
    if isinstance(given, bool):
        raise ValueError("a whole number, not true or false")
    if isinstance(given, str):
        with suppress(ValueError):
            return int(given, 0)
    return given


def _number(given: object) -> object:
    if isinstance(given, bool):
        raise ValueError("a number, not true or false")
    return given


Whole = Annotated[int, BeforeValidator(_whole)]
Number = Annotated[float, BeforeValidator(_number)]


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
            raise ValueError("a factor that is not 0, nor so close to it that every value is the same")
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

    @classmethod
    def __get_pydantic_json_schema__(cls, schema: CoreSchema, handler: GetJsonSchemaHandler) -> JsonSchemaValue:
        """Describe every kind of block as a block: the kinds differ in the names of their fields only."""
        return handler(schema if cls is Block else Block.__pydantic_core_schema__)

    @model_validator(mode="after")
    def _refuse_what_does_not_fit(self) -> "Block":
        if self.size > MOST_REGISTERS:
            raise ValueError(f"at most {MOST_REGISTERS} registers in one entry, which is what one answer carries, not {self.size}")
        if self.at + self.size * self.entries > 65536:
            raise ValueError(f"an end by register 65535, after which {self.entries} entries of {self.size} registers from {self.at} on end")
        for name, field in self.fields.items():
            if field.type.startswith("float") and name not in MEASURED:
                raise ValueError(f"whole numbers for the field {name}, which counts or marks, not {field.type}")
        return self


def _refuse_other_names(allowed: Mapping[str, str], name: str) -> str:
    if name not in allowed:
        raise PydanticCustomError("unknown_name", "one of {allowed}", {"allowed": ", ".join(allowed)})
    return name


_NAMES = "the numbers in the block by their names"


class StatusBlock(Block):
    """What is read besides the points."""

    fields: dict[Annotated[str, AfterValidator(partial(_refuse_other_names, STATUS_FIELDS))], RegisterField] = Field(
        min_length=1, description=_NAMES
    )


class PopBlock(Block):
    """What takes the oldest message out of a queue."""

    fields: dict[Annotated[str, AfterValidator(partial(_refuse_other_names, POP_FIELDS))], RegisterField] = Field(
        min_length=1, description=_NAMES
    )


class PointsBlock(Block):
    """The points, or the rest of a message."""

    fields: dict[Annotated[str, AfterValidator(partial(_refuse_other_names, POINTS_FIELDS))], RegisterField] = Field(
        min_length=1, description=_NAMES
    )


class RegisterMap(_Part):
    """One kind of Modbus device."""

    device: str = Field(min_length=1, description="the name of the device, for messages and results")
    source: str = Field(default="", description="where the addresses come from, like a manual and its section")
    table: Literal["holding", "input"] = Field(default="holding", description="holding registers (function 3), or input registers (4)")
    word_order: Literal["high-first", "low-first"] = Field(
        default="high-first", description="which register of a number of 32 or 64 bits comes first"
    )
    pattern: Literal["latest", "ring", "queue", "fifo"] = Field(description="how the device hands its points over")
    status: StatusBlock | None = Field(default=None, description="what is read besides the points; a ring needs it")
    pop: PopBlock | None = Field(default=None, description="what takes the oldest message out of a queue")
    points: PointsBlock = Field(description="the points")

    @property
    def counts_points(self) -> bool:
        """Whether the points carry a counter, without which a loss does not show."""
        return "sequence" in self.points.fields or (self.pop is not None and "sequence" in self.pop.fields)

    @property
    def axes(self) -> tuple[str, ...]:
        """Which of x, y and z the registers tell; what they do not tell is taken as 0."""
        named = set(self.points.fields) | (set(self.pop.fields) if self.pop else set())
        return tuple(axis for axis in ("x", "y", "z") if axis in named)

    @model_validator(mode="after")
    def _refuse_what_is_missing(self) -> "RegisterMap":
        named = set(self.points.fields) | (set(self.pop.fields) if self.pop else set())
        if not self.axes:
            raise ValueError("at least one of x, y and z among the fields of points")
        if self.pattern == "ring" and (self.status is None or "written" not in self.status.fields):
            raise ValueError("the field written in status, which a ring needs")
        if (self.pattern == "queue") != (self.pop is not None):
            raise ValueError("a block pop for a queue, and for no other pattern")
        if self.pattern != "latest" and "sequence" not in named:
            raise ValueError(f"a field sequence, without which a {self.pattern} would not show a loss")
        if self.pattern == "fifo" and self.points.size > MOST_FIFO:
            raise ValueError(f"at most {MOST_FIFO} registers in one entry, which is what function 24 hands over, not {self.points.size}")
        return self


def register_map(tree: Mapping[str, Any]) -> RegisterMap:
    """Make a map of its content. Raises ValueError naming the key, what is expected and what was found."""
    try:
        return RegisterMap.model_validate(tree)
    except ValidationError as error:
        first = error.errors()[0]
        key = ".".join(str(part) for part in first["loc"] if part != KEY) or "map"
        expected = re.sub(r"^(Value error, |Input should be )", "", first["msg"])
        raise ValueError(f"{key}: expected {expected}; found {first['input']!r:.80}") from error


@dataclass(frozen=True, slots=True)
class Entries:
    """The fields of m consecutive entries of a block.

    values   (m,) of each field, by its name
    sound    (m,) False where the checksum of an entry is wrong
    """

    values: dict[str, NDArray[np.generic]]
    sound: NDArray[np.bool_]

    def head(self, count: int) -> "Entries":
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
