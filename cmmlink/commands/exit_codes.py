"""What a command's exit status says, and the one line on standard error that goes with a failure."""

import logging
import sys

from inspection import Verdict

EXIT_OF = {Verdict.CONFORM: 0, Verdict.NONCONFORM: 1, Verdict.UNCERTAIN: 3}
UNUSABLE, DEVICE_FAILED, NO_RECORD = 2, 4, 5
STOPPED = 130  # by Ctrl-C outside a run; shells and typer use this number


_log = logging.getLogger(__name__)


def fail(message: str, code: int) -> int:
    """Write a message to standard error, and to the log together with the error being handled. Returns the code."""
    _log.error("%s", message, exc_info=sys.exc_info()[0] is not None)
    sys.stderr.write(f"cmmlink: {message}\n")
    return code
