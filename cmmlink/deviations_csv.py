"""deviations.csv: one line for every received point. That of a run that did not come to its end says so in every line."""

import csv
from collections.abc import Iterable, Iterator
from pathlib import Path

import numpy as np

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

_LINE = "%d" + 6 * ",%.6f" + ",%s"
_WORDS = {int(verdict): verdict.word for verdict in Verdict}

EARLY_COLUMNS = {
    **COLUMNS,
    "ending": "aborted or interrupted: the part has no verdict, and the verdicts on points may be those of a pose that had not settled",
}


def write_deviations(blocks: Iterable[JudgedRows], path: Path, ending: str = "complete") -> None:
    """Write the actual points in nominal coordinates, their feet, deviations and verdicts; rejected points say why.

    blocks : the rows of a result piece by piece, as `InspectionResult.blocks` gives them
    ending : how the run ended; of one that did not come to its end a last column says so
    """
    early = () if ending == "complete" else (ending,)
    with path.open("w", newline="", encoding="utf-8") as file:
        csv.writer(file).writerow(EARLY_COLUMNS if early else COLUMNS)
        end, index = ",".join(("", *early)) + "\r\n", 0
        for rows in blocks:
            file.writelines(line + end for line in _lines(rows, index))
            index += rows.received


def _lines(rows: JudgedRows, first: int) -> Iterator[str]:
    """The lines of rows without their ends, made by one format each: a format a number would take most of the time of a long export."""
    values = np.column_stack([rows.actual_mm, rows.station_mm, rows.foot_mm, rows.deviation_mm]).tolist()
    codes = zip(values, rows.verdicts.tolist(), rows.rejection.tolist(), strict=True)
    for index, (numbers, verdict, rejection) in enumerate(codes, start=first):
        if verdict == NOT_JUDGED:
            yield f"{index},,,,,,,rejected: {Rejection(rejection).words}"
        else:
            yield _LINE % (index, *numbers, _WORDS[verdict])
