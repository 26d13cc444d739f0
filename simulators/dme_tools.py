"""The tools of a simulated coordinate measuring machine, and their properties by the names that I++ DME gives them."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

from simulators.dme_language import Argument, Call, Refused, spelled

_BLOCKS: Mapping[str, Mapping[str, tuple[float, float, float]]] = MappingProxyType(  # least, greatest, default
    {
        "GoToPar": {"Speed": (1.0, 500.0, 20.0), "Accel": (1.0, 2000.0, 100.0)},
        "PtMeasPar": {
            "Speed": (0.1, 500.0, 20.0),
            "Accel": (1.0, 2000.0, 100.0),
            "Approach": (0.0, 100.0, 10.0),
            "Search": (0.0, 100.0, 10.0),
            "Retract": (-1.0, 100.0, 10.0),
        },
        "ScanPar": {"Speed": (0.1, 500.0, 20.0), "Accel": (1.0, 2000.0, 100.0)},
    }
)
_VOLUME = "OBB,20,20,20,10,10,10,1,0,0,0,1,0,0,0,1"  # of the probe, as a box
_SUBVALUES = ("Min", "Max", "Def", "Act")


@dataclass(slots=True)
class Tool:
    """One tool: its tip, and how it moves. `measures` says that there is a probe on it."""

    name: str
    radius_mm: float = 0.0
    measures: bool = False
    actual: dict[tuple[str, str], float] = field(default_factory=dict)

    def value(self, block: str, name: str, kind: str = "Act") -> float:
        """A property's value, or its least, greatest or default one."""
        least, greatest, default = _BLOCKS[block][name]
        return {"Min": least, "Max": greatest, "Def": default, "Act": self.actual.get((block, name), default)}[kind]


def answer(tool: Tool, prefix: str, asked: Argument) -> str:
    """The answer to one question for a property. Raises Refused."""
    block, name, kind, arguments = _property_of(asked, prefix)
    if arguments:
        raise Refused(509)
    told = f"{asked.name}" if isinstance(asked, Call) else ""
    if not block:
        values = {
            "Name": f'"{tool.name}"',
            "Id": f'"{tool.name}Id"',
            "AvrRadius": spelled(tool.radius_mm),
            "Alignment": "0, 1, 0",
            "CollisionVolume": _VOLUME,
        }
        if name == "Alignment" and prefix == "FoundTool":
            raise Refused(502)
        if name not in values:
            raise Refused(509)
        return f"{told}({values[name]})"
    _require_probe(tool, block)
    return f"{told}({spelled(tool.value(block, name, kind))})"


def change(tool: Tool, prefix: str, asked: Argument) -> None:
    """Set a property. Raises Refused; of a value out of range nothing is set."""
    block, name, kind, arguments = _property_of(asked, prefix)
    if not arguments:
        raise Refused(502)
    if not block or kind != "Act" or len(arguments) != 1 or not isinstance(arguments[0], float):
        raise Refused(509)
    _require_probe(tool, block)
    if not tool.value(block, name, "Min") <= arguments[0] <= tool.value(block, name, "Max"):
        raise Refused(504)
    tool.actual[block, name] = arguments[0]


def _require_probe(tool: Tool, block: str) -> None:
    if block != "GoToPar" and not tool.measures:
        raise Refused(507)


def _property_of(asked: Argument, prefix: str) -> tuple[str, str, str, tuple[Argument, ...]]:
    """Block, name and subvalue of a property `prefix.Block.Name.Sub`, or `prefix.Name` without a block; and what stands in its brackets."""
    if not isinstance(asked, Call):
        raise Refused(502)
    first, *parts = asked.name.split(".")
    if first != prefix:
        raise Refused(509)
    if len(parts) == 1 and parts[0] not in _BLOCKS:
        return "", parts[0], "Act", asked.arguments
    if len(parts) not in (2, 3):
        raise Refused(502)
    block, name, *kind = parts
    if block not in _BLOCKS or name not in _BLOCKS[block] or (kind and kind[0] not in _SUBVALUES):
        raise Refused(509)
    return block, name, kind[0] if kind else "Act", asked.arguments
