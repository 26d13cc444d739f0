"""How the program ends when it is told to: one line, no traceback, no temporary folder, no process left behind."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="ends processes by POSIX signals, and looks for them in /proc")
# Says that it is here as soon as the program, not Python any more, answers for Ctrl-C.
FROM_THE_FIRST_MOMENT = """
import signal
from cmmlink.__main__ import main

own = signal.signal

def first(*given):
    signal.signal = own
    before = own(*given)
    print("here", flush=True)
    return before

signal.signal = first
main()
"""


@contextmanager
def started(folder: Path, *arguments: str, program: str = "") -> Iterator[subprocess.Popen[str]]:
    """A command with temporary folders, home and records of its own."""
    temporary = folder / "temporary"
    temporary.mkdir(exist_ok=True)
    own = {name: str(folder) for name in ("HOME", "XDG_DATA_HOME", "XDG_STATE_HOME")} | {"TMPDIR": str(temporary)}
    command = [sys.executable, *(["-c", program] if program else ["-m", "cmmlink"]), *arguments]
    pipe = subprocess.PIPE
    with subprocess.Popen(command, stdin=pipe, stdout=pipe, stderr=pipe, text=True, env={**os.environ, **own}) as process:
        try:
            yield process
        finally:
            process.kill()


def processes_in(folder: Path) -> list[int]:
    """Processes whose environment names a folder."""
    found = []
    for place in Path("/proc").iterdir():
        try:
            if place.name.isdigit() and str(folder).encode() in (place / "environ").read_bytes():
                found.append(int(place.name))
        except OSError:
            continue
    return found


def comes_true(condition: Callable[[], bool], within_s: float) -> bool:
    until_s = time.monotonic() + within_s
    while not condition():
        if time.monotonic() > until_s:
            return False
        time.sleep(0.02)
    return True


def end_of(process: subprocess.Popen[str]) -> tuple[int, str]:
    said, complained = process.communicate(timeout=60)
    return process.returncode, said + complained


@pytest.mark.parametrize("after_s", [0.0, 0.05, 0.3, 0.8])
def test_ctrl_c_while_libraries_are_loaded_is_one_line(after_s: float, tmp_path: Path) -> None:
    with started(tmp_path, "console", "--no-browser", "--port", "0", str(tmp_path), program=FROM_THE_FIRST_MOMENT) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "here\n"
        time.sleep(after_s)
        process.send_signal(signal.SIGINT)
        code, said = end_of(process)
    if not said.startswith("console: "):  # else everything was loaded by then, and this is the usual end of a console
        assert (code, said) in ((130, "cmmlink: stopped by the operator\n"), (-signal.SIGINT, ""))
    assert "Traceback" not in said


def simulated_device_runs(folder: Path) -> bool:
    return any((folder / "temporary").glob("simulated-port-*/port"))


@pytest.mark.parametrize("request_to_end", [signal.SIGTERM, signal.SIGINT])
def test_a_run_that_is_asked_to_end_leaves_nothing_behind(request_to_end: signal.Signals, tmp_path: Path) -> None:
    with started(tmp_path, "demo", "--headless", "--out", str(tmp_path / "out"), "--records", str(tmp_path / "records")) as process:
        assert comes_true(lambda: simulated_device_runs(tmp_path), 60.0)
        process.send_signal(request_to_end)
        code, said = end_of(process)
    assert code not in (0, 1)
    assert "Traceback" not in said
    assert list((tmp_path / "temporary").iterdir()) == []
    assert comes_true(lambda: processes_in(tmp_path / "temporary") == [], 30.0)


def test_a_simulated_device_ends_with_a_run_that_is_killed(tmp_path: Path) -> None:
    with started(tmp_path, "demo", "--headless", "--out", str(tmp_path / "out"), "--records", str(tmp_path / "records")) as process:
        assert comes_true(lambda: simulated_device_runs(tmp_path), 60.0)
        process.kill()
        process.wait(20)
        assert comes_true(lambda: processes_in(tmp_path / "temporary") == [], 30.0)
    assert not simulated_device_runs(tmp_path)


def test_a_console_that_is_asked_to_end_by_a_closing_terminal_does(tmp_path: Path) -> None:
    with started(tmp_path, "console", "--no-browser", "--port", "0", str(tmp_path)) as process:
        assert process.stderr is not None
        assert process.stderr.readline().startswith("console: ")
        process.send_signal(signal.SIGHUP)
        assert end_of(process) == (0, "")
    assert list((tmp_path / "temporary").iterdir()) == []


def test_the_process_with_open3d_ends_with_its_pipe(tmp_path: Path) -> None:
    program = (
        "from drivers.helper_process import start_child; import sys; "
        "child = start_child('drivers.surface.open3d_process', (sys.executable,)); print(child.pid, flush=True)"
    )
    with started(tmp_path, program=f"{program}; input()") as process:
        assert process.stdout is not None
        child = int(process.stdout.readline())
        assert comes_true(lambda: child in processes_in(tmp_path / "temporary"), 20.0)
        process.kill()
        process.wait(20)
        assert comes_true(lambda: processes_in(tmp_path / "temporary") == [], 30.0)
