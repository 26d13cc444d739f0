"""What a recorded run was judged by, as it is on record: its plan, its nominal's file, and what decodes the bytes of its device."""

import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TypeVar

from cmmlink.errors import RunError, StoreError, YamlError
from cmmlink.plan import Plan, SurfacePlan, read_model
from cmmlink.record.reader import RecordedRun
from cmmlink.record.shapes import plain_name
from drivers import Decoder

PlanOfRun = TypeVar("PlanOfRun", Plan, SurfacePlan)


def recorded_plan(recorded: RecordedRun) -> Plan:
    """The effective plan of a recorded run of a section.

    Raises RunError where it is one of a whole surface, StoreError when this version cannot read it.
    """
    if recorded.is_of_surface:
        raise RunError(f"run {recorded.run} is one of a whole surface, of which there is none of this: it is made of runs of sections")
    return _plan_of(recorded, Plan)


def recorded_surface_plan(recorded: RecordedRun) -> SurfacePlan:
    """The effective plan of a recorded run of a whole surface. Raises StoreError when this version cannot read it."""
    return _plan_of(recorded, SurfacePlan)


def _plan_of(recorded: RecordedRun, kind: type[PlanOfRun]) -> PlanOfRun:
    try:
        return read_model(recorded.plan, kind)
    except YamlError as error:
        raise StoreError(f"the plan of run {recorded.run} cannot be read by this version of cmmlink: {error}") from None


def recorded_decoder(plan: PlanOfRun, recorded: RecordedRun, decoder_of: Callable[[PlanOfRun], Decoder | None]) -> Decoder | None:
    """The decoder of the device in a recorded plan, None for one without wire bytes. Raises StoreError."""
    try:
        return decoder_of(plan)
    except ValueError as error:  # a format, an option or a register map that was valid on that day, or is gone
        raise StoreError(f"the device in the plan of run {recorded.run} cannot be read by this version of cmmlink: {error}") from None


@contextmanager
def with_recorded_file(plan: PlanOfRun, recorded: RecordedRun) -> Iterator[PlanOfRun]:
    """The plan with the nominal's file as it was recorded, which is there while this is entered."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / f"nominal-{plain_name(recorded.header['nominal'])}"
        try:
            file.write_bytes(recorded.nominal)
        except OSError as error:
            raise StoreError(f"{folder}: the nominal cannot be written there: {error.strerror or error}; free some space") from error
        yield plan.with_nominal_file(file)
