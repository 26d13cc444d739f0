"""What a signed run says: who signed the hash of its end. The record of it stands behind the end, written together with it.

Signed is `cmmlink run`, the id of the run and the hash of its end, a line each. That hash follows from every record of the run and from
every run before it. What is added behind the end later has a signature of its own, which goes with it when the run is merged.
"""

import hashlib
from dataclasses import asdict, dataclass
from typing import Annotated, Any, Literal

from pydantic import Field

from cmmlink.record.bodies import pack_document, unpack_document
from cmmlink.record.chain import Draft, Record
from cmmlink.record.shapes import checked
from cmmlink.record.store import Store, name_record

_SHORT = 16  # digits of a key's id
_Digits64 = Annotated[str, Field(pattern=r"^[0-9a-f]{64}$")]
_Digits128 = Annotated[str, Field(pattern=r"^[0-9a-f]{128}$")]
_KeyId = Annotated[str, Field(pattern=r"^[0-9a-f]{16}$")]


def key_id_of(public_key: str) -> str:
    """What a key is called: the first digits of the SHA-256 of its public part."""
    return hashlib.sha256(bytes.fromhex(public_key)).hexdigest()[:_SHORT]


@dataclass(frozen=True, slots=True, kw_only=True)
class Signature:
    """The signature of a run, all of it in lower-case hexadecimal digits.

    chain_sha256 : the hash of the run's end at the station that measured it
    """

    algorithm: Literal["Ed25519"] = "Ed25519"
    run: str
    chain_sha256: _Digits64
    public_key: _Digits64
    signature: _Digits128
    key_id: _KeyId

    @property
    def message(self) -> bytes:
        """What was signed."""
        return signed_message(self.run, self.chain_sha256)

    def draft(self) -> Draft:
        """The record that keeps it."""
        return Draft(self.run, "signature", pack_document(asdict(self)))

    def beside_result(self) -> dict[str, Any]:
        """The signature as a result has it, which names run and hash itself."""
        return {key: value for key, value in asdict(self).items() if key not in ("run", "chain_sha256")}


@dataclass(frozen=True, slots=True, kw_only=True)
class Countersignature:
    """The signature of one record that was added behind the end of a run.

    body_sha256 : the hash of its body alone, so that it holds wherever the record stands
    """

    algorithm: Literal["Ed25519"] = "Ed25519"
    run: str
    kind: str
    time_s: float
    count: int
    body_sha256: _Digits64
    public_key: _Digits64
    signature: _Digits128
    key_id: _KeyId

    @property
    def message(self) -> bytes:
        """What was signed."""
        return f"cmmlink record\n{self.run}\n{self.kind}\n{self.time_s!r}\n{self.count}\n{self.body_sha256}\n".encode()

    def draft(self) -> Draft:
        """The record that keeps it."""
        return Draft(self.run, "countersignature", pack_document(asdict(self)))

    def is_of(self, record: Record) -> bool:
        """Whether it says that it signs this record."""
        said = (self.run, self.kind, self.time_s, self.count, self.body_sha256)
        return said == (record.run, record.kind, record.time_s, record.count, hashlib.sha256(record.body).hexdigest())


def signed_message(run: str, chain_sha256: str) -> bytes:
    """What is signed of a run."""
    return f"cmmlink run\n{run}\n{chain_sha256}\n".encode()


def signature_in(store: Store, record: Record) -> Signature:
    """The signature in its record. Raises StoreError for what no signature looks like."""
    with name_record(store.path, record):
        return checked(Signature, unpack_document(record.body))


def countersignature_in(store: Store, record: Record) -> Countersignature:
    """The signature of another record in its own. Raises StoreError for what no such signature looks like."""
    with name_record(store.path, record):
        return checked(Countersignature, unpack_document(record.body))


def signature_of(store: Store, run: str) -> Signature | None:
    """The signature of a run, None where it has none. Raises StoreError where it cannot be read."""
    return next((signature_in(store, record) for record in store.records(run, "signature")), None)
