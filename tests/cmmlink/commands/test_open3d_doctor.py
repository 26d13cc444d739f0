"""The doctor of Open3D: mends with apt and root, else says the exact command."""

from collections.abc import Sequence

import pytest

from cmmlink.commands import setup
from cmmlink.commands.open3d_doctor import look_after_open3d
from drivers.surface.open3d_process import Open3DStatus

GOOD = Open3DStatus("0.20.0")
LACKING = Open3DStatus(None, ("libGL.so.1", "libEGL.so.1"), ("apt-get", "install", "--yes", "libgl1", "libegl1"), "libGL.so.1: cannot open")


def test_a_system_that_is_well_is_told_so_and_left_alone() -> None:
    said: list[str] = []
    assert look_after_open3d(said.append, status=lambda: GOOD, run=_never, is_root=True)
    assert said == ["Open3D 0.20.0 can be loaded"]


def test_missing_libraries_are_installed_by_root_and_looked_at_again() -> None:
    said: list[str] = []
    ran: list[Sequence[str]] = []
    states = iter([LACKING, GOOD])

    def run(command: Sequence[str]) -> int:
        ran.append(command)
        return 0

    assert look_after_open3d(said.append, status=lambda: next(states), run=run, is_root=True)
    assert ran[-1] == LACKING.mend
    assert said == ["installed for Open3D: libgl1 libegl1", "Open3D 0.20.0 can be loaded"]


def test_an_extra_that_is_not_installed_is_no_fault() -> None:
    said: list[str] = []
    absent = Open3DStatus(None, mend=("python", "-m", "pip", "install", "cmmlink[open3d]"), installed=False)
    assert look_after_open3d(said.append, status=lambda: absent, run=_never, is_root=True)
    assert said[0] == 'Open3D is not installed; install it with: python -m pip install "cmmlink[open3d]"'
    assert "cut by numpy" in said[1]


def test_without_root_the_exact_command_is_said() -> None:
    said: list[str] = []
    assert not look_after_open3d(said.append, status=lambda: LACKING, run=_never, is_root=False)
    assert said[0].endswith("lacks libGL.so.1, libEGL.so.1; mend it with: apt-get install --yes libgl1 libegl1")
    assert "cut by numpy," in said[1]


def _never(command: Sequence[str]) -> int:
    raise AssertionError(f"nothing is to be run, yet {command} was")


def test_the_command_says_what_was_looked_at(monkeypatch: pytest.MonkeyPatch) -> None:
    said: list[str] = []
    monkeypatch.setattr("typer.echo", said.append)
    monkeypatch.setattr("cmmlink.commands.open3d_doctor.look_after_open3d", lambda say: say("Open3D: looked at") is None)
    monkeypatch.setattr("cmmlink.nominal_files.solids.words_on_kernel", lambda: "Open CASCADE: looked at")
    assert setup.doctor() == 0
    assert said[-2] == "Open CASCADE: looked at"
    assert said[0].startswith("cmmlink ")
    assert said[1:2] == ["inspection: compiled and working"]
    assert said[-1] == "Open3D: looked at"
    monkeypatch.setattr("cmmlink.commands.open3d_doctor.look_after_open3d", lambda _: False)
    assert setup.doctor() == 2
