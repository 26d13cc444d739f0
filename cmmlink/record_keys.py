"""The keys of what is said of the records themselves: of backups, of merging, and of where a run comes from."""

from typing import Any

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
