"""From one key of a station to the next: a record that both keys have signed, so that runs of before and of afterwards are one station's.

Signed is the line `cmmlink key` and behind it the record without its two signatures, as JSON with sorted keys on one line.
"""

from collections.abc import Iterable, Iterator, Mapping
from datetime import datetime
from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field

from cmmlink.errors import PlanError
from cmmlink.record.bodies import pack_document, unpack_document
from cmmlink.record.chain import Draft, Record
from cmmlink.record.seal import KEY_FILE, PUBLIC_FILE
from cmmlink.record.shapes import Moment, checked
from cmmlink.record.signature import key_id_of
from cmmlink.record.store import Store, name_record
from cmmlink.words import utc_words

NO_RUN = ""  # the run of a record that belongs to the station
_NEW = "station.key.new"


class Handover(BaseModel):
    """One key handed over to another.

    before, after : the public keys, in 64 hexadecimal digits
    signed_before, signed_after : the signatures of both
    """

    model_config = ConfigDict(strict=True, extra="forbid", frozen=True)

    before: Annotated[str, Field(pattern="^[0-9a-f]{64}$")]
    after: Annotated[str, Field(pattern="^[0-9a-f]{64}$")]
    when: Moment
    who: str
    why: str
    signed_before: Annotated[str, Field(pattern="^[0-9a-f]{128}$")]
    signed_after: Annotated[str, Field(pattern="^[0-9a-f]{128}$")]


def rotate_key(store: Store, *, who: str, why: str, now: datetime) -> Handover:
    """Give the station a new key, which the old one hands over to in the records. The old private key is gone afterwards.

    Whatever ends the program meanwhile, the key that is there is one that the records know. Raises PlanError where a key cannot be
    used, StoreError where the records cannot be kept.
    """
    from cmmlink.record.keys import make_key, read_key, write_public_key  # noqa: PLC0415 - only who signs loads the library of signatures

    folder = store.path.parent
    old = read_key(folder / KEY_FILE)
    try:
        (folder / _NEW).unlink(missing_ok=True)  # of a rotation that did not come to its end: nothing was signed with it
        new, when = make_key(folder / _NEW), utc_words(now)
        told = {"before": old.public_key, "after": new.public_key, "when": when, "who": who, "why": why}
        message = _message(told)
        kept = Handover(**told, signed_before=old.sign(message), signed_after=new.sign(message))
        store.append([Draft(NO_RUN, "key", pack_document(kept.model_dump()))])
        (folder / _NEW).replace(folder / KEY_FILE)
        write_public_key(folder / PUBLIC_FILE, new.public_key)
    except OSError as error:
        raise PlanError(f"{folder}: the key cannot be written: {error.strerror or error}") from None
    return kept


def handovers_of(store: Store) -> Iterator[tuple[Record, Handover]]:
    """Every handover with its record, oldest first. Raises StoreError where one cannot be read."""
    for record in store.records(NO_RUN, "key"):
        with name_record(store.path, record):
            yield record, checked(Handover, unpack_document(record.body))


def is_sound(handover: Handover) -> bool:
    """Whether both keys have signed it."""
    from cmmlink.record.keys import is_signed  # noqa: PLC0415 - as above

    message = _message(handover.model_dump(exclude={"signed_before", "signed_after"}))
    signed = ((handover.before, handover.signed_before), (handover.after, handover.signed_after))
    return all(is_signed(message, key, signature) for key, signature in signed)


def of_one_station(key: str, handovers: Iterable[Handover]) -> set[str]:
    """The keys that a key was handed over to or from, also by way of others, with the key itself."""
    known, waiting = {key}, [key]
    pairs = [(one.before, one.after) for one in handovers]
    while waiting:
        here = waiting.pop()
        beside = {b for a, b in pairs if a == here} | {a for a, b in pairs if b == here}
        waiting += sorted(beside - known)
        known |= beside
    return known


def handover_words(handover: Handover) -> str:
    """A handover in one line."""
    return f"{handover.when}: key {key_id_of(handover.before)} handed over to {key_id_of(handover.after)} ({handover.who}, {handover.why})"


def _message(told: Mapping[str, str]) -> bytes:
    return b"cmmlink key\n" + pack_document(dict(told)) + b"\n"
