"""The keys of what is said of the records themselves: who signed them, whether they were altered, of backups and of merging."""

from typing import Any, Literal

from pydantic import Field

from cmmlink.inspection_keys import JsonObject
from cmmlink.words import VerdictName


class RecordsCopied(JsonObject):
    """The answer of `backup`, `restore` and `merge`."""

    file: str = Field(description="the file that holds the records by now")
    runs: int = Field(description="the runs in it")
    records: int = Field(description="the records in it, every hash of which was recomputed")
    chain_sha256: str = Field(description="the hash of the last one")
    added: list[str] = Field(description="the ids of the runs that were not there before, with `restore` and `merge`")
    unfinished: list[str] = Field(
        description="the ids of the runs without an end, which were being recorded when the backup was begun, or were cut off; "
        "`merge` leaves them out"
    )
    aside: str | None = Field(description="the file that keeps the records that were there before, with `restore --replace`")


class RunSigned(JsonObject):
    """The signature of a run over its id and its `chain_sha256`; docs/evidence.md tells what exactly is signed."""

    algorithm: str = Field(description="Ed25519")
    public_key: str = Field(description="the public key, 64 hexadecimal digits")
    signature: str = Field(description="the signature, 128 hexadecimal digits")
    key_id: str = Field(description="what the key is called: the first 16 digits of the SHA-256 of the public key")


class MachineAnswered(JsonObject):
    """Whether the machine was told the verdict that it asked for."""

    request: int | None = Field(description="the number of its request; null where it told none")
    sent: bool = Field(description="whether the answer stood in its file, read back; it changes no verdict")
    verdict: VerdictName | None = Field(description="what it was told: uncertain where the run broke off; null where it was told nothing")
    at: str = Field(description="when it was sent, or could not be, in UTC")
    problem: str | None = Field(description="why it was not sent; null where it was")


class AnswerKept(MachineAnswered):
    """The answer to the machine as it is on record."""

    text: str | None = Field(description="the whole answer as it was written, or was to be; null where nothing was to be written")
    chain_sha256: str = Field(description="the hash of the record that keeps it")


class AnchorTold(JsonObject):
    """A place outside the computer that was to be told how the run ended."""

    place: str = Field(description="the file, or the address of the authority that was asked for a time stamp")
    problem: str = Field(description="what kept it from being told, empty where nothing did; it is then told at the next run")


class RunOrigin(JsonObject):
    """Where a run was taken over from by `merge`."""

    file: str = Field(description="the name of the file that it was read from")
    first: int = Field(description="the number of its first record there")
    records: int = Field(description="how many records it has, from the first to its end")
    previous: str = Field(description="the hash of the record before it there")
    chain_sha256: str = Field(description="the hash of its end there, which its result files name")
    merged: str = Field(description="when it was taken over, in UTC")


class SettingChanged(JsonObject):
    """A value of the plan that is not as it was in the recorded run."""

    key: str = Field(description="the key, dotted")
    recorded: Any = Field(description="its value in the recorded run")
    replayed: Any = Field(description="its value when the run was judged again")


class JudgedAgain(JsonObject):
    """What a run was found to be when it was judged again with something changed."""

    when: str = Field(description="when that was, in UTC")
    who: str = Field(description="who did it")
    why: str = Field(description="the reason that was given")
    changed: list[SettingChanged] = Field(description="what is not as in the plan of the run")
    verdict: VerdictName | None = Field(description="the verdict that came of it")
    chain_sha256: str = Field(description="the hash of the record that keeps it")


class JudgementKept(JsonObject):
    """Where a judgement stands in the records."""

    when: str = Field(description="when it was made, in UTC")
    who: str = Field(description="who made it")
    why: str = Field(description="the reason that was given")
    record: int = Field(description="the number of the record that keeps it")
    chain_sha256: str = Field(description="the hash of that record")


