"""The fonts of reports: DejaVu Sans, which matplotlib ships with its licence, embedded in every file, so that it looks alike everywhere.

It has the letters of Latin, Greek, Cyrillic and more scripts. A sign that it does not have is drawn as a box.
"""

from pathlib import Path

import matplotlib as mpl
from reportlab.pdfbase import pdfmetrics
from reportlab.pdfbase.ttfonts import TTFont

PLAIN, BOLD = "DejaVuSans", "DejaVuSans-Bold"


def register_fonts() -> None:
    """Make the fonts known to reportlab, once for a process."""
    known = pdfmetrics.getRegisteredFontNames()
    for name in (PLAIN, BOLD):
        if name not in known:
            pdfmetrics.registerFont(TTFont(name, str(Path(mpl.get_data_path()) / "fonts" / "ttf" / f"{name}.ttf")))
    pdfmetrics.registerFontFamily(PLAIN, normal=PLAIN, bold=BOLD, italic=PLAIN, boldItalic=BOLD)
