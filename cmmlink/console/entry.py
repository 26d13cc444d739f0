"""What the operator chose and entered for the next part."""

from dataclasses import dataclass, replace

from cmmlink.console.choice import CheckedPlan, CheckedSurface, Choice
from cmmlink.console.device_test import UNTESTED
from cmmlink.console.protocol import DeviceTest
from cmmlink.console.refused import Refused, answer_errors
from cmmlink.plan import next_serial_number

_LONGEST_NAME = 120


@dataclass(frozen=True, slots=True, eq=False)
class Entry:
    """The chosen plan, the last test of its device, and what belongs to the next part.

    question : what has to be confirmed before the part is measured; empty where nothing has
    typed : names of what the operator typed for the next part; no plan replaces it, whenever its check comes back
    """

    serial_number: str = ""
    operator: str = ""
    address: str = ""
    choice: Choice | None = None
    test: DeviceTest = UNTESTED
    question: str = ""
    typed: frozenset[str] = frozenset()

    def with_choice(self, choice: Choice) -> "Entry":
        """The entry with a plan chosen; another plan than before brings an address of its own, and a serial number if none was typed."""
        if self.choice is not None and self.choice.name == choice.name:
            return replace(self, choice=choice, question="")
        plan = choice.checked.plan if choice.checked else None
        address = str(getattr(plan.device, "address", "")) if plan else ""
        planned = (plan.part.serial_number or "") if plan else ""
        serial_number = self.serial_number if "serial_number" in self.typed else planned
        operator = self.operator or ((plan.operator or "") if plan else "")
        return Entry(serial_number, operator, address, choice, typed=self.typed)

    def for_next_part(self) -> "Entry":
        """The entry once its part was measured: the serial number is counted up, and waits to be typed over."""
        return replace(self, serial_number=next_serial_number(self.serial_number), question="", typed=self.typed - {"serial_number"})

    def with_values(self, serial_number: str | None, operator: str | None, address: str | None) -> "Entry":
        """The entry with new values; None leaves one as it is. Raises Refused."""
        typed = {"serial_number"} if serial_number is not None and serial_number.strip() != self.serial_number else set()
        return replace(
            self,
            question="" if typed else self.question,
            typed=self.typed | typed,
            serial_number=self.serial_number if serial_number is None else _printable(serial_number, "serial number"),
            operator=self.operator if operator is None else _printable(operator, "operator"),
            address=self.address if address is None else _printable(address, "address"),
        )

    def planned(self) -> CheckedPlan | CheckedSurface:
        """The chosen plan with the part and the address that were entered, and its nominal. Raises Refused."""
        if self.choice is None:
            raise Refused("choose a plan first")
        checked = self.choice.checked
        if checked is None:
            raise Refused(self.choice.shown.problem)
        with answer_errors():
            if isinstance(checked, CheckedSurface):
                surface = checked.plan.with_address(self.address) if self.address and checked.plan.has_address else checked.plan
                return CheckedSurface(surface.with_part(self.serial_number, self.operator), checked.file)
            plan = checked.plan.with_address(self.address) if self.address and checked.plan.has_address else checked.plan
            return CheckedPlan(plan.with_part(self.serial_number, self.operator), checked.profile)


def _printable(text: str, what: str) -> str:
    text = text.strip()
    if len(text) > _LONGEST_NAME or not text.isprintable():
        raise Refused(f"the {what} must be printable and at most {_LONGEST_NAME} characters long")
    return text
