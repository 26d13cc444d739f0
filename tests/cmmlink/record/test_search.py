"""Which runs a search finds."""

from datetime import date

import pytest

from cmmlink.record.search import RunSearch

ENTRY = {
    "part": "Blade 7",
    "serial_number": "B-0041",
    "operator": "Ada",
    "plan_file": "blade.yaml",
    "verdict": "nonconform",
    "state": "complete",
    "started": "2026-03-01T12:00:00Z",
}


@pytest.mark.parametrize(
    ("search", "found"),
    [
        (RunSearch(), True),
        (RunSearch(part="blade"), True),
        (RunSearch(part=" BLADE "), True),
        (RunSearch(part="vane"), False),
        (RunSearch(serial_number="004"), True),
        (RunSearch(operator="ada", plan="blade", serial_number="b-"), True),
        (RunSearch(operator="ada", plan="vane"), False),
        (RunSearch(verdict="nonconform"), True),
        (RunSearch(verdict="none"), False),
        (RunSearch(since=date(2026, 3, 1), until=date(2026, 3, 1)), True),
        (RunSearch(since=date(2026, 3, 2)), False),
        (RunSearch(until=date(2026, 2, 28)), False),
    ],
)
def test_a_run_is_found_when_it_has_all_that_is_asked_for(search: RunSearch, found: bool) -> None:
    assert search.finds(ENTRY) is found


def test_an_early_end_is_no_verdict_and_a_damaged_run_is_found_where_nothing_is_asked() -> None:
    for early in (ENTRY | {"state": "aborted"}, ENTRY | {"verdict": None}):
        assert RunSearch(verdict="none").finds(early)
        assert not RunSearch(verdict="nonconform").finds(early)
    damaged = dict.fromkeys(ENTRY) | {"state": "damaged"}
    assert RunSearch().finds(damaged)
    for search in (RunSearch(part="b"), RunSearch(since=date(2000, 1, 1)), RunSearch(verdict="conform")):
        assert not search.finds(damaged)
