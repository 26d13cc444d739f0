"""deviations.csv: one line for every received point."""

import csv
import math
from pathlib import Path

from cmmlink.record.bodies import JudgedRows
from inspection import NOT_JUDGED, InspectionResult, Rejection, Verdict

HEADER = ("index", "x_mm", "y_mm", "station_mm", "foot_x_mm", "foot_y_mm", "deviation_mm", "verdict")


def write_deviations(result: InspectionResult | JudgedRows, path: Path) -> None:
    """Write the actual points in nominal coordinates, their feet, deviations and verdicts; rejected points say why."""
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(HEADER)
        writer.writerows(_row(result, index) for index in range(result.received))


def _row(result: InspectionResult | JudgedRows, index: int) -> tuple[str | int, ...]:
    x, y = result.actual_mm[index]
    foot_x, foot_y = result.foot_mm[index]
    values = (x, y, result.station_mm[index], foot_x, foot_y, result.deviation_mm[index])
    code = result.verdicts[index]
    word = f"rejected: {Rejection(int(result.rejection[index])).words}" if code == NOT_JUDGED else Verdict(int(code)).word
    return (index, *("" if math.isnan(value) else f"{value:.6f}" for value in values), word)
