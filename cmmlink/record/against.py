"""A result file held against the records it came from: the anchor that a chain inside its own file cannot have."""

import hashlib
import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from cmmlink.errors import PlanError, RunError
from cmmlink.record.bodies import pack_document
from cmmlink.record.origin import original_chain_sha256
from cmmlink.record.reader import RecordedRun, recorded_run
from cmmlink.record.recorder import result_sha256
from cmmlink.record.store import Store

_SHORTEST_CHAIN = 64  # digits of a SHA-256


def read_result(file: Path) -> dict[str, Any]:
    """Read the `result.json` of a run. Raises PlanError where it is none."""
    try:
        document = json.loads(file.read_bytes())
    except OSError as error:
        raise PlanError(f"{file}: cannot be read ({error.strerror}); give the result.json of a run") from None
    except (ValueError, RecursionError):
        raise PlanError(f"{file}: this is no JSON; give the result.json of a run") from None
    named = isinstance(document, dict) and all(isinstance(document.get(key), str) for key in ("run", "chain_sha256"))
    if not named or "replay_of" in document or len(document["chain_sha256"]) != _SHORTEST_CHAIN:
        raise PlanError(f"{file}: it names no run and no chain_sha256; give the result.json that a recorded run wrote")
    return dict(document)


def disagreements(store: Store, result: Mapping[str, Any]) -> list[str]:
    """What a result file says otherwise than the records, in words; nothing where they agree. Raises StoreError.

    The last hash of the run covers every record before it, so where it agrees, and the chain is whole, none of them was changed,
    cut off or added since the result was written. Of a run that was taken over from another station that is so of the run alone.
    """
    run = str(result["run"])
    try:
        recorded = recorded_run(store, run) if run in {str(begin.run) for begin, _ in store.begins_and_ends()} else None
    except RunError:
        recorded = None
    if recorded is None:
        return [f"run {run} is not in the records: it was deleted or cut off, or these are the records of another station"]
    return list(_differences(store, recorded, result))


def _differences(store: Store, recorded: RecordedRun, result: Mapping[str, Any]) -> Iterator[str]:
    run, end = recorded.run, recorded.end
    if end is None:
        yield f"the end of run {run} is not in the records: it was deleted or cut off"
        return
    if result["chain_sha256"] not in (recorded.chain_sha256, original_chain_sha256(store, run)):
        yield f"the chain of run {run} ends with {recorded.chain_sha256 or 'nothing'}, the result says {result['chain_sha256']}"
    rows = (record.body for record in store.records(run, "deviations"))
    kept = recorded.result
    if kept is not None and result_sha256(kept, rows) != end["result_sha256"]:
        yield f"the result and deviations of run {run} are not those that its end was written for"
    for key, value in (recorded.result or {}).items():
        if key not in result:
            yield f"{key} is {_short(value)} in the records and missing in the result"
    for key, value in _expected(recorded).items():
        if key in result and pack_document(result[key]) != pack_document(value):
            yield f"{key} is {_short(value)} in the records, {_short(result[key])} in the result"


def _expected(recorded: RecordedRun) -> dict[str, Any]:
    """What the result file of a run has to say, as far as the records hold it."""
    header, end = recorded.header, recorded.end or {}
    told: dict[str, Any] = dict(recorded.result or {})
    told |= {key: header[key] for key in ("part", "device", "simulated", "software")}
    told |= {key: header[key] or None for key in ("serial_number", "operator")}
    told |= {key: header[key] for key in ("qualification",) if key in header}  # which earlier versions did not name
    told["ending"] = end["state"]
    told["plan_sha256"] = hashlib.sha256(recorded.plan.encode()).hexdigest()
    told["nominal_sha256"] = hashlib.sha256(recorded.nominal).hexdigest()
    return told


def _short(value: object) -> str:
    text = json.dumps(value)
    return text if len(text) <= 80 else f"{text[:77]}..."
