"""Sections of a CT surface, inspected one after the other by the path that every scan takes.

Surface -> slices -> a contour source each -> the pipeline -> verdicts. Which contours are the outline of a section, outline.py tells.
Contours beside it are counted and reported, never judged.
"""

import logging
import threading
from collections.abc import Callable, Generator, Iterator, Mapping
from contextlib import ExitStack, closing
from dataclasses import asdict, dataclass
from datetime import datetime
from pathlib import Path
from typing import Any

from cmmlink.characteristics import notes_on_characteristics
from cmmlink.errors import PlanError
from cmmlink.events import Ending, RunStarted
from cmmlink.foresight import Foresight, look_ahead
from cmmlink.from_plan import (
    check_fixed_place,
    notes_on_temperature,
    run_started,
)
from cmmlink.last_qualification import qualification_here
from cmmlink.outline import outline_of
from cmmlink.pipeline import RunOutcome
from cmmlink.plan import CtPlan, Plan
from cmmlink.record import PATIENCE_S, RecordReference, Told, open_to_record, seal_of
from cmmlink.result_folder import folder_of
from cmmlink.result_json import result_json
from cmmlink.section_run import (
    Chosen,
    StackRecord,
    choose_outline,
    count_points,
    measure_section,
    plan_of_section,
    recorder_of,
    refuse_section,
)
from cmmlink.stack_characteristics import JudgedSection, StackQuestions, stack_characteristic_json
from cmmlink.stack_fit import fit_sections, placed_at
from cmmlink.stack_inputs import Open3DOnUse, StackProfiles, check_own_nominals, heights_of, read_surface
from cmmlink.version import RESULT_SCHEMA
from cmmlink.words import utc_words
from drivers.surface import (
    Contour,
    ContourSource,
    Cutter,
    NumpyCutter,
    Open3DMissing,
    Open3DProcess,
    SurfaceMesh,
    SurfaceSection,
    cut_surface,
)
from inspection import (
    Characteristic,
    Evaluation,
    NominalProfile,
    Reason,
    RegistrationError,
    RigidTransform,
    StackCharacteristicResult,
    Verdict,
    evaluate,
)

_log = logging.getLogger(__name__)

_FEW_SECTIONS = 50  # up to here Open3D costs less than half a second; numpy gives the same points, a stack of 200 twice as fast
_LEAST_POINTS = 400  # over the length of a profile; on a coarser surface, points on the facets are judged as well as the corners


@dataclass(frozen=True, slots=True, eq=False)
class SectionOutcome:
    """One section: where it was cut, its nominal, its run, the warnings, and what ties it to its record, None without one."""

    slice: SurfaceSection
    judged: tuple[Contour, ...]
    nominal_file: Path
    profile: NominalProfile
    started: RunStarted
    run: RunOutcome
    warnings: tuple[str, ...]
    evidence: RecordReference | None = None

    @property
    def verdict(self) -> Verdict:
        """Uncertain where nothing could be judged."""
        return self.run.result.verdict if self.run.result is not None else Verdict.UNCERTAIN

    def result_json(self) -> dict[str, Any]:
        """The section as JSON holds it."""
        cut = self.slice
        return {
            "height_mm": cut.height_mm,
            "asked_height_mm": cut.asked_mm,
            "contours": len(cut.contours),
            "holes": sum(contour.hole for contour in cut.contours),
            "open_contours": len(cut.gaps),
            "set_aside": cut.set_aside,
            "set_aside_longest_mm": float(cut.set_aside_mm[0]) if cut.set_aside else None,
            "cutter": cut.cutter,
            "nominal": str(self.nominal_file),
            **result_json(self.run.result, self.run.counts),
            "ending": self.run.ending,
            "warnings": list(self.warnings),
            "run": self.evidence.run if self.evidence else None,
            "chain_sha256": self.evidence.chain_sha256 if self.evidence else None,
            "signature": self.evidence.signature if self.evidence else None,
        }


