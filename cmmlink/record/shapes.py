"""What the documents of a record hold, checked when they are read: a body that fits its hash may still be none that cmmlink wrote.

Keys that are not named here pass: later versions write more.
"""

import json
from datetime import datetime
from functools import cache
from pathlib import PurePosixPath
from typing import Annotated, Any, TypeVar

from pydantic import AfterValidator, BaseModel, ConfigDict, TypeAdapter, ValidationError

from cmmlink.errors import StoreError
from cmmlink.words import VerdictName

Kept = TypeVar("Kept")
_LONGEST_NAME = 100


def _require_moment(text: str) -> str:
    datetime.fromisoformat(text)
    return text


Moment = Annotated[str, AfterValidator(_require_moment)]


class _Document(BaseModel):
    model_config = ConfigDict(strict=True, extra="allow")


class Place(_Document):
    """The place of a section in its stack."""

    section: int
    sections: int
    height_mm: float
    doubt: str | None = None


class QualificationNamed(_Document):
    """The last qualification of the installation that recorded a run."""

    date: Moment
    result: str
    certificate_sha256: str
    same_installation: bool
    words: str


class Header(_Document):
    """The record that a run begins with."""

    run: str
    started: Moment
    clock_s: float
    part: str
    serial_number: str
    operator: str
    device: str
    simulated: bool
    notes: list[str] = []
    qualification: QualificationNamed | None = None
    software: dict[str, str | None]
    nominal: str
    plan_file: str = ""
    station: str = ""
    stack: Place | None = None


class End(_Document):
    """The record that a run ends with."""

    state: str
    message: str
    ended: Moment
    received: int | None
    verdict: VerdictName | None
    coverage: float | None = None
    result_sha256: str = ""


class Worst(_Document):
    """The worst point of a result."""

    deviation_mm: float | None = None
    station_mm: float | None = None


class Limits(_Document):
    """The zone of a result."""

    lower_mm: float | None = None
    upper_mm: float | None = None


class Pose(_Document):
    """The registration of a result."""

    other_poses: list[Any] = []


class Reason(_Document):
    """Why a verdict is no other."""

    kind: str
    words: str


class Judged(_Document):
    """A characteristic of a result."""

    name: str
    verdict: VerdictName


class Result(_Document):
    """The result of a run, as far as anything but a person reads it."""

    received: int
    judged: int
    rejected: int
    lost: int
    damaged_bytes: int
    rejected_by_reason: dict[str, int]
    out_of_tolerance: int
    verdict: VerdictName
    coverage: float | None
    worst: Worst | None = None
    tolerance: Limits | None = None
    registration: Pose | None
    reasons: list[Reason] = []
    characteristics: list[Judged] = []


class Placed(_Document):
    """An arrival with its place in the run."""

    event: str
    time_s: float
    reads: int
    points: int
    values: dict[str, Any]


def read_document(body: bytes) -> Any:
    """Read a document, whatever it holds. Raises StoreError."""
    try:
        return json.loads(body)
    except (ValueError, RecursionError, TypeError):
        raise StoreError("it is no document that can be read") from None


def checked(shape: type[Kept], document: object) -> Kept:
    """The document as a value of a shape. Raises StoreError, which names the first thing that is not as it has to be."""
    try:
        shape_itself: Any = shape
        found: Kept = _adapter(shape_itself).validate_json(json.dumps(document), strict=True)  # as JSON: there an arrival is an object
    except ValidationError as error:
        first = error.errors(include_url=False, include_input=False)[0]
        place = ".".join(str(part) for part in first["loc"])
        told = f"{place}: " if place else ""
        raise StoreError(f"it is not as cmmlink writes it ({told}{first['msg'][:1].lower()}{first['msg'][1:]})") from None
    return found


def plain_name(recorded: str) -> str:
    """The name of a recorded file as one that every system takes, behind a word of ours: no folder, no sign with a meaning, not endless."""
    name = PurePosixPath(recorded.replace("\\", "/")).name
    name = "".join(sign if sign.isascii() and (sign.isalnum() or sign in " ._+-()") else "_" for sign in name)
    return name[-_LONGEST_NAME:].strip(" .") or "file"


@cache
def _adapter(shape: Any) -> TypeAdapter[Any]:
    return TypeAdapter(shape)
