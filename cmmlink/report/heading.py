"""What stands above a picture: the part as it is called, whatever signs its name holds, and the verdict."""

import warnings
from pathlib import Path

from matplotlib.figure import Figure

_LONGEST_TITLE = 60  # signs that fit beside the longest verdict


def heading_of(title: str, verdict: str) -> str:
    """The heading of a picture: a title, and a verdict in words."""
    return f"{short_title(title)}    {verdict}"


def draw_heading(figure: Figure, heading: str) -> None:
    """Write the heading. A name is drawn as it is spelled: no sign in it means a formula."""
    figure.suptitle(heading, fontsize=15, fontweight="bold", parse_math=False)


def short_title(title: str) -> str:
    """A title on one line that leaves room for the verdict; of a long one the beginning and the end are kept."""
    line = " ".join(title.split())
    if len(line) <= _LONGEST_TITLE:
        return line
    half = _LONGEST_TITLE // 2
    return f"{line[:half].rstrip()} ... {line[-half:].lstrip()}"


def save_picture(figure: Figure, path: Path) -> None:
    """Write the picture. A sign that the font does not have is drawn as a box, and is no reason for a warning."""
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="Glyph .* missing from font")
        figure.savefig(path)
