"""What is shown of the points of a section while they come in and at their end: the extremes of every bin of station."""

from collections.abc import Sequence

import numpy as np

from cmmlink.extremes import DEVIATION, FOOT_X, NORMAL_X, STATION, VERDICT, ChangedBins, Extremes, PointsVersion
from cmmlink.result_json import density_notes, density_of
from cmmlink.run_state import WorstPoint
from cmmlink.words import VERDICT_NAMES
from inspection import JudgedRows, LiveUpdate, NominalProfile, ToleranceZone, Verdict, coverage


class ShownSection:
    """The points of one section. One thread adds; any thread reads `newest`, `worst` and what changed."""

    def __init__(self, profile: NominalProfile, zone: ToleranceZone, generation: int = 0) -> None:
        self._profile, self._zone = profile, zone
        self._extremes = Extremes(profile.length_mm, zone.middle_mm, generation)
        self._density = density_of([], profile.length_mm)

    def emptied(self) -> "ShownSection":
        """The same without any point; to a reader everything before is void."""
        return ShownSection(self._profile, self._zone, self._extremes.generation + 1)

    def add(self, updates: Sequence[LiveUpdate]) -> int:
        """Add what updates judged; gives how many of it look out now, whatever the pose can still move."""
        columns = ("station_mm", "deviation_mm", "foot_mm", "actual_mm", "verdicts")
        station, deviation, foot, actual, found = (np.concatenate([getattr(update, name) for update in updates]) for name in columns)
        self._extremes.add(station, deviation, foot, actual, found)
        return int(np.count_nonzero(self._zone.verdicts(deviation) == Verdict.NONCONFORM))

    def add_rows(self, rows: JudgedRows) -> None:
        """Add rows of a result."""
        self._extremes.add(rows.station_mm, rows.deviation_mm, rows.foot_mm, rows.actual_mm, rows.verdicts)
        self._density += density_of([rows.station_mm], self._profile.length_mm)

    def coverage(self) -> float:
        """The share of the profile's length that was measured."""
        return coverage(self._extremes.stations_mm, self._profile)

    @property
    def notes(self) -> tuple[str, ...]:
        """What the rows of the result are to be told beside."""
        return tuple(density_notes(self._density, self._profile.length_mm))

    @property
    def worst(self) -> WorstPoint | None:
        """The point farthest from the middle of the zone, None without points."""
        worst = self._extremes.worst
        if worst is None:
            return None
        x, y = worst[FOOT_X : FOOT_X + 2] + worst[DEVIATION] * worst[NORMAL_X : NORMAL_X + 2]
        verdict = VERDICT_NAMES[Verdict(int(worst[VERDICT]))]
        return WorstPoint(float(worst[STATION]), float(worst[DEVIATION]), float(x), float(y), verdict)

    @property
    def newest(self) -> PointsVersion:
        """The version of a reader that has seen all points up to now. Never waits."""
        return self._extremes.newest

    def changed_since(self, seen: PointsVersion) -> ChangedBins:
        """The bins that changed after what was `seen`."""
        return self._extremes.changed_since(seen)
