"""The answer to a command of the operator that cannot be carried out."""

from collections.abc import Iterator
from contextlib import contextmanager

from cmmlink.errors import PlanError, RunError, StoreError
from drivers import PointFileError
from inspection import InspectionError


class Refused(Exception):  # noqa: N818 - it is the answer, not a failure
    """A command cannot be carried out now; the message says why and what to do."""


@contextmanager
def answer_errors() -> Iterator[None]:
    """Turn what cannot be read or used into an answer to the operator."""
    try:
        yield
    except (StoreError, RunError, PlanError, InspectionError, PointFileError, OSError) as error:
        raise Refused(str(error)) from None


def words_of(error: OSError) -> str:
    """What the system refused, for the operator; where it happened stands in the log and is nothing for a page."""
    return f"the station's computer refuses it: {error.strerror or type(error).__name__}"
