"""What the command `ct` needs besides the inspection: its options spelled out, its progress, and its table of sections."""

import re
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import typer
from pydantic import ValidationError
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn
from typer.core import TyperCommand

from cmmlink.errors import PlanError
from cmmlink.plan.surface import CtPlan, NominalAt
from cmmlink.report.terminal import STYLES
from cmmlink.stack import SectionOutcome, StackOutcome
from cmmlink.words import VERDICT_WORDS

_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?")
_MOST_WARNINGS = 20


class ManyHeights(TyperCommand):
    """A command whose `--heights` takes any number of values, and whose `--nominal-at` takes two, as often as wanted."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Spell `--heights 1 2` as `--heights=1 --heights=2` and `--nominal-at 1 FILE` as `--nominal-at=1=FILE`."""
        return super().parse_args(ctx, list(_spelled_out(args)))


def _spelled_out(args: Sequence[str]) -> Iterator[str]:
    waiting = list(args)
    while waiting:
        word = waiting.pop(0)
        if word == "--heights" and waiting and _NUMBER.fullmatch(waiting[0]):
            while waiting and _NUMBER.fullmatch(waiting[0]):
                yield f"--heights={waiting.pop(0)}"
        elif word == "--nominal-at" and len(waiting) > 1:
            yield f"--nominal-at={waiting.pop(0)}={waiting.pop(0)}"
        else:
            yield word


def plan_from(settings: dict[str, object]) -> CtPlan:
    """Check a plan made of options. Raises PlanError with the option's place in the plan."""
    try:
        return CtPlan.model_validate(settings)
    except ValidationError as failure:
        problem = failure.errors()[0]
        place = ".".join(str(part) for part in problem["loc"])
        allowed = re.sub(r"^(Value error, |Input should be )", "", problem["msg"])
        given = problem["input"] if isinstance(problem["input"], str | int | float) else None
        raise PlanError(f"{place or 'the options'}{'' if given is None else f' is {given}'}: expected {allowed}") from None


def own_nominals(texts: Sequence[str]) -> list[dict[str, object]]:
    """Understand HEIGHT=FILE as ManyHeights spells it."""
    own = []
    for text in texts:
        height, found, file = text.partition("=")
        if not found or not _NUMBER.fullmatch(height) or not file:
            raise PlanError(f"--nominal-at {text}: expected a height in mm and a file, like --nominal-at 80 tip.dat")
        own.append(NominalAt.model_validate({"height_mm": float(height), "file": file}).model_dump())
    return own


def given(context: typer.Context) -> list[str]:
    """Names of the parameters that stand on the command line."""
    sources = {name: context.get_parameter_source(name) for name in context.params}
    return [name for name, source in sources.items() if source is not None and source.name == "COMMANDLINE"]


class SectionBar:
    """A progress bar with the remaining time, one step a section, for as many rounds as there are things to do with each."""

    def __init__(self, console: Console, visible: bool) -> None:
        words, count = TextColumn("{task.description}"), MofNCompleteColumn()
        columns = (words, BarColumn(bar_width=40), count, TextColumn("left"), TimeRemainingColumn())
        self._progress = Progress(*columns, console=console, transient=True, disable=not visible)

    @contextmanager
    def shown(self) -> Iterator[None]:
        """Keep the bar on the screen."""
        with self._progress:
            yield
        for task in self._progress.task_ids:
            self._progress.remove_task(task)

    def round(self, words: str, sections: int) -> Callable[[], None]:
        """Begin a round; call what it returns for each section done."""
        task = self._progress.add_task(words, total=sections)
        return lambda: self._progress.advance(task)


def print_stack(console: Console, stack: StackOutcome) -> None:
    """Print the verdict, a line for each section, and what was not as it should be."""
    facts = stack.facts()
    cutters = ", ".join(sorted({section.slice.cutter for section in stack.sections}))
    missing = "" if stack.complete else f" of {stack.asked}"
    console.print(
        f"[{STYLES[stack.verdict]}]{VERDICT_WORDS[stack.verdict]}[/]  {len(stack.sections)}{missing} sections of {stack.mesh.source}"
    )
    console.print(f"{stack.mesh.triangles} triangles ({stack.mesh.kind}), cut by {cutters}")
    console.print(f"received {facts['received']} = judged {facts['judged']} + rejected {facts['rejected']}; lost {facts['lost']}")
    console.print(
        f"{'height mm':>11}  {'verdict':11}  {'lowest':>7}  {'highest':>7}  {'rms':>6}  {'out':>5}  {'worst at':>8}  covered  aside"
    )
    for section in stack.sections:
        console.print(_line(section))
    told = [f"height {section.slice.asked_mm:g} mm: {text}" for section in stack.sections for text in section.warnings]
    for text in [*told[:_MOST_WARNINGS], *stack.notes]:
        console.print(f"  {text}", style="yellow", markup=False)
    if len(told) > _MOST_WARNINGS:
        console.print(f"  and {len(told) - _MOST_WARNINGS} more warnings, all of them with --json", style="yellow")


def _line(section: SectionOutcome) -> str:
    result, cut = section.run.result, section.slice
    head = f"{cut.height_mm:11.4f}  [{STYLES[section.verdict]}]{VERDICT_WORDS[section.verdict]:11}[/]"
    if result is None or result.worst is None:
        return f"{head}  nothing judged"
    numbers = f"{result.min_deviation_mm:+7.4f}  {result.max_deviation_mm:+7.4f}  {result.rms_mm:6.4f}  {result.out_of_tolerance:5d}"
    return f"{head}  {numbers}  {result.station_mm[result.worst]:8.2f}  {result.coverage:7.1%}  {cut.set_aside:5d}"
