"""Where compiled code is kept from one process to the next.

When numba loads compiled code it looks for changes in the file of that one function, not in the files of what the function
calls. So the folder is named after the content of every file of the package: any edit leads to another folder, and nothing
stale is ever loaded. A package within the package has a folder of its own, named after its files and those of the package around it:
an edit of the inner one leaves the code of the outer one as it is.
"""

import hashlib
import shutil
import sys
import tempfile
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path

_NAME = "compiled-"  # the stamp follows
_STAMP_DIGITS = 16  # of a sha256: 64 bits tell the versions of one package apart, and Windows allows paths of 260 letters only
_IDLE_S = 3600.0  # an older version's folder in which nothing was written for so long is in nobody's use


def stamp_of(*packages: Path) -> str:
    """A text that changes with the name or content of any file of some packages. Empty where they have no files, as in an archive."""
    files = [file for package in packages for file in sorted(package.glob("*.py"))]
    content = hashlib.sha256()
    for file in files:
        code = file.read_bytes()
        content.update(f"{file.name} {len(code)} ".encode() + code)
    return content.hexdigest()[:_STAMP_DIGITS] if files else ""


def stamped_folder(stamp: str, places: Iterable[Path]) -> Path | None:
    """The folder of a stamp in the first of the places that can be written; None where there is no such place.

    A folder that has to be made takes the place of those of other stamps.
    """
    for place in places:
        folder = place / f"{_NAME}{stamp}"
        with suppress(OSError):
            is_new = not folder.exists()
            folder.mkdir(parents=True, exist_ok=True)
            tempfile.TemporaryFile(dir=folder).close()
            if is_new:
                _remove_others(folder)
            return folder
    return None


def places_for(package: Path, chosen: str) -> Iterable[Path]:
    """Folders in which a package's compiled code may be kept: that chosen by the user, if any, or the package's own, then the user's.

    chosen : numba's setting; the name of a folder, or empty
    """
    own = f"{package.name}-{hashlib.sha256(str(package.resolve()).encode()).hexdigest()[:_STAMP_DIGITS]}"
    yield Path(chosen) / own if chosen else package / "__pycache__"
    with suppress(RuntimeError):  # an account without a home
        yield Path.home() / _user_caches(sys.platform) / "cmmlink" / own


def _user_caches(platform: str) -> str:
    return {"win32": "AppData/Local", "darwin": "Library/Caches"}.get(platform, ".cache")


def _remove_others(folder: Path) -> None:
    """Remove the folders of other stamps. A process of an older version may still run, so what was written lately stays."""
    now = folder.stat().st_mtime
    for other in folder.parent.glob(f"{_NAME}*"):
        with suppress(OSError):  # another process is removing it as well
            last_write = max(path.stat().st_mtime for path in (other, *other.rglob("*")))
            if other != folder and now - last_write > _IDLE_S:
                shutil.rmtree(other, ignore_errors=True)
