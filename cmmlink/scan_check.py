"""A plan checked with every file that it names, as `cmmlink check` and the page do it: all that is wrong with it at once."""

from dataclasses import dataclass
from pathlib import Path

from cmmlink.devices import connect
from cmmlink.errors import PlanError
from cmmlink.from_plan import Problems, find_problems, notes_on_nominal, notes_on_temperature
from cmmlink.plan import CtPlan, Plan, PlanMistake, find_mistakes, kind_of, load_ct_plan, load_plan
from drivers import read_text
from inspection import NominalProfile


@dataclass(frozen=True, slots=True, eq=False)
class ScanCheck:
    """What the plan of a scan would do, and everything that is wrong with it, each with file, line and key.

    profile : None where something is wrong with it
    """

    profile: NominalProfile | None
    notes: tuple[str, ...]
    problems: tuple[PlanError, ...]


def check_scan(plan: Plan, plan_file: Path) -> ScanCheck:
    """Build the nominal of a plan, and its device short of opening it, and hold both against the plan. No device is contacted."""
    profile, problems = find_problems(plan, plan_file)

    def notes_on_device() -> tuple[str, ...]:
        with connect(plan) as device:
            return device.notes

    of_device = Problems(plan_file)
    notes = of_device.attempt("device", notes_on_device) or ()
    problems = (*problems, *of_device.problems)
    if problems or profile is None:
        return ScanCheck(None, (), problems)
    return ScanCheck(profile, (*notes_on_nominal(plan), *notes_on_temperature(plan), *notes), ())


def mistakes_of(plan_file: Path) -> tuple[PlanMistake, ...]:
    """Everything that is wrong with the plan of a scan or of a surface, and with the files that it names; none where it can be used.

    Raises PlanError where the file is no text with keys.
    """
    mistakes = find_mistakes(plan_file)
    if mistakes:
        return mistakes
    if kind_of(read_text(plan_file)) is CtPlan:
        from cmmlink.stack_check import check_stack  # noqa: PLC0415 - it loads what cuts surfaces, and the check of a scan needs none of it

        return as_mistakes(plan_file, check_stack(load_ct_plan(plan_file), plan_file).problems)
    return as_mistakes(plan_file, check_scan(load_plan(plan_file), plan_file).problems)


def as_mistakes(plan_file: Path, problems: tuple[PlanError, ...]) -> tuple[PlanMistake, ...]:
    """Problems that only the files show that a plan names, as mistakes of its text; the name of the plan is left out."""
    return tuple(PlanMistake(str(problem).removeprefix(f"{plan_file}: ")) for problem in problems)
