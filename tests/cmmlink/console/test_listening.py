"""Beyond this computer nothing is served by accident, however the address is written."""

import socket
import ssl
from pathlib import Path

import pytest

from cmmlink.console.listening import Access, encryption_of, is_loopback, listen_at
from cmmlink.errors import PlanError

DATA = Path(__file__).parent / "data"
CERTIFICATE, KEY = DATA / "certificate.pem", DATA / "key.pem"
FINGERPRINT = (DATA / "fingerprint.txt").read_text(encoding="ascii").strip()  # as `openssl x509 -fingerprint -sha256` gave it


@pytest.mark.parametrize("host", ["127.0.0.1", "localhost", "127.0.0.2", "127.1", "::1", "[::1]", "::ffff:127.0.0.1", " 127.0.0.1 "])
def test_this_computer_alone_is_served_under_all_its_addresses(host: str) -> None:
    try:
        listening, remote = listen_at(Access(host))
    except OSError:
        pytest.skip(f"this machine has no {host}")
    listening.close()
    assert not remote


@pytest.mark.parametrize("host", ["0.0.0.0", "::", "[::]", "0", "0x0", "::ffff:0.0.0.0", "000.000.000.000"])
def test_every_network_is_served_only_when_asked_twice(host: str) -> None:
    try:
        with pytest.raises(PlanError, match=r"opens the console to the network: give --certificate FILE, .* or --unencrypted"):
            listen_at(Access(host))
    except OSError:
        pytest.skip(f"this machine has no {host}")
    for access in (Access(host, unencrypted=True), Access(host, certificate=CERTIFICATE)):
        listening, remote = listen_at(access)
        listening.close()
        assert remote


@pytest.mark.parametrize("host", ["", " ", "[]", "\t"])
def test_an_empty_address_is_none(host: str) -> None:
    with pytest.raises(PlanError, match="--host is empty"):
        listen_at(Access(host, unencrypted=True))


def test_a_refused_address_is_not_listened_at() -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        port = taken.getsockname()[1]
    with pytest.raises(PlanError):
        listen_at(Access("0.0.0.0", port))
    with socket.socket() as caller:
        assert caller.connect_ex(("127.0.0.1", port)) != 0


def test_loopback_is_told_from_the_rest() -> None:
    ours = ["127.0.0.1", "127.255.255.254", "::1", "::ffff:127.0.0.1"]
    others = ["0.0.0.0", "::", "192.0.2.7", "::ffff:192.0.2.7", "fe80::1%eth0", "2001:db8::7"]
    assert [is_loopback(address) for address in ours + others] == [True] * 4 + [False] * 6


def test_certificate_is_loaded_with_the_fingerprint_that_browsers_show() -> None:
    encryption = encryption_of(CERTIFICATE, KEY)
    assert encryption.fingerprint == FINGERPRINT
    assert encryption.context.minimum_version == ssl.TLSVersion.TLSv1_2


def test_certificate_that_cannot_be_used_is_one_message(tmp_path: Path) -> None:
    empty = tmp_path / "empty.pem"
    empty.touch()
    for certificate, key in ((tmp_path / "none.pem", None), (empty, None), (CERTIFICATE, empty), (CERTIFICATE, None), (tmp_path, None)):
        with pytest.raises(PlanError, match="no certificate with its key"):
            encryption_of(certificate, key)
    with pytest.raises(PlanError, match="protected by a password"):
        encryption_of(CERTIFICATE, DATA / "protected-key.pem")
