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
