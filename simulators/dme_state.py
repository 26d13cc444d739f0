"""The state of a simulated coordinate measuring machine: where it is, what it has in hand, and who is told of its movements."""

from collections import deque
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from simulators.dme_language import Refused, spelled
from simulators.dme_part import Part
from simulators.dme_scans import Step
from simulators.dme_tools import Tool

SYSTEMS = ("MachineCsy", "MoveableMachineCsy", "MultipleArmCsy", "PartCsy", "JogDisplayCsy", "JogMoveCsy", "SensorCsy")
_VOLUME_MM = 2000.0  # from zero, along each axis
_MOVE_MM_S = 200.0
_REPORTS_S = 0.1  # between two reports of a daemon at least
Array = NDArray[np.float64]


@dataclass(slots=True)
class Daemon:
    """A report of every movement under a tag of its own."""

    axes: list[str]
    every_s: float
    distance_mm: float
    since_s: float = 0.0
    reported_mm: Array = field(default_factory=lambda: np.zeros(3))


class State:
    """The machine, as its server knows it.

    part    : what the probe meets
    homed   : the machine knows where it is
    tool    : the name of the tool that it has
    points_a_line, point_s : how many points of a scan one line holds, and how long a point takes
    """

    def __init__(self, part: Part, *, homed: bool, tool: str, points_a_line: int, point_s: float) -> None:
        self.part, self.homed = part, homed
        self.tools = {"NoTool": Tool("NoTool")}
        for name in ("RefTool", "BaseTool", "Probe1"):
            self.tools[name] = Tool(name, part.radius_mm, measures=True)
        self.tool, self.found_tool = self.tools[tool], self.tools["NoTool"]
        self.points_a_line, self.point_s = points_a_line, point_s
        self.place_mm = np.zeros(3)
        self.density_mm = 1.0
        self.in_session = self.in_error = self.user_enabled = False
        self.next_quality: Callable[[], float] = lambda: 0.0
        self.system = "MachineCsy"
        self.transformations = dict.fromkeys(SYSTEMS, (0.0,) * 6)
        self.daemons: dict[str, Daemon] = {}
        self.reports: deque[tuple[str, str]] = deque()  # tag and data
        self.forget_reports()

    def forget_reports(self) -> None:
        """Report points as every new session does."""
        self.scan_columns, self.point_columns = ["X", "Y", "Z", "Q"], ["X", "Y", "Z"]

    def quality(self) -> float:
        """The quality of the next point."""
        return self.next_quality()

    def move(self, target_mm: Array) -> Iterator[Step]:
        """Move in pieces, of which daemons report."""
        if not np.abs(target_mm).max() <= _VOLUME_MM:
            raise Refused(2500)
        start = self.place_mm
        pieces = max(1, int(np.ceil(np.linalg.norm(target_mm - start) / (_MOVE_MM_S * _REPORTS_S))))
        for piece in range(1, pieces + 1):
            self.place_mm = start + (target_mm - start) * piece / pieces
            self._report(_REPORTS_S)
            yield Step(_REPORTS_S if self.point_s else 0.0)

    def _report(self, seconds: float) -> None:
        for tag, daemon in self.daemons.items():
            daemon.since_s += seconds
            if daemon.since_s >= daemon.every_s or np.linalg.norm(self.place_mm - daemon.reported_mm) >= daemon.distance_mm:
                daemon.since_s, daemon.reported_mm = 0.0, self.place_mm
                self.reports.append((tag, self.places(daemon.axes)))

    def places(self, axes: list[str]) -> str:
        """Spell where the machine is."""
        values = dict(zip("XYZ", (self.place_mm - self._offset_mm).tolist(), strict=True))
        return ", ".join(f"{axis}({spelled(values.get(axis, 0.0))})" for axis in axes)

    @property
    def _offset_mm(self) -> Array:
        """Where the origin of the active coordinate system lies."""
        return np.array(self.transformations[self.system][:3])

    def to_machine(self, points_mm: Array) -> Array:
        """Points (..., 3) of the active coordinate system on the machine; a turned system is more than this machine can."""
        if any(self.transformations[self.system][3:]):
            raise Refused(501)
        return np.asarray(points_mm + self._offset_mm)

    def from_machine(self, points_mm: Array) -> Array:
        """The way back."""
        return np.asarray(points_mm - self._offset_mm)

    def require_probe(self) -> None:
        """Raise Refused unless the machine can measure."""
        if not self.homed or not self.tool.measures:
            raise Refused(507)

    def require_room(self, points_mm: Array, code: int) -> None:
        """Raise Refused with this code where points of the active coordinate system lie outside the machine."""
        if not np.abs(self.to_machine(points_mm)).max() <= _VOLUME_MM:
            raise Refused(code)

    def target(self, values: Mapping[str, tuple[float, ...]]) -> Array:
        """Where named axes lead; the others stay."""
        here = self.from_machine(self.place_mm).tolist()
        return self.to_machine(np.array([values.get(axis, (here[k],))[0] for k, axis in enumerate("XYZ")]))
