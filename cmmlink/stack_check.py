"""A plan of a CT inspection checked before anything is cut: its files, its sections, and what it asks of them."""

from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

from cmmlink.errors import PlanError
from cmmlink.from_plan import Problems, check_fixed_place, notes_on_temperature
from cmmlink.plan import CtPlan
from cmmlink.stack_characteristics import StackQuestions
from cmmlink.stack_inputs import Open3DOnUse, StackProfiles, check_own_nominals, heights_of, read_surface


@dataclass(frozen=True, slots=True)
class StackCheck:
    """What a plan would do, and everything that is wrong with it, each with file, line and key.

    surface    : the surface in words
    heights_mm : of the sections
    """

    surface: str
    heights_mm: tuple[float, ...]
    notes: tuple[str, ...]
    problems: tuple[PlanError, ...]


def check_stack(plan: CtPlan, plan_file: Path) -> StackCheck:
    """Read the surface and every nominal, and hold them against the plan. Nothing is cut."""
    found, questions = Problems(plan_file), StackQuestions(plan)
    found.attempt("temperature" if plan.temperature is not None else "uncertainty.temperature", lambda: check_fixed_place(plan))
    profiles = found.attempt("nominal.file", lambda: StackProfiles(plan))
    with ExitStack() as opened:
        open3d = Open3DOnUse(opened)
        mesh = found.attempt("mesh.file", lambda: read_surface(plan, open3d))
    heights = None if mesh is None else found.attempt("sections", lambda: heights_of(plan, mesh))
    if heights is not None:
        found.attempt("sections.nominal_at", lambda: check_own_nominals(plan, heights))
        found.attempt("stack_characteristics", lambda: questions.check_heights(heights))
        if profiles is not None and not found.problems:
            found.attempt("stack_characteristics", lambda: [questions.numbers(profiles.at(height)[1]) for height in heights])
    surface = "" if mesh is None else f"{plan.mesh.file.name}, {mesh.triangles} triangles ({mesh.kind})"
    notes = (*(mesh.warnings if mesh else ()), *(profiles.notes if profiles else ()), *notes_on_temperature(plan))
    return StackCheck(surface, tuple(heights or ()), notes, tuple(found.problems))
