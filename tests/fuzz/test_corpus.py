"""What once went wrong is read by its target without a flaw ever after, and a few new inputs of every target with it.

`make fuzz MINUTES=10` tries as many as there is time for, and keeps what goes wrong in the corpus.
"""

from collections.abc import Iterator

import pytest

pytest.importorskip("resource", reason="time and memory of an input are measured on POSIX systems only")

from tests.fuzz.console_socket import close_workshop
from tests.fuzz.grow import CORPUS, flaw_of, input_of
from tests.fuzz.targets import TARGETS

INPUTS = 6


@pytest.fixture(autouse=True, scope="module")
def _no_workshop_left() -> Iterator[None]:
    yield
    close_workshop()


@pytest.mark.parametrize("kept", sorted(path.name for path in CORPUS.iterdir()))
def test_what_went_wrong_is_read(kept: str) -> None:
    assert not flaw_of(kept.rpartition("-")[0], (CORPUS / kept).read_bytes())


@pytest.mark.parametrize("name", TARGETS)
def test_unsound_input_ends_with_a_result_or_a_documented_error(name: str) -> None:
    for number in range(INPUTS):
        assert not flaw_of(name, input_of(name, number)), number
