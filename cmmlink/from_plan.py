"""Builds what a plan describes, except its device: the nominal profile and the inspection. Errors name file, line and key."""

import hashlib
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import replace
from functools import lru_cache, partial
from pathlib import Path
from typing import TypedDict, TypeVar

import numpy as np

from cmmlink.answer_file import refuse_foreign
from cmmlink.characteristics import Builder, base_of, known_pose, pose_of
from cmmlink.errors import AnswerError, PlanError
from cmmlink.events import RunStarted
from cmmlink.last_qualification import qualification_here
from cmmlink.line_sample import check_sample
from cmmlink.nominal_files import NominalFile, load_nominal, material_side
from cmmlink.plan import CtPlan, Discretisation, LinesDevice, Nominal, Plan, Section, SurfacePlan, place_of
from drivers import PointFileError, read_bytes
from inspection import (
    Characteristic,
    Evaluation,
    FitName,
    LiveInspection,
    Material,
    Method,
    NominalProfile,
    NurbsCurve,
    RigidTransform,
    Room,
    RuleName,
    SectionCharacteristic,
    SectionPlane,
    StatedUncertainty,
    ToleranceZone,
    WeightName,
    discretize,
    evaluate,
    uncertainty_along,
)

Found = TypeVar("Found")


def check_plan(plan: Plan, plan_file: Path) -> NominalProfile:
    """Build the profile of a plan and check the values that depend on it. Raises PlanError with file, line and key."""
    profile, problems = find_problems(plan, plan_file)
    if problems or profile is None:
        raise problems[0]
    return profile


def find_problems(plan: Plan, plan_file: Path) -> tuple[NominalProfile | None, tuple[PlanError, ...]]:
    """The profile of a plan, and everything that is wrong with the values that depend on it, each with file, line and key."""
    found = Problems(plan_file)
    profile = found.attempt("nominal.file", lambda: profile_of(plan))
    if isinstance(plan.device, LinesDevice):
        found.attempt("device.format.sample", partial(check_sample, plan.device, plan.probe.tip_radius_mm))
    if plan.answer is not None:
        found.attempt("answer.file", partial(_check_answer, plan.answer.file))
    found.attempt("temperature" if plan.temperature is not None else "uncertainty.temperature", lambda: check_fixed_place(plan))
    if profile is not None:
        found.attempt("uncertainty", lambda: zone_of(plan, profile))
        builder = Builder(plan, profile)
        for number in range(len(plan.characteristics)):
            found.attempt(f"characteristics.{number}", partial(builder.build, number))
        found.attempt("probe.tip_radius_mm", lambda: inspection_of(plan, profile, characteristics=()))
    return profile, tuple(found.problems)


def _check_answer(file: Path) -> None:
    """Raise PlanError where a file stands in the place of the answer that is none. One that is out of reach now may be there later."""
    try:
        refuse_foreign(file)
    except AnswerError as error:
        raise PlanError(str(error)) from None
    except OSError:
        return


class Problems:
    """Collects what is wrong with a plan, step by step."""

    def __init__(self, plan_file: Path) -> None:
        self._plan_file = plan_file
        self.problems: list[PlanError] = []

    def attempt(self, key: str, step: Callable[[], Found]) -> Found | None:
        """Take a step that depends on a key; None where it fails, which is kept with the place of the key."""
        try:
            with name_place(self._plan_file, key):
                return step()
        except PlanError as problem:
            self.problems.append(problem)
            return None


@contextmanager
def name_place(plan_file: Path, key: str) -> Iterator[None]:
    """Prefix a value's error with file, line and key."""
    try:
        yield
    except ValueError as error:
        problem = str(error).removeprefix(f"{key}: ")  # what names its key already needs only the place
        raise PlanError(f"{place_of(plan_file, key)}: {problem}") from None


def profile_of(plan: Plan) -> NominalProfile:
    """The nominal that a plan names, discretised as it says."""
    nominal = plan.nominal
    return discretize_file(_load(plan), nominal.file, nominal, plan.discretisation)


def nominal_of(plan: Plan) -> tuple[NurbsCurve, Material]:
    """The exact curve of a plan's nominal, and the side of its material. Raises PlanError where that side is not known."""
    curve = _load(plan).curve
    return curve, _side_of(curve, plan.nominal.file, plan.nominal)


