"""The report of a stack as a PDF: sections by characteristics, the map over height and station, a page for each that does not conform."""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure
from reportlab.platypus import Flowable, PageBreak, Spacer

from cmmlink.plan import CtPlan
from cmmlink.report.first_page import drawings, facts_table, identity_block, verdict_block
from cmmlink.report.further_pages import SHAPES, characteristics_part, qualification_words
from cmmlink.report.page_parts import NUMBER, SMALL, TITLE, Sign, grid, headed, text
from cmmlink.report.pdf import build_pages
from cmmlink.report.pdf_figure import DrawnFigure
from cmmlink.report.pdf_fonts import register_fonts
from cmmlink.report.profile_drawing import prepare_axes
from cmmlink.report.report_input import ReportInput
from cmmlink.report.speech import Speech
from cmmlink.report.stack_input import SectionSheet, StackInput
from cmmlink.report.stack_picture import draw_bar, draw_map
from cmmlink.words import Shape, VerdictName

_MOST_PAGES = 30  # of sections: a page takes a quarter of a second, and nobody reads hundreds
_MOST_COLUMNS = 10  # of characteristics in the matrix
_MAP_PT = 230.0


def write_stack_report(stack: StackInput, path: Path) -> None:
    """Write the report of a stack. Raises PlanError where its logo cannot be read, OSError where the file cannot be written."""
    register_fonts()
    say, whole = Speech(stack.plan.report.language), stack.whole()

    def pages(width: float, height: float) -> list[Flowable]:
        first = [
            verdict_block(whole, say, width),
            Spacer(1, 2),
            identity_block(whole, say, width),
            Spacer(1, 6),
            _map(stack, say, width),
            *_matrix(stack, say, width),
            Spacer(1, 6),
            *characteristics_part(whole, say, width),
            *_notes(stack, say, width),
        ]
        return [*first, *_section_pages(stack, say, width)]

    build_pages(path, whole, say, pages)


def _map(stack: StackInput, say: Speech, width: float) -> DrawnFigure:
    figure = Figure(figsize=(width / 72, _MAP_PT / 72), dpi=72)
    axes, beside = figure.add_axes((0.08, 0.13, 0.75, 0.82)), figure.add_axes((0.86, 0.13, 0.02, 0.82))
    prepare_axes(axes, say)
    figure.colorbar(draw_map(axes, [section.row for section in stack.sections], stack.zone, say), cax=beside, extend="both")
    draw_bar(beside, stack.zone, say)
    beside.tick_params(labelsize=6)
    beside.yaxis.label.set_fontsize(6)
    return DrawnFigure(figure)


def _matrix(stack: StackInput, say: Speech, width: float) -> Iterator[Flowable]:
    """A row for every section: its verdict, its worst point, and a sign for each of its characteristics."""
    named = _names(stack)
    shown = named[:_MOST_COLUMNS]
    yield text(say("Sections"), TITLE)
    names = ["No.", "Height (mm)", "Verdict", "Worst (mm)", "At station (mm)", "Zone error (mm)", "Coverage", "Run"]
    widths = [20.0, 46.0, 38.0, 50.0, 56.0, 68.0, 46.0]
    signs = min(34.0, 110.0 / len(shown)) if shown else 0.0
    widths += [width - sum(widths) - signs * len(shown), *[signs] * len(shown)]
    rows = [headed([*(say(name) for name in names), *(str(number) for number in range(1, len(shown) + 1))], (1, 3, 4, 5, 6))]
    rows += [[text(one.number), *_cells(one.document, say), *_signs(one.document, shown)] for one in stack.sections]
    yield grid(rows, widths)
    legend = "; ".join(f"{number}: {name}" for number, name in enumerate(shown, start=1))
    more = (
        say("{count} more characteristics stand in characteristics.csv", count=len(named) - len(shown)) if len(named) > len(shown) else ""
    )
    if legend:
        yield text("; ".join(filter(None, [legend, more])), SMALL)


def _names(stack: StackInput) -> list[str]:
    """The names of the characteristics of sections, in their order."""
    found = (one["name"] for section in stack.sections for one in section.document["characteristics"])
    return list(dict.fromkeys(found))


def _cells(found: Mapping[str, Any], say: Speech) -> Iterator[Any]:
    worst = found["worst"] or {"deviation_mm": None, "station_mm": None}
    yield text(say.number(found["height_mm"], ".3f"), NUMBER)
    yield Sign(shape_of(found), 8)
    yield text(say.number(worst["deviation_mm"], "+.4f"), NUMBER)
    yield text(say.number(worst["station_mm"], ".2f"), NUMBER)
    yield text(say.number(found["zone_error_mm"]), NUMBER)
    yield text(say.number(found["coverage"], ".1%"), NUMBER)
    yield text(found["run"] or "\u2013", SMALL)


def shape_of(found: Mapping[str, Any]) -> Shape:
    """The sign of a section; one that gave no result was not measured."""
    if found["rule"] is None:
        return "none"
    name: VerdictName = found["verdict"]
    return SHAPES[name]


def _signs(found: Mapping[str, Any], names: list[str]) -> Iterator[Any]:
    verdicts: dict[str, VerdictName] = {one["name"]: one["verdict"] for one in found["characteristics"]}
    for name in names:
        yield Sign(SHAPES[verdicts[name]], 8) if name in verdicts else ""


def _notes(stack: StackInput, say: Speech, width: float) -> Iterator[Flowable]:
    told = [(say("Assumed"), note) for note in stack.notes]
    if qualified := qualification_words(stack.document, say):
        told.append((say("Qualification"), qualified))
    if told:
        yield text(say("Conditions"), TITLE)
        yield grid([[text(name, SMALL), text(words)] for name, words in told], [110, width - 110], head=0)


def _section_pages(stack: StackInput, say: Speech, width: float) -> Iterator[Flowable]:
    """A page for each section that does not conform, of many the worst; for every section where the plan or the user wants them all."""
    every = stack.plan.report.section_pages == "all"
    chosen = [section for section in stack.sections if every or section.document["verdict"] != "conform"]
    shown = chosen if every else sorted(chosen, key=lambda section: -section.badness)[:_MOST_PAGES]
    if len(chosen) > len(shown):
        yield text(say("{count} more sections that do not conform have no page of their own", count=len(chosen) - len(shown)), SMALL)
    for section in sorted(shown, key=lambda one: one.number):
        yield PageBreak()
        yield from _section_page(section, stack.plan, say, width)


def _section_page(section: SectionSheet, plan: CtPlan, say: Speech, width: float) -> Iterator[Flowable]:
    document, content = section.document, section.draw()
    yield text(say("Section {number} at height {height} mm", number=section.number, height=say.number(document["height_mm"], ".3f")), TITLE)
    report = ReportInput(document, plan, section.message)
    yield verdict_block(report, say, width)
    yield facts_table(report, say, width)
    for note in document["notes"]:
        yield text(note, SMALL)
    if content is not None:
        yield from drawings(content, say, width, 430.0)
        yield from characteristics_part(report, say, width)