@dataclass(frozen=True, slots=True, eq=False)
class StackOutcome:
    """The inspected sections of a surface. `asked` is how many the plan asks for; `notes` apply to all of them.

    characteristics : those of the stack, in the order of the plan
    anchors : the places outside that were to be told how the runs of the sections ended
    """

    mesh: SurfaceMesh
    sections: tuple[SectionOutcome, ...]
    asked: int
    notes: tuple[str, ...]
    began: datetime
    characteristics: tuple[StackCharacteristicResult, ...] = ()
    anchors: tuple[Told, ...] = ()

    @property
    def complete(self) -> bool:
        """Whether no section that was asked for is missing, and none was aborted."""
        return len(self.sections) == self.asked and all(section.run.ending == "complete" for section in self.sections)

    @property
    def qualification(self) -> Mapping[str, Any] | None:
        """The last qualification of the installation, as every section of the stack names it."""
        return self.sections[0].started.qualification if self.sections else None

    @property
    def ending(self) -> Ending:
        """How the inspection of the whole stack ended."""
        return "complete" if self.complete else "aborted"

    @property
    def verdict(self) -> Verdict:
        """That of the worst section or characteristic of the stack; not better than uncertain when the stack was cut short."""
        of_stack = (one.found.verdict for one in self.characteristics)
        worst = max(*(section.verdict for section in self.sections), Verdict.CONFORM, *of_stack)
        return worst if self.complete else max(worst, Verdict.UNCERTAIN)

    def folder_of(self, pattern: Path, plan: CtPlan) -> Path:
        """The folder of this stack's results, its placeholders filled in."""
        serial_number = plan.part.serial_number or ""
        return folder_of(pattern, part=plan.part.name, serial_number=serial_number, run=f"{self.began:%Y%m%d-%H%M%S}")

    def result_json(self) -> dict[str, Any]:
        """The stack as JSON holds it."""
        slices = [section.result_json() for section in self.sections]
        return {
            "schema": RESULT_SCHEMA,
            "verdict": self.verdict.word,
            "complete": self.complete,
            "ending": self.ending,
            "measured_at": utc_words(self.began),
            "mesh": self.mesh.source,
            "mesh_kind": self.mesh.kind,
            "triangles": self.mesh.triangles,
            **{key: sum(section[key] for section in slices) for key in ("received", "judged", "rejected", "lost", "out_of_tolerance")},
            "slices": slices,
            "characteristics": [stack_characteristic_json(one) for one in self.characteristics],
            "qualification": self.qualification,
            "notes": list(self.notes),
            "anchors": [asdict(one) for one in self.anchors],
        }


def surface_words(plan: CtPlan) -> str:
    """How results and pages call the surface that the points of a section come from."""
    return f"surface {plan.mesh.file.name}"


