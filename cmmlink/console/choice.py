"""The plan that an operator has chosen: checked with everything it names, short of the device, and described for the page."""

import re
from dataclasses import dataclass
from datetime import datetime
from functools import partial
from pathlib import Path

from cmmlink.console.protocol import ChosenPlan
from cmmlink.console.refused import without_folders
from cmmlink.devices import words_of
from cmmlink.errors import PlanError
from cmmlink.from_plan import check_plan, zone_of
from cmmlink.from_surface_plan import check_surface_plan, document_of_surface
from cmmlink.nominal_files.surface_file import SurfaceFile
from cmmlink.plan import Plan, SurfacePlan, kind_of_plan, load_plan, load_surface_plan
from cmmlink.run_context import RunContext
from drivers import PointFileError
from inspection import InspectionError, NominalProfile, ToleranceZone

Facts = list[tuple[str, str]]

_MOST_PLAN_BYTES = 50_000  # of its text are shown


@dataclass(frozen=True, slots=True, eq=False)
class CheckedPlan:
    """A plan that can be run, and its nominal. `notes` are what is known of the part, beside what the device's notes say."""

    plan: Plan
    profile: NominalProfile
    notes: tuple[str, ...] = ()

    def context(self, began: datetime, number: str, name: str) -> RunContext:
        """What is known of its next run before that begins."""
        return RunContext.of(self.plan, self.profile, began, number, name)


@dataclass(frozen=True, slots=True, eq=False)
class CheckedSurface:
    """The plan of a whole surface that can be run, and its nominal; `notes` as of a section."""

    plan: SurfacePlan
    file: SurfaceFile
    notes: tuple[str, ...] = ()

    def context(self, began: datetime, number: str, name: str) -> RunContext:
        """What is known of its next run before that begins."""
        return RunContext.of_surface(self.plan, self.file, partial(document_of_surface, self.file), began, number, name)


@dataclass(frozen=True, slots=True, eq=False)
class Choice:
    """The plan chosen. `checked` is None where it cannot be run; `shown` says why, and is what a page gets."""

    name: str
    checked: CheckedPlan | CheckedSurface | None
    shown: ChosenPlan


def check_choice(name: str, file: Path) -> Choice:
    """Check a plan with everything it names. Reads files and builds the nominal: this may take seconds."""
    text = ""
    try:
        with file.open("rb") as opened:
            text = opened.read(_MOST_PLAN_BYTES).decode("utf-8", errors="replace")
        if kind_of_plan(file) is SurfacePlan:
            plan = load_surface_plan(file)
            checked = CheckedSurface(plan, check_surface_plan(plan, file))
            return Choice(name, checked, _shown(name, text, plan, _facts_of_surface(checked)))
        section = load_plan(file)
        profile = check_plan(section, file)
    except OSError as error:
        return _refusal(name, "", f"{file.name}: {error.strerror or error}", None)
    except (PlanError, InspectionError, PointFileError, ValueError) as error:
        found = re.search(r"\bline (\d+)", str(error))
        about_plan = isinstance(error, PlanError) and str(error).startswith(str(file))
        return _refusal(
            name, text, without_folders(str(error).replace(str(file), file.name)), int(found[1]) if found and about_plan else None
        )
    return Choice(name, CheckedPlan(section, profile), _shown(name, text, section, _facts(section, profile)))


def _refusal(name: str, text: str, problem: str, line: int | None) -> Choice:
    return Choice(name, None, ChosenPlan(name, text, problem, line, part="", facts=(), has_address=False))


def _shown(name: str, text: str, plan: Plan | SurfacePlan, facts: Facts) -> ChosenPlan:
    return ChosenPlan(name, text, "", None, plan.part.name, tuple(facts), has_address=plan.has_address)


def _facts_of_surface(checked: CheckedSurface) -> Facts:
    plan, nominal, context = checked.plan, checked.file.nominal, checked.context(datetime.min, "", "")
    zone, registration = context.zone, plan.registration
    facts = [
        ("Part", plan.part.name),
        ("Tolerance", _zone_words(zone)),
        ("Nominal", f"{plan.surface.file.name}, {nominal.area_mm2:.6g} mm\u00b2"),
        ("Device", words_of(plan.device)),
        ("Fit", f"{'start' if registration.start and registration.fit == 'none' else registration.fit}, whole surface"),
        ("Coverage", f"at least {registration.coverage_min:.0%}"),
    ]
    return [*facts, *_probe(plan)]


def _zone_words(zone: ToleranceZone) -> str:
    uncertainty = f", U {zone.uncertainty_mm:.4g} mm" if zone.uncertainty_mm else ""
    return f"{zone.lower_mm:+g} to {zone.upper_mm:+g} mm{uncertainty}"


def _probe(plan: Plan | SurfacePlan) -> Facts:
    radius = plan.probe.tip_radius_mm
    return [("Probe", f"ball, radius {radius:g} mm")] if radius else []


def _facts(plan: Plan, profile: NominalProfile) -> Facts:
    zone, registration = zone_of(plan, profile), plan.registration
    facts = [
        ("Part", plan.part.name),
        ("Tolerance", _zone_words(zone)),
        ("Nominal", f"{plan.nominal.file.name}, {profile.length_mm:.1f} mm, {'closed' if profile.curve.closed else 'open'}"),
        ("Device", words_of(plan.device)),
        ("Fit", f"{'datum' if registration.datum else registration.fit}, {registration.method}"),
        ("Coverage", f"at least {registration.coverage_min:.0%}"),
    ]
    facts += _probe(plan)
    if plan.answer is not None:
        facts.append(("Answer", plan.answer.file.name))
    return facts
