"""A recorded run as files that any program reads."""

import csv
import json
from pathlib import Path
from typing import Any

import numpy as np

from cmmlink.deviations_csv import write_deviations
from cmmlink.errors import PlanError
from cmmlink.record.bodies import unpack_judged
from cmmlink.record.reader import arrivals_of, describe, event_document, points_of, reads_of, recorded_run
from cmmlink.record.shapes import plain_name
from cmmlink.record.store import Store

POINT_COLUMNS = {
    "sequence": "the device's own counter of the point, unwrapped",
    "time_s": "the time of the point by the device's own clock, 0 where it has none",
    "x_mm": "x in machine coordinates",
    "y_mm": "y in machine coordinates",
    "z_mm": "z in machine coordinates",
}
WIRE_COLUMNS = {
    "time_s": "when the bytes were read, by the clock of the run",
    "offset": "where they begin in wire.bin",
    "bytes": "how many they are",
}


def export_run(store: Store, run: str, folder: Path) -> list[Path]:
    """Write a run to a folder. Returns the files written; raises PlanError when the folder cannot be written.

    run.json: all but the points; events.json; points.csv and points.npy (m, 5): sequence, time_s, x, y, z in mm;
    wire.bin, the bytes as they arrived, and wire.csv, when; plan.yaml; the nominal's file; of a run with a result
    deviations.csv and result.json.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        return [*_documents(store, run, folder), *_points(store, run, folder), *_wire(store, run, folder), *_result(store, run, folder)]
    except OSError as error:
        raise PlanError(f"{folder}: the run cannot be written there ({error.strerror}); choose another folder with --out") from None


def _documents(store: Store, run: str, folder: Path) -> list[Path]:
    recorded = recorded_run(store, run)
    nominal = folder / f"nominal-{plain_name(recorded.header['nominal'])}"
    nominal.write_bytes(recorded.nominal)
    plan = folder / "plan.yaml"
    plan.write_bytes(recorded.plan.encode())
    events = [event_document(moment) for moment in arrivals_of(store, run)]
    return [nominal, plan, _json(folder / "run.json", describe(store, run)), _json(folder / "events.json", events)]


def _points(store: Store, run: str, folder: Path) -> list[Path]:
    count = store.totals(run).get("points", (0, 0))[1]
    with (folder / "points.npy").open("wb") as array, (folder / "points.csv").open("w", newline="", encoding="utf-8") as file:
        np.lib.format.write_array_header_1_0(array, {"descr": "<f8", "fortran_order": False, "shape": (count, 5)})
        writer = csv.writer(file)
        writer.writerow(POINT_COLUMNS)
        for batch in points_of(store, run):
            rows = np.column_stack([batch.sequence, batch.time_s, batch.points_mm])
            array.write(rows.astype("<f8").tobytes())
            writer.writerows((int(row[0]), *row[1:]) for row in rows.tolist())
    return [folder / "points.npy", folder / "points.csv"]


def _wire(store: Store, run: str, folder: Path) -> list[Path]:
    offset = 0
    with (folder / "wire.bin").open("wb") as raw, (folder / "wire.csv").open("w", newline="", encoding="utf-8") as index:
        writer = csv.writer(index)
        writer.writerow(WIRE_COLUMNS)
        for read in reads_of(store, run):
            raw.write(read.data)
            writer.writerow((read.time_s, offset, len(read.data)))
            offset += len(read.data)
    return [folder / "wire.bin", folder / "wire.csv"]


def _result(store: Store, run: str, folder: Path) -> list[Path]:
    recorded = recorded_run(store, run)
    if recorded.result is None or recorded.end is None:
        return []
    ending = str(recorded.end["state"])
    blocks = (unpack_judged(record.body) for record in store.records(run, "deviations"))
    write_deviations(blocks, folder / "deviations.csv", ending)
    return [
        folder / "deviations.csv",
        _json(folder / "result.json", recorded.result | ({} if ending == "complete" else {"ending": ending})),
    ]


def _json(path: Path, document: Any) -> Path:
    path.write_text(json.dumps(document, indent=2, ensure_ascii=False) + "\n", encoding="utf-8")
    return path
