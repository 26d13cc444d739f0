"""What the station answers to the posts of a new plan, as JSON: what it understands of a nominal, and what came of the plan.

`declarations.py` writes its types for the page's scripts beside those of the protocol.
"""

from dataclasses import dataclass
from typing import Literal

Asked = Literal["unit", "chord", "curve", "ends", "side"]
FieldName = Literal["nominal", "unit", "curve", "ends", "side", "part", "tolerance", "source", "radius", "results", "name"]


@dataclass(frozen=True, slots=True)
class FormMistake:
    """What is wrong with the answer in a field of a new plan."""

    field: FieldName
    words: str


@dataclass(frozen=True, slots=True)
class Understood:
    """What is understood of a nominal that a page hands in. The answer to its post at `/nominal`, as JSON.

    problem    : why it cannot be read; empty where it can
    asks       : what it leaves open: the unit is that of the file, or the length of the chord that it is drawn in units of
    curves     : number and words of each curve of a drawing; empty where there is one
    turns_left : a profile that goes round does so counter-clockwise
    points_mm  : along the curve, from its start; in units of the file where the unit is not known, as are length and size
    part, name : names for part and plan that are offered; files: of points and surfaces beside the plans
    """

    problem: str = ""
    mistakes: tuple[FormMistake, ...] = ()
    asks: tuple[Asked, ...] = ()
    curves: tuple[tuple[int, str], ...] = ()
    closed: bool = False
    turns_left: bool = False
    length_mm: float = 0.0
    size_mm: tuple[float, float] = (0.0, 0.0)
    unit_known: bool = True
    source_format: str = ""
    notes: tuple[str, ...] = ()
    points_mm: tuple[tuple[float, float], ...] = ()
    part: str = ""
    name: str = ""
    files: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class PlanSaved:
    """What came of a new plan: its name once it is saved, else what is wrong. The answer to a post at `/plan`, as JSON.

    surface : it is a plan of a CT surface; taken: there was a plan of this name
    """

    name: str = ""
    surface: bool = False
    taken: bool = False
    mistakes: tuple[FormMistake, ...] = ()
