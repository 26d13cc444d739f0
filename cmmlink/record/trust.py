"""What proves that a record is the one which was written: the signatures of its runs, whose keys they are, and heads kept elsewhere.

Without a key or a head from outside, the chain shows that a file fits together, and no more. The cases that are told apart: intact and
signed, signed by another key, intact but unsigned, altered, and cut off after a head that stands in an anchor.
"""

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from datetime import datetime
from pathlib import Path
from typing import Any, Literal

from cmmlink.errors import PlanError, StoreError
from cmmlink.record.anchors import Head
from cmmlink.record.bodies import pack_document, unpack_document
from cmmlink.record.chain import BEHIND_THE_END, GENESIS, Alteration, Record, problem_of
from cmmlink.record.handover import handovers_of, is_sound, of_one_station
from cmmlink.record.machine_answer import problem_of_answer
from cmmlink.record.origin import origin_of, original_chain_sha256
from cmmlink.record.seal import PUBLIC_FILE, station_name
from cmmlink.record.shapes import Header, checked
from cmmlink.record.signature import Signature, countersignature_in, key_id_of, signature_in
from cmmlink.record.store import Store
from cmmlink.record.timestamps import read_stamp
from cmmlink.words import utc_words

State = Literal["intact and signed", "signed by another key", "intact but unsigned", "altered", "cut off"]
Known = Literal["given", "station", "handed over", "another", "evidence"]


class AlteredError(Exception):
    """Something is not as it was written."""

    def __init__(self, alteration: Alteration) -> None:
        super().__init__(str(alteration))
        self.alteration = alteration


@dataclass(frozen=True, slots=True)
class RunTrusted:
    """One run whose chain is whole.

    end       : the number of the record that ends it, 0 where it has no end
    head      : the hash of its end at the station that measured it, empty where it has no end
    signature : None where nobody signed it
    stamped   : when authorities stamped its end, as they say
    later     : how many records that were added behind the end are not signed
    keys      : the public keys of those that are
    merged    : whether it was taken over from another station
    """

    run: str
    station: str
    end: int
    head: str
    signature: Signature | None
    stamped: tuple[datetime, ...]
    later: int
    keys: tuple[str, ...]
    merged: bool

    @property
    def is_signed(self) -> bool:
        """Whether the run is signed, and everything that was added to it later."""
        return self.signature is not None and not self.later

    @property
    def signed_by(self) -> set[str]:
        """The public keys of whoever signed its end, and what was added later."""
        return {*self.keys, *([self.signature.public_key] if self.signature else [])}


@dataclass(frozen=True, slots=True)
class Keys:
    """Which keys are known, and from where.

    given       : by whoever verifies, as digits or as an id; then no other counts
    station     : the public key beside the records, empty where there is none
    handed_over : keys of the same station of before and of afterwards, as both sides have signed
    """

    given: tuple[str, ...]
    station: str
    handed_over: frozenset[str]

    def known_as(self, key: str) -> Known:
        """From where a key is known."""
        if self.given:
            return "given" if key in self.given or key_id_of(key) in self.given else "another"
        if not self.station:
            return "evidence"
        return "station" if key == self.station else "handed over" if key in self.handed_over else "another"


def trust_in(store: Store, found: Mapping[str, Any], run: str | None, given: Sequence[str], heads: Sequence[Head] | None) -> dict[str, Any]:
    """What a check of the chain found, with what signatures and anchors say of the same records.

    found : as `check_chain` gives it, of one run or of all
    given : public keys that whoever verifies was given; see `public_key_given`
    heads : of anchors; None where none were given

    Raises StoreError where the records cannot be read.
    """
    cut = found["altered"] and bool(heads) and _is_cut_off(store, found)
    if found["altered"] and not cut:
        return {**found, "state": "altered", "signatures": None, "anchors": None, "timestamps": []}
    try:
        runs = list(_trusted_runs(store, None if cut else run))
        keys = _keys(store, given)
        ours = _heads_of(store, runs, run, heads or ())
        _compare(runs, ours)
    except AlteredError as error:
        first = found["first"] or {**asdict(error.alteration), "message": str(error)}
        return {**found, "altered": True, "first": first, "state": "altered", "signatures": None, "anchors": None, "timestamps": []}
    here = {one.run for one in runs if one.end}
    lost = list(dict.fromkeys(head.run for head in ours if head.run not in here))
    state: State = "cut off" if lost else "altered" if cut else _state(runs, keys)
    return {
        **found,
        "altered": cut or bool(lost),
        "state": state,
        "signatures": _signatures(runs, keys),
        "anchors": None if heads is None else _anchors(heads, ours, lost),
        "timestamps": [{"run": one.run, "chain_sha256": one.head, "stamped": utc_words(moment)} for one in runs for moment in one.stamped],
    }


