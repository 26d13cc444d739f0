"""The hash-chained record of every run: written, read, replayed, exported. This is the front door of the package."""

TYPE_CHECKING = False  # as type checkers read it; `typing` itself takes longer to load than all of this

if TYPE_CHECKING:
    from cmmlink.record.against import disagreements, read_result
    from cmmlink.record.backup import Copied, back_up, merge, restore
    from cmmlink.record.bodies import unpack_judged
    from cmmlink.record.chain import Draft, Record
    from cmmlink.record.derived import Change, derived_of
    from cmmlink.record.evidence import Evidence, is_evidence, open_evidence
    from cmmlink.record.export import export_run
    from cmmlink.record.origin import origin_of
    from cmmlink.record.reader import (
        RecordedRun,
        arrivals_of,
        check_chain,
        default_folder,
        describe,
        earlier_run,
        end_missing,
        find_run,
        find_stack,
        last_serial_number,
        list_runs,
        open_to_read,
        open_to_record,
        points_of,
        reads_of,
        recorded_result,
        recorded_run,
    )
    from cmmlink.record.recorder import QUEUE_BYTES, Recorder, RecordReference, RunInputs, software
    from cmmlink.record.replay import Replay, keep_judgement, recorded_plan, recorded_profile, replay_run
    from cmmlink.record.search import RunSearch, VerdictSought
    from cmmlink.record.station_lock import PATIENCE_S
    from cmmlink.record.store import FILE_NAME, Store
else:
    from cmmlink.front_door import load_on_use

    _PLACES = {
        "cmmlink.record.against": ("disagreements", "read_result"),
        "cmmlink.record.backup": ("Copied", "back_up", "merge", "restore"),
        "cmmlink.record.bodies": ("unpack_judged",),
        "cmmlink.record.chain": ("Draft", "Record"),
        "cmmlink.record.derived": ("Change", "derived_of"),
        "cmmlink.record.evidence": ("Evidence", "is_evidence", "open_evidence"),
        "cmmlink.record.export": ("export_run",),
        "cmmlink.record.origin": ("origin_of",),
        "cmmlink.record.reader": (
            "RecordedRun",
            "arrivals_of",
            "check_chain",
            "default_folder",
            "describe",
            "end_missing",
            "earlier_run",
            "earlier_run",
            "find_run",
            "find_stack",
            "last_serial_number",
            "last_serial_number",
            "list_runs",
            "open_to_read",
            "open_to_record",
            "points_of",
            "reads_of",
            "recorded_result",
            "recorded_run",
        ),
        "cmmlink.record.recorder": ("QUEUE_BYTES", "Recorder", "RecordReference", "RunInputs", "software"),
        "cmmlink.record.replay": ("Replay", "keep_judgement", "recorded_plan", "recorded_profile", "replay_run"),
        "cmmlink.record.search": ("RunSearch", "VerdictSought"),
        "cmmlink.record.station_lock": ("PATIENCE_S",),
        "cmmlink.record.store": ("FILE_NAME", "Store"),
    }

    __getattr__ = load_on_use(__name__, _PLACES)


__all__ = [
    "FILE_NAME",
    "PATIENCE_S",
    "QUEUE_BYTES",
    "Change",
    "Copied",
    "Draft",
    "Evidence",
    "Record",
    "RecordReference",
    "RecordedRun",
    "Recorder",
    "Replay",
    "RunInputs",
    "RunSearch",
    "Store",
    "VerdictSought",
    "arrivals_of",
    "back_up",
    "check_chain",
    "default_folder",
    "derived_of",
    "describe",
    "disagreements",
    "earlier_run",
    "end_missing",
    "export_run",
    "find_run",
    "find_stack",
    "is_evidence",
    "keep_judgement",
    "last_serial_number",
    "list_runs",
    "merge",
    "open_evidence",
    "open_to_read",
    "open_to_record",
    "origin_of",
    "points_of",
    "read_result",
    "reads_of",
    "recorded_plan",
    "recorded_profile",
    "recorded_result",
    "recorded_run",
    "replay_run",
    "restore",
    "software",
    "unpack_judged",
]
