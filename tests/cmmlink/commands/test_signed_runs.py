"""Runs of the command line: signed, anchored, verified, and measured all the same where they cannot be."""

import errno
import json
import os
import stat
import subprocess
import sys
from pathlib import Path
from unittest.mock import patch

import pytest

from cmmlink.record.anchors import WAITING, heads_in
from tests.cmmlink.command import Ended, cmmlink
from tests.cmmlink.oval_part import oval_points, write_nominal, write_points
from tests.cmmlink.record.sealed import add_signed, forge, state_of, trust

PLAN = """part: {{name: oval}}
nominal: {{file: oval.yaml}}
tolerance: {{lower_mm: -0.05, upper_mm: 0.05}}
registration: {{fit: none}}
device: {{type: file, file: scan.csv}}
out: null
records: {records}
"""
KILLED_WHILE_SIGNING = """
import os, sys
from pathlib import Path
from cmmlink.record.signature import Signature
from tests.cmmlink.record import sealed
Signature.draft = lambda signature: os._exit(9)
sealed.add_signed(Path(sys.argv[1]), "b-0002")
"""


@pytest.fixture
def shop(tmp_path: Path) -> Path:
    write_nominal(tmp_path / "oval.yaml")
    write_points(tmp_path / "scan.csv", oval_points(0.0))
    return tmp_path


def run(shop: Path, records: str) -> Ended:
    (shop / "plan.yaml").write_text(PLAN.format(records=records), encoding="utf-8")
    return cmmlink("run", shop / "plan.yaml", "--headless", "--json")


def test_a_run_is_signed_anchored_and_verified_by_a_stranger(shop: Path) -> None:
    result = run(shop, "{folder: kept, anchor: heads.txt, station: CMM 3}").json()
    kept, heads = shop / "kept", shop / "heads.txt"
    (head,) = heads_in(heads)
    signature = result["signature"]
    assert (head.run, head.chain_sha256, head.key_id) == (result["run"], result["chain_sha256"], signature["key_id"])
    assert (head.station, result["anchors"]) == ("CMM_3", [{"place": str(heads), "problem": ""}])
    shown = cmmlink("key", "show", "--records", kept, "--json").json()
    assert shown["public_key"] == signature["public_key"]
    for given in (shown["public_key"], shown["key_id"], kept / "station.pub"):
        assert "intact and signed" in cmmlink("verify", "--records", kept, "--key", given, "--anchors", heads).out
    told = cmmlink("show", "last", "--records", kept, "--json").json()
    assert (told["signature"], told["anchors"], told["station"]) == (signature, result["anchors"], "CMM_3")
    cmmlink("export", "last", "--out", shop / "evidence", "--records", kept)
    exported = json.loads((shop / "evidence" / "signature.json").read_text(encoding="utf-8"))
    assert exported == {**signature, "run": result["run"], "chain_sha256": result["chain_sha256"]}


@pytest.mark.parametrize("name", ["station.key", "station.pub"])
def test_a_folder_that_does_not_tell_whether_a_key_is_there_keeps_no_part_from_being_measured(shop: Path, name: str) -> None:
    real = Path.exists

    def exists(path: Path) -> bool:
        if path.name == name:
            raise OSError(errno.EIO, "Input/output error", str(path))
        return real(path)

    with patch.object(Path, "exists", exists):
        ended = run(shop, "{folder: kept}")
    assert ended.code == 0
    assert f"the run is not signed: {shop / 'kept' / name}: Input/output error" in ended.json()["notes"]


