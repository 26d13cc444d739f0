"""What a command's exit status says, and the one line on standard error that goes with a failure."""

import json
import logging
import sys
from collections.abc import Sequence
from contextlib import suppress

from cmmlink.words import printable
from inspection import NotMeasured, Verdict

EXIT_OF = {Verdict.CONFORM: 0, Verdict.NONCONFORM: 1, Verdict.UNCERTAIN: 3}
UNUSABLE, DEVICE_FAILED, NO_RECORD = 2, 4, 5
_KIND_OF = {UNUSABLE: "unusable", DEVICE_FAILED: "device-failed", NO_RECORD: "no-record"}
_WORST_FIRST = (NO_RECORD, EXIT_OF[Verdict.NONCONFORM], DEVICE_FAILED, UNUSABLE, EXIT_OF[Verdict.UNCERTAIN], EXIT_OF[Verdict.CONFORM])
STOPPED = 130  # by Ctrl-C outside a run; shells and typer use this number


_log = logging.getLogger(__name__)


def worst_of(codes: Sequence[int]) -> int:
    """The exit status of several parts together; that of none is 0."""
    return min(codes, key=_WORST_FIRST.index, default=EXIT_OF[Verdict.CONFORM])


def fail(message: str, code: int) -> int:
    """Write a message to standard error, and to the log together with the error being handled. Returns the code."""
    _log.error("%s", message, exc_info=sys.exc_info()[0] is not None)
    say(message)
    return code


def say(message: str) -> None:
    """Write a message to standard error, whatever signs of a file or a device are quoted in it."""
    sys.stderr.write(f"cmmlink: {printable(message)}\n")


def kind_of_failure(error: Exception, code: int) -> str:
    """The word that JSON has for what went wrong."""
    return "not-measured" if isinstance(error, NotMeasured) else _KIND_OF[code]


def fail_as_asked(error: Exception, code: int) -> int:
    """The same for an error that leaves no result; where --json was asked for, a JSON object on standard output says it as well."""
    _say_in_json(kind_of_failure(error, code), str(error), code)
    return fail(f"{error} (NOT MEASURED)" if isinstance(error, NotMeasured) else str(error), code)


def fail_in_words(kind: str, message: str, code: int = UNUSABLE) -> int:
    """The same for what is no error of an inspection: a mistake in the command, the system's refusal, or a defect of the program."""
    _say_in_json(kind, message, code)
    return fail(message, code)


def _say_in_json(kind: str, message: str, code: int) -> None:
    """Where --json was asked for, say on standard output what went wrong; where that is broken, standard error still says it."""
    if "--json" not in sys.argv[1:]:
        return
    with suppress(OSError, ValueError):  # a closed stream is a ValueError
        sys.stdout.write(json.dumps({"error": {"kind": kind, "message": message, "exit_status": code}}) + "\n")
        sys.stdout.flush()
