"""One section of a surface as a run of its own: an ordinary plan, the pipeline that every scan takes, and its record.

A section's plan is that of a scan whose section plane is the cut. So replay, export and the history take it like any run and need
to know nothing of surfaces. The record of each section names its stack: the surface with its hash, the plan of the stack, and
which of its sections this one is.
"""

import hashlib
import threading
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import datetime
from functools import partial
from pathlib import Path
from typing import Any

from cmmlink.events import Arrived, Counts, RunFinished, RunStarted
from cmmlink.from_plan import inspection_of
from cmmlink.outline import Outline, place_of
from cmmlink.pipeline import Outcome, RunOutcome, run_inspection
from cmmlink.plan import NO_RESULTS, CtPlan, FileDevice, Plan, Section
from cmmlink.record import Recorder, RecordReference, RunInputs, Seal, Store, Told, anchor_ends
from cmmlink.words import VERDICT_WORDS, utc_words
from drivers import MeshError, Rejected, ScanClosed, ScanOpened, ScanSource
from drivers.surface import Contour, ContourSource, SurfaceSection, add_points_between
from inspection import Characteristic, Evaluation, NominalProfile, Reason, RegistrationError, SectionCharacteristic, evaluate

_REFUSED = "not registered"


def plan_of_section(plan: CtPlan, cut: SurfaceSection, nominal: Path) -> Plan:
    """The plan of one section: the plan of its stack, with the cut as the section plane and with the section's own nominal."""
    normal, x_axis = (tuple(axis.tolist()) for axis in (cut.axes.normal, cut.axes.x))
    origin = tuple((cut.height_mm * cut.axes.normal).tolist())
    return Plan(
        part=plan.part,
        nominal=plan.nominal.model_copy(update={"file": nominal}),
        tolerance=plan.tolerance,
        characteristics=plan.characteristics,
        decision_rule=plan.decision_rule,
        uncertainty=plan.uncertainty,
        temperature=plan.temperature,
        device=FileDevice(type="file", file=plan.mesh.file, scale=plan.mesh.mm_per_unit),
        section=Section(origin_mm=origin, normal=normal, x_axis=x_axis),
        registration=plan.registration,
        rule=plan.rule,
        weights=plan.weights,
        gap_max_mm=plan.gap_max_mm,
        end_allowance_mm=plan.end_allowance_mm,
        allow=plan.allow,
        out=NO_RESULTS,
        report=plan.report,
    ).named(plan.file_name)


@dataclass(frozen=True, slots=True, eq=False)
class StackRecord:
    """Where the sections of one stack are recorded, and how their runs end. `facts` are what every section says of its stack."""

    store: Store
    seal: Seal
    facts: Mapping[str, Any]
    clock: Callable[[], float]
    now: Callable[[], datetime]

    @classmethod
    def of(
        cls,
        store: Store,
        seal: Seal,
        plan: CtPlan,
        triangles: int,
        sections: int,
        *,
        began: datetime,
        clock: Callable[[], float],
        now: Callable[[], datetime],
    ) -> "StackRecord":
        """Begin the records of a stack; the file of the surface is read for its hash.

        began : when its inspection began; `now` tells when each section did
        """
        try:
            with plan.mesh.file.open("rb") as file:
                sha256 = hashlib.file_digest(file, "sha256").hexdigest()
        except OSError as error:
            raise MeshError(f"{plan.mesh.file}: cannot be read: {error.strerror or error}") from error
        facts = {
            "stack": f"{began:%Y%m%d-%H%M%S}-{sha256[:8]}",
            "sections": sections,
            "surface": plan.mesh.file.name,
            "surface_sha256": sha256,
            "triangles": triangles,
            "plan": plan.effective_yaml(),
        }
        return cls(store, seal, facts, clock, now)

    def recorder(self, number: int, cut: SurfaceSection, plan: Plan, doubt: Reason | None) -> Recorder:
        """A recorder for one section; `number` counts from 1."""
        place = {"section": number, "height_mm": cut.height_mm, "asked_height_mm": cut.asked_mm, "cutter": cut.cutter}
        place["doubt"] = doubt.words if doubt else None
        return Recorder(self.store, RunInputs.of(plan, {**self.facts, **place}), clock=self.clock, now=self.now, seal=self.seal)

    def tell_ends(self, places: Sequence[str], sections: Sequence[RecordReference]) -> tuple[Told, ...]:
        """Tell every place outside how the runs of the sections ended; see `anchor_ends`."""
        return anchor_ends(self.store, self.seal, places, utc_words(self.now()), sections)


@contextmanager
def recorder_of(
    record: StackRecord | None, number: int, cut: SurfaceSection, plan: Plan, doubt: Reason | None
) -> Iterator[Recorder | None]:
    """The recorder of one section for as long as it is entered; None where nothing is recorded."""
    if record is None:
        yield None
        return
    with record.recorder(number, cut, plan, doubt) as recorder:
        yield recorder


