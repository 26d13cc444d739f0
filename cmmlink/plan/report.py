"""What a plan says of its report: for whom it is, on which paper, and in which language."""

from pathlib import Path

from pydantic import Field

from cmmlink.plan.papers import LanguageName, PaperName, SectionPages
from cmmlink.plan.yaml_model import Settings, Text

REPORT = "how the report looks: a mapping with company, logo, language, paper"


class ReportSettings(Settings):
    """How the report of a run looks."""

    company: Text | None = Field(default=None, description="the name of the company at the head of every page")
    logo: Path | None = Field(default=None, description="a picture, PNG or JPEG, that stands there in place of the name")
    language: LanguageName = Field(default="en", description="the language of the report: en or de")
    paper: PaperName = Field(default="a4", description="the size of its pages: a4 or letter")

    section_pages: SectionPages = Field(
        default="not-conform",
        description="of a stack, which sections have a page of their own: not-conform (of many the 30 worst), or all",
    )

    def with_path_from(self, folder: Path) -> "ReportSettings":
        """Give the same with the path of the logo absolute, seen from a folder."""
        return self.model_copy(update={"logo": folder / self.logo}) if self.logo is not None else self
