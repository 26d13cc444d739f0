"""The installer of a computer without a network, with a Python of the test's that notes what it is asked for in place of doing it."""

import configparser
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

BUNDLE = Path(__file__).resolve().parents[2] / ".ci" / "bundle"
NOTING = """#!/bin/sh
echo "$0 $*" >>"$NOTED"
if [ "$2" = venv ]; then mkdir -p "$3/bin"; cp "$0" "$3/bin/python"; cp "$0" "$3/bin/cmmlink"; fi
"""

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="this installer is that of Linux")


def command_of(value: str) -> list[str]:
    """Take the key Exec apart as the specification of desktop files has it: escapes of a string, quotes, and field codes last."""
    text = value.replace("\\\\", "\\")
    words = [quoted or bare for quoted, bare in re.findall(r'"((?:[^"\\]|\\.)*)"|(\S+)', text)]
    return [re.sub(r"\\(.)", r"\1", word).replace("%%", "%") for word in words]


@pytest.mark.parametrize("name", ["cmmlink", "my work", "50 % of it", "it's $HOME", 'a "quoted" `one`', "back\\slash"])
def test_the_menu_entry_opens_the_console_wherever_it_was_installed(tmp_path: Path, name: str) -> None:
    bundle, folder = tmp_path / "bundle", tmp_path / name
    bundle.mkdir()
    (bundle / "install.sh").write_text((BUNDLE / "install.sh").read_text().replace("@PYTHON@", "3.11"))
    for file in ("cmmlink.png", "versions.txt"):
        (bundle / file).touch()
    python = tmp_path / "python"
    python.write_text(NOTING)
    python.chmod(0o755)
    noted = tmp_path / "noted"
    known = {
        "PYTHON": str(python),
        "NOTED": str(noted),
        "HOME": str(tmp_path),
        "XDG_DATA_HOME": str(tmp_path / "data"),
        "PATH": os.environ["PATH"],
    }
    subprocess.run(["sh", bundle / "install.sh", folder], env=known, check=True, capture_output=True)
    asked = noted.read_text()
    assert f"--no-index --find-links {bundle}/wheels --requirement {bundle}/versions.txt cmmlink" in asked
    assert asked.rstrip().endswith("prepare")
    entry = configparser.RawConfigParser(delimiters="=", interpolation=None, strict=True)
    entry.optionxform = str  # type: ignore[assignment,method-assign]
    entry.read(tmp_path / "data" / "applications" / "cmmlink.desktop", encoding="utf-8")
    assert command_of(entry["Desktop Entry"]["Exec"]) == [f"{folder}/program/bin/cmmlink", "console", f"{folder}/plans"]
    assert (folder / "plans").is_dir()


def test_another_python_than_the_wheels_are_for_is_refused(tmp_path: Path) -> None:
    text = (BUNDLE / "install.sh").read_text().replace("@PYTHON@", "3.2")
    (tmp_path / "install.sh").write_text(text)
    known = os.environ | {"PYTHON": sys.executable, "HOME": str(tmp_path)}
    ended = subprocess.run(["sh", tmp_path / "install.sh"], env=known, check=False, capture_output=True, text=True)
    assert ended.returncode == 1
    assert ended.stderr.startswith("This folder is for Python 3.2, and ")
    assert not (tmp_path / "cmmlink").exists()


def test_the_installers_are_sound_as_far_as_is_seen_without_running_them() -> None:
    subprocess.run([shutil.which("bash") or "sh", "-n", BUNDLE / "make"], check=True)
    windows = (BUNDLE / "install.ps1").read_text(encoding="ascii")
    for opened, closed in ("()", "{}"):
        assert windows.count(opened) == windows.count(closed)
    for needed in ("--no-index", "CreateShortcut", "$Link.Save()", "venv"):
        assert needed in windows
