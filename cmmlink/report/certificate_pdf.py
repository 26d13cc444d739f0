"""The certificate of a qualification as a PDF: the error budget on its first page, what was qualified on the next."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from reportlab.lib.pagesizes import A4
from reportlab.lib.units import mm
from reportlab.pdfgen.canvas import Canvas
from reportlab.platypus import Flowable, PageBreak, SimpleDocTemplate, Spacer, Table, TableStyle

from cmmlink.report.first_page import moment_words
from cmmlink.report.page_parts import BODY, BODY_BOLD, COLOURS, GREY, NUMBER, SMALL, TITLE, Sign, grid, headed, text
from cmmlink.report.pdf_fonts import PLAIN, register_fonts
from cmmlink.words import Shape

_MARGIN = 14 * mm
_COVERS = (
    "This certificate covers the software on the computer that is named: that points with known deviations from known curves are judged as "
    "they must be, from a file and from a simulated device. It does not cover the machine, its probe, the nominal or the part."
)


def write_certificate(certificate: Mapping[str, Any], path: Path) -> None:
    """Write the certificate. Raises OSError where the file cannot be written."""
    register_fonts()
    width = A4[0] - 2 * _MARGIN
    passed = certificate["result"] == "passed"
    title = f"Qualification of cmmlink {certificate['software']['cmmlink']}: {certificate['result']}"
    document = SimpleDocTemplate(
        str(path), pagesize=A4, leftMargin=_MARGIN, rightMargin=_MARGIN, topMargin=_MARGIN, bottomMargin=_MARGIN + 4 * mm,
        title=title, author="", creator="cmmlink", invariant=1,
    )  # fmt: skip

    def draw_foot(canvas: Canvas, _: object) -> None:
        canvas.setFillColor(GREY)
        canvas.setFont(PLAIN, 6)
        canvas.drawString(_MARGIN, _MARGIN, f"certificate {certificate['certificate_sha256']}")
        canvas.drawRightString(A4[0] - _MARGIN, _MARGIN, f"page {canvas.getPageNumber()}")

    shape: Shape = "conform" if passed else "not-conform"
    head = [_heading(certificate, shape, width), Spacer(1, 8), _facts(certificate, width), text("Error budget", TITLE)]
    pages = [*head, _budget(certificate, width), *_remarks(certificate), PageBreak(), *_installation(certificate, width)]
    document.build(pages, onFirstPage=draw_foot, onLaterPages=draw_foot)


def _heading(certificate: Mapping[str, Any], shape: Shape, width: float) -> Table:
    word = text(certificate["result"].upper(), BODY_BOLD.clone("result", fontSize=19, leading=23, textColor=COLOURS[shape]))
    outside = f"Outside the limits: {', '.join(certificate['outside'])}." if certificate["outside"] else "Every error is inside its limit."
    told = [text("Qualification of an installation of cmmlink", BODY_BOLD.clone("name", fontSize=11, leading=14)), word, text(outside)]
    style = TableStyle([("VALIGN", (0, 0), (-1, -1), "TOP"), ("LEFTPADDING", (0, 0), (-1, -1), 0)])
    return Table([[Sign(shape, 40), told]], colWidths=[52, width - 52], style=style, hAlign="LEFT")


def _facts(certificate: Mapping[str, Any], width: float) -> Flowable:
    machine, judged, parts = certificate["machine"], certificate["set"], certificate["installation"]["parts"]
    rows = [
        ("Made at", moment_words(certificate["date"])),
        ("Computer", f"{machine['name']}: {machine['system']}, {machine['processors']} processors, {parts['processor']}"),
        ("Software", ", ".join(f"{name} {version}" for name, version in certificate["software"].items())),
        ("Python", parts["Python"]),
        ("Reference set", f"{judged['cases']} cases, SHA-256 {judged['sha256']}"),
        ("Installation", f"SHA-256 {certificate['installation']['sha256']}"),
        ("Wire to verdict", _wire_words(certificate["wire"])),
        ("What it covers", _COVERS),
    ]
    return grid([[text(name, SMALL), text(told)] for name, told in rows], [80, width - 80], head=0)


def _wire_words(wire: Mapping[str, Any]) -> str:
    latency = wire["latency_ms"]
    waited = f"; from arrival to verdict {latency['median']:.2g} ms, 99 % within {latency['p99']:.2g} ms (no limit)" if latency else ""
    return f"{wire['received']} of {wire['sent']} points of a simulated scanner at {wire['rate_hz']:g} points/s{waited}"


def _budget(certificate: Mapping[str, Any], width: float) -> Flowable:
    names = ("Kind", "What", "Values", "Largest", "Median", "Limit", "", "Reason of the limit")
    widths = [70, 116, 36, 42, 42, 54, 14, width - 374]
    rows = [
        [
            text(line["kind"], BODY_BOLD),
            text(line["quantity"]),
            *(text(told, NUMBER) for told in (line["values"], _error(line, "largest"), _error(line, "median"))),
            text(f"{line['limit']:g} {line['unit']}" if line["unit"] != "count" else f"{line['limit']:g}", NUMBER),
            Sign("conform" if line["inside"] else "not-conform", 8),
            text(line["reason"], SMALL),
        ]
        for line in certificate["budget"]
    ]
    return grid([headed(names, range(2, 6)), *rows], widths)


def _error(line: Mapping[str, Any], name: str) -> str:
    if line[name] is None:
        return "none"
    return f"{line[name]:.0f}" if line["unit"] == "count" else f"{line[name]:.1e}"


def _remarks(certificate: Mapping[str, Any]) -> list[Flowable]:
    if not certificate["problems"]:
        return []
    return [text("Problems", TITLE), *(text(problem, BODY) for problem in certificate["problems"])]


def _installation(certificate: Mapping[str, Any], width: float) -> list[Flowable]:
    rows = [[text(name, SMALL), text(told)] for name, told in certificate["installation"]["parts"].items()]
    told = (
        "Of each part its version, or the SHA-256 of the names and contents of its files. A change of any of them is another installation."
    )
    return [text("What was qualified", TITLE), text(told), Spacer(1, 4), grid(rows, [110, width - 110], head=0)]
