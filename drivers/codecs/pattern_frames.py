"""Lines of text by a pattern of the user's own: a regular expression with the groups x, y and z, and seq for the number of the point.

Every line has to be a point, or the end, or of a kind that is passed over; what is none of these is damaged. Coordinates that the pattern
has no group for are 0. A machine that prints no numbers cannot show that a line was lost.
"""

import re

from drivers.codecs.text_lines import FEATURES, NO_REQUEST, is_feature_print, number_of, request_in, unit_in_mm
from drivers.codecs.touches import TouchLines
from drivers.errors import ProtocolError
from drivers.source import ScanOpened

LONGEST_PATTERN = 500
_AXES = ("x", "y", "z")
_SEQUENCE = re.compile(r"[0-9]{1,9}")


def compiled(pattern: str) -> re.Pattern[str]:
    """The pattern of a line. Raises ValueError for one that is none, or too long."""
    if len(pattern) > LONGEST_PATTERN:
        raise ValueError(f"a pattern of {len(pattern)} characters; at most {LONGEST_PATTERN} are read")
    try:
        return re.compile(pattern)
    except (re.error, OverflowError, RecursionError) as error:
        raise ValueError(f"pattern {pattern!r:.80} is no regular expression: {error}") from None


def point_pattern(pattern: str) -> re.Pattern[str]:
    """The pattern of a line with a point. Raises ValueError where it is none, or has not two of the groups x, y and z."""
    found = compiled(pattern)
    unknown = sorted(found.groupindex.keys() - {*_AXES, "seq"})
    if unknown or len(found.groupindex.keys() & set(_AXES)) < 2:
        told = f"the group {unknown[0]}" if unknown else "fewer than two of the groups x, y and z"
        raise ValueError(f"pattern {pattern!r:.80} has {told}; it names x, y, z and seq, like X(?P<x>[-+ .0-9]+) Y(?P<y>[-+ .0-9]+)")
    return found


def request_pattern(pattern: str) -> re.Pattern[str]:
    """The pattern of the line with the number of a request. Raises ValueError where it is none, or has another group than number."""
    found = compiled(pattern)
    if set(found.groupindex) != {"number"}:
        raise ValueError(f"request {pattern!r:.80} has not the one group number, like REQUEST(?P<number>[ 0-9]+)")
    return found


class PatternDecoder(TouchLines):
    """Lines that a pattern describes to points in millimetres."""

    def __init__(
        self,
        pattern: str,
        unit: str,
        end: str | None = None,
        pass_over: str | None = None,
        points: int | None = None,
        parity: str = "",
        request: str | None = None,
    ) -> None:
        """Take what the lines look like.

        pattern   : of a line with a point: the groups x, y, z and seq
        unit      : mm or inch
        end       : the pattern of the line that ends the scan
        pass_over : the pattern of lines that mean nothing
        points    : the scan ends after so many points, whether they came or are known to be missing
        parity    : even or odd, where the bytes carry it as their eighth bit
        request   : the pattern of the line with the number by which the control asks for a verdict: the group number
        """
        if end is None and points is None:
            raise ValueError("neither end nor points says how the scan ends; name the line that ends it, or the number of points")
        if points is not None and points < 1:
            raise ValueError(f"points is {points}; a scan has at least 1")
        self._pattern = point_pattern(pattern)
        self._end = None if end is None else compiled(end)
        self._pass_over = None if pass_over is None else compiled(pass_over)
        self._points = points
        self._asks = None if request is None else request_pattern(request)
        self._request: int | None = None
        super().__init__(unit_in_mm(unit), parity)
        self._opened = False

    def _take_line(self, line: str, size: int) -> None:
        if found := self._pattern.fullmatch(line):
            self._take_point(found, line, size)
        elif self._end is not None and self._end.fullmatch(line):
            self._touches.close(size)
        elif self._asks is not None and (found := self._asks.fullmatch(line)):
            self._take_request(found["number"] or "", size)
        elif self._pass_over is not None and self._pass_over.fullmatch(line):
            return
        elif is_feature_print(line) and not self._opened:
            raise ProtocolError(FEATURES)
        else:
            self._touches.damage(size, "line that the pattern does not describe")

    def _take_request(self, told: str, size: int) -> None:
        """Take the number of a request. Behind points it shows that the control began its cycle anew."""
        self._request = request_in(told)
        if self._request is None:
            self._touches.damage(size, NO_REQUEST)
        if self._opened:
            self._opened = False
            self._touches.begin_stretch()

    def _take_point(self, found: re.Match[str], line: str, size: int) -> None:
        fields = found.groupdict()
        values = [0.0 if axis not in fields else number_of(fields[axis] or "") for axis in _AXES]
        x, y, z = values
        number = (fields.get("seq") or "").strip()
        if x is None or y is None or z is None or ("seq" in fields and not _SEQUENCE.fullmatch(number)):
            self._touches.damage(size, "line of the pattern whose groups are no numbers")
            return
        if not self._opened:
            self._opened = True
            self._touches.out.append(ScanOpened("", "", None, self._request))
        self._touches.take(int(number) if "seq" in fields else None, (x, y, z), hash(line))
        if self._points is not None and self._touches.count >= self._points:
            self._touches.close(size)


DECODERS = {"pattern": PatternDecoder}
UNSEEN = {
    "pattern": "lines of text carry no checksum, so a garbled digit is a wrong point unless a parity bit shows it, and a lost line shows "
    "only where they are numbered"
}
