"""The answer to a command of the operator that cannot be carried out. Nothing that is said on a page names a folder of this computer."""

import re
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from cmmlink.errors import PlanError, PlantError, RunError, StoreError
from drivers import PointFileError
from inspection import InspectionError

# A path from the root of a system, a drive or a share, up to its last part. Names may hold spaces between two of its strokes.
_FOLDERS = re.compile(r"""(?<![\w.:/\\~-])(?!/dev/)(?:(?:[A-Za-z]:)?[\\/]|\\\\)(?:[^\\/:'"`\n]*[^\\/:'"`\s][\\/])+""")


class Refused(Exception):  # noqa: N818 - it is the answer, not a failure
    """A command cannot be carried out now; the message says why and what to do."""


@contextmanager
def answer_errors() -> Iterator[None]:
    """Turn what cannot be read or used into an answer to the operator."""
    try:
        yield
    except (StoreError, RunError, PlanError, PlantError, InspectionError, PointFileError, OSError) as error:
        raise Refused(without_folders(str(error))) from None


def without_folders(text: str) -> str:
    """The text with files named without the folders that they lie in. Devices keep their whole name, which is an address."""
    for known in (Path.cwd(), Path.home(), Path(tempfile.gettempdir())):
        if known != known.parent:
            text = text.replace(f"{known}/", "").replace(f"{known}\\", "").replace(str(known), known.name)
    return _FOLDERS.sub("", text)


def words_of(error: OSError) -> str:
    """What the system refused, for the operator; where it happened stands in the log and is nothing for a page."""
    return f"the station's computer refuses it: {error.strerror or type(error).__name__}"
