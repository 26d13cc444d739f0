"""Characteristics as the page shows them: red before the end only where that is proven, the worst named, and never more than a hundred."""

import math
from dataclasses import replace

import pytest

from cmmlink.characteristic_rows import MOST_ROWS, characteristics_at_end, characteristics_so_far, most_shown, names_of, worst_words
from cmmlink.characteristics_json import characteristic_json
from cmmlink.events import Evaluated
from inspection import CharacteristicResult, Reason, Verdict

CHORD = CharacteristicResult(
    name="chord",
    type="chord",
    method="tangent",
    value=99.95,
    nominal=100.0,
    unit="mm",
    lower=-0.1,
    upper=math.inf,
    deviation=-0.05,
    consumption=math.nan,
    uncertainty=0.002,
    rule="simple",
    verdict=Verdict.UNCERTAIN,
    reasons=(),
)
NOTHING = replace(CHORD, value=math.nan, deviation=math.nan)
OUT, PROVEN = replace(CHORD, deviation=-0.2), replace(CHORD, deviation=-0.2, verdict=Verdict.NONCONFORM)


def at_end(*found: CharacteristicResult) -> dict[str, object]:
    return {"characteristics": [characteristic_json(one) for one in found]}


@pytest.mark.parametrize(
    ("found", "refuted", "word"),
    [
        (CHORD, None, "so far"),
        (NOTHING, None, "so far"),
        (OUT, None, "LOOKS OUT"),
        (PROVEN, None, "NOT CONFORM"),
        (CHORD, 0, "NOT CONFORM"),
    ],
)
def test_before_the_end_a_row_is_red_only_where_that_is_proven(found: CharacteristicResult, refuted: int | None, word: str) -> None:
    rows = characteristics_so_far(Evaluated(0.0, (found, CHORD), None), refuted).rows
    assert [row.word for row in rows] == [word, "so far"]
    assert (rows[0].verdict == "nonconform") == (rows[0].shape == "not-conform") == (word == "NOT CONFORM")


def test_at_the_end_a_row_has_its_verdict_its_reason_and_its_limits() -> None:
    refused = replace(PROVEN, reasons=(Reason("out-of-tolerance", "It is short."),))
    (row,) = characteristics_at_end(at_end(refused)).rows
    assert (row.word, row.why, row.value, row.lower, row.upper) == ("NOT CONFORM", "It is short.", 99.95, -0.1, None)
    assert characteristics_at_end({"verdict": "conform"}).rows == (), "a record that is older than characteristics has none"


def test_u_along_the_profile_is_that_of_the_result() -> None:
    stations = [{"station_mm": 0.0, "expanded_mm": 0.002}, {"station_mm": 9.0, "expanded_mm": 0.003}]
    assert characteristics_at_end(at_end() | {"uncertainty": {"stations": stations}}).uncertainty == ((0.0, 0.002), (9.0, 0.003))


def test_the_worst_are_named() -> None:
    good, bad = replace(CHORD, verdict=Verdict.CONFORM), replace(PROVEN, name="edge")
    assert worst_words(characteristics_at_end(at_end(good)).rows) == ""
    assert worst_words(characteristics_at_end(at_end(good, good)).rows) == "all 2 characteristics"
    assert worst_words(characteristics_at_end(at_end(good, OUT, bad)).rows) == "edge"
    assert worst_words(characteristics_at_end(at_end(good, OUT, OUT)).rows) == "chord and 1 more"
    assert names_of(characteristics_at_end(at_end(good, bad, PROVEN, PROVEN)).rows, "not-conform") == "edge and 2 more"


def test_of_very_many_the_worst_are_shown_in_their_order() -> None:
    many = [replace(CHORD, name=str(k), verdict=Verdict.NONCONFORM if k % 50 == 49 else Verdict.CONFORM) for k in range(150)]
    shown = most_shown(characteristics_at_end(at_end(*many)).rows)
    assert len(shown) == MOST_ROWS
    assert [row.name for row in shown if row.verdict == "nonconform"] == ["49", "99", "149"]
    assert [int(row.name) for row in shown] == sorted(int(row.name) for row in shown)
