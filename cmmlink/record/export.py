"""A recorded run as files that any program reads."""

import csv
import json
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from cmmlink.deviations_csv import write_deviations
from cmmlink.errors import PlanError, StoreError
from cmmlink.record.bodies import unpack_judged
from cmmlink.record.evidence import write_chain
from cmmlink.record.reader import RecordedRun, arrivals_of, describe, event_document, points_of, reads_of, recorded_run
from cmmlink.record.recorded_inputs import recorded_plan
from cmmlink.record.recorded_nominal import recorded_profile
from cmmlink.record.shapes import plain_name
from cmmlink.record.signature import signature_of
from cmmlink.record.store import Store
from cmmlink.record.surface_bodies import unpack_surface
from cmmlink.result_files import NewFiles, new_files
from cmmlink.surface_csv import write_surface_deviations
from cmmlink.zone_file import nominal_document, zone_document

POINT_COLUMNS = {
    "sequence": "the device's own counter of the point, unwrapped",
    "time_s": "the time of the point by the device's own clock, 0 where it has none",
    "x_mm": "x in machine coordinates",
    "y_mm": "y in machine coordinates",
    "z_mm": "z in machine coordinates",
}
NORMAL_COLUMNS = {f"n{axis}": f"{axis} of the outward direction that the scan gives, nan where it gives none" for axis in "xyz"}
WIRE_COLUMNS = {
    "time_s": "when the bytes were read, by the clock of the run",
    "offset": "where they begin in wire.bin",
    "bytes": "how many they are",
}


def export_run(store: Store, run: str, folder: Path) -> list[Path]:
    """Write a run to a folder. Returns the files written; raises PlanError when the folder cannot be written.

    run.json: all but the points; events.json; points.csv and points.npy (m, 5): sequence, time_s, x, y, z in mm, and (m, 8) with nx, ny,
    nz where the scan gave normals;
    wire.bin, the bytes as they arrived, and wire.csv, when; plan.yaml; the nominal's file; of a run with a result
    deviations.csv and result.json, and zone.json where it has a certificate. nominal.json is the curve that was made of the nominal's
    file; records.bin, the records as they are hashed, and chain.csv, their hashes, are what somebody else recomputes the chain from;
    signature.json says who signed the run, where somebody did, timestamp.tsr when an authority stamped its end.
    """
    try:
        with new_files(folder) as files:
            _documents(store, run, files)
            _points(store, run, files)
            _wire(store, run, files)
            _result(store, run, files)
            write_chain(store, run, files)
            _signature(store, run, files)
        return [folder / name for name in files.names]
    except OSError as error:
        raise PlanError(f"{folder}: the run cannot be written there ({error.strerror}); choose another folder with --out") from None


def _documents(store: Store, run: str, files: NewFiles) -> None:
    recorded = recorded_run(store, run)
    files(f"nominal-{plain_name(recorded.header['nominal'])}").write_bytes(recorded.nominal)
    files("plan.yaml").write_bytes(recorded.plan.encode())
    _json(files("run.json"), describe(store, run))
    _json(files("events.json"), [event_document(moment) for moment in arrivals_of(store, run)])


def _points(store: Store, run: str, files: NewFiles) -> None:
    totals = store.totals(run)
    count, with_normals = totals.get("points", (0, 0))[1], "normals" in totals
    columns = (*POINT_COLUMNS, *(NORMAL_COLUMNS if with_normals else ()))
    array_path, table_path = files.together("points.npy", "points.csv")
    with array_path.open("wb") as array, table_path.open("w", newline="", encoding="utf-8") as file:
        np.lib.format.write_array_header_1_0(array, {"descr": "<f8", "fortran_order": False, "shape": (count, len(columns))})
        writer = csv.writer(file)
        writer.writerow(columns)
        for batch in points_of(store, run):
            rows = np.column_stack([batch.sequence, batch.time_s, batch.points_mm])
            if with_normals:
                rows = np.column_stack([rows, np.full((len(rows), 3), np.nan) if batch.normals is None else batch.normals])
            array.write(rows.astype("<f8").tobytes())
            writer.writerows((int(row[0]), *row[1:]) for row in rows.tolist())


def _wire(store: Store, run: str, files: NewFiles) -> None:
    offset = 0
    raw_path, index_path = files.together("wire.bin", "wire.csv")
    with raw_path.open("wb") as raw, index_path.open("w", newline="", encoding="utf-8") as index:
        writer = csv.writer(index)
        writer.writerow(WIRE_COLUMNS)
        for read in reads_of(store, run):
            raw.write(read.data)
            writer.writerow((read.time_s, offset, len(read.data)))
            offset += len(read.data)


def _result(store: Store, run: str, files: NewFiles) -> None:
    recorded = recorded_run(store, run)
    if recorded.result is None or recorded.end is None:
        return
    ending = str(recorded.end["state"])
    rows = (record.body for record in store.records(run, "deviations"))
    if recorded.is_of_surface:
        write_surface_deviations(map(unpack_surface, rows), files("deviations.csv"), ending)
    else:
        write_deviations(map(unpack_judged, rows), files("deviations.csv"), ending)
        _nominal(recorded, recorded.result, files)
    _json(files("result.json"), recorded.result | ({} if ending == "complete" else {"ending": ending}))


def _nominal(recorded: RecordedRun, result: Mapping[str, Any], files: NewFiles) -> None:
    """The curve that was made of the nominal's file, and the certificates that stand on it."""
    with suppress(ValueError, StoreError):  # a plan or nominal that cannot be read has no curve; all else is written all the same
        profile = recorded_profile(recorded_plan(recorded), recorded)
        _json(files("nominal.json"), nominal_document(profile))
        zones = zone_document(result, profile)
        if zones is not None:
            _json(files("zone.json"), zones)


def _signature(store: Store, run: str, files: NewFiles) -> None:
    signature = signature_of(store, run)
    if signature is not None:
        _json(files("signature.json"), asdict(signature))
    stamps = [record.body for record in store.records(run, "timestamp")]
    if stamps:
        files("timestamp.tsr").write_bytes(stamps[-1])


def _json(path: Path, document: Any) -> None:
    path.write_text(json.dumps(document, indent=2, ensure_ascii=False) + "\n", encoding="utf-8")
