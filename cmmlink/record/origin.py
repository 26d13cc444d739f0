"""Where a run was taken over from: its place in the chain of the other station, which its result files were written from.

A run that is merged into the records of another station gets new hashes there. The record of its origin, behind its end, keeps what
is needed to recompute the old ones: so a result file that was written at the first station is still held against the run.
"""

from itertools import islice

from pydantic import BaseModel, ConfigDict

from cmmlink.errors import StoreError
from cmmlink.record.bodies import pack_document, unpack_document
from cmmlink.record.chain import Draft, hash_of
from cmmlink.record.shapes import Moment, checked
from cmmlink.record.store import Store, name_record


class Origin(BaseModel):
    """The place of a run in the chain of the station that measured it.

    file         : the name of the file that it was read from
    first        : the number of its first record there, and `records` how many follow one another up to its end
    previous     : the hash of the record before it
    chain_sha256 : the hash of its end
    merged       : when it was taken over, in UTC
    """

    model_config = ConfigDict(strict=True, extra="allow", frozen=True)

    file: str
    first: int
    records: int
    previous: str
    chain_sha256: str
    merged: Moment

    def draft(self, run: str) -> Draft:
        """The record that keeps it."""
        return Draft(run, "origin", pack_document(self.model_dump(mode="json")))


def origin_of(store: Store, run: str) -> Origin | None:
    """Where a run was taken over from; None for one that was recorded here. Raises StoreError where that cannot be read."""
    for record in store.records(run, "origin"):
        with name_record(store.path, record):
            return checked(Origin, unpack_document(record.body))
    return None


def original_chain_sha256(store: Store, run: str) -> str | None:
    """The hash of a run's end at the station that measured it, recomputed from what stands here; None for one that was recorded here."""
    origin = origin_of(store, run)
    if origin is None:
        return None
    try:
        previous = bytes.fromhex(origin.previous)
    except ValueError:
        raise StoreError(f"{store.path}: the origin of run {run} is not as cmmlink writes it; `cmmlink verify` says more") from None
    return hash_of(islice(store.records(run), origin.records), origin.first, previous).hex()
