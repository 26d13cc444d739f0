"""deviations.csv: one line for every received point."""

import csv
import math
from pathlib import Path

from cmmlink.record.bodies import JudgedRows
from inspection import NOT_JUDGED, InspectionResult, Rejection, Verdict

COLUMNS = {
    "index": "the number of the point in the order of arrival, from 0",
    "x_mm": "x of the actual surface point in nominal coordinates; ball centres are compensated",
    "y_mm": "y of the actual surface point in nominal coordinates",
    "station_mm": "arc length of the foot point from the start of the nominal",
    "foot_x_mm": "x of the foot point, the nominal point that the actual point is compared with",
    "foot_y_mm": "y of the foot point",
    "deviation_mm": "the deviation, positive out of material",
    "verdict": "conform, nonconform or uncertain; of a rejected point `rejected:` and the reason, beside empty numbers",
}


def write_deviations(result: InspectionResult | JudgedRows, path: Path) -> None:
    """Write the actual points in nominal coordinates, their feet, deviations and verdicts; rejected points say why."""
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(COLUMNS)
        writer.writerows(_row(result, index) for index in range(result.received))


def _row(result: InspectionResult | JudgedRows, index: int) -> tuple[str | int, ...]:
    x, y = result.actual_mm[index]
    foot_x, foot_y = result.foot_mm[index]
    values = (x, y, result.station_mm[index], foot_x, foot_y, result.deviation_mm[index])
    code = result.verdicts[index]
    word = f"rejected: {Rejection(int(result.rejection[index])).words}" if code == NOT_JUDGED else Verdict(int(code)).word
    return (index, *("" if math.isnan(value) else f"{value:.6f}" for value in values), word)
