"""The command `ct`: its options spelled out, its progress, and its table of sections."""

import math
import re
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, nullcontext
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer
from typer.core import TyperCommand

from cmmlink.commands.exit_codes import EXIT_OF
from cmmlink.commands.options import (
    AllowUnseen,
    Closed,
    CurveNumber,
    EndAllowance,
    GapMax,
    Json,
    Layer,
    NominalScale,
    NominalUnit,
    NoRecord,
    Out,
    Records,
    RejectOutliers,
    Rule,
    Uncertainty,
    Weights,
    records_folder,
)
from cmmlink.commands.output import Output, print_json, say_untold, stop_on_ctrl_c, terminal
from cmmlink.commands.pushed import pushing_after
from cmmlink.errors import PlanError
from cmmlink.plan import CutterName
from cmmlink.words import VERDICT_WORDS, headline_of, printable
from drivers import UnitName
from inspection import FitName, Material, Method

if TYPE_CHECKING:
    from rich.console import Console

    from cmmlink.plan import CtPlan
    from cmmlink.report import SectionPictures
    from cmmlink.stack import SectionOutcome, StackOutcome

PicturesWanted = Literal["needed", "all", "none"]
_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?")
_MOST_WARNINGS = 20
_MOST_HEIGHTS = 8  # told of a sentence that is said of many sections
_MOST_SHARES = 12
_PATIENCE_S = 60.0  # surfaces are inspected side by side, and each waits for its turn to be recorded
_BESIDE_A_PLAN = ("mesh", "out", "records", "no_record", "as_json", "pictures", "no_pictures")
_OPTION_OF = {
    "mesh.scale": "--mesh-scale",
    "mesh.unit": "--mesh-unit",
    "nominal.scale": "--scale",
    "nominal.unit": "--nominal-unit",
    "nominal.layer": "--layer",
    "nominal.curve": "--curve",
    "tolerance.uncertainty_mm": "--uncertainty",
    "tolerance": "--tolerance",
    "sections.normal": "--normal",
    "sections.every_mm": "--every",
    "sections.from_mm": "--from",
    "sections.to_mm": "--to",
    "sections.nominal_at": "--nominal-at",
    "sections": "--heights, --every, --from, --to",
    "cut.weld_mm": "--weld",
    "cut.shortest_mm": "--shortest",
    "registration.coverage_min": "--coverage-min",
    "gap_max_mm": "--gap-max",
    "end_allowance_mm": "--end-allowance",
    "allow.unseen_mm": "--allow-unseen",
    "registration.reject_outliers": "--reject-outliers",
}


class ManyHeights(TyperCommand):
    """A command whose `--heights` takes any number of values, and whose `--nominal-at` takes two, as often as wanted."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Spell `--heights 1 2` as `--heights=1 --heights=2` and `--nominal-at 1 FILE` as `--nominal-at=1=FILE`."""
        return super().parse_args(ctx, list(_spell_out(args)))


def _spell_out(args: Sequence[str]) -> Iterator[str]:
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


