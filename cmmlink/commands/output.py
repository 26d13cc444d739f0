"""How commands speak: words or JSON on standard output, files in a folder, and what came of a run."""

import json
import signal
import sys
import threading
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from cmmlink.commands.exit_codes import DEVICE_FAILED, EXIT_OF, NO_RECORD, UNUSABLE, say
from cmmlink.commands.progress import progress
from cmmlink.errors import StoreError
from cmmlink.words import VERDICT_WORDS, anchor_words
from inspection import NotMeasured

if TYPE_CHECKING:
    from rich.console import Console

    from cmmlink.events import Answered
    from cmmlink.report import Pictures
    from cmmlink.run import FinishedRun

_STOPPING = ("SIGINT", "SIGTERM", "SIGHUP", "SIGBREAK")  # as far as the system has them


@dataclass(frozen=True, slots=True)
class Output:
    """What the user wants to see of a run, and where it goes."""

    headless: bool
    as_json: bool
    out: Path | None
    records: Path | None = None
    no_browser: bool = False

    @property
    def on_page(self) -> bool:
        """True when somebody can see the console's page and asked for nothing else by --headless or --json."""
        from cmmlink.console.browser import graphical_browser

        quiet = self.headless or self.as_json
        return not quiet and (self.no_browser or (sys.stderr.isatty() and graphical_browser() is not None))


def now() -> datetime:
    """Date and time of day, with the zone."""
    return datetime.now().astimezone()


def print_json(document: dict[str, Any]) -> None:
    """Print one JSON object on one line."""
    typer.echo(json.dumps(document))


def terminal() -> "Console":
    """Standard output for words with style; lines are broken only where a person reads them."""
    from rich.console import Console

    return Console(highlight=False, soft_wrap=not sys.stdout.isatty())


def report_outcome(run: "FinishedRun", output: Output, pictures: "Pictures | None" = None) -> int:
    """Print the outcome and write its files, each even if the other fails. Returns the exit code.

    pictures : draws the picture among the files

    Raises NotMeasured where the set-up contradicts the points: then there is no result to print or to write.
    """
    outcome, evidence = run.outcome, run.evidence
    refusal = run.refusal
    if isinstance(refusal, NotMeasured) and outcome.failure is None and outcome.ending == "complete":
        raise refusal
    message = str(outcome.failure or refusal or "")
    if outcome.ending == "aborted":
        message = message or "stopped by the operator: the scan is not complete"
    if message:
        say(message)
    say_untold(() if evidence is None else evidence.anchors)
    written: Sequence[str] = ()
    folder: Path | None = None
    try:
        if output.out is not None and outcome.measured:
            from cmmlink.report import write_run

            folder = run.folder_of(output.out)
            with progress(f"writing results to {folder}"):
                written = write_run(folder, run, pictures)
    finally:
        if output.as_json:
            print_json(run.result_json())
        else:
            from cmmlink.report import print_summary

            print_summary(terminal(), outcome.result, outcome.counts, f"{run.title}, {run.started.device}", outcome.ending, run.notes)
    if written and not output.as_json:
        typer.echo(f"results in {folder}: {', '.join(written)}")
    if evidence is not None and not output.as_json:
        typer.echo(f"recorded as run {evidence.run}")
    if run.answer is not None:
        _say_answer(run.answer, output)
    if outcome.failure is not None:
        return NO_RECORD if isinstance(outcome.failure, StoreError) else DEVICE_FAILED
    return UNUSABLE if outcome.result is None else EXIT_OF[run.verdict]


def _say_answer(answer: "Answered", output: Output) -> None:
    """Say whether the machine was told the verdict. That it was not is no reason for another exit status: the verdict stands."""
    if answer.state != "sent":
        say(f"NOT SENT to the machine: {answer.problem}")
    elif not output.as_json:
        told = VERDICT_WORDS[answer.verdict] if answer.verdict is not None else ""
        typer.echo(f"sent to the machine at {answer.at:%H:%M:%S}: {told}, request {answer.request}")
    if answer.unrecorded:
        say(f"what the machine was told is not on record: {answer.unrecorded}")


def say_untold(anchors: Sequence[Mapping[str, str]]) -> None:
    """Say which places outside were not told how a run ended. It changes no exit status."""
    for told in anchors:
        if told["problem"]:
            say(anchor_words(told["place"], told["problem"]))


@contextmanager
def stop_on_ctrl_c() -> Iterator[threading.Event]:
    """Yield an event that the first Ctrl-C sets, or the first request to end; the second one does what it does outside."""
    stop = threading.Event()

    def interrupt(*_: object) -> None:
        stop.set()
        restore()

    def restore() -> None:
        for number, handler in before.items():
            signal.signal(number, handler)

    numbers = [getattr(signal, name) for name in _STOPPING if hasattr(signal, name)]
    before = {number: signal.getsignal(number) for number in numbers if signal.getsignal(number) != signal.SIG_IGN}
    for number in before:
        signal.signal(number, interrupt)
    try:
        yield stop
    finally:
        restore()
