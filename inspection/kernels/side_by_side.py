"""The first use after an installation: two processes compile at once what takes longest, and share it on disk."""

import gc
import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from inspection.kernels.compiling import compiled_code_folder

_CHILD = """
import gc, sys
gc.disable()
sys.path.append(sys.argv[1])
from inspection.kernels.pose import compile_fit
compile_fit(outliers=sys.argv[2] == "outliers")
"""
_PATIENCE_S = 60.0  # the other process takes some 10 s


@contextmanager
def fit_compiled_beside(outliers: bool = False) -> Iterator[bool]:
    """Let another process compile the search and the fit while this one compiles the rest, where there is no compiled fit on disk.

    outliers : the fit that finds outliers as well

    Yields whether another process does. Nothing depends on it: what it has not left on disk is compiled here. It ends when the block does.
    """
    child = _start(outliers) if _is_worth_it() else None
    collects = gc.isenabled()
    try:
        if child is not None:
            gc.disable()  # a compiler makes millions of objects that stay: to look for garbage among them takes a tenth of its time
        yield child is not None
        if child is not None:
            with suppress(subprocess.TimeoutExpired):
                child.wait(_PATIENCE_S)
    finally:
        if collects:
            gc.enable()
        if child is not None:
            child.kill()
            child.wait()


def is_fit_compiled() -> bool:
    """Whether the fit, which is compiled last, is on disk."""
    folder = compiled_code_folder()
    return folder is not None and any(folder.rglob("pose.*.nbi"))


def _is_worth_it() -> bool:
    return compiled_code_folder() is not None and (os.cpu_count() or 1) > 1 and not is_fit_compiled()


def _start(outliers: bool) -> "subprocess.Popen[bytes] | None":
    """The other process; None where the system starts none."""
    asked, nothing = [str(Path(__file__).parents[2]), "outliers" if outliers else "fit"], subprocess.DEVNULL
    with suppress(OSError):
        return subprocess.Popen([sys.executable, "-P", "-c", _CHILD, *asked], stdin=nothing, stdout=nothing, stderr=nothing)
    return None
