"""A batch of a live scan, entered and judged by one compiled call over arrays whose places in memory are packed once.

For so few points it takes longer to hand twenty arrays to a compiled loop than to work the points out.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from inspection.kernels.blocks import CurveTables
from inspection.kernels.compiling import CODE, INTEGER, MARK, REAL, SHORT, array_at, brief_kernel, inlined_kernel, memory_of
from inspection.kernels.feet import Feet
from inspection.kernels.layout import BLOCK, PLANE_WIDTH
from inspection.kernels.on_samples import SampleTables, project_by, projection_of
from inspection.kernels.rows import Columns, Judgement, Places, enter_feet, enter_points, place_some

Array = NDArray[np.float64]
Taken = tuple[Array, Array, float]

NONE_TAKEN: Taken = (np.empty((0, 2)), np.zeros(PLANE_WIDTH), np.inf)
NONE_TAKEN[1].setflags(write=False)  # as the plane of a section is
_reals_at, _integers_at, _shorts_at, _codes_at, _marks_at = (memory_of(kind) for kind in (REAL, INTEGER, SHORT, CODE, MARK))
# The arrays, in the order in which their places and lengths are packed; then come the numbers of the projection.
_SECTION, _STATION, _DEVIATION, _VERDICTS, _REJECTION, _TALLY, _HEIGHT = range(7)
_ACTUAL, _FOOT, _NORMAL = range(7, 10)
_REALS, _INTEGERS = range(10, 12)
_SAMPLES, _LINKS, _BOXES, _STARTS, _DOMAIN, _CELLS, _NEIGHBOURS = range(12, 19)
_OWN, _VERTEX = range(19, 21)  # memory to work in
_METHOD, _EXACT, _SEARCH, _ON_SAMPLES, _PACKED = range(2 * 21, 2 * 21 + 5)
# Where each begins in the memory to work in: points, then their feet.
_MOVED, _FEET, _GRADIENT, _PARAMETER, _DISTANCE, _CURVATURE, _STATIONS, _MOST = (BLOCK * i for i in (0, 2, 4, 6, 7, 8, 9, 10))


class FewRows:
    """Where the arrays of a scan and of its nominal are in memory. They are held as long as this is.

    section_mm          : (n, 2) section points
    columns             : see `judge_rows`
    grid, table, method : the curve, and the samples where the method looks at those only
    """

    def __init__(self, section_mm: Array, columns: Columns, grid: CurveTables, table: SampleTables | None, method: str) -> None:
        tables, codes = projection_of(table, method)
        self._packed = np.zeros(_PACKED, dtype=np.int64)
        self._packed[_METHOD:] = (tables[-1], *codes)
        self._held: dict[int, NDArray[Any]] = {}
        self._last_row, self._last_place = len(section_mm), 0
        self._pack(_SECTION, section_mm, *columns)
        self._pack(_REALS, grid.reals, grid.integers, *tables[:-1])
        self._pack(_OWN, np.empty(_MOST), np.empty(BLOCK, dtype=np.uint8))

    def keep_places(self, places: Places) -> None:
        """Let the places of the newest rows be entered in these arrays from now on, see `judge_rows`."""
        self._last_place = len(places[0])
        self._pack(_ACTUAL, *places)

    def judge(
        self, base: int, first: int, stop: int, pose: tuple[float, float, float, float], judgement: Judgement, taken: Taken = NONE_TAKEN
    ) -> None:
        """The same as `judge_rows`, in this thread, for at most BLOCK rows, whose places are kept from the row `base` on.

        taken : what is to be entered as these rows before, see `take_in`: points, plane, and how far off they may be

        Raises IndexError for rows that the arrays do not hold: compiled code would write beyond them.
        """
        if not (base <= first <= stop <= min(first + BLOCK, base + self._last_place, self._last_row) and len(taken[0]) <= stop - first):
            raise IndexError(f"rows {first} to {stop}, with places from {base} on, are not among {self._last_row} and {self._last_place}")
        _judge_few(self._packed, base, first, stop, pose, judgement, *taken)

    def _pack(self, first: int, *arrays: NDArray[Any]) -> None:
        for number, array in enumerate(arrays, first):
            self._held[number] = array
            self._packed[2 * number] = array.__array_interface__["data"][0]
            self._packed[2 * number + 1] = array.size


@brief_kernel
def _judge_few(
    packed: Any, base: int, first: int, stop: int, pose: Any, judgement: Any, points: Any, plane: Any, off_section_max: float
) -> None:
    section, rejection, m = _pairs(packed, _SECTION), _codes(packed, _REJECTION), stop - first
    columns = (
        _reals(packed, _STATION),
        _reals(packed, _DEVIATION),
        _codes(packed, _VERDICTS),
        rejection,
        _integers(packed, _TALLY),
        _reals(packed, _HEIGHT),
    )
    places = _pairs(packed, _ACTUAL), _pairs(packed, _FOOT), _pairs(packed, _NORMAL)
    tables = (
        _reals(packed, _SAMPLES),
        _integers(packed, _LINKS),
        _reals(packed, _BOXES),
        _integers(packed, _STARTS),
        _reals(packed, _DOMAIN),
        _reals(packed, _CELLS),
        _shorts(packed, _NEIGHBOURS),
        packed[_METHOD],
    )
    enter_points(points, plane, off_section_max, section, columns, places, base, first)
    moved, feet = _two(packed, _MOVED, m), _own_feet(packed, m)
    place_some(section, rejection, first, pose, moved)
    projection = tables, (packed[_EXACT], packed[_SEARCH], packed[_ON_SAMPLES])
    project_by(projection, moved.reshape(-1), _reals(packed, _REALS), _shorts(packed, _INTEGERS), feet)
    enter_feet(
        feet.foot_mm, feet.distance_mm, feet.gradient, feet.curvature, feet.station_mm, feet.vertex, judgement, first, base, columns, places
    )


@inlined_kernel
def _reals(packed: Any, number: int) -> Any:
    return array_at(_reals_at(packed[2 * number]), packed[2 * number + 1])


@inlined_kernel
def _pairs(packed: Any, number: int) -> Any:
    return array_at(_reals_at(packed[2 * number]), (packed[2 * number + 1] // 2, 2))


@inlined_kernel
def _integers(packed: Any, number: int) -> Any:
    return array_at(_integers_at(packed[2 * number]), packed[2 * number + 1])


@inlined_kernel
def _shorts(packed: Any, number: int) -> Any:
    return array_at(_shorts_at(packed[2 * number]), packed[2 * number + 1])


@inlined_kernel
def _codes(packed: Any, number: int) -> Any:
    return array_at(_codes_at(packed[2 * number]), packed[2 * number + 1])


@inlined_kernel
def _own_feet(packed: Any, m: int) -> Any:
    """Feet of so many points in the memory to work in."""
    return Feet(
        _one(packed, _PARAMETER, m),
        _two(packed, _FEET, m),
        _one(packed, _DISTANCE, m),
        _two(packed, _GRADIENT, m),
        _one(packed, _CURVATURE, m),
        _one(packed, _STATIONS, m),
        array_at(_marks_at(packed[2 * _VERTEX]), m),
    )


@inlined_kernel
def _one(packed: Any, at: int, m: int) -> Any:
    return array_at(_reals_at(packed[2 * _OWN] + 8 * at), m)


@inlined_kernel
def _two(packed: Any, at: int, m: int) -> Any:
    return array_at(_reals_at(packed[2 * _OWN] + 8 * at), (m, 2))