@dataclass(frozen=True, slots=True, eq=False)
class Chosen:
    """The outline that is judged: its contours as they were cut, and with points between their corners; what makes the choice doubtful."""

    contours: tuple[Contour, ...]
    judged: tuple[Contour, ...]
    doubt: Reason | None = None


def choose_outline(
    outline: Outline,
    plan: Plan,
    profile: NominalProfile,
    asked: Sequence[Characteristic],
    spacing_mm: float,
    surface: str,
    *,
    clock: Callable[[], float],
    stop: threading.Event,
) -> Chosen:
    """Choose what is judged. Where several contours can be the part, each is judged beforehand, and the first that fits is taken.

    What cannot be the part may be long beyond all bounds: no points are set between its corners.
    """
    if outline.refusal is not None:
        return Chosen(outline.contours, outline.contours)
    candidates = [outline.contours, *((rival,) for rival in outline.rivals)]
    filled = [tuple(add_points_between(contour, spacing_mm) for contour in contours) for contours in candidates]
    if len(candidates) == 1:
        return Chosen(candidates[0], filled[0])
    started = RunStarted(plan.part.name, "", "", surface, simulated=False)
    judge = partial(
        measure_section, plan=plan, profile=profile, asked=asked, started=started, recorder=None, doubt=None, clock=clock, stop=stop
    )
    runs = [judge(ContourSource(judged, surface)) for judged in filled]
    order = sorted(range(len(runs)), key=lambda k: runs[k].result is None)  # those that fit first; the most alike before the others
    first, *others = order
    doubt = _doubt((candidates[first], runs[first]), [(candidates[k], runs[k]) for k in others])
    return Chosen(candidates[first], filled[first], doubt)


_Candidate = tuple[tuple[Contour, ...], RunOutcome]


def _doubt(taken: _Candidate, others: Sequence[_Candidate]) -> Reason | None:
    """The doubt where another contour that can be the part, and fits the nominal, has another verdict."""
    contours, run = taken
    for other_contours, other in others:
        if run.result is None or other.result is None or other.result.verdict is run.result.verdict:
            continue
        return Reason(
            "outline",
            f"Which contour is the part is not known: the one around {place_of(contours[0])} is {VERDICT_WORDS[run.result.verdict]}, "
            f"the one around {place_of(other_contours[0])} {VERDICT_WORDS[other.result.verdict]}.",
        )
    return None


def count_points(contours: tuple[Contour, ...]) -> int:
    """How many points contours have together."""
    return sum(len(contour.points_mm) for contour in contours)


def measure_section(
    source: ScanSource,
    plan: Plan,
    profile: NominalProfile,
    asked: Sequence[Characteristic],
    started: RunStarted,
    recorder: Recorder | None,
    *,
    doubt: Reason | None,
    clock: Callable[[], float],
    stop: threading.Event,
    numbers: Sequence[SectionCharacteristic] = (),
    evaluation: Evaluation = evaluate,
) -> RunOutcome:
    """Send the outline of one section through the pipeline. With a doubt about the outline no verdict is proven.

    asked   : the characteristics of the plan for this profile
    numbers : what is found of it as well, for the characteristics of its stack
    evaluation : how both are found

    Raises MeshError where the outline cannot be read, which is no fault of the outline: the system has no thread to give.
    """
    live = inspection_of(plan, profile, provisional=False, characteristics=asked, numbers=numbers, evaluation=evaluation)
    sinks = [recorder] if recorder else []
    watch = recorder.check if recorder else lambda: None
    run = run_inspection(source, live, sinks, started, buffer_points=plan.buffer_points, clock=clock, stop=stop, watch=watch, doubt=doubt)
    if run.failure is not None:
        raise MeshError(f"{started.device}: a section cannot be inspected: {run.failure}")
    return run


def refuse_section(count: int, refusal: RegistrationError, started: RunStarted, recorder: Recorder | None, now_s: float) -> RunOutcome:
    """Give a section whose outline cannot be its profile no result. On record are the number of its points, and the reason.

    The points themselves are not kept: what is not the part may be long beyond all bounds.
    """
    counts = Counts(received=count, rejected=count, rejected_by_reason={_REFUSED: count} if count else {})
    if recorder is not None:
        recorder(started)
        recorder(Arrived(now_s, ScanOpened(started.device, "", count)))
        if count:
            recorder(Arrived(now_s, Rejected(count, _REFUSED)))
        recorder(Arrived(now_s, ScanClosed(count)))
        recorder(RunFinished("complete", None, counts, str(refusal)))
    return Outcome("complete", None, counts, None, refusal)
