"""What the console asks of the station's records: the runs, one run to look at, to measure again, or to take away."""

import shutil
import tempfile
import threading
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from datetime import datetime
from functools import partial
from pathlib import Path
from typing import Any

from cmmlink.characteristic_rows import characteristics_at_end, worst_words
from cmmlink.console.paper_process import make_comparison, make_report
from cmmlink.console.protocol import RunRow
from cmmlink.endings import Ended
from cmmlink.errors import StoreError
from cmmlink.events import Counts, RunStarted, Sink
from cmmlink.from_surface_plan import document_of_surface
from cmmlink.plan import Plan, SurfacePlan
from cmmlink.record import (
    Agreement,
    Change,
    RecordedRun,
    RunSearch,
    Store,
    derived_of,
    earlier_run,
    end_missing,
    find_run,
    list_runs,
    open_to_read,
    recorded_plan,
    recorded_profile,
    recorded_result,
    recorded_run,
    recorded_surface,
    recorded_surface_plan,
    replay_run,
    replay_surface,
    unpack_judged,
    unpack_surface,
)
from cmmlink.record import export_run as export_files
from cmmlink.result_json import result_json
from cmmlink.run_context import RunContext
from cmmlink.run_state import RunKind
from cmmlink.surface_rows import SurfaceRows
from cmmlink.words import headline_of, judgement_words, local_words, section_words
from drivers import Decoder
from inspection import JudgedRows, Verdict

Rows = JudgedRows | SurfaceRows

_MOST_LISTED = 500


@dataclass(frozen=True, slots=True, eq=False)
class OpenedRun:
    """One run as the records hold it."""

    run: str
    began: datetime
    started: RunStarted
    ended: Ended
    context_of: Callable[[str, RunKind], RunContext]

    def context(self, title: str, kind: RunKind) -> RunContext:
        """What the run was judged by, under a title that pages show in place of a number."""
        return self.context_of(title, kind)


@dataclass(slots=True)
class PastRuns:
    """The records in a folder.

    decoder_of : the decoder of a plan's device, None for one without wire bytes
    clock      : monotonic, s; now : date and time of day
    """

    folder: Path
    decoder_of: Callable[[Plan | SurfacePlan], Decoder | None]
    clock: Callable[[], float]
    now: Callable[[], datetime]
    _known: dict[tuple[str, str], RunRow] = field(default_factory=dict)

    def runs(self) -> Sequence[RunRow]:
        """The newest runs, newest first. Raises StoreError."""
        return self.find_runs(RunSearch())[0]

    def find_runs(self, search: RunSearch) -> tuple[Sequence[RunRow], int]:
        """The newest of the runs that are looked for, newest first, and how many there are. Raises StoreError."""
        found = list_runs(self.folder, self.now, search=search)
        return self._rows_of(found[::-1][:_MOST_LISTED]), len(found)

    def _rows_of(self, entries: Sequence[dict[str, Any]]) -> Sequence[RunRow]:
        if not entries:
            return []
        unknown = [entry for entry in entries if _key(entry) not in self._known]
        with open_to_read(self.folder, self.now) as store:
            self._known.update((_key(entry), _row_of(entry, _result_of(store, entry["run"]))) for entry in unknown)
            judged = [_judgements_of(store, entry["run"]) for entry in entries]  # at any time there may be one more
        return [replace(self._known[_key(entry)], judged=words) for entry, words in zip(entries, judged, strict=True)]

    def measured_before(self, part: str, serial_number: str) -> str | None:
        """The newest run of a part with this serial number, None where there is none. Raises StoreError."""
        return earlier_run(self.folder, part, serial_number, self.now)

    def open_run(self, run: str) -> OpenedRun:
        """Give one run as it was recorded. Raises StoreError, RunError."""
        with open_to_read(self.folder, self.now) as store:
            recorded = recorded_run(store, find_run(store, run))
            end = recorded.end or end_missing(store, recorded.run)
            unpack = unpack_surface if recorded.is_of_surface else unpack_judged
            has_rows = recorded.result and "deviations" in store.totals(recorded.run)
            blocks = partial(self._judged_blocks, recorded.run, unpack) if has_rows else None
        received = end["received"] or 0
        counts = Counts(received=received, rejected=received, rejected_by_reason={"not judged": received})
        result = recorded.result or result_json(None, counts)
        began = datetime.fromisoformat(recorded.header["started"]).astimezone()
        ended = Ended(end["state"], end["message"], result, blocks)
        context_of = _context_of_surface(recorded, began) if recorded.is_of_surface else _context_of_section(recorded, began)
        return OpenedRun(recorded.run, began, RunStarted.from_header(recorded.header), ended, context_of)

    def _judged_blocks(self, run: str, unpack: Callable[[bytes], Rows]) -> Iterator[Rows]:
        """Read the judged rows of a run from the records, piece by piece."""
        with open_to_read(self.folder, self.now) as store:
            yield from (unpack(record.body) for record in store.records(run, "deviations"))

    def replay_run(self, run: str, sinks: Sequence[Sink], stop: threading.Event) -> str:
        """Measure a run again from its record; returns a sentence on the result. Raises StoreError, RunError, PlanError."""
        with open_to_read(self.folder, self.now) as store:
            recorded = recorded_run(store, find_run(store, run))
            if recorded.is_of_surface:
                surface = replay_surface(store, recorded, self.decoder_of, clock=self.clock, sinks=sinks, stop=stop)
                return _comparison_of(surface.agreement, surface.changed, recorded.run)
            again = replay_run(store, recorded, self.decoder_of, clock=self.clock, sinks=sinks, stop=stop, shown=True)
            return _comparison_of(again.agreement, again.changed, recorded.run)

    def export_run(self, run: str, folder: Path) -> Path:
        """Write one run as a zip archive into a folder. Raises StoreError, RunError, PlanError."""
        with tempfile.TemporaryDirectory(dir=folder) as files, open_to_read(self.folder, self.now) as store:
            run = find_run(store, run)
            export_files(store, run, Path(files))
            return Path(shutil.make_archive(str(folder / "run"), "zip", files))

    def report_run(self, run: str, folder: Path, settings: Mapping[str, str]) -> Path:
        """Write the report of one run as a PDF into a folder. Raises StoreError, RunError.

        settings : options of `cmmlink report` without their dashes
        """
        with open_to_read(self.folder, self.now, close_interrupted=False) as store:
            run = find_run(store, run)
        file = folder / "report.pdf"
        make_report(self.folder, run, file, settings)
        return file

    def compare_runs(self, first: str, second: str, folder: Path) -> Path:
        """Draw two runs of one profile and their difference as a PDF into a folder. Raises StoreError, RunError."""
        with open_to_read(self.folder, self.now, close_interrupted=False) as store:
            first, second = (find_run(store, run) for run in (first, second))
        file = folder / "comparison.pdf"
        make_comparison(self.folder, first, second, file)
        return file


