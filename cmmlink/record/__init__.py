"""The hash-chained record of every run: written, read, replayed, exported. This is the front door of the package."""

from cmmlink.record.against import disagreements, read_result
from cmmlink.record.bodies import unpack_judged
from cmmlink.record.chain import Draft, Record
from cmmlink.record.export import export_run
from cmmlink.record.reader import (
    RecordedRun,
    arrivals_of,
    check_chain,
    default_folder,
    describe,
    end_missing,
    find_run,
    list_runs,
    open_to_read,
    open_to_record,
    points_of,
    reads_of,
    recorded_result,
    recorded_run,
)
from cmmlink.record.recorder import Recorder, RecordReference, RunInputs
from cmmlink.record.replay import Change, Replay, recorded_plan, recorded_profile, replay_run
from cmmlink.record.station_lock import PATIENCE_S
from cmmlink.record.store import FILE_NAME, Store

__all__ = [
    "FILE_NAME",
    "PATIENCE_S",
    "Change",
    "Draft",
    "Record",
    "RecordReference",
    "RecordedRun",
    "Recorder",
    "Replay",
    "RunInputs",
    "Store",
    "arrivals_of",
    "check_chain",
    "default_folder",
    "describe",
    "disagreements",
    "end_missing",
    "export_run",
    "find_run",
    "list_runs",
    "open_to_read",
    "open_to_record",
    "points_of",
    "read_result",
    "reads_of",
    "recorded_plan",
    "recorded_profile",
    "recorded_result",
    "recorded_run",
    "replay_run",
    "unpack_judged",
]
