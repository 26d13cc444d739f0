"""The log file: what stands in it, and that whatever befalls it nothing else suffers."""

import io
import logging
import re
import threading
import time
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path

import pytest

from cmmlink.devices import Connected
from cmmlink.log import FILE_NAME, keep_log, log_command, log_files
from cmmlink.run import carry_out
from drivers import LinkDown, LinkError, LinkUp, PointBatch, WireBytes
from tests.cmmlink.recorded import Script, scan_arrivals, small_plan, small_profile, today

_LOG = logging.getLogger("cmmlink.of.a.test")


def text_of(folder: Path) -> str:
    return (folder / FILE_NAME).read_text(encoding="utf-8")


def test_a_run_leaves_its_plan_device_link_id_and_verdict_in_the_log_and_no_point(tmp_path: Path) -> None:
    arrivals = [*scan_arrivals(), LinkDown("unplugged"), LinkUp(1.5), WireBytes(0.0, b"secret")]
    with keep_log(tmp_path / "log"):
        device = Connected(Script(*arrivals), "serial COM3", simulated=True)
        run = carry_out(
            small_plan(),
            small_profile(),
            device,
            records=tmp_path,
            clock=time.monotonic,
            now=today,
            stop=threading.Event(),
        )
    text = text_of(tmp_path / "log")
    assert run.evidence is not None
    for expected in (small_plan().part.name, "serial COM3", "unplugged", run.evidence.run, run.evidence.chain_sha256, "received=612"):
        assert expected in text
    assert re.search(r" WARNING cmmlink\.run_log: link: LinkDown", text)
    assert not re.search(f"{PointBatch.__name__}|Damaged|Rejected|secret", text)
    assert len(text.splitlines()) < 12


def test_an_error_stands_there_with_its_traceback(tmp_path: Path) -> None:
    with keep_log(tmp_path):
        log_command(["run", "my plan.yaml"])
        try:
            raise LinkError("unplugged")
        except LinkError:
            _LOG.exception("the run failed")
    text = text_of(tmp_path)
    assert 'run "my plan.yaml"' in text
    assert re.search(r"ERROR cmmlink\.of\.a\.test: the run failed\nTraceback .*\n.*LinkError: unplugged\n", text, re.DOTALL)


def test_nothing_is_printed_and_afterwards_nothing_is_kept(tmp_path: Path) -> None:
    with redirect_stdout(io.StringIO()) as out, redirect_stderr(io.StringIO()) as err, keep_log(tmp_path):
        _LOG.error("kept")
        _LOG.error("%d", "no number")  # a line that cannot be put together
    before = text_of(tmp_path)
    assert (out.getvalue(), err.getvalue()) == ("", "")
    assert "kept" in before
    with redirect_stderr(io.StringIO()) as err:
        _LOG.error("not kept")
    assert err.getvalue() == ""
    assert text_of(tmp_path) == before


@pytest.mark.parametrize("broken", ["folder is a file", "file is a folder"])
def test_a_log_that_cannot_be_written_fails_nothing(tmp_path: Path, broken: str) -> None:
    folder = tmp_path / "log"
    if broken == "folder is a file":
        folder.write_text("", encoding="utf-8")
    else:
        (folder / FILE_NAME).mkdir(parents=True)
    with redirect_stderr(io.StringIO()) as err, keep_log(folder):
        _LOG.error("lost")
    assert err.getvalue() == ""


def test_a_full_file_makes_room_for_a_new_one_and_a_few_are_kept(tmp_path: Path) -> None:
    with keep_log(tmp_path):
        for _ in range(60):
            _LOG.info("x" * 100_000)
    sizes = {path.name: path.stat().st_size for path in log_files(tmp_path)}
    assert list(sizes) == [FILE_NAME, f"{FILE_NAME}.1", f"{FILE_NAME}.2", f"{FILE_NAME}.3"]
    assert max(sizes.values()) <= 1_000_000
