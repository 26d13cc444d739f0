"""A plan checked with every file that it names, as `cmmlink check` and the page do it: all that is wrong with it at once."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from cmmlink.devices import connect
from cmmlink.errors import PlanError
from cmmlink.from_plan import Problems, find_problems, notes_on_nominal, notes_on_temperature
from cmmlink.plan import CtPlan, Plan, PlanMistake, SurfacePlan, find_mistakes, kind_of, load_ct_plan, load_plan, load_surface_plan
from drivers import read_text
from inspection import NominalProfile

if TYPE_CHECKING:
    from cmmlink.nominal_files.surface_file import SurfaceFile


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
    notes, of_device = _notes_on_device(plan, plan_file)
    problems = (*problems, *of_device)
    if problems or profile is None:
        return ScanCheck(None, (), problems)
    return ScanCheck(profile, (*notes_on_nominal(plan), *notes_on_temperature(plan), *notes), ())


@dataclass(frozen=True, slots=True, eq=False)
class SurfaceCheck:
    """The same of the plan of a whole surface.

    file : the nominal; None where something is wrong with the plan
    """

    file: "SurfaceFile | None"
    notes: tuple[str, ...]
    problems: tuple[PlanError, ...]


def check_surface(plan: SurfacePlan, plan_file: Path) -> SurfaceCheck:
    """Read the nominal surface of a plan, and build its device short of opening it. No device is contacted."""
    from cmmlink.from_surface_plan import find_surface_problems, notes_on_surface  # noqa: PLC0415 - it loads what reads surfaces

    file, problems = find_surface_problems(plan, plan_file)
    notes, of_device = _notes_on_device(plan, plan_file)
    if problems or of_device or file is None:
        return SurfaceCheck(None, (), (*problems, *of_device))
    return SurfaceCheck(file, (*notes_on_surface(plan, file), *notes), ())


def _notes_on_device(plan: Plan | SurfacePlan, plan_file: Path) -> tuple[tuple[str, ...], tuple[PlanError, ...]]:
    """What is assumed of the device of a plan, and what is wrong with it."""

    def connected() -> tuple[str, ...]:
        with connect(plan) as device:
            return device.notes

    found = Problems(plan_file)
    return found.attempt("device", connected) or (), tuple(found.problems)


def mistakes_of(plan_file: Path) -> tuple[PlanMistake, ...]:
    """Everything that is wrong with the plan of a scan or of a surface, and with the files that it names; none where it can be used.

    Raises PlanError where the file is no text with keys.
    """
    mistakes = find_mistakes(plan_file)
    if mistakes:
        return mistakes
    kind = kind_of(read_text(plan_file))
    if kind is SurfacePlan:
        return as_mistakes(plan_file, check_surface(load_surface_plan(plan_file), plan_file).problems)
    if kind is CtPlan:
        from cmmlink.stack_check import check_stack  # noqa: PLC0415 - it loads what cuts surfaces, and the check of a scan needs none of it

        return as_mistakes(plan_file, check_stack(load_ct_plan(plan_file), plan_file).problems)
    return as_mistakes(plan_file, check_scan(load_plan(plan_file), plan_file).problems)


def as_mistakes(plan_file: Path, problems: tuple[PlanError, ...]) -> tuple[PlanMistake, ...]:
    """Problems that only the files show that a plan names, as mistakes of its text; the name of the plan is left out."""
    return tuple(PlanMistake(str(problem).removeprefix(f"{plan_file}: ")) for problem in problems)
