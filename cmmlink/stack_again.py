"""A stack of sections on record, judged again: its characteristics are not on record themselves, but all that they are worked out of is."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from cmmlink.devices import decoder_of
from cmmlink.errors import RunError, StoreError, YamlError
from cmmlink.events import Counts
from cmmlink.pipeline import Outcome
from cmmlink.plan import CtPlan, read_model
from cmmlink.record import (
    Nominals,
    RecordedRun,
    Store,
    end_missing,
    find_stack,
    recorded_plan,
    recorded_run,
    replay_run,
    with_changes,
)
from cmmlink.stack_characteristics import JudgedSection, StackQuestions, stack_characteristic_json
from inspection import RegistrationError, Verdict

_OF_STACK = "stack_characteristics"


@dataclass(frozen=True, slots=True, eq=False)
class StackAgain:
    """What came of a stack.

    characteristics : in the order of the plan, as result.json holds them
    differs         : runs of sections whose result is not to the last bit that on record; with something changed in the plan, most are
    lost            : runs of sections whose result is not that on record, even where last bits do not count
    sections        : the verdict of the worst section
    """

    characteristics: tuple[Mapping[str, Any], ...]
    differs: tuple[str, ...]
    lost: tuple[str, ...]
    sections: Verdict

    @property
    def verdict(self) -> Verdict:
        """That of the worst section or characteristic, of a stack whose sections are all there."""
        return max(self.sections, *(Verdict[one["verdict"].upper()] for one in self.characteristics))


def plan_of_stack(section: RecordedRun) -> CtPlan:
    """The plan of the stack of a section. Raises StoreError where this version cannot read it."""
    try:
        return read_model(section.header["stack"]["plan"], CtPlan)
    except YamlError as error:
        raise StoreError(f"the plan of the stack of run {section.run} cannot be read by this version of cmmlink: {error}") from None


def judge_stack_again(
    store: Store, recorded: Sequence[RecordedRun], profiles: Nominals, settings: Mapping[str, str] | None = None
) -> StackAgain:
    """The characteristics of a stack, whose sections these runs are, in their order.

    settings : keys of the plan of the stack with what is to stand behind them

    Raises StoreError where a record was altered or cannot be read, PlanError where the plan cannot be changed so.
    """
    place = recorded[0].header["stack"]
    where_it_lies = {"registration": recorded_plan(recorded[0]).registration, "stack_fit": "each"}  # the common fit, where there was one
    placed = plan_of_stack(recorded[0]).model_copy(update=where_it_lies)
    questions = StackQuestions(with_changes(placed, None, None, settings or {}))
    of_section = settings_of_section(settings or {})
    judged, differs, lost = [], list[str](), list[str]()
    for one in recorded:
        where, end = one.header["stack"], one.end or end_missing(store, one.run)
        if one.result is None:
            outcome = Outcome("complete", None, Counts(), None, RegistrationError(end["message"] or "nothing of it was judged"))
        else:
            profile = profiles.of(with_changes(recorded_plan(one), None, None, of_section), one)
            numbers = questions.numbers(profile)
            again = replay_run(store, one, decoder_of, settings=of_section, profile=profile, numbers=numbers)
            outcome = again.outcome
            differs += [one.run] if again.identical is False else []
            lost += [] if again.agreement.holds else [one.run]
        judged.append(JudgedSection(where["asked_height_mm"], where["height_mm"], outcome))
    found = questions.judge(judged, int(place["sections"]))
    worst = max(Verdict.UNCERTAIN if one.run.result is None else one.run.result.verdict for one in judged)
    return StackAgain(tuple(stack_characteristic_json(one) for one in found), tuple(differs), tuple(lost), worst)


def settings_of_section(settings: Mapping[str, str]) -> dict[str, str]:
    """What of the settings of a stack is for its sections: all but what is asked of the stack as a whole."""
    return {key: text for key, text in settings.items() if not f"{key}.".startswith(f"{_OF_STACK}.")}


def whole_stack(store: Store, last: RecordedRun) -> tuple[str, tuple[RecordedRun, ...]] | None:
    """The id and the sections of the stack that a run is the last section of, where all are on record and the stack has characteristics.

    None for every other run. Raises StoreError where a record cannot be read.
    """
    place = last.header.get("stack")
    if not place or place["section"] != place["sections"] or not plan_of_stack(last).stack_characteristics:
        return None
    try:
        stack, runs = find_stack(store, place["stack"])
    except RunError:
        return None
    if len(runs) != place["sections"]:
        return None
    return stack, tuple(recorded_run(store, run) for run in runs)
