"""The command `check`: a plan of any kind, with every file that it names. All mistakes are told at once, each with a line that is right."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from cmmlink.commands.exit_codes import UNUSABLE, fail
from cmmlink.commands.options import PlanFile, records_folder

if TYPE_CHECKING:
    from cmmlink.plan import CtPlan, Plan, PlanMistake, SurfacePlan


def check(plan_file: PlanFile) -> int:
    """Check a plan of any kind, and the files that it names.

    A plan is that of a scan, of a whole surface or of a CT surface; a register map is checked as well. All mistakes are listed, each with
    its line and an example of what may stand there. No device is contacted.
    """
    from cmmlink.plan import CtPlan, Plan, SurfacePlan, find_mistakes, kind_of, load_ct_plan, load_plan, load_surface_plan
    from drivers import read_text

    mistakes = find_mistakes(plan_file)
    if mistakes:
        return _fail_with(plan_file, mistakes)
    kind = kind_of(read_text(plan_file))
    if kind is Plan:
        return _check_scan(load_plan(plan_file), plan_file)
    if kind is SurfacePlan:
        return _check_surface(load_surface_plan(plan_file), plan_file)
    return _check_stack(load_ct_plan(plan_file), plan_file) if kind is CtPlan else _check_map(plan_file)


def _fail_with(plan_file: Path, mistakes: "Sequence[PlanMistake]") -> int:
    """Say what is wrong: one mistake on the line of the message, several on lines of their own below it."""
    if len(mistakes) == 1:
        example = f"; for example {mistakes[0].example}" if mistakes[0].example else ""
        return fail(f"{plan_file}: {mistakes[0].words}{example}", UNUSABLE)
    lines = [f"{plan_file}: {len(mistakes)} mistakes"]
    for mistake in mistakes:
        lines += [f"  {mistake.words}", *([f"      for example {mistake.example}"] if mistake.example else [])]
    return fail("\n".join(lines), UNUSABLE)


def _check_scan(plan: "Plan", plan_file: Path) -> int:
    from cmmlink.devices import words_of
    from cmmlink.from_plan import zone_of
    from cmmlink.scan_check import as_mistakes, check_scan
    from cmmlink.scratch import words_of_room

    found = check_scan(plan, plan_file)
    profile = found.profile
    if found.problems or profile is None:
        return _fail_with(plan_file, as_mistakes(plan_file, found.problems))
    zone = zone_of(plan, profile)
    typer.echo(f"{plan_file} can be run: {plan.part.name}, zone {zone.lower_mm:+g} .. {zone.upper_mm:+g} mm, {words_of(plan.device)}")
    typer.echo(f"records in {words_of_room(plan.records.folder or records_folder(None))}")
    typer.echo(f"nominal {profile.length_mm:.3f} mm long, {len(profile)} samples, material on the {profile.material}")
    typer.echo(f"decision rule: {zone.decision_rule}")
    if plan.answer is not None:
        away = "" if plan.answer.file.parent.is_dir() else f", which is out of reach now: there is no folder {plan.answer.file.parent}"
        typer.echo(f"the machine is told the verdict in {plan.answer.file}{away}")
    _print_notes(found.notes)
    return 0


def _check_surface(plan: "SurfacePlan", plan_file: Path) -> int:
    from cmmlink.devices import words_of
    from cmmlink.scan_check import as_mistakes, check_surface

    found = check_surface(plan, plan_file)
    file = found.file
    if found.problems or file is None:
        return _fail_with(plan_file, as_mistakes(plan_file, found.problems))
    zone = plan.zone
    typer.echo(f"{plan_file} can be run: {plan.part.name}, zone {zone.lower_mm:+g} .. {zone.upper_mm:+g} mm, {words_of(plan.device)}")
    typer.echo(f"nominal {file.source_format}, {file.nominal.area_mm2:.6g} mm2, {file.nominal.size_mm:.6g} mm long")
    typer.echo(f"decision rule: {zone.decision_rule}")
    _print_notes(found.notes)
    return 0


def _check_stack(plan: "CtPlan", plan_file: Path) -> int:
    from cmmlink.scan_check import as_mistakes
    from cmmlink.stack_check import check_stack

    found = check_stack(plan, plan_file)
    if found.problems:
        return _fail_with(plan_file, as_mistakes(plan_file, found.problems))
    zone, heights = plan.zone, found.heights_mm
    typer.echo(f"{plan_file} can be inspected: {plan.part.name}, zone {zone.lower_mm:+g} .. {zone.upper_mm:+g} mm, {found.surface}")
    typer.echo(f"{len(heights)} section{'' if len(heights) == 1 else 's'} at heights {_words_of_heights(heights)} mm")
    _print_notes(found.notes)
    return 0


def _words_of_heights(heights_mm: Sequence[float]) -> str:
    if len(heights_mm) > 6:
        return f"from {min(heights_mm):g} to {max(heights_mm):g}"
    return ", ".join(f"{height:g}" for height in heights_mm)


def _check_map(map_file: Path) -> int:
    from cmmlink.plan import map_of

    found = map_of(map_file)
    typer.echo(f"{map_file} can be used: the registers of {found.device}, read by the pattern {found.pattern}")
    return 0


def _print_notes(notes: Sequence[str]) -> None:
    for note in notes:
        typer.echo(f"  note: {note}")
