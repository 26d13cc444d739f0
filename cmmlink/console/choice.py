"""The plan that an operator has chosen: checked with everything it names, short of the device, and described for the page."""

import re
from dataclasses import dataclass
from pathlib import Path

from cmmlink.console.protocol import ChosenPlan
from cmmlink.console.refused import without_folders
from cmmlink.devices import words_of
from cmmlink.errors import PlanError
from cmmlink.from_plan import check_plan, zone_of
from cmmlink.plan import Plan, load_plan
from drivers import PointFileError
from inspection import InspectionError, NominalProfile

_MOST_PLAN_BYTES = 50_000  # of its text are shown


@dataclass(frozen=True, slots=True, eq=False)
class CheckedPlan:
    """A plan that can be run, and its nominal. `notes` are what is known of the part, beside what the device's notes say."""

    plan: Plan
    profile: NominalProfile
    notes: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True, eq=False)
class Choice:
    """The plan chosen. `checked` is None where it cannot be run; `shown` says why, and is what a page gets."""

    name: str
    checked: CheckedPlan | None
    shown: ChosenPlan


def check_choice(name: str, file: Path) -> Choice:
    """Check a plan with everything it names. Reads files and builds the nominal: this may take seconds."""
    text = ""
    try:
        with file.open("rb") as opened:
            text = opened.read(_MOST_PLAN_BYTES).decode("utf-8", errors="replace")
        plan = load_plan(file)
        profile = check_plan(plan, file)
    except OSError as error:
        return _refusal(name, "", f"{file.name}: {error.strerror or error}", None)
    except (PlanError, InspectionError, PointFileError, ValueError) as error:
        found = re.search(r"\bline (\d+)", str(error))
        about_plan = isinstance(error, PlanError) and str(error).startswith(str(file))
        return _refusal(
            name, text, without_folders(str(error).replace(str(file), file.name)), int(found[1]) if found and about_plan else None
        )
    return Choice(name, CheckedPlan(plan, profile), _description(name, text, plan, profile))


def _refusal(name: str, text: str, problem: str, line: int | None) -> Choice:
    return Choice(name, None, ChosenPlan(name, text, problem, line, part="", facts=(), has_address=False))


def _description(name: str, text: str, plan: Plan, profile: NominalProfile) -> ChosenPlan:
    zone, registration = zone_of(plan, profile), plan.registration
    uncertainty = f", U {zone.uncertainty_mm:.4g} mm" if zone.uncertainty_mm else ""
    facts = [
        ("Part", plan.part.name),
        ("Tolerance", f"{zone.lower_mm:+g} to {zone.upper_mm:+g} mm{uncertainty}"),
        ("Nominal", f"{plan.nominal.file.name}, {profile.length_mm:.1f} mm, {'closed' if profile.curve.closed else 'open'}"),
        ("Device", words_of(plan.device)),
        ("Fit", f"{'datum' if registration.datum else registration.fit}, {registration.method}"),
        ("Coverage", f"at least {registration.coverage_min:.0%}"),
    ]
    if plan.probe.tip_radius_mm:
        facts.append(("Probe", f"ball, radius {plan.probe.tip_radius_mm:g} mm"))
    if plan.answer is not None:
        facts.append(("Answer", plan.answer.file.name))
    return ChosenPlan(name, text, "", None, plan.part.name, tuple(facts), has_address=plan.has_address)
