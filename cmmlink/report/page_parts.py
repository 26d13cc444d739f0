"""What the pages of a report are put together from: paragraphs, tables, the sign of a verdict, the bar of a tolerance."""

from collections.abc import Sequence
from typing import Any
from xml.sax.saxutils import escape

from reportlab.lib.colors import Color, HexColor, white
from reportlab.lib.styles import ParagraphStyle
from reportlab.platypus import Flowable, Paragraph, Table, TableStyle

from cmmlink.report.pdf_fonts import BOLD, PLAIN
from cmmlink.words import Shape

INK, GREY, LINE, HEAD = HexColor("#1f2328"), HexColor("#5b626a"), HexColor("#c5cad0"), HexColor("#eef1f4")
COLOURS: dict[Shape, Color] = {
    "conform": HexColor("#1d6f42"),
    "not-proven": HexColor("#a16207"),
    "not-conform": HexColor("#b42318"),
    "ended-early": HexColor("#a16207"),
    "none": HexColor("#5b626a"),
}
LONGEST, LONGEST_NAME = 2000, 200  # signs of a text in one cell, and in a narrow one: more would not fit on a page


def _style(size: float, colour: Color = INK, bold: bool = False, **more: Any) -> ParagraphStyle:
    name = f"{size}{'b' if bold else ''}"
    font = BOLD if bold else PLAIN
    return ParagraphStyle(name, fontName=font, fontSize=size, leading=1.25 * size, textColor=colour, splitLongWords=1, **more)


BODY, BODY_BOLD, SMALL, SMALL_BOLD = _style(7.5), _style(7.5, bold=True), _style(6, GREY), _style(6, bold=True)
TITLE, NUMBER, NUMBER_BOLD, SMALL_NUMBER = (
    _style(10, bold=True, spaceBefore=8, spaceAfter=3, keepWithNext=1),
    _style(7.5, alignment=2),
    _style(7.5, bold=True, alignment=2),
    _style(6, GREY, alignment=2),
)


def text(told: object, style: ParagraphStyle = BODY, longest: int = LONGEST) -> Paragraph:
    """A paragraph of a text as it is spelled, whatever signs it holds; of one that is too long the beginning."""
    return Paragraph(_spelled(str(told), longest), style)


def headed(names: Sequence[str], numbers: Sequence[int]) -> list[Paragraph]:
    """The head of a table; the columns of `numbers` are set to the right."""
    return [text(name, SMALL_NUMBER if place in numbers else SMALL) for place, name in enumerate(names)]


def _spelled(told: str, longest: int) -> str:
    shortened = told if len(told) <= longest else f"{told[:longest]} ..."
    return escape("".join(sign if sign.isprintable() else " " for sign in shortened))


def grid(rows: Sequence[Sequence[Any]], widths: Sequence[float], head: int = 1, lines: Sequence[int] = ()) -> Table:
    """A table with thin lines between its rows; its head is repeated on every page.

    lines : rows with one cell, which is as wide as the table and belongs to the row above
    """
    style = [
        ("VALIGN", (0, 0), (-1, -1), "TOP"),
        ("LINEBELOW", (0, 0), (-1, -1), 0.3, LINE),
        ("LEFTPADDING", (0, 0), (-1, -1), 2.5),
        ("RIGHTPADDING", (0, 0), (-1, -1), 2.5),
        ("TOPPADDING", (0, 0), (-1, -1), 1.4),
        ("BOTTOMPADDING", (0, 0), (-1, -1), 1.8),
    ]
    if head:
        style += [("BACKGROUND", (0, 0), (-1, head - 1), HEAD), ("LINEABOVE", (0, 0), (-1, 0), 0.6, INK)]
    for row in lines:
        style += [("SPAN", (0, row), (-1, row)), ("LINEABOVE", (0, row), (-1, row), 0.4, white), ("NOSPLIT", (0, row - 1), (-1, row))]
    return Table(list(rows), colWidths=list(widths), repeatRows=head, style=TableStyle(style), hAlign="LEFT")


class Sign(Flowable):
    """The sign of a verdict: its form says it as well as its colour."""

    def __init__(self, shape: Shape, size: float) -> None:
        super().__init__()
        self._shape, self.width, self.height = shape, size, size

    def draw(self) -> None:
        """Draw it into its square."""
        draw_sign(self.canv, self._shape, 0, 0, self.width)


