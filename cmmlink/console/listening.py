"""Where the station listens, and how what is said there is kept from others.

Beyond this computer nothing is served by accident: whether an address can be reached from others is read from the socket that was
bound, not from how the address was written, and then either a certificate or a second word of the operator is asked for.
"""

import hashlib
import ipaddress
import re
import socket
import ssl
import sys
from dataclasses import dataclass
from pathlib import Path

from cmmlink.errors import PlanError

_CERTIFICATE = re.compile("-----BEGIN CERTIFICATE-----.+?-----END CERTIFICATE-----", re.DOTALL)


@dataclass(frozen=True, slots=True)
class Access:
    """Who may reach the station, and how.

    host, port  : where to listen; port 0 takes a free one
    certificate : a PEM file with the station's certificate, and with its key unless `key` names another file
    unencrypted : serve other computers without a certificate
    """

    host: str = "127.0.0.1"
    port: int = 0
    certificate: Path | None = None
    key: Path | None = None
    unencrypted: bool = False


@dataclass(frozen=True, slots=True)
class Encryption:
    """A certificate that is in use; the fingerprint is what browsers show as SHA-256."""

    context: ssl.SSLContext
    fingerprint: str


def listen_at(access: Access) -> tuple[socket.socket, bool]:
    """A bound socket, and whether other computers can reach it.

    Raises PlanError where that was not asked for as it has to be, OSError when the address is taken or is none of this computer.
    """
    host = access.host.strip().removeprefix("[").removesuffix("]")
    if not host:
        raise PlanError("--host is empty; give an address of this computer, like 127.0.0.1 for this computer alone")
    family, _, _, _, place = socket.getaddrinfo(host, access.port, type=socket.SOCK_STREAM)[0]
    listening = socket.socket(family, socket.SOCK_STREAM)
    try:
        if sys.platform != "win32":  # there it would let another program take over the port
            listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        listening.bind(place)
        remote = not is_loopback(listening.getsockname()[0])
        if remote and access.certificate is None and not access.unencrypted:
            raise PlanError(
                f"--host {access.host} opens the console to the network: give --certificate FILE, so that it is encrypted, "
                "or --unencrypted where you trust everybody on that network"
            )
        listening.listen()  # from here on nobody is turned away, though it may take a moment until somebody answers
        listening.setblocking(False)
    except BaseException:
        listening.close()
        raise
    return listening, remote


def is_loopback(address: str) -> bool:
    """Whether an address of a bound socket can be reached from this computer alone."""
    found = ipaddress.ip_address(address.partition("%")[0])
    mapped = getattr(found, "ipv4_mapped", None)
    return bool((mapped or found).is_loopback)


def encryption_of(certificate: Path, key: Path | None) -> Encryption:
    """Load a certificate and its key. Raises PlanError."""
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    context.minimum_version = ssl.TLSVersion.TLSv1_2

    def refuse_password() -> str:
        raise PlanError(f"{key or certificate}: the key is protected by a password; give one that is not, readable by its owner alone")

    try:
        text = certificate.read_text(encoding="ascii", errors="replace")
        context.load_cert_chain(certificate, key, refuse_password)
    except OSError as error:  # an SSLError is one
        files = " or ".join(str(file) for file in (certificate, key) if file)
        raise PlanError(f"{files}: no certificate with its key, as PEM, can be read there ({error.strerror or error})") from None
    found = _CERTIFICATE.search(text)
    if found is None:
        raise PlanError(f"{certificate}: there is no certificate in it")
    digest = hashlib.sha256(ssl.PEM_cert_to_DER_cert(found[0])).hexdigest().upper()
    return Encryption(context, ":".join(digest[k : k + 2] for k in range(0, len(digest), 2)))
