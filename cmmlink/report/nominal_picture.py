"""The picture of a nominal as it was understood: its shape, where it starts, which way it runs, its corners, and what was assumed."""

import textwrap
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from cmmlink.errors import PlanError
from cmmlink.nominal_files import NominalFile, material_side
from cmmlink.report.curve_course import arrows_along, points_along
from cmmlink.report.heading import draw_heading, fix_labels, save_picture, short_title
from inspection import NurbsCurve

Array = NDArray[np.float64]

_LINE, _INSIDE, _START, _CORNER = "#3a3f45", "#eef2f6", "#2a7fa5", "#c2410c"
_LETTERS, _LINE_OF_TEXT = 128, 0.021  # of a line of notes, beside which the legend stands, and its share of the height
_FEWEST_LINES, _MOST_LINES = 4, 14  # the legend needs as many as the fewest


def write_nominal_picture(file: NominalFile, title: str, path: Path) -> None:
    """Draw a nominal to a PNG file. Raises PlanError where it cannot be written."""
    lines = [line for note in file.notes for line in textwrap.wrap(f"- {note}", _LETTERS, subsequent_indent="  ")]
    if len(lines) > _MOST_LINES:
        lines = [*lines[: _MOST_LINES - 1], f"... and {len(lines) - _MOST_LINES + 1} more lines, which cmmlink nominal prints"]
    height = _LINE_OF_TEXT * max(len(lines), _FEWEST_LINES)
    figure = Figure(figsize=(12, 8), dpi=110)
    axes = figure.subplots(gridspec_kw={"left": 0.09, "right": 0.97, "top": 0.87, "bottom": 0.11 + height})
    fix_labels(axes)
    _draw_curve(axes, file.curve)
    _draw_marks(axes, file.curve)
    axes.set_title(_facts(file), fontsize=10)
    draw_heading(figure, short_title(title))
    figure.text(0.03, 0.015, "\n".join(lines), va="bottom", fontsize=8, family="monospace", parse_math=False)
    try:
        save_picture(figure, path)
    except OSError as error:
        raise PlanError(f"{path}: cannot be written: {error.strerror or error}") from None


def _facts(file: NominalFile) -> str:
    """What a reader compares with the drawing: open or closed, length, size, degree, corners, layers."""
    curve = file.curve
    size = np.ptp(points_along(curve), axis=0)
    layers = f", layer {' and '.join(file.layers)}" if file.layers else ""
    ends = "closed" if curve.closed else "open"
    return (
        f"{file.source_format}{layers}: {ends}, length {curve.length_mm:.4f} mm, {size[0]:.3f} x {size[1]:.3f} mm, degree {curve.degree}, "
        f"{len(curve.corners)} corner{'' if len(curve.corners) == 1 else 's'}"
    )


def _draw_curve(axes: Axes, curve: NurbsCurve) -> None:
    points = points_along(curve)
    if material_side(curve) is not None:
        axes.fill(*points.T, color=_INSIDE, lw=0)
    axes.plot(*points.T, color=_LINE, lw=1.2)
    axes.set_aspect("equal")
    axes.margins(0.08)
    axes.set(xlabel="x (mm)", ylabel="y (mm)")


def _draw_marks(axes: Axes, curve: NurbsCurve) -> None:
    """The start, the end of an open curve, the corners, and arrows along the direction of travel."""
    start, end = np.round(curve.point(np.array(curve.domain)), 9) + 0.0  # no -0
    corners = curve.point(curve.corners)
    if len(corners):
        axes.plot(
            *corners.T,
            "s",
            ms=9,
            mfc="none",
            mec=_CORNER,
            mew=1.4,
            zorder=4,
            label=f"{len(corners)} corner{'' if len(corners) == 1 else 's'}",
        )
    axes.plot(*start, "o", ms=7, color=_START, label=f"start ({start[0]:.4f}, {start[1]:.4f})")
    if not curve.closed:
        axes.plot(*end, "X", ms=9, color=_START, label=f"end ({end[0]:.4f}, {end[1]:.4f})")
    for foot, tip in zip(*arrows_along(curve), strict=True):
        axes.annotate("", tip, foot, arrowprops={"arrowstyle": "-|>", "color": _START, "mutation_scale": 18})
    axes.figure.legend(loc="lower right", fontsize=9, bbox_to_anchor=(0.985, 0.01))  # beside the notes, never over the curve
