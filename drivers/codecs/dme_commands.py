"""The commands of an I++ DME client, spelled as the specification wants them.

Lengths are in mm, angles in degrees. Points of the surface go out with the direction out of the material; what comes back is the
centre of the ball.
"""

from collections.abc import Iterator, Sequence
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from drivers.codecs.dme_lines import LONGEST_LINE

Vector = tuple[float, float, float]
Dialect = Literal["1.4.3", "1.4.0"]
DECIMALS = 6
MOVE = "GoTo"
_ROOM_FOR_TAG = 6  # five characters and a blank before the command


def number(value: float) -> str:
    """Spell a number in millimetres or degrees: at most six digits behind the point, and no more than needed."""
    text = f"{value:.{DECIMALS}f}".rstrip("0").rstrip(".")
    return "0" if text in ("-0", "") else text


def numbers(*values: float) -> str:
    """Spell numbers between commas."""
    return ",".join(map(number, values))


def command_line(tag: str, command: str) -> bytes:
    """Spell one line as it goes out."""
    return f"{tag} {command}\r\n".encode("ascii")


def point_measurement(point_mm: Vector, direction: Vector) -> str:
    """Touch one point of the surface; `direction` points out of the material."""
    x, y, z = map(number, point_mm)
    return f"PtMeas(X({x}), Y({y}), Z({z}), IJK({numbers(*direction)}))"


def move_to(place_mm: Vector) -> str:
    """Move there in a straight line, without measuring."""
    x, y, z = map(number, place_mm)
    return f"{MOVE}(X({x}), Y({y}), Z({z}))"


def scan_on_line(start_mm: Vector, end_mm: Vector, direction: Vector, step_mm: float) -> str:
    """Scan along a straight line; `direction` points out of the material, at right angles to the line."""
    return f"ScanOnLine({numbers(*start_mm, *end_mm, *direction, step_mm)})"


def scan_on_circle(centre_mm: Vector, start_mm: Vector, axis: Vector, sweep_deg: float, surface_deg: float, step_deg: float) -> str:
    """Scan around an axis; `surface_deg` is 0 outside a cylinder, 180 inside, 90 on a plane."""
    return f"ScanOnCircle({numbers(*centre_mm, *start_mm, *axis, sweep_deg, surface_deg, step_deg)})"


def scan_unknown(
    start_mm: Vector,
    start_direction: Vector,
    normal: Vector,
    towards_mm: Vector,
    step_mm: float,
    end_mm: Vector,
    diameter_mm: float,
    crossings: int,
    end_direction: Vector,
    dialect: Dialect,
) -> str:
    """Scan an unknown contour in a plane, until it has come to a sphere around its end so many times.

    The older dialect knows neither the plane's normal nor how often the sphere is reached.
    """
    newer = dialect == "1.4.3"
    plane = normal if newer else ()
    times = (float(crossings),) if newer else ()
    told = (*start_mm, *start_direction, *plane, *towards_mm, step_mm, *end_mm, diameter_mm, *times, *end_direction)
    return f"ScanInPlaneEndIsSphere({numbers(*told)})"


def curve_density(step_mm: float, angle_deg: float) -> str:
    """Say how densely points are taken along a known curve: a point at the latest after this way, or this turn of the surface."""
    return f"ScanOnCurveDensity(Dis({number(step_mm)}), Angle({number(angle_deg)}), AtNominals(0))"


def scans_on_curve(path: NDArray[np.float64], *, closed: bool) -> tuple[str, ...]:
    """Scan along a known curve. A curve that needs a longer line than is allowed goes in several scans that share their ends.

    path : (k, 6) points of the surface in mm with the directions out of the material; of a closed one the last is not the first
    """
    rows = [numbers(*row, 1.0) for row in path.tolist()]
    head = "ScanOnCurve(Closed({}), Format(X(),Y(),Z(),IJK(),tag), Data({}))"
    most = LONGEST_LINE - _ROOM_FOR_TAG - len(head)
    if sum(map(len, rows)) + len(rows) <= most:
        return (head.format(int(closed), ",".join(rows)),)
    return tuple(head.format(0, ",".join(part)) for part in _parts([*rows, rows[0]] if closed else rows, most))


def _parts(rows: Sequence[str], most: int) -> Iterator[Sequence[str]]:
    """Cut rows into stretches of at most so many characters; each begins with the last row of the one before."""
    first, size = 0, 0
    for at, row in enumerate(rows):
        if size + len(row) + 1 > most:
            yield rows[first:at]
            first, size = at - 1, len(rows[at - 1]) + 1
        size += len(row) + 1
    yield rows[first:]
