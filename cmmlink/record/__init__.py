"""The hash-chained record of every run: written, read, replayed, exported. This is the front door of the package."""

TYPE_CHECKING = False  # as type checkers read it; `typing` itself takes longer to load than all of this

if TYPE_CHECKING:
    from cmmlink.record.against import disagreements, read_result
    from cmmlink.record.agreement import Agreement
    from cmmlink.record.anchors import Head, Told, anchor_ends, anchors_of, heads_in
    from cmmlink.record.backup import Copied, back_up, merge, open_archive, restore
    from cmmlink.record.bodies import unpack_judged
    from cmmlink.record.chain import Draft, Record
    from cmmlink.record.changed_plan import with_changes
    from cmmlink.record.derived import Change, Derived, Judgement, derived_of, judged_by_means, keep_judgements, means_of
    from cmmlink.record.evidence import Evidence, is_evidence, open_evidence
    from cmmlink.record.export import export_run
    from cmmlink.record.handover import handover_words, handovers_of, rotate_key
    from cmmlink.record.kept_result import DocumentOf, document_of_section
    from cmmlink.record.keys import make_key, public_key_given, read_key
    from cmmlink.record.machine_answer import answer_document, answer_of, keep_answer
    from cmmlink.record.origin import origin_of
    from cmmlink.record.reader import (
        RecordedRun,
        arrivals_of,
        check_chain,
        default_folder,
        describe,
        earlier_run,
        end_missing,
        entries_of,
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
        run_header,
    )
    from cmmlink.record.recorded_inputs import recorded_plan, recorded_surface_plan
    from cmmlink.record.recorded_nominal import Nominals, recorded_profile
    from cmmlink.record.recorder import QUEUE_BYTES, Recorder, RecordReference
    from cmmlink.record.replay import Replay, judgement_of, keep_judgement, replay_run
    from cmmlink.record.run_inputs import RunInputs, software
    from cmmlink.record.seal import KEY_FILE, PUBLIC_FILE, Seal, seal_of, station_name
    from cmmlink.record.search import RunSearch, VerdictSought
    from cmmlink.record.signature import Signature, key_id_of, signature_of
    from cmmlink.record.station_lock import PATIENCE_S
    from cmmlink.record.store import FILE_NAME, Store, has_records
    from cmmlink.record.surface_bodies import unpack_surface
    from cmmlink.record.surface_replay import SurfaceReplay, recorded_surface, replay_surface
    from cmmlink.record.trust import trust_in
else:
    from cmmlink.front_door import load_on_use

    _PLACES = {
        "cmmlink.record.against": ("disagreements", "read_result"),
        "cmmlink.record.anchors": ("Head", "Told", "anchor_ends", "anchors_of", "heads_in"),
        "cmmlink.record.backup": ("Copied", "back_up", "merge", "open_archive", "restore"),
        "cmmlink.record.bodies": ("unpack_judged",),
        "cmmlink.record.chain": ("Draft", "Record"),
        "cmmlink.record.changed_plan": ("with_changes",),
        "cmmlink.record.agreement": ("Agreement",),
        "cmmlink.record.derived": ("Change", "Derived", "Judgement", "derived_of", "judged_by_means", "keep_judgements", "means_of"),
        "cmmlink.record.evidence": ("Evidence", "is_evidence", "open_evidence"),
        "cmmlink.record.export": ("export_run",),
        "cmmlink.record.handover": ("handover_words", "handovers_of", "rotate_key"),
        "cmmlink.record.kept_result": ("DocumentOf", "document_of_section"),
        "cmmlink.record.keys": ("make_key", "public_key_given", "read_key"),
        "cmmlink.record.machine_answer": ("answer_document", "answer_of", "keep_answer"),
        "cmmlink.record.origin": ("origin_of",),
        "cmmlink.record.reader": (
            "RecordedRun",
            "arrivals_of",
            "check_chain",
            "default_folder",
            "describe",
            "end_missing",
            "earlier_run",
            "entries_of",
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
            "run_header",
        ),
        "cmmlink.record.recorded_inputs": ("recorded_plan", "recorded_surface_plan"),
        "cmmlink.record.recorder": ("QUEUE_BYTES", "Recorder", "RecordReference"),
        "cmmlink.record.recorded_nominal": ("Nominals", "recorded_profile"),
        "cmmlink.record.replay": ("Replay", "judgement_of", "keep_judgement", "replay_run"),
        "cmmlink.record.run_inputs": ("RunInputs", "software"),
        "cmmlink.record.seal": ("KEY_FILE", "PUBLIC_FILE", "Seal", "seal_of", "station_name"),
        "cmmlink.record.search": ("RunSearch", "VerdictSought"),
        "cmmlink.record.signature": ("Signature", "key_id_of", "signature_of"),
        "cmmlink.record.station_lock": ("PATIENCE_S",),
        "cmmlink.record.store": ("FILE_NAME", "Store", "has_records"),
        "cmmlink.record.surface_bodies": ("unpack_surface",),
        "cmmlink.record.surface_replay": ("SurfaceReplay", "recorded_surface", "replay_surface"),
        "cmmlink.record.trust": ("trust_in",),
    }

    __getattr__ = load_on_use(__name__, _PLACES)


__all__ = [
    "FILE_NAME",
    "KEY_FILE",
    "PATIENCE_S",
    "PUBLIC_FILE",
    "QUEUE_BYTES",
    "Agreement",
    "Change",
    "Copied",
    "Derived",
    "DocumentOf",
    "Draft",
    "Evidence",
    "Head",
    "Judgement",
    "Nominals",
    "Record",
    "RecordReference",
    "RecordedRun",
    "Recorder",
    "Replay",
    "RunInputs",
    "RunSearch",
    "Seal",
    "Signature",
    "Store",
    "SurfaceReplay",
    "Told",
    "VerdictSought",
    "anchor_ends",
    "anchors_of",
    "answer_document",
    "answer_of",
    "arrivals_of",
    "back_up",
    "check_chain",
    "default_folder",
    "derived_of",
    "describe",
    "disagreements",
    "document_of_section",
    "earlier_run",
    "end_missing",
    "entries_of",
    "export_run",
    "find_run",
    "find_stack",
    "handover_words",
    "handovers_of",
    "has_records",
    "heads_in",
    "is_evidence",
    "judged_by_means",
    "judgement_of",
    "keep_answer",
    "keep_judgement",
    "keep_judgements",
    "key_id_of",
    "last_serial_number",
    "list_runs",
    "make_key",
    "means_of",
    "merge",
    "open_archive",
    "open_evidence",
    "open_to_read",
    "open_to_record",
    "origin_of",
    "points_of",
    "public_key_given",
    "read_key",
    "read_result",
    "reads_of",
    "recorded_plan",
    "recorded_profile",
    "recorded_result",
    "recorded_run",
    "recorded_surface",
    "recorded_surface_plan",
    "replay_run",
    "replay_surface",
    "restore",
    "rotate_key",
    "run_header",
    "seal_of",
    "signature_of",
    "software",
    "station_name",
    "trust_in",
    "unpack_judged",
    "unpack_surface",
    "with_changes",
]