def load_from(nominal: Nominal, path: Path, section: SectionPlane | None = None) -> NominalFile:
    """The nominal in the file `path`, read as a plan says; `section` is the plane of the section, where one is asked for."""
    return load_nominal(path, nominal.scale, nominal.closed, nominal.unit, layer=nominal.layer, curve=nominal.curve, section=section)


def notes_on_nominal(plan: Plan) -> tuple[str, ...]:
    """What was assumed or mended when the nominal of a plan was read, each with the name of its file."""
    return tuple(f"{plan.nominal.file.name}: {note}" for note in _load(plan).notes)


def with_section(plan: Plan) -> Plan:
    """The plan with the section that its nominal brings: the plane of a curve in space, where the plan names none of its own."""
    plane = None if _asks_for_section(plan) else _load(plan).plane
    if plane is None:
        return plan
    vectors = {name: getattr(plane, name).tolist() for name in ("origin_mm", "normal", "x_axis")}
    return plan.model_copy(update={"section": plan.section.model_copy(update={name: tuple(vector) for name, vector in vectors.items()})})


def _load(plan: Plan) -> NominalFile:
    """The nominal of a plan. Who asks for it again has what was read before, as long as the file holds the same bytes."""
    nominal, section = plan.nominal, plan.section if _asks_for_section(plan) else None
    content = _content_of(nominal.file)
    if content is not None:
        file = _read(nominal, section, content)
        if _content_of(nominal.file) == content:
            return file
        _read.cache_clear()  # it was written meanwhile: which of its contents was read is not known
    return load_from(nominal, nominal.file, None if section is None else plane_of(section))


@lru_cache(maxsize=2)
def _read(nominal: Nominal, section: Section | None, content: bytes) -> NominalFile:
    """The nominal in a file that holds this content. A drawing of a solid takes seconds to read, and a run needs it three times."""
    return load_from(nominal, nominal.file, None if section is None else plane_of(section))


def _content_of(path: Path) -> bytes | None:
    """What tells the content of a file from any other; None where it cannot be read, of which whoever reads it says why."""
    with suppress(PointFileError):
        return hashlib.sha256(read_bytes(path)).digest()
    return None


def _asks_for_section(plan: Plan) -> bool:
    """Whether a plan says in which plane its section lies."""
    return bool(plan.section.model_fields_set & {"origin_mm", "normal", "x_axis"})


def plane_of(section: Section) -> SectionPlane:
    """The plane of a plan's section."""
    return SectionPlane(np.array(section.origin_mm), np.array(section.x_axis), np.array(section.normal))


def notes_on_datum(plan: Plan) -> tuple[str, ...]:
    """Where a known pose was taken over from."""
    datum = plan.registration.datum
    return (datum.words,) if datum is not None and datum.words is not None else ()


def notes_on_temperature(plan: Plan | CtPlan) -> tuple[str, ...]:
    """What was made of the temperature of the part."""
    return (plan.warmth.words,) if plan.warmth is not None else ()


def stated_by(plan: Plan | CtPlan) -> StatedUncertainty | None:
    """The budget of the uncertainty that a plan states."""
    return plan.uncertainty.stated(plan.warmth) if plan.uncertainty is not None else None


def check_fixed_place(plan: Plan | CtPlan) -> None:
    """Raise PlanError where the place that a warm part grows about matters, and is not stated."""
    warm, registration = plan.warmth, plan.registration
    is_known = known_pose(pose_of(registration.datum), registration.fit) is not None
    if warm is not None and warm.growth and warm.fixed_mm is None and is_known:
        raise PlanError("found no fixed_mm; the pose is known, so that it matters which place stays where it is as the part grows: [x, y]")


def zone_of(plan: Plan | CtPlan, profile: NominalProfile) -> ToleranceZone:
    """The zone that judges the points of a plan as they arrive, with its U. Raises PlanError where U leaves nothing provable."""
    stated, base = stated_by(plan), base_of(plan)
    if stated is None:
        return plan.zone
    largest_mm = uncertainty_along(profile, stated, known_pose(base.datum, base.fit)).largest_mm
    try:
        return replace(plan.zone, uncertainty_mm=largest_mm)
    except ValueError as error:
        raise PlanError(f"uncertainty: {error}") from None