def _context_of_section(recorded: RecordedRun, began: datetime) -> Callable[[str, RunKind], RunContext]:
    plan = recorded_plan(recorded)
    profile = recorded_profile(plan, recorded)
    return lambda title, kind: RunContext.of(plan, profile, began, title, plan_name="", kind=kind)


def _context_of_surface(recorded: RecordedRun, began: datetime) -> Callable[[str, RunKind], RunContext]:
    plan = recorded_surface_plan(recorded)
    file = recorded_surface(plan, recorded)
    document_of = partial(document_of_surface, file)
    return lambda title, kind: RunContext.of_surface(plan, file, document_of, began, title, plan_name="", kind=kind)


def _key(entry: dict[str, Any]) -> tuple[str, str]:
    """What a line of the history is kept under: a run that was still being recorded when it was read is read again."""
    return entry["run"], entry["state"]


def _result_of(store: Store, run: str) -> dict[str, Any]:
    """Give what the result of a run says, nothing where there is none or it cannot be read."""
    try:
        return recorded_result(store, run)
    except StoreError:
        return {}


def _judgements_of(store: Store, run: str) -> tuple[str, ...]:
    """What was judged of a run later, in words; nothing where that cannot be read."""
    try:
        return tuple(map(judgement_words, derived_of(store, run)))
    except StoreError:
        return ()


def _row_of(entry: dict[str, Any], result: dict[str, Any]) -> RunRow:
    worst, zone = result.get("worst") or {}, result.get("tolerance") or {}
    verdict = Verdict[entry["verdict"].upper()] if entry["verdict"] and result.get("registration") else None  # older records say more
    headline = headline_of(verdict, entry["state"], result.get("coverage"))
    return RunRow(
        entry["run"],
        local_words(datetime.fromisoformat(entry["started"])) if entry["started"] else "",
        entry["part"] or "",
        entry["serial_number"] or "",
        entry["operator"] or "",
        entry["plan_file"] or "",
        section_words(entry["stack"]),
        bool(entry["simulated"]),
        entry["state"],
        entry["received"] or 0,
        entry["verdict"] if verdict is not None else None,
        headline.words,
        headline.shape,
        entry["state"] == "complete" and verdict is not None,
        "" if verdict in (None, Verdict.CONFORM) else worst_words(characteristics_at_end(result).rows),
        worst.get("deviation_mm"),
        worst.get("station_mm"),
        worst.get("x_mm"),
        worst.get("y_mm"),
        zone.get("lower_mm"),
        zone.get("upper_mm"),
        worst_z_mm=worst.get("z_mm"),
    )


def _comparison_of(agreement: Agreement, changes: Sequence[Change], run: str) -> str:
    changed = f"; changed since: {', '.join(change.key for change in changes)}" if changes else ""
    if agreement.identical is None:
        return f"Replay of run {run}, which has no recorded result to compare with{changed}"
    if agreement.identical:
        return f"Replay of run {run}: identical to the recorded result, to the last bit{changed}"
    if agreement.holds:
        return f"Replay of run {run}: the same decision as recorded, with numbers at most {agreement.apart:.1e} apart{changed}"
    return f"Replay of run {run}: NOT the recorded result; {', '.join(change.key for change in agreement.differs[:4])} differ{changed}"
