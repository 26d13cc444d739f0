"""The first use after an installation: two processes compile at once what takes longest, and share it on disk."""

import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from inspection.kernels.compiling import compiled_code_folder

_CHILD = "import sys; sys.path.append(sys.argv[1]); from inspection.kernels.pose import compile_fit; compile_fit()"
_PATIENCE_S = 60.0  # the other process takes some 5 s


@contextmanager
def fit_compiled_beside() -> Iterator[None]:
    """Let another process compile the search and the fit while this one compiles the projection, where there is no compiled fit on disk.

    Nothing depends on the other process: what it has not left on disk is compiled here. It ends when the block does.
    """
    child = _start() if _is_worth_it() else None
    try:
        yield
        if child is not None:
            with suppress(subprocess.TimeoutExpired):
                child.wait(_PATIENCE_S)
    finally:
        if child is not None:
            child.kill()
            child.wait()


def _is_worth_it() -> bool:
    folder = compiled_code_folder()
    return folder is not None and (os.cpu_count() or 1) > 1 and not any(folder.rglob("pose.*.nbi"))


def _start() -> "subprocess.Popen[bytes] | None":
    """The other process; None where the system starts none."""
    root, nothing = str(Path(__file__).parents[2]), subprocess.DEVNULL
    with suppress(OSError):
        return subprocess.Popen([sys.executable, "-P", "-c", _CHILD, root], stdin=nothing, stdout=nothing, stderr=nothing)
    return None