def discretize_file(file: NominalFile, path: Path, nominal: Nominal, finely: Discretisation) -> NominalProfile:
    """Discretise a nominal that was read from `path`. The material lies inside a closed profile unless the plan says otherwise."""
    side = _side_of(file.curve, path, nominal)
    return discretize(file.curve, finely.samples, finely.pole_angle_min_deg, finely.step_min, side)


def _side_of(curve: NurbsCurve, path: Path, nominal: Nominal) -> Material:
    side = nominal.material or material_side(curve)
    if side is None:
        raise PlanError(
            f"{path}: an open profile does not show on which side its material lies; "
            "set nominal.material to left or right in the plan, or give --material left or --material right"
        )
    return side


def inspection_of(
    plan: Plan,
    profile: NominalProfile,
    room: Room = np.empty,
    *,
    provisional: bool = True,
    characteristics: Sequence[Characteristic] | None = None,
    numbers: Sequence[SectionCharacteristic] = (),
    evaluation: Evaluation = evaluate,
) -> LiveInspection:
    """A fresh inspection as a plan describes it. Points that are all there from the start need no provisional verdicts.

    room            : gives the arrays that grow with the scan, like numpy.empty
    characteristics : those of the plan for this profile, where they are built already
    numbers         : what is found as well, without a part in the verdict
    evaluation      : how both are found at the end

    Raises PlanError for a characteristic that the nominal does not have.
    """
    section = plan.section
    return LiveInspection(
        profile,
        plan.zone,
        **_fitting(plan),
        tip_radius_mm=plan.probe.tip_radius_mm,
        section=plane_of(section),
        off_section_max_mm=section.off_plane_max_mm,
        uncertainty=stated_by(plan),
        compensation=plan.warmth.compensation if plan.warmth is not None else None,
        characteristics=asked_of(plan, profile) if characteristics is None else characteristics,
        numbers=numbers,
        evaluation=evaluation,
        provisional=provisional,
        room=room,
    )


def asked_of(plan: Plan | CtPlan, profile: NominalProfile) -> tuple[Characteristic, ...]:
    """The characteristics of a plan for a nominal. Raises PlanError for one that the nominal does not have."""
    builder, found = Builder(plan, profile), []
    for number, asked in enumerate(plan.characteristics):
        try:
            found.append(builder.build(number))
        except ValueError as error:
            raise PlanError(f"characteristics[{number}], {asked.name}: {error}") from None
    return (*builder.short_form, *found)


class _Fitting(TypedDict):
    """What a plan says of the registration and of the verdict, as LiveInspection takes it."""

    datum: RigidTransform | None
    fit: FitName
    method: Method
    coverage_min: float
    reject_outliers: bool
    rule: RuleName
    weights: WeightName
    gap_max_mm: float | None
    end_allowance_mm: float | None
    allow_unseen_mm: float | None


def _fitting(plan: Plan) -> _Fitting:
    registration, base = plan.registration, base_of(plan)
    return {
        "datum": base.datum,
        "fit": base.fit,
        "method": registration.method,
        "coverage_min": registration.coverage_min,
        "reject_outliers": registration.reject_outliers,
        "rule": base.rule,
        "weights": plan.weights,
        "gap_max_mm": plan.gap_max_mm,
        "end_allowance_mm": plan.end_allowance_mm,
        "allow_unseen_mm": plan.allow.unseen_mm,
    }


def run_started(plan: Plan | SurfacePlan | CtPlan, device: str, simulated: bool, notes: tuple[str, ...] = ()) -> RunStarted:
    """The event that begins a run of a plan. What is to be warned of about the qualification of the installation stands in its notes."""
    operator = None if isinstance(plan, CtPlan) else plan.operator
    qualification, warning = qualification_here()
    told = tuple(dict.fromkeys([*notes, warning])) if warning else notes
    return RunStarted(plan.part.name, plan.part.serial_number or "", operator or "", device, simulated, told, qualification)
