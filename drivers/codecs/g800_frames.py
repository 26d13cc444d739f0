r"""The language of inspection on machine tools (G800 and G801 lines, "MSR"), which the posts of CAM systems make controls print.

    START                           opens a set; a stream or a file may hold several
    RESULTSFILE name                each of these may miss, and their order varies; RESULTSFILE stands before START, too
    DOCUMENTID ..  MODELVERSION ..  TIMESTAMP ..  TOOLPATHID ..  TOOLPATH ..
    REQUEST 42                      the number by which the control asks for a verdict, where its program prints one; it begins a set, too
    G331 N.. A.. B.. C.. X.. Y.. Z..          the plane of the model
    G330 N.. A.. B.. C.. X.. Y.. Z.. I.. R..  the work plane
    G800 N1 X.. Y.. Z.. I.. J.. K.. O.. U.. L..   a nominal point, the direction out of the material, offset, tolerance
    G801 N1 X.. Y.. Z.. R..                   what was measured: the centre of the ball, and its radius
    G802 N1 DEVIATION ..                      what the control made of it, which is passed over
    END                             closes the set

Lines and numbers are as `text_lines` says. No line carries a unit or a checksum. A G800 line that is labelled G801 is known by its
direction. A nominal point without its measured one was not touched, which the next measured point or the end of the toolpath
shows. How numbers run on from one toolpath to the next no description at hand says, so they may begin anew with each.
"""

import re
from collections.abc import Mapping

from drivers.codecs.text_lines import FEATURES, NO_REQUEST, NUMBER, is_feature_print, number_of, request_in, unit_in_mm
from drivers.codecs.touches import MODULUS, TouchLines
from drivers.errors import ProtocolError
from drivers.source import ScanOpened

MOST_WAITING = 1024  # nominal points that wait for their measured one; of more the oldest counts as not touched
NO_CONTACT = "nominal point without a measured one: the probe touched nothing"
NO_NOMINAL = "measured point whose nominal point (G800) did not come"
OTHER_PLANE = "point taken after the planes of the points (G330, G331) were changed within the set"

_WORD = re.compile(rf"([A-Z]) *({NUMBER}) *")
_WORDS = re.compile(rf"(?:[A-Z] *{NUMBER} *)+")
_CODED = re.compile(r"G *(330|331|800|801|802) +(.*)")
_HEADINGS = re.compile(r"(RESULTSFILE|DOCUMENTID|MODELVERSION|TIMESTAMP|TOOLPATHID|TOOLPATH)(?: +(.*))?")
_REQUEST = re.compile(r"REQUEST *([-+ .0-9]*)")
_NAMES = ("RESULTSFILE", "DOCUMENTID")
_OF_NOMINALS = frozenset("IJKOUL")


