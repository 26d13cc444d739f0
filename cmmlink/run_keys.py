"""The keys that every run has beside what was found of it: how it ended, what ties it to its record, how a replay compares with it.

They stand beside the keys of a section (cmmlink.result_keys) and beside those of a whole surface (cmmlink.surface_keys).
"""

from typing import Any

from pydantic import Field

from cmmlink.events import Ending
from cmmlink.inspection_keys import JsonObject, QualificationNamed
from cmmlink.record_keys import AnchorTold, JudgementKept, MachineAnswered, RunSigned
from cmmlink.version import ResultSchema

SCHEMA = "the version of these keys, in which none goes or changes its meaning, but keys may be added; docs/result.schema.json describes it"


class MachineTold(MachineAnswered):
    """Whether the machine was told the verdict that it asked for, and whether that is on record."""

    unrecorded: str | None = Field(
        description="why the records of the run do not hold this; null where they do, and where the run itself is not recorded"
    )


class OfRun(JsonObject):
    """How a run ended, what was measured, by whom and with what."""

    schema_urn: ResultSchema = Field(alias="schema", description=SCHEMA)
    measured_at: str = Field(description="when the run began, in UTC, like 2026-03-14T15:09:26.000Z")
    ending: Ending = Field(description="how the run ended; aborted by the operator (then the verdict is uncertain), or interrupted")
    part: str = Field(description="the name of the part")
    serial_number: str | None = Field(description="the serial number of the part")
    operator: str | None = Field(description="who measured")
    device: str = Field(description="the device or file that the points came from")
    simulated: bool = Field(description="whether the device was a simulated one: no real part was measured")
    qualification: QualificationNamed | None = Field(description="the last qualification of the installation; null where none was made")
    notes: list[str] = Field(description="what was assumed about the nominal and the points: unit, columns, gaps, rows left out, density")
    answer: MachineTold | None = Field(default=None, description="the answer to the machine, where the plan names a file for it (`answer`)")


class OfRecord(JsonObject):
    """What ties a result to its record."""

    run: str = Field(description="the id of the recorded run")
    chain_sha256: str = Field(description="the hash of the run's end, which follows from every record before it")
    plan_sha256: str = Field(description="the hash of the effective plan")
    nominal_sha256: str = Field(description="the hash of the nominal's file")
    software: dict[str, str] = Field(description="the versions of everything that the result depends on")
    signature: RunSigned | None = Field(description="the signature of the run; null where it is not signed, which a note explains")
    anchors: list[AnchorTold] = Field(description="the places of the plan's `records.anchor`, and whether each was told of the run")


class Change(JsonObject):
    """A value that is not as it was in the recorded run."""

    key: str = Field(description="the dotted key")
    recorded: Any = Field(description="its value in the recorded run")
    replayed: Any = Field(description="its value in the replay")


class OfReplay(JsonObject):
    """How the result of a replay compares with the recorded one."""

    schema_urn: ResultSchema = Field(alias="schema", description=SCHEMA)
    measured_at: str = Field(description="when the recorded run began, in UTC")
    ending: Ending = Field(description="how the recorded run ended")
    replay_of: str = Field(description="the id of the recorded run")
    chain_sha256: str = Field(description="the hash of the run's last record")
    identical: bool | None = Field(
        description="whether all of the recorded result is found again to the last bit; null where none was recorded"
    )
    result_sha256: str = Field(
        description="the SHA-256 of the result and of every point's deviation, foot, station and verdict, to the last bit; where the "
        "replay is identical it is the one that the run's end keeps"
    )
    same_decision: bool | None = Field(
        description="whether the same was decided of the part, every characteristic and every point; null where no result was recorded"
    )
    apart: float | None = Field(
        description="how far a deviation, or the value of a characteristic, lies from the recorded one at most, in its unit; 0 where the "
        "replay is identical, null where a point or a value is missing in one of the two"
    )
    decision_sha256: str = Field(
        description="the SHA-256 of what was decided: verdict, counts of points, kinds of the reasons, the verdict of every "
        "characteristic, and the verdict and rejection of every point; the same on every processor where the decision is the same"
    )
    changed: list[Change] = Field(description="the settings and software that are not those of the recorded run")
    differs: list[Change] = Field(description="what of the result is not as recorded")
    derived: JudgementKept | None = Field(default=None, description="with `--reason`: where this judgement is kept")
    notes: list[str] = Field(description="what was assumed about the nominal and the points when they were recorded, and their density")
