"""The words of the verdict: as results spell them, and as people read them on the page, in the terminal and on pictures.

While a scan runs there is one more: points look out of tolerance, and it is not proven that the part will fail.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Any, Literal

from inspection import Verdict

VerdictName = Literal["conform", "uncertain", "nonconform"]
VerdictWords = Literal["CONFORM", "NOT PROVEN", "NOT CONFORM"]
Shape = Literal["conform", "not-proven", "not-conform", "ended-early", "none"]

VERDICT_NAMES: Mapping[Verdict, VerdictName] = {
    Verdict.CONFORM: "conform",
    Verdict.UNCERTAIN: "uncertain",
    Verdict.NONCONFORM: "nonconform",
}
VERDICT_WORDS: Mapping[Verdict, VerdictWords] = {
    Verdict.CONFORM: "CONFORM",
    Verdict.UNCERTAIN: "NOT PROVEN",
    Verdict.NONCONFORM: "NOT CONFORM",
}
_SHAPES: Mapping[Verdict, Shape] = {
    Verdict.CONFORM: "conform",
    Verdict.UNCERTAIN: "not-proven",
    Verdict.NONCONFORM: "not-conform",
}
_ENDINGS = {"aborted": "ABORTED", "interrupted": "INTERRUPTED", "running": "RUNNING", "damaged": "RECORD DAMAGED"}


@dataclass(frozen=True, slots=True)
class Headline:
    """What stands above a run in capitals, and the sign and colour it is shown with."""

    words: str
    shape: Shape


def utc_words(moment: datetime) -> str:
    """A moment as files hold it: ISO 8601 in UTC, to the millisecond, with a Z."""
    return moment.astimezone(UTC).isoformat(timespec="milliseconds").replace("+00:00", "Z")


def local_words(moment: datetime) -> str:
    """A moment as people of this place read it: date, time of day and the offset from UTC."""
    local = moment.astimezone()
    return f"{local:%Y-%m-%d %H:%M:%S} {local:%z}"


def judgement_words(judged: Mapping[str, Any]) -> str:
    """A judgement of a recorded run that was made later: when, by whom, what came of it, what was changed, and why."""
    changes = ", ".join(f"{change['key']} {change['recorded']} -> {change['replayed']}" for change in judged["changed"])
    verdict = headline_of(Verdict[judged["verdict"].upper()]).words if judged["verdict"] else "no verdict"
    return f"{local_words(datetime.fromisoformat(judged['when']))} by {judged['who']}: {verdict}; {changes}; {judged['why']}"


def answer_words(answer: Mapping[str, Any]) -> str:
    """What came of the answer to a machine."""
    if not answer["sent"]:
        return f"not sent: {answer['problem']}"
    told = VERDICT_WORDS[Verdict[answer["verdict"].upper()]] if answer["verdict"] else "nothing"
    return f"sent {local_words(datetime.fromisoformat(answer['at']))}: {told}, request {answer['request']}"


def repetition_words(serial_number: str, run: str) -> str:
    """What is said of a part that was measured before, as a question and beside its verdict."""
    return f"the serial number {serial_number} of this part was measured before: run {run}"


def section_words(place: Mapping[str, Any] | None) -> str:
    """Which section of a surface a recorded run is, from its place in the stack; empty where it is none."""
    return "" if place is None else f"section {place['section']} of {place['sections']} at {place['height_mm']:.3f} mm"


NOT_MEASURED = Headline("NOT MEASURED", "none")
LOOKS_OUT = Headline("LOOKS OUT", "not-proven")
SO_FAR = Headline("so far", "none")
POSE_MOVES = "the pose still moves"


def headline_of(verdict: Verdict | None, ending: str = "complete", share: float | None = None) -> Headline:
    """The one headline of a run, for the page, the picture, the terminal and the history.

    verdict : None where nothing could be measured
    ending  : complete, aborted or interrupted; of a run on record also running or damaged
    share   : how much of the profile, or of the points announced, was measured, from 0 to 1; None where that is not known

    The verdict on a part stands there only where its scan came to its end: what was aborted never poses as settled.
    """
    if ending in _ENDINGS:
        at = "" if not share else f" AT {math.floor(100 * share)} %"  # rounded down: 99.9 % is not the whole
        return Headline(_ENDINGS[ending] + at, "ended-early")
    return NOT_MEASURED if verdict is None else Headline(VERDICT_WORDS[verdict], _SHAPES[verdict])


def deciding_words(verdicts: Sequence[tuple[str, str]]) -> str:
    """Which of several characteristics gave a part its verdict: the first by its name, and how many more; nothing where all conform.

    verdicts : names with verdicts as results spell them; of a single one nothing is said
    """
    if len(verdicts) > 1:
        for worst in ("nonconform", "uncertain"):
            if names := [name for name, verdict in verdicts if verdict == worst]:
                return named_first(names)
    return ""


def named_first(names: Sequence[str]) -> str:
    """The first of some names, and how many more there are; nothing without one."""
    return " and ".join([*names[:1], *([f"{len(names) - 1} more"] if len(names) > 1 else [])])


def printable(text: str) -> str:
    """The text without signs that steer a terminal, each spelled out in its place; lines stay lines."""
    return "".join(sign if sign.isprintable() or sign == "\n" else repr(sign)[1:-1] for sign in text)


def anchor_words(place: str, problem: str) -> str:
    """That a place outside was not told how a run ended, for the operator: it changes nothing of the verdict."""
    return f"the end of this run was not told to {place}: {problem}. It is kept and told at the next run; the verdict and the record stand"