def test_a_key_that_is_not_there_keeps_no_part_from_being_measured(shop: Path) -> None:
    result = run(shop, "{folder: kept, key: stick.pem}").json()
    assert (result["verdict"], result["signature"]) == ("conform", None)
    assert any(note.startswith("the run is not signed: ") and "stick.pem" in note for note in result["notes"])
    assert "intact but unsigned" in cmmlink("verify", "--records", shop / "kept").out
    assert not (shop / "kept" / "station.key").exists()
    made = cmmlink("key", "new", shop / "stick.pem", "--json").json()
    signed = run(shop, "{folder: kept, key: stick.pem}").json()
    assert signed["signature"]["key_id"] == made["key_id"]
    assert "intact and signed" in cmmlink("verify", "last", "--records", shop / "kept", "--key", made["public_key"]).out
    assert "intact but unsigned" in cmmlink("verify", "--records", shop / "kept", "--key", made["public_key"]).failed(5)
    assert "never written over" in cmmlink("key", "new", shop / "stick.pem").refused()


def test_an_anchor_that_is_not_there_changes_neither_verdict_nor_exit_status(shop: Path) -> None:
    ended = run(shop, "{folder: kept, anchor: [share/heads.txt, near.txt]}")
    assert ended.code == 0
    assert "not told to" in ended.err
    assert "the verdict and the record stand" in ended.err
    far, near = ended.json()["anchors"]
    assert (bool(far["problem"]), near["problem"]) == (True, "")
    assert (shop / "kept" / WAITING).exists()
    (shop / "share").mkdir()
    assert run(shop, "{folder: kept, anchor: [share/heads.txt, near.txt]}").err == ""
    assert [head.chain_sha256 for head in heads_in(shop / "share" / "heads.txt")] == [
        one.chain_sha256 for one in heads_in(shop / "near.txt")
    ]


def test_a_deleted_run_is_asked_for_by_its_name_in_the_anchor(shop: Path) -> None:
    records = "{folder: kept, anchor: heads.txt}"
    names = [run(shop, records).json()["run"] for _ in range(2)]
    forge(shop / "kept", f"DELETE FROM record WHERE run = '{names[1]}'")
    asked = ("--records", shop / "kept", "--anchors", shop / "heads.txt")
    for arguments in (asked, (names[1], *asked)):
        said = cmmlink("verify", *arguments).failed(5)
        assert said.startswith("cut off after an anchored head: run ")
        assert names[1] in said
    assert "there is no run" in cmmlink("verify", "20991231-000000-0099", *asked).refused()


@pytest.mark.skipif(os.name != "posix", reason="what Windows allows is set by icacls")
def test_the_private_key_is_for_its_account_alone_and_another_mode_is_told(shop: Path) -> None:
    key = shop / "kept" / "station.key"
    assert run(shop, "kept").json()["signature"]
    assert stat.S_IMODE(key.stat().st_mode) == 0o600
    key.chmod(0o644)
    notes = run(shop, "kept").json()["notes"]
    assert any("other accounts of this computer may read the key" in note for note in notes)


@pytest.mark.parametrize("content", [b"", b"no key", b"-----BEGIN PRIVATE KEY-----\nAAAA\n-----END PRIVATE KEY-----\n"])
def test_a_damaged_key_is_told_and_never_written_over(shop: Path, content: bytes) -> None:
    (shop / "kept").mkdir()
    (shop / "kept" / "station.key").write_bytes(content)
    result = run(shop, "kept").json()
    assert (result["verdict"], result["signature"]) == ("conform", None)
    assert any("this is no private key" in note for note in result["notes"])
    assert (shop / "kept" / "station.key").read_bytes() == content


def test_a_program_that_is_killed_while_it_signs_leaves_a_run_without_its_end(tmp_path: Path) -> None:
    """End and signature stand in one transaction: between them nothing is ever found."""
    add_signed(tmp_path, "a-0001")
    root = Path(__file__).resolve().parents[3]
    killed = subprocess.run([sys.executable, "-c", KILLED_WHILE_SIGNING, tmp_path], cwd=root, check=False, timeout=60)
    assert killed.returncode == 9
    listed = cmmlink("runs", "--records", tmp_path, "--json").json()["runs"]
    assert [one["state"] for one in listed] == ["complete", "interrupted"]
    assert trust(tmp_path)["signatures"]["unsigned"] == ["b-0002"]
    assert state_of(tmp_path) == "intact but unsigned"
