"""The picture of a drawing with several curves: each with the number that `curve` takes, its beginning, and what is loose about it."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from cmmlink.errors import PlanError
from cmmlink.nominal_files.drawing import DrawnCurve
from cmmlink.report.heading import draw_heading, fix_labels, save_picture, short_title

_COLOURS = ("#14608c", "#c2410c", "#1d6f42", "#6d28d9", "#a16207", "#b42318", "#0f766e", "#3a3f45")
_MOST_LISTED = 12


def write_curves_picture(curves: Sequence[DrawnCurve], title: str, path: Path) -> None:
    """Draw the curves of a drawing, seen along the axis in which they reach least, to a PNG file. Raises PlanError."""
    everything = np.vstack([curve.points for curve in curves])
    first, second = sorted(np.argsort(np.ptp(everything, axis=0), kind="stable")[1:].tolist())
    figure = Figure(figsize=(12, 8), dpi=110)
    listed = curves[:_MOST_LISTED]
    axes = figure.subplots(gridspec_kw={"left": 0.08, "right": 0.97, "top": 0.92, "bottom": 0.13 + 0.022 * len(listed)})
    fix_labels(axes)
    for curve in curves:
        colour = _COLOURS[(curve.number - 1) % len(_COLOURS)]
        x, y = curve.points[:, first], curve.points[:, second]
        axes.plot(x, y, color=colour, lw=1.4, ls="-" if curve.closed else (0, (6, 2)))
        axes.plot(x[0], y[0], "o", ms=5, color=colour)
        middle = len(x) // 2  # several may begin at one fork
        axes.annotate(
            str(curve.number), (x[middle], y[middle]), (5, 5), textcoords="offset points", color=colour, fontsize=12, fontweight="bold"
        )
        if curve.loose is not None:
            axes.plot(curve.loose[first], curve.loose[second], "o", ms=12, mfc="none", mec="#b42318", mew=1.5)
    axes.set_aspect("equal", adjustable="datalim")
    axes.margins(0.08)
    axes.set(xlabel=f"{'xyz'[first]} ({curves[0].unit})", ylabel=f"{'xyz'[second]} ({curves[0].unit})")
    told = [f"curve {curve.number}: {curve.words}" for curve in listed]
    more = [f"and {len(curves) - len(listed)} shorter ones"] if len(curves) > len(listed) else []
    figure.text(0.03, 0.015, "\n".join([*told, *more]), va="bottom", fontsize=8, family="monospace", parse_math=False)
    draw_heading(figure, short_title(f"{title}: {len(curves)} curves; dashed: open; red rings: gaps and forks"))
    try:
        save_picture(figure, path)
    except OSError as error:
        raise PlanError(f"{path}: cannot be written: {error.strerror or error}") from None