def inspect_stack(
    plan: CtPlan,
    *,
    clock: Callable[[], float],
    stop: threading.Event,
    now: Callable[[], datetime] = lambda: datetime.now().astimezone(),
    records: Path | None = None,
    patience_s: float = PATIENCE_S,
    on_start: Callable[[int], None] = lambda sections: None,
    on_section: Callable[[SectionOutcome], None] = lambda section: None,
) -> StackOutcome:
    """Cut, inspect and record every section of the plan. Setting `stop` ends the inspection after the section at hand.

    records    : folder of the run records, where each section becomes a run; None records nothing
    patience_s : how long another process may go on recording before the stack is refused
    on_start   : called with the number of sections, before the first one
    on_section : called with each section that is done

    Raises PlanError, NominalError and MeshError for what cannot be used, RegistrationError when no section fits its nominal,
    StoreError when the record cannot be kept.
    """
    check_fixed_place(plan)
    began, profiles, doubt = now(), StackProfiles(plan), None
    if plan.stack_fit == "common":
        check_fixed_place(placed_at(plan, RigidTransform.identity()))
    questions = StackQuestions(plan if plan.stack_fit == "each" else placed_at(plan, RigidTransform.identity()))
    with ExitStack() as opened:
        open3d = Open3DOnUse(opened)
        foresight = opened.enter_context(Foresight())
        mesh = read_surface(plan, open3d)
        heights = heights_of(plan, mesh)
        check_own_nominals(plan, heights)
        questions.check_heights(heights)
        numbers = [len(questions.numbers(profiles.at(height)[1])) for height in heights]
        record = None
        if records is not None:
            store = opened.enter_context(open_to_record(records, now, patience_s))
            seal = seal_of(store, station=plan.records.station, key=plan.records.key)
            record = StackRecord.of(store, seal, plan, mesh.triangles, len(heights), began=began, clock=clock, now=now)
        on_start(len(heights))
        foresight.expect(len(heights), len(plan.characteristics) + max(numbers))
        read_in = [f"{plan.mesh.file.name}: read in {plan.mesh.unit}, as asked"] if plan.mesh.unit else []
        notes = [*read_in, *mesh.warnings, *profiles.notes, *notes_on_temperature(plan), *notes_on_characteristics(plan)]
        notes += [*filter(None, [qualification_here()[1]]), *(record.seal.notes if record else ())]
        sections: list[SectionOutcome] = []
        slices: Iterator[SurfaceSection] = opened.enter_context(closing(_slices(plan, mesh, heights, open3d, notes, profiles.shortest_mm)))
        if plan.stack_fit == "common":
            cuts = list(slices)
            own = plan.model_copy(update={"stack_characteristics": ()})
            alone = _Stack(own, profiles, StackQuestions(own))
            measured: list[SectionOutcome] = []
            for ready in _prepare_ahead(alone, iter(cuts), notes, foresight, clock, stop):
                measured.append(_inspect(alone, len(measured) + 1, ready, None, clock, stop))
                if stop.is_set():
                    break
            common = fit_sections(plan, measured, len(cuts))
            plan, doubt, slices = common.plan, common.doubt, iter(cuts)
            profiles, questions = profiles.asked_by(plan), StackQuestions(plan)
            notes.append(common.words)
        stack = _Stack(plan, profiles, questions, doubt)
        for ready in _prepare_ahead(stack, slices, notes, foresight, clock, stop):
            sections.append(_inspect(stack, len(sections) + 1, ready, record, clock, stop))
            on_section(sections[-1])
            if stop.is_set():
                notes.append(f"aborted by the operator after {len(sections)} of {len(heights)} sections")
                break
        told = record.tell_ends(plan.records.places, [one.evidence for one in sections if one.evidence]) if record else ()
    if all(section.run.result is None for section in sections) and sections[0].run.refusal is not None:
        raise sections[0].run.refusal
    judged = [JudgedSection(section.slice.asked_mm, section.slice.height_mm, section.run) for section in sections]
    outcome = StackOutcome(mesh, tuple(sections), len(heights), tuple(notes), began, questions.judge(judged, len(heights)), told)
    _log.info("%s: %s, %d of %d sections. %s", surface_words(plan), outcome.verdict.word, len(sections), len(heights), "; ".join(notes))
    return outcome


@dataclass(frozen=True, slots=True, eq=False)
class _Stack:
    """What the sections of a stack share; `doubt` is of all of them."""

    plan: CtPlan
    profiles: StackProfiles
    questions: StackQuestions
    doubt: Reason | None = None


def _slices(
    plan: CtPlan,
    mesh: SurfaceMesh,
    heights: list[float],
    open3d: Callable[[], Open3DProcess],
    notes: list[str],
    part_mm: float,
) -> Generator[SurfaceSection, None, None]:
    """Slices by the cutter of the plan; where Open3D is missing or breaks down, the rest by numpy, and a note says so."""
    cutter = _cutter(plan, len(heights), open3d, notes)
    done = 0
    try:
        for cut in _cut(plan, mesh, heights, cutter, part_mm):
            yield cut
            done += 1
    except Open3DMissing as error:
        notes.append(f"sections from {heights[done]:g} mm on were cut by numpy: {error}")
        yield from _cut(plan, mesh, heights[done:], NumpyCutter(), part_mm)


def _cut(plan: CtPlan, mesh: SurfaceMesh, heights: list[float], cutter: Cutter, part_mm: float) -> Iterator[SurfaceSection]:
    weld_mm, shortest_mm = plan.cut.weld_mm, plan.cut.shortest_mm
    return cut_surface(mesh, plan.sections.normal, heights, cutter=cutter, weld_mm=weld_mm, shortest_mm=shortest_mm, part_mm=part_mm)


