"""Keeps judgements in the records of a station, some seconds of work at a time: one process writes, and a run can be measured between.

Where the station records just now, they wait until it does not.
"""

import time
from collections.abc import Callable, Sequence
from datetime import datetime
from itertools import groupby
from pathlib import Path

from cmmlink.errors import StationBusyError, StoreError
from cmmlink.record import PATIENCE_S, Judgement, keep_judgements, open_to_record, seal_of
from cmmlink.words import utc_words

_EVERY_S = 5.0  # so much work is lost at most where this process is killed
_PATIENCE_AT_THE_END_S = 20.0


class Keeper:
    """Adds judgements to the records in a folder, with who judged again, when, and why.

    kept  : ids of the runs whose judgements are on the disk
    notes : what the reader of the judgements has to know, as that they are not signed
    """

    def __init__(
        self, folder: Path, *, who: str, why: str, now: Callable[[], datetime], clock: Callable[[], float] = time.monotonic
    ) -> None:
        self.folder = folder
        self.kept: set[str] = set()
        self.notes: dict[str, None] = {}
        self._who, self._why, self._now, self._clock = who, why, now, clock
        self._waiting: list[Judgement] = []
        self._written_s = clock()

    def take(self, judgements: Sequence[Judgement]) -> None:
        """Take judgements; those of some seconds are written together. Raises StoreError where they cannot be kept."""
        self._waiting += judgements
        if self._clock() >= self._written_s + _EVERY_S:
            try:
                self._write(PATIENCE_S)
            except StationBusyError:  # a run is being recorded: it goes first
                self._written_s = self._clock()

    def finish(self) -> None:
        """Write what waits. Raises StoreError where it cannot be kept, also because the station goes on recording."""
        if self._waiting:
            try:
                self._write(_PATIENCE_AT_THE_END_S)
            except StationBusyError as error:
                left = f"{len(self._waiting)} judgements are not kept"
                raise StoreError(f"{left}: {error}. Run the command again afterwards: it goes on with these") from None

    def _write(self, patience_s: float) -> None:
        with open_to_record(self.folder, self._now, patience_s) as store:
            for key, judgements in groupby(sorted(self._waiting, key=_key), _key):
                several = list(judgements)
                seal = seal_of(store, station=None, key=Path(key) if key else None)
                self.notes |= dict.fromkeys(note.replace("the run is", "the judgement is") for note in seal.notes)
                keep_judgements(store, several, who=self._who, why=self._why, when=utc_words(self._now()), seal=seal)
                self.kept.update(one.run for one in several)
                self._waiting = [one for one in self._waiting if one.run not in self.kept]
        self._written_s = self._clock()


def _key(judgement: Judgement) -> str:
    return str(judgement.key or "")
