"""One run of a plan, from a device made ready to a finished run with its record: the same for command line, page and files.

The walk: compile what the inspection needs, and conduct the run (`conduct`). Nothing else is printed, shown or written; whoever wants to
follow the run gives sinks.
"""

import logging
import threading
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from datetime import datetime
from pathlib import Path
from typing import Any

from cmmlink.answer import MachineAnswer
from cmmlink.characteristics import notes_on_characteristics
from cmmlink.conduct import conduct, refusal_of, results_folder, title_of
from cmmlink.devices import Connected
from cmmlink.events import Answered, Event, RunStarted, Sink
from cmmlink.from_plan import inspection_of, notes_on_datum, notes_on_nominal, notes_on_temperature, with_section, zone_of
from cmmlink.pipeline import RunOutcome
from cmmlink.plan import FileDevice, LinesDevice, Plan
from cmmlink.record import PATIENCE_S, RecordReference, answer_document
from cmmlink.result_json import density_notes, density_of, result_json, run_document, stations_of
from cmmlink.run_log import log_event
from cmmlink.scratch import scratch_in, words_of_room
from cmmlink.words import utc_words
from inspection import CharacteristicResult, InspectionError, NominalProfile, Verdict, rehearse

_log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True, eq=False)
class FinishedRun:
    """A run that is over: what was measured, against what, and what came of it. `evidence` is None where nothing was recorded.

    began  : date and time of day, with its zone
    answer : whether the machine was told the verdict; None where it asks for none
    """

    plan: Plan
    profile: NominalProfile
    started: RunStarted
    outcome: RunOutcome
    evidence: RecordReference | None
    began: datetime
    answer: Answered | None = None

    def __repr__(self) -> str:
        found = "no result" if self.outcome.result is None else repr(self.outcome.result)
        return f"<FinishedRun {self.title}: {self.outcome.ending}, {found}>"

    @property
    def refusal(self) -> InspectionError | None:
        """Why no result could be given, with what was assumed of a file of points: that may be the cause. None where there is one."""
        return refusal_of(self.outcome.refusal, self.plan, self.started)

    @property
    def verdict(self) -> Verdict:
        """The verdict on the part, the worst of its characteristics; nothing is proven of one without a result."""
        return Verdict.UNCERTAIN if self.outcome.result is None else self.outcome.result.verdict

    @property
    def characteristics(self) -> tuple[CharacteristicResult, ...]:
        """What was found of every characteristic of the plan."""
        return () if self.outcome.result is None else self.outcome.result.characteristics

    @property
    def title(self) -> str:
        """The part, its serial number, and whether it was simulated."""
        return title_of(self.started)

    @property
    def notes(self) -> list[str]:
        """What was assumed about the nominal and the points, and what the reader of the verdict has to know of them."""
        length_mm = self.profile.length_mm
        return [*self.started.notes, *density_notes(density_of(stations_of(self.outcome.result), length_mm), length_mm)]

    def result_json(self) -> dict[str, Any]:
        """The run as `--json` and result.json hold it."""
        evidence = asdict(self.evidence) if self.evidence else {}
        found = result_json(self.outcome.result, self.outcome.counts)
        document = run_document(found, self.started, self.notes, self.outcome.ending, utc_words(self.began), evidence)
        return (
            document
            if self.answer is None
            else {**document, "answer": answer_document(self.answer) | {"unrecorded": self.answer.unrecorded or None}}
        )

    def folder_of(self, pattern: Path) -> Path:
        """The folder of this run's results, its placeholders filled in; without a record the run is named by when it began."""
        return results_folder(pattern, self.started, self.evidence, self.began)


def carry_out(
    plan: Plan,
    profile: NominalProfile,
    device: Connected,
    *,
    records: Path | None,
    clock: Callable[[], float],
    now: Callable[[], datetime],
    stop: threading.Event,
    sinks: Sequence[Sink] = (),
    on_ready: Callable[[], None] = lambda: None,
    patience_s: float = PATIENCE_S,
    shown: bool = False,
) -> FinishedRun:
    """Carry out one run of a plan to its end. Blocks the calling thread, in which all sinks are called, the recorder first.

    profile : the plan's nominal, as `profile_of` gives it
    device  : made ready for one scan; its `source.stop()` ends the scan early with a result, setting `stop` aborts it
    records : folder of the run records; None records nothing
    clock   : monotonic seconds of the run; now : date and time of day
    patience_s : how long another process may go on recording before this run is refused
    on_ready: called when everything is compiled, just before the device is asked for points
    shown   : somebody looks on, who is told the characteristics while the scan runs

    The points of a file that no sink follows have their verdicts at the end alone; the result is the same to the last bit.
    A device that fails does not raise: the outcome says so. Raises StoreError when the record cannot be kept, PlanError when
    the plan cannot be carried out, and whatever a sink raises.
    """
    assumed, plan = (*notes_on_nominal(plan), *notes_on_datum(plan), *notes_on_temperature(plan)), with_section(plan)
    _log.info("nominal %s, %s, %s", plan.nominal.file, zone_of(plan, profile), plan.registration)
    followed = bool(sinks) or not isinstance(plan.device, FileDevice)
    rehearse(profile, plan.registration.method, plan.registration.reject_outliers, not followed)
    scratch = scratch_in(records)
    _log.info("%s", words_of_room(scratch.folder))
    live = inspection_of(plan, profile, scratch, provisional=followed)
    notes = (*assumed, *notes_on_characteristics(plan), *_notes_on_end(plan), *device.notes)
    on_ready()
    conducted = conduct(
        plan,
        live,
        device,
        notes,
        records=records,
        clock=clock,
        now=now,
        stop=stop,
        sinks=sinks,
        answer=_answer_of(plan, [*sinks, log_event], now),
        patience_s=patience_s,
        no_room=scratch.refusal,
        shown=shown,
        cut_short="when failed" if plan.stop_when_failed else "never",
    )
    return FinishedRun(plan, profile, conducted.started, conducted.outcome, conducted.evidence, conducted.began, conducted.answer)


def _answer_of(plan: Plan, followers: Sequence[Sink], now: Callable[[], datetime]) -> MachineAnswer | None:
    """What tells the machine the verdict; None where the plan names no file for it."""

    def tell(event: Event) -> None:
        for follower in followers:
            follower(event)

    if plan.answer is None or not isinstance(plan.device, LinesDevice):
        return None
    return MachineAnswer(plan.answer, plan.device.unit, tell, now)


def _notes_on_end(plan: Plan) -> tuple[str, ...]:
    """That the scan may end before its end."""
    told = "the scan is ended as soon as it is proven that the part can no longer pass (stop_when_failed)"
    return (told,) if plan.stop_when_failed else ()
