"""Languages, sizes of paper and choices of pages of reports, by the names that plans and options use."""

from typing import Literal

LanguageName = Literal["en", "de"]
PaperName = Literal["a4", "letter"]
SectionPages = Literal["not-conform", "all"]
