"""What a case asks of a program in single numbers, and the sheet in which their values are set beside the truth."""

import csv
import io
from collections.abc import Iterable, Iterator
from typing import NamedTuple

import numpy as np

from cmmlink.reference.case import ReferenceCase

COLUMNS = ("case", "quantity", "unit", "truth", "their_value", "difference")


class Quantity(NamedTuple):
    """A number that is true of a case; in mm or inch, in degrees, or a share or count with the unit 1."""

    name: str
    unit: str
    value: float


def quantities(case: ReferenceCase) -> Iterator[Quantity]:
    """The numbers of a case, in the order of its truth."""
    truth, unit = case.truth, case.unit
    if truth.pose is not None:
        yield Quantity("rotation", "deg", truth.pose.rotation_deg)
        yield Quantity("translation along x", unit, truth.pose.translation[0])
        yield Quantity("translation along y", unit, truth.pose.translation[1])
    if truth.deviation is not None:
        yield Quantity("largest deviation", unit, float(np.nanmax(truth.deviation)))
        yield Quantity("smallest deviation", unit, float(np.nanmin(truth.deviation)))
    if truth.worst is not None:
        yield Quantity("row of the worst point", "1", truth.worst.row)
    if truth.rms is not None:
        yield Quantity("root mean square of the deviations", unit, truth.rms)
    if truth.zone is not None:
        yield Quantity("width of the minimum zone", unit, truth.zone.value)
    if truth.consumption is not None:
        yield Quantity("least consumption", "1", truth.consumption.value)
    for each in truth.filtered:
        yield Quantity(f"largest deviation behind {each.name}", unit, float(each.deviation.max()))
    for value in truth.values:
        yield Quantity(value.name, value.unit, value.value)
    if truth.outliers:
        yield Quantity("count of outliers", "1", len(truth.outliers))


def scoring_sheet(cases: Iterable[ReferenceCase]) -> str:
    """The sheet as CSV: a row for every number, with an empty place for theirs and a formula that spreadsheets work out."""
    text = io.StringIO()
    rows = csv.writer(text, lineterminator="\n")
    rows.writerow(COLUMNS)
    every = ((case.name, each) for case in cases for each in quantities(case))
    for number, (name, each) in enumerate(every, 2):
        rows.writerow([name, each.name, each.unit, repr(each.value), "", f'=IF(E{number}="","",E{number}-D{number})'])
    return text.getvalue()