def _trusted_runs(store: Store, run: str | None) -> Iterator[RunTrusted]:
    """Every run that is asked for. Raises AlteredError for the first that is not as it was written, though its chain is whole."""
    if run is None and (stray := store.stray_record()) is not None:
        raise AlteredError(Alteration(stray, "", "", "belongs to no run"))
    for begin, end in store.begins_and_ends():
        if run in (None, begin.run):
            yield _trusted(store, begin, end)


def _trusted(store: Store, begin: Record, end: Record | None) -> RunTrusted:
    run = str(begin.run)
    signatures = list(store.records(run, "signature"))
    if end is None:
        if signatures:
            raise AlteredError(Alteration(signatures[0].number, run, "signature", "stands in a run that has no end"))
        return RunTrusted(run, _station_of(begin), 0, "", None, (), 0, (), merged=False)
    added = store.added_behind(run, end.number)
    if added is not None:
        raise AlteredError(Alteration(added, run, "", "was added to a run that had ended"))
    for kind in BEHIND_THE_END:
        for record in store.records(run, kind):
            before = store.record_at(record.number - 1)
            if problem := problem_of(record, before.sha256 if before else GENESIS):
                raise AlteredError(Alteration(record.number, run, kind, problem))
    origin = origin_of(store, run)
    head = bytes(end.sha256).hex() if origin is None else original_chain_sha256(store, run) or ""
    if origin is not None and origin.chain_sha256 != head:
        raise AlteredError(Alteration(end.number, run, "end", "is not the end that the run had at the station which it was merged from"))
    if len(signatures) > 1:
        raise AlteredError(Alteration(signatures[1].number, run, "signature", "is a second signature of the run"))
    signature = _signature(store, signatures[0], end, head) if signatures else None
    _require_answer(store, end)
    later, keys = _countersigned(store, run)
    return RunTrusted(
        run, _station_of(begin), end.number, head, signature, tuple(_stamps(store, run, head)), later, keys, origin is not None
    )


def _stamps(store: Store, run: str, head: str) -> Iterator[datetime]:
    """When authorities stamped the end of a run. Raises AlteredError for a time stamp of anything else."""
    for record in store.records(run, "timestamp"):
        try:
            stamp = read_stamp(record.body)
        except StoreError as error:
            raise AlteredError(Alteration(record.number, run, record.kind, str(error))) from None
        if stamp.sha256.hex() != head:
            raise AlteredError(Alteration(record.number, run, record.kind, "stamps another end of the run, or another run"))
        yield stamp.moment


def _require_answer(store: Store, end: Record) -> None:
    """Raise AlteredError for an answer to the machine that the run cannot have given, and for a second one."""
    for count, record in enumerate(store.records(end.run, "answer"), start=1):
        problem = problem_of_answer(record, end) if count == 1 else "is a second answer to the machine"
        if problem:
            raise AlteredError(Alteration(record.number, record.run, record.kind, problem))


def _countersigned(store: Store, run: str) -> tuple[int, tuple[str, ...]]:
    """How many records behind the end of a run nobody signed, and the keys of the others. Raises AlteredError for a wrong signature."""
    left = [record for kind in ("answer", "anchors", "timestamp", "derived") for record in store.records(run, kind)]
    found, keys = list(store.records(run, "countersignature")), []
    if not found:
        return len(left), ()
    from cmmlink.record.keys import is_signed  # noqa: PLC0415 - as above

    for record in found:
        try:
            told = countersignature_in(store, record)
        except StoreError:
            raise AlteredError(Alteration(record.number, run, record.kind, "is no signature")) from None
        signed = next((one for one in left if told.is_of(one)), None)
        if signed is None or record.body != told.draft().body or (record.count, record.time_s) != (1, signed.time_s):
            raise AlteredError(Alteration(record.number, run, record.kind, "signs a record that is not as it was written, or is gone"))
        if told.key_id != key_id_of(told.public_key) or not is_signed(told.message, told.public_key, told.signature):
            raise AlteredError(Alteration(record.number, run, record.kind, "was not made with the key that it names"))
        left.remove(signed)
        keys.append(told.public_key)
    return len(left), tuple(keys)