def ct(
    context: typer.Context,
    mesh: Annotated[Path, typer.Argument(metavar="MESH", help="Surface: STL, PLY, OBJ; or a plan (YAML) of all that follows.")],
    nominal: Annotated[Path | None, typer.Option(metavar="FILE", help="The nominal profile.")] = None,
    tolerance: Annotated[
        tuple[float, float] | None, typer.Option(metavar="LO HI", help="Deviations allowed, mm, positive out of material.")
    ] = None,
    normal: Annotated[tuple[float, float, float], typer.Option(metavar="X Y Z", help="The part's axis in the scan.")] = (0.0, 0.0, 1.0),
    heights: Annotated[list[float] | None, typer.Option(metavar="H [H ...]", help="Heights of the sections along the normal, mm.")] = None,
    every: Annotated[float | None, typer.Option(metavar="STEP", help="A section every STEP mm, in place of --heights.")] = None,
    start: Annotated[float | None, typer.Option("--from", metavar="A", help="First height with --every.")] = None,
    end: Annotated[float | None, typer.Option("--to", metavar="B", help="Last height with --every.")] = None,
    nominal_at: Annotated[list[str] | None, typer.Option(metavar="HEIGHT FILE", help="Another nominal for one section.")] = None,
    method: Annotated[Method, typer.Option(help="How deviations are found.")] = "exact",
    fit: Annotated[FitName, typer.Option(help="How each section comes onto its nominal.")] = "best-fit",
    uncertainty: Uncertainty = 0.0,
    scale: NominalScale = 1.0,
    nominal_unit: NominalUnit = None,
    layer: Layer = None,
    curve: CurveNumber = None,
    mesh_scale: Annotated[float, typer.Option(metavar="S", help="Units of the surface file to mm.")] = 1.0,
    mesh_unit: Annotated[UnitName | None, typer.Option(help="Unit of the surface file, in place of --mesh-scale.")] = None,
    closed: Closed = None,
    material: Annotated[Material | None, typer.Option(help="Side of the material, seen along the nominal.")] = None,
    coverage_min: Annotated[float, typer.Option(help="Share of a nominal to be there before conform is proven.")] = 0.95,
    reject_outliers: RejectOutliers = False,
    rule: Rule = "minimum-zone",
    weights: Weights = "arc-length",
    gap_max: GapMax = None,
    end_allowance: EndAllowance = None,
    allow_unseen: AllowUnseen = None,
    cutter: Annotated[CutterName, typer.Option(help="auto: Open3D, and numpy for more than 50 sections; same points.")] = "auto",
    weld: Annotated[float, typer.Option(metavar="MM", help="Loose ends no farther apart are one point.")] = 1e-6,
    shortest: Annotated[float | None, typer.Option(metavar="MM", help="Shorter pieces are dust; 5 % of the longest if not given.")] = None,
    pictures: Annotated[
        PicturesWanted,
        typer.Option(
            "--pictures", help="Which sections are drawn into the folder of --out: needed are those that do not conform, or not provably."
        ),
    ] = "needed",
    no_pictures: Annotated[
        bool, typer.Option("--no-pictures", help="Draw none, and write no report; the same as --pictures none.")
    ] = False,
    out: Out = None,
    records: Records = None,
    no_record: NoRecord = False,
    as_json: Json = False,
) -> int:
    """Inspect sections of a CT surface, and record each as a run."""
    from cmmlink.plan import CtPlan, load_ct_plan, plan_given_by

    pictures = "none" if no_pictures else pictures
    if mesh.suffix.lower() in (".yaml", ".yml"):
        beside = [name for name in _options_given(context) if name not in _BESIDE_A_PLAN]
        if beside:
            raise PlanError(f"{mesh}: --{beside[0].replace('_', '-')} stands beside a plan, which says it all itself: set it in the plan")
        return _inspect_stack(load_ct_plan(mesh), Output(False, as_json, out, records), pictures, no_record)
    if nominal is None or tolerance is None:
        raise PlanError(f"{mesh}: a surface needs --nominal FILE and --tolerance LO HI")
    settings: dict[str, object] = {
        "part": {"name": printable(mesh.stem.replace("\n", " "))},
        "mesh": {"file": mesh, "scale": mesh_scale, "unit": mesh_unit},
        "nominal": {
            "file": nominal,
            "layer": layer,
            "curve": curve,
            "scale": scale,
            "unit": nominal_unit,
            "closed": closed,
            "material": material,
        },
        "tolerance": {"lower_mm": tolerance[0], "upper_mm": tolerance[1], "uncertainty_mm": uncertainty},
        "sections": {
            "normal": normal,
            "heights_mm": tuple(heights or ()),
            "every_mm": every,
            "from_mm": start,
            "to_mm": end,
            "nominal_at": _own_nominals(nominal_at or ()),
        },
        "cut": {"cutter": cutter, "weld_mm": weld, "shortest_mm": shortest},
        "registration": {"fit": fit, "method": method, "coverage_min": coverage_min, "reject_outliers": reject_outliers},
        "rule": rule,
        "weights": weights,
        "gap_max_mm": gap_max,
        "end_allowance_mm": end_allowance,
        "allow": {"unseen_mm": allow_unseen},
    }
    return _inspect_stack(plan_given_by(CtPlan, settings, _OPTION_OF), Output(False, as_json, out, records), pictures, no_record)


