"""What a signed run says: who signed the hash of its end. The record of it stands behind the end, written together with it.

Signed is `cmmlink run`, the id of the run and the hash of its end, a line each. That hash follows from every record of the run and from
every run before it.
"""

import hashlib
from collections.abc import Callable
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field

from cmmlink.record.bodies import pack_document, unpack_document
from cmmlink.record.chain import Draft, Record
from cmmlink.record.shapes import checked
from cmmlink.record.store import Store, name_record

_SHORT = 16  # digits of a key's id
Sign = Callable[[str, bytes], "Signature"]
"""Signs a run: of its id and the hash of its end."""


def key_id_of(public_key: str) -> str:
    """What a key is called: the first digits of the SHA-256 of its public part."""
    return hashlib.sha256(bytes.fromhex(public_key)).hexdigest()[:_SHORT]


class Signature(BaseModel):
    """The signature of a run, all of it in lower-case hexadecimal digits.

    chain_sha256 : the hash of the run's end at the station that measured it
    """

    model_config = ConfigDict(strict=True, extra="forbid", frozen=True)

    algorithm: Literal["Ed25519"] = "Ed25519"
    run: str
    chain_sha256: Annotated[str, Field(pattern=r"^[0-9a-f]{64}$")]
    public_key: Annotated[str, Field(pattern=r"^[0-9a-f]{64}$")]
    signature: Annotated[str, Field(pattern=r"^[0-9a-f]{128}$")]
    key_id: Annotated[str, Field(pattern=r"^[0-9a-f]{16}$")]

    @property
    def message(self) -> bytes:
        """What was signed."""
        return signed_message(self.run, self.chain_sha256)

    def draft(self) -> Draft:
        """The record that keeps it."""
        return Draft(self.run, "signature", pack_document(self.model_dump()))

    def beside_result(self) -> dict[str, Any]:
        """The signature as a result has it, which names run and hash itself."""
        return self.model_dump(exclude={"run", "chain_sha256"})


def signed_message(run: str, chain_sha256: str) -> bytes:
    """What is signed of a run."""
    return f"cmmlink run\n{run}\n{chain_sha256}\n".encode()


def signature_in(store: Store, record: Record) -> Signature:
    """The signature in its record. Raises StoreError for what no signature looks like."""
    with name_record(store.path, record):
        return checked(Signature, unpack_document(record.body))


def signature_of(store: Store, run: str) -> Signature | None:
    """The signature of a run, None where it has none. Raises StoreError where it cannot be read."""
    return next((signature_in(store, record) for record in store.records(run, "signature")), None)
