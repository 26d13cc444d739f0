"""How a replay compares with the recorded run: to the last bit, and where it does not agree so far, by what was decided.

The last bits of a number may depend on the processor and on the libraries: these add in another order, or fuse a product with a sum. A
decision must not. It is what was decided of the part, of every characteristic and of every point, without any number that was computed.
"""

import hashlib
import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import zip_longest
from typing import TYPE_CHECKING, Any

import numpy as np

from cmmlink.record.bodies import pack_document, unpack_judged
from cmmlink.record.derived import Change
from cmmlink.record.kept_result import judged_bodies
from cmmlink.record.reader import RecordedRun
from cmmlink.record.recorder import result_sha256
from cmmlink.record.store import Store
from cmmlink.record.surface_bodies import unpack_surface
from cmmlink.surface_rows import SurfaceRows
from inspection import InspectionResult, JudgedRows

if TYPE_CHECKING:
    from inspection.surface import SurfaceResult

Unpack = Callable[[bytes], JudgedRows | SurfaceRows]

LAST_BITS = 1e-9  # mm; degrees for angles: numbers that lie no farther apart are the same but for how they were computed
_DECIDED = ("verdict", "received", "judged", "rejected", "lost", "damaged_bytes", "rejected_by_reason", "out_of_tolerance", "complete")


@dataclass(frozen=True, slots=True)
class Agreement:
    """How a replay compares with the recorded run.

    identical       : to the last bit of every deviation; None where the recorded run has no result to compare with
    differs         : values of the result that are not as recorded
    result_sha256   : of all that was found, as the end of a run keeps it: where the replay is identical, that of the record
    same_decision   : the same was decided of the part, of every characteristic and of every point; None as above
    decision_sha256 : of what was decided
    apart           : how far a deviation or the value of a characteristic lies from the recorded one at most, in its unit; None as above
    """

    identical: bool | None
    differs: tuple[Change, ...]
    result_sha256: str
    same_decision: bool | None
    decision_sha256: str
    apart: float | None

    @property
    def holds(self) -> bool:
        """Whether the recorded result was found again, if not to the last bit."""
        return bool(self.same_decision) and self.apart is not None and self.apart <= LAST_BITS

    @property
    def words(self) -> str:
        """How a replay that is not identical compares."""
        if not self.same_decision or self.apart is None:
            return "another decision than the recorded one"
        told = "the same decision as recorded, of the part, of every characteristic and of every point"
        why = ", as they may on another processor or with other versions" if self.holds else ""
        far = f"numbers lie at most {self.apart:.2g} apart{why}" if math.isfinite(self.apart) else "not every number is there in both"
        return f"{told}; {far}"


def compare(
    store: Store, recorded: RecordedRun, replayed: Mapping[str, Any], result: "InspectionResult | SurfaceResult | None"
) -> Agreement:
    """Hold a replay against the recorded run. What a later version of cmmlink tells as well is no difference."""
    differs = tuple(differences_of(recorded.result, replayed)) if recorded.result is not None else ()
    same = replayed if differs or recorded.result is None else recorded.result
    unpack: Unpack = unpack_surface if recorded.is_of_surface else unpack_judged
    decided = _Decided(unpack)
    sha256 = result_sha256(same, decided.noting(body for _, body in judged_bodies(result)))
    decision = decided.sha256(decision_of(same))
    if recorded.end is None or not recorded.end["result_sha256"]:
        return Agreement(None, differs, sha256, None, decision, None)
    if sha256 == recorded.end["result_sha256"] and not differs:
        return Agreement(True, (), sha256, True, decision, 0.0)
    if not differs:
        differs = (Change("deviations", "as recorded", "differ in the last bits; nothing of the summary does"),)
    if recorded.result is None:
        return Agreement(False, differs, sha256, False, decision, None)
    known = decision_of(recorded.result)
    rows, kept = _Decided(unpack), (record.body for record in store.records(recorded.run, "deviations"))
    apart = _farthest(unpack, rows.noting(kept), (body for _, body in judged_bodies(result)))
    there = {key: value for key, value in decision_of(replayed).items() if key in known}
    alike = rows.sha256(known) == decided.sha256(there)
    return Agreement(False, differs, sha256, alike, decision, max(apart, _values_apart(recorded.result, replayed)))


def decision_of(result: Mapping[str, Any]) -> dict[str, Any]:
    """What a result decides, with the counts of points it rests on and the kinds of its reasons; no computed number."""
    told = {key: result[key] for key in _DECIDED if key in result}
    lists = {"reasons": ("kind",), "characteristics": ("name", "verdict")}
    return told | {name: [[one[key] for key in keys] for one in result[name]] for name, keys in lists.items() if name in result}


class _Decided:
    """Hashes what was decided of every point, while rows pass by."""

    def __init__(self, unpack: Unpack) -> None:
        self._unpack = unpack
        self._verdicts, self._rejections = hashlib.sha256(), hashlib.sha256()

    def noting(self, bodies: Iterable[bytes]) -> Iterator[bytes]:
        for body in bodies:
            rows = self._unpack(body)
            self._verdicts.update(rows.verdicts.tobytes())
            self._rejections.update(rows.rejection.tobytes())
            yield body

    def sha256(self, decision: Mapping[str, Any]) -> str:
        return hashlib.sha256(pack_document(decision) + self._verdicts.digest() + self._rejections.digest()).hexdigest()


def _farthest(unpack: Unpack, recorded: Iterable[bytes], replayed: Iterable[bytes]) -> float:
    """The largest difference of a point's deviations, in mm; infinity where one of them has no such point, or no deviation of it."""
    farthest = 0.0
    for before, now in zip_longest(map(unpack, recorded), map(unpack, replayed)):
        farthest = max(farthest, _rows_apart(before, now))
    return farthest


def _rows_apart(before: JudgedRows | SurfaceRows | None, now: JudgedRows | SurfaceRows | None) -> float:
    if before is None or now is None or before.received != now.received:
        return np.inf
    known = np.isfinite(before.deviation_mm)
    if (known != np.isfinite(now.deviation_mm)).any():
        return np.inf
    return float(np.abs(before.deviation_mm - now.deviation_mm)[known].max(initial=0.0))


def _values_apart(recorded: Mapping[str, Any], replayed: Mapping[str, Any]) -> float:
    """The largest difference of the values of a characteristic."""
    found = {one["name"]: one for one in replayed.get("characteristics", ())}
    farthest = 0.0
    for before in recorded.get("characteristics", ()):
        value, now = before.get("value"), found.get(before["name"], {}).get("value")
        if (value is None) != (now is None):
            return np.inf
        farthest = max(farthest, abs(value - now) if value is not None else 0.0)
    return farthest


def differences_of(recorded: Any, replayed: Any, key: str = "") -> Iterator[Change]:
    """Name the recorded values that are not found again, by their path."""
    if isinstance(recorded, Mapping) and isinstance(replayed, Mapping):
        for name in recorded:
            prefix = key if not key or key.endswith(".") else key + "."
            yield from differences_of(recorded.get(name), replayed.get(name), prefix + name)
    elif _is_list(recorded) and _is_list(replayed):
        if len(recorded) != len(replayed):
            yield Change(f"{key} (how many)", len(recorded), len(replayed))
            return
        for index, (before, now) in enumerate(zip(recorded, replayed, strict=True)):
            yield from differences_of(before, now, f"{key}[{index}]")
    elif pack_document(recorded) != pack_document(replayed):
        yield Change(key, recorded, replayed)


def _is_list(value: Any) -> bool:
    return isinstance(value, Sequence) and not isinstance(value, str)
