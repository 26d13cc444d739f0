"""deviations.csv of a surface: one line for every received point. That of a run that did not come to its end says so in every line."""

from collections.abc import Iterable
from pathlib import Path

import numpy as np

from cmmlink.csv_rows import Column, Texts, write_rows
from cmmlink.deviations_csv import POINT_WORDS
from cmmlink.surface_rows import SurfaceRows
from inspection import NOT_JUDGED, Verdict

SURFACE_COLUMNS = {
    "index": "the number of the point in the order of arrival, from 0",
    "x_mm": "x of the measured point in nominal coordinates; that of a ball's centre where the probe has a tip",
    "y_mm": "y of the measured point in nominal coordinates",
    "z_mm": "z of the measured point in nominal coordinates",
    "foot_x_mm": "x of the foot point, the nominal point that the measured point is compared with",
    "foot_y_mm": "y of the foot point",
    "foot_z_mm": "z of the foot point",
    "deviation_mm": "the deviation, positive out of material",
    "verdict": "conform, nonconform or uncertain; of a rejected point `rejected:` and the reason, beside empty numbers",
    "face": "the number of the face or triangle of the nominal that the foot lies on, from 1",
}

EARLY_SURFACE_COLUMNS = {
    **SURFACE_COLUMNS,
    "ending": "aborted or interrupted: the part has no verdict, and the verdicts on points may be those of a pose that had not settled",
}


def write_surface_deviations(blocks: Iterable[SurfaceRows], path: Path, ending: str = "complete") -> None:
    """Write the measured points in nominal coordinates, their feet, deviations, verdicts and faces; rejected points say why.

    blocks : the rows of a result piece by piece
    ending : how the run ended; of one that did not come to its end a last column says so
    """
    columns, last = (SURFACE_COLUMNS, "") if ending == "complete" else (EARLY_SURFACE_COLUMNS, f",{ending}")
    with path.open("wb") as file:
        file.write((",".join(columns) + "\r\n").encode())
        index = 0
        for rows in blocks:
            write_rows(file, _columns(rows, index, last))
            index += rows.received


def _columns(rows: SurfaceRows, first: int, last: str) -> list[Column]:
    judged = rows.verdicts != NOT_JUDGED
    numbers = np.column_stack([rows.actual_mm, rows.foot_mm, rows.deviation_mm])
    numbers[~judged] = np.nan
    codes = np.where(judged, rows.verdicts, len(Verdict) + rows.rejection)
    faces, which = np.unique(rows.face, return_inverse=True)
    names = [("" if face < 0 else str(face + 1)) + last for face in faces.tolist()]
    return [np.arange(first, first + rows.received), numbers, Texts(codes, POINT_WORDS), Texts(which.ravel(), names)]
