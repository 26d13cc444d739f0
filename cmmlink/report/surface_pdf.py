"""The report of a run of a whole surface as a PDF: the same bytes for the same run, as that of a section."""

from pathlib import Path

from reportlab.platypus import Flowable

from cmmlink.report.pdf import build_pages
from cmmlink.report.pdf_fonts import register_fonts
from cmmlink.report.report_input import ReportInput
from cmmlink.report.speech import Speech
from cmmlink.report.surface_content import SurfaceContent
from cmmlink.report.surface_pages import surface_pages
from cmmlink.report.trend_pages import trend_pages


def write_surface_report(report: ReportInput, content: SurfaceContent | None, path: Path) -> None:
    """Write the report of a run. `content` is None where no point was judged. Raises as `write_report` does."""
    register_fonts()
    say = Speech(report.settings.language)

    def pages(width: float, height: float) -> list[Flowable]:
        return [*surface_pages(report, content, say, width, height), *trend_pages(report, say, width, height)]

    build_pages(path, report, say, pages)