def _cutter(plan: CtPlan, sections: int, open3d: Callable[[], Open3DProcess], notes: list[str]) -> Cutter:
    wanted = plan.cut.cutter
    if wanted == "numpy" or (wanted == "auto" and sections > _FEW_SECTIONS):
        return NumpyCutter()
    status = open3d().status()
    if status.version is not None:
        return open3d()
    if wanted == "open3d":
        raise PlanError(f"{status.sentence()}; or cut with numpy, which gives the same points")
    if status.installed:  # where it is not installed, numpy was the user's choice
        notes.append(f"cut by numpy. {status.sentence()}")
    return NumpyCutter()


@dataclass(frozen=True, slots=True, eq=False)
class _Ready:
    """A section before it is measured, with what was assumed about the surface and the nominals by then."""

    cut: SurfaceSection
    notes: tuple[str, ...]
    nominal_file: Path
    plan: Plan
    profile: NominalProfile
    asked: tuple[Characteristic, ...]
    refusal: RegistrationError | None
    chosen: Chosen
    warnings: tuple[str, ...]
    evaluation: Evaluation


def _prepare_ahead(
    stack: _Stack,
    slices: Iterator[SurfaceSection],
    notes: list[str],
    foresight: Foresight,
    clock: Callable[[], float],
    stop: threading.Event,
) -> Iterator[_Ready]:
    """The sections, so many of them prepared before they are needed as other processes can evaluate beforehand."""
    return look_ahead((_prepare(stack, cut, tuple(notes), foresight, clock, stop) for cut in slices), foresight.ahead)


def _prepare(
    stack: _Stack, cut: SurfaceSection, notes: tuple[str, ...], foresight: Foresight, clock: Callable[[], float], stop: threading.Event
) -> _Ready:
    """Choose what is judged of a section. An outline that cannot be this profile is refused before anything is fitted."""
    plan, (path, _) = stack.plan, stack.profiles.at(cut.asked_mm)
    section, surface = plan_of_section(plan, cut, path), plan.mesh.file.name
    profile, asked = stack.profiles.of(section)
    outline = outline_of(cut, profile)
    spacing_mm = profile.length_mm / _LEAST_POINTS
    chosen = choose_outline(outline, section, profile, asked, spacing_mm, surface, clock=clock, stop=stop)
    warnings = [*cut.warnings, *outline.notes, *_beside(cut, chosen.contours)]
    if count_points(chosen.judged) > count_points(chosen.contours):
        warnings.append(f"a coarse surface: points were set between its corners, no farther apart than {spacing_mm:.3f} mm")
    evaluation = evaluate if outline.refusal is not None else foresight.begin(plan, section, chosen.judged)
    return _Ready(cut, notes, path, section, profile, asked, outline.refusal, chosen, tuple(warnings), evaluation)


def _inspect(
    stack: _Stack, number: int, ready: _Ready, record: StackRecord | None, clock: Callable[[], float], stop: threading.Event
) -> SectionOutcome:
    """Send one section through the pipeline."""
    cut, chosen, warnings, profile = ready.cut, ready.chosen, list(ready.warnings), ready.profile
    started = run_started(stack.plan, surface_words(stack.plan), simulated=False, notes=(*ready.notes, *warnings))
    doubt = chosen.doubt or stack.doubt
    with recorder_of(record, number, cut, ready.plan, doubt) as recorder:
        if ready.refusal is not None:
            run = refuse_section(count_points(chosen.judged), ready.refusal, started, recorder, clock())
        else:
            run = measure_section(
                ContourSource(chosen.judged, stack.plan.mesh.file.name),
                ready.plan,
                profile,
                ready.asked,
                started,
                recorder,
                doubt=doubt,
                clock=clock,
                stop=stop,
                numbers=stack.questions.numbers(profile),
                evaluation=ready.evaluation,
            )
    if run.refusal is not None:
        warnings.append(str(run.refusal))
    evidence = recorder.evidence if recorder else None
    return SectionOutcome(cut, chosen.judged, ready.nominal_file, profile, started, run, tuple(warnings), evidence)


def _beside(cut: SurfaceSection, judged: tuple[Contour, ...]) -> Iterator[str]:
    """What is not judged beside the outline."""
    beside = [contour for contour in cut.contours if not any(contour is part for part in judged)]
    if beside:
        holes = sum(contour.hole for contour in beside)
        longest = beside[0].length_mm
        yield f"{len(beside)} further contour(s) beside the outline, {holes} of them holes, are not judged; the longest is {longest:.2f} mm"