class G800Decoder(TouchLines):
    """Lines of the language to points in millimetres; one set is one scan."""

    def __init__(
        self, unit: str, tip_radius_mm: float | None = None, radius_tolerance_mm: float = 0.002, set_name: str = "", parity: str = ""
    ) -> None:
        """Take what the lines do not tell.

        unit          : mm or inch
        tip_radius_mm : the radius of the ball by the plan; a point of another R is rejected; None: R is not looked at
        set_name      : the RESULTSFILE or DOCUMENTID of the set to take, others being passed over; nothing: the first one
        parity        : even or odd, where the bytes carry it as their eighth bit
        """
        self._mm_per_unit = unit_in_mm(unit)
        self._radius_mm, self._tolerance_mm = tip_radius_mm, radius_tolerance_mm
        self._wanted = set_name
        super().__init__(self._mm_per_unit, parity)
        self._names = dict[str, str]()
        self._request: int | None = None
        self._names_are_old = False  # those of a set that has points, and its request with them
        self._begin()

    def _begin(self) -> None:
        """Forget what was said of the set before."""
        self._waiting = dict[int, None]()  # numbers of nominal points without their measured one, in their order
        self._started = self._opened = self._passed_over = self._planes_changed = self._has_nominals = False
        self._planes = dict[str, str]()
        self._letters: frozenset[str] | None = None

    def _damage(self, byte_count: int, reason: str) -> None:
        if not self._passed_over:
            self._touches.damage(byte_count, reason)

    def _take_line(self, line: str, size: int) -> None:
        if coded := _CODED.fullmatch(line):
            self._take_coded(coded[1], coded[2], line, size)
        elif heading := _HEADINGS.fullmatch(line):
            self._take_heading(heading[1], (heading[2] or "").strip())
        elif asked := _REQUEST.fullmatch(line):
            self._take_request(asked[1], size)
        elif line == "START":
            self._start()
        elif line == "END":
            self._end(size)
        elif is_feature_print(line) and not self._opened:
            raise ProtocolError(FEATURES)
        else:
            self._damage(size, "line of unknown form")

    def _take_heading(self, name: str, value: str) -> None:
        if name in _NAMES:
            self._forget_old_names()
            self._names[name] = value
        elif name.startswith("TOOLPATH"):
            self._end_stretch()

    def _take_request(self, told: str, size: int) -> None:
        """Take the number of a request, which belongs to the set that follows. Behind points it shows that the cycle began anew."""
        if self._opened or self._passed_over:
            self._end_stretch()
            self._begin()
        self._forget_old_names()
        self._request = request_in(told)
        if self._request is None:
            self._damage(size, NO_REQUEST)

    def _start(self) -> None:
        """Begin a set. The names that stand before it are its own."""
        self._end_stretch()
        self._begin()
        self._forget_old_names()
        self._started = True

    def _end(self, size: int) -> None:
        """End the set. The end of one that is passed over, or whose beginning and points did not come, is not that of the scan."""
        self._end_stretch()
        is_it = self._opened or (self._started and not self._passed_over and self._is_wanted)
        self._begin()
        self._names_are_old = True
        if is_it:
            self._touches.close(size)

    def _end_stretch(self) -> None:
        """The numbers of a toolpath are over: what still waits was not touched."""
        self._miss_before(MODULUS)
        self._touches.begin_stretch()

    def _forget_old_names(self) -> None:
        if self._names_are_old:
            self._names.clear()
            self._request = None
        self._names_are_old = False

    @property
    def _is_wanted(self) -> bool:
        return not self._wanted or self._wanted in self._names.values()

    def _take_coded(self, code: str, rest: str, line: str, size: int) -> None:
        if code == "802" or self._passed_over:
            return
        words = _words_in(rest)
        number = None if words is None else words.get("N")
        if words is None or number is None or not (0 <= number < 1e9 and number.is_integer()):
            self._damage(size, f"G{code} line of unknown form")
        elif code in ("330", "331"):
            self._take_plane(code, words)
        else:
            self._take_point(code, int(number), words, line, size)

    def _take_plane(self, code: str, words: Mapping[str, float]) -> None:
        """Points of one set are taken to lie in one frame: a plane that changes behind the first of them moves the frame."""
        plane = repr({letter: value for letter, value in words.items() if letter != "N"})
        if self._opened and self._planes.get(code, plane) != plane:
            self._planes_changed = True
        self._planes[code] = plane

    def _take_point(self, code: str, number: int, words: Mapping[str, float], line: str, size: int) -> None:
        self._names_are_old = True
        if not self._opened and not self._is_wanted:
            self._passed_over = True
            return
        self._open()
        if code == "800" or _OF_NOMINALS & words.keys():
            self._take_nominal(number)
            return
        letters = frozenset(words)
        if not letters >= {"X", "Y", "Z"} or letters != (self._letters or letters):
            self._damage(size, "G801 line without the words that a measured point has")
            return
        self._letters = letters
        refusal = self._refusal(number, words)
        self._waiting.pop(number, None)
        self._miss_before(number)
        self._touches.take(number, (words["X"], words["Y"], words["Z"]), hash(line), refusal)

    def _take_nominal(self, number: int) -> None:
        self._has_nominals = True
        self._waiting[number] = None
        if len(self._waiting) > MOST_WAITING:
            self._miss_before(next(iter(self._waiting)) + 1)

    def _miss_before(self, number: int) -> None:
        """Points are touched in their order: what waits before one that came was not touched."""
        while self._waiting and (oldest := next(iter(self._waiting))) < number:
            del self._waiting[oldest]
            self._touches.miss(oldest, NO_CONTACT)

    def _refusal(self, number: int, words: Mapping[str, float]) -> str:
        """Why a measured point cannot be used; nothing where it can."""
        radius_mm = words["R"] * self._mm_per_unit if "R" in words else None
        if self._has_nominals and number not in self._waiting:
            return NO_NOMINAL
        if self._planes_changed:
            return OTHER_PLANE
        if radius_mm is not None and self._radius_mm is not None and abs(radius_mm - self._radius_mm) > self._tolerance_mm:
            return f"radius R of the ball is not the plan's {self._radius_mm:g} mm (probe.tip_radius_mm)"
        return ""

    def _open(self) -> None:
        if not self._opened:
            self._opened = True
            self._touches.out.append(ScanOpened(" ".join(("G800", *self._names.values())), "", None, self._request))


def _words_in(text: str) -> dict[str, float] | None:
    """The numbers of a line by their letters; None where anything else stands on it, or a letter twice."""
    if not _WORDS.fullmatch(text):
        return None
    found = {letter: number_of(number) for letter, number in _WORD.findall(text)}
    values = {letter: number for letter, number in found.items() if number is not None}
    return values if len(values) == len(_WORD.findall(text)) else None


DECODERS = {"g800": G800Decoder}
UNSEEN = {
    "g800": "lines of text carry no checksum, so a garbled digit is a wrong point unless a parity bit shows it; coordinates are taken "
    "as they are written, whatever the planes G330 and G331 say, and the tolerances in the lines are not used"
}