def _inspect_stack(plan: "CtPlan", output: Output, pictures: PicturesWanted, no_record: bool) -> int:
    """Inspect a stack with a progress bar; write its files and print what came of it, each even if the other fails."""
    from rich.console import Console

    from cmmlink.report import Pictures, SectionPictures, prepare, write_stack

    pattern = output.out or plan.out.folder
    prepare(pattern)
    bar = _SectionBar(Console(stderr=True), visible=not output.as_json and sys.stderr.isatty())
    records = None if no_record else records_folder(output.records or plan.records.folder)
    with pushing_after(records) as recorded:
        with Pictures() as processes:
            drawn = pictures != "none" and pattern is not None
            wanted = SectionPictures(plan.part.name, processes, every=pictures == "all") if drawn else None
            stack = _judge_stack(plan, records, bar, wanted)
            recorded += [section.evidence for section in stack.sections]
            say_untold([asdict(one) for one in stack.anchors])
            folder = None if pattern is None else stack.folder_of(pattern, plan)
            try:
                if folder is not None:
                    with bar.show():
                        done = bar.begin_round("written", len(stack.sections))
                        write_stack(folder, stack, plan.zone, plan.part.name, plan=plan, pictures=wanted, on_section=done)
            finally:
                if output.as_json:
                    print_json(stack.result_json())
                else:
                    _print_stack(terminal(), stack)
        if folder is not None and not output.as_json:
            whole = ", stack.png, stack.svg, report.pdf" if drawn else ""
            further = "".join(f", result.{name}" for name in plan.out.formats if name != "json")
            typer.echo(f"results in {folder}: result.json, sections.csv, a folder for each section{whole}{further}")
            if wanted is not None and (left := sum(not wanted.wants(section) for section in stack.sections)):
                typer.echo(f"sections that were not drawn: {left}; --pictures all draws those that conform as well")
    return EXIT_OF[stack.verdict]


def _judge_stack(plan: "CtPlan", records: Path | None, bar: "_SectionBar", pictures: "SectionPictures | None") -> "StackOutcome":
    """Inspect the sections, each of which is drawn as soon as it is judged, where pictures are wanted."""
    from cmmlink.stack import inspect_stack

    steps: list[Callable[[], None]] = []

    def begin(sections: int) -> None:
        steps.append(bar.begin_round("inspected", sections))
        if pictures is not None:
            pictures.expect(sections)

    def add(section: "SectionOutcome") -> None:
        if pictures is not None:
            pictures.begin(section)
        steps[0]()

    with bar.show(), stop_on_ctrl_c() as stop:
        return inspect_stack(
            plan,
            clock=time.monotonic,
            stop=stop,
            records=records,
            patience_s=_PATIENCE_S,
            on_start=begin,
            on_section=add,
        )


def _own_nominals(texts: Sequence[str]) -> list[dict[str, object]]:
    """Understand HEIGHT=FILE as ManyHeights spells it."""
    from cmmlink.plan import NominalAt

    own = []
    for text in texts:
        height, found, file = text.partition("=")
        if not found or not _NUMBER.fullmatch(height) or not file:
            raise PlanError(f"--nominal-at {text}: expected a height in mm and a file, like --nominal-at 80 tip.dat")
        own.append(NominalAt.model_validate({"height_mm": float(height), "file": file}).model_dump())
    return own


def _options_given(context: typer.Context) -> list[str]:
    """Names of the parameters that stand on the command line."""
    sources = {name: context.get_parameter_source(name) for name in context.params}
    return [name for name, source in sources.items() if source is not None and source.name == "COMMANDLINE"]


class _SectionBar:
    """A progress bar with the remaining time. One round goes once through all sections; several rounds can follow one another."""

    def __init__(self, console: "Console", visible: bool) -> None:
        from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

        words, count = TextColumn("{task.description}"), MofNCompleteColumn()
        columns = (words, BarColumn(bar_width=40), count, TextColumn("left"), TimeRemainingColumn())
        self._progress = Progress(*columns, console=console, transient=True, disable=not visible)

    @contextmanager
    def show(self) -> Iterator[None]:
        """Keep the bar on the screen. One that is not to be seen is not begun: older versions of rich end it with an empty line."""
        with nullcontext() if self._progress.disable else self._progress:
            yield
        for task in self._progress.task_ids:
            self._progress.remove_task(task)

    def begin_round(self, words: str, sections: int) -> Callable[[], None]:
        """Begin a round; call what it returns for each section done."""
        task = self._progress.add_task(words, total=sections)
        return lambda: self._progress.advance(task)


