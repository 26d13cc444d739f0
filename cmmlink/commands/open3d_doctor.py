"""Checks whether Open3D can be loaded, installs what is missing where it can, and says what else to do. Run by make and by `doctor`."""

import os
import subprocess
import sys
from collections.abc import Callable, Sequence

from drivers.surface import Open3DStatus, mend_open3d, open3d_status


def look_after_open3d(
    say: Callable[[str], None],
    *,
    status: Callable[[], Open3DStatus] = open3d_status,
    run: Callable[[Sequence[str]], int] | None = None,
    is_root: bool | None = None,
) -> bool:
    """Return whether Open3D works or is not installed, after installing missing system libraries where apt and root allow it."""
    found = status()
    root = is_root if is_root is not None else hasattr(os, "geteuid") and os.geteuid() == 0
    if found.version is None and found.mend is not None and mend_open3d(found, run or _run, root):
        say(f"installed for Open3D: {' '.join(found.mend[3:])}")
        found = status()
    say(found.sentence())
    if found.version is None:
        say("surfaces are cut by numpy, with the same points; PLY files need Open3D")
    return found.version is not None or not found.installed


def _run(command: Sequence[str]) -> int:
    return subprocess.run(command, check=False, stdout=subprocess.DEVNULL).returncode


if __name__ == "__main__":
    look_after_open3d(lambda text: print(text, file=sys.stderr))  # noqa: T201 - a program of its own, for make