class SignAndWord(Flowable):
    """The sign of a verdict with its word beside it."""

    def __init__(self, shape: Shape, word: str) -> None:
        super().__init__()
        self._shape, self._word, self.width, self.height = shape, word, 72.0, 9.0

    def draw(self) -> None:
        """Draw both on one line; a long word is set smaller."""
        draw_sign(self.canv, self._shape, 0, 0.5, 8)
        size = min(6.5, 6.5 * 60 / self.canv.stringWidth(self._word, BOLD, 6.5))
        self.canv.setFillColor(INK)
        self.canv.setFont(BOLD, size)
        self.canv.drawString(11, 2.2, self._word)


def draw_sign(canvas: Any, shape: Shape, x: float, y: float, size: float) -> None:
    """Draw the sign of a verdict into a square: a round tick, a lozenge, a cross in an octagon, a hollow square, a bar."""
    canvas.saveState()
    canvas.translate(x, y)
    canvas.scale(size, size)
    canvas.setFillColor(COLOURS[shape])
    canvas.setStrokeColor(COLOURS[shape])
    canvas.setLineWidth(0.1)
    if shape == "conform":
        canvas.circle(0.5, 0.5, 0.48, stroke=0, fill=1)
        _line(canvas, [(0.26, 0.5), (0.44, 0.32), (0.75, 0.68)])
    elif shape == "not-conform":
        corners = [(0.29, 0.02), (0.71, 0.02), (0.98, 0.29), (0.98, 0.71), (0.71, 0.98), (0.29, 0.98), (0.02, 0.71), (0.02, 0.29)]
        _fill(canvas, corners)
        _line(canvas, [(0.3, 0.3), (0.7, 0.7)])
        _line(canvas, [(0.3, 0.7), (0.7, 0.3)])
    elif shape == "not-proven":
        _fill(canvas, [(0.5, 0.0), (1.0, 0.5), (0.5, 1.0), (0.0, 0.5)])
        _line(canvas, [(0.36, 0.5), (0.64, 0.5)])
    elif shape == "ended-early":
        canvas.rect(0.08, 0.08, 0.84, 0.84, stroke=1, fill=0)
    else:
        canvas.rect(0.08, 0.4, 0.84, 0.2, stroke=0, fill=1)
    canvas.restoreState()


def _fill(canvas: Any, corners: Sequence[tuple[float, float]]) -> None:
    path = canvas.beginPath()
    path.moveTo(*corners[0])
    for corner in corners[1:]:
        path.lineTo(*corner)
    path.close()
    canvas.drawPath(path, stroke=0, fill=1)


def _line(canvas: Any, corners: Sequence[tuple[float, float]]) -> None:
    canvas.setStrokeColor(white)
    canvas.setLineWidth(0.11)
    path = canvas.beginPath()
    path.moveTo(*corners[0])
    for corner in corners[1:]:
        path.lineTo(*corner)
    canvas.drawPath(path, stroke=1, fill=0)


class ToleranceBar(Flowable):
    """Where a deviation lies between its limits: the middle two thirds of the bar are the tolerance."""

    def __init__(self, share: float, shape: Shape, width: float) -> None:
        """`share` is 0 at the lower limit and 1 at the upper one."""
        super().__init__()
        self._share, self._shape, self.width, self.height = share, shape, width, 7.0

    def draw(self) -> None:
        """Draw the bar with its two limits, and the mark of the deviation; one far outside stands at the end."""
        canvas, third, middle = self.canv, self.width / 6, self.height / 2
        canvas.setStrokeColor(LINE)
        canvas.setLineWidth(0.5)
        canvas.line(0, middle, self.width, middle)
        canvas.setFillColor(HEAD)
        canvas.rect(third, middle - 1.5, 4 * third, 3, stroke=0, fill=1)
        canvas.setStrokeColor(INK)
        for limit in (third, 5 * third):
            canvas.line(limit, middle - 2.5, limit, middle + 2.5)
        place = min(max(third + 4 * third * self._share, 2.0), self.width - 2.0)
        draw_sign(canvas, self._shape, place - 2, middle - 2, 4)
