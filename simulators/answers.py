"""How the control of a machine tool takes the answer to its request: it reads a program of assignments until that answers its own request.

The program is carried out as a control would: each line sets a macro variable, and M99 ends it. A program without its end is not taken.
"""

import re
import time
from collections.abc import Callable, Mapping
from pathlib import Path

VERDICT, WORST, REQUEST = 150, 151, 152  # the macro variables
WORDS: Mapping[int, str] = {1: "CONFORM", 2: "NOT CONFORM", 3: "NOT PROVEN", 9: "NOT JUDGED"}
RELEASED, STOPPED = "the part is released", "the machine stops"
LOOK_S = 0.05
_ASSIGNMENT = re.compile(r"#(\d+)=(-?(?:\d+\.?\d*|\.\d+))(?: *\([^()]*\))?")


def variables_set_by(program: str) -> dict[int, float] | None:
    """The macro variables after the program was carried out; None where it is none, or has no end."""
    lines = [line.strip() for line in program.splitlines()]
    if not lines or not re.fullmatch(r"O\d+(?: *\([^()]*\))?", lines[0]) or "M99" not in lines:
        return None
    found: dict[int, float] = {}
    for line in lines[1 : lines.index("M99")]:
        if assignment := _ASSIGNMENT.fullmatch(line):
            found[int(assignment[1])] = float(assignment[2])
        elif not re.fullmatch(r"\([^()]*\)", line):
            return None
    return found


def await_answer(
    file: Path, request: int, within_s: float, clock: Callable[[], float] = time.monotonic, sleep: Callable[[float], None] = time.sleep
) -> str:
    """Wait for the answer to a request, and say what the machine does: it releases the part for the verdict CONFORM alone."""
    end_s, before = clock() + within_s, ""
    while True:
        found = _read(file)
        answered = 0 if found is None else round(found.get(REQUEST, 0.0))
        if found is not None and answered == request:
            code = round(found.get(VERDICT, 0.0))
            told = f"request {request}: {WORDS.get(code, f'verdict {code}')}, worst deviation {found.get(WORST, 0.0):g}"
            return f"{told}: {RELEASED if code == 1 else STOPPED}"
        before = f"; what stands there answers request {answered}" if answered else ""
        if clock() >= end_s:
            return f"request {request}: no answer within {within_s:g} s{before}: {STOPPED}"
        sleep(LOOK_S)


def _read(file: Path) -> dict[int, float] | None:
    try:
        return variables_set_by(file.read_text(encoding="ascii"))
    except (OSError, ValueError):
        return None
