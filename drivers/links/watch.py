"""What shows that a scan goes on, how long is waited for it, and what is said of a scan in which it never came."""

from collections import Counter
from collections.abc import Iterable, Iterator
from math import inf

from drivers.errors import LinkError, ProtocolError
from drivers.source import HARMLESS_REASONS, Arrival, Damaged, Heartbeat, LinkDown, Lost, PointBatch, Rejected, ScanClosed


def is_news(arrival: Arrival) -> bool:
    """Tell whether an arrival shows that the scan goes on: a new point, though it may be rejected, a heartbeat, or the end."""
    if isinstance(arrival, Rejected):
        return arrival.count > 0 and arrival.reason not in HARMLESS_REASONS
    return isinstance(arrival, PointBatch | Heartbeat | ScanClosed)


class Watch:
    """Waits for news over one opened link.

    silence_s     how long nothing new may come
    until_s       when the link is given up by the clock, if nothing new comes before
    last_byte_s   when anything came at all
    """

    def __init__(self, silence_s: float, until_s: float, now_s: float) -> None:
        self._silence_s = silence_s
        self._until_s = until_s
        self._last_news_s = self.last_byte_s = now_s
        self.heard_sound = False  # over this link
        self._sound = False  # since the last news
        self.garbled = False  # since the last news damage came, and nothing sound
        self.told = False  # since the last news anything came

    def note(self, found: Iterable[Arrival], now_s: float) -> None:
        """Take note of one read that brought bytes, and of what was decoded from it."""
        found = list(found)
        self.last_byte_s, self.told = now_s, True
        sound = any(not isinstance(arrival, Damaged) for arrival in found)
        self.heard_sound |= sound
        self._sound |= sound
        if any(map(is_news, found)):
            self._last_news_s, self._until_s = now_s, inf
            self._sound = self.told = self.garbled = False
        else:
            self.garbled = (self.garbled or bool(found)) and not self._sound

    def is_over(self, now_s: float) -> bool:
        """Tell whether the patience is at its end."""
        return self.left_s(now_s) < 0

    def left_s(self, now_s: float) -> float:
        """How long the patience still lasts."""
        return min(self._last_news_s + self._silence_s, self._until_s) - now_s


def explained(address: str, arrivals: Iterable[Arrival]) -> Iterator[Arrival]:
    """Pass on what arrives. Where a scan ends without one usable point, say what became of those that came.

    Raises ProtocolError at the end of such a scan, and the link's own error with the explanation behind it.
    """
    points, became = 0, _Became()
    try:
        for arrival in arrivals:
            if isinstance(arrival, PointBatch):
                points += len(arrival)
            became.note(arrival)
            yield arrival
            if isinstance(arrival, ScanClosed) and not points and became.is_worth_telling:
                raise ProtocolError(f"{address}: not one point of the scan can be used: {became.words}")
    except (LinkError, ProtocolError) as error:
        if points or not became.is_worth_telling or isinstance(arrival, ScanClosed):
            raise
        raise type(error)(f"{error}; not one usable point came: {became.words}") from error


class _Became:
    """What became of the points of a scan, the largest share first."""

    def __init__(self) -> None:
        self._links, self._lost = list[str](), Counter[str]()
        self._rejected, self._damaged = Counter[str](), Counter[str]()

    def note(self, arrival: Arrival) -> None:
        if isinstance(arrival, LinkDown):
            self._links.append(arrival.reason)
        elif isinstance(arrival, Lost):
            self._lost[arrival.reason] += arrival.count
        elif isinstance(arrival, Rejected) and arrival.reason not in HARMLESS_REASONS:
            self._rejected[arrival.reason] += arrival.count
        elif isinstance(arrival, Damaged):
            self._damaged[arrival.reason] += arrival.byte_count

    @property
    def is_worth_telling(self) -> bool:
        return bool(self._rejected or self._damaged)

    @property
    def words(self) -> str:
        of_points = sorted(((self._lost, "lost"), (self._rejected, "rejected")), key=lambda told: -told[0].total())
        counts = [*((counted, f"points {what}") for counted, what in of_points), (self._damaged, "bytes damaged")]
        parts = [f"{told.total():,} {what} ({told.most_common(1)[0][0]})" for told, what in counts if told.total() > 0]
        if self._links:
            parts.append(f"the link was lost {_times(len(self._links))} ({self._links[0]})")
        return ", ".join(parts)


def _times(count: int) -> str:
    """How often something happened, for people."""
    return "once" if count == 1 else f"{count} times"
