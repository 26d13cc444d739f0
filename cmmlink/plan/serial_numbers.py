"""Serial numbers: what a plan asks of them, and which one comes next."""

import re
from typing import Any

from pydantic import Field, model_validator

from cmmlink.plan.yaml_model import Settings, Text

SERIAL_NUMBER = "what is asked of the serial number of each part: required, or a mapping with required and pattern; null: nothing is"
_SIGNS = {"#": "[0-9]", "@": "[A-Za-z]", "?": "."}


class SerialNumbers(Settings):
    """What is asked of the serial number of each part; the word `required` is the short form."""

    required: bool = Field(default=True, description="whether no part is measured without a serial number")
    pattern: Text | None = Field(
        default=None,
        description="how every serial number is spelled: # stands for a digit, @ for a letter, ? for any sign, all else for itself, "
        "like B-####; null: as one likes",
    )

    @model_validator(mode="before")
    @classmethod
    def _in_a_word(cls, given: Any) -> Any:
        if not isinstance(given, str):
            return given
        if given.strip() != "required":
            raise ValueError("the word required, or a mapping with required and pattern, like {pattern: B-####}")
        return {}

    def problem_with(self, serial_number: str) -> str:
        """What is wrong with a serial number, in words; empty where it may be used."""
        if not serial_number:
            return "the plan asks for a serial number, and none was given" if self.required else ""
        if self.pattern is None or re.fullmatch("".join(_SIGNS.get(sign, re.escape(sign)) for sign in self.pattern), serial_number):
            return ""
        return f"the serial number {serial_number} is not spelled as the plan asks: {self.pattern} (# a digit, @ a letter, ? any sign)"


def next_serial_number(serial_number: str) -> str:
    """Count the last number in a serial number up by one, keeping its width: B-0099 becomes B-0100. Empty where there is no number."""
    found = re.fullmatch(r"(.*?)([0-9]+)([^0-9]*)", serial_number)
    if not found:
        return ""
    head, digits, tail = found.groups()
    return f"{head}{int(digits) + 1:0{len(digits)}d}{tail}"
