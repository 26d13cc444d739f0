"""Headlines: what stands above a run."""

import pytest

from cmmlink.words import headline_of
from inspection import Verdict


@pytest.mark.parametrize("verdict", [None, *Verdict])
@pytest.mark.parametrize("ending", ["aborted", "interrupted"])
def test_no_verdict_stands_above_a_run_that_did_not_come_to_its_end(verdict: Verdict | None, ending: str) -> None:
    headline = headline_of(verdict, ending, 0.3299)
    assert headline.words == {"aborted": "ABORTED AT 32 %", "interrupted": "INTERRUPTED AT 32 %"}[ending]
    assert headline.shape == "ended-early"


def test_the_share_is_never_rounded_up_to_the_whole_and_left_out_where_it_is_not_known() -> None:
    assert headline_of(None, "aborted", 0.9999).words == "ABORTED AT 99 %"
    assert headline_of(None, "aborted", None).words == headline_of(None, "aborted", 0.0).words == "ABORTED"


def test_without_a_verdict_nothing_was_measured() -> None:
    assert headline_of(None).words == "NOT MEASURED"
    assert [headline_of(verdict).words for verdict in Verdict] == ["CONFORM", "NOT PROVEN", "NOT CONFORM"]
