"""What a command's exit status says, and the one line on standard error that goes with a failure."""

import sys

from inspection import Verdict

EXIT_OF = {Verdict.CONFORM: 0, Verdict.NONCONFORM: 1, Verdict.UNCERTAIN: 3}
UNUSABLE, DEVICE_FAILED, NO_RECORD = 2, 4, 5
STOPPED = 130  # Ctrl-C outside a run, as shells and typer have it


def fail(message: str, code: int) -> int:
    """Write a message to standard error; returns the code."""
    sys.stderr.write(f"cmmlink: {message}\n")
    return code
