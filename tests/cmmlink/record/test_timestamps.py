"""Time stamps by RFC 3161, asked of an authority that is a process of openssl, on loopback."""

import shutil
import subprocess
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

import pytest

from cmmlink.errors import StoreError
from cmmlink.record.anchors import WAITING, anchor_ends
from cmmlink.record.recorder import RecordReference
from cmmlink.record.seal import seal_of
from cmmlink.record.store import Store
from cmmlink.record.timestamps import ask_stamp, read_stamp, stamp_request
from tests.cmmlink.record.sealed import add_signed, forge, state_of, trust

OPENSSL = shutil.which("openssl")
MOMENT = "2026-03-14T15:09:27.000Z"
SETTINGS = """[tsa]
default_tsa = t
[t]
serial = serial
crypto_device = builtin
signer_cert = tsa.pem
certs = tsa.pem
signer_key = tsa.key
signer_digest = sha256
default_policy = 1.2.3.4.1
digests = sha256
accuracy = secs:1
ordering = yes
[req]
distinguished_name = dn
[dn]
[ext]
extendedKeyUsage = critical, timeStamping
"""


def test_a_request_has_the_bytes_of_the_standard() -> None:
    """Written by `openssl ts -query -digest abab... -sha256 -cert` (OpenSSL 3.0.19), whose nonce was 0x0f3b9acaf5ac9979."""
    expected = "30430201013031300d060960864801650304020105000420" + "ab" * 32 + "02080f3b9acaf5ac99790101ff"
    assert stamp_request(b"\xab" * 32, 0x0F3B9ACAF5AC9979).hex() == expected


@pytest.mark.parametrize(
    "response",
    [b"", b"\x30", b"\x30\x80", b"\x30\x03\x02\x01\x00", b"<html>", b"\x30\x05\x30\x03\x02\x01\x00", b"\x30\x84\xff\xff\xff\xff" * 9],
)
def test_what_is_no_time_stamp_is_told_as_that(response: bytes) -> None:
    with pytest.raises(StoreError, match="it is no time stamp"):
        read_stamp(response)


def test_a_refusal_is_told_as_that() -> None:
    with pytest.raises(StoreError, match="refused to stamp"):
        read_stamp(bytes.fromhex("30053003020102"))


@pytest.fixture(scope="module")
def authority(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of an authority of time stamps: a key, and a certificate that it signed for itself."""
    if OPENSSL is None:
        pytest.skip("openssl is not installed here")
    folder = tmp_path_factory.mktemp("authority")
    (folder / "settings").write_text(SETTINGS, encoding="ascii")
    (folder / "serial").write_text("01\n", encoding="ascii")
    asked = ["req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:P-256", "-nodes", "-days", "3650", "-subj", "/CN=authority"]
    openssl(folder, *asked, "-config", "settings", "-extensions", "ext", "-keyout", "tsa.key", "-out", "tsa.pem")
    return folder


def openssl(folder: Path, *words: str) -> str:
    assert OPENSSL is not None
    return subprocess.run([OPENSSL, *words], cwd=folder, check=True, capture_output=True, text=True, timeout=30).stdout


@contextmanager
def serving(authority: Path) -> Iterator[str]:
    """The address of the authority: what it is asked, openssl answers."""

    class Answering(BaseHTTPRequestHandler):
        def do_POST(self) -> None:
            (authority / "query").write_bytes(self.rfile.read(int(self.headers["Content-Length"])))
            openssl(authority, "ts", "-reply", "-config", "settings", "-queryfile", "query", "-out", "reply")
            self.send_response(200)
            self.end_headers()
            self.wfile.write((authority / "reply").read_bytes())

        def log_message(self, *_: object) -> None:
            """Nothing is logged."""

    with ThreadingHTTPServer(("127.0.0.1", 0), Answering) as server:
        thread = threading.Thread(target=server.serve_forever, args=(0.01,))
        thread.start()
        try:
            yield f"http://127.0.0.1:{server.server_address[1]}/"
        finally:
            server.shutdown()
            thread.join()


def tell(folder: Path, place: str, *runs: RecordReference) -> list[str]:
    with Store(folder, writing=True, epoch_s=lambda: 7.0) as store:
        seal = seal_of(store, station="cmm-1", key=None)
        return [told.problem for told in anchor_ends(store, seal, [place], MOMENT, runs)]


def test_a_run_is_stamped_and_openssl_verifies_it(authority: Path, tmp_path: Path) -> None:
    """Also one that could not be stamped at once: the stamp of the next run states all before it."""
    first = add_signed(tmp_path / "station", "a-0001")
    assert tell(tmp_path / "station", "http://127.0.0.1:9/", first) != [""]
    assert (tmp_path / "station" / WAITING).exists()
    second = add_signed(tmp_path / "station", "b-0002")
    with serving(authority) as address:
        assert tell(tmp_path / "station", address, second) == [""]
    with Store(tmp_path / "station", writing=False, epoch_s=lambda: 0.0) as store:
        (record,) = store.records("b-0002", "timestamp")
    (tmp_path / "timestamp.tsr").write_bytes(record.body)
    given = ("-in", str(tmp_path / "timestamp.tsr"), "-CAfile", "tsa.pem")
    assert "Verification: OK" in openssl(authority, "ts", "-verify", "-digest", second.chain_sha256, *given)
    found = trust(tmp_path / "station")
    assert [(one["run"], one["chain_sha256"]) for one in found["timestamps"]] == [("b-0002", second.chain_sha256)]
    assert found["state"] == "intact and signed"
    forge(tmp_path / "station", "UPDATE record SET run = 'a-0001' WHERE kind = 'timestamp'")
    assert state_of(tmp_path / "station") == "altered"


def test_a_stamp_of_something_else_is_refused(authority: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with serving(authority) as address:
        kept = ask_stamp(address, b"\x01" * 32, 10.0)
        assert read_stamp(kept).sha256 == b"\x01" * 32
        monkeypatch.setattr("cmmlink.record.timestamps.stamp_request", lambda sha256, nonce: stamp_request(sha256, nonce ^ 1))
        with pytest.raises(StoreError, match="something else than was asked"):
            ask_stamp(address, b"\x01" * 32, 10.0)
