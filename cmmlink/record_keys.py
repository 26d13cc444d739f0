"""The keys of what is said of the records themselves: of backups, of merging, and of where a run comes from."""

from pydantic import Field

from cmmlink.inspection_keys import JsonObject


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
