"""All that a user waits for, in one run on one machine, with its rivals: `make bench`.

    python -m tests.benchmarks.bench [--long] [--quick] [--only WORDS] [--no-page]
    python -m tests.benchmarks.bench --slower

Waits are measured in turn, round after round, so that a busy machine slows all of them alike. A line is appended to
docs/performance-history.jsonl, the table of docs/performance.md is written anew, and what got slower than in the run before on the
same processor is named. --slower only does the last, from the history, and its exit status is 1 where something did.
"""

import argparse
import datetime
import subprocess
import sys
import tempfile
from collections import defaultdict
from pathlib import Path

from rich.console import Console
from rich.progress import track

from tests.benchmarks import growth, history
from tests.benchmarks.machine import machine, processor
from tests.benchmarks.waits import ROOT, Wait, waits
from tests.benchmarks.warm_up import compile_kernels


def measure(every: list[Wait], most_rounds: int) -> tuple[history.Figure, ...]:
    """Figures of all waits, measured in turn."""
    values: dict[tuple[str, str], list[float]] = defaultdict(list)
    turns = [wait for k in range(most_rounds) for wait in every if k < wait.rounds]
    for wait in track(turns, "measuring", console=Console(stderr=True), transient=True, disable=not sys.stderr.isatty()):
        for unit, value in wait.once().items():
            values[wait.name, unit].append(value)
    by_name = {wait.name: wait for wait in every}
    return tuple(
        history.figure_of(name, unit, found, by_name[name].goals.get(unit), by_name[name].limit) for (name, unit), found in values.items()
    )


def commit() -> str:
    """Short hash of the commit that is checked out, with a plus where files differ from it."""
    told = subprocess.run(["git", "describe", "--always", "--dirty=+"], cwd=ROOT, capture_output=True, text=True, check=False)
    return told.stdout.strip() or "unknown"


def say_what_got_slower() -> int:
    """Name what got slower than in the run before. Gives how many figures did."""
    past = history.runs()
    if not past:
        print("No run is on record yet.")
        return 0
    before = history.previous(past[-1], past[:-1])
    if before is None:
        print(f"The run of {past[-1].date} is the first on this processor.")
        return 0
    found = list(history.slower(past[-1], before))
    print(*(found or [f"Nothing got slower than on {before.date} ({before.commit}) by more than its scatter."]), sep="\n")
    return len(found)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--long", action="store_true", help="also ten million points (needs some minutes and 2 GB)")
    parser.add_argument("--quick", action="store_true", help="one round, nothing is kept: does it run?")
    parser.add_argument("--only", default="", metavar="WORDS", help="only waits with these words in their name; nothing is kept")
    parser.add_argument("--no-page", action="store_true", help="only say the figures; nothing is kept")
    parser.add_argument("--slower", action="store_true", help="only say what got slower in the last run on record")
    options = parser.parse_args()
    if options.slower:
        sys.exit(say_what_got_slower() > 0)
    compile_kernels()
    with tempfile.TemporaryDirectory() as name:
        every = [wait for wait in waits(Path(name), options.long) if options.only in wait.name]
        figures = measure(every, 1 if options.quick else max(wait.rounds for wait in every))
    is_kept = not (options.quick or options.only or options.no_page)
    today = datetime.datetime.now(tz=datetime.UTC).strftime("%Y-%m-%d %H:%M")
    lines = growth.lines() if is_kept else {}
    run = history.Run(today, commit(), machine("numpy", "scipy", "numba"), processor(), figures, lines)
    for figure in figures:
        goal = f"   goal {figure.goal:g}" if figure.goal is not None else ""
        print(f"{figure.name:62} {figure.median:>10g} {figure.unit} ({figure.low:g} to {figure.high:g}){goal}")
    if is_kept:
        history.append(run)
        history.write_page(run)
        growth.draw(run)
        say_what_got_slower()


if __name__ == "__main__":
    main()
