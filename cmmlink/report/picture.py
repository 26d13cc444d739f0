"""The picture of a judged profile for the folder of results: the drawings of the report's first page, as PNG and as SVG."""

import pathlib
from typing import TYPE_CHECKING

import matplotlib as mpl
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from cmmlink.report.heading import draw_heading, save_picture
from cmmlink.report.picture_content import PictureContent
from cmmlink.report.profile_drawing import draw_contour, draw_strip, prepare_axes, wipe
from cmmlink.report.speech import Speech

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# Everything has its place beforehand: to find places for labels of unknown size takes longer than to draw the picture.
_PLACES = {"height_ratios": (3, 2), "left": 0.09, "right": 0.9, "bottom": 0.065, "top": 0.92, "hspace": 0.3}
_INCHES, _DOTS_PER_INCH = (7.1, 6.2), 200  # as wide as a printed page allows


class ProfilePictures:
    """Draws pictures one after the other on one figure, whose axes with their numbers are made once: they take as long as the rest."""

    def __init__(self, say: Speech | None = None) -> None:
        self._say = say or Speech()
        self._figure = Figure(figsize=_INCHES, dpi=_DOTS_PER_INCH)
        FigureCanvasAgg(self._figure)  # stays with the figure, with the sizes of all that was written on it before
        self._profile, self._strip = self._figure.subplots(2, 1, gridspec_kw=_PLACES)
        self._foot = self._figure.text(0.99, 0.005, "", ha="right", va="bottom", fontsize=5.5, parse_math=False)
        for axes in (self._profile, self._strip):
            prepare_axes(axes, self._say)

    def draw(self, content: PictureContent) -> Figure:
        """Draw the profile and the strip of deviations. The figure is the one that the next picture is drawn on as well."""
        axes: Axes
        for axes, draw in ((self._profile, draw_contour), (self._strip, draw_strip)):
            wipe(axes)
            draw(axes, content, self._say)
        draw_heading(self._figure, content.heading, size=10)
        self._foot.set_text(content.foot)
        return self._figure

    def write(self, content: PictureContent, *paths: pathlib.Path) -> None:
        """Draw the profile and the strip of deviations to files, PNG or SVG by their names."""
        self.draw(content)
        with mpl.rc_context({"svg.hashsalt": "cmmlink"}):  # the names inside an SVG are the same each time
            for path in paths:
                save_picture(self._figure, path)
