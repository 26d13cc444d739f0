"""Fuzzing: `python -m tests.fuzz.grow MINUTES [TARGET ...]` mutates sound inputs of every target and looks at how each ends.

An input may take five seconds of the processor and 200 MB of memory, and must end with a result or a documented error. Whatever does
not is kept in corpus/TARGET-HASH and printed; test_corpus.py reads all that is kept ever after. An input follows from its target and
number alone, so that a run can be repeated; where it goes on is told by the number to begin with, --from N.
"""

import hashlib
import resource
import signal
import sys
import tempfile
import time
import traceback
import warnings
from collections import Counter
from functools import cache
from pathlib import Path
from random import Random
from types import FrameType

from tests.fuzz.mutations import mutated
from tests.fuzz.targets import TARGETS

CORPUS = Path(__file__).with_name("corpus")
MOST_CPU_S, MOST_MB = 5.0, 200.0


class TooSlow(BaseException):
    """An input took more time than any may."""


def _too_slow(_: int, __: FrameType | None) -> None:
    raise TooSlow


def resident_mb() -> float:
    """The most memory that this process has held so far."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / (1e6 if sys.platform == "darwin" else 1e3)


def flaw_of(name: str, data: bytes) -> str:
    """Let a target read an input; returns what must not be, nothing if all is well."""
    seeds_of(name)  # what is compiled and recorded for them is no input's cost
    target, before_mb = TARGETS[name], resident_mb()
    signal.signal(signal.SIGPROF, _too_slow)
    with tempfile.TemporaryDirectory() as place, warnings.catch_warnings():
        warnings.simplefilter("error")
        folder = Path(place) / "inside"
        folder.mkdir()
        signal.setitimer(signal.ITIMER_PROF, MOST_CPU_S)
        try:
            target.read(data, folder)
        except target.allowed as error:
            if not str(error):
                return f"{type(error).__name__} without a word"
        except TooSlow:
            return f"more than {MOST_CPU_S:g} s of the processor\n{traceback.format_exc(limit=-4)}"
        except BaseException:
            return traceback.format_exc(limit=-6)
        finally:
            signal.setitimer(signal.ITIMER_PROF, 0)
    grown_mb = resident_mb() - before_mb
    return f"{grown_mb:.0f} MB for {len(data)} bytes" if grown_mb > MOST_MB else ""


@cache
def seeds_of(name: str) -> list[bytes]:
    """The sound inputs of a target."""
    return TARGETS[name].seeds()


def input_of(name: str, number: int) -> bytes:
    """Make the input with this number."""
    rng = Random(f"{name} {number}")
    return mutated(rng.choice(seeds_of(name)), TARGETS[name].mutations, rng)


def grow(minutes: float, names: list[str], first: int) -> int:
    """Fuzz the targets in turn for so many minutes; returns how many inputs went wrong."""
    for name in names:
        for seed in seeds_of(name):
            if words := flaw_of(name, seed):
                raise SystemExit(f"{name}: a sound input goes wrong: {words}")
    until_s, tried, wrong = time.monotonic() + 60 * minutes, Counter[str](), Counter[str]()
    seen: set[str] = set()
    number = first
    while time.monotonic() < until_s:
        for name in names:
            for each in range(number, number + 20):
                data = input_of(name, each)
                tried[name] += 1
                if words := flaw_of(name, data):
                    wrong[name] += 1
                    kind = (
                        name + words.strip().splitlines()[-1][:60] + "".join(line for line in words.splitlines() if "File" in line)[-120:]
                    )
                    if kind not in seen:
                        seen.add(kind)
                        kept = CORPUS / f"{name}-{hashlib.sha256(data).hexdigest()[:12]}"
                        CORPUS.mkdir(exist_ok=True)
                        kept.write_bytes(data)
                        print(f"{name} {each}, kept as {kept.name}: {words}", flush=True)
        number += 20
    print(f"inputs {first} to {number - 1} of each target:")
    for name in names:
        print(f"  {name:18} {tried[name]:8} inputs, {wrong[name]} went wrong")
    print(f"{tried.total()} inputs, {wrong.total()} went wrong, {len(seen)} kinds; {resident_mb():.0f} MB held at most")
    return wrong.total()


if __name__ == "__main__":
    first = int(sys.argv[sys.argv.index("--from") + 1]) if "--from" in sys.argv else 0
    sys.exit(1 if grow(float(sys.argv[1]), [word for word in sys.argv[2:] if word in TARGETS] or list(TARGETS), first) else 0)
