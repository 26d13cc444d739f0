"""The next part of a series, from the command line: its serial number, who measures, and what was recorded of it before."""

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

import typer

from cmmlink.commands.output import now
from cmmlink.errors import PlanError
from cmmlink.words import printable, repetition_words

if TYPE_CHECKING:
    from cmmlink.devices import Connect, Connected
    from cmmlink.plan import Plan, SurfacePlan

AnyPlan = TypeVar("AnyPlan", "Plan", "SurfacePlan")


@dataclass(frozen=True, slots=True)
class NextPart:
    """What is asked for on the command line: a serial number, or the one after the last that was recorded, and who measures."""

    serial_number: str | None
    operator: str | None
    count_up: bool

    def of(self, plan: AnyPlan, records: Path, *, asks: bool) -> tuple[AnyPlan, tuple[str, ...]]:
        """The plan of this part, and notes on it. Raises PlanError for a serial number that the plan does not allow.

        asks : whether somebody may be asked here: for a serial number that is required, and whether one is to be measured again
        """
        from cmmlink.record import earlier_run

        can_ask = asks and sys.stdin.isatty()
        serial_number = self._chosen(plan, records)
        if not serial_number and plan.serial_number is not None and plan.serial_number.required and can_ask:
            serial_number = str(typer.prompt("Serial number of the part", err=True)).strip()
        part = plan.with_part(serial_number, self.operator)
        before = earlier_run(records, plan.part.name, serial_number, now) if serial_number else None
        if before is None:
            return part, ()
        told = repetition_words(serial_number, before)
        if can_ask and not typer.confirm(f"{printable(told)}. Measure it again?", err=True):
            raise PlanError(f"{told}; it was not measured again")
        return part, (told,)

    def _chosen(self, plan: "Plan | SurfacePlan", records: Path) -> str:
        from cmmlink.plan import next_serial_number
        from cmmlink.record import last_serial_number

        if self.serial_number is not None and self.count_up:
            raise PlanError("--serial and --next are both given; expected one of them")
        if not self.count_up:
            return (self.serial_number if self.serial_number is not None else plan.part.serial_number or "").strip()
        last = last_serial_number(records, plan.part.name, now)
        if last is None and plan.part.serial_number:
            return plan.part.serial_number
        if last is None:
            raise PlanError(
                f"--next: no part called {plan.part.name} was recorded with a serial number yet; give the first one with --serial"
            )
        following = next_serial_number(last)
        if not following:
            raise PlanError(f"--next: the last serial number, {last}, ends in no number to be counted up; give one with --serial")
        return following


@contextmanager
def connect_part(
    connect: "Connect", serial_number: str | None, notes: tuple[str, ...], plan: "Plan | SurfacePlan"
) -> Iterator["Connected"]:
    """Connect the device of a plan; what is known of the part with this serial number stands beside its verdict."""
    with connect(plan) as device:
        yield replace(device, notes=(*notes, *device.notes)) if plan.part.serial_number == serial_number else device
