"""What the station tells a page of trends: which parts have results, and the trend of one characteristic with its heat strip."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class TrendChoices:
    """Which parts have results, and of which stations."""

    parts: tuple[str, ...]
    stations: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class TrendRun:
    """One run: when it began, at this place; value and limits are null where there is none."""

    run: str
    station: str
    serial_number: str
    began: str
    value: float | None
    lower: float | None
    upper: float | None
    verdict: str


@dataclass(frozen=True, slots=True)
class BrokenRule:
    """A rule of Western Electric that is broken at a plotted value."""

    at: int
    words: str
    above: bool


@dataclass(frozen=True, slots=True)
class TrendChart:
    """One line of a control chart; what is plotted is null where there is nothing."""

    centre: float
    lower: float
    upper: float
    plotted: tuple[float | None, ...]
    broken: tuple[BrokenRule, ...]


@dataclass(frozen=True, slots=True)
class TrendIndex:
    """An index of capability with its limits of confidence; null where one is not stated, and why."""

    name: str
    value: float | None
    lower: float | None
    upper: float | None
    reason: str


@dataclass(frozen=True, slots=True)
class TrendStrip:
    """The heat strip: a row a run, oldest first, and in each a value for every even part of the profile.

    names     : serial number, or run, of each row
    worst_mm  : the worst deviation, null where nothing was measured
    levels    : from -3 to 3, out of tolerance at both ends; null has no colour
    slope_um  : the drift of each part, micrometres a run
    stretches : from and to, mm, where the drift is significant
    """

    length_mm: float
    names: tuple[str, ...]
    worst_mm: tuple[tuple[float | None, ...], ...]
    levels: tuple[tuple[int | None, ...], ...]
    slope_um: tuple[float | None, ...]
    stretches: tuple[tuple[float, float], ...]


@dataclass(frozen=True, slots=True)
class TrendShown:
    """The trend of one characteristic over the newest runs, oldest first.

    characteristics : the names of all that the part has
    rows   : of each plotted value the run that it ends with
    basis  : mean, standard deviation and distribution of the indices, in words; empty without any
    drifts : where the profile drifts, in words
    """

    part: str
    characteristic: str
    characteristics: tuple[str, ...]
    unit: str
    is_form: bool
    subgroup: int
    runs: tuple[TrendRun, ...]
    rows: tuple[int, ...]
    location: TrendChart | None
    spread: TrendChart | None
    indices: tuple[TrendIndex, ...]
    basis: str
    strip: TrendStrip | None
    drifts: tuple[str, ...]
    notes: tuple[str, ...]
