"""The characteristics of a part as the page and the history show them: while it is measured, and once it has its verdicts.

Before the end a row is red only where that is proven whatever comes, and never green.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from cmmlink.characteristics_json import characteristic_json
from cmmlink.events import Evaluated
from cmmlink.run_state import WorstPoint
from cmmlink.words import LOOKS_OUT, SO_FAR, VERDICT_NAMES, Headline, Shape, VerdictName, deciding_words, headline_of, named_first
from inspection import CharacteristicResult, Verdict

MOST_ROWS, _MOST_LETTERS, _MOST_OF_A_REASON = 100, 200, 600  # rows that are shown, letters of a name, and letters of a reason


@dataclass(frozen=True, slots=True)
class CharacteristicRow:
    """One characteristic as it is shown.

    word, shape  : its verdict, or how it looks so far, and the sign of it
    value, nominal, deviation, lower, upper, uncertainty : in `unit`; null where there is none. The limits are those of the deviation
    method       : how the value is found; `fit`, `filter`, `zone` and `region` in words, `fit` and `filter` "none" where there is none
    from_mm, to_mm : the stretch of the profile that it is of; null for the whole. From above to where it crosses the seam
    why          : the first reason of the verdict
    worst        : the point that consumes most of its tolerance
    places       : places that its value was found at, with their names, in the coordinates of the nominal, mm
    """

    name: str
    type: str
    word: str
    shape: Shape
    verdict: VerdictName
    value: float | None
    nominal: float | None
    unit: str
    lower: float | None
    upper: float | None
    deviation: float | None
    uncertainty: float
    method: str
    fit: str
    filter: str
    zone: str
    region: str
    rule: str
    from_mm: float | None
    to_mm: float | None
    why: str
    worst: WorstPoint | None
    places: tuple[tuple[str, float, float], ...]


@dataclass(frozen=True, slots=True)
class Characteristics:
    """The characteristics of a run, and U along its profile, as pairs of station and U in mm; without a budget there are none."""

    rows: tuple[CharacteristicRow, ...] = ()
    uncertainty: tuple[tuple[float, float], ...] = ()


def characteristics_at_end(result: Mapping[str, Any]) -> Characteristics:
    """Those of a result as JSON holds it; an older one has none."""
    rows = tuple(_row(one, headline_of(Verdict[one["verdict"].upper()])) for one in result.get("characteristics", ()))
    stations = (result.get("uncertainty") or {"stations": ()})["stations"]
    return Characteristics(rows, tuple((at["station_mm"], at["expanded_mm"]) for at in stations))


def characteristics_so_far(evaluated: Evaluated, refuted: int | None) -> Characteristics:
    """What was found so far.

    refuted : the place of one that is proven to be out by other means, None where none is
    """
    rows = tuple(_row_so_far(one, place == refuted) for place, one in enumerate(evaluated.found))
    along = evaluated.uncertainty
    if along is None:
        return Characteristics(rows)
    told = along.telling_places()
    return Characteristics(rows, tuple(zip(along.station_mm[told].tolist(), along.expanded_mm[told].tolist(), strict=True)))


def most_shown(rows: Sequence[CharacteristicRow]) -> tuple[CharacteristicRow, ...]:
    """At most a hundred of them, where there are more those with the worst verdicts, in their order."""
    if len(rows) <= MOST_ROWS:
        return tuple(rows)
    worst = sorted(range(len(rows)), key=lambda place: -Verdict[rows[place].verdict.upper()])[:MOST_ROWS]
    return tuple(rows[place] for place in sorted(worst))


def names_of(rows: Sequence[CharacteristicRow], shape: Shape) -> str:
    """The first of the characteristics with a sign by its name, and how many more have it; nothing where there is but one in all."""
    return named_first([row.name for row in rows if row.shape == shape] if len(rows) > 1 else [])


def worst_words(rows: Sequence[CharacteristicRow]) -> str:
    """Which of several characteristics gave the part its verdict."""
    all_of_them = f"all {len(rows)} characteristics" if len(rows) > 1 else ""
    return deciding_words([(row.name, row.verdict) for row in rows]) or all_of_them


def _row_so_far(one: CharacteristicResult, refuted: bool) -> CharacteristicRow:
    if refuted or one.verdict is Verdict.NONCONFORM:
        return _row(characteristic_json(one) | {"verdict": Verdict.NONCONFORM.word}, headline_of(Verdict.NONCONFORM))
    looks_out = one.deviation < one.lower or one.deviation > one.upper  # neither of NaN
    return _row(characteristic_json(one), LOOKS_OUT if looks_out else SO_FAR)


def _row(one: Mapping[str, Any], headline: Headline) -> CharacteristicRow:
    verdict = VERDICT_NAMES[Verdict[one["verdict"].upper()]]
    region, worst = one["region"] or {}, one["worst"]
    return CharacteristicRow(
        name=one["name"][:_MOST_LETTERS],
        type=one["type"],
        word=headline.words,
        shape=headline.shape,
        verdict=verdict,
        **{name: one[name] for name in ("value", "nominal", "unit", "lower", "upper", "deviation", "uncertainty", "method", "fit")},
        **{name: one[name] for name in ("filter", "zone", "rule")},
        region=one["region_words"],
        from_mm=region.get("from_mm"),
        to_mm=region.get("to_mm"),
        why=one["reasons"][0]["words"][:_MOST_OF_A_REASON] if one["reasons"] else "",
        worst=None if worst is None else WorstPoint(**worst, verdict=verdict),
        places=tuple((place["name"], place["x_mm"], place["y_mm"]) for place in one["places"]),
    )
