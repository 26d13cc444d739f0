"""The last pages of a report where trends are asked for: one a characteristic, drawn as `plant trends` draws it, up to the run."""

from typing import TYPE_CHECKING

from reportlab.platypus import Flowable, PageBreak

from cmmlink import plant  # whose statistics are loaded when they serve
from cmmlink.report.page_parts import SMALL, TITLE, text
from cmmlink.report.pdf_figure import DrawnFigure
from cmmlink.report.report_input import ReportInput
from cmmlink.report.speech import Speech

if TYPE_CHECKING:
    from cmmlink.run_trends import RunTrend

_HEAD_PT = 34.0  # of the page: its title and the line below it


def trend_pages(report: ReportInput, say: Speech, width: float, height: float) -> list[Flowable]:
    """A page for each trend; nothing where none was asked for. What was pushed after the run has no part in it."""
    parts: list[Flowable] = []
    if report.trends:
        from cmmlink.report.trend_picture import trend_figure  # noqa: PLC0415 - it loads the statistics, which few reports need
    for one in report.trends:
        found = one.found
        title = say("Trend: {name}, the {count} runs up to this one", name=found.series.name, count=len(found.series.run))
        told = _words_of(one, say)
        figure = trend_figure(found, say, (width / 72, (height - _HEAD_PT) / 72), 72)
        parts += [PageBreak(), text(title, TITLE.clone("trend", spaceBefore=0)), text(told, SMALL), DrawnFigure(figure)]
    return parts


def _words_of(one: "RunTrend", say: Speech) -> str:
    """Which rules the run breaks."""
    if one.broken is None:
        fewest = plant.FEWEST_BEFORE_ALARM
        return say("This run is held against no rule: it has no value, or fewer than {fewest} before it.", fewest=fewest)
    broken = "; ".join(say.sentence(words) for words in one.broken)
    return say("This run: {broken}", broken=broken) if broken else say("This run breaks no rule of Western Electric.")
