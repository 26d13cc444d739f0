"""The pictures of the sections of a stack, drawn by other processes while this one judges the sections that follow."""

from pathlib import Path
from typing import TYPE_CHECKING

from cmmlink.other_processes import processes_here
from cmmlink.report.judged_scan import scan_of
from cmmlink.report.picture_content import PictureContent, content_of
from cmmlink.report.picture_processes import Drawing, Pictures, drawn_by_none
from inspection import Verdict

if TYPE_CHECKING:
    from cmmlink.stack import SectionOutcome

_KINDS = (".png", ".svg")
_WORTH_A_PROCESS = 8  # pictures: it takes as long to load matplotlib


class SectionPictures:
    """Pictures of the sections of one stack, in the order of its sections."""

    def __init__(self, title: str, pictures: Pictures, every: bool = True) -> None:
        """`every` draws all sections; else those alone that do not conform, or of which that is not proven."""
        self._title, self._pictures, self._every = title, pictures, every
        self._begun: list[Drawing] = []
        self._asked = 0

    def wants(self, section: "SectionOutcome") -> bool:
        """Whether a section is drawn: points were judged, and it is not one of those left out."""
        return bool(section.run.result is not None and section.run.result.judged and (self._every or section.verdict != Verdict.CONFORM))

    def expect(self, sections: int) -> None:
        """Start the processes that are worth it for so many sections. How many of them do not conform shows later."""
        if self._every:
            self._pictures.start(min(processes_here(), sections // _WORTH_A_PROCESS))

    def begin(self, section: "SectionOutcome") -> None:
        """Let another process draw the next section, where there is one and a picture is wanted."""
        wanted = self.wants(section)
        self._asked += wanted
        if wanted and not self._every and self._asked == _WORTH_A_PROCESS:
            self._pictures.start(processes_here())
        content = self._content_of(section) if wanted else None
        self._begun.append(drawn_by_none() if content is None else self._pictures.begin(content, *_KINDS))

    def write(self, number: int, section: "SectionOutcome", png: Path, svg: Path) -> None:
        """Write the picture of a section, whose number in the stack counts from 1 and which is wanted, as PNG and SVG."""
        begun = self._begun[number - 1] if number <= len(self._begun) else drawn_by_none()
        self._pictures.write(begun, lambda: self._content_of(section), png, svg)

    def _content_of(self, section: "SectionOutcome") -> PictureContent:
        assert section.run.result is not None
        heading = f"{self._title}, height {section.slice.height_mm:g} mm"
        return content_of(scan_of(section.run.result), section.profile, heading, section.run.ending)
