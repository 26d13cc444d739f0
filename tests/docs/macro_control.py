"""A control that runs short macro programs of Fanuc's kind, as far as those of docs/machines.md go, with a part under its probe.

It knows assignments, IF GOTO, subprograms (M98, and with letters G65), skip moves (G31), straight moves, dwelling (G4), DPRNT, and alarms
(#3000). What it does not know it refuses. Variables that hold nothing are refused as well, so that a misspelled number shows.
"""

import operator
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
_LOCALS = dict(zip("ABCDEFHIJKMQRSTUVWXYZ", (1, 2, 3, 7, 8, 9, 11, 4, 5, 6, 13, 17, 18, 19, 20, 21, 22, 23, 24, 25, 26), strict=True))
_SYSTEM = 5000
_COMPARED = {"LT": operator.lt, "GT": operator.gt, "LE": operator.le, "EQ": operator.eq}
_WORD = re.compile(r"([A-Z])(#[0-9]+|\[[^A-Z]*\]|[-+]?[0-9.]+)")


class AlarmError(Exception):
    """The program ended itself."""


@dataclass
class Control:
    """Runs programs.
    touch       : gives the centre of the ball (3,) where it meets the part between two places, or None where it does not
    sign_places : how many places DPRNT keeps for a sign before the digits of a number: controls differ
    dwell       : is called with the seconds for which the control waits
    """

    programs: Mapping[int, list[str]]
    touch: Callable[[Array, Array], Array | None]
    place_mm: Array
    sign_places: int = 0
    dwell: Callable[[float], None] = lambda _: None
    printed: list[str] = field(default_factory=list)
    is_open: bool = False
    shared: dict[int, float] = field(default_factory=dict)

    def run(self, number: int, letters: Mapping[int, float] | None = None) -> None:
        """Run a program from its first block to M99 or M30."""
        own, blocks, at = dict(letters or {}), self.programs[number], 0
        while True:
            block = re.sub(r"^N[0-9]+ ?", "", blocks[at])
            at += 1
            if not block:
                continue
            if block in ("M99", "M30"):
                return
            if jump := re.fullmatch(r"IF\[(.*)(LT|GT|LE|EQ)(.*?)\]GOTO([0-9]+)", block):
                left, right = self.value(jump[1], own), self.value(jump[3], own)
                if _COMPARED[jump[2]](left, right):
                    at = next(k for k, line in enumerate(blocks) if re.match(rf"N{jump[4]}\b", line))
            else:
                self.carry_out(block, own)

    def carry_out(self, block: str, own: dict[int, float]) -> None:
        """Carry out a block that leads to the next one."""
        if assigned := re.fullmatch(r"#([0-9]+)=(.+)", block):
            number = int(assigned[1])
            if number == 3000:
                raise AlarmError(int(assigned[2]))
            (own if number < 100 else self.shared)[number] = self.value(assigned[2], own)
        elif called := re.fullmatch(r"M98 P([0-9]+)", block):
            self.run(int(called[1]))
        elif waited := re.fullmatch(r"G4 X([0-9.]+)", block):
            self.dwell(float(waited[1]))
        elif block in ("POPEN", "PCLOS"):
            self.is_open = block == "POPEN"
        elif printed := re.fullmatch(r"DPRNT\[(.*)\]", block):
            assert self.is_open
            assert re.fullmatch(r"(?:[A-Z0-9+\-/*]|#[0-9]+\[[0-9]{2}\])*", printed[1]), block
            self.printed.append(self._line(printed[1], own))
        else:
            self._move(block, own)

    def value(self, text: str, own: Mapping[int, float]) -> float:
        """The value of an expression."""
        assert re.fullmatch(r"(?:ABS|#[0-9]+|[0-9.]+|[-+*\[\]])+", text), text
        known = {**self.shared, **own} | {_SYSTEM + 41 + axis: float(self.place_mm[axis]) for axis in range(3)}
        found = re.sub(r"#([0-9]+)", lambda number: f"({known[int(number[1])]!r})", text)
        return float(eval(found.replace("[", "(").replace("]", ")").replace("ABS", "abs"), {"__builtins__": {}, "abs": abs}))

    def _line(self, text: str, own: Mapping[int, float]) -> str:
        """What DPRNT prints: * as a blank, #n[wf] as a number with w places before the point and f behind it."""

        def number(found: re.Match[str]) -> str:
            before, after = int(found[2]), int(found[3])
            assert 0 < before + after <= 8
            return f"{self.value('#' + found[1], own):{self.sign_places + before + after + bool(after)}.{after}f}"

        return re.sub(r"#([0-9]+)\[([0-9])([0-9])\]", number, text.replace("*", " "))

    def _move(self, block: str, own: dict[int, float]) -> None:
        """Go where the words say; a skip move ends where the probe meets the part."""
        words = _WORD.findall(block)
        assert re.sub(r" |G[0-9]+", "", block) == "".join(letter + value for letter, value in words if letter != "G"), block
        codes = {int(value) for letter, value in words if letter == "G"}
        assert codes <= {1, 17, 21, 31, 40, 54, 65, 90}, block
        values = {letter: self.value(value.removeprefix("+"), own) for letter, value in words if letter != "G"}
        if 65 in codes:
            self.run(int(values.pop("P")), {_LOCALS[letter]: value for letter, value in values.items()})
        elif "F" in values:
            target_mm = np.array([values.get(axis, self.place_mm[k]) for k, axis in enumerate("XYZ")])
            met_mm = self.touch(self.place_mm, target_mm)
            assert met_mm is None or 31 in codes, f"the probe runs into the part: {block}"
            self.place_mm = target_mm if met_mm is None else met_mm
            if 31 in codes:
                self.shared |= {_SYSTEM + 61 + axis: float(self.place_mm[axis]) for axis in range(3)}


def programs_in(text: str) -> dict[int, list[str]]:
    """The blocks of every program by its number, without comments."""
    found: dict[int, list[str]] = {}
    for line in text.splitlines():
        block = re.sub(r" *\([^()]*\)", "", line).strip()
        if opened := re.fullmatch(r"O([0-9]+)", block):
            found[int(opened[1])] = []
        elif block and block != "%":
            found[list(found)[-1]].append(block)
    return found
