"""characteristics.csv: one line for every characteristic of a run, with everything that its value depends on."""

import csv
import math
from collections.abc import Sequence
from pathlib import Path

from inspection import CharacteristicResult

COLUMNS = {
    "name": "the name of the characteristic in the plan",
    "type": "what it is, like line-profile or chord",
    "method": "how the value was found, with the window that the method used",
    "value": "its value; of a profile 2 * max |deviation - middle of the zone|",
    "nominal": "the value that the deviation is counted from; empty for a profile",
    "unit": "the unit of all numbers of the line",
    "lower": "the lower limit of the deviation, of a varying zone at the worst point; empty: no limit",
    "upper": "the upper limit, likewise",
    "deviation": "value - nominal; of a profile the deviation of the worst point",
    "uncertainty": "the expanded uncertainty U, 0 where none was stated",
    "verdict": "conform, nonconform or uncertain",
    "region": "the stretch of the profile that was judged",
    "zone": "of a profile, the tolerance in the notations of ISO 1101 (UZ) and ASME Y14.5 (circled U, here (U))",
    "fit": "how the pose was found, with what was locked or limited",
    "filter": "what the deviations went through; none: raw",
    "weights": "how points counted in the fit",
    "rule": "what decided, and how U counts",
    "reasons": "why, the most important first",
}


def write_characteristics(found: Sequence[CharacteristicResult], path: Path) -> None:
    """Write the characteristics of a result."""
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(COLUMNS)
        for one in found:
            numbers = [_number(number) for number in (one.lower, one.upper, one.deviation, one.uncertainty)]
            how = (one.region_words, one.zone_words, one.fit, one.filter, one.weights, one.rule)
            reasons = " ".join(reason.words for reason in one.reasons)
            head = (one.name, one.type, one.method, _number(one.value), _number(one.nominal), one.unit)
            writer.writerow([*head, *numbers, one.verdict.word, *how, reasons])


def _number(number: float) -> str:
    return f"{number:.9g}" if math.isfinite(number) else ""
