"""What another process of a test runs: it doubles numbers, prints what it is asked, and fails at what is no number."""

import sys
from collections.abc import Callable

from cmmlink.other_processes import answer_all


def serve() -> None:
    """Run as the other process."""
    answer_all(_begin)


def _begin() -> Callable[[int], int]:
    def double(number: int) -> int:
        sys.stdout.write(f"asked {number}\n")  # which must not get among the answers
        sys.stdout.flush()
        return 2 * int(number)

    return double
