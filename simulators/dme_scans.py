"""How a simulated coordinate measuring machine measures: single points, and scans along lines, circles, known and unknown curves."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from simulators.dme_language import Call, Refused, Word, axis_values, numbers_of, spelled
from simulators.dme_part import Part
from simulators.dme_tools import Tool

Array = NDArray[np.float64]
_MEASURED_AXES = frozenset({"X", "Y", "Z", "IJK", "R", "Tool.A", "Tool.B", "Tool.C"})
_MOST_ROUNDS = 20  # of a scan whose end is not reached
_DECIMALS = 6


@dataclass(frozen=True, slots=True)
class Step:
    """A piece of a command: how long it takes, and the data that it brings. `points` are those of a scan that the data hold."""

    seconds: float
    data: str = ""
    points: int = 0


class Machine(Protocol):
    """What measuring needs of the machine."""

    part: Part
    tool: Tool
    density_mm: float
    scan_columns: list[str]
    point_columns: list[str]
    points_a_line: int
    point_s: float
    place_mm: Array

    def move(self, target_mm: Array) -> Iterator[Step]:
        """Move the machine there."""

    def target(self, values: Mapping[str, tuple[float, ...]]) -> Array:
        """Where named axes lead; the others stay."""

    def to_machine(self, points_mm: Array) -> Array:
        """Points of the active coordinate system on the machine."""

    def from_machine(self, points_mm: Array) -> Array:
        """The way back."""

    def require_probe(self) -> None:
        """Raise Refused unless the machine can measure."""

    def require_room(self, points_mm: Array, code: int) -> None:
        """Raise Refused with this code where points of the active coordinate system lie outside the machine."""

    def quality(self) -> float:
        """The quality of the next point."""


def measure_point(machine: Machine, call: Call) -> Iterator[Step]:
    """Touch one point: PtMeas."""
    values = axis_values(call, _MEASURED_AXES)
    if not {"X", "Y", "Z"} & set(values):
        raise Refused(502)
    direction = _unit(np.array(values.get("IJK", (0.0, 0.0, 1.0))))
    machine.require_probe()
    point = machine.target(values)
    machine.require_room(machine.from_machine(point), 1008)
    approach, search = (machine.tool.value("PtMeasPar", name) for name in ("Approach", "Search"))
    yield from machine.move(point + approach * direction)
    centre = machine.part.touch(point, direction, approach, search)
    if centre is None:
        raise Refused(1006)
    yield from machine.move(centre)
    told = _values(machine, machine.from_machine(centre), direction)
    data = ", ".join(f"{name}({','.join(map(spelled, told[name]))})" for name in machine.point_columns)
    yield Step(0.0, data, points=1)
    yield from machine.move(centre + machine.tool.value("PtMeasPar", "Retract") * direction)


def scan_on_line(machine: Machine, call: Call) -> Iterator[Step]:
    """ScanOnLine(S, E, direction, StepW)."""
    told = np.array(numbers_of(call, 10))
    start, end, step = told[:3], told[3:6], told[9]
    if step <= 0:
        raise Refused(509)
    machine.require_probe()
    direction = _unit(told[6:9])
    length = float(np.linalg.norm(end - start))
    if length == 0:
        raise Refused(502)
    machine.require_room(np.array([start, end]), 504)
    share = np.append(np.arange(0.0, length, step), length)[:, None] / length
    points = machine.to_machine(start + share * (end - start))
    yield from _touch_all(machine, points, np.tile(direction, (len(points), 1)))


def scan_on_circle(machine: Machine, call: Call) -> Iterator[Step]:
    """ScanOnCircle(C, S, axis, delta, sfa, StepW)."""
    told = np.array(numbers_of(call, 12))
    machine.require_probe()
    centre, start, axis, (sweep, surface, step) = told[:3], told[3:6], _unit(told[6:9]), told[9:]
    arm = start - centre
    if np.linalg.norm(arm) == 0 or abs(arm @ axis) > 1e-3 * np.linalg.norm(arm):
        raise Refused(502)
    if step <= 0:
        raise Refused(509)
    machine.require_room(centre + np.linalg.norm(arm) * np.array([[1.0], [-1.0]]), 504)
    angles = np.radians(np.sign(sweep) * np.append(np.arange(0.0, abs(sweep), step), abs(sweep)))[:, None]
    arms = np.cos(angles) * arm + np.sin(angles) * np.cross(axis, arm)
    outward = arms / np.linalg.norm(arm)
    turned = np.radians(surface)
    directions = np.cos(turned) * outward + np.sin(turned) * axis
    yield from _touch_all(machine, machine.to_machine(centre + arms), directions)


def scan_on_curve(machine: Machine, call: Call) -> Iterator[Step]:
    """ScanOnCurve(Closed(c), Format(X(), Y(), Z(), IJK(), tag, ...), Data(...))."""
    parts = {one.name: one.arguments for one in call.arguments if isinstance(one, Call)}
    if len(call.arguments) != 3 or set(parts) != {"Closed", "Format", "Data"}:
        raise Refused(502)
    width = sum(3 if isinstance(one, Call) and one.name == "IJK" else 1 for one in parts["Format"])
    data = [value for value in parts["Data"] if isinstance(value, float)]
    names = [one.name if isinstance(one, Call) else one.value for one in parts["Format"] if isinstance(one, Call | Word)]
    if names[:5] != ["X", "Y", "Z", "IJK", "tag"] or not data or len(data) != len(parts["Data"]) or len(data) % width:
        raise Refused(502)
    rows = np.array(data).reshape(-1, width)
    if len(rows) < 2 or not np.linalg.norm(rows[:, 3:6], axis=1).all():
        raise Refused(1010 if len(rows) >= 2 else 502)
    machine.require_probe()
    machine.require_room(rows[:, :3], 504)
    rows = rows[rows[:, 6] > 0]
    closed = parts["Closed"] == (1.0,)
    yield from _follow(machine, machine.to_machine(rows[:, :3]), _unit(rows[0, 3:6]), machine.density_mm, closed=closed)


def scan_in_plane(machine: Machine, call: Call) -> Iterator[Step]:
    """ScanInPlaneEndIsSphere(S, direction, N, D, StepW, E, Dia, n, direction), or the older form without N and n."""
    told = np.array(numbers_of(call, 17, 21))
    newer = len(told) == 21
    start, towards = told[:3], told[9:12] if newer else told[6:9]
    step, end, diameter = (told[12], told[13:16], told[16]) if newer else (told[9], told[10:13], told[13])
    times = told[17] if newer else 1.0
    if step <= 0 or diameter <= 0 or times < 1 or times != int(times):
        raise Refused(509)
    machine.require_probe()
    direction, _ = _unit(told[3:6]), _unit(told[-3:])
    if np.array_equal(start, towards):
        raise Refused(502)
    machine.require_room(np.array([start, towards, end]), 504)
    course = machine.to_machine(np.array([start, start + (towards - start) / np.linalg.norm(towards - start) * step]))
    length = float(np.linalg.norm(towards - start)) * _MOST_ROUNDS + 1e4 * step
    yield from _follow_unknown(machine, course, direction, step, (machine.to_machine(end), diameter / 2, int(times)), length)


def _follow_unknown(
    machine: Machine, course: Array, direction: Array, step: float, goal: tuple[Array, float, int], length_mm: float
) -> Iterator[Step]:
    """Follow the contour from its start until the sphere around the end was reached so many times."""
    yield from _arrive(machine, course[0], direction)
    end, radius, times = goal
    far = course[0] + (course[1] - course[0]) / np.linalg.norm(course[1] - course[0]) * length_mm
    centres, outward, _ = machine.part.follow(np.array([course[0], course[1], far]), step, closed=False, lost_mm=np.inf)
    inside = np.linalg.norm(centres - machine.part.radius_mm * outward - end, axis=1) <= radius
    entered = np.flatnonzero(inside & ~np.concatenate([[True], inside[:-1]]))
    if len(entered) < times:
        raise Refused(1006)
    stop = int(entered[times - 1]) + 1
    yield from _report(machine, centres[:stop], outward[:stop])


def _follow(machine: Machine, course: Array, direction: Array, step: float, *, closed: bool) -> Iterator[Step]:
    """Follow a known course; the scan begins by touching its first point."""
    search = machine.tool.value("PtMeasPar", "Search")
    yield from _arrive(machine, course[0], direction)
    centres, outward, lost = machine.part.follow(course, step, closed=closed, lost_mm=search)
    yield from _report(machine, centres, outward)
    if lost:
        raise Refused(1006)


def _arrive(machine: Machine, point: Array, direction: Array) -> Iterator[Step]:
    approach, search = (machine.tool.value("PtMeasPar", name) for name in ("Approach", "Search"))
    yield from machine.move(point + approach * direction)
    if machine.part.touch(point, direction, approach, search) is None:
        raise Refused(1006)


def _touch_all(machine: Machine, points: Array, directions: Array) -> Iterator[Step]:
    """Keep the ball on the surface while the probe is led past points in their directions."""
    search = machine.tool.value("PtMeasPar", "Search")
    yield from _arrive(machine, points[0], directions[0])
    found: list[Array] = []
    for point, direction in zip(points, directions, strict=True):
        centre = machine.part.touch(point, direction, machine.part.radius_mm + search, search)
        if centre is None:
            break
        found.append(centre)
    centres = np.array(found).reshape(-1, 3)
    yield from _report(machine, centres, directions[: len(centres)])
    if len(centres) < len(points):
        raise Refused(1006)


def _report(machine: Machine, centres: Array, outward: Array) -> Iterator[Step]:
    """Tell the points of a scan, some of them a line, at the pace of the scan."""
    places = machine.from_machine(centres)
    for first in range(0, len(places), machine.points_a_line):
        numbers: list[str] = []
        rows = slice(first, first + machine.points_a_line)
        for place, direction in zip(places[rows], outward[rows], strict=True):
            told = _values(machine, place, direction)
            numbers += [repr(round(value, _DECIMALS) + 0.0) for name in machine.scan_columns for value in told[name]]
        count = len(places[rows])
        machine.place_mm = centres[rows][-1]
        yield Step(machine.point_s * count, ",".join(numbers), points=count)


def _values(machine: Machine, place: Array, direction: Array) -> dict[str, tuple[float, ...]]:
    """What can be told of a point, by the names of the columns."""
    x, y, z = place.tolist()
    nothing = dict.fromkeys(("R", "Tool.A", "Tool.B", "Tool.C"), (0.0,))
    told = {"X": (x,), "Y": (y,), "Z": (z,), "IJK": tuple(direction.tolist())}
    return {**nothing, **told, "Q": (machine.quality(),), "ER": (machine.tool.radius_mm,)}


def _unit(vector: Array) -> Array:
    length = float(np.linalg.norm(vector))
    if length == 0:
        raise Refused(1010)
    return np.asarray(vector / length)


MEASURED: Mapping[str, Callable[[Machine, Call], Iterator[Step]]] = MappingProxyType(
    {
        "PtMeas": measure_point,
        "ScanOnLine": scan_on_line,
        "ScanOnCircle": scan_on_circle,
        "ScanOnCurve": scan_on_curve,
        "ScanInPlaneEndIsSphere": scan_in_plane,
    }
)
