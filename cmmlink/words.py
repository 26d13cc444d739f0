"""The words of the verdict: as results spell them, and as people read them on the page, in the terminal and on pictures."""

from collections.abc import Mapping
from typing import Literal

from inspection import Verdict

VerdictName = Literal["conform", "uncertain", "nonconform"]
VerdictWords = Literal["CONFORM", "NOT PROVEN", "NOT CONFORM"]

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
