"""The rows of the table: what a run was on record, and what it is by the changed plan."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal, Self

from cmmlink.archive.tasks import Failure
from cmmlink.words import headline_of, section_words
from inspection import Verdict

COLUMNS: dict[str, str] = {
    "run": "the id of the run",
    "measured_at": "when it began, in UTC (ISO 8601)",
    "part": "the name of the part",
    "serial_number": "its serial number",
    "section": "of a section of a surface, which one it is",
    "recorded": "the headline of the run on record, like CONFORM",
    "again": "its headline by the changed plan; empty where it could not be judged",
    "changed": "1 where the verdict is another one, else 0",
    "characteristics": "the characteristics whose verdict is another one, each with both",
    "out_of_tolerance_recorded": "the points out of tolerance on record",
    "out_of_tolerance": "the points out of tolerance by the changed plan",
    "min_deviation_mm": "the smallest deviation by the changed plan",
    "max_deviation_mm": "the largest",
    "profile_error_mm": "2 * max |deviation|",
    "reason": "why the verdict is what it is: the most important reason",
    "state": "judged, known (the same judgement was on record), or failed",
    "kept": "1 where the judgement is on record, else 0",
    "problem": "why the run could not be judged again",
}
_NUMBERS = ("out_of_tolerance", "min_deviation_mm", "max_deviation_mm", "profile_error_mm", "coverage")


@dataclass(frozen=True, slots=True, eq=False)
class Row:
    """A run of the archive.

    entry   : its line in the list of runs
    before  : what a row tells of the recorded result; None where there is none, or it could not be read
    after   : the same of the result by the changed plan; None where it could not be judged
    known   : the judgement was on record before
    kept    : it is on record now
    """

    entry: Mapping[str, Any]
    before: Mapping[str, Any] | None = None
    after: Mapping[str, Any] | None = None
    failure: Failure | None = None
    known: bool = False
    kept: bool = False

    @classmethod
    def of(cls, entry: Mapping[str, Any], before: Mapping[str, Any] | None, after: Mapping[str, Any] | None, **state: Any) -> Self:
        """The row of two results, of which it holds little: there may be a hundred thousand."""
        return cls(entry, _told(before), _told(after), **state)

    @property
    def run(self) -> str:
        """The run's id."""
        return str(self.entry["run"])

    @property
    def state(self) -> Literal["judged", "known", "failed"]:
        """Whether it was judged now, or before by the same plan, or not at all."""
        return "failed" if self.after is None else "known" if self.known else "judged"

    @property
    def recorded(self) -> str:
        """Its headline on record; of a stack it follows from its sections, and is empty where these could not be judged again."""
        if self.entry["verdict"] is None and self.entry.get("sections"):
            return ""
        return headline_of(_verdict(self.entry["verdict"]), self.entry["state"], self.entry.get("coverage")).words

    @property
    def verdict(self) -> Verdict | None:
        """Its verdict by the changed plan; None where it has none."""
        return None if self.after is None else _verdict(self.after["verdict"])

    @property
    def again(self) -> str:
        """Its headline by the changed plan; nothing where it could not be judged."""
        return "" if self.after is None else headline_of(self.verdict, self.entry["state"], self.after.get("coverage")).words

    @property
    def changed(self) -> bool:
        """Whether its verdict is another one."""
        return self.after is not None and self.after["verdict"] != self.entry["verdict"]

    @property
    def characteristics(self) -> list[str]:
        """The characteristics whose verdict is another one, with both; of a single one nothing is said: it is that of the run."""
        if self.before is None or self.after is None or len(self.after["characteristics"]) < 2:
            return []
        before, after = (_verdicts(result) for result in (self.before, self.after))
        return [f"{name}: {before[name]} -> {verdict}" for name, verdict in after.items() if before.get(name, verdict) != verdict]

    @property
    def cells(self) -> dict[str, str | float | int | None]:
        """The row by the names of its columns."""
        after, before = self.after or {}, self.before or {}
        reasons: Sequence[Mapping[str, Any]] = after.get("reasons") or ()
        return {
            "run": self.run,
            "measured_at": self.entry["started"],
            "part": self.entry["part"],
            "serial_number": self.entry["serial_number"],
            "section": section_words(self.entry.get("stack")),
            "recorded": self.recorded,
            "again": self.again,
            "changed": int(self.changed),
            "characteristics": "; ".join(self.characteristics),
            "out_of_tolerance_recorded": before.get("out_of_tolerance"),
            **{key: after.get(key) for key in _NUMBERS if key in COLUMNS},
            "reason": str(reasons[0]["words"]) if reasons else "",
            "state": self.state,
            "kept": int(self.kept),
            "problem": "" if self.failure is None else self.failure.message,
        }


def _told(result: Mapping[str, Any] | None) -> dict[str, Any] | None:
    """What rows tell of a result."""
    if result is None:
        return None
    characteristics = [{"name": one["name"], "verdict": one["verdict"]} for one in result.get("characteristics") or ()]
    numbers = {key: result.get(key) for key in _NUMBERS}
    reasons = list(result.get("reasons") or ())[:1]
    return {"verdict": _verdict_in(result), "characteristics": characteristics, "reasons": reasons, **numbers}


def _verdict_in(result: Mapping[str, Any]) -> str | None:
    """The verdict of a result by the rule of the end of a run: none where the part was not found."""
    return result["verdict"] if result.get("received") and result.get("registration") else None


def _verdict(name: str | None) -> Verdict | None:
    return Verdict[name.upper()] if name else None


def _verdicts(result: Mapping[str, Any]) -> dict[str, str]:
    return {one["name"]: one["verdict"] for one in result["characteristics"]}
