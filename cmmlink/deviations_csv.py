"""deviations.csv: one line for every received point."""

import csv
import math
from pathlib import Path

from inspection import NOT_JUDGED, JudgedRows, Rejection, Verdict

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


def write_deviations(rows: JudgedRows, path: Path) -> None:
    """Write the actual points in nominal coordinates, their feet, deviations and verdicts; rejected points say why."""
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(COLUMNS)
        writer.writerows(_row(rows, index) for index in range(rows.received))


def _row(rows: JudgedRows, index: int) -> tuple[str | int, ...]:
    x, y = rows.actual_mm[index]
    foot_x, foot_y = rows.foot_mm[index]
    values = (x, y, rows.station_mm[index], foot_x, foot_y, rows.deviation_mm[index])
    code = rows.verdicts[index]
    word = f"rejected: {Rejection(int(rows.rejection[index])).words}" if code == NOT_JUDGED else Verdict(int(code)).word
    return (index, *("" if math.isnan(value) else f"{value:.6f}" for value in values), word)
