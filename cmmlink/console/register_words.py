"""What station and page say to one another of the registers of a Modbus device, which somebody looks at to make a map of them."""

from dataclasses import dataclass
from typing import Literal


@dataclass(frozen=True, slots=True)
class RegisterRow:
    """One register: what it holds in hexadecimal, and the number that begins there in every column; all empty where there is none."""

    at: int
    hex: str
    values: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class RegisterTable:
    """The registers that are read, or were read last. `columns` are type and word order, the latter empty for 16 bits."""

    state: Literal["none", "reading", "over", "failed"]
    message: str
    address: str
    table: str
    columns: tuple[tuple[str, str], ...]
    rows: tuple[RegisterRow, ...]
    type: Literal["registers"] = "registers"


@dataclass(frozen=True, slots=True)
class LookAtRegisters:
    """Read registers of a Modbus device over and over, until it is aborted."""

    address: str
    table: str
    first: int
    count: int
    device_id: int
    baud_rate: int
    parity: str
    do: Literal["look at registers"] = "look at registers"


@dataclass(frozen=True, slots=True)
class KeepMap:
    """Save a register map beside the plans. The answer is a `MapSaved` as JSON.

    x, y, z, sequence : register and type, like 41:float32; empty where the device has none
    scale   : mm per unit of coordinates that are whole numbers
    replace : a map of this name may be written over
    """

    name: str
    device: str
    table: str
    word_order: str
    x: str
    y: str
    z: str
    sequence: str
    scale: str
    replace: bool
    do: Literal["keep map"] = "keep map"


@dataclass(frozen=True, slots=True)
class MapSaved:
    """What came of a map: its name as a plan beside it calls it, else why there is none. `taken`: a map of this name is there."""

    name: str = ""
    problem: str = ""
    taken: bool = False
