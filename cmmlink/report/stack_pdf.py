"""The report of a stack as a PDF: sections by characteristics, the map over height and station, a page for each that does not conform."""

import math
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure
from reportlab.platypus import Flowable, PageBreak, Spacer

from cmmlink.characteristics_json import characteristic_json
from cmmlink.plan import CtPlan
from cmmlink.report.first_page import drawings, facts_table, identity_block, verdict_block
from cmmlink.report.further_pages import SHAPES, characteristics_part
from cmmlink.report.judged_scan import scan_of
from cmmlink.report.page_parts import NUMBER, SMALL, TITLE, Sign, grid, headed, text
from cmmlink.report.pdf import build_pages
from cmmlink.report.pdf_figure import DrawnFigure
from cmmlink.report.pdf_fonts import register_fonts
from cmmlink.report.picture_content import content_of
from cmmlink.report.profile_drawing import prepare_axes
from cmmlink.report.report_input import ReportInput, regions_in
from cmmlink.report.speech import Speech
from cmmlink.report.stack_picture import draw_bar, draw_map
from cmmlink.stack import SectionOutcome, StackOutcome
from cmmlink.words import Shape, VerdictName
from inspection import ToleranceZone

_MOST_PAGES = 30  # of sections: a page takes a quarter of a second, and nobody reads hundreds
_MOST_COLUMNS = 10  # of characteristics in the matrix
_MAP_PT = 230.0


def write_stack_report(stack: StackOutcome, plan: CtPlan, zone: ToleranceZone, path: Path) -> None:
    """Write the report of a stack. Raises PlanError where its logo cannot be read, OSError where the file cannot be written."""
    register_fonts()
    say, whole = Speech(plan.report.language), _input_of(stack, plan)

    def pages(width: float, height: float) -> list[Flowable]:
        first = [
            verdict_block(whole, say, width),
            Spacer(1, 2),
            identity_block(whole, say, width),
            Spacer(1, 6),
            _map(stack, zone, say, width),
            *_matrix(stack, say, width),
            Spacer(1, 6),
            *characteristics_part(whole, say, width),
            *_notes(stack, say, width),
        ]
        return [*first, *_section_pages(stack, plan, say, width)]

    build_pages(path, whole, say, pages)


def _input_of(stack: StackOutcome, plan: CtPlan) -> ReportInput:
    """The stack as the head of its report takes it."""
    found = stack.result_json()
    said = {name: found[name] for name in ("verdict", "ending", "measured_at")}
    part = {"part": plan.part.name, "serial_number": plan.part.serial_number, "device": plan.mesh.file.name}
    share = len(stack.sections) / stack.asked
    reasons = [{"words": reason.words} for one in stack.characteristics for reason in one.found.reasons]
    out = [section for section in stack.sections if section.verdict.word != "conform"]
    if out:
        words = f"{len(out)} of {stack.asked} sections do not conform or are not proven."
        reasons.insert(0, {"words": words})
    ofstack = [characteristic_json(one.found) for one in stack.characteristics]
    runs = [section.evidence.run for section in stack.sections if section.evidence]
    part["run"] = " .. ".join(dict.fromkeys([runs[0], runs[-1]])) if runs else None
    software = next((dict(section.evidence.software) for section in stack.sections if section.evidence), None)
    document = {**said, **part, "coverage": share, "rule": "sections", "reasons": reasons, "characteristics": ofstack, "software": software}
    return ReportInput(document, plan)


def _map(stack: StackOutcome, zone: ToleranceZone, say: Speech, width: float) -> DrawnFigure:
    figure = Figure(figsize=(width / 72, _MAP_PT / 72), dpi=72)
    axes, beside = figure.add_axes((0.08, 0.13, 0.75, 0.82)), figure.add_axes((0.86, 0.13, 0.02, 0.82))
    prepare_axes(axes, say)
    figure.colorbar(draw_map(axes, stack, zone, say), cax=beside, extend="both")
    draw_bar(beside, zone, say)
    beside.tick_params(labelsize=6)
    beside.yaxis.label.set_fontsize(6)
    return DrawnFigure(figure)


def _matrix(stack: StackOutcome, say: Speech, width: float) -> Iterator[Flowable]:
    """A row for every section: its verdict, its worst point, and a sign for each of its characteristics."""
    named = _names(stack)
    shown = named[:_MOST_COLUMNS]
    yield text(say("Sections"), TITLE)
    names = ["No.", "Height (mm)", "Verdict", "Worst (mm)", "At station (mm)", "Zone error (mm)", "Coverage", "Run"]
    widths = [26.0, 50.0, 40.0, 52.0, 58.0, 58.0, 48.0]
    signs = min(34.0, 110.0 / len(shown)) if shown else 0.0
    widths += [width - sum(widths) - signs * len(shown), *[signs] * len(shown)]
    rows = [headed([*(say(name) for name in names), *(str(number) for number in range(1, len(shown) + 1))], (1, 3, 4, 5, 6))]
    for number, section in enumerate(stack.sections, start=1):
        found = section.result_json()
        rows.append([text(number), *_cells(found, say), *_signs(found, shown)])
    yield grid(rows, widths)
    legend = "; ".join(f"{number}: {name}" for number, name in enumerate(shown, start=1))
    more = (
        say("{count} more characteristics stand in characteristics.csv", count=len(named) - len(shown)) if len(named) > len(shown) else ""
    )
    if legend:
        yield text("; ".join(filter(None, [legend, more])), SMALL)


def _names(stack: StackOutcome) -> list[str]:
    """The names of the characteristics of sections, in their order."""
    found = (one.name for section in stack.sections if section.run.result for one in section.run.result.characteristics)
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


def _notes(stack: StackOutcome, say: Speech, width: float) -> Iterator[Flowable]:
    if stack.notes:
        yield text(say("Conditions"), TITLE)
        yield grid([[text(say("Assumed"), SMALL), text(note)] for note in stack.notes], [110, width - 110], head=0)


def _section_pages(stack: StackOutcome, plan: CtPlan, say: Speech, width: float) -> Iterator[Flowable]:
    """A page for each section that does not conform, the worst of them where there are many."""
    chosen = [(number, section) for number, section in enumerate(stack.sections, start=1) if section.verdict.word != "conform"]
    worst = sorted(chosen, key=lambda one: -_badness(one[1]))[:_MOST_PAGES]
    if len(chosen) > len(worst):
        yield text(say("{count} more sections that do not conform have no page of their own", count=len(chosen) - len(worst)), SMALL)
    for number, section in sorted(worst, key=lambda one: one[0]):
        yield PageBreak()
        yield from _section_page(number, section, plan, say, width)


def _badness(section: SectionOutcome) -> float:
    result = section.run.result
    return math.inf if result is None or not result.judged else result.zone_error_mm


def _section_page(number: int, section: SectionOutcome, plan: CtPlan, say: Speech, width: float) -> Iterator[Flowable]:
    document = section.result_json() | {"notes": list(section.warnings)}
    yield text(say("Section {number} at height {height} mm", number=number, height=say.number(document["height_mm"], ".3f")), TITLE)
    report = ReportInput(document, plan, str(section.run.refusal or ""))
    yield verdict_block(report, say, width)
    yield facts_table(report, say, width)
    for warning in section.warnings:
        yield text(warning, SMALL)
    result = section.run.result
    if result is not None and result.judged:
        content = content_of(scan_of(result), section.profile, "", section.run.ending, regions=regions_in(document))
        yield from drawings(content, say, width, 430.0)
        yield from characteristics_part(report, say, width)
