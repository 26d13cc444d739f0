"""The unit of length that a text states in words: in a remark, a header line, the names of its columns, or a row below them.

A text that states nothing is in millimetres. What it states is read here and nowhere else; what is done about it, its reader decides.
"""

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Literal

UnitName = Literal["mm", "um", "inch"]
MM_PER_UNIT = {"mm": 1.0, "um": 0.001, "inch": 25.4, "cm": 10.0, "m": 1000.0, "thou": 0.0254, "ft": 304.8}

_WORDS = {
    "mm": ("mm", "millimeters", "millimeter", "millimetres", "millimetre"),
    "um": ("\u00b5m", "\u03bcm", "um", "microns", "micron", "micrometers", "micrometer", "micrometres", "micrometre"),
    "inch": ("inches", "inch", "in", "zoll"),
    "cm": ("cm", "centimeters", "centimeter", "centimetres", "centimetre"),
    "m": ("meters", "meter", "metres", "metre", "m"),
    "thou": ("thou", "mils", "mil"),
    "ft": ("feet", "foot", "ft"),
}
_UNIT_OF = {word: unit for unit, words in _WORDS.items() for word in words} | {"metric": "mm", "imperial": "inch"}
_ANY = "|".join(sorted((word for words in _WORDS.values() for word in words), key=len, reverse=True))
_PLAIN = "|".join(word for word in sorted(_UNIT_OF, key=len, reverse=True) if word not in ("in", "m", "mil", "foot", "metric", "imperial"))
_START, _END = r"(?<![a-z\u00b5\u03bc])", r"(?![a-z])"
_SENTENCES = tuple(
    re.compile(pattern, re.IGNORECASE)
    for pattern in (
        # Units: inch; unit of length = mm; dimensions are in inches. `in` and `m` mean a unit only at the end of the line.
        rf"\b(?:units?|dimensions?|coordinates?|einheit(?:en)?)\b[^a-z\u00b5\u03bc]*(?:(?:of|is|are|in|all|length|given|system)\b[^a-z\u00b5\u03bc]*)*"
        rf"{_START}({_PLAIN}|metric|imperial){_END}",
        r"\b(?:units?|einheit(?:en)?)\b\W*(in|m)\W*$",
        rf"(?:{_START}in\s+|[\[(]\s*){_START}({_PLAIN}){_END}",
        rf"^\W*({_PLAIN}|metric|imperial)\W*$",
    )
)
_AXIS_NAME = re.compile(rf"([xyz])(?![a-z0-9])(?:.*?{_START}({_ANY})[\])]?$)?", re.IGNORECASE)
_MEASURED = re.compile(r"(?:^|(?<=[\s_.-]))(?:actual|act|ist|measured|meas)(?=$|[\s_.\[(-])[\s_.-]*", re.IGNORECASE)
_VECTOR_FILE = re.compile(r"XYZIJK(?P<metric>\s*[,;]?\s*METRIC)?\b", re.IGNORECASE)


@dataclass(frozen=True, slots=True)
class StatedUnit:
    """A unit that a text states: where, as which word, and how many mm it is."""

    place: str
    word: str
    unit: str

    @property
    def mm(self) -> float:
        """How many mm the unit is."""
        return MM_PER_UNIT[self.unit]


def mm_per(unit: UnitName) -> float:
    """Return how many mm a unit is."""
    return MM_PER_UNIT[unit]


def axis_letters(names: Sequence[str]) -> list[str]:
    """Return which axis each name of a column is: x, y, z, or nothing.

    Where columns are called actual, measured or ist, like `X Actual` beside `X Nominal`, those alone are axes.
    """
    axes = [_AXIS_NAME.match(name) for name in _measured_ones(names)]
    return [axis[1].lower() if axis else "" for axis in axes]


def _measured_ones(names: Sequence[str]) -> list[str]:
    """The names without the word for measured, and nothing in place of the others, where such a word stands beside an axis."""
    plain = [_MEASURED.sub("", name).rstrip(" _.-") if _MEASURED.search(name) else "" for name in names]
    return plain if any(map(_AXIS_NAME.match, plain)) else list(names)


def units_of_names(names: Sequence[str]) -> list[StatedUnit]:
    """Units that the names of columns give to coordinates: x_mm, Y [inch]."""
    axes = [axis for axis in map(_AXIS_NAME.match, _measured_ones(names)) if axis and axis[2]]
    return [StatedUnit(f"the header gives {axis[1]} in", axis[2], _UNIT_OF[axis[2].lower()]) for axis in axes]


def units_of_row(number: int, fields: Sequence[str], axes: Sequence[str]) -> list[StatedUnit]:
    """Units of a row like `mm,mm,mm`; where the axes (c,) of the columns are known, those of the coordinates."""
    words = [field.strip(" \t[]()\"'").lower() for field in fields]
    known = len(axes) == len(words) and any(axes)
    told = [word for word, axis in zip(words, axes, strict=True) if axis] if known else [word for word in words if word not in ("", "-")]
    if len(words) < 2 or not told or any(word not in _UNIT_OF for word in told):
        return []
    return [StatedUnit(f"line {number} gives the unit", word, _UNIT_OF[word]) for word in dict.fromkeys(told)]


def units_of_lines(lines: Iterable[tuple[int, str]]) -> list[StatedUnit]:
    """Units that remarks and header lines state. A first word XYZIJK without METRIC means inch: so PC-DMIS defines its files."""
    stated = []
    for number, line in lines:
        vectors = _VECTOR_FILE.match(line)
        if vectors:
            word, unit = ("METRIC", "mm") if vectors["metric"] else ("XYZIJK without METRIC, which means inch", "inch")
            stated.append(StatedUnit(f"line {number} states", word, unit))
            continue
        found = next(filter(None, (sentence.search(line) for sentence in _SENTENCES)), None)
        if found:
            stated.append(StatedUnit(f"line {number} states", found[1], _UNIT_OF[found[1].lower()]))
    return stated
