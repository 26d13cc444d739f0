"""What can go wrong with a device and its line: a catalogue of faults with names, and their injection.

A fault is written `NAME[:VALUE][@POINT[-STOP]]`: from point number POINT on (default: from the start) up to before STOP (default:
the end), with VALUE as the catalogue says. The same seed gives the same faults.
"""

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Literal

import numpy as np

Only = Literal["", "registers", "dme", "lines"]
"""A kind of devices that some faults strike alone: Modbus registers, measuring machines, machine tools; nothing for all others."""


@dataclass(frozen=True, slots=True)
class FaultKind:
    """One entry of the catalogue: what the value means and what it is if not given; `once` acts at its point only.

    only : the kinds of devices that it can strike; empty: all
    """

    meaning: str
    default: float
    once: bool = False
    only: tuple[Only, ...] = ()


CATALOGUE: Mapping[str, FaultKind] = MappingProxyType(
    {
        "flip": FaultKind("share of bytes in which one random bit is turned over", 1e-4),
        "lost-bytes": FaultKind("share of bytes that vanish", 1e-4),
        "inserted-bytes": FaultKind("share of bytes before which a random byte appears", 1e-4),
        "burst": FaultKind("number of bytes replaced by random ones", 300, once=True),
        "lost-frames": FaultKind("share of points whose frame is not sent", 0.01),
        "repeated-frames": FaultKind("share of points whose frame is sent twice", 0.01),
        "reordered-frames": FaultKind("share of points whose frame is sent after the following one", 0.01),
        "invalid": FaultKind("share of points that the device marks invalid", 0.01),
        "gap": FaultKind("number of frames in a row that are not sent", 50, once=True),
        "stall": FaultKind("seconds without points, the device being alive", 1.0, once=True),
        "silence": FaultKind("seconds without any byte", math.inf, once=True),
        "unplug": FaultKind("seconds for which the line is gone", 0.5, once=True),
        "restart": FaultKind("seconds for which the device is gone before it begins its scan anew", 0.5, once=True),
        "slow": FaultKind("seconds that each Modbus answer takes from then on", 0.3, only=("registers",)),
        "word-swap": FaultKind("1: the halves of 32-bit numbers in Modbus registers come swapped", 1, only=("registers",)),
        "sentinel": FaultKind("share of points whose registers hold the value for none", 0.01, only=("registers",)),
        "overflow": FaultKind("number of points that a full Modbus buffer costs; its flag stays set", 20, once=True, only=("registers",)),
        "torn-line": FaultKind("largest number of bytes that the network carries in one piece", 7, only=("dme",)),
        "split-points": FaultKind("share of I++ lines whose last point goes on in the next line", 0.1, only=("dme",)),
        "wrong-tag": FaultKind("share of I++ data lines under the tag of another command", 0.01, only=("dme",)),
        "lone-lf": FaultKind("share of I++ data lines that end with line feed alone", 0.01, only=("dme",)),
        "early-data": FaultKind("1: data of an I++ scan come before its acknowledgement", 1, once=True, only=("dme",)),
        "no-complete": FaultKind("1: the I++ server does not say that its scan is complete", 1, once=True, only=("dme",)),
        "jog-key": FaultKind("1: somebody presses a key of the jog box while the machine scans", 1, once=True, only=("dme",)),
        "emergency-stop": FaultKind("1: somebody presses the emergency stop while the machine scans", 1, once=True, only=("dme", "lines")),
        "tool-change": FaultKind("1: somebody changes the tool by hand while the machine scans", 1, once=True, only=("dme", "lines")),
        "no-surface": FaultKind("1: the probe of the machine finds no surface any more", 1, once=True, only=("dme",)),
        "cut-line": FaultKind("1: the link is cut in the middle of an I++ line", 1, once=True, only=("dme",)),
        "bare-cause": FaultKind("1: the causes of I++ errors come without quotes", 1, only=("dme",)),
        "not-homed": FaultKind("1: the machine does not know where it is before it is sent home", 1, only=("dme",)),
        "no-contact": FaultKind("share of nominal points that the probe of a machine tool does not touch", 0.01, only=("lines",)),
        "mislabelled": FaultKind("share of nominal points that a machine tool labels as measured", 0.01, only=("lines",)),
        "old-set": FaultKind("1: the results of another part stand before those of this one", 1, only=("lines",)),
        "no-end": FaultKind("1: the machine tool does not print the end of its results", 1, only=("lines",)),
        "cr-only": FaultKind("1: lines end with carriage return alone", 1, only=("lines",)),
        "inch": FaultKind("1: the control measures in inches", 1, only=("lines",)),
        "parity": FaultKind("1: every byte carries its even parity as its eighth bit, as on a line of seven data bits", 1, only=("lines",)),
        "die": FaultKind("exit status with which the device ends at once", 9, once=True),
    }
)


@dataclass(frozen=True, slots=True)
class Fault:
    """One fault as asked for."""

    name: str
    value: float
    at: int
    stop: float = math.inf

    @classmethod
    def parse(cls, text: str) -> "Fault":
        """Read `NAME[:VALUE][@POINT[-STOP]]`."""
        head, _, place = text.partition("@")
        at, _, stop = place.partition("-")
        name, _, value = head.partition(":")
        kind = CATALOGUE.get(name)
        if kind is None:
            raise ValueError(f"fault {name!r} is none of {', '.join(CATALOGUE)}")
        try:
            return cls(name, float(value) if value else kind.default, int(at) if at else 0, int(stop) if stop else math.inf)
        except ValueError:
            raise ValueError(f"fault {text!r}: expected NAME[:VALUE][@POINT[-STOP]] with a number each") from None

    def lasts(self, index: int) -> bool:
        """Tell whether the fault strikes at this point, as far as its place goes."""
        return self.at <= index < self.stop


