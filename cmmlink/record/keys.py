"""The keys that runs are signed with: Ed25519 (RFC 8032), made, read and used. The one file that knows the library of signatures.

A private key is a PEM file (PKCS 8) that only the account which made it can read. A public key is told as 64 hexadecimal digits, and
called by the first 16 of the SHA-256 of its 32 bytes.
"""

import getpass
import os
import re
import subprocess
import tempfile
from dataclasses import dataclass
from pathlib import Path

from cryptography.exceptions import InvalidSignature, UnsupportedAlgorithm
from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey, Ed25519PublicKey
from cryptography.hazmat.primitives.serialization import (
    Encoding,
    NoEncryption,
    PrivateFormat,
    PublicFormat,
    load_pem_private_key,
    load_pem_public_key,
)

from cmmlink.errors import PlanError
from cmmlink.record.signature import key_id_of

_EXPECTED = "expected the PEM file of an Ed25519 key, as `cmmlink key new FILE` writes it"
_LONGEST_FILE = 1 << 16
_PATIENCE_S = 10.0  # for the program of Windows that sets who may read a file
_OTHERS = 0o077


@dataclass(frozen=True, slots=True)
class SigningKey:
    """A private key in use. `public_key` is its public part, in 64 hexadecimal digits."""

    private: Ed25519PrivateKey
    public_key: str

    def __repr__(self) -> str:
        return f"<SigningKey {self.key_id}>"

    @property
    def key_id(self) -> str:
        """What the key is called."""
        return key_id_of(self.public_key)

    def sign(self, message: bytes) -> str:
        """Sign a message; the signature in 128 hexadecimal digits."""
        return self.private.sign(message).hex()


def make_key(file: Path) -> SigningKey:
    """Make a key and write it to a file that only this account can read. Raises PlanError where that cannot be done.

    The file is there as a whole or not at all, whatever ends the program. A file that is there already is never written over.
    """
    private = Ed25519PrivateKey.generate()
    pem = private.private_bytes(Encoding.PEM, PrivateFormat.PKCS8, NoEncryption())
    if file.exists():
        raise PlanError(f"{file}: there is a file of this name already; a key is never written over")
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        handle, name = tempfile.mkstemp(prefix=".key-", dir=file.parent)  # for this account alone from its first moment
        part = Path(name)
        try:
            with open(handle, "wb") as written:
                _shut_out_others(part)
                written.write(pem)
                written.flush()
                os.fsync(written.fileno())
            part.replace(file)
        finally:
            part.unlink(missing_ok=True)
    except OSError as error:
        raise PlanError(f"{file}: the key cannot be written: {error.strerror or error}") from None
    return _in_use(private)


def read_key(file: Path) -> SigningKey:
    """Read a private key. Raises PlanError, which says what is wrong with it."""
    try:
        private = load_pem_private_key(_content(file), password=None)
    except TypeError:
        raise PlanError(f"{file}: the key is protected by a passphrase, which nobody can be asked for while a machine waits") from None
    except (ValueError, UnsupportedAlgorithm):
        raise PlanError(f"{file}: this is no private key; {_EXPECTED}") from None
    if not isinstance(private, Ed25519PrivateKey):
        raise PlanError(f"{file}: this is a key of another kind; {_EXPECTED}")
    return _in_use(private)


def readable_by_others(file: Path) -> bool:
    """Whether other accounts of this computer may read a file; what Windows allows is not looked up."""
    try:
        return os.name == "posix" and bool(file.stat().st_mode & _OTHERS)
    except OSError:
        return False


def write_public_key(file: Path, public_key: str) -> None:
    """Write a public key as a PEM file, for whoever verifies. Raises OSError."""
    public = Ed25519PublicKey.from_public_bytes(bytes.fromhex(public_key))
    file.write_bytes(public.public_bytes(Encoding.PEM, PublicFormat.SubjectPublicKeyInfo))


def public_key_given(given: str) -> str:
    """The public key that somebody gave: in 64 hexadecimal digits, or as 16 of its id. Raises PlanError where it is none.

    given : the digits themselves, or a file that holds them or a public key as PEM
    """
    if digits := _digits(given):
        return digits
    file = Path(given)
    content = _content(file)
    if digits := _digits(content.decode("ascii", "replace")):
        return digits
    try:
        public = load_pem_public_key(content)
    except (ValueError, UnsupportedAlgorithm):
        raise PlanError(f"{file}: this is no public key; expected a PEM file like station.pub, or its 64 hexadecimal digits") from None
    if not isinstance(public, Ed25519PublicKey):
        raise PlanError(f"{file}: this is a public key of another kind; expected one of Ed25519")
    return public.public_bytes(Encoding.Raw, PublicFormat.Raw).hex()


def is_signed(message: bytes, public_key: str, signature: str) -> bool:
    """Whether a message was signed by the owner of a key, both in hexadecimal digits."""
    try:
        Ed25519PublicKey.from_public_bytes(bytes.fromhex(public_key)).verify(bytes.fromhex(signature), message)
    except (InvalidSignature, ValueError):
        return False
    return True


def _in_use(private: Ed25519PrivateKey) -> SigningKey:
    return SigningKey(private, private.public_key().public_bytes(Encoding.Raw, PublicFormat.Raw).hex())


def _digits(text: str) -> str:
    digits = text.strip().lower()
    return digits if re.fullmatch("[0-9a-f]{64}|[0-9a-f]{16}", digits) else ""


def _content(file: Path) -> bytes:
    try:
        with file.open("rb") as opened:
            return opened.read(_LONGEST_FILE)
    except (OSError, ValueError) as error:  # a name with a zero byte is a ValueError
        raise PlanError(f"{file}: the key cannot be read: {getattr(error, 'strerror', None) or error}") from None


def _shut_out_others(file: Path) -> None:
    """On Windows, take from a new file what it inherits of its folder. Raises OSError. Elsewhere it is made so."""
    if os.name != "nt":
        return
    try:
        asked = ["icacls", str(file), "/inheritance:r", "/grant:r", f"{getpass.getuser()}:F"]
        done = subprocess.run(asked, capture_output=True, timeout=_PATIENCE_S, check=False)
    except (subprocess.TimeoutExpired, KeyError) as error:
        raise OSError(0, f"who may read it could not be set: {error}") from None
    if done.returncode:
        raise OSError(0, f"who may read it could not be set: icacls ended with {done.returncode}")
