"""What a recorded run was found to be when it was judged again with something changed: by whom, when and why, chained to the run.

The record of the run itself stays as it is. What was found of every point is not kept: the plan is, and a replay with it gives the same.
"""

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ConfigDict

from cmmlink.record.bodies import pack_document, unpack_document
from cmmlink.record.chain import Draft, Record
from cmmlink.record.seal import Seal
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


@dataclass(frozen=True, slots=True, eq=False)
class Judgement:
    """What a run was found to be by a changed plan, as it is kept once somebody says why. It may come from another process.

    run, run_chain_sha256 : the run, and the hash of its end
    changed, plan, software, result, result_sha256 : as in `Derived`
    key : the file of the key that its plan has runs signed with; None: the station's own
    """

    run: str
    run_chain_sha256: str
    changed: Sequence[Change]
    plan: str
    software: Mapping[str, str]
    result: Mapping[str, Any]
    result_sha256: str
    key: Path | None

    def draft(self, *, when: str, who: str, why: str) -> Draft:
        """The record that keeps it."""
        kept = Derived(
            run=self.run,
            run_chain_sha256=self.run_chain_sha256,
            when=when,
            who=who,
            why=why,
            changed=[_Changed(**asdict(change)) for change in self.changed],
            plan=self.plan,
            software=dict(self.software),
            result=dict(self.result),
            result_sha256=self.result_sha256,
        )
        return Draft(self.run, "derived", pack_document(kept.model_dump(mode="json")))


def keep_judgements(store: Store, judgements: Sequence[Judgement], *, who: str, why: str, when: str, seal: Seal | None) -> list[Record]:
    """Add judgements to the records in one transaction, each chained and signed. Raises StoreError: then none is added."""
    drafts = [one.draft(when=when, who=who, why=why) for one in judgements]
    return store.append_each(drafts, seal.countersign if seal else lambda _: [])


def means_of(plan: str, software: Mapping[str, str]) -> str:
    """What a run was judged by, as one hash: the whole plan, and the version of cmmlink."""
    return hashlib.sha256(f"{software.get('cmmlink')}\n{plan}".encode()).hexdigest()


def judged_by_means(store: Store, run: str) -> dict[str, Derived]:
    """Every judgement of a run that is on record, by its means; of several by the same, the last. Raises StoreError."""
    found = (_derived_in(store, record) for record in store.records(run, "derived"))
    return {means_of(kept.plan, kept.software): kept for kept in found}


def derived_of(store: Store, run: str) -> list[dict[str, Any]]:
    """Every judgement of a run that is on record, oldest first, without its plan and its result but with its verdict and its hash.

    Raises StoreError where one cannot be read.
    """
    found = []
    for record in store.records(run, "derived"):
        kept = _derived_in(store, record)
        with name_record(store.path, record):
            verdict = checked(Result, kept.result).verdict
        told = {"when": kept.when, "who": kept.who, "why": kept.why, "changed": [change.model_dump() for change in kept.changed]}
        found.append({**told, "verdict": verdict, "chain_sha256": bytes(record.sha256).hex()})
    return found


def _derived_in(store: Store, record: Record) -> Derived:
    with name_record(store.path, record):
        return checked(Derived, unpack_document(record.body))
