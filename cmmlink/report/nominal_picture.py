"""The picture of a nominal as it was understood: its shape, where it starts, which way it runs, its corners, and what was assumed."""

import textwrap
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from cmmlink.errors import PlanError
from cmmlink.nominal_files import NominalFile, material_side
from cmmlink.report.heading import draw_heading, fix_labels, save_picture, short_title
from inspection import NurbsCurve

Array = NDArray[np.float64]

_LINE, _INSIDE, _START, _CORNER = "#3a3f45", "#eef2f6", "#2a7fa5", "#c2410c"
_ARROWS = 8
_A_STEP = 2e-3  # of the length: how far the tip of an arrow lies from its foot
_LETTERS, _LINE_OF_TEXT = 128, 0.021  # of a line of notes, beside which the legend stands, and its share of the height
_FEWEST_LINES, _MOST_LINES = 4, 14  # the legend needs as many as the fewest
_SAMPLES_OF_A_SPAN = 24
_MOST_SAMPLES = 100_000


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
    size = np.ptp(_points(curve), axis=0)
    layers = f", layer {' and '.join(file.layers)}" if file.layers else ""
    ends = "closed" if curve.closed else "open"
    return (
        f"{file.source_format}{layers}: {ends}, length {curve.length_mm:.4f} mm, {size[0]:.3f} x {size[1]:.3f} mm, degree {curve.degree}, "
        f"{len(curve.corners)} corner{'' if len(curve.corners) == 1 else 's'}"
    )


def _points(curve: NurbsCurve) -> Array:
    """Points (m, 2) of the curve, dense enough in every span of its knots to be drawn."""
    spans = np.unique(np.clip(curve.knots, *curve.domain))
    each = max(2, min(_SAMPLES_OF_A_SPAN, _MOST_SAMPLES // len(spans)))
    inside = (spans[:-1, None] + np.diff(spans)[:, None] * np.linspace(0, 1, each, endpoint=False)).ravel()
    return curve.point(np.append(inside, spans[-1]))


def _draw_curve(axes: Axes, curve: NurbsCurve) -> None:
    points = _points(curve)
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
    for foot, tip in zip(*_arrows(curve), strict=True):
        axes.annotate("", tip, foot, arrowprops={"arrowstyle": "-|>", "color": _START, "mutation_scale": 18})
    axes.figure.legend(loc="lower right", fontsize=9, bbox_to_anchor=(0.985, 0.01))  # beside the notes, never over the curve


def _arrows(curve: NurbsCurve) -> tuple[Array, Array]:
    """Feet and tips (a, 2) of short arrows, evenly along the curve."""
    u = np.linspace(*curve.domain, 4001)
    stations = curve.station_mm(u)
    stations[-1] = curve.length_mm  # of a closed curve the last parameter is the first
    wanted = curve.length_mm * (np.arange(_ARROWS) + 0.5) / _ARROWS
    step = _A_STEP * curve.length_mm
    feet, tips = (curve.point(np.interp(wanted + shift, stations, u)) for shift in (-step, step))
    return feet, tips
