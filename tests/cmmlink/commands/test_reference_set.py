"""The command that writes the reference set."""

import hashlib
from pathlib import Path

from tests.cmmlink.command import cmmlink


def test_a_set_is_written_whole_with_its_sums_and_nothing_is_overwritten(tmp_path: Path) -> None:
    ended = cmmlink("reference", tmp_path / "set")
    assert (ended.code, ended.err) == (0, "")
    listed = dict(line.split("  ")[::-1] for line in (tmp_path / "set" / "SHA256SUMS").read_text(encoding="ascii").splitlines())
    there = {path.relative_to(tmp_path / "set").as_posix(): path for path in (tmp_path / "set").rglob("*") if path.is_file()}
    assert set(there) - set(listed) == {"SHA256SUMS"}
    assert listed == {name: hashlib.sha256(there[name].read_bytes()).hexdigest() for name in listed}
    assert "nothing is overwritten" in cmmlink("reference", tmp_path / "set").refused()
