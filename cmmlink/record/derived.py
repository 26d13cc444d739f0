"""What a recorded run was found to be when it was judged again with something changed: by whom, when and why, chained to the run.

The record of the run itself stays as it is. What was found of every point is not kept: the plan is, and a replay with it gives the same.
"""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

from pydantic import BaseModel, ConfigDict

from cmmlink.record.bodies import pack_document, unpack_document
from cmmlink.record.chain import Draft
from cmmlink.record.shapes import Moment, Result, checked
from cmmlink.record.store import Store, name_record


@dataclass(frozen=True, slots=True)
class Change:
    """A value that is not as it was in the recorded run."""

    key: str
    recorded: Any
    replayed: Any


class _Changed(BaseModel):
    """A change, as it is read."""

    model_config = ConfigDict(strict=True, frozen=True)

    key: str
    recorded: Any
    replayed: Any


class Derived(BaseModel):
    """A judgement of a recorded run.

    run, run_chain_sha256 : the run, and the hash of its end
    when, who, why        : in UTC, the operator, and the reason that was given
    changed               : what is not as in the run's plan, and not of its software
    plan                  : the whole plan that judged, as YAML
    result, result_sha256 : what was found, and the hash of it together with every deviation, to the last bit
    """

    model_config = ConfigDict(strict=True, extra="allow", frozen=True)

    run: str
    run_chain_sha256: str
    when: Moment
    who: str
    why: str
    changed: list[_Changed]
    plan: str
    software: dict[str, str]
    result: dict[str, Any]
    result_sha256: str


def derived_draft(
    run: str,
    run_chain_sha256: str,
    *,
    when: str,
    who: str,
    why: str,
    changed: Sequence[Change],
    plan: str,
    software: Mapping[str, str],
    result: Mapping[str, Any],
    result_sha256: str,
) -> Draft:
    """The record of a judgement; see the fields of `Derived`."""
    kept = Derived(
        run=run,
        run_chain_sha256=run_chain_sha256,
        when=when,
        who=who,
        why=why,
        changed=[_Changed(**asdict(change)) for change in changed],
        plan=plan,
        software=dict(software),
        result=dict(result),
        result_sha256=result_sha256,
    )
    return Draft(run, "derived", pack_document(kept.model_dump(mode="json")))


def derived_of(store: Store, run: str) -> list[dict[str, Any]]:
    """Every judgement of a run that is on record, oldest first, without its plan and its result but with its verdict and its hash.

    Raises StoreError where one cannot be read.
    """
    found = []
    for record in store.records(run, "derived"):
        with name_record(store.path, record):
            kept = checked(Derived, unpack_document(record.body))
            verdict = checked(Result, kept.result).verdict
        told = {"when": kept.when, "who": kept.who, "why": kept.why, "changed": [change.model_dump() for change in kept.changed]}
        found.append({**told, "verdict": verdict, "chain_sha256": bytes(record.sha256).hex()})
    return found