def refuse_others(faults: Sequence[Fault], kind: Only) -> None:
    """Raise ValueError for a fault that cannot strike a device of this kind."""
    names: Mapping[Only, str] = {"registers": "Modbus devices", "dme": "measuring machines", "lines": "machine tools"}
    for fault in faults:
        only = CATALOGUE[fault.name].only
        if only and kind not in only:
            raise ValueError(f"fault {fault.name!r} strikes {' and '.join(names[one] for one in only)} only")


class Injector:
    """Lets the faults happen to one scan, and counts what it did."""

    def __init__(self, faults: Sequence[Fault], seed: int) -> None:
        self._faults = tuple(faults)
        self._rng = np.random.default_rng(seed)
        self._held: bytes | None = None
        self._index = 0
        self._done: set[Fault] = set()
        self._without_value: dict[int, bool] = {}
        self.tally: Counter[str] = Counter()

    def marks_invalid(self, index: int) -> bool:
        """Tell whether the device marks this point invalid."""
        return self._strikes("invalid", index)

    def pass_on(self, index: int, frame: bytes) -> bytes:
        """Return what of this point's frame, and of one held back before, goes out."""
        self._index = index
        if self._strikes("lost-frames", index) or self._is_in_gap(index):
            return b""
        if self._held is None and self._strikes("reordered-frames", index):
            self._held = frame
            return b""
        return frame * (2 if self._strikes("repeated-frames", index) else 1) + self.release()

    def release(self) -> bytes:
        """Return the frame held back, if any."""
        frame, self._held = self._held or b"", None
        return frame

    def strike(self, name: str, index: int) -> float | None:
        """Return the value of a fault that strikes at this point, once."""
        for fault in self._faults:
            if fault.name == name and fault.at <= index and fault not in self._done:
                self._done.add(fault)
                self.tally[name] += 1
                return fault.value
        return None

    def lacks_value(self, index: int) -> bool:
        """Tell whether this point has no value; the same however often it is asked."""
        if index not in self._without_value:
            self._without_value[index] = self._strikes("sentinel", index)
        return self._without_value[index]

    def points_stored_at(self, index: int) -> list[int]:
        """Return which points, by their numbers, are stored when this one is taken: none, it, or it twice, or it and one held back."""
        stored = self.pass_on(index, index.to_bytes(8, "big"))
        return [int.from_bytes(stored[at : at + 8], "big") for at in range(0, len(stored), 8)]

    def expects(self, name: str) -> bool:
        """Tell whether a fault was asked for at all."""
        return any(fault.name == name for fault in self._faults)

    def lasting_value(self, name: str, index: int) -> float:
        """Return the value of a fault that lasts from its point on; 0 before."""
        return self._share(name, index)

    def strikes(self, name: str, index: int) -> bool:
        """Tell whether a fault that strikes a share of the points strikes this one."""
        return self._strikes(name, index)

    def note_progress(self, index: int) -> None:
        """Take note of how far the scan is."""
        self._index = index

    def next_stop(self, index: int, due: int) -> int:
        """Return `due`, or the point before it at which something is to happen once, or a fault that has an end begins or ends."""
        once = [fault.at for fault in self._faults if CATALOGUE[fault.name].once]
        borders = [border for fault in self._faults if fault.stop < math.inf for border in (fault.at, int(fault.stop))]
        return min((point for point in once + borders if index < point < due), default=due)

    def damage(self, data: bytes) -> bytes:
        """Return the bytes as the line delivers them."""
        for name in ("lost-bytes", "inserted-bytes", "flip"):
            share = self._share(name, self._index)
            if share and data:
                data = self._scatter(name, share, data)
        size = self.strike("burst", self._index) if data else None
        if size is not None:
            length = min(int(size), len(data))
            data = self._rng.bytes(length) + data[length:]
        return data

    def _scatter(self, name: str, share: float, data: bytes) -> bytes:
        array = np.frombuffer(data, dtype=np.uint8)
        struck = np.flatnonzero(self._rng.random(len(array)) < share)
        if not len(struck):
            return data
        self.tally[name] += len(struck)
        if name == "lost-bytes":
            return np.delete(array, struck).tobytes()
        if name == "inserted-bytes":
            return np.insert(array, struck, self._rng.integers(0, 256, len(struck), dtype=np.uint8)).tobytes()
        flipped = array.copy()
        flipped[struck] ^= (1 << self._rng.integers(0, 8, len(struck))).astype(np.uint8)
        return flipped.tobytes()

    def _share(self, name: str, index: int) -> float:
        return max((fault.value for fault in self._faults if fault.name == name and fault.lasts(index)), default=0.0)

    def _strikes(self, name: str, index: int) -> bool:
        share = self._share(name, index)
        struck = share > 0 and self._rng.random() < share
        self.tally[name] += struck
        return bool(struck)

    def _is_in_gap(self, index: int) -> bool:
        struck = any(fault.name == "gap" and fault.at <= index < fault.at + fault.value for fault in self._faults)
        self.tally["gap"] += struck
        return struck
