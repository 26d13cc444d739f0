"""What ends a run so that nobody can write it anew: the name of the station and its key, at hand before the run begins.

The station's own key, `station.key` beside the records, is made at the first run; `station.pub`, its public part, is for whoever
verifies. A key that somebody else keeps, as on a stick, signs in its place while its file is there. Where no key can be used the run is
measured and judged all the same: it is not signed, and a note beside its verdict says why.
"""

import hashlib
import logging
import platform
import re
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from cmmlink.errors import PlanError
from cmmlink.record.chain import Draft, Record
from cmmlink.record.signature import Countersignature, Signature, signed_message
from cmmlink.record.store import Store

if TYPE_CHECKING:
    from cmmlink.record.keys import SigningKey

KEY_FILE, PUBLIC_FILE = "station.key", "station.pub"
_LONGEST_NAME = 60
_log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class Seal:
    """How the runs of a station end.

    station : its name, one word
    key     : what signs; None where no key can be used
    notes   : what the reader of a verdict has to know of that
    """

    station: str
    key: "SigningKey | None"
    notes: tuple[str, ...] = ()

    def sign(self, end: Record) -> list[Draft]:
        """The signature of a run, to stand behind its end; nothing where no key can be used."""
        if self.key is None:
            return []
        run, chain_sha256 = end.run, end.sha256.hex()
        signed = self.key.sign(signed_message(run, chain_sha256))
        public_key, key_id = self.key.public_key, self.key.key_id
        return [Signature(run=run, chain_sha256=chain_sha256, public_key=public_key, signature=signed, key_id=key_id).draft()]

    def countersign(self, record: Record) -> list[Draft]:
        """The signature of a record that is added to a run which has ended, to stand behind it; nothing where no key can be used."""
        if self.key is None:
            return []
        unsigned = Countersignature(
            run=record.run,
            kind=record.kind,
            time_s=record.time_s,
            count=record.count,
            body_sha256=hashlib.sha256(record.body).hexdigest(),
            public_key=self.key.public_key,
            signature="",
            key_id=self.key.key_id,
        )
        return [replace(unsigned, signature=self.key.sign(unsigned.message)).draft()]


def seal_of(store: Store, *, station: str | None, key: Path | None) -> Seal:
    """How runs end that are added to these records, which are open to be written.

    station : the name of the station; None: that of this computer
    key     : the file of a key that somebody else keeps; None: the station's own, which is made where there is none yet
    """
    name = station_name(station)
    try:
        signing, notes = _own_key(store) if key is None else _key_in(key)
    except PlanError as error:
        return Seal(name, None, (f"the run is not signed: {error}",))
    except OSError as error:  # the folder does not even tell whether a key is there
        return Seal(name, None, (f"the run is not signed: {error.filename or store.path.parent}: {error.strerror or error}",))
    except ImportError as error:
        return Seal(name, None, (f"the run is not signed: the library of signatures cannot be used here ({error})",))
    return Seal(name, signing, notes)


def station_name(station: str | None) -> str:
    """The name of a station as one word, None for that of this computer."""
    word = re.sub(r"[^\w.-]+", "_", (station or platform.node()).strip(), flags=re.ASCII)
    return word[:_LONGEST_NAME].strip("_.") or "station"


def _own_key(store: Store) -> tuple["SigningKey", tuple[str, ...]]:
    """The station's own key, made where there is none. Raises PlanError."""
    from cmmlink.record.keys import make_key, read_key  # noqa: PLC0415 - only who signs or verifies loads the library of signatures

    folder = store.path.parent
    file = folder / KEY_FILE
    if file.exists():
        signing, notes = read_key(file), _notes_on(file)
    else:
        signing, notes = make_key(file), ()
        _log.info("the station's key %s was made: %s", signing.key_id, file)
        if store.holds("signature"):
            notes = (f"{file} was not there, so that a new key was made: runs before this one are signed with another key",)
    return signing, (*notes, *_keep_public_key(folder / PUBLIC_FILE, signing.public_key))


def _key_in(file: Path) -> tuple["SigningKey", tuple[str, ...]]:
    """The key that somebody else keeps. Raises PlanError where it is not there."""
    from cmmlink.record.keys import read_key  # noqa: PLC0415 - as above

    return read_key(file), _notes_on(file)


def _notes_on(file: Path) -> tuple[str, ...]:
    from cmmlink.record.keys import readable_by_others  # noqa: PLC0415 - as above

    if readable_by_others(file):
        return (f"{file}: other accounts of this computer may read the key that signs this run, and sign with it; `chmod 600` mends that",)
    return ()


def _keep_public_key(file: Path, public_key: str) -> tuple[str, ...]:
    """Keep the public key beside the private one; what stood there may have been put there by somebody else."""
    from cmmlink.record.keys import public_key_given, write_public_key  # noqa: PLC0415 - as above

    try:
        stood = public_key_given(str(file)) if file.exists() else ""
    except PlanError:
        stood = "what is no key"
    if stood == public_key:
        return ()
    try:
        write_public_key(file, public_key)
    except OSError as error:
        return (f"{file}: the station's public key cannot be written: {error.strerror or error}",)
    return (f"{file} held another key than {KEY_FILE}; it was written anew",) if stood else ()
