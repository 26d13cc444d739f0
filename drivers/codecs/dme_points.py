"""Points out of the data lines of an I++ DME server: the columns of a scan, whole points, and which of them can be used.

A scan's line holds bare numbers, whole points one behind the other; a length that is no multiple of the columns is damage, not a point.
A server that splits a point over two lines is understood where the two lines together hold whole points, and where every point tells its
direction or its radius: only these show that the right parts were put together. Behind damage, until the scan ends, a line of a whole
length may begin within a point as well; then it is taken where all its points fit, and would not if it began within a point. Columns that
tell neither direction nor radius show nothing of it, so nothing of a scan is taken behind a line of another length.

Nothing of the protocol carries a checksum or counts points. So whatever else the columns tell is held against what is known: a direction
has length 1, a quality lies between 0 and 100, and the effective radius of the tip is that of the plan.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from drivers.codecs.dme_lines import number_in, numbers_in, values_in
from drivers.codecs.outbox import Outbox
from drivers.source import Arrival, Damaged, PointBatch, Rejected

WIDTHS: Mapping[str, int] = MappingProxyType(
    {"X": 1, "Y": 1, "Z": 1, "IJK": 3, "Q": 1, "ER": 1, "R": 1, "Tool.A": 1, "Tool.B": 1, "Tool.C": 1}
)
_POSITION = ("X", "Y", "Z")
_CHECKED = frozenset({"IJK", "ER"})
_LENGTH_TOLERANCE = 0.01  # of a direction: servers round its components to a few digits


@dataclass(frozen=True, slots=True)
class PointCheck:
    """What a point has to be like to be used.

    tip_radius_mm       the radius by which points are compensated
    radius_tolerance_mm how far the effective radius that the machine tells of a point may be from it
    quality_max         a larger quality number is worse than is taken: 0 is good, 100 bad
    """

    tip_radius_mm: float
    radius_tolerance_mm: float
    quality_max: float

    def refusal(self, values: Mapping[str, Sequence[float]]) -> str:
        """Return why a point cannot be used, or nothing."""
        if "ER" in values and abs(values["ER"][0] - self.tip_radius_mm) > self.radius_tolerance_mm:
            return f"effective radius of the tip is not the plan's {self.tip_radius_mm:g} mm"
        if "Q" in values and values["Q"][0] > self.quality_max:
            return "the machine calls the quality of the point bad"
        return ""


def _are_sound(values: Mapping[str, Sequence[float]]) -> bool:
    """Tell whether direction and quality are such as there can be."""
    length = float(np.hypot.reduce(values["IJK"])) if "IJK" in values else 1.0
    quality = values["Q"][0] if "Q" in values else 0.0
    return abs(length - 1.0) <= _LENGTH_TOLERANCE and 0.0 <= quality <= 100.0


class PointReader:
    """Collects the points of one run, whatever number of scans it has. Their sequence is the order in which they came."""

    def __init__(self, check: PointCheck, columns: Sequence[str]) -> None:
        self._check = check
        self.columns = tuple(columns)
        self.count = 0  # of the points that came whole, used or not
        self._held: list[float] = []
        self._held_bytes = 0
        self._in_doubt = False  # whether lines of this scan begin with a point
        self._sequence: list[int] = []
        self._points_mm: list[tuple[float, float, float]] = []
        self.out = Outbox(self._batch)

    @property
    def _tells_beginnings(self) -> bool:
        """Whether the columns, which are agreed on after the session began, show where a point begins."""
        return bool(_CHECKED & set(self.columns))

    def take_scan_line(self, data: str) -> None:
        """Take a data line of a scan."""
        found = numbers_in(data)
        if found is None:
            self.drop_held()
            self.damage(len(data), "data of a scan that are not numbers")
            return
        width = sum(WIDTHS[name] for name in self.columns)
        if not self._held and len(found) % width and self._tells_beginnings:
            self._held, self._held_bytes = found, len(data)
            return
        rows = self._held + found
        if len(rows) % width:
            self._in_doubt = True
            self.damage(self._held_bytes + len(data), "scan data that hold no whole number of points")
        else:
            self._take_rows(rows, width, self._held_bytes + len(data))
        self._held, self._held_bytes = [], 0

    def take_measured_point(self, data: str) -> None:
        """Take the report of a single point: its values by their names, in any order."""
        told = values_in(data)
        fields = {name: [number_in(part) for part in told[name].split(",")] for name in WIDTHS if name in told} if told else {}
        values = {name: [part for part in parts if part is not None] for name, parts in fields.items()}
        whole = all(len(values.get(name, ())) == WIDTHS[name] for name in {*_POSITION, *values})
        if not whole:
            self.damage(len(data), "report of a point without its coordinates")
        else:
            self._take(values, len(data))

    def end_scan(self) -> None:
        """Note the end of a scan: what is held of a point is none."""
        self.drop_held()
        self._in_doubt = False

    def drop_held(self) -> None:
        """Count the line that was held, for the other part of its last point, as damage."""
        if self._held:
            self.damage(self._held_bytes, "scan data that hold no whole number of points")
        self._held, self._held_bytes = [], 0

    def damage(self, byte_count: int, reason: str) -> None:
        """Count bytes that are no points."""
        self._in_doubt |= self._tells_beginnings
        self.out.append(Damaged(byte_count, reason))

    def _take_rows(self, numbers: list[float], width: int, size: int) -> None:
        """Take whole points. Of lines that need not begin with a point, one that cannot be used shows that they may not belong together."""
        rows = [numbers[at : at + width] for at in range(0, len(numbers), width)]
        fit = [self._fits(row) for row in rows]
        if self._held and not all(fit):
            self.damage(size, "scan data that hold no whole number of points")
            return
        if self._in_doubt and any(fit) and not (all(fit) and self._begins_with_a_point(numbers, width)):
            self.damage(size, "scan data behind damage that do not show where a point begins")
            return
        for row in rows:
            self._take(self._values_of(row), size // len(rows))

    def _fits(self, row: Sequence[float]) -> bool:
        """Tell whether the numbers are those of a point that can be used."""
        values = self._values_of(row)
        return _are_sound(values) and not self._check.refusal(values)

    def _begins_with_a_point(self, numbers: list[float], width: int) -> bool:
        """Tell whether the numbers of a line that fit as they stand would not fit if the line began within a point.

        Such a line ends with the beginning of another point, which stands before the rest at the line's own beginning here.
        """
        turned = (numbers[-shift:] + numbers[:-shift] for shift in range(1, width))
        return all(not all(self._fits(other[at : at + width]) for at in range(0, len(other), width)) for other in turned)

    def _values_of(self, row: Sequence[float]) -> dict[str, Sequence[float]]:
        """The values of a point by the names of their columns."""
        values, at = dict[str, Sequence[float]](), 0
        for name in self.columns:
            values[name] = row[at : at + WIDTHS[name]]
            at += WIDTHS[name]
        return values

    def _take(self, values: Mapping[str, Sequence[float]], size: int) -> None:
        if not _are_sound(values):
            self.damage(size, "point with a direction or a quality that cannot be")
            return
        number, self.count = self.count, self.count + 1
        refusal = self._check.refusal(values)
        if refusal:
            self.out.append(Rejected(1, refusal))
            return
        x, y, z = (values[name][0] for name in _POSITION)
        self._sequence.append(number)
        self._points_mm.append((x, y, z))

    def _batch(self) -> Arrival | None:
        """Return the points collected so far as one batch; the machine tells no time."""
        if not self._sequence:
            return None
        sequence: NDArray[np.int64] = np.array(self._sequence, dtype=np.int64)
        points_mm = np.array(self._points_mm, dtype=np.float64)
        self._sequence, self._points_mm = [], []
        return PointBatch(sequence, np.zeros(len(sequence)), points_mm)
