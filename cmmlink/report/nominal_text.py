"""The picture of a nominal in a terminal: its shape in dots, where it starts, and which way it runs."""

import numpy as np

from cmmlink.nominal_files import NominalFile
from cmmlink.report.curve_course import arrows_along, points_along

_BLANK = 0x2800  # the first of Unicode's Braille patterns, whose eight dots are the bits below
_BITS = np.array([[0x01, 0x08], [0x02, 0x10], [0x04, 0x20], [0x40, 0x80]])  # dot of row and column in a character
_START = "S"
_ARROWS = ">^<v"  # of a direction of 0, 90, 180 and 270 degrees
_PER_STEP = 4  # points of the polyline for every dot that it is long


def text_picture(file: NominalFile, columns: int = 72, rows: int = 18) -> str:
    """The nominal as lines of Braille characters, no wider and no higher than asked; x to the right, y up.

    S stands where it starts, and arrows along it show its direction of travel.
    """
    points = points_along(file.curve)
    low, size = points.min(axis=0), np.ptp(points, axis=0)
    dot_mm = float(max(size[0] / (2 * columns - 1), size[1] / (4 * rows - 1))) or 1.0
    wide, high = int(size[0] / dot_mm) // 2 + 1, int(size[1] / dot_mm) // 4 + 1
    along = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(points, axis=0).T))])
    even = np.linspace(0.0, along[-1], int(_PER_STEP * along[-1] / dot_mm) + 2)
    dense = np.column_stack([np.interp(even, along, points[:, axis]) for axis in range(2)])
    column, row = np.rint((dense - low) / dot_mm).astype(int).T
    row = 4 * high - 1 - row
    dots = np.zeros((high, wide), dtype=int)
    np.bitwise_or.at(dots, (row // 4, np.minimum(column // 2, wide - 1)), _BITS[row % 4, column % 2])
    signs = [[chr(_BLANK + bits) for bits in line] for line in dots]
    for foot, tip in zip(*arrows_along(file.curve), strict=True):
        turn = np.degrees(np.arctan2(*(tip - foot)[::-1]))
        signs[_row(foot[1], low[1], dot_mm, high)][_column(foot[0], low[0], dot_mm, wide)] = _ARROWS[round(turn / 90) % 4]
    start = file.curve.point(np.array(file.curve.domain[:1]))[0]
    signs[_row(start[1], low[1], dot_mm, high)][_column(start[0], low[0], dot_mm, wide)] = _START
    return "\n".join("".join(line).rstrip(chr(_BLANK)) for line in signs)


def _row(y: float, low: float, dot_mm: float, high: int) -> int:
    return int((4 * high - 1 - np.rint((y - low) / dot_mm)) // 4)


def _column(x: float, low: float, dot_mm: float, wide: int) -> int:
    return min(int(np.rint((x - low) / dot_mm) // 2), wide - 1)
