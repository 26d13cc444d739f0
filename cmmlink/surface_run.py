"""One run of the plan of a whole surface, from a device made ready to a finished run with its record: the same as of a section."""

import logging
import threading
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from datetime import datetime
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cmmlink.conduct import conduct, refusal_of, results_folder, title_of
from cmmlink.devices import Connected
from cmmlink.events import RunStarted, Sink
from cmmlink.from_surface_plan import document_of_surface, live_surface_of, notes_of_result, notes_on_surface, rehearse_on, words_of_nominal
from cmmlink.nominal_files.surface_file import SurfaceFile
from cmmlink.pipeline import Outcome
from cmmlink.plan import FileDevice, SurfacePlan
from cmmlink.record import PATIENCE_S, RecordReference
from cmmlink.result_json import run_document
from cmmlink.surface_json import surface_json
from cmmlink.words import utc_words
from inspection import InspectionError, Verdict

if TYPE_CHECKING:
    from inspection.surface import SurfaceResult

_log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True, eq=False)
class FinishedSurface:
    """A run of a whole surface that is over: what was measured, against what, and what came of it.

    evidence : None where nothing was recorded
    began    : date and time of day, with its zone
    """

    plan: SurfacePlan
    file: SurfaceFile
    started: RunStarted
    outcome: "Outcome[SurfaceResult]"
    evidence: RecordReference | None
    began: datetime

    def __repr__(self) -> str:
        found = "no result" if self.outcome.result is None else repr(self.outcome.result)
        return f"<FinishedSurface {self.title}: {self.outcome.ending}, {found}>"

    @property
    def refusal(self) -> InspectionError | None:
        """Why no result could be given, with what was assumed of a file of points: that may be the cause. None where there is one."""
        return refusal_of(self.outcome.refusal, self.plan, self.started)

    @property
    def verdict(self) -> Verdict:
        """The verdict on the part; nothing is proven of one without a result."""
        return Verdict.UNCERTAIN if self.outcome.result is None else self.outcome.result.verdict

    @property
    def title(self) -> str:
        """The part, its serial number, and whether it was simulated."""
        return title_of(self.started)

    @property
    def notes(self) -> list[str]:
        """What was assumed about the nominal and the points, and what the reader of the verdict has to know of them."""
        return [*self.started.notes, *notes_of_result(self.outcome.result, self.file)]

    def result_json(self) -> dict[str, Any]:
        """The run as `--json` and result.json hold it."""
        found = surface_json(self.outcome.result, self.outcome.counts, words_of_nominal(self.file))
        evidence = asdict(self.evidence) if self.evidence else {}
        return run_document(found, self.started, self.notes, self.outcome.ending, utc_words(self.began), evidence)

    def folder_of(self, pattern: Path) -> Path:
        """The folder of this run's results, its placeholders filled in; without a record the run is named by when it began."""
        return results_folder(pattern, self.started, self.evidence, self.began)


def carry_out_surface(
    plan: SurfacePlan,
    file: SurfaceFile,
    device: Connected,
    *,
    records: Path | None,
    clock: Callable[[], float],
    now: Callable[[], datetime],
    stop: threading.Event,
    sinks: Sequence[Sink] = (),
    on_ready: Callable[[], None] = lambda: None,
    patience_s: float = PATIENCE_S,
) -> FinishedSurface:
    """Carry out one run of the plan of a whole surface to its end; see `cmmlink.run.carry_out`, whose arguments these are.

    file : the plan's nominal, as `surface_of` gives it
    """
    _log.info("nominal %s, %s, %s", plan.surface.file, plan.zone, plan.registration)
    followed = bool(sinks) or not isinstance(plan.device, FileDevice)
    if followed:  # the points of a file can wait for what has to be compiled
        rehearse_on(file)
    live = live_surface_of(plan, file, provisional=followed)
    notes = (*notes_on_surface(plan, file), *device.notes)
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
        patience_s=patience_s,
        document_of=partial(document_of_surface, file),
    )
    return FinishedSurface(plan, file, conducted.started, conducted.outcome, conducted.evidence, conducted.began)
