"""What opens the station: a token that is kept in memory alone, and codes that are exchanged for it once.

Addresses carry a code and never the token, because whatever stands on a browser's command line can be read by every program of this
computer. A code opens one page, within a minute. Whoever comes second with it is refused, and the station hears of it.
"""

import hmac
import secrets
import threading
from collections.abc import Callable
from typing import Literal

VALID_S = 60.0
_MOST_CODES = 32  # that wait for their page; the oldest goes
_BYTES = 32

Redeemed = Literal["opened", "used", "unknown"]


class Keys:
    """The token and the codes of one station. Any thread may ask.

    clock : monotonic, s
    """

    def __init__(self, clock: Callable[[], float], token: str | None = None) -> None:
        self._clock = clock
        self._lock = threading.Lock()
        self._token = token or secrets.token_urlsafe(_BYTES)
        self._until_s: dict[str, float] = {}  # of a code; in the order of their making
        self._used: dict[str, float] = {}

    @property
    def token(self) -> str:
        """What a page must know."""
        return self._token

    def new_code(self) -> str:
        """A code that opens one page within `VALID_S`."""
        code = secrets.token_urlsafe(_BYTES)
        with self._lock:
            self._forget_old()
            while len(self._until_s) >= _MOST_CODES:
                del self._until_s[next(iter(self._until_s))]
            self._until_s[code] = self._clock() + VALID_S
        return code

    def redeem(self, code: object) -> Redeemed:
        """Exchange a code: it is `opened` once, `used` when somebody came before, and else `unknown`."""
        if not isinstance(code, str):
            return "unknown"
        with self._lock:
            self._forget_old()
            if code in self._until_s:
                self._used[code] = self._until_s.pop(code)
                return "opened"
            return "used" if code in self._used else "unknown"

    def renew(self) -> None:
        """Make a new token and forget every code: who came in before has to come in again."""
        with self._lock:
            self._token = secrets.token_urlsafe(_BYTES)
            self._until_s.clear()

    def knows(self, given: object) -> bool:
        """Whether somebody gave the right token; takes as long for a wrong one."""
        return isinstance(given, str) and hmac.compare_digest(given.encode("utf-8", "replace"), self._token.encode())

    def _forget_old(self) -> None:
        now_s = self._clock()
        for codes in (self._until_s, self._used):
            for code in [code for code, until_s in codes.items() if until_s <= now_s]:
                del codes[code]
