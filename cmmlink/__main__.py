"""The command `cmmlink`, also as `python -m cmmlink`: what the signals of the system do to it, from its first moment to its last.

Ctrl-C ends it with exit status 130 and one line, also while libraries are being loaded. A request to end (SIGTERM, a terminal that is
closed, Ctrl-Break) leaves as an error does: temporary folders are removed, and processes that were started are ended.
"""

import gc
import os
import signal
import sys

_STOPPED = 130
_REQUESTS = ("SIGTERM", "SIGHUP", "SIGBREAK")  # as far as the system has them
_OBJECTS_BEFORE_A_LOOK = 400_000  # for garbage; libraries make some hundred thousand objects, and all of them stay
_OBJECTS_BETWEEN_LOOKS = 10_000


def main() -> None:
    """Run the command line."""
    interruptible = signal.getsignal(signal.SIGINT) is signal.default_int_handler
    os.environ.setdefault("PYDANTIC_DISABLE_PLUGINS", "1")  # else it looks for some through all that is installed
    gc.set_threshold(_OBJECTS_BEFORE_A_LOOK)
    gc.callbacks.append(_look_oftener)
    try:
        if interruptible:
            signal.signal(signal.SIGINT, _end_at_once)
        from cmmlink.commands import main as run  # noqa: PLC0415 - this takes a second, in which Ctrl-C has to work

        if interruptible:
            signal.signal(signal.SIGINT, signal.default_int_handler)
        for request in (getattr(signal, name) for name in _REQUESTS if hasattr(signal, name)):
            if signal.getsignal(request) is signal.SIG_DFL:  # else somebody wants it ignored, as nohup does
                signal.signal(request, _leave)
        run()
    except KeyboardInterrupt:
        _say_stopped()
        sys.exit(_STOPPED)
    finally:
        gc.freeze()  # the memory goes back to the system as it is: to look through it once more takes a sixth of a short command
        if interruptible:
            signal.signal(signal.SIGINT, signal.SIG_DFL)  # all is done; what is left is Python's own end


def _look_oftener(phase: str, _: object) -> None:
    """Once the first look for garbage is over: what is there by then stays and is not looked at again, and looks come oftener."""
    if phase == "stop":
        gc.callbacks.remove(_look_oftener)
        gc.freeze()
        gc.set_threshold(_OBJECTS_BETWEEN_LOOKS)


def _end_at_once(*_: object) -> None:
    """Stop while nothing is there yet that would have to be left in order."""
    _say_stopped()
    os._exit(_STOPPED)


def _leave(number: int, _: object) -> None:
    raise SystemExit(128 + number)


def _say_stopped() -> None:
    if sys.stderr is not None:
        sys.stderr.write("cmmlink: stopped by the operator\n")
        sys.stderr.flush()


if __name__ == "__main__":
    main()
