"""What the newest run changes in the trends of its part: an alarm for every characteristic that breaks a rule with it."""

from collections.abc import Iterator
from datetime import timedelta
from typing import TYPE_CHECKING

from cmmlink.plant import StoredEvent, alarm_words

if TYPE_CHECKING:
    from cmmlink.plant import ResultsDatabase, StoredRun

KIND = "trend alarm"
_RUNS = 101  # that are looked at, the newest among them
_JUST_AFTER = timedelta(microseconds=1)


def trend_alarms(results: "ResultsDatabase", run: "StoredRun") -> Iterator[StoredEvent]:
    """The alarms of a run that is in the database, held against the runs of its station before it; none of one that ended early.

    They are the same events each time, so that none is in the database twice.
    """
    if run.state != "complete":
        return
    for value in run.values:
        series = results.series(run.part, value.name, station=run.station, until=run.started + _JUST_AFTER, last=_RUNS)
        if not series.run or series.run[-1] != run.run:
            continue  # another one began at the same moment, and is looked at itself
        for words in alarm_words(series.value):
            yield StoredEvent(
                key=f"{KIND} {run.station} {run.run} {value.name} {words}",
                at=run.started,
                kind=KIND,
                words=f"{value.name}: {words}",
                station=run.station,
                part=run.part,
                characteristic=value.name,
                run=run.run,
            )
