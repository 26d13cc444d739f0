"""deviations.csv: one line for every received point. That of a run that did not come to its end says so in every line."""

from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from cmmlink.csv_rows import Column, Texts, write_rows
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

POINT_WORDS = (*(verdict.word for verdict in Verdict), *(f"rejected: {reason.words}" for reason in Rejection))

EARLY_COLUMNS = {
    **COLUMNS,
    "ending": "aborted or interrupted: the part has no verdict, and the verdicts on points may be those of a pose that had not settled",
}


def write_deviations(blocks: Iterable[JudgedRows], path: Path, ending: str = "complete") -> None:
    """Write the actual points in nominal coordinates, their feet, deviations and verdicts; rejected points say why.

    blocks : the rows of a result piece by piece, as `InspectionResult.blocks` gives them
    ending : how the run ended; of one that did not come to its end a last column says so
    """
    columns, last = (COLUMNS, "") if ending == "complete" else (EARLY_COLUMNS, f",{ending}")
    words = [word + last for word in POINT_WORDS]
    with path.open("wb") as file:
        file.write((",".join(columns) + "\r\n").encode())
        index = 0
        for rows in blocks:
            write_rows(file, point_columns(rows, index, words))
            index += rows.received


def point_columns(rows: JudgedRows, first: int, words: Sequence[str] = POINT_WORDS) -> list[Column]:
    """The columns of points in a table, of which the first has the index `first`; rejected ones have no numbers."""
    judged = rows.verdicts != NOT_JUDGED
    numbers = np.column_stack([rows.actual_mm, rows.station_mm, rows.foot_mm, rows.deviation_mm])
    numbers[~judged] = np.nan
    return [np.arange(first, first + rows.received), numbers, Texts(word_codes(rows), words)]


def word_codes(rows: JudgedRows) -> NDArray[np.integer]:
    """The places in POINT_WORDS (m,) of what stands beside each point."""
    codes: NDArray[np.integer] = np.where(rows.verdicts != NOT_JUDGED, rows.verdicts, len(Verdict) + rows.rejection)
    return codes
