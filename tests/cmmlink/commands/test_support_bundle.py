"""`cmmlink doctor --bundle`: what is packed, and that it is said."""

import json
import zipfile
from importlib import metadata
from pathlib import Path

import pytest

from tests.cmmlink.command import Ended, cmmlink
from tests.cmmlink.recorded import Script, record, scan_arrivals


@pytest.fixture(autouse=True)
def _no_look_at_open3d(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("cmmlink.commands.open3d_doctor.look_after_open3d", lambda say: say("Open3D: looked at") is None)
    monkeypatch.setattr("cmmlink.nominal_files.solids.words_on_kernel", lambda: "Open CASCADE: looked at")


def bundled(file: Path, records: Path) -> tuple[Ended, dict[str, bytes]]:
    ended = cmmlink("doctor", "--bundle", file, "--records", records)
    with zipfile.ZipFile(file) as archive:
        assert archive.testzip() is None
        return ended, {name: archive.read(name) for name in archive.namelist()}


def test_a_bundle_holds_the_log_the_versions_and_the_newest_run(tmp_path: Path) -> None:
    record(tmp_path / "records", Script(*scan_arrivals()))
    _, recorder = record(tmp_path / "records", Script(*scan_arrivals()))
    cmmlink("show", "no-such-run", "--records", tmp_path / "records")
    ended, files = bundled(tmp_path / "new" / "bundle.zip", tmp_path / "records")
    assert ended.code == 0
    assert "there is no run 'no-such-run'" in files["log/cmmlink.log"].decode()
    assert "inspection: compiled and working" in files["doctor.txt"].decode()
    assert json.loads(files["versions.json"])["numpy"] == metadata.version("numpy")
    assert json.loads(files["platform.json"])["compiled_code"]["files"] > 0
    assert json.loads(files["run/run.json"])["run"] == recorder.run
    assert {"run/plan.yaml", "run/points.csv", "run/deviations.csv", "run/result.json"} <= set(files)
    said = ended.out.splitlines()
    assert f"packed into {tmp_path / 'new' / 'bundle.zip'}:" in said
    assert f"  run: {recorder.run}, the newest in {tmp_path / 'records'}" in said
    assert "look whether you may send it" in said[-1]


def test_without_a_run_the_bundle_says_so(tmp_path: Path) -> None:
    ended, files = bundled(tmp_path / "bundle.zip", tmp_path / "none")
    assert ended.code == 0
    assert "  no run: " in ended.out
    assert not [name for name in files if name.startswith("run/")]


def test_a_bundle_is_packed_also_where_the_inspection_cannot_work(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(_: object) -> None:
        raise OSError(28, "no room for compiled code", "cache")

    monkeypatch.setattr("inspection.rehearse", broken)
    ended, files = bundled(tmp_path / "bundle.zip", tmp_path / "none")
    assert ended.code == 2
    assert "no room for compiled code" in ended.err
    assert "versions.json" in files


def test_a_file_that_cannot_be_written_is_named(tmp_path: Path) -> None:
    message = cmmlink("doctor", "--bundle", tmp_path, "--records", tmp_path / "none").refused()
    assert message.startswith(f"{tmp_path}: the bundle cannot be written")