class Alteration(JsonObject):
    """The first record that is not as it was written."""

    number: int = Field(description="its number in the chain")
    run: str = Field(description="the run that it belongs to, empty where that is not known")
    kind: str = Field(description="what it holds, like points or result")
    problem: str = Field(description="what is wrong with it")
    message: str = Field(description="all of this in one sentence")


class Against(JsonObject):
    """What came of holding a result file against the records."""

    run: str = Field(description="the run that the result file names")
    disagreements: list[str] = Field(description="what the two say differently, in words; empty where they agree")
    taken_over: bool = Field(
        description="whether the result was written at another station, which the run was merged from: then it covers that run alone"
    )


class KeySigned(JsonObject):
    """A key that runs were signed with."""

    key_id: str = Field(description="what the key is called")
    public_key: str = Field(description="the public key, 64 hexadecimal digits")
    runs: int = Field(description="how many of the runs it signed, or something that was added to them later")
    known_as: Literal["given", "station", "handed over", "another", "evidence"] = Field(
        description="from where it is known: given with `--key`; the station's own; an earlier or later one of the station; another than "
        "those that are known; or evidence: the evidence itself names it, and there is nothing to compare it with"
    )


class Signatures(JsonObject):
    """Who signed the runs."""

    signed: int = Field(description="how many runs are signed, with all that was added to them later")
    unsigned: list[str] = Field(description="the ids of the runs that are not, or to which something was added later that nobody signed")
    keys: list[KeySigned] = Field(description="the keys")


class Anchored(JsonObject):
    """What anchors say of the records."""

    heads: int = Field(description="how many heads in them belong to these records")
    missing: list[str] = Field(description="the runs whose heads they hold and which are not in the records")
    last: str | None = Field(description="the last run whose head agrees; what was recorded later is not covered")
    others: dict[str, int] = Field(description="how many heads of other stations they hold, by the name of the station")


class Stamped(JsonObject):
    """A time stamp by RFC 3161; `openssl ts -verify` shows whether its authority made it."""

    run: str = Field(description="the run whose end was stamped")
    chain_sha256: str = Field(description="the hash that was stamped")
    stamped: str = Field(description="when, as the authority says, in UTC")


class KeyShown(JsonObject):
    """The answer of `key new`, and the beginning of that of `key show`."""

    key_id: str = Field(description="what the key is called: the first 16 digits of the SHA-256 of the public key")
    public_key: str = Field(description="the public key, 64 hexadecimal digits")
    file: str = Field(description="the file of the key: of `show` the public one, of `new` the private one")


class KeyHandedOver(JsonObject):
    """A key that was handed over to another, and the answer of `key rotate`."""

    before: str = Field(description="the public key of before")
    after: str = Field(description="the public key since then")
    when: str = Field(description="when that was, in UTC")
    who: str = Field(description="who did it")
    why: str = Field(description="the reason that was given")
    signed_before: str = Field(description="the signature of the key of before")
    signed_after: str = Field(description="the signature of the key since then")


class StationKey(KeyShown):
    """The answer of `key show`."""

    handovers: list[KeyHandedOver] = Field(description="the keys that were handed over, oldest first")


class Verified(JsonObject):
    """The answer of `verify`."""

    altered: bool = Field(description="whether anything was altered or cut off")
    run: str | None = Field(description="the run that was asked for; null: all records")
    records: int = Field(description="the number of sound records")
    chain_sha256: str = Field(description="the hash of the last sound record, of one run that of its end")
    first: Alteration | None = Field(description="the first record that was altered")
    state: Literal["intact and signed", "signed by another key", "intact but unsigned", "altered", "cut off"] = Field(
        description="what the records are: of several runs the least that is proven"
    )
    signatures: Signatures | None = Field(description="who signed the runs; null where something was altered")
    anchors: Anchored | None = Field(description="with `--anchors`: what they say of these records")
    timestamps: list[Stamped] = Field(description="the time stamps of the runs")
    against: Against | None = Field(default=None, description="with `--against`: whether the result file and the records agree")
