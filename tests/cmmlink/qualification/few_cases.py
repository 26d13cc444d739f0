"""A case of each kind of the reference set, built without the others: the whole set takes two seconds."""

from functools import cache
from itertools import islice

from cmmlink.reference import (
    ReferenceCase,
    consumption_cases,
    deviation_cases,
    filter_cases,
    fit_cases,
    placement_cases,
    section_cases,
)
from cmmlink.reference.exact_numbers import with_fifty_digits

_PLACES = {
    "open-curve": (deviation_cases, 0),
    "best-fit-closed": (fit_cases, 0),
    "minimum-zone-closed": (fit_cases, 10),
    "consumption-open": (consumption_cases, 1),
    "filter-gaussian": (filter_cases, 1),
    "section-too-large": (section_cases, 1),
    "twist": (placement_cases, 0),
}
_BESIDES = {"section-bent-too-large": (section_cases, 5)}
NAMES = tuple(_PLACES)


@cache
def case_named(name: str) -> ReferenceCase:
    """One of these cases, or one that a test wants besides."""
    kind, place = (_PLACES | _BESIDES)[name]
    with with_fifty_digits():
        [build] = islice(kind.builders(), place, place + 1)
        case: ReferenceCase = build()
    assert case.name == name
    return case
