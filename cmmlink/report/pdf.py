"""The report of a run as a PDF: the same bytes for the same run, with its fonts in it, and without a clock or a path."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from reportlab import rl_config
from reportlab.lib.pagesizes import A4, LETTER
from reportlab.lib.units import mm
from reportlab.lib.utils import ImageReader
from reportlab.pdfbase.pdfmetrics import stringWidth
from reportlab.pdfgen.canvas import Canvas
from reportlab.platypus import BaseDocTemplate, Flowable, Frame, PageBreak, PageTemplate

from cmmlink.errors import PlanError
from cmmlink.report.first_page import first_page
from cmmlink.report.further_pages import characteristics_part, conditions_part, stretches_part
from cmmlink.report.page_parts import GREY, INK, LINE, draw_sign
from cmmlink.report.pdf_fonts import BOLD, PLAIN, register_fonts
from cmmlink.report.report_input import ReportInput
from cmmlink.report.speech import Speech
from cmmlink.report.trend_pages import trend_pages
from cmmlink.words import Headline

_PAPERS = {"a4": A4, "letter": LETTER}
_MARGIN, _HEAD, _FOOT = 13 * mm, 9 * mm, 6 * mm
_SIDE_WIDTH, _MIDDLE_WIDTH, _LOGO_HEIGHT = 55 * mm, 62 * mm, 9 * mm


def write_report(report: ReportInput, path: Path) -> None:
    """Write the report of a run. Raises PlanError where its logo cannot be read, OSError where the file cannot be written."""
    register_fonts()
    say = Speech(report.settings.language)
    build_pages(path, report, say, lambda width, height: [*_pages(report, say, width, height), *trend_pages(report, say, width, height)])


def build_pages(path: Path, report: ReportInput, say: Speech, pages: Callable[[float, float], Sequence[Flowable]]) -> None:
    """Write pages with their heads and feet; `pages` gives what stands on them for the width and the height of what is between."""
    rl_config.useA85 = 0  # pages as bytes: to spell them as text takes a third of the time, and a quarter more room
    paper = _PAPERS[report.settings.paper]
    width, height = paper[0] - 2 * _MARGIN, paper[1] - 2 * _MARGIN - _HEAD - _FOOT
    frame = Frame(_MARGIN, _MARGIN + _FOOT, width, height, 0, 0, 0, 0)
    edges = _Edges(report, say, paper)
    title = f"{report.title}: {say.sentence(report.headline.words)}"
    document = BaseDocTemplate(str(path), pagesize=paper, title=title, author=report.settings.company or "", creator="cmmlink", invariant=1)
    document.addPageTemplates([PageTemplate(frames=[frame], onPage=edges.draw)])
    document.build(list(pages(width, height)), canvasmaker=edges.canvas)


def _pages(report: ReportInput, say: Speech, width: float, height: float) -> list[Flowable]:
    content = report.content
    first = first_page(report, content, say, width, height)
    second = [*characteristics_part(report, say, width), *stretches_part(report, content, say, width)]
    return [*first, PageBreak(), *second, *conditions_part(report, say, width)]


class _Edges:
    """Head and foot of every page: for whom it is, what was measured, the verdict, the run, and page x of y."""

    def __init__(self, report: ReportInput, say: Speech, paper: tuple[float, float]) -> None:
        self._report, self._say, self._paper = report, say, paper
        self._logo = _read_logo(report.settings.logo)

    def draw(self, canvas: Canvas, _: object) -> None:
        """Draw all that does not depend on how many pages there are."""
        (width, height), report, headline = self._paper, self._report, self._report.headline
        base = height - _MARGIN - _HEAD + 10
        canvas.saveState()
        canvas.setStrokeColor(LINE)
        canvas.line(_MARGIN, base - 5, width - _MARGIN, base - 5)
        canvas.line(_MARGIN, _MARGIN + _FOOT - 4, width - _MARGIN, _MARGIN + _FOOT - 4)
        self._draw_owner(canvas, base)
        canvas.setFillColor(INK)
        canvas.setFont(BOLD, 8)
        canvas.drawCentredString(width / 2, base, fitted(report.title, _MIDDLE_WIDTH, BOLD, 8))
        self._draw_verdict(canvas, headline, width - _MARGIN, base)
        canvas.setFillColor(GREY)
        canvas.setFont(PLAIN, 6)
        canvas.drawString(_MARGIN, _MARGIN + _FOOT - 12, self._foot())
        canvas.restoreState()

    def _draw_owner(self, canvas: Canvas, base: float) -> None:
        if self._logo is not None:
            wide, high = self._logo.getSize()
            scale = min(_SIDE_WIDTH / wide, _LOGO_HEIGHT / high)
            canvas.drawImage(self._logo, _MARGIN, base - 2, wide * scale, high * scale, mask="auto")
            return
        canvas.setFillColor(INK)
        canvas.setFont(PLAIN, 8)
        canvas.drawString(_MARGIN, base, fitted(self._report.settings.company or self._say("Inspection report"), _SIDE_WIDTH, PLAIN, 8))

    def _draw_verdict(self, canvas: Canvas, headline: Headline, right: float, base: float) -> None:
        canvas.setFont(BOLD, 8)
        word = self._say.sentence(headline.words)
        canvas.drawRightString(right, base, word)
        draw_sign(canvas, headline.shape, right - canvas.stringWidth(word, BOLD, 8) - 13, base - 1.5, 9)

    def _foot(self) -> str:
        document = self._report.document
        run, chain = document.get("run") or document.get("replay_of"), document.get("chain_sha256")
        version = (document.get("software") or {}).get("cmmlink")
        parts = [f"cmmlink {version}" if version else "cmmlink", run and self._say("run {run}", run=run)]
        return "   ".join(filter(None, [*parts, chain and self._say("record {chain}", chain=chain)]))

    def canvas(self, *given: Any, **named: Any) -> "_NumberedCanvas":
        """A canvas that numbers its pages at the end, when it is known how many there are."""
        return _NumberedCanvas(self._number, *given, **named)

    def _number(self, canvas: Canvas, page: int, pages: int) -> None:
        canvas.setFillColor(GREY)
        canvas.setFont(PLAIN, 6)
        told = self._say("page {page} of {pages}", page=page, pages=pages)
        canvas.drawRightString(self._paper[0] - _MARGIN, _MARGIN + _FOOT - 12, told)


class _NumberedCanvas(Canvas):
    """Keeps every page until the last one is drawn, and then numbers them."""

    def __init__(self, number: Callable[[Canvas, int, int], None], *given: Any, **named: Any) -> None:
        super().__init__(*given, **named)
        self._number_page = number
        self._kept: list[dict[str, Any]] = []

    def showPage(self) -> None:  # noqa: N802 - the name that reportlab calls
        """Keep the page."""
        self._kept.append(dict(self.__dict__))
        self._startPage()

    def save(self) -> None:
        """Number the pages and write the file."""
        pages = self._kept
        for number, page in enumerate(pages, start=1):
            self.__dict__.update(page)
            self._number_page(self, number, len(pages))
            super().showPage()
        super().save()


def fitted(told: str, width: float, font: str, size: float) -> str:
    """A text on one line of a width; of one that is too long the beginning and the end."""
    line = " ".join(told.split())
    keep = len(line)
    while keep > 2 and stringWidth(shown := line if keep == len(line) else _ends(line, keep), font, size) > width:
        keep = min(keep - 1, int(keep * max(0.5, width / stringWidth(shown, font, size))))
    return line if keep == len(line) else _ends(line, keep)


def _ends(line: str, keep: int) -> str:
    return f"{line[: keep - keep // 2].rstrip()} ... {line[-(keep // 2) :].lstrip()}"


def _read_logo(path: Path | None) -> ImageReader | None:
    """Read the logo; None where there is none, or none any more. Raises PlanError where it is no picture."""
    if path is None or not path.is_file():
        return None
    try:
        return ImageReader(str(path))
    except OSError:
        raise PlanError(f"{path}: the logo of the report cannot be read; expected a PNG or JPEG picture") from None
