"""The commands of the README run as they stand there, in their order, on files of the names that they use."""

import re
import shlex
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from cmmlink.commands import main
from cmmlink.plan import load_plan

README = (Path(__file__).resolve().parents[2] / "README.md").read_text(encoding="utf-8")
BLOCKS = re.findall(r"^```sh\n(.*?)^```", README, re.MULTILINE | re.DOTALL)
COMMANDS = [
    words[1:] if words[0] == "cmmlink" else words
    for line in "".join(BLOCKS).splitlines()
    if (words := shlex.split(line, comments=True)) and words[0] in ("cmmlink", "cd")
]
FOR_A_DEVICE_OR_A_SCREEN = ("run", "console")
PLANS = [text for text in re.findall(r"^```yaml\n(.*?)^```", README, re.MULTILINE | re.DOTALL) if text.startswith("part:")]


@pytest.fixture
def _measuring_computer(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A folder for the files of the example, and the user's own folder."""
    monkeypatch.chdir(tmp_path)
    for name in ("XDG_DATA_HOME", "WIN_PD_OVERRIDE_LOCAL_APPDATA"):
        monkeypatch.setenv(name, str(tmp_path / "user"))


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
        if command[0] == "cd":
            monkeypatch.chdir(command[1])
            continue
        assert exit_status(command, monkeypatch) == status, f"{command}: {capfd.readouterr()}"
    assert {"example", "inspect", "check", "ct", "runs", "show", "replay", "export", "verify"} <= {command[0] for command in COMMANDS}
    assert "identical to the recorded result" in capfd.readouterr().out
    assert all((Path("demo-result") / name).is_file() for name in ("deviations.csv", "result.json", "profile.png", "report.pdf"))
    assert all(Path(name).is_dir() for name in ("result", "sections", "folder"))


@pytest.mark.parametrize("text", PLANS, ids=lambda text: text.splitlines()[0])
def test_a_plan_of_the_readme_can_be_read(tmp_path: Path, text: str) -> None:
    (tmp_path / "plan.yaml").write_text(text, encoding="utf-8")
    assert load_plan(tmp_path / "plan.yaml").part.name
