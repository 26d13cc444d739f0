"""A scan of which nothing can be used says what became of it, the largest share first."""

import pytest

from drivers.errors import LinkError, ProtocolError
from drivers.links.watch import explained
from drivers.source import Arrival, Damaged, LinkDown, LinkUp, Lost, Rejected, ScanClosed

CUT = Damaged(1, "line cut off")
GONE = (LinkDown("Input/output error"), LinkUp(0.1))
NO_HEADER = Rejected(3, "no scan header arrived")


@pytest.mark.parametrize(
    ("arrivals", "words"),
    [
        (
            [CUT, *GONE, Lost(360, "announced and never came"), ScanClosed(360)],
            "360 points lost (announced and never came), 1 bytes damaged (line cut off), the link was lost once (Input/output error)",
        ),
        (
            [Lost(2, "gap"), NO_HEADER, NO_HEADER, *GONE, *GONE, ScanClosed(8)],
            "6 points rejected (no scan header arrived), 2 points lost (gap), the link was lost 2 times (Input/output error)",
        ),
        ([Lost(2, "gap"), Lost(-2, "late"), NO_HEADER, ScanClosed(3)], "3 points rejected (no scan header arrived)"),
    ],
)
def test_the_largest_share_comes_first(arrivals: list[Arrival], words: str) -> None:
    with pytest.raises(ProtocolError) as refused:
        list(explained("COM1", arrivals))
    assert str(refused.value) == f"COM1: not one point of the scan can be used: {words}"


def test_the_error_of_the_link_stands_before_what_became_of_the_points() -> None:
    def broken() -> list[Arrival]:
        raise LinkError("COM1: silent for 3 s")

    with pytest.raises(LinkError, match=r"COM1: silent for 3 s; not one usable point came: 1 bytes damaged \(line cut off\)$"):
        list(explained("COM1", (arrival for source in (lambda: [CUT], broken) for arrival in source())))