def _print_stack(console: "Console", stack: "StackOutcome") -> None:
    """Print a line for each section, what is to be said of them and of the whole, and last the verdict, which then stands on the screen."""
    from rich.markup import escape

    from cmmlink.report import STYLE_OF

    counts = stack.result_json()
    cutters = ", ".join(sorted({section.slice.cutter for section in stack.sections}))
    console.print(f"{stack.mesh.triangles} triangles ({stack.mesh.kind}), cut by {cutters}")
    console.print(
        f"{'height mm':>11}  {'verdict':11}  {'lowest':>7}  {'highest':>7}  {'rms':>6}  {'out':>5}  {'worst at':>8}  covered  aside"
    )
    for section in stack.sections:
        console.print(_line(section))
    _print_characteristics(console, stack)
    told = list(_grouped([(section.slice.asked_mm, text) for section in stack.sections for text in section.warnings]))
    for text in told[:_MOST_WARNINGS]:
        console.print(f"  {text}", style="yellow", markup=False)
    if len(told) > _MOST_WARNINGS:
        console.print(f"  and {len(told) - _MOST_WARNINGS} more warnings, all of them with --json", style="yellow")
    for note in dict.fromkeys(stack.notes):
        console.print(f"  note: {note}", markup=False)
    console.print(f"received {counts['received']} = judged {counts['judged']} + rejected {counts['rejected']}; lost {counts['lost']}")
    missing = "" if stack.complete else f" of {stack.asked}"
    headline = headline_of(stack.verdict, stack.ending, len(stack.sections) / stack.asked)
    console.print(
        f"[{STYLE_OF[headline.shape]}]{headline.words}[/]  {len(stack.sections)}{missing} sections of {escape(stack.mesh.source)}"
    )


def _grouped(told: Sequence[tuple[float, str]]) -> Iterator[str]:
    """What is said of sections, from pairs of height and sentence: each sentence once, with the heights that it is said of."""
    heights: dict[str, list[float]] = {}
    for height_mm, text in told:
        heights.setdefault(text, []).append(height_mm)
    for text, places in heights.items():
        shown = ", ".join(f"{place:g}" for place in places[:_MOST_HEIGHTS])
        more = f" and {len(places) - _MOST_HEIGHTS} more" if len(places) > _MOST_HEIGHTS else ""
        yield f"{'height' if len(places) == 1 else 'heights'} {shown}{more} mm: {text}"


def _print_characteristics(console: "Console", stack: "StackOutcome") -> None:
    """Print the characteristics of the stack: each with its reasons, and with its values from section to section."""
    from cmmlink.report import STYLES, print_characteristics

    if stack.characteristics:
        console.print("characteristics of the stack:")
    for one in stack.characteristics:
        print_characteristics(console, [one.found])
        for reason in one.found.reasons:
            console.print(f"      {reason.words}", style="yellow", markup=False)
        shown = sorted(sorted(one.sections, key=lambda share: -share.verdict)[:_MOST_SHARES], key=lambda share: share.height_mm)
        for share in shown:
            style, value = STYLES[share.verdict], "no value" if math.isnan(share.value) else f"{share.value:+.4f}"
            console.print(f"{share.height_mm:15.4f}  {value:>9}  [{style}]{VERDICT_WORDS[share.verdict]}[/]")
        if len(shown) < len(one.sections):
            console.print(f"      and {len(one.sections) - len(shown)} more sections, none of them worse; all of them in stack.csv")


def _line(section: "SectionOutcome") -> str:
    from cmmlink.report import STYLES

    result, cut = section.run.result, section.slice
    head = f"{cut.height_mm:11.4f}  [{STYLES[section.verdict]}]{VERDICT_WORDS[section.verdict]:11}[/]"
    if result is None or result.worst is None:
        return f"{head}  nothing judged"
    numbers = f"{result.min_deviation_mm:+7.4f}  {result.max_deviation_mm:+7.4f}  {result.rms_mm:6.4f}  {result.out_of_tolerance:5d}"
    return f"{head}  {numbers}  {result.station_mm[result.worst]:8.2f}  {result.coverage:7.1%}  {cut.set_aside:5d}"
