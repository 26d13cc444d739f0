"""The keys of what an archive that was judged again gives: their types and what they mean. The objects are made in the command."""

from typing import Literal

from pydantic import Field

from cmmlink.inspection_keys import JsonObject


class RunRejudged(JsonObject):
    """A run of an archive, and what it is by the changed plan."""

    run: str = Field(description="the id of the run; of a stack of sections that has characteristics, which is a row of its own, its id")
    measured_at: str | None = Field(description="when it began, in UTC")
    part: str | None = Field(description="the name of the part")
    serial_number: str | None = Field(description="its serial number")
    section: str = Field(description="of a section of a surface, which one it is; else empty")
    recorded: str = Field(description="its headline on record, like CONFORM; of a stack that which follows from its sections")
    again: str = Field(description="its headline by the changed plan; empty where it could not be judged")
    changed: bool = Field(description="whether its verdict is another one")
    characteristics: list[str] = Field(
        description="the characteristics whose verdict is another one, each with both; of a stack its sections count as one more"
    )
    out_of_tolerance_recorded: int | None = Field(description="the points out of tolerance on record")
    out_of_tolerance: int | None = Field(description="the points out of tolerance by the changed plan")
    min_deviation_mm: float | None = Field(description="the smallest deviation by the changed plan")
    max_deviation_mm: float | None = Field(description="the largest deviation")
    profile_error_mm: float | None = Field(description="2 * max |deviation|")
    reason: str = Field(description="why its verdict is what it is: the most important reason")
    state: Literal["judged", "known", "failed"] = Field(description="judged now; known, by a judgement on record; or failed")
    kept: bool = Field(description="whether the judgement is on record")
    problem: str = Field(description="why it could not be judged again; else empty")


class ArchiveRejudged(JsonObject):
    """The answer of `rejudge`."""

    exit_status: int = Field(description="the worst of the exit statuses: 5, then 1, 4, 2, 3 and 0")
    archive: str = Field(description="the archive, as it was named")
    settings: dict[str, str] = Field(description="the keys of the plans that were changed, each with what was set")
    changed: int = Field(description="how many runs have another verdict")
    failed: int = Field(description="how many could not be judged again")
    left: int = Field(description="how many are left, because it was stopped")
    runs: list[RunRejudged] = Field(description="the runs that are done, in the order of the archive")
