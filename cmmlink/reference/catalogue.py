"""All cases, in the order of their kinds."""

from collections.abc import Iterator

from cmmlink.reference import consumption_cases, deviation_cases, disturbed_cases, filter_cases, fit_cases, placement_cases, section_cases
from cmmlink.reference.case import ReferenceCase
from cmmlink.reference.exact_numbers import with_fifty_digits


def reference_cases() -> Iterator[ReferenceCase]:
    """Build one case after another; the same bits on every machine."""
    for kind in (deviation_cases, fit_cases, consumption_cases, filter_cases, section_cases, placement_cases, disturbed_cases):
        for build in kind.builders():
            with with_fifty_digits():
                case = build()
            yield case
