"""How a link is opened, and how long its silence and its loss are borne: the same for streams and registers."""

from dataclasses import dataclass
from typing import Literal


@dataclass(frozen=True, slots=True)
class LinkSettings:
    """The settings of one link.

    baud_rate     bits per second of a serial line; over TCP it means nothing
    parity        none, even or odd, of a serial line
    silence_s     a link over which nothing new comes for so long counts as lost
    reconnect_s   a lost link is tried again for so long; 0: the first loss ends the scan
    """

    baud_rate: int
    parity: Literal["N", "E", "O"]
    silence_s: float = 3.0
    reconnect_s: float = 0.0
