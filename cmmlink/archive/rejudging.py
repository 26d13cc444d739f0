"""An archive judged again: which runs, by whom, what comes of each, and what is kept. The order of workers changes nothing of it."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from threading import Event
from typing import Any

from cmmlink.archive.judging import judge_runs, require_settings
from cmmlink.archive.keeping import Keeper
from cmmlink.archive.rows import Row
from cmmlink.archive.scheduling import Judge, Workers, judge_all
from cmmlink.archive.tasks import Failure, Outcome, RunAsked, tasks_of
from cmmlink.errors import StoreError
from cmmlink.record import RunSearch, Store, entries_of, judged_by_means, recorded_result, recorded_run
from cmmlink.stack_again import whole_stack

Open = Callable[[int], Workers]


@dataclass(frozen=True, slots=True, eq=False)
class Rejudged:
    """What came of an archive.

    rows : a row for each run that is done, in the order of the archive, and for each stack behind its sections
    left : how many runs are not, because it was stopped
    """

    rows: tuple[Row, ...]
    left: int


def rejudge(
    store: Store,
    settings: Mapping[str, str],
    workers: Open,
    *,
    search: RunSearch,
    stop: Event,
    keeper: Keeper | None = None,
    kept_in: Store | None = None,
    tell: Callable[[float], None] = lambda share: None,
    judge: Judge = judge_runs,
) -> Rejudged:
    """Judge the runs of an archive again with other values behind some keys of their plans.

    workers : gives who judges, for so many runs
    keeper  : keeps what was found; None: nothing is kept
    kept_in : the records that judgements are kept in, where these are not the archive itself

    A run that was judged by the same plan and version before is not judged again: its row is that of the judgement on record.

    Raises PlanError where no plan can be changed so, StoreError where the judgements cannot be kept; what was kept by then stays.
    """
    archive = _Archive(store, kept_in, keeper)
    asked = archive.asked(search)
    require_settings(store, [one.run for one, _ in asked], dict(settings))
    if asked:
        judging = workers(len(asked))
        tasks = tasks_of(store.path.resolve(), dict(settings), asked, max(1, judging.places))

        def take(outcomes: list[Outcome]) -> None:
            archive.take(outcomes)
            tell(archive.done / len(asked))

        with ExitStack() as ending:
            if keeper is not None:
                ending.callback(keeper.finish)
            judge_all(tasks, judging, take, stop, judge)
    return Rejudged(tuple(archive.rows()), len(asked) - archive.done)


class _Archive:
    """The runs that are looked for, and what has come of them."""

    def __init__(self, store: Store, kept_in: Store | None, keeper: Keeper | None) -> None:
        self._store, self._kept_in, self._keeper = store, kept_in or store, keeper
        self._entries: dict[str, Mapping[str, Any]] = {}
        self._found: dict[str, Row] = {}
        self.done = 0

    def asked(self, search: RunSearch) -> list[tuple[RunAsked, int | None]]:
        """The runs to be judged, each with the number of its points; what is wrong with the others has its row."""
        self._entries = {str(entry["run"]): entry for entry in entries_of(self._store, search)}
        ends, there = _ends(self._store), _ends(self._kept_in)
        asked = []
        for run, entry in self._entries.items():
            try:
                known = self._known(run, ends.get(run, ""), there.get(run, ""))
            except StoreError as error:
                self._found[run] = Row(entry, failure=Failure("no-record", str(error)))
                continue
            if entry["state"] == "damaged":
                why = Failure("no-record", f"{self._store.path}: run {run} is damaged; `cmmlink verify` says more")
                self._found[run] = Row(entry, failure=why)
            elif not ends.get(run):
                why = Failure("unusable", f"run {run} has no end yet: it can be judged again when it has")
                self._found[run] = Row(entry, failure=why)
            else:
                asked.append((RunAsked(run, ends[run], known), entry["received"]))
        return [*asked, *self._stacks({one.run: one.chain_sha256 for one, _ in asked})]

    def _stacks(self, asked: Mapping[str, str]) -> Iterator[tuple[RunAsked, int | None]]:
        """The stacks that have characteristics and whose sections are all to be judged, each behind its last section."""
        entries, self._entries = self._entries, {}
        for run, entry in entries.items():
            self._entries[run] = entry
            place = entry.get("stack")
            if run not in asked or not place or place["section"] != place["sections"]:
                continue
            stack = str(place["stack"])
            try:
                found = whole_stack(self._store, recorded_run(self._store, run))
            except StoreError as error:
                self._entries[stack] = _entry_of_stack(stack, [entry])
                self._found[stack] = Row(self._entries[stack], failure=Failure("no-record", str(error)))
                continue
            if found is not None and all(section.run in asked for section in found[1]):
                sections = tuple(section.run for section in found[1])
                self._entries[stack] = _entry_of_stack(stack, [entries[one] for one in sections])
                yield RunAsked(stack, asked[run], sections=sections), 2 * self._entries[stack]["received"]

    def take(self, outcomes: Sequence[Outcome]) -> None:
        """Take what came of runs, and have it kept."""
        for one in outcomes:
            self._found[one.run] = self._row(self._entries[one.run], one)
        self.done += len(outcomes)
        if self._keeper is not None:
            self._keeper.take([one.judgement for one in outcomes if one.judgement is not None and not one.is_same])

    def rows(self) -> list[Row]:
        """The rows of what is done, in the order of the archive."""
        kept = self._keeper.kept if self._keeper is not None else set[str]()
        found = [self._found[run] for run in self._entries if run in self._found]
        return [replace(row, kept=True) if row.run in kept else row for row in found]

    def _known(self, run: str, end: str, there: str) -> frozenset[str]:
        """The means by which a run was judged before. Raises StoreError where the judgement could not be kept with its run."""
        if end and end != there and self._keeper is not None:
            raise StoreError(f"{self._kept_in.path}: run {run} is not there, or with another content; add it with `cmmlink merge` first")
        return frozenset(judged_by_means(self._kept_in, run)) if end == there else frozenset()

    def _row(self, entry: Mapping[str, Any], outcome: Outcome) -> Row:
        if entry.get("sections"):
            before, after = outcome.stack or (None, None)
            told = {**entry, "verdict": None if before is None else before["verdict"]}
            return Row(told, before, after, failure=outcome.failure)
        try:
            before = recorded_result(self._store, outcome.run) or None
            if outcome.known:
                known = judged_by_means(self._kept_in, outcome.run)[outcome.known]
                return Row.of(entry, before, known.result, known=True, kept=True)
        except StoreError as error:
            return Row(entry, failure=Failure("no-record", str(error)))
        after = None if outcome.judgement is None else outcome.judgement.result
        return Row.of(entry, before, after, failure=outcome.failure)


def _entry_of_stack(stack: str, sections: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """The line of a stack in the list of runs, from those of its sections."""
    first = sections[0]
    return {
        "run": stack,
        **{key: first[key] for key in ("started", "part", "serial_number")},
        "state": next((one["state"] for one in sections if one["state"] != "complete"), "complete"),
        "received": sum(one["received"] or 0 for one in sections),
        "verdict": None,
        "sections": len(sections),
    }


def _ends(store: Store) -> dict[str, str]:
    """The hash of the end of each run that has one."""
    return {str(begin.run): bytes(end.sha256).hex() for begin, end in store.begins_and_ends() if end is not None}
