"""Languages and sizes of paper of reports, by the names that plans and options use."""

from typing import Literal

LanguageName = Literal["en", "de"]
PaperName = Literal["a4", "letter"]