def _signature(store: Store, record: Record, end: Record, head: str) -> Signature:
    """The signature of a run. Raises AlteredError where it is not one of its end."""
    from cmmlink.record.keys import is_signed  # noqa: PLC0415 - only who signs or verifies loads the library of signatures

    try:
        signature = signature_in(store, record)
    except StoreError:
        problem = "is no signature"
    else:
        if (signature.run, signature.chain_sha256) != (end.run, head):
            problem = "was made for another end of the run, or for another run"
        elif signature.key_id != key_id_of(signature.public_key) or not is_signed(
            signature.message, signature.public_key, signature.signature
        ):
            problem = "was not made with the key that it names"
        elif record.body != signature.draft().body or (record.count, record.time_s) != (1, end.time_s):
            problem = "is not as it was written"
        else:
            return signature
    raise AlteredError(Alteration(record.number, str(end.run), "signature", problem))


def _is_named_right(signature: Signature) -> bool:
    return signature.key_id == key_id_of(signature.public_key)


def _station_of(begin: Record) -> str:
    try:
        return checked(Header, unpack_document(begin.body)).station
    except StoreError:
        return ""


def _keys(store: Store, given: Sequence[str]) -> Keys:
    """The keys that are known. Raises AlteredError for a handover that not both keys have signed."""
    handovers = []
    for record, handover in handovers_of(store):
        if not is_sound(handover) or record.body != pack_document(handover.model_dump()) or record.count != 1:
            raise AlteredError(Alteration(record.number, "", "key", "the handover of a key is not as both keys signed it"))
        handovers.append(handover)
    station = _public_key(store.path.with_name(PUBLIC_FILE))
    return Keys(tuple(given), station, frozenset(of_one_station(station, handovers)) if station else frozenset())


def _public_key(file: Path) -> str:
    """The public key beside the records, empty where there is none that can be read."""
    if not file.exists():
        return ""
    from cmmlink.record.keys import public_key_given  # noqa: PLC0415 - as above

    try:
        return public_key_given(str(file))
    except PlanError:
        return ""


def _state(runs: Sequence[RunTrusted], keys: Keys) -> State:
    """How much is proven of runs that are as they were written: of several the least."""
    if not runs or not all(one.is_signed for one in runs):
        return "intact but unsigned"
    another = any(keys.known_as(key) == "another" for one in runs for key in one.signed_by)
    return "signed by another key" if another else "intact and signed"


def _signatures(runs: Sequence[RunTrusted], keys: Keys) -> dict[str, Any]:
    """Who signed how many runs, and which nobody did."""
    signed = Counter(key for one in runs for key in one.signed_by)
    told = [{"key_id": key_id_of(key), "public_key": key, "runs": signed[key], "known_as": keys.known_as(key)} for key in sorted(signed)]
    return {"signed": sum(one.is_signed for one in runs), "unsigned": [one.run for one in runs if not one.is_signed], "keys": told}


def _heads_of(store: Store, runs: Sequence[RunTrusted], run: str | None, heads: Sequence[Head]) -> list[Head]:
    """The heads in anchors that these records have to have: those of their stations, and of the runs that were merged into them.

    Records without a run have to have all of them.
    """
    if not heads:
        return []
    everything = runs if run is None else [_trusted(store, begin, end) for begin, end in store.begins_and_ends()]
    stations = {one.station or station_name(None) for one in everything if not one.merged}
    merged = {(one.station, one.run) for one in everything if one.merged}
    ours = [head for head in heads if not everything or head.station in stations or (head.station, head.run) in merged]
    return [head for head in ours if run in (None, head.run)]


def _compare(runs: Sequence[RunTrusted], heads: Sequence[Head]) -> None:
    """Raise AlteredError for the first run that does not end as it did when it was anchored."""
    known = {one.run: one for one in runs}
    for head in heads:
        one = known.get(head.run)
        if one is not None and one.end and one.head != head.chain_sha256:  # without an end, the run was cut off
            told = f"ends with {one.head or 'nothing'}, but when it was anchored, at {head.time}, it ended with {head.chain_sha256}"
            raise AlteredError(Alteration(one.end, one.run, "end", told))


def _is_cut_off(store: Store, found: Mapping[str, Any]) -> bool:
    """Whether all that is there is sound, and only the end is missing."""
    number = found["first"]["number"]
    return number > 0 and next(store.records_from(number), None) is None


def _anchors(heads: Sequence[Head], ours: Sequence[Head], lost: Sequence[str]) -> dict[str, Any]:
    """What anchors say: how many heads of these records they hold, which runs are not there, the last that is, and whose the others are."""
    there = [head.run for head in ours if head.run not in lost]
    others = Counter(head.station for head in set(heads) - set(ours))
    return {"heads": len(ours), "missing": list(lost), "last": there[-1] if there else None, "others": dict(sorted(others.items()))}
