"""The reference set: what every case must be."""

from cmmlink.reference import reference_cases


def test_every_case_has_a_name_of_its_own_and_says_what_it_is_about() -> None:
    cases = list(reference_cases())
    assert len({case.name for case in cases}) == len(cases)
    assert all(case.about.endswith(".") for case in cases)
