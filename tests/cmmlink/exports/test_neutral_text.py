"""No text becomes a formula, whatever a name holds and whichever sign divides the cells; and text without harm stays as it is."""

import csv
import io

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cmmlink.exports.neutral_text import MOST_LETTERS, neutral

FORMULAS = [
    "=1+1",
    "+1",
    "-1",
    "@SUM(1)",
    "\t=1",
    "\r=1",
    "  =1",
    "\u00a0=1",
    "\uff1d1",
    "\n@x",
    "=cmd|'/c calc'!A1",
    "-2+cmd|' /C calc'!D2",
]
LEADING = "=+-@\t\r\n\uff1d\uff0b\uff0d\uff20"


def cells(text: str, divided_by: str) -> list[str]:
    """The cells that a spreadsheet makes of a line of csv that holds the text."""
    line = io.StringIO()
    csv.writer(line).writerow(["before", neutral(text), "behind"])
    return next(csv.reader(io.StringIO(line.getvalue()), delimiter=divided_by))


@pytest.mark.parametrize("text", FORMULAS)
def test_a_formula_becomes_text(text: str) -> None:
    assert neutral(text).lstrip()[0] not in LEADING
    assert cells(f"blade;{text}", ";")[1].lstrip()[0] not in LEADING


@given(st.text(st.sampled_from("=+-@;\t\r\n \"',a1\uff1d\u00a0")))
def test_no_cell_of_any_text_begins_a_formula(text: str) -> None:
    assert not neutral(text).lstrip().startswith(tuple(LEADING))
    for cell in cells(text, ","):
        assert not cell.lstrip().startswith(tuple(LEADING))
    for cell in cells(text, ";"):
        assert not cell.lstrip(' \u00a0"').startswith(tuple(LEADING))


@pytest.mark.parametrize("text", ["blade 7", "M\u00fcller & Co.", "0042", "a-b", "100 % = all", "limits -0.05 .. 0.05 mm; 3 points", ""])
def test_text_without_harm_stays_as_it_is(text: str) -> None:
    assert neutral(text) == text


def test_text_stays_on_one_line_steers_nothing_and_fits_into_a_cell() -> None:
    assert neutral("a\r\nb\x1b[2J") == "a b\\x1b[2J"
    assert len(neutral("x" * 50_000)) == MOST_LETTERS
