"""The report of a study of the measuring system as a PDF: of each characteristic figures and budget, then the spread along the profile."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from reportlab.graphics.shapes import Drawing, Group, Line, PolyLine, String
from reportlab.lib.colors import Color
from reportlab.lib.pagesizes import A4
from reportlab.lib.units import mm
from reportlab.pdfgen.canvas import Canvas
from reportlab.platypus import CondPageBreak, Flowable, SimpleDocTemplate, Spacer, Table

from cmmlink.plant import Study, StudyFinding, StudyFindings
from cmmlink.report.first_page import moment_words
from cmmlink.report.page_parts import BODY, BODY_BOLD, COLOURS, GREY, INK, LINE, NUMBER, SMALL, TITLE, grid, headed, text
from cmmlink.report.pdf_fonts import PLAIN, register_fonts
from cmmlink.report.study_text import along_words, figures, kind_words, limits_words, middles_mm, plan_words, result_words

_MARGIN = 14 * mm
_WHOLE = 150.0  # points of the page that a characteristic takes at least: it begins on a new one where less is left
_HEIGHT, _LEFT, _BELOW = 150.0, 44.0, 26.0  # of the drawing along the profile


def write_study(study: Study, found: StudyFindings, path: Path) -> None:
    """Write the report of a study. Raises OSError where the file cannot be written."""
    register_fonts()
    width = A4[0] - 2 * _MARGIN
    document = SimpleDocTemplate(
        str(path), pagesize=A4, leftMargin=_MARGIN, rightMargin=_MARGIN, topMargin=_MARGIN, bottomMargin=_MARGIN + 4 * mm,
        title=f"Study {study.name}", author="", creator="cmmlink", invariant=1,
    )  # fmt: skip

    def draw_foot(canvas: Canvas, _: object) -> None:
        canvas.setFillColor(GREY)
        canvas.setFont(PLAIN, 6)
        canvas.drawRightString(A4[0] - _MARGIN, _MARGIN, f"page {canvas.getPageNumber()}")

    parts: list[Flowable] = [text(f"Study of the measuring system: {study.name}", TITLE.clone("head", fontSize=14, leading=18))]
    parts += [text(f"{kind_words(study, found)[0].upper()}{kind_words(study, found)[1:]}."), _facts(study, found, width)]
    for one in found.findings:
        parts += [CondPageBreak(_WHOLE), *_characteristic(study, one, width)]
    parts += [CondPageBreak(_HEIGHT + 60), text("Along the profile", TITLE), *(text(line) for line in along_words(study, found))]
    parts += [Spacer(1, 4), _spread_along(study, found, width), *_runs(study, width)]
    document.build(parts, onFirstPage=draw_foot, onLaterPages=draw_foot)


def _facts(study: Study, found: StudyFindings, width: float) -> Flowable:
    moments = sorted(run.measured_at for run in study.runs)
    rows = [("Measured", f"{moment_words(moments[0])} to {moment_words(moments[-1])}"), ("Parts", ", ".join(found.parts))]
    rows += [("Operators", ", ".join(filter(None, found.operators)))] if any(found.operators) else []
    rows += [("Left out", note) for note in found.notes]
    return grid([[text(name, SMALL), text(told)] for name, told in rows], [80, width - 80], head=0)


def _characteristic(study: Study, one: StudyFinding, width: float) -> Iterator[Flowable]:
    asked = one.characteristic
    yield text(f"{asked.name}: {asked.type}, {limits_words(asked)}", TITLE)
    yield from (text(line, BODY_BOLD if place == 0 else BODY) for place, line in enumerate(figures(one)))
    if one.crossed is not None:
        yield Spacer(1, 3)
        yield _anova(one, width)
    yield Spacer(1, 3)
    yield _budget(one, width)
    yield text(f"{result_words(one)}.", BODY_BOLD)
    yield text(f"With this characteristic in a plan: {plan_words(study, one)}", SMALL)
    yield from (text(note, SMALL) for note in one.notes)


def _anova(one: StudyFinding, width: float) -> Table:
    assert one.crossed is not None
    names = ("Analysis of variance", "df", "Sum of squares", "Mean square", "F", "Level")
    widths = [width - 350, 40, 90, 90, 65, 65]
    rows = []
    for line in one.crossed.anova:
        tested = ["" if value is None else f"{value:.4g}" for value in (line.f, line.level)]
        told = (str(line.freedom), f"{line.sum_of_squares:.5g}", f"{line.mean_square:.5g}", *tested)
        rows.append([text(line.source), *(text(number, NUMBER) for number in told)])
    return grid([headed(names, range(1, 6)), *rows], widths)


def _budget(one: StudyFinding, width: float) -> Table:
    names = ("Source of uncertainty", "Type", f"u ({one.characteristic.unit})", "df", "Share of u\N{SUPERSCRIPT TWO}")
    rows = [
        [
            text(line.source),
            text(line.evaluated),
            *(text(told, NUMBER) for told in (f"{line.standard:.6f}", _freedom(line.freedom), f"{line.share:.1%}")),
        ]
        for line in one.budget.sources
    ]
    return grid([headed(names, range(2, 5)), *rows], [width - 250, 40, 90, 50, 70])


def _freedom(freedom: int | None) -> str:
    return "\N{INFINITY}" if freedom is None else str(freedom)


def _runs(study: Study, width: float) -> Iterator[Flowable]:
    yield text("Runs", TITLE)
    rows = [[text(told, SMALL) for told in (run.run, run.part, run.operator, run.measured_at, run.chain_sha256)] for run in study.runs]
    yield grid([headed(("Run", "Part", "Operator", "Measured at", "Hash of its record"), ()), *rows], [100, 60, 60, 80, width - 300])


def _spread_along(study: Study, found: StudyFindings, width: float) -> Drawing:
    """The standard deviations of gauge, repeatability and part in the even parts of the profile."""
    along, drawing = found.along, Drawing(width, _HEIGHT)
    curves = [("gauge R&R" if study.kind == "crossed" else "repeatability", along.gauge, COLOURS["not-conform"])]
    curves += [("repeatability alone", along.repeatability, COLOURS["conform"])] if study.kind == "crossed" else []
    highest = max(float(np.nanmax(values, initial=0.0)) for _, values, _ in curves) or 1e-6
    across, up = (width - _LEFT - 8) / study.length_mm, (_HEIGHT - _BELOW - 22) / highest
    frame = Group(
        Line(_LEFT, _BELOW, width - 8, _BELOW, strokeColor=INK, strokeWidth=0.5),
        Line(_LEFT, _BELOW, _LEFT, _HEIGHT - 18, strokeColor=INK, strokeWidth=0.5),
    )
    for share in (0.0, 0.5, 1.0):
        y = _BELOW + share * highest * up
        frame.add(Line(_LEFT, y, width - 8, y, strokeColor=LINE, strokeWidth=0.3))
        frame.add(String(_LEFT - 3, y - 2, f"{1000 * share * highest:.3g}", fontName=PLAIN, fontSize=6, textAnchor="end", fillColor=GREY))
        x = _LEFT + share * study.length_mm * across
        frame.add(String(x, _BELOW - 9, f"{share * study.length_mm:.1f}", fontName=PLAIN, fontSize=6, textAnchor="middle", fillColor=GREY))
    frame.add(String(_LEFT, 6, "station along the profile, mm", fontName=PLAIN, fontSize=6, fillColor=GREY))
    frame.add(String(2, _HEIGHT - 8, "standard deviation, \N{MICRO SIGN}m", fontName=PLAIN, fontSize=6, fillColor=GREY))
    drawing.add(frame)
    for place, (name, values, colour) in enumerate(curves):
        drawing.add(String(_LEFT + 110 + 110 * place, _HEIGHT - 8, f"\N{EM DASH} {name}", fontName=PLAIN, fontSize=6.5, fillColor=colour))
        for line in _lines(middles_mm(study, len(values)), values, across, up, colour):
            drawing.add(line)
    return drawing


def _lines(where: NDArray[np.float64], values: NDArray[np.float64], across: float, up: float, colour: Color) -> Iterator[PolyLine]:
    """The curve of values (s,), broken where one is not known."""
    known = np.isfinite(values)
    for run in np.split(np.arange(len(values)), np.flatnonzero(np.diff(known.astype(int))) + 1):
        if len(run) and known[run[0]]:
            places = [number for k in run for number in (_LEFT + where[k] * across, _BELOW + values[k] * up)]
            yield PolyLine([float(number) for number in places], strokeColor=colour, strokeWidth=1.0)
