"""What is no proof is refused with the reason, before anything is said of a zone."""

from pathlib import Path

import pytest

from tests.cmmlink.command import cmmlink


@pytest.mark.parametrize(
    "content", [b"", b"part: {name: blade}", b"\xff\xfe\x00", b"[" * 100_000], ids=["empty", "a plan", "bytes", "deep"]
)
def test_a_file_that_is_no_json_is_named_as_such(tmp_path: Path, content: bytes) -> None:
    file = tmp_path / "zone.json"
    file.write_bytes(content)
    assert cmmlink("verify-zone", file).failed(2) == f"{file}: is no JSON; expected the zone.json that a run wrote beside its result"


@pytest.mark.parametrize("content", ["[]", "{}", "null", '{"zones": 3}', '{"zones": [{}]}', '{"zones": [{"name": "a", "active": "b"}]}'])
def test_json_that_states_no_zone_is_refused(tmp_path: Path, content: str) -> None:
    file = tmp_path / "zone.json"
    file.write_text(content, encoding="utf-8")
    assert cmmlink("verify-zone", file).failed(2).startswith(f"{file}: ")
