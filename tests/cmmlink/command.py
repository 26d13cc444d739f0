"""The command line called in this process, as `cmmlink ARGUMENTS` would be."""

import io
import json
import re
import sys
import tempfile
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from unittest.mock import patch

from cmmlink.commands import main

_COMPILING = re.compile("cmmlink: compiling the inspection, .*\n")  # said by whichever test is the first after an installation


@dataclass(frozen=True, slots=True)
class Ended:
    """How a command ended."""

    code: int
    out: str
    err: str

    def json(self) -> dict[str, Any]:
        """Take standard output as the one JSON object it has to be."""
        assert self.out.count("\n") == 1, self.out
        found = json.loads(self.out)
        assert isinstance(found, dict)
        return found

    def refused(self) -> str:
        """Take the one message of a command that found its input unusable."""
        return self.failed(2)

    def failed(self, code: int) -> str:
        """Take the one message of a command that failed with this exit code."""
        assert self.code == code, f"{self.code}: {self.out}{self.err}"
        lines = self.err.splitlines()
        assert len(lines) == 1, self.err
        assert lines[0].startswith("cmmlink: "), self.err
        return lines[0].removeprefix("cmmlink: ")


def cmmlink(*arguments: object) -> Ended:
    """Run one command to its end, with a folder of its own in place of the user's records."""
    words = ["cmmlink", *map(str, arguments)]
    with (
        tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as records,
        patch("cmmlink.record.default_folder", lambda: Path(records)),
        patch.object(sys, "argv", words),
        redirect_stdout(io.StringIO()) as out,
        redirect_stderr(io.StringIO()) as err,
    ):
        try:
            main()
        except SystemExit as ended:
            return Ended(int(ended.code or 0), out.getvalue(), _COMPILING.sub("", err.getvalue()))
    raise AssertionError("a command must end with an exit code")
