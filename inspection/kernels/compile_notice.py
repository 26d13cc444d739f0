"""Who is told when something has to be compiled. They can say so before numba is loaded, which takes longer than most commands."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager

_waiting: list[Callable[[], None]] = []  # numba keeps who listens to it for the whole process, and so does this


@contextmanager
def while_compiling(tell: Callable[[], None]) -> Iterator[None]:
    """Call `tell` once, when the first function has to be compiled instead of loaded from the cache."""
    _waiting.append(tell)
    try:
        yield
    finally:
        if tell in _waiting:
            _waiting.remove(tell)


def begin_to_compile() -> None:
    """Tell those who wait for it that something is compiled now, each once."""
    while _waiting:
        _waiting.pop()()
