"""What stands above a picture: the part as it is called, whatever signs its name holds, and the verdict."""

import warnings
from pathlib import Path
from typing import TYPE_CHECKING, BinaryIO

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_PACKED = 2  # of 9: a tenth larger than where they are packed harder, in two thirds of the time
_LONGEST_TITLE = 60  # signs that fit beside the longest verdict


def heading_of(title: str, verdict: str) -> str:
    """The heading of a picture: a title, and a verdict in words."""
    return f"{short_title(title)}    {verdict}"


def draw_heading(figure: "Figure", heading: str, size: float = 15) -> None:
    """Write the heading. A name is drawn as it is spelled: no sign in it means a formula."""
    figure.suptitle(heading, fontsize=size, fontweight="bold", parse_math=False)


def fix_labels(axes: "Axes", beside_pt: float = 57.0, below_pt: float = 20.0) -> None:
    """Keep the labels of both axes at fixed distances, which leave room for the numbers.

    Without it matplotlib lays out every number several times to find the distances.
    """
    from matplotlib.transforms import ScaledTranslation  # noqa: PLC0415 - who only words a heading needs no matplotlib

    figure = axes.figure
    beside, below = (ScaledTranslation(x / 72, y / 72, figure.dpi_scale_trans) for x, y in ((-beside_pt, 0), (0, -below_pt)))
    axes.yaxis.set_label_coords(0, 0.5, axes.transAxes + beside)
    axes.xaxis.set_label_coords(0.5, 0, axes.transAxes + below)


def short_title(title: str) -> str:
    """A title on one line that leaves room for the verdict; of a long one the beginning and the end are kept."""
    line = " ".join(title.split())
    if len(line) <= _LONGEST_TITLE:
        return line
    half = _LONGEST_TITLE // 2
    return f"{line[:half].rstrip()} ... {line[-half:].lstrip()}"


def save_picture(figure: "Figure", path: Path | BinaryIO) -> None:
    """Write the picture: a path as its name says, a file as PNG.

    A sign that the font does not have is drawn as a box, and is no reason for a warning.
    """
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="Glyph .* missing from font")
        if isinstance(path, Path) and path.suffix == ".svg":
            figure.savefig(path, metadata={"Date": None})
        else:
            figure.savefig(path, pil_kwargs={"compress_level": _PACKED})
