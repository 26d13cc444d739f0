"""Time stamps by RFC 3161: an authority states that the hash of a run's end was there at a moment. Requests and responses are DER.

Of a response this file reads what is stamped, and when. That the authority signed it, `openssl ts -verify` shows to whoever trusts its
certificate.
"""

import os
from dataclasses import dataclass
from datetime import UTC, datetime

from cmmlink.errors import StoreError

_SHA256 = bytes.fromhex("0609608648016503040201")  # the object identifier 2.16.840.1.101.3.4.2.1
_SIGNED_DATA = bytes.fromhex("06092a864886f70d010702")  # 1.2.840.113549.1.7.2
_STAMPED = bytes.fromhex("060b2a864886f70d0109100104")  # 1.2.840.113549.1.9.16.1.4, what a time stamp states
_INTEGER, _OCTETS, _MOMENT, _SEQUENCE, _INNER = 0x02, 0x04, 0x18, 0x30, 0xA0  # tags
_NULL, _TRUE = b"\x05\x00", b"\x01\x01\xff"
_GRANTED = (0, 1)
_NONCE_BYTES = 8
_LONGEST = 1 << 18
_ASKED = {"Content-Type": "application/timestamp-query", "Accept": "application/timestamp-reply"}
_NONE = "it is no time stamp"


@dataclass(frozen=True, slots=True)
class Stamp:
    """What a response states: the hash that was stamped, when, and the number that the request held, None where it held none."""

    sha256: bytes
    moment: datetime
    nonce: int | None


def ask_stamp(url: str, sha256: bytes, patience_s: float) -> bytes:
    """Ask an authority to stamp a hash; its response, once it was read. Raises StoreError where there is none that states it."""
    import http.client  # noqa: PLC0415 - what speaks to servers is loaded where one is spoken to: it takes longer than all else here
    import urllib.request  # noqa: PLC0415 - as above

    nonce = int.from_bytes(os.urandom(_NONCE_BYTES), "big")
    asked = urllib.request.Request(url, stamp_request(sha256, nonce), _ASKED)
    try:
        with urllib.request.urlopen(asked, timeout=patience_s) as answer:
            response: bytes = answer.read(_LONGEST)
    except (OSError, http.client.HTTPException, ValueError) as error:  # no address, no answer, or none of HTTP
        reason = getattr(error, "reason", None) or error
        raise StoreError(f"{url}: no time stamp: {getattr(reason, 'strerror', None) or reason}") from None
    stamp = read_stamp(response)
    if (stamp.sha256, stamp.nonce) != (sha256, nonce):
        raise StoreError(f"{url}: the time stamp is for something else than was asked")
    return response


def stamp_request(sha256: bytes, nonce: int) -> bytes:
    """The request to stamp a hash, with the certificate of the authority."""
    imprint = _packed(_SEQUENCE, _packed(_SEQUENCE, _SHA256 + _NULL) + _packed(_OCTETS, sha256))
    number = _packed(_INTEGER, nonce.to_bytes(nonce.bit_length() // 8 + 1, "big"))
    return _packed(_SEQUENCE, _packed(_INTEGER, b"\x01") + imprint + number + _TRUE)


def read_stamp(response: bytes) -> Stamp:
    """What a response states. Raises StoreError for one that was refused, and for what is none."""
    try:
        (whole,) = _items(response)
        status, *token = _items(_content(whole, _SEQUENCE))
        if int.from_bytes(_content(_items(_content(status, _SEQUENCE))[0], _INTEGER), "big") not in _GRANTED:
            raise StoreError("the authority refused to stamp")
        kind, content = _items(_content(token[0], _SEQUENCE))
        (signed,) = _items(_content(content, _INNER))
        what, stated = _items(_content(_items(_content(signed, _SEQUENCE))[2], _SEQUENCE))
        if (_packed(*kind), _packed(*what)) != (_SIGNED_DATA, _STAMPED):
            raise StoreError(_NONE)
        (octets,) = _items(_content(stated, _INNER))
        (info,) = _items(_content(octets, _OCTETS))
        return _stamp(_items(_content(info, _SEQUENCE)))
    except (ValueError, IndexError):  # another shape, or cut off
        raise StoreError(_NONE) from None


def _stamp(info: list[tuple[int, bytes]]) -> Stamp:
    """The statement itself: version, policy, imprint, serial number, moment, and behind it the nonce among what may be left out."""
    algorithm, sha256 = _items(_content(info[2], _SEQUENCE))
    if not _content(algorithm, _SEQUENCE).startswith(_SHA256):
        raise ValueError
    told = _content(info[4], _MOMENT).decode("ascii")  # like 20261127152427Z or 20261127152427.25Z
    seconds, _, part = told.removesuffix("Z").partition(".")
    moment = datetime.strptime(seconds + (part or "0")[:6], "%Y%m%d%H%M%S%f").replace(tzinfo=UTC)
    nonce = next((int.from_bytes(value, "big") for tag, value in info[5:] if tag == _INTEGER), None)
    return Stamp(_content(sha256, _OCTETS), moment, nonce)


def _items(packed: bytes) -> list[tuple[int, bytes]]:
    """The tag and the content of every value that is packed one behind the other. Raises ValueError, IndexError."""
    found, place = list[tuple[int, bytes]](), 0
    while place < len(packed):
        tag, size, place = packed[place], packed[place + 1], place + 2
        if size & 0x80:  # the next bytes are the size
            digits = size & 0x7F
            size, place = int.from_bytes(packed[place : place + digits], "big"), place + digits
        if place + size > len(packed):
            raise ValueError
        found.append((tag, packed[place : place + size]))
        place += size
    return found


def _content(item: tuple[int, bytes], tag: int) -> bytes:
    if item[0] != tag:
        raise ValueError
    return item[1]


def _packed(tag: int, content: bytes) -> bytes:
    size = len(content)
    if size < 0x80:
        return bytes([tag, size]) + content
    digits = size.to_bytes((size.bit_length() + 7) // 8, "big")
    return bytes([tag, 0x80 | len(digits)]) + digits + content
