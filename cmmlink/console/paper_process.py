"""What is made of recorded runs on request, by another process and with less priority: a scan that goes on at the station keeps its own."""

import json
import subprocess
import sys
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path

from cmmlink.errors import RunError

_CHILD = (
    "import os, sys; sys.path.append(sys.argv.pop(1)); getattr(os, 'nice', int)(10); from cmmlink.__main__ import main; sys.exit(main())"
)
BELOW_NORMAL = getattr(subprocess, "BELOW_NORMAL_PRIORITY_CLASS", 0)  # Windows has no `nice`
_LONGEST_S = 300.0  # a report of a million points takes a few seconds


def this_program(words: Sequence[str]) -> list[str]:
    """What starts this program once more, with less priority than any run: `cmmlink` with these words behind it."""
    return [sys.executable, "-P", "-c", _CHILD, str(Path(__file__).resolve().parents[2]), *words]


def make_report(records: Path, run: str, file: Path, settings: Mapping[str, str]) -> None:
    """Write the report of a run, which is given by its id, as `cmmlink report` does.

    settings : options of that command without their dashes

    Raises RunError with what the command says where it fails, OSError where no process can be started.
    """
    _make(["report", run], records, file, [word for name, value in settings.items() for word in (f"--{name}", value)])


def make_comparison(records: Path, first: str, second: str, file: Path) -> None:
    """Draw the comparison of two runs, which are given by their ids, as `cmmlink compare` does. Raises like `make_report`."""
    _make(["compare", first, second], records, file, [])


def make_trend(records: Path, part: str, file: Path, options: Sequence[str]) -> None:
    """Write the trend of a part, as a drawing or a workbook, as `cmmlink plant trends` does. Raises like `make_report`."""
    _make(["plant", "trends", *options], records, file, ["--", part])


def _make(command: list[str], records: Path, file: Path, options: list[str]) -> None:
    words = [*command, "--records", str(records), "--out", str(file), "--json", *options]
    child, quiet = this_program(words), subprocess.DEVNULL
    try:
        ended = subprocess.run(child, stdin=quiet, capture_output=True, timeout=_LONGEST_S, creationflags=BELOW_NORMAL, check=False)
    except subprocess.TimeoutExpired:
        raise RunError(f"it was not made within {_LONGEST_S:g} s") from None
    if ended.returncode or not file.is_file():
        raise RunError(_refusal(ended.stdout) or f"it could not be made; `cmmlink {' '.join(command)}` says more")


def _refusal(answer: bytes) -> str:
    """What the command says of why it failed; empty where it says nothing."""
    with suppress(ValueError, KeyError, TypeError):
        return str(json.loads(answer)["error"]["message"])
    return ""
