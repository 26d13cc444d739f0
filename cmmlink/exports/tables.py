"""The tables that spreadsheets and statistics programs take: one row a run, one a characteristic, one a point.

Both formats of tables, csv and xlsx, are written from these columns and rows.
"""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from cmmlink import characteristics_csv, deviations_csv
from cmmlink.exports.measured_part import MeasuredPart, MeasuredSection

Cell = str | float | int | bool | None
_ROW = "the number of the run's row in the table of runs, from 1"
_CHAIN = "the hash of the run's last record, which follows from every record before it; empty where nothing was recorded"

RUN_COLUMNS = {
    "row": "the number of this row, from 1, by which the other tables name it",
    "run": "the id of the recorded run; empty where nothing was recorded",
    "measured_at": "when the measurement began, in UTC (ISO 8601)",
    "part": "the name of the part",
    "serial_number": "the serial number of the part",
    "operator": "who measured",
    "device": "the device or file that the points came from",
    "simulated": "1 where the device was a simulated one and no real part was measured, else 0",
    "height_mm": "of a section of a surface, the height at which it was cut",
    "ending": "complete; aborted or interrupted: the part has no verdict",
    "part_verdict": "the verdict on the part: that of its worst section or characteristic",
    "verdict": "the verdict on what this row is of: conform, nonconform or uncertain",
    "received": "the points that came through the link whole; always judged + rejected",
    "judged": "the points with a verdict",
    "rejected": "the points that cannot be judged",
    "lost": "the points that are missing by the device's own counters",
    "out_of_tolerance": "the points whose verdict is nonconform",
    "max_deviation_mm": "the largest deviation",
    "min_deviation_mm": "the smallest deviation",
    "rms_mm": "the root mean square of the deviations",
    "profile_error_mm": "2 * max |deviation|",
    "zone_error_mm": "2 * max |deviation - middle of the zone|",
    "best_fit_error_mm": "the zone error at the best fit",
    "minimum_zone_mm": "the zone error at the minimum zone",
    "worst_station_mm": "the station of the point farthest from the middle of the zone",
    "worst_x_mm": "x of that point in nominal coordinates",
    "worst_y_mm": "y of that point",
    "worst_deviation_mm": "the deviation of that point",
    "lower_mm": "the lower limit of the deviation",
    "upper_mm": "the upper limit of the deviation",
    "uncertainty_mm": "the expanded uncertainty of one deviation",
    "decision_rule": "how the uncertainty counts",
    "rule": "what decided: minimum-zone, best-fit, or datum where the pose was known",
    "fit": "how the pose was found",
    "method": "how deviations were found",
    "weights": "how points counted in the best fit",
    "rotation_deg": "the rotation from section to nominal coordinates, counterclockwise",
    "translation_x_mm": "the translation after it, along x",
    "translation_y_mm": "the translation after it, along y",
    "coverage": "the share of the nominal's length that was measured, from 0 to 1",
    "largest_gap_mm": "the longest stretch of the profile without a judged point",
    "reasons": "why the verdict is what it is, the most important first",
    "notes": "what was assumed about the nominal and the points",
    "cmmlink": "the version of cmmlink that judged",
    "plan_sha256": "the hash of the effective plan",
    "nominal_sha256": "the hash of the nominal's file",
    "chain_sha256": _CHAIN,
}
CHARACTERISTIC_COLUMNS = {
    "row": _ROW + "; empty of a characteristic that all sections of a stack have together",
    "run": RUN_COLUMNS["run"],
    "measured_at": RUN_COLUMNS["measured_at"],
    "part": RUN_COLUMNS["part"],
    "serial_number": RUN_COLUMNS["serial_number"],
    "height_mm": "of a section of a surface, the height at which it was cut; of a stack's characteristic, that of its worst section",
    **characteristics_csv.COLUMNS,
    "chain_sha256": _CHAIN,
}
POINT_COLUMNS = {
    "row": _ROW,
    **deviations_csv.COLUMNS,
    "chain_sha256": f"{_CHAIN}; in the first row of each run",
}


def sections_of(parts: Sequence[MeasuredPart]) -> Iterator[tuple[int, MeasuredPart, MeasuredSection]]:
    """Every section of the parts, with the number of its row."""
    yield from ((row, part, section) for row, (part, section) in enumerate(((p, s) for p in parts for s in p.sections), start=1))


def run_rows(parts: Sequence[MeasuredPart]) -> Iterator[dict[str, Cell]]:
    """A row for every section of every part, by the names of its columns."""
    for row, part, section in sections_of(parts):
        found = section.document
        worst, zone, pose = found["worst"] or {}, found["tolerance"] or {}, found["registration"] or {}
        x_mm, y_mm = pose.get("translation_mm", (None, None))
        plain = {key: found.get(key) for key in RUN_COLUMNS if isinstance(found.get(key), str | float | int)}
        yield {
            **plain,
            **_whose(part, section),
            "row": row,
            "operator": part.text("operator"),
            "device": part.text("device"),
            "simulated": int(part.identity["simulated"]),
            "part_verdict": part.text("verdict"),
            **{f"worst_{key}": worst.get(key) for key in ("station_mm", "x_mm", "y_mm", "deviation_mm")},
            **{key: zone.get(key) for key in ("lower_mm", "upper_mm", "uncertainty_mm", "decision_rule")},
            "rotation_deg": pose.get("rotation_deg"),
            "translation_x_mm": x_mm,
            "translation_y_mm": y_mm,
            "reasons": reasons_in(found),
            "notes": "; ".join(found.get("notes") or found.get("warnings") or ()),
            "cmmlink": (part.identity.get("software") or {}).get("cmmlink"),
            "plan_sha256": found.get("plan_sha256") or part.text("plan_sha256"),
        }


def characteristic_rows(parts: Sequence[MeasuredPart]) -> Iterator[dict[str, Cell]]:
    """A row for every characteristic of every section, and behind those of each part a row for every one of its stack."""
    for part in parts:
        first = next(row for row, other, _ in sections_of(parts) if other is part)
        for row, section in enumerate(part.sections, start=first):
            for one in section.document["characteristics"]:
                yield {**_characteristic(one), **_whose(part, section), "row": row}
        for one in part.of_stack:
            whose = {key: part.text(key) for key in ("measured_at", "part", "serial_number", "chain_sha256")}
            yield {**_characteristic(one), **whose, "height_mm": one["height_mm"]}


def _whose(part: MeasuredPart, section: MeasuredSection) -> dict[str, Cell]:
    """Whose row it is."""
    own = {key: section.document.get(key) or "" for key in ("run", "chain_sha256")}
    return {**own, **{key: part.text(key) for key in ("measured_at", "part", "serial_number")}, "height_mm": section.height_mm}


def _characteristic(one: Mapping[str, Any]) -> dict[str, Cell]:
    named = {key: one[key] for key in characteristics_csv.COLUMNS if key in one}
    return {**named, "region": one["region_words"], "reasons": reasons_in(one)}


def reasons_in(found: Mapping[str, Any]) -> str:
    """Why a verdict is what it is, as one text."""
    return " ".join(reason["words"] for reason in found["reasons"])
