"""Whatever is altered never ends as intact and signed, and every case is told from the others."""

import shutil
import sqlite3
from contextlib import closing
from pathlib import Path

import pytest
from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey, Ed25519PublicKey

from cmmlink.events import Answered
from cmmlink.record.anchors import anchor_ends
from cmmlink.record.backup import back_up, merge, restore
from cmmlink.record.chain import Draft
from cmmlink.record.handover import rotate_key
from cmmlink.record.keys import make_key, public_key_given, write_public_key
from cmmlink.record.machine_answer import keep_answer
from cmmlink.record.reader import open_to_record
from cmmlink.record.seal import KEY_FILE, PUBLIC_FILE, seal_of
from cmmlink.record.signature import Signature, signature_of, signed_message
from cmmlink.record.store import FILE_NAME, Store
from inspection import Verdict
from tests.cmmlink.record.sealed import BEGAN, Clock, add_signed, forge, key_id, state_of, trust

NONE_SIGNED = "intact but unsigned"
SIGNED = "intact and signed"
ANOTHER = "signed by another key"
KINDS = {"run", "plan", "points", "end", "signature", "key", "answer", "anchors", "derived", "countersignature"}


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two signed runs, a rotation of the key, and a third run signed by the new one."""
    folder = tmp_path_factory.mktemp("made") / "station"
    for run in ("a-0001", "b-0002"):
        add_signed(folder, run)
    with Store(folder, writing=True, epoch_s=lambda: 99.0) as store:
        rotate_key(store, who="me", why="yearly", now=BEGAN)
    last = add_signed(folder, "c-0003")
    with Store(folder, writing=True, epoch_s=lambda: 101.0) as store:
        seal = seal_of(store, station="cmm-1", key=None)
        keep_answer(store, seal, "c-0003", Answered("sent", 7, BEGAN, "", Verdict.UNCERTAIN, "M99"))
        anchor_ends(store, seal, [str(folder.parent / "heads.txt")], "2026-03-14T15:09:27.000Z", [last])
        store.append([Draft("c-0003", "derived", b'{"verdict":"conform"}')], seal.countersign)
    return folder


@pytest.fixture
def station(made: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(made, tmp_path / "station"))


def test_the_signature_is_that_of_the_documented_bytes(made: Path) -> None:
    """Verified by the library alone, over a message spelled here."""
    with Store(made, writing=False, epoch_s=lambda: 0.0) as store:
        signature = signature_of(store, "a-0001")
        (end,) = store.records("a-0001", "end")
    assert signature is not None
    message = f"cmmlink run\na-0001\n{end.sha256.hex()}\n".encode("ascii")
    Ed25519PublicKey.from_public_bytes(bytes.fromhex(signature.public_key)).verify(bytes.fromhex(signature.signature), message)
    assert signature.key_id == key_id(signature.public_key)
    assert set(signature.beside_result()) == {"algorithm", "public_key", "signature", "key_id"}


def test_signed_runs_are_told_as_signed_by_the_keys_of_the_station(made: Path) -> None:
    found = trust(made)
    assert (found["state"], found["altered"], found["signatures"]["signed"], found["signatures"]["unsigned"]) == (SIGNED, False, 3, [])
    known = {one["known_as"]: one["runs"] for one in found["signatures"]["keys"]}
    assert known == {"handed over": 2, "station": 1}
    assert [state_of(made, run) for run in ("a-0001", "b-0002", "c-0003")] == [SIGNED] * 3


def test_no_byte_of_any_value_can_be_altered_and_the_records_stay_signed(station: Path) -> None:
    """Every value of every record, its first, a middle and its last byte, with every hash computed anew behind the change."""
    file = station / FILE_NAME
    sound = file.read_bytes()
    with closing(sqlite3.connect(file)) as connection:
        rows = connection.execute("SELECT number, run, kind, time_s, count, body FROM record").fetchall()
    assert {row[2] for row in rows} == KINDS
    tried = 0
    for number, *values in rows:
        for column, value in zip(("run", "kind", "time_s", "count", "body"), values, strict=True):
            if (rows[number - 1][2], column) == ("key", "time_s"):
                continue  # behind it a signed run stands, which is seen below
            for altered in _altered(value):
                forge(station, f"UPDATE record SET {column} = ? WHERE number = {number}", parameters=(altered,))
                assert trust(station)["state"] != SIGNED, (number, column, altered)
                file.write_bytes(sound)
                tried += 1
    assert tried > 100
    forge(station, "UPDATE record SET time_s = time_s + 1 WHERE kind = 'key'")
    assert state_of(station) == "altered"


def _altered(value: object) -> list[object]:
    if isinstance(value, float):
        return [value + 1]
    if isinstance(value, int):
        return [value + 1]
    text = value if isinstance(value, bytes) else str(value).encode()
    found: list[object] = []
    for place in sorted({0, len(text) // 2, len(text) - 1} if text else ()):
        flipped = text[:place] + bytes([text[place] ^ 1]) + text[place + 1 :]
        found.append(flipped if isinstance(value, bytes) else flipped.decode())
    return found or [b"x" if isinstance(value, bytes) else "x"]


@pytest.mark.parametrize(
    ("statements", "says"),
    [
        (["DELETE FROM record WHERE run = 'b-0002'"], "made for another end"),
        (["DELETE FROM record WHERE kind = 'signature' AND run = 'a-0001'"], "made for another end"),
        (["DELETE FROM record WHERE kind = 'key'"], "made for another end"),
        (["INSERT INTO record SELECT 99, run, 'result', time_s, 1, x'7b7d', 0, x'' FROM record WHERE number = 1"], "had ended"),
        (["INSERT INTO record SELECT 99, run, kind, time_s, 1, body, 0, x'' FROM record WHERE kind = 'end' LIMIT 1"], "had ended"),
        (["INSERT INTO record SELECT 99, run, kind, time_s, 1, body, 0, x'' FROM record WHERE number = 5"], "second signature"),
        (["INSERT INTO record SELECT 99, 'x', 'points', time_s, 1, body, 0, x'' FROM record WHERE number = 1"], "belongs to no run"),
        (["UPDATE record SET body = x'7b7d' WHERE kind = 'signature' AND run = 'c-0003'"], "is no signature"),
    ],
    ids=["run", "signature", "key", "result behind", "end behind", "signature behind", "stray", "no signature"],
)
def test_what_was_taken_or_added_is_told(station: Path, statements: list[str], says: str) -> None:
    forge(station, *statements, number_anew=True)
    found = trust(station)
    assert (found["state"], found["altered"]) == ("altered", True)
    assert says in found["first"]["message"]


def test_who_signs_anew_with_a_key_of_his_own_is_told_by_it(station: Path) -> None:
    own = Ed25519PrivateKey.generate()
    public = own.public_key().public_bytes_raw().hex()
    forge(station, "UPDATE record SET body = x'71' WHERE kind = 'points' AND run = 'c-0003'")
    with Store(station, writing=False, epoch_s=lambda: 0.0) as store:
        (end,) = store.records("c-0003", "end")
    head = end.sha256.hex()
    signed = own.sign(signed_message("c-0003", head)).hex()
    forged = Signature(run="c-0003", chain_sha256=head, public_key=public, signature=signed, key_id=key_id(public))
    forge(station, "UPDATE record SET body = ? WHERE kind = 'signature' AND run = 'c-0003'", parameters=(forged.draft().body,))
    assert state_of(station, "c-0003") == ANOTHER
    assert {one["public_key"] for one in trust(station)["signatures"]["keys"] if one["known_as"] == "another"} == {public}
    right = public_key_given(str(station / PUBLIC_FILE))
    (station / PUBLIC_FILE).unlink()
    assert [one["known_as"] for one in trust(station, "c-0003")["signatures"]["keys"]] == ["evidence"] * 2
    assert [state_of(station, "c-0003", given) for given in ([right], [public], [right, public])] == [ANOTHER, ANOTHER, SIGNED]


def test_a_stripped_signature_leaves_the_run_unsigned(station: Path) -> None:
    forge(station, "DELETE FROM record WHERE kind = 'signature' AND run = 'c-0003'", number_anew=True)
    assert state_of(station, "c-0003") == state_of(station) == NONE_SIGNED
    assert trust(station)["signatures"]["unsigned"] == ["c-0003"]


def test_what_was_added_later_and_not_signed_leaves_the_run_unsigned(station: Path) -> None:
    forge(station, "DELETE FROM record WHERE number = (SELECT max(number) FROM record)")
    assert (state_of(station), trust(station)["signatures"]["unsigned"]) == (NONE_SIGNED, ["c-0003"])
    forge(station, "DELETE FROM record WHERE kind = 'derived'")
    assert state_of(station) == SIGNED, "a judgement that is gone as a whole is what an anchor or a later run shows"


def test_with_keys_given_no_other_counts(made: Path) -> None:
    keys = {one["known_as"]: one["public_key"] for one in trust(made)["signatures"]["keys"]}
    assert state_of(made, given=[keys["station"]]) == ANOTHER
    assert state_of(made, given=[keys["station"], key_id(keys["handed over"])]) == SIGNED
    assert state_of(made, "c-0003", given=[keys["station"]]) == SIGNED
    assert state_of(made, "c-0003", given=["0" * 64]) == ANOTHER


def test_an_altered_public_key_beside_the_records_never_signs(station: Path) -> None:
    other = make_key(station.parent / "other.pem").public_key
    public = station / PUBLIC_FILE
    right = public_key_given(str(public))
    write_public_key(public, other)
    assert state_of(station) == ANOTHER
    add_signed(station, "d-0004")
    assert public_key_given(str(public)) == right, "the station writes its public key anew"
    assert state_of(station) == SIGNED


def test_a_run_without_an_end_is_unsigned_and_stays_so_once_it_is_closed(station: Path) -> None:
    """Nobody vouches for what stood in the file between the end of the program and the next start."""
    add_signed(station, "d-0004", ended=False)
    assert state_of(station, "d-0004") == NONE_SIGNED
    with open_to_record(station, Clock()):
        pass
    assert state_of(station, "d-0004") == NONE_SIGNED
    add_signed(station, "e-0005")
    assert trust(station)["signatures"]["unsigned"] == ["d-0004"]


def test_backup_and_restore_carry_signatures(made: Path, tmp_path: Path) -> None:
    back_up(made, tmp_path / "kept.sqlite", Clock())
    restore(tmp_path / "kept.sqlite", tmp_path / "new", Clock())
    assert [one["known_as"] for one in trust(tmp_path / "new")["signatures"]["keys"]] == ["evidence"] * 2
    shutil.copy(made / PUBLIC_FILE, tmp_path / "new" / PUBLIC_FILE)
    assert state_of(tmp_path / "new") == SIGNED


def test_merged_runs_are_verified_by_their_own_key(made: Path, tmp_path: Path) -> None:
    archive = tmp_path / "archive"
    add_signed(archive, "x-0001", station="cmm-2")
    merge(made, archive, Clock())
    found = trust(archive)
    keys = {one["known_as"] for one in found["signatures"]["keys"]}
    assert (found["state"], found["signatures"]["signed"], keys) == (ANOTHER, 4, {"station", "another"})
    everyone = [one["public_key"] for one in found["signatures"]["keys"]]
    assert state_of(archive, given=everyone) == SIGNED
    forge(archive, "UPDATE record SET body = x'71' WHERE kind = 'points' AND run = 'b-0002'")
    assert state_of(archive, "b-0002", given=everyone) == "altered"


@pytest.mark.parametrize("key", ["previous", "chain_sha256", "first", "records"])
def test_an_altered_origin_of_a_merged_run_is_found(made: Path, tmp_path: Path, key: str) -> None:
    archive = tmp_path / "archive"
    merge(made, archive, Clock())
    value = "2" if key in ("first", "records") else "'" + "0" * 64 + "'"
    forge(archive, f"UPDATE record SET body = CAST(json_set(body, '$.{key}', {value}) AS BLOB) WHERE kind = 'origin' AND run = 'b-0002'")
    assert state_of(archive, "b-0002") == "altered"


def test_old_records_are_intact_but_unsigned() -> None:
    old = Path(__file__).resolve().parents[2] / "data" / "record-0.1.0"
    found = trust(old)
    assert (found["state"], found["altered"]) == (NONE_SIGNED, False)
    assert found["signatures"]["unsigned"]


def test_a_key_that_was_lost_is_made_anew_and_told(station: Path) -> None:
    (station / KEY_FILE).unlink()
    with Store(station, writing=True, epoch_s=lambda: 1.0) as store:
        seal = seal_of(store, station=None, key=None)
    assert seal.key is not None
    assert any("a new key was made" in note for note in seal.notes)
    assert state_of(station) == ANOTHER
