"""The characteristics of a stack beside its map: a panel for each with a value in every section, a line for each of the whole stack.

State is told by mark as well as by colour, as in the map.
"""

import math
from collections.abc import Sequence

from matplotlib.axes import Axes

from cmmlink.words import VERDICT_WORDS
from inspection import StackCharacteristicResult, Verdict

MOST_PANELS = 4
_MARKS = {Verdict.CONFORM: ("o", "#0f6b4f"), Verdict.UNCERTAIN: ("s", "#8a5a00"), Verdict.NONCONFORM: ("X", "#b3202a")}
_UNKNOWN = "x"


def along_height(found: Sequence[StackCharacteristicResult]) -> list[StackCharacteristicResult]:
    """Those with a value in every section; of many the worst come first, and a picture has room for few."""
    with_sections = [one for one in found if one.sections]
    kept = sorted(with_sections, key=lambda one: -one.found.verdict)[:MOST_PANELS]
    return [one for one in with_sections if one in kept]


def draw_panel(axes: Axes, one: StackCharacteristicResult) -> None:
    """The deviations of the sections from the nominal over their heights, with the limits."""
    known = [share for share in one.sections if math.isfinite(share.deviation)]
    axes.plot([share.deviation for share in known], [share.height_mm for share in known], "-", color="#7a828c", lw=0.8)
    for share in known:
        mark, colour = _MARKS[share.verdict]
        axes.plot(share.deviation, share.height_mm, mark, color=colour, ms=5)
    for share in one.sections:
        if not math.isfinite(share.deviation):
            axes.plot(0.02, share.height_mm, _UNKNOWN, color=_MARKS[Verdict.UNCERTAIN][1], ms=6, transform=axes.get_yaxis_transform())
    for limit in (one.found.lower, one.found.upper):
        if math.isfinite(limit):
            axes.axvline(limit, color="black", lw=1.0, ls="--")
    axes.axvline(0.0, color="#b9c0c7", lw=0.6)
    axes.margins(x=0.15)
    axes.set_xlabel(f"deviation ({one.found.unit})", parse_math=False)
    axes.set_title(f"{_short(one.found.name)}\n{VERDICT_WORDS[one.found.verdict]}", fontsize=10, parse_math=False)


def words_of(one: StackCharacteristicResult) -> str:
    """A characteristic of the whole stack in a line."""
    found = one.found
    unit = "" if found.unit == "1" else f" {found.unit}"
    value = "no value" if math.isnan(found.value) else f"{found.value:.5g}{unit} ({found.deviation:+.4g})"
    return f"{_short(found.name)}: {value}, {VERDICT_WORDS[found.verdict]}"


def _short(name: str) -> str:
    return name if len(name) <= 28 else f"{name[:25].rstrip()}..."
