"""The commands of the README run as they stand there, in their order, on files of the names that they use."""

import re
import shlex
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from cmmlink.commands import main
from cmmlink.demo.section import nominal_points
from simulators import Motion, walk
from tests.drivers.surface.meshes import binary_stl, tube, write

README = (Path(__file__).resolve().parents[2] / "README.md").read_text(encoding="utf-8")
BLOCKS = re.findall(r"^```sh\n(.*?)^```", README, re.MULTILINE | re.DOTALL)
COMMANDS = [shlex.split(line, comments=True)[1:] for line in "".join(BLOCKS).splitlines() if line.startswith("cmmlink ")]
FOR_A_DEVICE_OR_A_SCREEN = ("run", "console")
PLAN = next(text for text in re.findall(r"^```yaml\n(.*?)^```", README, re.MULTILINE | re.DOTALL) if text.startswith("part:"))


@pytest.fixture
def _measuring_computer(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A folder with the files of the README: a blade of 100 mm, ball centres on it, its plan, and a surface of 60 mm."""
    monkeypatch.chdir(tmp_path)
    for name in ("XDG_DATA_HOME", "WIN_PD_OVERRIDE_LOCAL_APPDATA"):
        monkeypatch.setenv(name, str(tmp_path / "user"))
    blade_mm = nominal_points()
    np.savetxt("blade.dat", blade_mm / 100, fmt="%.9f", header="a blade", comments="")
    motion = Motion(speed_mm_s=100.0, rate_hz=1000.0, tip_radius_mm=1.0, rotation_deg=30.0, noise_mm=0.001)
    np.savetxt("points.csv", walk(blade_mm, motion).points_mm[:, :2], delimiter=",", fmt="%.6f")
    write(Path("part.stl"), binary_stl(tube(0.6 * blade_mm[:-1], np.array([0.0, 10.0]))))
    Path("plan.yaml").write_text(PLAN, encoding="utf-8")


def exit_status(arguments: list[str], monkeypatch: pytest.MonkeyPatch) -> int:
    monkeypatch.setattr(sys, "argv", ["cmmlink", *arguments])
    with pytest.raises(SystemExit) as ended:
        main()
    return int(ended.value.code or 0)


def expected_statuses() -> Iterator[tuple[list[str], int]]:
    """What each command has to end with; the demonstration, whose part has a bump, is the last run when records are looked at."""
    for command in COMMANDS:
        if command[0] == "runs":
            yield shlex.split("demo --headless --defect 0.12@40"), 1
        if command[0] not in FOR_A_DEVICE_OR_A_SCREEN:
            yield command, 1 if command[0] == "replay" else 0


@pytest.mark.usefixtures("_measuring_computer")
def test_the_commands_of_the_readme_do_what_it_says(monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]) -> None:
    assert "`cmmlink demo --defect 0.12@40`" in README
    monkeypatch.setattr("cmmlink.simulated.RATE_HZ", 40_000)  # nobody watches the demonstration
    for command, status in expected_statuses():
        assert exit_status(command, monkeypatch) == status, f"{command}: {capfd.readouterr()}"
    assert {"inspect", "check", "ct", "runs", "show", "replay", "export", "verify"} <= {command[0] for command in COMMANDS}
    assert "identical to the recorded result" in capfd.readouterr().out
    assert all((Path("demo-result") / name).is_file() for name in ("deviations.csv", "result.json", "profile.png", "report.pdf"))
    assert all(Path(name).is_dir() for name in ("result", "sections", "folder"))
