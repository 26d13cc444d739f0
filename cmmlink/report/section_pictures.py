"""The pictures of the sections of a stack, drawn by other processes while this one judges the sections that follow."""

from pathlib import Path
from typing import TYPE_CHECKING

from cmmlink.other_processes import processes_here
from cmmlink.report.judged_scan import scan_of
from cmmlink.report.picture_content import PictureContent, content_of
from cmmlink.report.picture_processes import Drawing, Pictures, drawn_by_none

if TYPE_CHECKING:
    from cmmlink.stack import SectionOutcome

_KINDS = (".png", ".svg")
_WORTH_A_PROCESS = 8  # pictures: it takes as long to load matplotlib


class SectionPictures:
    """Pictures of the sections of one stack, in the order of its sections."""

    def __init__(self, title: str, pictures: Pictures) -> None:
        self._title, self._pictures = title, pictures
        self._begun: list[dict[str, Drawing]] = []

    def expect(self, sections: int) -> None:
        """Start the processes that are worth it for so many sections."""
        self._pictures.start(min(processes_here(), sections // _WORTH_A_PROCESS))

    def begin(self, section: "SectionOutcome") -> None:
        """Let another process draw the next section, where there is one and points were judged."""
        judged = section.run.result is not None and section.run.result.judged
        content = self._content_of(section) if judged else None
        self._begun.append({} if content is None else {suffix: self._pictures.begin(content, suffix) for suffix in _KINDS})

    def write(self, number: int, section: "SectionOutcome", *paths: Path) -> None:
        """Write the picture of a section, whose number in the stack counts from 1 and in which points were judged, as PNG and SVG."""
        begun = self._begun[number - 1] if number <= len(self._begun) else {}
        for path in paths:
            self._pictures.write(begun.get(path.suffix, drawn_by_none()), lambda: self._content_of(section), path)

    def _content_of(self, section: "SectionOutcome") -> PictureContent:
        assert section.run.result is not None
        heading = f"{self._title}, height {section.slice.height_mm:g} mm"
        return content_of(scan_of(section.run.result), section.profile, heading, section.run.ending)
