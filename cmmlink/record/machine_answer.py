"""The answer that a machine was given, behind the end of its run: what was written, for which request and when, or why it was not sent.

It is recorded once it was sent, or could not be. Where the program was killed in between, no record claims anything.
"""

import re
from typing import Any

from pydantic import BaseModel, ConfigDict

from cmmlink.errors import StoreError
from cmmlink.events import Answered
from cmmlink.record.bodies import pack_document, unpack_document
from cmmlink.record.chain import Draft, Record
from cmmlink.record.seal import Seal
from cmmlink.record.shapes import End, Moment, checked
from cmmlink.record.store import Store, name_record
from cmmlink.words import VerdictName, utc_words

_PASSES = re.compile(r"^#[0-9]+=1\. \(1 CONFORM", re.MULTILINE)


class MachineAnswered(BaseModel):
    """What came of an answer.

    request, verdict : the number of the machine's request, and what it was told; None where there is none
    sent, problem    : whether the answer stood in its file, read back, and why not
    at               : when that was, in UTC
    text             : the whole answer, as it was written or was to be; None where nothing was to be written
    """

    model_config = ConfigDict(strict=True, extra="allow", frozen=True)

    request: int | None
    sent: bool
    verdict: VerdictName | None
    at: Moment
    problem: str | None
    text: str | None

    @property
    def passes(self) -> bool:
        """Whether it tells the machine that its part conforms, or was to."""
        return self.verdict == "conform" or _PASSES.search(self.text or "") is not None


def answer_document(answered: Answered) -> dict[str, Any]:
    """What came of an answer, as a result has it."""
    return {
        "request": answered.request,
        "sent": answered.state == "sent",
        "verdict": answered.verdict.word if answered.verdict is not None else None,
        "at": utc_words(answered.at),
        "problem": answered.problem or None,
    }


def keep_answer(store: Store, seal: Seal, run: str, answered: Answered) -> str:
    """Add what came of an answer to the records, chained to them and to its run. Returns why they do not hold it, nothing where they do."""
    kept = answer_document(answered) | {"text": answered.text or None}
    try:
        store.append([Draft(run, "answer", pack_document(kept))], seal.countersign)
    except StoreError as error:  # the run itself is on record, and the machine has its answer
        return str(error)
    return ""


def answer_of(store: Store, run: str) -> dict[str, Any] | None:
    """The answer of a run with the hash of its record; None where none is on record. Raises StoreError where it cannot be read."""
    for record in store.records(run, "answer"):
        with name_record(store.path, record):
            kept = checked(MachineAnswered, unpack_document(record.body))
        return {**kept.model_dump(include=set(MachineAnswered.model_fields)), "chain_sha256": bytes(record.sha256).hex()}
    return None


def problem_of_answer(record: Record, end: Record) -> str:
    """What is wrong with an answer on record behind the end of its run, nothing where it may stand there: only what conforms is passed."""
    try:
        kept, ended = checked(MachineAnswered, unpack_document(record.body)), checked(End, unpack_document(end.body))
    except StoreError as error:
        return str(error)
    if kept.passes and (ended.verdict, ended.state) != ("conform", "complete"):
        return "passes the part to the machine, but the run did not"
    return ""
